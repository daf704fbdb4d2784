"""Retargeting of a recording to a clip of a worker, and evaluation of the remaining errors.

Paths scale with the legs; trunk, arms and head keep their directions, with the worker's lengths.
The control vector of each frame is fitted by damped least squares. Columns that the 15 joints do
not determine are regularized towards usual values and towards those of adjacent frames.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from hrc_env.core.skeleton import JOINT, JOINTS
from hrc_env.core.typing import Bools, Floats, Points3
from hrc_env.mocap.guess import PELVIS_SHARE, guess_controls
from hrc_env.mocap.person import measure_legs, midpoint, smooth, span
from hrc_env.mocap.poses import Marks, locate_joints, make_marks
from hrc_env.mocap.record import Capture
from hrc_env.mocap.stance import lock_feet, measure_slip
from hrc_env.motion import controls as c
from hrc_env.motion.clip import Clip, move_to_origin
from hrc_env.worker.body import Body, load_body

STILL_M_S = 0.15
"""Speed of an ankle below which the foot may stand on the floor [m/s]."""
LOW_SHARE = 40.0
"""Percentile of an ankle's heights below which the foot may stand on the floor."""
OnProgress: TypeAlias = Callable[[float], None]
"""Callback that receives each increase of the completed fraction of the work."""
ROUNDS = 12
"""Number of iterations of the fit; after eight it changes by less than a millimetre."""
FRAMES = 256
"""Number of frames fitted in one batch."""
STEP = 1e-4
"""Step of the finite differences [m or rad]."""
FARTHEST = 0.25
"""Maximum change of a column in one iteration [m or rad]."""
SMOOTH_S = 0.05
"""Standard deviation of the smoothing that yields the values for regularization [s]."""

WEIGHT: dict[str, float] = {
    "nose": 0.7,
    "shoulder": 1.0,
    "elbow": 1.0,
    "wrist": 1.5,
    "hip": 1.0,
    "knee": 0.5,
    "ankle": 3.0,
    "foot": 0.7,
}
"""Weight of the error of each joint.

The values are estimates, larger for feet and hands because these touch objects.
"""
PULL: dict[int, float] = {
    c.PELVIS_PITCH: 0.05,
    c.SPINE_FLEX: 0.02,
    c.PELVIS_ROLL: 0.01,
    c.SPINE_SIDE: 0.01,
    c.SPINE_TWIST: 0.01,
    c.PELVIS_YAW: 0.01,
    c.HEAD_PITCH: 0.01,
    c.HEAD_YAW: 0.01,
    c.SWIVEL: 0.01,
    c.SWIVEL + 1: 0.01,
}
"""Joint error equivalent to a unit deviation of a column from its usual value [m/rad]."""
SLIGHT = 1e-3
"""Value of `PULL` for all other columns [m/rad]."""
FITTED = np.array(
    [c.ROOT_X, c.ROOT_Y, *range(c.PELVIS_Z, c.N_BLENDED)]
    + [c.ANKLE + 6 * side + k for side in range(2) for k in range(5)]
)
"""Fitted columns: those of a clip except the heading and the toes."""


@dataclass(frozen=True, slots=True)
class RetargetError:
    """Distances between the worker's joints and the recorded ones, scaled to the worker's size."""

    mean_m: Floats
    """Mean distance (15,) over the frames [m]."""
    p95_m: Floats
    """95th percentile (15,) of the distance over the frames [m]."""
    scale: float
    """Size of the worker relative to the person."""
    slip_m_s: float
    """95th percentile of the speed of the balls of standing feet [m/s]; NaN if no foot stands."""


class Retargeted(NamedTuple):
    """A clip made from a recording."""

    clip: Clip
    """Clip of the worker."""
    error: RetargetError
    """Distances between the worker's joints and the recorded ones."""


class Alignment(NamedTuple):
    """Least-squares similarity transformation between two recordings."""

    scale: float
    """Size of the second recording, divided by that of the first."""
    distance_m: Floats
    """Distances (T, 15) between the joints after the transformation [m]."""


def retarget(
    capture: Capture,
    body: Body | str = "worker_1",
    on_progress: OnProgress = lambda share: None,
) -> Retargeted:
    """Convert a recording to a clip by fitting a worker's body to the recorded person.

    Args:
        capture: recording, from `read_recording`.
        body: body or name of a worker. The clip, scaled to their size, can be played by other
            workers, too.
        on_progress: called with each increase of the completed fraction of the work.

    Returns:
        The clip, and the distances between the worker's joints and the recorded ones [m].

    Raises:
        ConfigError: there is no worker of that name.
    """
    body = load_body(body) if isinstance(body, str) else body
    marks = make_marks(body, capture.are_landmarks)
    target = scale_joints(capture.joints_world, capture.fps, marks)
    size = marks.anatomy.lengths
    poses = fit_controls(target, capture.fps, marks, on_progress)
    controls, contacts = lock_feet(poses, capture.fps, size)
    done = locate_joints(controls, marks)
    scale, apart = align(capture.joints_world, done)
    slips = measure_slip(controls, contacts, capture.fps, marks.anatomy)
    slip_m_s = float(np.percentile(slips, 95)) if len(slips) else float("nan")
    error = RetargetError(apart.mean(0), np.percentile(apart, 95, axis=0), scale, slip_m_s)
    clip = Clip(move_to_origin(controls), capture.fps, contacts, size, capture.source)
    return Retargeted(clip, error)


def align(source: Points3, done: Points3) -> Alignment:
    """Return the least-squares similarity transformation between two recordings (T, 15, 3).

    The method is that of Umeyama, IEEE PAMI 13(4), 1991.
    """
    a, b = source.reshape(-1, 3), done.reshape(-1, 3)
    a0, b0 = a - a.mean(0), b - b.mean(0)
    u, s, vt = np.linalg.svd(b0.T @ a0)
    s[2] *= np.sign(np.linalg.det(u) * np.linalg.det(vt))
    rotation = (u * [1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    scale = float(s.sum() / (a0**2).sum())
    moved = scale * a0 @ rotation.T
    distance_m = np.linalg.norm(moved - b0, axis=-1).reshape(source.shape[:2])
    return Alignment(scale, distance_m)


def scale_joints(joints: Points3, fps: float, marks: Marks) -> Points3:
    """Return the desired positions (T, 15, 3) of the worker's joints [m].

    Args:
        joints: joints (T, 15, 3) of the person [m].
        fps: frame rate [Hz].
        marks: joints of the worker's body.
    """
    standing = [
        _find_standing(joints[:, JOINT[f"{side}_ankle"]], fps) for side in ("left", "right")
    ]
    scaled = measure_legs(marks.rest[None]) / measure_legs(joints) * joints
    heights = [
        np.median(scaled[on, JOINT[f"{side}_ankle"], 2])
        for side, on in zip(("left", "right"), standing, strict=True)
    ]
    scaled[..., 2] += marks.rest[JOINT["left_ankle"], 2] - np.mean(heights)
    target, rest = scaled.copy(), marks.rest
    _set_pair(target, "hip", midpoint(scaled, "hip"), scaled, rest)
    trunk = midpoint(rest, "shoulder") - midpoint(rest, "hip")
    way = midpoint(scaled, "shoulder") - midpoint(scaled, "hip")
    stretched = way * (np.linalg.norm(trunk) / np.median(np.linalg.norm(way, axis=-1)))
    _set_pair(target, "shoulder", midpoint(scaled, "hip") + stretched, scaled, rest)
    nose = rest[0] - midpoint(rest, "shoulder")
    target[:, 0] = midpoint(target, "shoulder") + _set_length(
        scaled[:, 0] - midpoint(scaled, "shoulder"), float(np.linalg.norm(nose))
    )
    for side, on in zip(("left_", "right_"), standing, strict=True):
        for first, second in (("shoulder", "elbow"), ("elbow", "wrist")):
            a, b = JOINT[side + first], JOINT[side + second]
            reach = float(np.linalg.norm(rest[b] - rest[a]))
            target[:, b] = target[:, a] + _set_length(scaled[:, b] - scaled[:, a], reach)
        a, b = JOINT[side + "ankle"], JOINT[side + "foot"]
        target[:, b] = target[:, a] + _adapt_foot(
            scaled[:, b] - scaled[:, a], on, rest[b] - rest[a]
        )
    return target


def _set_pair(target: Points3, part: str, centre: Points3, source: Points3, rest: Points3) -> None:
    """Place a pair of joints about its midpoint, along the person's axis, at the worker's width.

    Args:
        target: joints (T, 15, 3), which are changed.
        part: name of the pair.
        centre: midpoint (T, 3) of the pair.
        source: joints (T, 15, 3) that define the axis.
        rest: joints (15, 3) that define the width.
    """
    half = 0.5 * _set_length(span(source, part), float(np.linalg.norm(span(rest, part))))
    target[:, JOINT[f"left_{part}"]] = centre + half
    target[:, JOINT[f"right_{part}"]] = centre - half


def _set_length(way: Points3, metres: float) -> Points3:
    """Scale vectors to a given length [m]."""
    return way * (metres / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-9))


def _find_standing(ankle: Points3, fps: float) -> Bools:
    """Return a mask (T,) of the frames in which an ankle stands on the floor.

    With fewer than three such frames, return the lowest 5 % instead.
    """
    speed = np.linalg.norm(np.gradient(ankle, 1.0 / fps, axis=0), axis=-1)
    low = ankle[:, 2] <= np.percentile(ankle[:, 2], LOW_SHARE)
    still = low & (speed < STILL_M_S)
    return still if still.sum() >= 3 else ankle[:, 2] <= np.percentile(ankle[:, 2], 5.0)


def _adapt_foot(way: Points3, standing: Bools, rest: Floats) -> Points3:
    """Return the vector (T, 3) from ankle to foot tip, as for the person but flat in stance."""
    level = np.hypot(way[:, 0], way[:, 1])
    pitch = np.arctan2(way[:, 2], level)
    flat = np.arctan2(rest[2], np.hypot(rest[0], rest[1]))
    pitch += flat - np.median(pitch[standing])
    heading = way[:, :2] / np.maximum(level, 1e-9)[:, None]
    metres = float(np.linalg.norm(rest))
    return metres * np.column_stack([np.cos(pitch)[:, None] * heading, np.sin(pitch)])


def fit_controls(
    joints: Points3, fps: float, marks: Marks, on_progress: OnProgress = lambda share: None
) -> Floats:
    """Fit the control vectors (T, N_CONTROLS) of a worker to given joints.

    Args:
        joints: desired positions (T, 15, 3) of the worker's joints [m].
        fps: frame rate [Hz].
        marks: joints of the worker's body.
        on_progress: called with each increase of the completed fraction of the work.
    """
    q = guess_controls(joints, fps, marks)
    weight = np.array([WEIGHT[joint.split("_")[-1]] for joint in JOINTS])[:, None]
    pull = np.array([PULL.get(int(column), SLIGHT) for column in FITTED])
    for _ in range(ROUNDS):
        usual = _find_usual(q, fps)
        for first in range(0, len(q), FRAMES):
            part = slice(first, first + FRAMES)
            _improve(q[part], joints[part], usual[part], weight, pull, marks)
            on_progress(len(q[part]) / (len(q) * ROUNDS))
    return q


def _find_usual(q: Floats, fps: float) -> Floats:
    """Return the values (T, F) towards which the fitted columns are regularized."""
    bow = q[:, c.PELVIS_PITCH] + q[:, c.SPINE_FLEX]
    near = smooth(q, SMOOTH_S * fps)
    near[:, c.PELVIS_PITCH], near[:, c.SPINE_FLEX] = PELVIS_SHARE * bow, (1 - PELVIS_SHARE) * bow
    return near[:, FITTED]


def _improve(
    q: Floats, joints: Points3, usual: Floats, weight: Floats, pull: Floats, marks: Marks
) -> None:
    """Improve some frames by one damped Gauss-Newton step.

    Args:
        q: control vectors (n, N_CONTROLS), which are changed.
        joints: desired positions (n, 15, 3) of the worker's joints [m].
        usual: values (n, F) towards which the fitted columns are regularized.
        weight: weight (15, 1) of each joint.
        pull: strength (F,) of the regularization of each column.
        marks: joints of the worker's body.
    """
    n, f = len(q), len(FITTED)
    moved = np.repeat(q[:, None], f + 1, axis=1)
    moved[:, np.arange(f) + 1, FITTED] += STEP
    placed = locate_joints(moved.reshape(n * (f + 1), -1), marks).reshape(
        n, f + 1, *joints.shape[1:]
    )
    slope = ((placed[:, 1:] - placed[:, :1]) / STEP * weight).reshape(n, f, -1)
    miss = ((joints - placed[:, 0]) * weight).reshape(n, -1, 1)
    left = slope @ np.swapaxes(slope, 1, 2) + np.diag(pull**2)
    held = (pull**2 * (usual - q[:, FITTED]))[..., None]
    change = np.linalg.solve(left, slope @ miss + held)[..., 0]
    q[:, FITTED] += np.clip(change, -FARTHEST, FARTHEST)
