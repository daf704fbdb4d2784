"""The bench of one camera by the worker's yaw: what it sorts, and what it counts."""

import numpy as np
import pytest

from benchmarks import facing
from benchmarks.facing import YAWS, count_errors, find_yaw, measure_level
from hrc_env.core.skeleton import JOINTS, N_JOINTS
from hrc_env.experiments.ablations.play import make_walks
from hrc_env.experiments.rigs import ALL, N_WARM_UP
from hrc_env.geometry.rotations import about_axis

pytestmark = pytest.mark.slow  # a study is played

SEEDS = (5, 6, 7, 8)


def body_facing(yaw_deg: float) -> np.ndarray:
    """(1, J, 3) an upright body at the origin that looks that way from world +x."""
    joints = np.zeros((1, N_JOINTS, 3))
    joints[..., 2] = 1.0
    joints[0, [name.startswith("left") for name in JOINTS], 1] = 0.2
    joints[0, [name.startswith("right") for name in JOINTS], 1] = -0.2
    return joints @ about_axis("z", np.radians(yaw_deg)).T


@pytest.mark.parametrize(
    ("yaw_deg", "expected"), [(0, 0), (20, 0), (-25, 1), (90, 2), (-90, 2), (140, 3), (175, 4)]
)
def test_a_body_is_sorted_by_its_angle_to_the_camera_on_either_side(yaw_deg, expected):
    eyes = np.array([[4.0, 0.0, 2.5], [0.0, 4.0, 2.5]])
    assert find_yaw(body_facing(yaw_deg), eyes)[0, 0] == expected
    assert find_yaw(body_facing(yaw_deg + 90), eyes)[0, 1] == expected


def test_every_joint_that_is_free_counts_once_at_its_yaw():
    walks = make_walks("lab", 1, SEEDS, N_WARM_UP + 4)
    all_four = count_errors("keypoints", "kalman", ALL, walks, SEEDS)
    free = sum(all_four[f"free.{yaw}"] for yaw in YAWS)
    assert (free <= 4 * 4 * N_JOINTS).all()
    assert (free > 2 * 4 * N_JOINTS).all()
    assert sum(all_four[f"error_m.{yaw}"].sum() for yaw in YAWS) == free.sum()
    alone = count_errors("keypoints", "kalman", (1,), walks, SEEDS)
    assert [sum(alone[f"free.{yaw}"][b] for yaw in YAWS) > 0 for b in range(4)] == [
        False, True, False, False,
    ]  # fmt: skip


def test_numbers_of_every_yaw_are_there(monkeypatch):
    monkeypatch.setattr(facing, "ESTIMATORS", {"keypoints": ("kalman",)})
    metrics = measure_level("keypoints", 4, facing.Facing(seconds=1.2))
    assert {name.split(".")[2] for name in metrics} == {str(yaw) for yaw in YAWS}
    there = [metrics[f"missed.keypoints.{yaw}"].value for yaw in YAWS]
    assert all(0 <= share <= 1 for share in there if share == share)
    assert np.isfinite(metrics["error_m.keypoints.90.kalman.median"].value)
