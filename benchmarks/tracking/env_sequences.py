"""A second, independent source of sequences: the environment's worker and detector emulator.

The walkers of the benchmark (`walks`) and the environment's worker (`hrc_env.motion`) share no
code, and neither do their detections: errors in the benchmark are white, while those of the
environment's emulator are correlated over half a second, have heavy tails, and may disagree with
the reported confidence.
"""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from benchmarks.tracking.rigs import Rig
from hrc_env.config import HRCConfig
from hrc_env.core.records import Keypoints, WorkerTruth
from hrc_env.core.typing import Bools, Points3
from hrc_env.geometry.cameras import projections
from hrc_env.geometry.sight import Surroundings, no_surroundings
from hrc_env.motion import generator
from hrc_env.perception import emulator
from hrc_env.settings import resolve_settings
from hrc_env.simulation import Simulation
from hrc_env.tracking.config import ParticleConfig, cast_config
from hrc_env.worker.body import worker_truth

ENV = "env"
"""Name of the rig with the four cameras of the environment's room."""
ENV_CONDITIONS = ("four_cameras", "two_cameras", "one_camera", "occluded")
"""Conditions of the rig `ENV`.

The first three are without occlusion, with all cameras, with the first two cameras, and with only
one camera for 4 s. In `occluded`, the room and a moving robot occlude the worker.
"""
ENV_FRAMES = 150
ALONE_FRAMES = slice(25, 125)
_SLOWNESS = 0.95


def make_env_rig() -> Rig:
    """Return the rig with the environment's cameras and tracker settings."""
    simulation = simulate(1)
    P = projections(simulation.scene.cameras)
    simulation.close()
    return Rig(ENV, P, (np.nan, np.nan), cast_config(HRCConfig().tracker, ParticleConfig))


class EnvSequences(NamedTuple):
    """Sequences from the environment, with one episode per seed."""

    joints_world: Points3
    """True joints (T, S, 1, J, 3) [m]."""
    keypoints: Keypoints
    """Detected keypoints (T, S, C, 1, J, ...)."""


def record(condition: str, seeds: list[int]) -> EnvSequences:
    """Simulate the sequences of a condition, one per seed."""
    episodes = _play_episodes(tuple(seeds))
    if condition == "occluded":
        return EnvSequences(episodes.joints_world, episodes.hidden)
    blind: Bools = np.zeros(episodes.free.confidence.shape, bool)
    if condition == "two_cameras":
        blind[:, :, 2:] = True
    elif condition == "one_camera":
        left = np.array(seeds) % blind.shape[2]
        others = np.arange(blind.shape[2]) != left[:, None]
        blind[ALONE_FRAMES] = others[:, :, None, None]
    return EnvSequences(episodes.joints_world, remove_blind(episodes.free, blind))


def remove_blind(keypoints: Keypoints, blind: Bools) -> Keypoints:
    """Return a copy in which the keypoints in the mask `blind` (..., C, W, J) are missing."""
    return Keypoints(
        np.where(blind[..., None], np.nan, keypoints.px),
        np.where(blind, 0.0, keypoints.confidence),
        np.where(blind, np.inf, keypoints.sigma_px),
    )


def watch(
    simulation: Simulation, seeds: Sequence[int], pushes: list[np.random.Generator], n_frames: int
) -> Iterator[tuple[WorkerTruth, Surroundings]]:
    """Simulate random slow motions of the robot (`pushes`); yield the workers and surroundings."""
    simulation.reset(np.arange(len(seeds)), [np.random.default_rng([seed, 9]) for seed in seeds])
    action = np.zeros((len(seeds), simulation.n_actions))
    for _ in range(n_frames):
        push = np.stack([rng.standard_normal(simulation.n_actions) for rng in pushes])
        action = _SLOWNESS * action + np.sqrt(1 - _SLOWNESS**2) * push
        simulation.step(np.clip(action, -1, 1))
        motion = generator.current(simulation.motion)
        truth = worker_truth(simulation.bodies, motion)
        yield truth, simulation.scene.surroundings(simulation.physics.q, motion.held)


class EmulatedDetector:
    """The detector emulator for a batch of seeds, which converts true poses to keypoints."""

    def __init__(self, simulation: Simulation, rngs: list[np.random.Generator]) -> None:
        self.config, self.cameras, self.rngs = simulation.config, simulation.scene.cameras, rngs
        self.state = emulator.make_state(
            len(rngs), len(self.cameras), 1, self.config.ctrl_dt, self.config.emulator
        )
        emulator.reset(self.state, np.arange(len(rngs)), rngs)

    def detect(self, truth: WorkerTruth, between: Surroundings) -> Keypoints:
        """Return emulated detections of true poses in the given surroundings."""
        settings = self.config.emulator
        return emulator.emulate(self.state, self.rngs, truth, between, self.cameras, settings)


class _Episodes(NamedTuple):
    """Episodes of the environment, with keypoints in both variants: without and with occlusion."""

    joints_world: Points3
    """True joints (T, S, 1, J, 3) [m]."""
    free: Keypoints
    """Keypoints without occlusion."""
    hidden: Keypoints
    """Keypoints with occlusion by the robot and the scene."""


@lru_cache(maxsize=1)
def _play_episodes(seeds: tuple[int, ...]) -> _Episodes:
    """Simulate one episode per seed; the latest episodes are cached."""
    simulation = simulate(len(seeds))
    free, hidden, pushes = (
        [np.random.default_rng([seed, 10, k]) for seed in seeds] for k in range(3)
    )
    detectors = [EmulatedDetector(simulation, rngs) for rngs in (free, hidden)]
    joints: list[Points3] = []
    seen: tuple[list[Keypoints], list[Keypoints]] = ([], [])
    for truth, lab in watch(simulation, seeds, pushes, ENV_FRAMES):
        joints.append(truth.joints_world.copy())
        for frames, detector, between in zip(
            seen, detectors, (no_surroundings(len(seeds)), lab), strict=True
        ):
            frames.append(detector.detect(truth, between))
    simulation.close()
    return _Episodes(np.stack(joints), _stack(seen[0]), _stack(seen[1]))


def _stack(records: list[Keypoints]) -> Keypoints:
    px, confidence, sigma_px = (
        np.stack([getattr(each, name) for each in records])
        for name in ("px", "confidence", "sigma_px")
    )
    return Keypoints(px, confidence, sigma_px)


def simulate(batch: int, config: HRCConfig | None = None) -> Simulation:
    """Create the simulation of a batch of environments, without perception."""
    config = config or HRCConfig()
    return Simulation(
        batch, resolve_settings(perception="none", estimator="triangulation", config=config)
    )
