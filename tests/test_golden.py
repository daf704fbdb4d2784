"""Golden trajectories: an id is a promise; its numbers change only with a reason.

    python tests/test_golden.py      # writes tests/golden/*.json anew

They change only with a version bump or a line in the CHANGELOG that says why. Numbers are
compared to 1e-6 because compilers of other machines may round differently; on one machine,
runs are bit-identical (tests/test_env.py).
"""

import json
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import hrc_env

GOLDEN = Path(__file__).parent / "golden"
LEVELS = ("keypoints", "truth", "none")
KEYS = ("cost", "safety/min_separation_m", "tracking/mpjpe_m", "task/goals_reached")


def trajectory(env_id: str, level: str) -> dict[str, list[float]]:
    """Forty steps of seeded random actions, every fifth one written down."""
    env = gymnasium.make(env_id, perception=level)
    rng = np.random.default_rng(11)
    observation, _ = env.reset(seed=11)
    kept: dict[str, list[float]] = {"observation_sum": [float(observation.astype(float).sum())]}
    for step in range(1, 41):
        action = rng.uniform(-1, 1, 6).astype(np.float32)
        observation, reward, _, _, info = env.step(action)
        if step % 5 == 0:
            kept["observation_sum"].append(float(observation.astype(float).sum()))
            kept.setdefault("reward", []).append(float(reward))
            for key in KEYS:
                if key in info:
                    kept.setdefault(key, []).append(float(info[key]))
    return kept


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("env_id", hrc_env.IDS)
def test_the_trajectory_is_the_golden_one(env_id, level):
    golden = json.loads((GOLDEN / f"{env_id}.{level}.json").read_text())
    now = trajectory(env_id, level)
    assert now.keys() == golden.keys()
    for name, values in golden.items():
        np.testing.assert_allclose(now[name], values, rtol=1e-6, atol=1e-6, err_msg=name)


if __name__ == "__main__":
    GOLDEN.mkdir(exist_ok=True)
    for each_id in hrc_env.IDS:
        for each in LEVELS:
            content = json.dumps(trajectory(each_id, each), indent=1)
            (GOLDEN / f"{each_id}.{each}.json").write_text(content + "\n")
