"""Cells of the tracking benchmark, each of which runs an estimator on one rig and condition."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from benchmarks.common import CHI2_95_3D
from benchmarks.tracking.arrivals import restore_times
from benchmarks.tracking.couples import match_identities
from benchmarks.tracking.dlt import triangulate_frame
from benchmarks.tracking.names import DLT, SMOOTHER
from benchmarks.tracking.rigs import DT_S, Rig
from benchmarks.tracking.sequences import Sequences
from hrc_env.core.batching import rows
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import TORSO
from hrc_env.core.typing import Bools, Covariances3, Floats, Points3
from hrc_env.experiments.cache import PartProgress
from hrc_env.tracking.estimators import make_estimator
from hrc_env.tracking.people.association import associate
from hrc_env.tracking.smoother import smooth

UNKNOWN_M2 = 1e6
"""Variance of an unknown bone length [m^2]."""
_AT_ONCE = 10
"""Number of sequences that are smoothed together, which limits memory: the smoother stores 90x90
numbers per frame.
"""


class Belief(NamedTuple):
    """Estimated joint positions after a frame."""

    mean_world: Points3
    """Estimated positions of joints (S, W, J, 3) [m]."""
    cov_world: Covariances3 | None
    """Covariances of the positions (S, W, J, 3, 3) [m^2], or None if the estimator has none."""


class TrackedFrame(NamedTuple):
    """Input and output of an estimator in one frame."""

    keypoints: Keypoints
    """Detections after association with the tracks."""
    estimate: PoseEstimate
    """Estimate after the update with the detections."""


def beliefs(name: str, rig: Rig, sequences: Sequences, seeds: list[int]) -> Iterator[Belief]:
    """Run an estimator and yield its belief after each frame."""
    if name == DLT:
        yield from _triangulate(rig, sequences)
    elif name == SMOOTHER:
        yield from _smooth(rig, sequences, seeds)
    else:
        for frame in _estimate(name, rig, sequences, seeds):
            yield Belief(frame.estimate.mean_world, frame.estimate.cov_world)


def _triangulate(rig: Rig, sequences: Sequences) -> Iterator[Belief]:
    """Yield the triangulation of each frame; joints without two views keep their last position."""
    shape = sequences.joints.shape[1:]
    last = np.tile(sequences.config.prior_mean_world, (shape[0], shape[1] * shape[2], 1))
    for px in sequences.px:
        last = triangulate_frame(rig.P, px.reshape(*px.shape[:2], -1, 2), last)
        yield Belief(last.reshape(shape), None)


def _estimate(
    name: str, rig: Rig, sequences: Sequences, seeds: list[int]
) -> Iterator[TrackedFrame]:
    """Run an estimator as in an environment, and yield its input and output in each frame.

    If there are several people, detected poses are assigned to the tracks by comparison with the
    predictions.
    """
    n_sequences, n_people = sequences.joints.shape[1:3]
    estimator = make_estimator(name, rig.P, DT_S, sequences.config)
    rngs = [np.random.default_rng([seed, 4]) for seed in seeds]
    state = estimator.init(n_sequences, n_people)
    estimator.reset(state, np.arange(n_sequences), rngs)
    for t in range(len(sequences.px)):
        estimator.predict(state, DT_S, rngs)
        keypoints = sequences.keypoints(t)
        if sequences.order is not None:
            keypoints = associate(rig.P, keypoints, estimator.estimate(state)).keypoints
        if not sequences.has_bones:
            _forget_bones(state)
        estimator.update(state, keypoints, rngs)
        yield TrackedFrame(keypoints, estimator.estimate(state))


def _smooth(rig: Rig, sequences: Sequences, seeds: list[int]) -> Iterator[Belief]:
    """Yield the results of the smoother, which uses delayed frames at the time they were taken.

    If there are several people, the poses are assigned to tracks by the estimator `kalman`.
    """
    if sequences.time_s is not None:
        px = restore_times(sequences.px, sequences.time_s)
        config = replace(sequences.config, max_delay_s=0.0)
        sequences = replace(sequences, px=px, time_s=None, config=config)
    if sequences.order is None:
        clip = [sequences.keypoints(t) for t in range(len(sequences.px))]
    else:
        clip = [frame.keypoints for frame in _estimate("kalman", rig, sequences, seeds)]
    parts = []
    for begin in range(0, len(seeds), _AT_ONCE):
        some = np.arange(begin, min(begin + _AT_ONCE, len(seeds)))
        frames = [rows(keypoints, some) for keypoints in clip]
        parts.append(smooth(rig.P, frames, DT_S, sequences.config))
    for t in range(len(clip)):
        yield Belief(
            np.concatenate([part.mean_world[t] for part in parts]),
            np.concatenate([part.cov_world[t] for part in parts]),
        )


def _forget_bones(state: Any) -> None:
    """Reset the bone lengths in all hypotheses of an estimator to unknown."""
    trees = getattr(state, "trees", None)
    if trees is not None:
        trees["bone_variance"][...] = UNKNOWN_M2


def run_cell(
    name: str, rig: Rig, sequences: Sequences, seeds: list[int], tick: PartProgress
) -> dict[str, Any]:
    """Run an estimator, and return the sums of `tally` per sequence for each window."""
    n_frames = len(sequences.joints)
    means = np.empty(sequences.joints.shape)
    covs = np.empty((*sequences.joints.shape, 3)) if name != DLT else None
    for t, (mean, cov) in enumerate(beliefs(name, rig, sequences, seeds)):
        means[t] = mean
        if covs is not None and cov is not None:
            covs[t] = cov
        tick(1 / n_frames)
    return {
        window: _window(slice(*frames), sequences, means, covs)
        for window, frames in sequences.windows.items()
    }


def _window(
    frames: slice, sequences: Sequences, means: Points3, covs: Covariances3 | None
) -> dict[str, Any]:
    """Compute the sums of one window, in which each person is compared with one track."""
    truth, mean = sequences.joints[frames], means[frames]
    cov = None if covs is None else covs[frames]
    swaps = None
    if sequences.order is not None:
        track, swaps = match_identities(truth, mean)
        mean = np.take_along_axis(mean, track[None, :, :, None, None], 2)
        if cov is not None:
            cov = np.take_along_axis(cov, track[None, :, :, None, None, None], 2)
    sums = tally(truth, mean, cov)
    if swaps is not None:
        sums["identity_swaps"] = swaps.tolist()
    if sequences.bound_m2 is not None:
        sums["bound"] = sequences.bound_m2[frames].sum((0, 2)).tolist()
    return sums


def tally(truth: Points3, mean: Points3, cov: Covariances3 | None) -> dict[str, Any]:
    """Sum the errors in each sequence; return lists of sums over the sequences, by name.

    Args:
        truth: true joint positions (T, S, W, J, 3) [m].
        mean: estimated joint positions (T, S, W, J, 3) [m].
        cov: covariances of the estimates (T, S, W, J, 3, 3) [m^2], or None.
    """
    n_frames, n_sequences = truth.shape[:2]
    offset = mean - truth
    squared = (offset**2).sum(-1)
    out: dict[str, Floats] = {
        "n": np.full(n_sequences, float(squared[:, 0].size)),
        "n_frames": np.full(n_sequences, float(n_frames * truth.shape[2])),
        "squared": _total(squared),
        "wrong_way": _total(((_left(mean) * _left(truth)).sum(-1) < 0)[..., None]),
        "median": np.median(np.sqrt(squared), axis=(0, 2, 3)),
    }
    if cov is not None:
        nees = np.einsum("...i,...i->...", offset, np.linalg.solve(cov, offset[..., None])[..., 0])
        out["inside"] = _total(nees < CHI2_95_3D)
        out["trace"] = _total(np.trace(cov, axis1=-2, axis2=-1))
    return {name: value.tolist() for name, value in out.items()}


def _total(values: Floats | Bools) -> Floats:
    """Return the sums (S,) of values (T, S, W, J) in each sequence."""
    return values.sum(axis=(0, 2, 3), dtype=float)


def _left(joints: Points3) -> Floats:
    """Return the horizontal direction (..., 2) from right to left across the torso."""
    a, b, c, d = (joints[..., j, :2] for j in TORSO)
    return a - b + c - d
