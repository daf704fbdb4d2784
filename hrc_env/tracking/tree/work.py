"""Scratch of one body's prediction and update, made once for all bodies."""

from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Ints
from hrc_env.tracking.tree.lanes import LANES, N_JOINT_ROWS, N_SUM_ROWS, N_VIEW_ROWS
from hrc_env.tracking.tree.quads import QUAD, QUADS


class Work(NamedTuple):
    """Scratch of one body's prediction and update."""

    a: Floats
    b: Floats
    c: Floats
    d: Floats
    """Four times (6, 6)."""
    step: Floats
    """(J, 6) change of the mean."""
    gradient: Floats
    """(J, 6) what the means are pulled by."""
    camera_information: Floats
    """(J, 3, 3) [1/m^2]."""
    camera_gradient: Floats
    """(J, 3) [1/m]."""
    edge_information: Floats
    """(J, 3, 3) what bones say of x_j - x_parent [1/m^2]; 0 at the root."""
    edge_gradient: Floats
    """(J, 3) [1/m]."""
    point: Floats
    """(J, 3) where the cameras are linearised [m]."""
    rows: Floats
    """The joints' matrices, as in `quads`."""
    joints: Floats
    """Positions and their covariances in rows of `lanes`."""
    seen: Floats
    """One camera's rows of `lanes`."""
    sums: Floats
    """All cameras' rows of `lanes`."""
    views: Floats
    """(C, 3 rows) measurements in rows of `lanes`."""
    looks: Floats
    """(C, 8) what each camera says of one joint, for `models.noise`."""
    spread: Floats
    """(3, 4) where the cameras together see that joint, for the same."""
    grows: Floats
    """(J,) how errors that persist add up, for the same."""
    n_views: Ints
    """(J,) cameras that measured a joint."""


@kernel(makes_arrays=True)
def make_work(n_cameras):
    """Scratch with room for one body and its measurements, made inside a kernel."""
    return Work(
        a=np.empty((6, 6)),
        b=np.empty((6, 6)),
        c=np.empty((6, 6)),
        d=np.empty((6, 6)),
        step=np.empty((N_JOINTS, 6)),
        gradient=np.empty((N_JOINTS, 6)),
        camera_information=np.zeros((N_JOINTS, 3, 3)),
        camera_gradient=np.zeros((N_JOINTS, 3)),
        edge_information=np.zeros((N_JOINTS, 3, 3)),
        edge_gradient=np.zeros((N_JOINTS, 3)),
        point=np.empty((N_JOINTS, 3)),
        rows=np.zeros(QUADS * QUAD),
        joints=np.ones(N_JOINT_ROWS * LANES),
        seen=np.zeros(N_VIEW_ROWS * LANES),
        sums=np.zeros(N_SUM_ROWS * LANES),
        views=np.empty((n_cameras, 3 * LANES)),
        looks=np.empty((n_cameras, 8)),
        spread=np.empty((3, 4)),
        grows=np.empty(N_JOINTS),
        n_views=np.empty(N_JOINTS, np.int64),
    )
