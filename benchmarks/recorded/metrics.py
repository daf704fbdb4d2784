"""Metrics of an estimator on recorded videos, without ground truth.

The metrics are the error of predicted detections in a held-out camera, the variation of bone
lengths, and the jerk of the motion.
"""

from dataclasses import dataclass, fields

import numpy as np

from benchmarks.recorded.detections import SURE, Detections
from hrc_env.core.records import PoseEstimate
from hrc_env.core.results import Metric
from hrc_env.core.skeleton import BONES, MIRROR
from hrc_env.core.typing import Bools, Covariances3, Floats, Points3
from hrc_env.evaluation.intervals import estimate_clustered_share, estimate_quantile
from hrc_env.geometry.cameras import project
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.estimators import ESTIMATORS, make_estimator
from hrc_env.tracking.smoother import smooth

SMOOTHER = "smoother"
"""Name of the offline smoother, which uses the whole recording."""
NAMES = [*ESTIMATORS, SMOOTHER]
"""Names of the estimators that run on a recording."""
CHI2_95_2D = 5.991
"""Squared Mahalanobis radius of the 95 % region of a normal distribution in two dimensions."""
_BLOCK = 10
"""Number of frames in a block of the bootstrap; neighbouring frames are correlated."""


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Estimates after each of T frames."""

    mean_world: Points3
    """Joint positions (T, J, 3) [m]."""
    cov_world: Covariances3
    """Covariances of joint positions (T, J, 3, 3) [m^2]."""
    tracked: Bools
    """Mask (T,) of frames in which the person is tracked."""


def follow(
    name: str, P: Floats, config: TrackerConfig, detections: Detections, cameras: list[int]
) -> Track:
    """Run an estimator or the smoother with the given cameras of a recording."""
    clip = [detections.keypoints(t, cameras) for t in range(len(detections.px))]
    if name == SMOOTHER:
        belief = smooth(P[cameras], clip, detections.dt_s, config)
        return Track(*(getattr(belief, each.name)[:, 0, 0] for each in fields(Track)))
    estimator = make_estimator(name, P[cameras], detections.dt_s, config)
    rngs = [np.random.default_rng([0, 7])]
    state = estimator.init(1, 1)
    estimator.reset(state, np.arange(1), rngs)
    said: list[PoseEstimate] = []
    for keypoints in clip:
        estimator.predict(state, detections.dt_s, rngs)
        estimator.update(state, keypoints, rngs)
        said.append(estimator.estimate(state))
    return Track(
        *(np.stack([getattr(row, each.name)[0, 0] for row in said]) for each in fields(Track))
    )


@dataclass(frozen=True, slots=True, eq=False)
class Foretold:
    """Errors in held-out cameras of the detections that are predicted from the other cameras."""

    off_px: Floats
    """Distance between predictions and detections (T, C, J) [px]; NaN if the confidence is low or
    there is no track.
    """
    off_either_px: Floats
    """The same distances, with left and right of the detection swapped in frames in which this
    reduces the error [px].
    """
    inside: Floats
    """Indicator (T, C, J), 1 for detections within the combined 95 % region of estimate and
    detector, otherwise 0.
    """


def foretell(name: str, P: Floats, config: TrackerConfig, detections: Detections) -> Foretold:
    """Predict the detections in each camera from those in the other cameras."""
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
    """Return a mask (T, J) of detections in the combined 95 % region of estimate and detector."""
    points = np.concatenate([track.mean_world, np.ones((*track.mean_world.shape[:-1], 1))], -1)
    u, v, w = np.moveaxis(points @ P.T, -1, 0)
    px = np.stack([u / w, v / w], -1)
    slope = (P[:2, :3] - px[..., None] * P[2, :3]) / w[..., None, None]
    cov = slope @ track.cov_world @ slope.swapaxes(-1, -2)
    sigma = np.where(np.isfinite(detections.sigma_px[:, camera]), detections.sigma_px[:, camera], 1)
    cov += sigma[..., None, None] ** 2 * np.eye(2)
    off = detections.px[:, camera] - px
    return np.einsum("tji,tjik,tjk->tj", off, np.linalg.inv(cov), off) < CHI2_95_2D


def summarize_foretold(foretold: Foretold) -> dict[str, Metric]:
    """Compute median and 95th percentile of errors [px], without and with swaps, and coverage.

    Confidence intervals are computed by bootstrap over blocks of frames.
    """
    n_blocks = max(len(foretold.inside) // _BLOCK, 1)
    out = {
        f"{kind}.{part}": estimate_quantile(np.array_split(off, n_blocks), q, "px")
        for kind, off in (("px", foretold.off_px), ("either_px", foretold.off_either_px))
        for part, q in (("median", 0.5), ("p95", 0.95))
    }
    inside = np.array_split(foretold.inside, n_blocks)
    counts = [np.isfinite(each).sum() for each in inside]
    out["coverage95"] = estimate_clustered_share([np.nansum(each) for each in inside], counts)
    return out


def bone_std(track: Track) -> Metric:
    """Compute the standard deviation of bone lengths over time [m].

    The value of the metric is the mean over bones; its interval is the range over bones.
    """
    joints = track.mean_world[track.tracked]
    lengths = np.linalg.norm(joints[:, BONES[:, 0]] - joints[:, BONES[:, 1]], axis=-1)
    return _over(lengths.std(0), float(lengths.std(0).mean()), "m")


def jerk(track: Track, dt_s: float) -> Metric:
    """Compute the root mean square of the jerk of joint positions [m/s^3].

    The value of the metric includes all joints; its interval is the range over joints.
    """
    squared = (np.diff(track.mean_world[track.tracked], 3, axis=0) ** 2).sum(-1) / dt_s**6
    return _over(np.sqrt(squared.mean(0)), float(np.sqrt(squared.mean())), "m/s^3")


def _over(values: Floats, value: float, unit: str) -> Metric:
    return Metric(value, float(values.min()), float(values.max()), unit, len(values))
