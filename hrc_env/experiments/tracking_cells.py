"""One cell of the tracking bench: an estimator on the sequences of a rig and a condition."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import erf, exp, pi, sqrt
from typing import Any

import numpy as np

from hrc_env.experiments.tracking_bound import posterior_bound
from hrc_env.experiments.tracking_detections import CONDITIONS, Damage, detect
from hrc_env.experiments.tracking_dlt import triangulate_frame
from hrc_env.experiments.tracking_full_state import filter_matched
from hrc_env.experiments.tracking_matched import draw, matched_model
from hrc_env.experiments.tracking_rigs import DT_S, SIGMA_PX, Rig
from hrc_env.experiments.tracking_walks import walk
from hrc_env.records import Keypoints
from hrc_env.skeleton import N_JOINTS, TORSO
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.estimators import make_estimator
from hrc_env.typing import Covariances3, Floats, Points2, Points3

DLT = "dlt"
"""The name under which plain per-frame triangulation appears beside the estimators."""
FULL_STATE = "full_state"
"""The filter that knows the matched sequences' model; runs on these only."""
MATCHED = "matched"
CHI2_95_3D = 7.815
"""95 % of a three-dimensional normal variable lies within this squared distance."""
MATCHED_ROOT_ACCELERATION = 0.05
"""Of the matched sequences and of the estimators on them, so that they stay in view [m^2/s^3]."""
N_LEVELS = 20
"""Bins of the probability that the reported Gaussian gives to a nearer joint."""
_FRAMES = {"clean": 500, "occluded": 500, "hard": 500, "one_camera": 175, MATCHED: 40}
_WINDOWS: dict[str, dict[str, tuple[int, int]]] = {
    **{name: {name: (25, 500)} for name in ("clean", "occluded", "hard")},
    "one_camera": {"one_camera": (25, 125), "after_return": (150, 175)},
    MATCHED: {MATCHED: (15, 40)},
}
"""Frames that count: after the first second; while one camera sees, and from one second after
the others' return; matched sequences are short, lest the drifting body leave the images."""
Tick = Callable[[float], None]


@dataclass(frozen=True, slots=True, eq=False)
class Sequences:
    """What all estimators are given, and what they are held against."""

    joints: Points3
    """(T, S, J, 3) [m]."""
    px: Points2
    """(T, S, C, J, 2)."""
    windows: dict[str, tuple[int, int]]
    """Name of each window and its frames."""
    config: TrackerConfig
    bound_m2: Floats | None
    """(T, S, J) the least mean squared error, where it is known."""


def make_sequences(rig: Rig, condition: str, seeds: list[int]) -> Sequences:
    """Sequences of a rig and a condition (of `CONDITIONS`, or "matched"), one per seed."""
    n_frames, windows = _FRAMES[condition], _WINDOWS[condition]
    if condition != MATCHED:
        joints = walk(rig.walk_m, seeds, n_frames)
        px = detect(rig.P, joints, CONDITIONS[condition], seeds)
        return Sequences(joints, px, windows, rig.tracker, None)
    config = replace(rig.tracker, root_acceleration=MATCHED_ROOT_ACCELERATION)
    model = matched_model(config.damping, config.root_acceleration)
    joints = draw(model, seeds, n_frames)
    px = detect(rig.P, joints, Damage(), seeds)
    bound = posterior_bound(rig.P, model, joints, np.isfinite(px[..., 0]), SIGMA_PX)
    return Sequences(joints, px, windows, config, np.trace(bound, axis1=-2, axis2=-1))


def keypoints_of(px: Points2) -> Keypoints:
    """The record for one frame of S sequences with one worker each, from (S, C, J, 2)."""
    px = px[:, :, None]
    seen = np.isfinite(px[..., 0])
    return Keypoints(px, np.where(seen, 0.9, 0.0), np.where(seen, SIGMA_PX, np.inf))


def beliefs(
    name: str, rig: Rig, sequences: Sequences, seeds: list[int]
) -> Iterator[tuple[Points3, Covariances3 | None]]:
    """Mean (S, J, 3) and covariance (S, J, 3, 3) after each frame; DLT has none."""
    n_sequences = len(seeds)
    if name == DLT:
        last = np.tile(sequences.config.prior_mean_world, (n_sequences, N_JOINTS, 1))
        for px in sequences.px:
            last = triangulate_frame(rig.P, px, last)
            yield last, None
        return
    if name == FULL_STATE:
        model = matched_model(sequences.config.damping, sequences.config.root_acceleration)
        yield from filter_matched(rig.P, model, sequences.px, SIGMA_PX)
        return
    estimator = make_estimator(name, rig.P, DT_S, sequences.config)
    rngs = [np.random.default_rng([seed, 4]) for seed in seeds]
    state = estimator.init(n_sequences, 1)
    estimator.reset(state, np.arange(n_sequences), rngs)
    for px in sequences.px:
        estimator.predict(state, DT_S, rngs)
        estimator.update(state, keypoints_of(px), rngs)
        belief = estimator.estimate(state)
        yield belief.mean_world[:, 0], belief.cov_world[:, 0]


class Tally:
    """Sums per sequence over one window's frames and joints."""

    def __init__(self, n_sequences: int) -> None:
        zeros = np.zeros(n_sequences)
        self.n = zeros.copy()
        self.n_frames = zeros.copy()
        self.squared = zeros.copy()
        self.bound = zeros.copy()
        self.mirrored = zeros.copy()
        self.inside = zeros.copy()
        self.trace = zeros.copy()
        self.nees = zeros.copy()
        self.levels = np.zeros((n_sequences, N_LEVELS))
        self.squared_by_views = np.zeros((n_sequences, 5))
        self.n_by_views = np.zeros((n_sequences, 5))
        self._errors: list[Floats] = []

    def add(self, truth: Points3, mean: Points3, cov: Covariances3 | None, px: Points2) -> None:
        """One frame: truth and mean (S, J, 3), cov (S, J, 3, 3), px (S, C, J, 2)."""
        offset = mean - truth
        squared = (offset**2).sum(-1)
        self.n += squared.shape[1]
        self.n_frames += 1
        self.squared += squared.sum(1)
        self.mirrored += (_left(mean) * _left(truth)).sum(-1) < 0
        self._errors.append(np.sqrt(squared).astype(np.float32))
        n_views = np.isfinite(px[..., 0]).sum(1)
        for k in range(self.n_by_views.shape[1]):
            self.squared_by_views[:, k] += np.where(n_views == k, squared, 0).sum(1)
            self.n_by_views[:, k] += (n_views == k).sum(1)
        if cov is not None:
            nees = np.einsum("sji,sjik,sjk->sj", offset, np.linalg.inv(cov), offset)
            self.inside += (nees < CHI2_95_3D).sum(1)
            self.nees += nees.sum(1)
            self.trace += np.trace(cov, axis1=-2, axis2=-1).sum(1)
            level = np.searchsorted(CHI2_LEVELS, nees)
            for k in range(N_LEVELS):
                self.levels[:, k] += (level == k).sum(1)

    def as_lists(self) -> dict[str, Any]:
        """Everything by name, for a JSON file; errors as each sequence's median."""
        out = {name: value.tolist() for name, value in vars(self).items() if name[0] != "_"}
        out["median"] = np.median(np.stack(self._errors), axis=(0, 2)).tolist()
        return out


def run_cell(
    name: str, rig: Rig, sequences: Sequences, seeds: list[int], tick: Tick
) -> dict[str, Any]:
    """Run one estimator; sums per sequence of each window, as `Tally.as_lists`."""
    tallies = {window: Tally(len(seeds)) for window in sequences.windows}
    n_frames = len(sequences.joints)
    for t, (mean, cov) in enumerate(beliefs(name, rig, sequences, seeds)):
        for window, (begin, end) in sequences.windows.items():
            if begin <= t < end:
                tallies[window].add(sequences.joints[t], mean, cov, sequences.px[t])
                if sequences.bound_m2 is not None:
                    tallies[window].bound += sequences.bound_m2[t].sum(-1)
        tick(1 / n_frames)
    return {window: tally.as_lists() for window, tally in tallies.items()}


def _left(joints: Points3) -> Floats:
    """(S, 2) from right to left across the torso, on the ground."""
    a, b, c, d = (joints[:, j, :2] for j in TORSO)
    return a - b + c - d


def _chi2_levels() -> Floats:
    """Squared distances within which 1/n, 2/n, ... of a 3D normal variable lie.

    By Newton's method on the distribution erf(r / sqrt 2) - r sqrt(2 / pi) exp(-r^2 / 2).
    """
    levels = []
    r = 1.0
    for k in range(1, N_LEVELS):
        for _ in range(30):
            below = erf(r / sqrt(2)) - r * sqrt(2 / pi) * exp(-r * r / 2)
            density = sqrt(2 / pi) * r * r * exp(-r * r / 2)
            r = max(r - (below - k / N_LEVELS) / density, 0.05)
        levels.append(r * r)
    return np.array(levels)


CHI2_LEVELS: Floats = _chi2_levels()
"""(19,) limits of the 20 equally likely classes of a normalised squared error."""
