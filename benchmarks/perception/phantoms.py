"""Rooms without anybody: how often the eyes see somebody there."""

from collections.abc import Callable

import numpy as np

from hrc_env.env import HRCEnv

EPISODE_STEPS = 250


def count(scene: str, n_steps: int, seed: int, tick: Callable[[float], None]) -> dict[str, int]:
    """Look for workers in a scene that has none, while the arm moves at random.

    Args:
        scene: its name.
        n_steps: how often every camera looks.
        seed: of the first episode tried; those in which somebody comes are passed over.
        tick: told of the share that is done.

    Returns:
        "images" that were looked at, those with somebody in them, and "tracked" steps.
    """
    found = {"images": 0, "phantoms": 0, "tracked": 0}
    env = HRCEnv(scene=scene, n_workers=(0, 1))
    try:
        actions = np.random.default_rng(seed)
        steps = 0
        while steps < n_steps:
            env.reset(seed=seed)
            seed += 1
            if env.simulation.present.any():
                continue
            n = min(EPISODE_STEPS, n_steps - steps)
            for _ in range(n):
                env.step(actions.uniform(-1, 1, env.simulation.n_actions).astype(np.float32))
                keypoints, _ = env.simulation.pipeline.last_detections(0)
                if keypoints is not None:
                    somebody = (keypoints.confidence[0] > 0).any((1, 2))
                    found["images"] += len(somebody)
                    found["phantoms"] += int(somebody.sum())
                found["tracked"] += int(env.simulation.estimate.tracked.any())
                tick(1 / n_steps)
            steps += n
    finally:
        env.close()
    return found
