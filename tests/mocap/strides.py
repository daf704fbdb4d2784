"""Ten people who walk, each in a gait of their own, of whom nobody ever stands on both feet."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from written import ORDERS, Y_UP, write_acclaim, write_bvh

from benchmarks.tracking.walks import Gait, walk
from hrc_env.core.skeleton import JOINTS
from hrc_env.core.typing import Floats, Points3, Rotations
from hrc_env.mocap.poses import locate_joints, make_marks, pose_segments
from hrc_env.mocap.record import Capture
from hrc_env.mocap.retarget import retarget
from hrc_env.worker.body import Body, load_body, worker_names

FPS = 25.0
N_STRIDES = 10
FORMS = ("npz", "bvh", "amc")


class Stride(NamedTuple):
    """A walk of 2 to 4 s."""

    body: Body
    position: Points3
    """(T, 22, 3) origins of the body's segments [m]."""
    rotation: Rotations
    """(T, 22, 3, 3)."""
    joints: Points3
    """(T, 15, 3) as BlazePose means them [m]."""


def stride(seed: int) -> Stride:
    """A walker whose body and gait depend on the seed."""
    rng = np.random.default_rng(seed)
    speed = rng.uniform(0.8, 1.6)
    gait = Gait(
        (speed - 0.1, speed, speed + 0.1), rng.uniform(0.6, 0.8), rng.uniform(0.35, 0.5),
        rng.uniform(0.45, 0.7), rng.uniform(0.2, 0.6),
    )  # fmt: skip
    joints = walk((4.0, 4.0), [seed], int(rng.uniform(2.0, 4.0) * FPS), gait)[:, 0]
    body = load_body(worker_names()[seed % len(worker_names())])
    return stride_of(
        retarget(Capture(joints, FPS, True, JOINTS, f"walk {seed}"), body)[0].controls, body
    )


def stride_of(controls: Floats, body: Body) -> Stride:
    """Poses (T, N_CONTROLS) of a body as a recording has them."""
    marks = make_marks(body, landmarks=True)
    position, _, rotation = pose_segments(controls, marks.anatomy)
    return Stride(body, position, rotation, locate_joints(controls, marks))


def written_as(form: str, walked: Stride, folder: Path, seed: int = 0) -> Path:
    """The recording as a file of one of FORMS; units, axes and orders of angles vary with the
    seed."""
    if form == "npz":
        np.savez(folder / "walk.npz", joints=walked.joints, fps=FPS)
        return folder / "walk.npz"
    if form == "amc":
        return write_acclaim(folder, walked.position, walked.rotation, walked.body)
    unit_m, axes = (1.0, 0.01, 0.0254)[seed % 3], (None, Y_UP)[seed % 2]
    return write_bvh(
        folder / "walk.bvh", walked.position, walked.rotation, FPS, unit_m, axes,
        (ORDERS[seed % len(ORDERS)],), rest_first=seed % 4 == 3, body=walked.body,
    )  # fmt: skip
