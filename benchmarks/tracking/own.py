"""A second, independent source of motion: the environment's own worker and its detector.

The bench's walkers (`walks`) and the environment's worker (`hrc_env.motion`) share no
code, and neither do the bench's white detections and the environment's emulator, whose errors
last for half a second, have heavy tails and come with honest or dishonest confidence.
"""

from functools import lru_cache

import numpy as np

from benchmarks.tracking.rigs import Rig
from hrc_env.config import HRCConfig, settle
from hrc_env.core.records import Keypoints
from hrc_env.core.typing import Bools, Floats, Points3
from hrc_env.geometry.cameras import projections
from hrc_env.geometry.sight import nothing
from hrc_env.motion import generator
from hrc_env.perception import emulator
from hrc_env.simulation import Simulation
from hrc_env.tracking.config import ParticleConfig, of_kind
from hrc_env.worker.body import worker_truth

OWN = "own"
"""Name of the rig: the environment's room and its four cameras."""
OWN_CONDITIONS = ("four_cameras", "two_cameras", "one_camera", "occluded")
"""With nothing in the way: all cameras, the first two, and all but for 4 s, in which one is
left; then all with the room and a moving robot in the way of their lines of sight."""
OWN_FRAMES = 150
ALONE_FRAMES = slice(25, 125)
_SLOWNESS = 0.95


def make_own_rig() -> Rig:
    """The environment's cameras and tracker settings."""
    simulation = _simulation(1)
    P = projections(simulation.scene.cameras)
    simulation.close()
    return Rig(OWN, P, (np.nan, np.nan), of_kind(HRCConfig().tracker, ParticleConfig))


def record(condition: str, seeds: list[int]) -> tuple[Points3, Keypoints]:
    """Joints (T, S, 1, J, 3) [m] and keypoints (T, S, C, 1, J, ...), one episode per seed."""
    joints, free, hidden = _episodes(tuple(seeds))
    if condition == "occluded":
        return joints, hidden
    blind: Bools = np.zeros(free.confidence.shape, bool)
    if condition == "two_cameras":
        blind[:, :, 2:] = True
    elif condition == "one_camera":
        left = np.array(seeds) % blind.shape[2]
        others = np.arange(blind.shape[2]) != left[:, None]
        blind[ALONE_FRAMES] = others[:, :, None, None]
    return joints, _without(free, blind)


def _without(keypoints: Keypoints, blind: Bools) -> Keypoints:
    return Keypoints(
        np.where(blind[..., None], np.nan, keypoints.px),
        np.where(blind, 0.0, keypoints.confidence),
        np.where(blind, np.inf, keypoints.sigma_px),
    )


@lru_cache(maxsize=1)
def _episodes(seeds: tuple[int, ...]) -> tuple[Points3, Keypoints, Keypoints]:
    """Joints, keypoints with free lines of sight, and keypoints with the robot in the way."""
    batch, config = len(seeds), HRCConfig()
    simulation = _simulation(batch)
    everyone = np.arange(batch)
    simulation.reset(everyone, [np.random.default_rng([seed, 9]) for seed in seeds])
    rngs = [[np.random.default_rng([seed, 10, k]) for seed in seeds] for k in range(3)]
    cameras = simulation.scene.cameras
    states = [
        emulator.make_state(batch, len(cameras), 1, config.ctrl_dt, config.emulator)
        for _ in range(2)
    ]
    for state, own in zip(states, rngs, strict=False):
        emulator.reset(state, everyone, own)
    joints, seen = [], ([], [])  # type: ignore[var-annotated]
    action = np.zeros((batch, simulation.n_actions))
    for _ in range(OWN_FRAMES):
        action = _wander(action, rngs[2])
        simulation.step(np.clip(action, -1, 1))
        motion = generator.current(simulation.motion)
        truth = worker_truth(simulation.bodies, motion)
        lab = simulation.scene.surroundings(simulation.physics.q, motion.held)
        joints.append(truth.joints_world.copy())
        for k, between in enumerate((nothing(batch), lab)):
            seen[k].append(
                emulator.emulate(states[k], rngs[k], truth, between, cameras, config.emulator)
            )
    simulation.close()
    return np.stack(joints), _stacked(seen[0]), _stacked(seen[1])


def _wander(action: Floats, rngs: list[np.random.Generator]) -> Floats:
    """The robot's next action: it moves about slowly."""
    push = np.stack([rng.standard_normal(action.shape[1]) for rng in rngs])
    return _SLOWNESS * action + np.sqrt(1 - _SLOWNESS**2) * push


def _stacked(records: list[Keypoints]) -> Keypoints:
    px, confidence, sigma_px = (
        np.stack([getattr(each, name) for each in records])
        for name in ("px", "confidence", "sigma_px")
    )
    return Keypoints(px, confidence, sigma_px)


def _simulation(batch: int) -> Simulation:
    return Simulation(batch, settle(perception="none", estimator="triangulation"))
