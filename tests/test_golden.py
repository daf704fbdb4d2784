"""Golden trajectories: an id is a promise; its numbers change only with a reason.

    python -m tests.test_golden             # by how much today's numbers differ, key by key
    python -m tests.test_golden --write     # the same, and writes tests/golden/*.json anew

They change only with a version bump or a line in the CHANGELOG that says why. Every term of the
observation and the reward and every key of the infos is kept. Numbers are compared to 1e-6 because
compilers of other machines may round differently, and to 0.05 where a picture was drawn; on one
machine, runs are bit-identical (tests/test_env.py).
"""

import json
import sys
from pathlib import Path
from typing import Any

import pytest

import hrc_env
from benchmarks.trajectory import cases_of, differences, play

GOLDEN = Path(__file__).parent / "golden"
N_STEPS, EVERY = 40, 5
TOLERANCES = {"pixels": 0.05}
"""What estimates of another renderer may differ by; actions do not depend on them."""
TOLERANCE = 1e-6
PLAYED = [(env_id, case) for env_id in hrc_env.IDS for case in cases_of(env_id)]


def kept_in(env_id: str, case: str) -> Path:
    return GOLDEN / f"{env_id}.{case}.json"


def read(env_id: str, case: str) -> dict[str, list[Any]]:
    return json.loads(kept_in(env_id, case).read_text())


@pytest.mark.parametrize(("env_id", "case"), PLAYED)
def test_the_trajectory_is_the_golden_one(env_id, case):
    apart = differences(read(env_id, case), play(env_id, case, N_STEPS, EVERY))
    tolerance = TOLERANCES.get(case, TOLERANCE)
    assert {name: size for name, size in apart.items() if not size <= tolerance} == {}


def test_a_difference_is_found_where_it_is():
    golden = read("HRCReach-v0", "truth")
    now = json.loads(json.dumps(golden))
    assert not any(differences(golden, now).values())
    now["observation/joint_angle_sin"][3][2] += 0.25
    now["worker/activity"][1] = ["dancing"]
    now["reward"][0] = 1.0
    now["extra"] = [0.0]
    del now["cost"]
    assert {name: size for name, size in differences(golden, now).items() if size} == {
        "observation/joint_angle_sin": pytest.approx(0.25),
        "worker/activity": float("inf"),
        "reward": float("inf"),
        "extra": float("inf"),
        "cost": float("inf"),
    }


def main(write: bool) -> None:
    """Print the largest change of every key that has one; write the files if asked."""
    for env_id, case in PLAYED:
        now, path = play(env_id, case, N_STEPS, EVERY), kept_in(env_id, case)
        before = read(env_id, case) if path.exists() else {}
        for name, size in differences(before, now).items():
            if size:
                print(f"{env_id} {case:12s} {name:40s} {size:.3g}")
        if write:
            lines = ",\n".join(f" {json.dumps(name)}: {json.dumps(now[name])}" for name in now)
            path.write_text(f"{{\n{lines}\n}}\n")


if __name__ == "__main__":
    main("--write" in sys.argv[1:])
