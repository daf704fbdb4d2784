"""Speed of environments of other packages in steps per second.

This script does not import hrc_env, since gymnasium-robotics and robosuite need other versions of
MuJoCo and NumPy. It runs in a separate virtual environment:

    python3.11 -m venv others
    others/bin/pip install "gymnasium-robotics==1.4.2" "robosuite==1.5.2" "mujoco==3.5.*" "numpy<2"
    others/bin/python benchmarks/baselines_speed.py

Missing environments are reported. Actions are random, resets are included in the time, and infos
are read. The result is the median of several runs; within each run, all environments are measured
in turn.
"""

import statistics
import time
from typing import Any

import gymnasium

RUNS, SECONDS = 5, 4.0
"""Number of runs, and duration of each environment's measurement in a run [s]."""


def make_fetch_reach() -> Any:
    """Create the task of gymnasium-robotics in which a Fetch robot reaches for a point."""
    import gymnasium_robotics

    gymnasium.register_envs(gymnasium_robotics)
    return gymnasium.make("FetchReach-v4")


def make_lift() -> Any:
    """Create the task of robosuite in which a Panda robot lifts a cube, without cameras."""
    import robosuite
    from robosuite.wrappers import GymWrapper

    off = dict.fromkeys(("has_renderer", "has_offscreen_renderer", "use_camera_obs"), False)
    return GymWrapper(robosuite.make("Lift", robots="Panda", **off))


FACTORIES = {
    "Reacher-v5": lambda: gymnasium.make("Reacher-v5"),
    "FetchReach-v4": make_fetch_reach,
    "robosuite Lift, Panda": make_lift,
}
"""Functions that create the environments, by name."""


def measure_pace(env: Any) -> float:
    """Return the speed of an environment in steps per second."""
    n_steps, started_s = 0, time.perf_counter()
    env.reset()
    while time.perf_counter() - started_s < SECONDS:
        _, _, terminated, truncated, info = env.step(env.action_space.sample())
        for name in info:
            _ = info[name]
        if terminated or truncated:
            env.reset()
        n_steps += 1
    return n_steps / (time.perf_counter() - started_s)


def main() -> None:
    """Measure the speed of all environments and print it."""
    envs = {}
    for name, make in FACTORIES.items():
        try:
            envs[name] = make()
        except Exception as error:  # missing, or broken by newer packages
            print(
                f"{name} does not work ({error!r}); the top of this file describes the "
                "installation."
            )
    paces = [{name: measure_pace(env) for name, env in envs.items()} for _ in range(RUNS)]
    for name in envs:
        values = [paced[name] for paced in paces]
        spread = f"({min(values):,.0f}-{max(values):,.0f})"
        print(f"{name}: {statistics.median(values):,.0f} env-steps/s {spread}")


if __name__ == "__main__":
    main()
