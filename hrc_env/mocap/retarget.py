"""A recording to a clip for a worker, and how far their joints are apart then.

Ways scale with the legs; trunk, arms and head keep their directions and take the worker's lengths.
Then damped least squares find each frame's control vector. What 15 joints do not tell is held near
what people do and near the frames before and after.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from hrc_env.core.skeleton import JOINT, JOINTS
from hrc_env.core.typing import Bools, Floats, Points3
from hrc_env.mocap.guess import PELVIS_SHARE, first_guess
from hrc_env.mocap.person import across, legs, middle, smoothed
from hrc_env.mocap.poses import Marks, joints_in, marks_of
from hrc_env.mocap.record import Capture
from hrc_env.mocap.stance import locked, slip
from hrc_env.motion import controls as c
from hrc_env.motion.clip import Clip, move_to_origin
from hrc_env.worker.body import Body, load_body

STILL_M_S, LOW_SHARE = 0.15, 40.0
"""An ankle slower than this [m/s] and below this percentile of its heights stands."""
Say: TypeAlias = Callable[[float], None]
"""Told by how much the share that is done grew."""
ROUNDS, FRAMES = 12, 256
"""Steps of the fit; after eight it changes by less than a millimetre; frames done together."""
STEP, FARTHEST = 1e-4, 0.25
"""Step of the difference quotients; most that a column changes in a round [m or rad]."""
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
"""The same of every other column."""
FITTED = np.array(
    [c.ROOT_X, c.ROOT_Y, *range(c.PELVIS_Z, c.N_BLENDED)]
    + [c.ANKLE + 6 * side + k for side in range(2) for k in range(5)]
)
"""Columns that are fitted: of those that a clip has, all but the heading and the toes."""


@dataclass(frozen=True, slots=True)
class RetargetError:
    """How far the worker's joints are from the person's, in the worker's size."""

    mean_m: Floats
    """(15,) over the frames [m]."""
    p95_m: Floats
    """(15,) 95th percentile over the frames [m]."""
    scale: float
    """The worker's size beside the person's."""
    slip_m_s: float
    """95th percentile of the speed of the balls of standing feet [m/s]; NaN: none stands."""


def retarget(
    capture: Capture, body: Body | str = "worker_1", say: Say = lambda share: None
) -> tuple[Clip, RetargetError]:
    """Fit a worker's body to a recorded person, so that workers can do what the person did.

    Args:
        capture: the recording, as of `read_recording`.
        body: the worker, or a name; others play the clip, too, scaled to their legs and arms.
        say: called with the share of the work that is done.

    Returns:
        The clip, and the distances of the worker's joints from the person's [m].

    Raises:
        ConfigError: there is no worker of that name.
    """
    body = load_body(body) if isinstance(body, str) else body
    marks = marks_of(body, capture.landmarks)
    target = adapted(capture.joints_world, capture.fps, marks)
    size = marks.anatomy.lengths
    poses = fitted(target, capture.fps, marks, say)
    controls, contacts = locked(poses, capture.fps, size)
    done = joints_in(controls, marks)
    scale, apart = aligned_errors(capture.joints_world, done)
    slips = slip(controls, contacts, capture.fps, marks.anatomy)
    error = RetargetError(
        apart.mean(0), np.percentile(apart, 95, axis=0), scale,
        float(np.percentile(slips, 95)) if len(slips) else float("nan"),
    )  # fmt: skip
    clip = Clip(move_to_origin(controls), capture.fps, contacts, size, capture.source)
    return clip, error


def aligned_errors(source: Points3, done: Points3) -> tuple[float, Floats]:
    """Scale of, and distances (T, 15) after, the best similarity of the whole recording: Umeyama,
    IEEE PAMI 13(4), 1991."""
    a, b = source.reshape(-1, 3), done.reshape(-1, 3)
    a0, b0 = a - a.mean(0), b - b.mean(0)
    u, s, vt = np.linalg.svd(b0.T @ a0)
    s[2] *= np.sign(np.linalg.det(u) * np.linalg.det(vt))
    rotation = (u * [1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    scale = float(s.sum() / (a0**2).sum())
    moved = scale * a0 @ rotation.T
    return scale, np.linalg.norm(moved - b0, axis=-1).reshape(source.shape[:2])


def adapted(joints: Points3, fps: float, marks: Marks) -> Points3:
    """(T, 15, 3) where the worker's joints should be [m]."""
    standing = [_standing(joints[:, JOINT[f"{side}_ankle"]], fps) for side in ("left", "right")]
    scaled = legs(marks.rest[None]) / legs(joints) * joints
    scaled[..., 2] += marks.rest[JOINT["left_ankle"], 2] - np.mean(
        [np.median(scaled[on, JOINT[f"{side}_ankle"], 2])
         for side, on in zip(("left", "right"), standing, strict=True)]
    )  # fmt: skip
    target, rest = scaled.copy(), marks.rest
    _pair(target, "hip", middle(scaled, "hip"), scaled, rest)
    trunk = middle(rest, "shoulder") - middle(rest, "hip")
    way = middle(scaled, "shoulder") - middle(scaled, "hip")
    stretched = way * (np.linalg.norm(trunk) / np.median(np.linalg.norm(way, axis=-1)))
    _pair(target, "shoulder", middle(scaled, "hip") + stretched, scaled, rest)
    nose = rest[0] - middle(rest, "shoulder")
    target[:, 0] = middle(target, "shoulder") + _along(
        scaled[:, 0] - middle(scaled, "shoulder"), float(np.linalg.norm(nose))
    )
    for side, on in zip(("left_", "right_"), standing, strict=True):
        for first, second in (("shoulder", "elbow"), ("elbow", "wrist")):
            a, b = JOINT[side + first], JOINT[side + second]
            reach = float(np.linalg.norm(rest[b] - rest[a]))
            target[:, b] = target[:, a] + _along(scaled[:, b] - scaled[:, a], reach)
        a, b = JOINT[side + "ankle"], JOINT[side + "foot"]
        target[:, b] = target[:, a] + _foot_way(scaled[:, b] - scaled[:, a], on, rest[b] - rest[a])
    return target


def _pair(target: Points3, part: str, centre: Points3, source: Points3, rest: Points3) -> None:
    """Set a pair of joints round its middle, along the person's axis, as wide as the worker."""
    half = 0.5 * _along(across(source, part), float(np.linalg.norm(across(rest, part))))
    target[:, JOINT[f"left_{part}"]] = centre + half
    target[:, JOINT[f"right_{part}"]] = centre - half


def _along(way: Points3, metres: float) -> Points3:
    """Vectors of the same direction and another length."""
    return way * (metres / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-9))


def _standing(ankle: Points3, fps: float) -> Bools:
    """(T,) frames in which an ankle stands on the floor; at least the lowest ones."""
    speed = np.linalg.norm(np.gradient(ankle, 1.0 / fps, axis=0), axis=-1)
    low = ankle[:, 2] <= np.percentile(ankle[:, 2], LOW_SHARE)
    still = low & (speed < STILL_M_S)
    return still if still.sum() >= 3 else ankle[:, 2] <= np.percentile(ankle[:, 2], 5.0)


def _foot_way(way: Points3, standing: Bools, rest: Floats) -> Points3:
    """(T, 3) ankle to foot tip: as the person's, but flat where they stand flat."""
    level = np.hypot(way[:, 0], way[:, 1])
    pitch = np.arctan2(way[:, 2], level)
    flat = np.arctan2(rest[2], np.hypot(rest[0], rest[1]))
    pitch += flat - np.median(pitch[standing])
    heading = way[:, :2] / np.maximum(level, 1e-9)[:, None]
    metres = float(np.linalg.norm(rest))
    return metres * np.column_stack([np.cos(pitch)[:, None] * heading, np.sin(pitch)])


def fitted(joints: Points3, fps: float, marks: Marks, say: Say = lambda share: None) -> Floats:
    """(T, N_CONTROLS) the poses of a worker whose joints (T, 15, 3) should be there."""
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
