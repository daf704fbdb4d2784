"""Scratch of one body's prediction and update: a record, made once for all bodies.

Fields of a record have sizes and places that the compiler knows, so that it sees what overlaps and
makes vector instructions of plain loops.
"""

import numpy as np

from hrc_env.core.skeleton import N_JOINTS
from hrc_env.tracking.tree.cameras import LANES, N_IMAGE, N_POINT, N_SUM

_J = N_JOINTS
WORK = np.dtype(
    [
        ("a", "f8", (6, 6)), ("b", "f8", (6, 6)), ("c", "f8", (6, 6)), ("d", "f8", (6, 6)),
        # covariance of a joint with its parent, and with the mean of the torso
        ("edge", "f8", (_J, 6, 6)), ("root", "f8", (_J, 6, 6)),
        # a moment later: covariance of a joint, and with its parent
        ("moved", "f8", (_J, 6, 6)), ("moved_edge", "f8", (_J, 6, 6)),
        # precision given the parent; times the slope; the slope's transpose times that
        ("own", "f8", (_J, 6, 6)), ("pull", "f8", (_J, 6, 6)), ("back", "f8", (_J, 6, 6)),
        # what cameras and subtree say of a joint; inverse Hessian given the parent
        ("known", "f8", (_J, 6, 6)), ("inverse", "f8", (_J, 6, 6)),
        # change of the means; what they are pulled by
        ("step", "f8", (_J, 6)), ("gradient", "f8", (_J, 6)),
        # of positions alone: precision given the parent's, slope on it, the two products as above
        ("precision", "f8", (_J, 3, 3)), ("follow", "f8", (_J, 3, 3)),
        ("pull_position", "f8", (_J, 3, 3)), ("back_position", "f8", (_J, 3, 3)),
        # inverse Hessian of a position given its parent's; what cameras and subtree say of it
        ("inverse_position", "f8", (_J, 3, 3)),
        ("node", "f8", (_J, 3, 3)), ("node_gradient", "f8", (_J, 3)),
        # where the likelihood is linearised [m], and how far that is from the predicted mean
        ("point", "f8", (_J, 3)), ("shift", "f8", (_J, 3)),
        # cameras' log-likelihood as a function of shifts, at none: [1/m^2] and [1/m]
        ("camera_information", "f8", (_J, 3, 3)), ("camera_gradient", "f8", (_J, 3)),
        # the same of the bones', of x_j - x_parent; of no meaning at the root
        ("edge_information", "f8", (_J, 3, 3)), ("edge_gradient", "f8", (_J, 3)),
        # as in `tree.cameras`
        ("points", "f8", (N_POINT, LANES)), ("image", "f8", (N_IMAGE, LANES)),
        ("sums", "f8", (N_SUM, LANES)),
        # for `models.noise`: where the cameras see a joint together, how lasting errors add up
        ("spread", "f8", (3, 4)), ("grows", "f8", (_J,)),
        # cameras that measured a joint; variances of the bones' lengths as measurements [m^2]
        ("n_views", "i8", (_J,)), ("bone_variance", "f8", (_J,)),
        # places on the body that are not learnt; covariances before the update, for `models.noise`;
        # joints that were put somewhere
        ("offset", "f8", (_J, 3)), ("offset_count", "f8", (_J,)),
        ("predicted", "f8", (_J, 3, 3)), ("placed", "i1", (_J,)),
        # axes of the torso, of a body upright; a place on the body [m]
        ("axes", "f8", (2, 3, 3)), ("place", "f8", (3,)),
    ],
    align=True,
)  # fmt: skip
