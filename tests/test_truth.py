"""Belief and truth do not mix: who perturbs the truth moves cost and errors, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from hrc_env import simulation
from hrc_env.core.records import WorkerTruth
from hrc_env.env import HRCEnv
from hrc_env.pipeline.sensor_input import TrueSensorInput
from hrc_env.worker.body import worker_capsules, worker_truth

SHIFT_M = np.array([0.02, -0.01, 0.03])
ON_THE_TRUTH = ("cost", "episode_cost", "safety/", "tracking/")
"""Infos that are counted on the truth."""


def slower(now, command, dt_s):
    """A shield that says what it was given."""
    nearest_m = now.separation.distance_m.min(-1, initial=1.0)
    return 0.5 * command, {"nearest_m": np.minimum(nearest_m, 1.0)}


def rolled(level: str) -> list[tuple[np.ndarray, dict[str, object]]]:
    env = HRCEnv(perception=level, shield=slower)
    seen = [env.reset(seed=3)]
    for _ in range(25):
        observation, _, _, _, info = env.step(np.full(6, 0.6, np.float32))
        seen.append((observation, info))
    env.close()
    return seen


def perturb(patch: pytest.MonkeyPatch) -> None:
    """Let cost and metrics have another truth than the emulator and the level `truth`."""

    bodies = {}

    def shifted(them, motion) -> WorkerTruth:
        bodies["now"], truth = them, worker_truth(them, motion)
        joints, capsules = truth.joints_world + SHIFT_M, truth.capsules_world + SHIFT_M
        return replace(truth, joints_world=joints, capsules_world=capsules)

    def sensor_input(ids, q, motion, truth, present) -> TrueSensorInput:
        return TrueSensorInput(ids, q, motion, worker_truth(bodies["now"], motion), present)

    patch.setattr(simulation, "worker_truth", shifted)
    patch.setattr(simulation, "TrueSensorInput", sensor_input)
    patch.setattr(simulation, "worker_capsules", lambda *given: worker_capsules(*given) + SHIFT_M)


@pytest.mark.parametrize(
    "level", ["none", "truth", "keypoints", pytest.param("pixels", marks=pytest.mark.slow)]
)
def test_another_truth_moves_cost_and_errors_and_nothing_else(level, monkeypatch):
    plain = rolled(level)
    perturb(monkeypatch)
    moved = set()
    for (before, info), (after, other) in zip(plain, rolled(level), strict=True):
        np.testing.assert_array_equal(before, after)
        assert info.keys() == other.keys()
        moved |= {name for name in info if info[name] != other[name]}
    assert all(name.startswith(ON_THE_TRUTH) for name in moved), moved
    assert "safety/min_separation_m" in moved
    assert ("tracking/mpjpe_m" in moved) == (level != "none")
