"""What is drawn for an episode stands in infos, as it was drawn, and in no observation."""

from typing import Any

import gymnasium
import numpy as np
import pytest

from hrc_env import HRCEnv, HRCVectorEnv, RigDistribution
from hrc_env.core.infos import is_of_belief
from hrc_env.perception.faults.fault import IMAGE, KINDS

LATE = {"kind": "late", "cameras": ["all"], "amount": [0.0, 0.3]}
TURNED = {"kind": "wrong_rotation", "cameras": ["camera_2"], "amount": [0.01, 0.03]}
LOST = {"kind": "lost", "cameras": ["camera_3"], "start_s": 2.0}


def drawn(info: dict[str, Any]) -> dict[str, float]:
    return {name: float(each) for name, each in info.items() if name.startswith("episode/")}


def test_amounts_of_faults_are_those_of_the_episode() -> None:
    env, told = HRCEnv(perception="keypoints", faults=[LATE, TURNED, LOST]), set()
    for seed in range(5):
        _, info = env.reset(seed=seed)
        late, turned, lost = env.faults
        assert info["episode/fault_late"] == late.max_amount
        assert info["episode/fault_wrong_rotation"] == turned.max_amount
        assert (info["episode/fault_lost"], lost.kind) == (1.0, "lost")
        assert 0 <= info["episode/delay_s"] - late.max_amount < 0.04
        told.add(late.max_amount)
        stepped = env.step(np.zeros(6, np.float32))[-1]
        assert drawn(stepped) == drawn(info)
    assert len(told) == 5


def test_nothing_is_told_of_what_is_as_it_was_made() -> None:
    _, info = HRCEnv(perception="keypoints").reset(seed=0)
    told = drawn(info)
    usual = {"episode/n_cameras": 4.0, "episode/light": 1.0, "episode/fault_darkness": 1.0}
    assert {name: value for name, value in told.items() if value} == usual
    known = {name.removeprefix("episode/fault_") for name in told if "fault" in name}
    assert known == {k for k, each in KINDS.items() if each.group != IMAGE or k == "darkness"}
    for level in ("truth", "none"):
        assert drawn(HRCEnv(perception=level).reset(seed=0)[1]) == {}


def test_the_rig_is_the_one_of_the_episode() -> None:
    env = HRCEnv(perception="keypoints")
    made = {camera.name: camera for camera in env.rig}
    options = {"cameras": RigDistribution(max_shift_m=0.2, max_rotation_rad=0.05, n_cameras=(2, 4))}
    counts = set()
    for seed in range(6):
        _, info = env.reset(seed=seed, options=options)
        moved_m = [
            np.linalg.norm(np.subtract(each.eye_world, made[each.name].eye_world))
            for each in env.rig
        ]
        assert info["episode/n_cameras"] == len(env.rig)
        assert info["episode/max_camera_shift_m"] == pytest.approx(max(moved_m))
        assert 0 < info["episode/max_camera_rotation_rad"] <= 0.05 + 1e-6
        counts.add(len(env.rig))
    assert len(counts) > 1
    _, info = env.reset(seed=0)
    assert (info["episode/n_cameras"], info["episode/max_camera_shift_m"]) == (4, 0)


def test_light_and_delays_are_told_of_each_environment_of_a_batch() -> None:
    options = [{"appearance": {"light": (0.2, 0.5)}}, {"faults": [LATE]}, {}]
    envs = HRCVectorEnv(3, num_threads=1)
    _, infos = envs.reset(seed=4, options={"each": options})
    assert 0.2 <= infos["episode/light"][0] <= 0.5
    assert (infos["episode/light"][1:] == 1).all()
    assert infos["episode/fault_late"][1] > 0
    assert envs.member(1).faults[0].max_amount == infos["episode/fault_late"][1]
    assert not infos["episode/fault_late"][[0, 2]].any()
    for k, each in enumerate(options):
        _, alone = HRCEnv(perception="keypoints").reset(seed=4 + k, options=each)
        assert drawn(alone) == drawn({name: infos[name][k] for name in infos})


def test_a_state_tells_what_was_drawn() -> None:
    env, other = HRCEnv(perception="keypoints"), HRCEnv(perception="keypoints")
    _, info = env.reset(seed=0, options={"faults": [LATE], "cameras": ["camera_1", "camera_3"]})
    other.reset(seed=1)
    other.set_state(env.get_state())
    assert drawn(other.step(np.zeros(6, np.float32))[-1]) == drawn(info)


def test_what_was_drawn_is_truth_and_in_no_observation() -> None:
    """Two episodes that differ in a fault that nobody has seen yet look the same."""
    env = HRCEnv(perception="keypoints")
    late = {**TURNED, "start_s": 5.0}
    free, _ = env.reset(seed=0)
    seen, info = env.reset(seed=0, options={"faults": [late]})
    assert info["episode/fault_wrong_rotation"] > 0
    np.testing.assert_array_equal(free, seen)
    assert not any(map(is_of_belief, drawn(info)))


@pytest.mark.usefixtures("pixels")
def test_faults_of_images_are_told_at_pixels() -> None:
    noise = {"kind": "noise", "cameras": ["all"], "amount": [5.0, 9.0]}
    env = gymnasium.make("HRCReach-v0", perception="pixels", faults=[noise], appearance="varied")
    _, info = env.reset(seed=0)
    assert 5.0 <= info["episode/fault_noise"] <= 9.0
    assert info["episode/light"] != 1.0
    assert len([name for name in info if name.startswith("episode/fault_")]) == len(KINDS)
    env.close()
