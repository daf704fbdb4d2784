"""Steps a second of other people's environments: python baselines_speed.py

Knows nothing of hrc_env: gymnasium-robotics and robosuite want other versions of MuJoCo and NumPy,
so this is for an environment of their own,

    python3.11 -m venv others
    others/bin/pip install "gymnasium-robotics==1.4.2" "robosuite==1.5.2" "mujoco==3.5.*" "numpy<2"
    others/bin/python benchmarks/baselines_speed.py

and where one of them is missing it says so. Random actions, resets inside, infos read; the median
of runs that take turns with Gymnasium's Reacher.
"""

import statistics
import time
from typing import Any

import gymnasium

RUNS, SECONDS = 5, 4.0


def fetch_reach() -> Any:
    """gymnasium-robotics: a Fetch arm reaches for a point."""
    import gymnasium_robotics

    gymnasium.register_envs(gymnasium_robotics)
    return gymnasium.make("FetchReach-v4")


def lift() -> Any:
    """robosuite: a Panda lifts a cube; no cameras."""
    import robosuite
    from robosuite.wrappers import GymWrapper

    off = dict.fromkeys(("has_renderer", "has_offscreen_renderer", "use_camera_obs"), False)
    return GymWrapper(robosuite.make("Lift", robots="Panda", **off))


MADE = {
    "Reacher-v5": lambda: gymnasium.make("Reacher-v5"),
    "FetchReach-v4": fetch_reach,
    "robosuite Lift, Panda": lift,
}


def pace(env: Any) -> float:
    """Steps a second."""
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
    """Measure and print."""
    envs = {}
    for name, make in MADE.items():
        try:
            envs[name] = make()
        except Exception as error:  # not there, or broken by newer packages: say how
            print(f"{name} does not work ({error!r}); the top of this file says how to install it.")
    paces = [{name: pace(env) for name, env in envs.items()} for _ in range(RUNS)]
    for name in envs:
        values = [each[name] for each in paces]
        spread = f"({min(values):,.0f}-{max(values):,.0f})"
        print(f"{name}: {statistics.median(values):,.0f} env-steps/s {spread}")


if __name__ == "__main__":
    main()
