"""The control vector whose pose comes nearest to given joints: damped least squares a frame.

What 15 joints do not tell (how a bow is shared between pelvis and spine, where the elbow of a
straight arm points) is held near what people do and near the frames before and after.
"""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from hrc_env.core.skeleton import JOINTS
from hrc_env.core.typing import Floats, Points3
from hrc_env.motion import controls as c
from hrc_env.motion.capture.guess import PELVIS_SHARE, first_guess
from hrc_env.motion.capture.marks import Marks, joints_in
from hrc_env.motion.capture.series import smoothed

Say: TypeAlias = Callable[[float], None]
"""Told by how much the share that is done grew."""
ROUNDS = 12
"""Steps of the fit; after eight it changes by less than a millimetre."""
FRAMES = 256
"""Frames that are worked on together: bounds the memory."""
STEP = 1e-4
"""Step of the difference quotients [m or rad]."""
FARTHEST = 0.25
"""A column changes by at most this in a round [m or rad]."""
SMOOTH_S = 0.05
"""Time over which neighbours pull [s]."""

WEIGHT: dict[str, float] = {
    "nose": 0.7, "shoulder": 1.0, "elbow": 1.0, "wrist": 1.5, "hip": 1.0, "knee": 0.5,
    "ankle": 3.0, "foot": 0.7,
}  # fmt: skip
"""What an error of a joint counts beside others; judgement: feet and hands touch things."""
PULL: dict[int, float] = {
    c.PELVIS_PITCH: 0.05, c.SPINE_FLEX: 0.02, c.PELVIS_ROLL: 0.01, c.SPINE_SIDE: 0.01,
    c.SPINE_TWIST: 0.01, c.PELVIS_YAW: 0.01, c.HEAD_PITCH: 0.01, c.HEAD_YAW: 0.01,
    c.SWIVEL: 0.01, c.SWIVEL + 1: 0.01,
}  # fmt: skip
"""How strongly a column is held near what is usual: metres of joint error that one rad is worth."""
SLIGHT = 1e-3
"""The pull on every other column [m per m or rad]."""
FITTED = np.array(
    [c.ROOT_X, c.ROOT_Y, *range(c.PELVIS_Z, c.N_BLENDED)]
    + [c.ANKLE + 6 * side + k for side in range(2) for k in range(5)]
)
"""Columns that are fitted: of those that a clip has, all but the heading and the toes."""


def fitted(joints: Points3, fps: float, marks: Marks, say: Say = lambda share: None) -> Floats:
    """(T, N_CONTROLS) the poses of a worker whose joints (T, 15, 3) should be there.

    `say` is told the share of the work that each part of it was.
    """
    q = first_guess(joints, fps, marks)
    weight = np.array([WEIGHT[joint.split("_")[-1]] for joint in JOINTS])[:, None]
    pull = np.array([PULL.get(int(column), SLIGHT) for column in FITTED])
    for _ in range(ROUNDS):
        usual = _usual(q, fps)
        for first in range(0, len(q), FRAMES):
            part = slice(first, first + FRAMES)
            _improve(q[part], joints[part], usual[part], weight, pull, marks)
            say(len(q[part]) / (len(q) * ROUNDS))
    return q


def _usual(q: Floats, fps: float) -> Floats:
    """(T, F) what the fitted columns are pulled to."""
    bow = q[:, c.PELVIS_PITCH] + q[:, c.SPINE_FLEX]
    near = smoothed(q, SMOOTH_S * fps)
    near[:, c.PELVIS_PITCH], near[:, c.SPINE_FLEX] = PELVIS_SHARE * bow, (1 - PELVIS_SHARE) * bow
    return near[:, FITTED]


def _improve(
    q: Floats, joints: Points3, usual: Floats, weight: Floats, pull: Floats, marks: Marks
) -> None:
    """One Gauss-Newton step of some frames, in place."""
    n, f = len(q), len(FITTED)
    moved = np.repeat(q[:, None], f + 1, axis=1)
    moved[:, np.arange(f) + 1, FITTED] += STEP
    placed = joints_in(moved.reshape(n * (f + 1), -1), marks).reshape(n, f + 1, *joints.shape[1:])
    slope = ((placed[:, 1:] - placed[:, :1]) / STEP * weight).reshape(n, f, -1)
    miss = ((joints - placed[:, 0]) * weight).reshape(n, -1, 1)
    left = slope @ np.swapaxes(slope, 1, 2) + np.diag(pull**2)
    held = (pull**2 * (usual - q[:, FITTED]))[..., None]
    change = np.linalg.solve(left, slope @ miss + held)[..., 0]
    q[:, FITTED] += np.clip(change, -FARTHEST, FARTHEST)
