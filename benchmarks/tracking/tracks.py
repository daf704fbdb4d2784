"""Workers, and what an estimator made of them, frame by frame: what predictions are tried on.

Two sources: the environment's own worker through its own detector's emulator, the robot moving
about, with or without cameras failing; and the tracking bench's walkers, of whom nothing that
predicts was ever told.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from benchmarks.tracking.detections import CONDITIONS, detect
from benchmarks.tracking.rigs import DT_S, SIGMA_PX, make_rig
from benchmarks.tracking.walks import walk
from hrc_env.config import HRCConfig, settle
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Points3, Velocities3
from hrc_env.geometry.cameras import projections
from hrc_env.motion import generator
from hrc_env.perception import emulator
from hrc_env.simulation import Simulation
from hrc_env.tracking.estimators import Estimator, make_estimator
from hrc_env.worker.body import worker_truth

LIVELY = {"dwell_s": (0.5, 4.0), "near_probability": 0.5}
"""Changes to `MotionConfig` that make a worker walk for about half of the time."""
_SLOWNESS = 0.95
_FAILURE_S, _BETWEEN_S = (0.4, 3.0), 1.5
Look = Callable[[Estimator[Any], Any], Any]


@dataclass(frozen=True, slots=True)
class Tracks:
    """T frames of S sequences with one worker each."""

    truth: Points3
    """(T, S, J, 3) [m]."""
    speed: Velocities3
    """(T, S, J, 3) true velocities [m/s]; NaN where the source does not say."""
    estimates: list[PoseEstimate] = field(default_factory=list)
    """T of them, (S, 1, J, ...)."""
    looks: list[Any] = field(default_factory=list)
    """What `look` said of the estimator and its state after each frame."""


def _nothing(estimator: Estimator[Any], state: Any) -> None:
    del estimator, state


def follow_walkers(
    seeds: list[int], n_frames: int, condition: str, name: str = "kalman", look: Look = _nothing
) -> Tracks:
    """The bench's walkers in its lab, under one of `tracking.detections.CONDITIONS`."""
    rig = make_rig("lab")
    joints = walk(rig.walk_m, seeds, n_frames)
    pixels = detect(rig.P, joints, CONDITIONS[condition], seeds)
    estimator = make_estimator(name, rig.P, DT_S, rig.tracker)
    rngs = [np.random.default_rng([seed, 4]) for seed in seeds]
    state = estimator.init(len(seeds), 1)
    estimator.reset(state, np.arange(len(seeds)), rngs)
    tracks = Tracks(joints, np.full_like(joints, np.nan))
    for px in pixels[:, :, :, None]:
        seen = np.isfinite(px[..., 0])
        sigma = np.where(seen, SIGMA_PX, np.inf)
        _take(tracks, estimator, state, Keypoints(px, np.where(seen, 0.9, 0.0), sigma), rngs, look)
    return tracks


def follow_own(
    seeds: list[int],
    n_frames: int,
    lively: bool = False,
    failing: bool = False,
    name: str = "kalman",
    look: Look = _nothing,
) -> Tracks:
    """The environment's own worker at the level `keypoints`, one episode per seed.

    Args:
        seeds: one per sequence.
        n_frames: how many frames.
        lively: workers walk more than the environment's.
        failing: after the first second cameras fail for up to 3 s, all but one or two at once.
        name: the estimator.
        look: asked after every frame.
    """
    config = HRCConfig()
    if lively:
        config = replace(config, motion=replace(config.motion, **LIVELY))  # type: ignore[arg-type]
    scene = Simulation(len(seeds), settle(perception="none", estimator="kalman", config=config))
    cameras = scene.scene.cameras
    blind = _failures(seeds, n_frames, len(cameras), failing)[..., None, None]
    estimator = make_estimator(name, projections(cameras), config.ctrl_dt, config.tracker)
    rngs = [np.random.default_rng([seed, 12]) for seed in seeds]
    state = estimator.init(len(seeds), 1)
    estimator.reset(state, np.arange(len(seeds)), rngs)
    shape = (n_frames, len(seeds), N_JOINTS, 3)
    tracks = Tracks(np.empty(shape), np.empty(shape))
    for t, (joints, speed, seen) in enumerate(_frames(scene, seeds, n_frames)):
        tracks.truth[t], tracks.speed[t] = joints, speed
        _take(tracks, estimator, state, _without(seen, blind[t]), rngs, look)
    scene.close()
    return tracks


def _frames(
    scene: Simulation, seeds: list[int], n_frames: int
) -> Iterator[tuple[Points3, Velocities3, Keypoints]]:
    """True joints, their velocities (S, J, 3) and what the emulated detector reports of them."""
    config, cameras, everyone = scene.config, scene.scene.cameras, np.arange(len(seeds))
    scene.reset(everyone, [np.random.default_rng([seed, 9]) for seed in seeds])
    pushes, sensors = ([np.random.default_rng([seed, kind]) for seed in seeds] for kind in (10, 11))
    errors = emulator.make_state(len(seeds), len(cameras), 1, config.ctrl_dt, config.emulator)
    emulator.reset(errors, everyone, sensors)
    action = np.zeros((len(seeds), scene.n_actions))
    for _ in range(n_frames):
        push = np.stack([rng.standard_normal(scene.n_actions) for rng in pushes])
        action = _SLOWNESS * action + np.sqrt(1 - _SLOWNESS**2) * push
        scene.step(np.clip(action, -1, 1))
        motion = generator.current(scene.motion)
        now = worker_truth(scene.bodies, motion)
        between = scene.scene.surroundings(scene.physics.q, motion.held)
        seen = emulator.emulate(errors, sensors, now, between, cameras, config.emulator)
        yield now.joints_world[:, 0], now.velocity_world[:, 0], seen


def _take(
    tracks: Tracks, estimator: Estimator[Any], state: Any, seen: Keypoints, rngs: Any, look: Look
) -> None:
    """One frame into the estimator, what it says into the tracks."""
    estimator.predict(state, DT_S, rngs)
    estimator.update(state, seen, rngs)
    tracks.estimates.append(estimator.estimate(state))
    tracks.looks.append(look(estimator, state))


def _failures(seeds: list[int], n_frames: int, n_cameras: int, failing: bool) -> Bools:
    """(T, S, C) whether a camera sees nothing."""
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


def _without(seen: Keypoints, blind: Bools) -> Keypoints:
    """Keypoints of cameras that see; `blind` broadcasts to (S, C, 1, J)."""
    return Keypoints(
        np.where(blind[..., None], np.nan, seen.px),
        np.where(blind, 0.0, seen.confidence),
        np.where(blind, np.inf, seen.sigma_px),
    )
