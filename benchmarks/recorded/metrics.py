"""How good an estimator is where nobody knows the truth: real footage.

A camera is held out and must be foretold; bones must not change; motion must be smooth; and
two cameras must be enough to go on with every joint.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from benchmarks.recorded.detections import Detections
from benchmarks.recorded.lag import SURE
from hrc_env.core.records import PoseEstimate
from hrc_env.core.results import Metric
from hrc_env.core.skeleton import BONES, MIRROR
from hrc_env.core.typing import Bools, Covariances3, Floats, Points3
from hrc_env.geometry.cameras import project
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.estimators import ESTIMATORS, make_estimator
from hrc_env.tracking.smoother import smooth

SMOOTHER = "smoother"
"""Offline: it sees the whole recording at once."""
NAMES = [*ESTIMATORS, SMOOTHER]
"""Who runs on real footage."""
FRESH_S = 0.2
"""A joint counts as updated when a measurement supported it within so many seconds."""
CHI2_95_2D = 5.991
"""95 % of a two-dimensional normal variable lies within this squared distance."""
_BLOCK = 10
"""Neighbouring frames are alike: intervals come from drawing blocks of this many."""
_N_DRAWN = 300


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """What an estimator believed after each of T frames."""

    mean_world: Points3
    """(T, J, 3) [m]."""
    cov_world: Covariances3
    """(T, J, 3, 3) [m^2]."""
    age_s: Floats
    """(T, J)."""
    tracked: Bools
    """(T,)."""


def follow(
    name: str, P: Floats, config: TrackerConfig, detections: Detections, cameras: list[int]
) -> Track:
    """Run an estimator, or the smoother, on some of the cameras of a recording."""
    if name == SMOOTHER:
        clip = [detections.keypoints(t, cameras) for t in range(len(detections.px))]
        belief = smooth(P[cameras], clip, detections.dt_s, config)
        return Track(
            belief.mean_world[:, 0, 0],
            belief.cov_world[:, 0, 0],
            belief.age_s[:, 0, 0],
            belief.tracked[:, 0, 0],
        )
    rows = list(_follow(name, P, config, detections, cameras))
    return Track(
        np.stack([row.mean_world[0, 0] for row in rows]),
        np.stack([row.cov_world[0, 0] for row in rows]),
        np.stack([row.age_s[0, 0] for row in rows]),
        np.stack([row.tracked[0, 0] for row in rows]),
    )


def _follow(
    name: str, P: Floats, config: TrackerConfig, detections: Detections, cameras: list[int]
) -> Iterator[PoseEstimate]:
    estimator = make_estimator(name, P[cameras], detections.dt_s, config)
    rngs = [np.random.default_rng([0, 7])]
    state = estimator.init(1, 1)
    estimator.reset(state, np.arange(1), rngs)
    for t in range(len(detections.px)):
        estimator.predict(state, detections.dt_s, rngs)
        estimator.update(state, detections.keypoints(t, cameras), rngs)
        yield estimator.estimate(state)


@dataclass(frozen=True, slots=True, eq=False)
class Foretold:
    """How far detections in held-out cameras were from what the others made of them."""

    off_px: Floats
    """(T, C, J), NaN where the detector was not sure or nobody was followed."""
    off_either_px: Floats
    """The same if, in a frame in which that fits better, the held-out detector is taken to have
    exchanged left and right."""
    inside: Floats
    """(T, C, J) 1 where the detection lies in the 95 % region of belief and detector, else 0."""


def foretell(name: str, P: Floats, config: TrackerConfig, detections: Detections) -> Foretold:
    """Hold every camera out once."""
    n_frames, n_cameras, n_joints = detections.confidence.shape
    off = np.full((3, n_frames, n_cameras, n_joints), np.nan)
    for held in range(n_cameras):
        others = [c for c in range(n_cameras) if c != held]
        track = follow(name, P, config, detections, others)
        counted = (detections.confidence[:, held] >= SURE) & track.tracked[:, None]
        shown = project(P[held : held + 1], track.mean_world)[0][:, 0]
        plain = np.linalg.norm(shown - detections.px[:, held], axis=-1)
        renamed = np.linalg.norm(shown - detections.px[:, held][:, MIRROR], axis=-1)
        exchanged = np.nanmedian(renamed, 1) < np.nanmedian(plain, 1)
        inside = _inside(P[held], track, detections, held)
        for row, value in enumerate(
            (plain, np.where(exchanged[:, None], renamed, plain), inside.astype(float))
        ):
            off[row, :, held] = np.where(counted, value, np.nan)
    return Foretold(*off)


def _inside(P: Floats, track: Track, detections: Detections, camera: int) -> Bools:
    """(T, J) whether a detection lies in the 95 % region that belief and detector claim."""
    points = np.concatenate([track.mean_world, np.ones((*track.age_s.shape, 1))], -1)
    u, v, w = np.moveaxis(points @ P.T, -1, 0)
    px = np.stack([u / w, v / w], -1)
    slope = (P[:2, :3] - px[..., None] * P[2, :3]) / w[..., None, None]
    cov = slope @ track.cov_world @ slope.swapaxes(-1, -2)
    sigma = np.where(np.isfinite(detections.sigma_px[:, camera]), detections.sigma_px[:, camera], 1)
    cov += sigma[..., None, None] ** 2 * np.eye(2)
    off = detections.px[:, camera] - px
    return np.einsum("tji,tjik,tjk->tj", off, np.linalg.inv(cov), off) < CHI2_95_2D


def foretold_metrics(foretold: Foretold) -> dict[str, Metric]:
    """Median and 95th percentile [px], also with sides renamed, and coverage, with intervals."""
    out = {}
    for kind, off in (("px", foretold.off_px), ("either_px", foretold.off_either_px)):
        for part, share in (("median", 50), ("p95", 95)):
            values = [float(np.nanpercentile(some, share)) for some in _drawn(off)]
            out[f"{kind}.{part}"] = _interval(values, "px", off)
    values = [float(np.nanmean(some)) for some in _drawn(foretold.inside)]
    out["coverage95"] = _interval(values, "share", foretold.inside)
    return out


def _drawn(values: Floats) -> Iterator[Floats]:
    """All frames, then 300 times as many blocks of frames, drawn with replacement."""
    yield values
    blocks = np.array_split(np.arange(len(values)), max(len(values) // _BLOCK, 1))
    rng = np.random.default_rng(0)
    for _ in range(_N_DRAWN):
        drawn = rng.integers(len(blocks), size=len(blocks))
        yield values[np.concatenate([blocks[k] for k in drawn])]


def _interval(values: list[float], unit: str, counted: Floats) -> Metric:
    low, high = np.percentile(values[1:], (2.5, 97.5))
    return Metric(values[0], float(low), float(high), unit, int(np.isfinite(counted).sum()))


def bone_std(track: Track) -> Metric:
    """Standard deviation of bone lengths over time [m]: mean, least and largest over bones."""
    joints = track.mean_world[track.tracked]
    lengths = np.linalg.norm(joints[:, BONES[:, 0]] - joints[:, BONES[:, 1]], axis=-1)
    return _over(lengths.std(0), float(lengths.std(0).mean()), "m")


def jerk(track: Track, dt_s: float) -> Metric:
    """Root mean squared third difference [m/s^3]: all joints, the calmest and the wildest."""
    squared = (np.diff(track.mean_world[track.tracked], 3, axis=0) ** 2).sum(-1) / dt_s**6
    return _over(np.sqrt(squared.mean(0)), float(np.sqrt(squared.mean())), "m/s^3")


def two_camera_share(name: str, P: Floats, config: TrackerConfig, detections: Detections) -> Metric:
    """Share of frames in which two cameras kept every joint fresh: mean, worst and best pair."""
    shares = []
    for pair in combinations(range(len(P)), 2):
        track = follow(name, P, config, detections, list(pair))
        shares.append(float(((track.age_s <= FRESH_S).all(1) & track.tracked).mean()))
    return _over(np.array(shares), float(np.mean(shares)), "share")


def _over(values: Floats, value: float, unit: str) -> Metric:
    return Metric(value, float(values.min()), float(values.max()), unit, len(values))
