"""Trajectories to compare: every observation term, reward term and info key, by name.

`python -m benchmarks.trajectory ID CASE N_STEPS` prints one as JSON, and whose it is. Run as a file
in another checkout it plays that one: it imports nothing but `hrc_env`, by its public interface.
"""

import json
import math
import sys
from typing import Any

import gymnasium
import numpy as np

CASES: dict[str, dict[str, Any]] = {
    "keypoints": {"perception": "keypoints"},
    "truth": {"perception": "truth"},
    "none": {"perception": "none"},
    "pixels": {"perception": "pixels"},
    "site": {"perception": "keypoints", "scene": "site"},
    "two_workers": {"perception": "keypoints", "n_workers": 2},
    "tool": {"perception": "keypoints", "control": "tool"},
}
"""What is played: keyword arguments of `gymnasium.make`."""
NOT_OF = {"HRCDelivery-v0": ("tool",)}
"""Cases that there are not of an id: a base that drives has no tool."""
SEED = 11


def cases_of(env_id: str) -> list[str]:
    """What can be played of an id."""
    return [case for case in CASES if case not in NOT_OF.get(env_id, ())]


def play(env_id: str, case: str, n_steps: int, every: int = 1) -> dict[str, list[Any]]:
    """Seeded random actions; the reset and every so many steps, each value by its name.

    Returns:
        "observation/..." lists of numbers, "reward" and infos numbers, truth values or lists of
        words; None at moments that have no such key (a reset has no reward).
    """
    env = gymnasium.make(f"hrc_env:{env_id}", max_episode_steps=n_steps, **CASES[case])
    simulation: Any = env.unwrapped.simulation
    slices = simulation.layout.slices
    rng = np.random.default_rng(SEED)
    observation, info = env.reset(seed=SEED)
    moments = [_moment(observation, slices, info)]
    for step in range(1, n_steps + 1):
        action = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        observation, reward, _, _, info = env.step(action)
        if step % every == 0:
            moments.append(_moment(observation, slices, {"reward": reward, **info}))
    env.close()
    names = dict.fromkeys(name for moment in moments for name in moment)
    return {name: [moment.get(name) for moment in moments] for name in names}


def _moment(observation: Any, slices: dict[str, slice], told: dict[str, Any]) -> dict[str, Any]:
    seen = observation if isinstance(observation, dict) else {"observation": observation}
    flat = seen["observation"]
    terms = {f"observation/{name}": flat[part] for name, part in slices.items()}
    terms |= {name: part for name, part in seen.items() if part is not flat}
    return {name: _plain(value) for name, value in {**terms, **told}.items()}


def _plain(value: Any) -> Any:
    """As JSON has it; float32 with the digits that tell it from its neighbours."""
    if isinstance(value, np.ndarray):
        return [float(str(each)) for each in value.ravel()]
    if isinstance(value, tuple | list):
        return [str(each) for each in value]
    return value.item() if isinstance(value, np.generic) else value


def differences(one: dict[str, list[Any]], other: dict[str, list[Any]]) -> dict[str, float]:
    """The largest difference of every key; infinity where it is not one of numbers."""
    return {
        name: _apart(one[name], other[name]) if name in one and name in other else math.inf
        for name in [*one, *(name for name in other if name not in one)]
    }


def _apart(one: Any, other: Any) -> float:
    if isinstance(one, list) and isinstance(other, list):
        if len(one) != len(other):
            return math.inf
        return max(map(_apart, one, other), default=0.0)
    if isinstance(one, str | None) or isinstance(other, str | None):
        return 0.0 if one == other else math.inf
    if math.isnan(one) or math.isnan(other):
        return 0.0 if math.isnan(one) and math.isnan(other) else math.inf
    return 0.0 if one == other else abs(float(one) - float(other))


if __name__ == "__main__":
    played = play(sys.argv[1], sys.argv[2], int(sys.argv[3]))
    print(json.dumps({"package": sys.modules["hrc_env"].__file__, "trajectory": played}))
