"""Steps per second at level `pixels` with all cameras in each step, and times of the stages."""

import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from benchmarks.speed.stopwatch import Place, Stopwatch
from hrc_env.env import HRCEnv
from hrc_env.motion import generator
from hrc_env.perception.network import LANDMARK_SIDE, load_landmarker
from hrc_env.pipeline.image_tracking import ImageTracking
from hrc_env.pipeline.tracking import PoseTracking
from hrc_env.scene.canvas import Canvas
from hrc_env.scene.physics import Physics
from hrc_env.scene.render import CropRenderer

STAGES: Mapping[str, Sequence[Place]] = {
    "draw": ((Canvas, "pose"), (CropRenderer, "view")),
    "detect": ((ImageTracking, "detect"),),
    "track": ((PoseTracking, "perceive"),),
    "physics": ((Physics, "step"),),
    "motion": ((generator, "advance"), (generator, "watch")),
}
"""Functions of each stage, which are timed in the thread that steps the environment.

The stage `detect` is detection without rendering; it mainly consists of waiting for the network.
The stage `track` includes association.
"""
REST = "rest"
WARM_UP = 10
"""Number of warm-up steps before the measurement."""
ROUNDS = 60
"""Number of repetitions, with four crops each, for timing the network alone."""
LITERT, OPENVINO = "litert", "openvino"


class Setting(NamedTuple):
    """The conditions of a time measurement."""

    cameras: int
    workers: int
    scene: str = "lab"
    runtime: str = LITERT

    @property
    def name(self) -> str:
        """Name in metrics: numbers of cameras and workers, and scene or runtime unless default."""
        usual = {"lab", LITERT}
        special = (each for each in (self.scene, self.runtime) if each not in usual)
        return ".".join([str(self.cameras), str(self.workers), *special])


def network_ms(runtime: str, tick: Callable[[float], None]) -> dict[str, float]:
    """Measure the median time of the network for four crops on two threads [ms].

    The result "ms" is a lower bound on the time of a step.
    """
    landmarkers = [load_landmarker(runtime=runtime) for _ in range(2)]
    crop = np.random.default_rng(0).random((LANDMARK_SIDE, LANDMARK_SIDE, 3), np.float32)
    seconds = []
    with ThreadPoolExecutor(1) as helper:
        for _ in range(ROUNDS):
            started_s = time.perf_counter()
            other = helper.submit(lambda: [landmarkers[1](crop) for _ in range(2)])
            for _ in range(2):
                landmarkers[0](crop)
            other.result()
            seconds.append(time.perf_counter() - started_s)
            tick(1 / ROUNDS)
    return {"ms": 1e3 * float(np.median(seconds))}


def measure(
    setting: Setting, n_steps: int, seed: int, tick: Callable[[float], None]
) -> dict[str, Any]:
    """Measure the speed of an environment with random actions, and the times of its stages.

    The result contains "steps_per_s", from the median time of "n" steps, and "stages", the time of
    each stage per step [ms], from the same number of further steps.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # warning about few cameras
        env = HRCEnv(
            scene=setting.scene,
            cameras=list(range(setting.cameras)),
            n_workers=setting.workers,
            config={"detector": {"runtime": setting.runtime}},
        )
    try:
        actions = np.random.default_rng(seed)
        env.reset(seed=seed)
        _step(env, actions, WARM_UP)
        seconds = _step(env, actions, n_steps)
        tick(0.5)
        watch = Stopwatch(STAGES)
        with watch.running():
            total = sum(_step(env, actions, n_steps))
        tick(0.5)
    finally:
        env.close()
    stages = {name: 1e3 * s / n_steps for name, s in watch.seconds.items()}
    stages[REST] = 1e3 * total / n_steps - sum(stages.values())
    return {
        "steps_per_s": float(1 / np.median(seconds)),
        "stages": stages,
        "n": n_steps,
    }


def _step(env: HRCEnv, actions: np.random.Generator, n_steps: int) -> list[float]:
    """Take random actions and return the duration of each step [s]."""
    seconds = []
    for _ in range(n_steps):
        action = actions.uniform(-1, 1, env.simulation.n_actions).astype(np.float32)
        started_s = time.perf_counter()
        env.step(action)
        seconds.append(time.perf_counter() - started_s)
    return seconds
