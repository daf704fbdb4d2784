"""Steps a second of other people's environments: python peers_speed.py

Knows nothing of hrc_env: gymnasium-robotics and robosuite want other versions of MuJoCo and NumPy,
so this is for an environment of their own,

    python3.11 -m venv peers
    peers/bin/pip install "gymnasium-robotics==1.4.2" "robosuite==1.5.2" "mujoco==3.5.*" "numpy<2"
    peers/bin/python benchmarks/peers_speed.py

and where one of them is missing it says so. Random actions, resets inside, infos read; the median
of runs that take turns with Gymnasium's Reacher.
"""

import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import suppress

import gymnasium
import numpy as np

RUNS, SECONDS = 5, 4.0
Step = Callable[[], None]


def reacher() -> Step:
    """Gymnasium's Reacher, to compare by."""
    return _steps(gymnasium.make("Reacher-v5"))


def fetch_reach() -> Step:
    """gymnasium-robotics: a Fetch arm reaches for a point."""
    import gymnasium_robotics

    gymnasium.register_envs(gymnasium_robotics)
    return _steps(gymnasium.make("FetchReach-v4"))


def lift() -> Step:
    """robosuite: a Panda lifts a cube; no cameras."""
    import robosuite

    env = robosuite.make(
        "Lift", robots="Panda", has_renderer=False, has_offscreen_renderer=False,
        use_camera_obs=False,
    )  # fmt: skip
    env.reset()
    rng, (low, high) = np.random.default_rng(0), env.action_spec

    def step() -> None:
        if env.step(rng.uniform(low, high))[2]:
            env.reset()

    return step


def _steps(env: gymnasium.Env) -> Step:
    env.reset(seed=0)
    env.action_space.seed(0)

    def step() -> None:
        _, _, terminated, truncated, info = env.step(env.action_space.sample())
        for name in info:
            _ = info[name]
        if terminated or truncated:
            env.reset()

    return step


PEERS = {"Reacher-v5": reacher, "FetchReach-v4": fetch_reach, "robosuite Lift, Panda": lift}


def made() -> Iterator[tuple[str, Step]]:
    """Those that are installed and work; the others say what is the matter."""
    for name, make in PEERS.items():
        try:
            yield name, make()
        except ImportError as error:
            print(f"{name}: {error}; see the top of this file for how to install it.")
        except Exception as error:  # a peer that is broken by newer packages: say how
            print(f"{name}: is installed and does not work: {type(error).__name__}: {error}")


def pace(step: Step) -> float:
    """Steps a second."""
    n_steps, started_s = 0, time.perf_counter()
    while time.perf_counter() - started_s < SECONDS:
        step()
        n_steps += 1
    return n_steps / (time.perf_counter() - started_s)


def main() -> None:
    """Measure and print."""
    peers = dict(made())
    paces: dict[str, list[float]] = {name: [] for name in peers}
    for _ in range(RUNS):
        for name, step in peers.items():
            paces[name].append(pace(step))
    for name, values in paces.items():
        spread = f"({min(values):,.0f}-{max(values):,.0f})"
        print(f"{name}: {statistics.median(values):,.0f} env-steps/s {spread}")


if __name__ == "__main__":
    with suppress(KeyboardInterrupt):
        main()
