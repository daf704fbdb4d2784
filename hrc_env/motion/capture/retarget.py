"""A recording to a clip for a worker, and how far their joints are apart then."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.typing import Floats, Points3
from hrc_env.motion.capture.adapt import adapted
from hrc_env.motion.capture.clip import Clip, placed_at_origin
from hrc_env.motion.capture.fit import Say, fitted
from hrc_env.motion.capture.marks import joints_in, marks_of
from hrc_env.motion.capture.record import Capture
from hrc_env.motion.capture.stance import locked, slip
from hrc_env.worker.body import Body


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
    capture: Capture, body: Body, say: Say = lambda share: None
) -> tuple[Clip, RetargetError]:
    """Let a worker do what a person did; `say` is told how the work goes on."""
    marks = marks_of(body, capture.landmarks)
    target = adapted(capture.joints_world, capture.fps, marks)
    size = marks.anatomy.size
    poses = fitted(target, capture.fps, marks, say)
    controls, contacts = locked(poses, capture.fps, size)
    done = joints_in(controls, marks)
    scale, apart = aligned_errors(capture.joints_world, done)
    slips = slip(controls, contacts, capture.fps, marks.anatomy)
    error = RetargetError(
        apart.mean(0), np.percentile(apart, 95, axis=0), scale,
        float(np.percentile(slips, 95)) if len(slips) else float("nan"),
    )  # fmt: skip
    clip = Clip(placed_at_origin(controls), capture.fps, contacts, size, capture.source)
    return clip, error


def aligned_errors(source: Points3, done: Points3) -> tuple[float, Floats]:
    """Distances (T, 15) after the best similarity of the whole recording, and its scale.

    One scale, rotation and translation for all frames: S. Umeyama, IEEE PAMI 13(4), 1991.
    """
    a, b = source.reshape(-1, 3), done.reshape(-1, 3)
    a0, b0 = a - a.mean(0), b - b.mean(0)
    u, s, vt = np.linalg.svd(b0.T @ a0)
    s[2] *= np.sign(np.linalg.det(u) * np.linalg.det(vt))
    rotation = (u * [1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    scale = float(s.sum() / (a0**2).sum())
    moved = scale * a0 @ rotation.T
    return scale, np.linalg.norm(moved - b0, axis=-1).reshape(source.shape[:2])
