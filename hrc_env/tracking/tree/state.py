"""The state of the default estimator, as records declared in one place.

The joints of a body share their errors: with one view the depth of all of them is wrong together.
So the whole body is one Gaussian whose dependencies are the kinematic tree's (`gaussian`), and a
worker is a few such hypotheses. `predict` moves them, `update` conditions them on a frame,
`evidence` weighs them.
"""

from typing import Any, NamedTuple

import numpy as np

from hrc_env.core.skeleton import BONE_LENGTH_M, BONES, JOINT, N_JOINTS
from hrc_env.core.typing import Floats, Ints
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.tree.gaussian import EDGE_BONE, ROOT

LANES = 16
"""Columns: joints, and one that is nobody's."""
N_POINT = 9
"""x, y, z [m]; then 00, 11, 22, 01, 02, 12 of the prior's position covariance [m^2]."""
N_VIEW = 3
"""u, v [px], precision [1/px^2]; 0 stands for what was not measured."""
N_IMAGE = 12
"""Belief; logarithm and factor of its odds; Jacobian of u, of v [px/m]; residuals [px]; reciprocal
of the depth [1/m], 0 for a joint that has no usable pixel."""
N_SUM = 9
"""Information 00, 11, 22, 01, 02, 12 [1/m^2], then gradient [1/m]."""
STANDING_M: Floats = np.array(
    [
        (0.12, 0.00, 0.42),
        (0.00, 0.18, 0.25), (0.00, -0.18, 0.25),
        (0.00, 0.24, -0.02), (0.00, -0.24, -0.02),
        (0.08, 0.25, -0.27), (0.08, -0.25, -0.27),
        (0.00, 0.11, -0.25), (0.00, -0.11, -0.25),
        (0.02, 0.11, -0.67), (0.02, -0.11, -0.67),
        (0.00, 0.11, -1.08), (0.00, -0.11, -1.08),
        (0.14, 0.11, -1.14), (0.14, -0.11, -1.14),
    ]
)  # fmt: skip
"""Joints of a standing adult from the middle of the torso [m]: forward, left, up."""
STANDING_COUNT = 5.0
"""Updates that the standing body's offsets are worth before any was learnt."""
N_SUMS = 5
"""Fading sums of the residuals' squares, redundancy, products with the last ones and the squares
of these; and, at the first joint and camera, whose turn it is."""
POPULATION_SHARE = 0.10
"""Standard deviation of a bone's length over people, as a share of it."""
STIFFNESS_M: Floats = np.where(np.any(JOINT["nose"] == BONES, axis=-1), 0.05, 0.02)
"""How much a distance changes in one person [m]: the head turns on its neck."""
EDGE_STIFFNESS_M = tuple(
    0.0 if j == ROOT else float(STIFFNESS_M[k]) for j, k in enumerate(EDGE_BONE)
)
"""The same of the edges of the tree; the root's: 0."""
PAIR = np.dtype(
    [
        # the two cameras; information and score of their turns
        ("cameras", "i8", (2,)), ("information", "f8", (6, 6)), ("score", "f8", (6,)),
        # the turns about the world's axes [rad], their covariance
        ("turn", "f8", (6,)), ("turn_cov", "f8", (6, 6)),
        # share of the last updates in which lines met; whether the two count as turned; updates in
        # which they saw somebody whom nobody follows
        ("fits", "f8"), ("askew", "?"), ("waited", "i8"),
    ],
    align=True,
)  # fmt: skip
"""What is remembered of two cameras that alone see a worker."""
_J = N_JOINTS
TREE = np.dtype(
    [
        # mean position [m] and velocity [m/s] in the world, marginal covariances, slopes on parents
        ("body", "f8", (_J, 6)), ("cov", "f8", (_J, 6, 6)), ("slope", "f8", (_J, 6, 6)),
        # since a measurement supported the joint [s]; updates in a row in which views did not
        ("age_s", "f8", (_J,)), ("conflict", "i8", (_J,)), ("tracked", "?"),
        # of who is not tracked: updates in which one view alone has shown somebody; of who is: how
        # much larger and farther off, as a share, the body that one view has begun may be, or 0
        ("waited", "i8"), ("size_std", "f8"),
        # the two cameras that alone see the body; how far off it may be for what is known of their
        # turns, as a whole [m^2]
        ("pair", PAIR), ("displaced_m2", "f8", (3, 3)),
        # mean place on the body [m]: forward, left, up of the torso; updates that went into it
        ("offset", "f8", (_J, 3)), ("offset_count", "f8", (_J,)),
        # from each joint to its parent [m], [m^2]
        ("bone_length", "f8", (_J,)), ("bone_variance", "f8", (_J,)),
        # log-probability of the hypothesis; of its pose, by `anatomy`, a part of that
        ("log_weight", "f8"), ("pose_log_prior", "f8"),
    ],
    align=True,
)  # fmt: skip
"""The Gaussian of one hypothesis about one worker, and what it has learnt of them."""
VIEW = np.dtype(
    [
        # probability that the camera exchanges left and right
        ("swap_chance", "f8"),
        # updates since it saw the worker; for which it is still not asked about swaps
        ("blind", "i8"), ("believed", "i8"),
    ],
    align=True,
)  # fmt: skip
"""What a hypothesis holds of one camera."""
NOISE = np.dtype(
    [
        # learnt factor on the variance that the detector reports; what it is learnt from
        ("factor", "f8"), ("sums", "f8", (N_SUMS,)),
        # last residuals in reported standard deviations, fading; 0: none
        ("last", "f8", (2,)),
    ],
    align=True,
)  # fmt: skip
"""What a hypothesis holds of one joint in one camera, as in `learning`."""
PACE = np.dtype(
    [
        # directions in the last update, of the line across hips and shoulders on the floor, and of
        # the trunk; time since then [s]; whether there are any
        ("across", "f8", 2), ("up", "f8", 3), ("since_s", "f8"), ("known", "?"),
        # rates of turning about the vertical and of tipping [rad/s], speed of the trunk [m/s], each
        # a mean over `pace.LASTS_S`
        ("turns", "f8"), ("tips", "f8"), ("travels", "f8"),
    ],
    align=True,
)  # fmt: skip
"""How a worker has moved lately."""
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
        # as in `search`
        ("points", "f8", (N_POINT, LANES)), ("image", "f8", (N_IMAGE, LANES)),
        ("sums", "f8", (N_SUM, LANES)),
        # for `learning`: where the cameras see a joint together, how lasting errors add up
        ("spread", "f8", (3, 4)), ("grows", "f8", (_J,)),
        # cameras that measured a joint; variances of the bones' lengths as measurements [m^2]
        ("n_views", "i8", (_J,)), ("bone_variance", "f8", (_J,)),
        # places on the body that are not learnt; covariances before the update, for `learning`;
        # joints that were put somewhere
        ("offset", "f8", (_J, 3)), ("offset_count", "f8", (_J,)),
        ("predicted", "f8", (_J, 3, 3)), ("placed", "i1", (_J,)),
        # axes of the torso, of a body upright; a place on the body [m]
        ("axes", "f8", (2, 3, 3)), ("place", "f8", (3,)),
    ],
    align=True,
)  # fmt: skip


def population_edges() -> tuple[Floats, Floats]:
    """Lengths [m] from each joint to its parent and their variances [m^2], (J,); the root's: 1."""
    length = np.array([1.0 if k < 0 else BONE_LENGTH_M[k] for k in EDGE_BONE])
    return length, (POPULATION_SHARE * length) ** 2


def forget_trees(trees: Any, views: Any, noise: Any, ids: Ints, config: ParticleConfig) -> None:
    """Put environments `ids` of trees (B, W, H), and of what they hold of cameras, to the prior."""
    fresh = np.zeros((), TREE)
    fresh["body"][:, :3] = config.prior_mean_world
    fresh["cov"] = np.eye(6)
    fresh["cov"][:, :3, :3] = config.prior_std_m**2 * np.eye(3)
    fresh["age_s"] = config.max_age_s
    fresh["offset"], fresh["offset_count"] = STANDING_M, STANDING_COUNT
    fresh["bone_length"], fresh["bone_variance"] = population_edges()
    trees[ids] = fresh
    views[ids] = np.array((config.swap_begins, 0, 0), VIEW)
    factor = np.clip(1.0, *config.noise_bounds)  # the detector is believed
    noise[ids] = np.array((factor, np.zeros(N_SUMS), np.zeros(2)), NOISE)


class Hypotheses(NamedTuple):
    """Hypotheses about each worker; arrays changed in place."""

    trees: Any
    """(B, W, H) records of `TREE`; log-weights of those in use sum to one."""
    views: Any
    """(B, W, H, C) records of `VIEW`."""
    noise: Any
    """(B, W, H, J, C) records of `NOISE`."""
    n_alive: Ints
    """(B, W) slots in use, at least one."""
    waited_s: Floats
    """(B, W) time since other hypotheses were looked for [s]."""
    pace: Any
    """(B, W) records of `PACE`."""
