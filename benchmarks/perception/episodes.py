"""Episodes of the environment, with the errors of the estimated joints in each step.

The arm is at rest, so that the motion of the worker depends on the seed only. Faults and perception
levels are therefore compared on the same motion.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from benchmarks.common import CHI2_95_3D, compute_normalized_square
from benchmarks.perception.views import family_index
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.env import HRCEnv
from hrc_env.geometry.cameras import project
from hrc_env.motion import generator
from hrc_env.worker.body import worker_truth


@dataclass(frozen=True, slots=True)
class Episode:
    """An episode of T steps with one worker, excluding the reset."""

    error_m: Floats
    """Position errors of the estimated joints (T, J) [m]; NaN if the worker is not tracked."""
    std_m: Floats
    """Square root of the trace of the reported covariance (T, J) [m]; NaN if the worker is not
    tracked.
    """
    inside95: Ints
    """Number of joints (T,) with the true position within the reported 95 % region."""
    off_px: Floats
    """Mean error (T, C) of the keypoints of each camera [px]; NaN without a detection."""
    family: Ints
    """Index (T,) in `views.FAMILIES` of the family of the worker's activity."""
    named: Bools
    """Mask (T, C) of cameras that are reported as miscalibrated."""

    def to_json(self) -> dict[str, Any]:
        """Return lists of numbers for JSON, rounded to four decimals.

        Missing values are NaN.
        """
        arrays = {each.name: np.asarray(getattr(self, each.name), float) for each in fields(self)}
        return {name: np.round(values, 4).tolist() for name, values in arrays.items()}


def read_episode(content: dict[str, Any]) -> Episode:
    """Create an episode from the result of `Episode.to_json`."""
    arrays = {name: np.array(values, float) for name, values in content.items()}
    return Episode(**{**arrays, "named": arrays["named"] > 0})


def select_steps(episode: Episode, steps: Bools | slice) -> Episode:
    """Return an episode that contains only the selected steps."""
    names = [each.name for each in fields(Episode)]
    return Episode(*(getattr(episode, name)[steps] for name in names))


def play(
    seeds: Sequence[int], n_steps: int, tick: Callable[[float], None], **arguments: Any
) -> list[Episode]:
    """Simulate one episode per seed in an environment with the given keyword arguments.

    The arm is at rest.
    """
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
        off_px[t] = _measure_error_px(env, joints)
        named[t] = simulation.pipeline.suspected_cameras(np.array([0]))[0]
        if estimate.tracked[0, 0]:
            offset, cov = estimate.mean_world[0, 0] - joints, estimate.cov_world[0, 0]
            error[t] = np.linalg.norm(offset, axis=-1)
            std[t] = np.sqrt(np.trace(cov, axis1=-2, axis2=-1))
            inside[t] = np.count_nonzero(compute_normalized_square(offset, cov) < CHI2_95_3D)
    return Episode(error, std, inside, off_px, family, named)


def _measure_error_px(env: HRCEnv, joints_world: Floats) -> Floats:
    """Return the mean error (C,) of the current step's keypoints [px]; NaN without a detection."""
    keypoints, _ = env.simulation.pipeline.last_detections(0)
    cameras = env.simulation.scene.cameras
    if keypoints is None:
        return np.full(len(cameras), np.nan)
    true_px, _ = project(np.stack([camera.P for camera in cameras]), joints_world[None])
    away = np.linalg.norm(keypoints.px[0, :, 0] - true_px[0], axis=-1)
    seen: Bools = np.isfinite(away)
    total = np.where(seen, away, 0.0).sum(-1)
    return np.where(seen.any(-1), total / np.maximum(seen.sum(-1), 1), np.nan)
