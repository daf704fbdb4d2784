"""True and estimated motion of workers in each frame, for tests of predictions.

The motion has two sources: the worker of the environment, which the emulator detects, with a moving
robot and optional camera failures; and the walkers of the tracking benchmark, on which no predictor
was tuned.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from benchmarks.tracking.detections import CONDITIONS, detect
from benchmarks.tracking.env_sequences import EmulatedDetector, remove_blind, simulate, watch
from benchmarks.tracking.rigs import DT_S, SIGMA_PX, make_rig
from benchmarks.tracking.walks import walk
from hrc_env.config import HRCConfig
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Points3, Velocities3
from hrc_env.geometry.cameras import projections
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.estimators import Estimator, make_estimator

LIVELY = {"dwell_s": (0.5, 4.0), "near_probability": 0.5}
"""Arguments of `MotionConfig` with which a worker walks for about half of the time."""
_FAILURE_S, _BETWEEN_S = (0.4, 3.0), 1.5
Look = Callable[[Estimator[Any], Any], Any]


@dataclass(frozen=True, slots=True)
class Tracks:
    """True and estimated motion in T frames of S sequences with one worker each."""

    truth: Points3
    """True joints (T, S, J, 3) [m]."""
    speed: Velocities3
    """True velocities (T, S, J, 3) [m/s]; NaN if the source does not provide them."""
    estimates: list[PoseEstimate] = field(default_factory=list)
    """Estimates (S, 1, J, ...) after each frame."""
    looks: list[Any] = field(default_factory=list)
    """Results of the function `look`, which is called with the estimator and its state after each
    frame.
    """


def _report_nothing(estimator: Estimator[Any], state: Any) -> None:
    """Return None; this is the default function `look`."""


class _Follower:
    """An estimator that processes frames one after the other and appends to `Tracks`."""

    def __init__(self, tracks: Tracks, look: Look, P: Floats, config: TrackerConfig,
                 rngs: list[np.random.Generator]) -> None:  # fmt: skip
        self.tracks, self.look, self.rngs = tracks, look, rngs
        self.estimator = make_estimator("kalman", P, DT_S, config)
        self.state = self.estimator.init(len(rngs), 1)
        self.estimator.reset(self.state, np.arange(len(rngs)), rngs)

    def take(self, seen: Keypoints) -> None:
        """Update the estimator with one frame, and append its estimate to the tracks."""
        self.estimator.predict(self.state, DT_S, self.rngs)
        self.estimator.update(self.state, seen, self.rngs)
        self.tracks.estimates.append(self.estimator.estimate(self.state))
        self.tracks.looks.append(self.look(self.estimator, self.state))


def follow_walkers(
    seeds: list[int], n_frames: int, condition: str, look: Look = _report_nothing
) -> Tracks:
    """Track the benchmark's walkers in its lab under a condition of `tracking.detections`."""
    rig = make_rig("lab")
    joints = walk(rig.walk_m, seeds, n_frames)
    tracks = Tracks(joints, np.full_like(joints, np.nan))
    rngs = [np.random.default_rng([seed, 4]) for seed in seeds]
    follower = _Follower(tracks, look, rig.P, rig.tracker, rngs)
    for px in detect(rig.P, joints, CONDITIONS[condition], seeds)[:, :, :, None]:
        seen = np.isfinite(px[..., 0])
        sigma_px = np.where(seen, SIGMA_PX, np.inf)
        follower.take(Keypoints(px, np.where(seen, 0.9, 0.0), sigma_px))
    return tracks


def follow_env(
    seeds: list[int],
    n_frames: int,
    lively: bool = False,
    failing: bool = False,
    look: Look = _report_nothing,
) -> Tracks:
    """Track the worker of the environment at level `keypoints` in one episode per seed.

    Args:
        seeds: seeds of the episodes.
        n_frames: number of frames.
        lively: whether workers walk more than with the default settings.
        failing: whether all cameras except one or two fail repeatedly after the first second, for
            up to 3 s at a time.
        look: function of the estimator and its state, which is called after each frame.
    """
    config = HRCConfig()
    if lively:
        config = replace(config, motion=replace(config.motion, **LIVELY))  # type: ignore[arg-type]
    simulation = simulate(len(seeds), config)
    pushes, sensors, rngs = (
        [np.random.default_rng([seed, kind]) for seed in seeds] for kind in (10, 11, 12)
    )
    detector = EmulatedDetector(simulation, sensors)
    shape = (n_frames, len(seeds), N_JOINTS, 3)
    tracks = Tracks(np.empty(shape), np.empty(shape))
    P = projections(detector.cameras)
    follower = _Follower(tracks, look, P, config.tracker, rngs)
    blind = _failures(seeds, n_frames, len(P), failing)[..., None, None]
    for t, (truth, between) in enumerate(watch(simulation, seeds, pushes, n_frames)):
        tracks.truth[t], tracks.speed[t] = truth.joints_world[:, 0], truth.velocity_world[:, 0]
        follower.take(remove_blind(detector.detect(truth, between), blind[t]))
    simulation.close()
    return tracks


def _failures(seeds: list[int], n_frames: int, n_cameras: int, failing: bool) -> Bools:
    """Sample a mask (T, S, C) of frames in which a camera fails."""
    blind = np.zeros((n_frames, len(seeds), n_cameras), bool)
    for s, seed in enumerate(seeds if failing else []):
        rng = np.random.default_rng([seed, 13])
        time_s = 1.0 + rng.exponential(_BETWEEN_S)
        while time_s < n_frames * DT_S:
            end_s = time_s + rng.uniform(*_FAILURE_S)
            n_lost = n_cameras - int(rng.integers(1, 3))
            lost = rng.permutation(n_cameras)[:n_lost]
            blind[round(time_s / DT_S) : round(end_s / DT_S), s, lost] = True
            time_s = end_s + rng.exponential(_BETWEEN_S)
    return blind
