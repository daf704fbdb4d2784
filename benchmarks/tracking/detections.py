"""Simulated detections of walkers.

The detections have white noise, correlated errors, occlusions, gross errors, and swapped left and
right sides.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.tracking.athletes import FALLS_S
from benchmarks.tracking.rigs import DT_S, HEIGHT_PX, SIGMA_PX, WIDTH_PX
from hrc_env.core.skeleton import MIRROR
from hrc_env.core.typing import Bools, Floats, Points2, Points3
from hrc_env.geometry.cameras import project

_HZ = 1 / DT_S
_DRIFT_TAU_S = 0.5


@dataclass(frozen=True, slots=True)
class Damage:
    """Parameters of the errors of simulated detections."""

    sigma_px: float = SIGMA_PX
    """Standard deviation of the white noise on each coordinate [px]."""
    drift_px: float = 0.0
    """Standard deviation of the error on each coordinate with a correlation time of 0.5 s [px].

    Estimators receive no information about these errors.
    """
    occluded: bool = False
    """Whether joints are occluded.

    Each camera loses each joint on average every 5 s for 0.5 to 2 s. In addition, on average every
    6 s, a joint is visible in only one camera for 0.5 to 1.5 s or, in one of five cases, in no
    camera for 0.4 to 0.8 s.
    """
    gross: float = 0.0
    """Fraction of gross errors; their standard deviation is about a third of the body's size in the
    image.
    """
    swapped: float = 0.0
    """Fraction of frames in which a camera swaps left and right, in episodes of about 6 frames."""
    mirrored_start: bool = False
    """Whether two cameras swap left and right in the first frame."""
    alone_s: tuple[float, float] | None = None
    """Start and end of the interval in which only one camera sees the body [s], or None."""


CONDITIONS: dict[str, Damage] = {
    "clean": Damage(),
    "occluded": Damage(occluded=True),
    "hard": Damage(occluded=True, gross=0.10, swapped=0.05),
    "one_camera": Damage(alone_s=(1.0, 5.0)),
    "drifting": Damage(drift_px=4.0),
}
SURPRISES: dict[str, Damage] = {
    "mirrored_start": Damage(mirrored_start=True),
    **dict.fromkeys(("running", "running_fast", "acrobat", "fallen"), Damage()),
    **dict.fromkeys(("worker_runs", "worker_falls"), Damage()),
    **dict.fromkeys(
        ("fallen_one_camera", "worker_falls_one_camera"), Damage(alone_s=(FALLS_S, 6.0))
    ),
    **dict.fromkeys(
        (
            "acrobat_one_camera", "spins_one_camera", "circles_one_camera",
            "small_circles_one_camera",
        ),
        Damage(alone_s=(1.0, 6.0)),
    ),
}  # fmt: skip
"""Errors of the detections, by condition of `tests/properties/test_sudden_motions.py`."""


def detect(P: Floats, joints: Points3, damage: Damage, seeds: list[int]) -> Points2:
    """Return detections (T, S, C, J, 2) of joints (T, S, J, 3) [px]; NaN if missing.

    Each seed and kind of error has a separate random stream, so that conditions differ only in the
    kinds of errors.
    """
    exact, depth = project(P, joints)
    exact, depth = exact.swapaxes(1, 2), depth.swapaxes(1, 2)
    inside = (exact >= 0).all(-1) & (exact[..., 0] < WIDTH_PX) & (exact[..., 1] < HEIGHT_PX)
    in_view = inside & (depth > 0.1)
    px = np.empty_like(exact)
    for s, seed in enumerate(seeds):
        px[:, s] = _damage(exact[:, s], in_view[:, s], damage, seed)
    return px


def _damage(exact: Points2, in_view: Bools, damage: Damage, seed: int) -> Points2:
    """Add errors to the exact pixels of one sequence, given a mask of the joints in view."""
    rngs = [np.random.default_rng([seed, 2, kind]) for kind in range(5)]
    px = exact + damage.sigma_px * rngs[0].standard_normal(exact.shape)
    if damage.drift_px:
        px += damage.drift_px * _drift(rngs[4], exact.shape)
    seen = in_view
    if damage.occluded:
        seen = in_view & _occlusions(rngs[1], in_view.shape)
    if damage.alone_s is not None:
        begin, end = (round(time_s * _HZ) for time_s in damage.alone_s)
        seen = seen.copy()
        seen[begin:end, np.arange(seen.shape[1]) != seed % seen.shape[1]] = False
    if damage.swapped:
        now = _swaps(rngs[2], in_view.shape[:2], damage.swapped)[..., None]
        px = np.where(now[..., None], px[:, :, MIRROR], px)
        seen = np.where(now, seen[:, :, MIRROR], seen)
    if damage.mirrored_start:
        two = np.random.default_rng([seed, 9]).permutation(px.shape[1])[:2]
        px[0, two], seen = px[0, two][:, MIRROR], seen.copy()
        seen[0, two] = seen[0, two][:, MIRROR]
    if damage.gross:
        size = np.linalg.norm(exact.max(2) - exact.min(2), axis=-1)[..., None, None]
        wrong = rngs[3].random(seen.shape) < damage.gross
        error = 3 * (20 + 0.12 * size) * rngs[3].standard_normal(px.shape)
        px = np.where(wrong[..., None], px + error, px)
    return np.where(seen[..., None], px, np.nan)


def _drift(rng: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    """Sample stationary noise (T, ...) of unit variance with autocorrelation exp(-t / 0.5 s)."""
    keep = np.exp(-DT_S / _DRIFT_TAU_S)
    drift = rng.standard_normal(shape)
    for t in range(1, len(drift)):
        drift[t] = keep * drift[t - 1] + np.sqrt(1 - keep**2) * drift[t]
    return drift


def _occlusions(rng: np.random.Generator, shape: tuple[int, ...]) -> Bools:
    """Sample a mask (T, C, J) of joints that are not occluded."""
    n_frames, n_cameras, n_joints = shape
    free = np.ones(shape, bool)
    for c in range(n_cameras):
        for j in range(n_joints):
            t = rng.exponential(5 * _HZ)
            while t < n_frames:
                length = int(rng.uniform(0.5, 2.0) * _HZ)
                free[int(t) : int(t) + length, c, j] = False
                t += length + rng.exponential(5 * _HZ)
    for j in range(n_joints):
        t = 2 * _HZ + rng.exponential(6 * _HZ)
        while t < n_frames:
            length, left = int(rng.uniform(0.5, 1.5) * _HZ), int(rng.integers(n_cameras + 1))
            if left == n_cameras:
                length = int(rng.uniform(0.4, 0.8) * _HZ)
            free[int(t) : int(t) + length, :, j] = np.arange(n_cameras) == left
            t += length + rng.exponential(6 * _HZ)
    return free


def _swaps(rng: np.random.Generator, shape: tuple[int, ...], share: float) -> Bools:
    """Sample a mask (T, C) of frames in which a camera swaps left and right."""
    n_frames, n_cameras = shape
    swapped = np.zeros(shape, bool)
    pause = 6 / share * (1 - share)
    for c in range(n_cameras):
        t = rng.exponential(pause)
        while t < n_frames:
            length = 1 + int(rng.geometric(1 / 6))
            swapped[int(t) : int(t) + length, c] = True
            t += length + rng.exponential(pause)
    return swapped
