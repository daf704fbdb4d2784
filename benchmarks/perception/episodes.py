"""Episodes of the environment: where the belief was, where the worker was, step by step.

The arm rests, so that the worker of a seed moves in the same way whatever the cameras do: faults
and levels are compared on the very same motion.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from benchmarks.common import CHI2_95_3D, normalised_square
from benchmarks.perception.views import family_index
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.env import HRCEnv
from hrc_env.geometry.cameras import project
from hrc_env.motion import generator
from hrc_env.worker.body import worker_truth


@dataclass(frozen=True, slots=True)
class Episode:
    """One episode of T steps, one worker; the reset's look is not in it."""

    error_m: Floats
    """(T, J) of the estimate; NaN where the worker was not tracked."""
    std_m: Floats
    """(T, J) root of the trace of what was reported; NaN likewise."""
    inside95: Ints
    """(T,) joints within the reported 95 % region."""
    off_px: Floats
    """(T, C) mean distance of a camera's keypoints from the true joints; NaN: nothing found."""
    family: Ints
    """(T,) what the worker did, an index of `views.FAMILIES`."""
    named: Bools
    """(T, C) whether a camera was named in info as miscalibrated."""

    def to_json(self) -> dict[str, Any]:
        """Lists of numbers, lengths to a tenth of a millimetre; NaN where unknown."""
        arrays = {each.name: np.asarray(getattr(self, each.name), float) for each in fields(self)}
        return {name: np.round(values, 4).tolist() for name, values in arrays.items()}


def episode_of(content: dict[str, Any]) -> Episode:
    """What `Episode.to_json` gave."""
    arrays = {name: np.array(values, float) for name, values in content.items()}
    return Episode(**{**arrays, "named": arrays["named"] > 0})


def some_steps(episode: Episode, steps: Bools | slice) -> Episode:
    """An episode's steps that are asked for."""
    names = [each.name for each in fields(Episode)]
    return Episode(*(getattr(episode, name)[steps] for name in names))


def play(
    seeds: Sequence[int], n_steps: int, tick: Callable[[float], None], **arguments: Any
) -> list[Episode]:
    """An episode a seed of an environment, made with these arguments, whose arm rests."""
    env = HRCEnv(n_workers=1, **arguments)
    try:
        episodes = []
        for seed in seeds:
            episodes.append(_episode(env, seed, n_steps))
            tick(1 / len(seeds))
        return episodes
    finally:
        env.close()


def _episode(env: HRCEnv, seed: int, n_steps: int) -> Episode:
    simulation = env.simulation
    n_cameras = len(simulation.scene.cameras)
    error, std = np.full((2, n_steps, N_JOINTS), np.nan)
    inside, family = np.zeros((2, n_steps), np.int64)
    off_px, named = np.full((n_steps, n_cameras), np.nan), np.zeros((n_steps, n_cameras), bool)
    env.reset(seed=seed)
    rest = np.zeros(env.action_space.shape or (0,), np.float32)
    for t in range(n_steps):
        env.step(rest)
        truth = worker_truth(simulation.bodies, generator.current(simulation.motion))
        joints, estimate = truth.joints_world[0, 0], simulation.estimate
        family[t] = family_index(int(generator.activity(simulation.motion)[0, 0]))
        off_px[t] = _off_px(env, joints)
        named[t] = simulation.pipeline.suspected_cameras(np.array([0]))[0]
        if estimate.tracked[0, 0]:
            offset, cov = estimate.mean_world[0, 0] - joints, estimate.cov_world[0, 0]
            error[t] = np.linalg.norm(offset, axis=-1)
            std[t] = np.sqrt(np.trace(cov, axis1=-2, axis2=-1))
            inside[t] = np.count_nonzero(normalised_square(offset, cov) < CHI2_95_3D)
    return Episode(error, std, inside, off_px, family, named)


def _off_px(env: HRCEnv, joints_world: Floats) -> Floats:
    """(C,) how far the keypoints of this step are from the truth; NaN: none."""
    keypoints, _ = env.simulation.pipeline.last_detections(0)
    cameras = env.simulation.scene.cameras
    if keypoints is None:
        return np.full(len(cameras), np.nan)
    true_px, _ = project(np.stack([camera.P for camera in cameras]), joints_world[None])
    away = np.linalg.norm(keypoints.px[0, :, 0] - true_px[0], axis=-1)
    seen: Bools = np.isfinite(away)
    total = np.where(seen, away, 0.0).sum(-1)
    return np.where(seen.any(-1), total / np.maximum(seen.sum(-1), 1), np.nan)
