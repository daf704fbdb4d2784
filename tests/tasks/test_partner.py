"""Whose arms are welcome at what a robot holds: those of who stands there, and is nearest."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from hrc_env.core.skeleton import JOINT
from hrc_env.geometry.enclosure import CAPSULE, N_CAPSULES
from hrc_env.tasks import drywall, handover
from hrc_env.tasks.task import find_task
from hrc_env.world import FOOT_WORLD

RIGHT = [CAPSULE["right_forearm"], CAPSULE["right_hand"]]
"""Forearm and hand."""
UP = np.array([0.0, 0.0, 1.0])
HANDLE = FOOT_WORLD + handover.MEET_M
SCREW = FOOT_WORLD + drywall.SCREWS_M[1][:1] + [0.0, drywall.WALL_Y_M, drywall.SCREWS_M[1][1]]
AT = {"HRCHandover-v0": HANDLE, "HRCDrywall-v0": SCREW - [0.0, 0.1, 0.0]}
STANDS = {"HRCHandover-v0": handover.BESIDE_M, "HRCDrywall-v0": drywall.BESIDE_M}


def beliefs(task, stands_off_m, hand_off_m, tracked=(True, True)):
    """What is believed where each of two people is so far off where the task has them stand, with
    the right hand so far above where it works, and the robot holds what it should."""
    env = gymnasium.make(task, perception="truth", n_workers=2)
    env.reset(seed=1)
    now, at = env.unwrapped.simulation.belief, AT[task]
    mean = np.empty((1, 2, 15, 3))
    for w in range(2):
        feet = FOOT_WORLD[:2] + STANDS[task]
        mean[0, w] = [feet[0] + stands_off_m[w], feet[1], FOOT_WORLD[2] - 0.2]
        mean[0, w, JOINT["right_wrist"]] = at + np.array([0.1, 0.0, hand_off_m[w]])
        mean[0, w, JOINT["right_elbow"]] = at + np.array([0.4, 0.0, hand_off_m[w]])
        mean[0, w, JOINT["left_wrist"]] = at + 2.0 * UP
    estimate = replace(now.estimate, mean_world=mean, tracked=np.array([tracked]))
    middle = HANDLE - handover.HANDLE_UP_M * UP
    tool, upright = middle + handover.GRIP_UP_M * UP, np.array([1.0, 0.0, 0.0, 0.0])
    if task == "HRCDrywall-v0":
        middle, upright = FOOT_WORLD + drywall.PLACE_M, np.array([0.5**0.5, 0.5**0.5, 0.0, 0.0])
    objects = replace(
        now.objects, position_world=middle[None, None], quaternion_wxyz=upright[None, None],
        held=np.array([[True]]),
    )  # fmt: skip
    robot = replace(now.robot, tool_world=tool[None])
    return replace(now, estimate=estimate, objects=objects, robot=robot)


@pytest.mark.parametrize("task", AT)
@pytest.mark.parametrize(
    ("stands_off_m", "hand_off_m", "tracked", "who"),
    [
        ((0.0, 0.0), (0.0, 0.2), (True, True), 0),
        ((0.0, 0.0), (0.2, 0.0), (True, True), 1),
        ((0.0, 2.0), (0.2, 0.0), (True, True), 0),  # who passes by
        ((0.0, 0.0), (0.0, 0.2), (False, True), 1),
        ((0.0, 2.0), (1.5, 0.0), (True, True), None),
        ((0.0, 0.0), (0.0, 0.0), (False, False), None),
    ],
)
def test_the_arm_of_who_takes_part_is_welcome(task, stands_off_m, hand_off_m, tracked, who):
    now = beliefs(task, stands_off_m, hand_off_m, tracked)
    welcome = find_task(task)().allowed_contact(now)
    assert welcome.shape == (1, 2, N_CAPSULES)
    expected = np.zeros((1, 2, N_CAPSULES), bool)
    if who is not None:
        expected[0, who, RIGHT] = True
    np.testing.assert_array_equal(welcome, expected)


@pytest.mark.parametrize("task", AT)
def test_nobody_is_while_nothing_is_held_for_them(task):
    now = beliefs(task, (0.0, 0.0), (0.0, 0.2))
    low = now.objects.position_world - 0.6 * UP
    away = replace(now.robot, tool_world=now.robot.tool_world + 0.3 * UP)
    for other in (
        {"objects": replace(now.objects, position_world=low), "robot": away},
        {"objects": replace(now.objects, held=np.array([[False]])), "robot": away},
    ):
        alone = replace(now, **other)
        assert not find_task(task)().allowed_contact(alone).any()


@pytest.mark.parametrize("task", AT)
def test_without_workers_nobody_is(task):
    env = gymnasium.make(task, perception="none", n_workers=0)
    env.reset(seed=1)
    now = env.unwrapped.simulation.belief
    assert now.allowed_contact.shape == (1, 0, N_CAPSULES)
