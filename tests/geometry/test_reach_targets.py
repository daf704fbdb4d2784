"""Where tools have to get to: an arm that is too short is refused before anything happens."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.env import HRCEnv
from hrc_env.geometry.reach import ReachTarget, check_reach, wrist_reach
from hrc_env.scene.build import build
from hrc_env.tasks import pick_place
from hrc_env.tasks.task import find_task
from hrc_env.world import FOOT_WORLD, TaskScene
from tests.tasks.variants import vary

ARM = build(robot="ur10e_gripper").chain


def test_a_wrist_gets_as_far_as_the_data_sheet_says():
    """Upper arm, forearm and the wrist's second length in line, its first across."""
    shoulder_world, most_m = wrist_reach(ARM)
    np.testing.assert_allclose(shoulder_world, FOOT_WORLD + np.array([0.0, 0.0, 0.1807]))
    assert most_m == pytest.approx(np.hypot(0.6127 + 0.57155 + 0.11985, 0.17415))


@pytest.mark.parametrize(
    ("x_m", "along", "fits"),
    [
        (1.55, None, True), (1.65, None, False),  # with the tool stretched out
        (1.25, (0.0, 0.0, -1.0), True), (1.35, (0.0, 0.0, -1.0), False),  # from above
        (1.55, (1.0, 0.0, 0.0), True), (1.10, (-1.0, 0.0, 0.0), False),  # from before, from behind
    ],
)  # fmt: skip
def test_it_depends_on_where_the_tool_points(x_m, along, fits):
    spot = ReachTarget("the thing", wrist_reach(ARM)[0] + [x_m, 0.0, 0.0], along)
    if fits:
        check_reach("T-v0", "arm", ARM, [spot])
        return
    with pytest.raises(ConfigError, match=r"T-v0: the thing at \(.* out of reach .*'arm'.*1\.32 m"):
        check_reach("T-v0", "arm", ARM, [spot])


def test_goals_too_far_away_are_refused():
    said = r"the nearest goal at .* out of reach of the robot 'ur10e_like': .* closer"
    for task in ("HRCReach-v0", "HRCReachGoal-v0"):
        with pytest.raises(ConfigError, match=said):
            gymnasium.make(task, perception="none", config={"task": {"distance_m": (2.0, 2.5)}})


def test_so_is_what_a_task_puts_too_far_away():
    mjcf = pick_place.PickPlace().make_scene().mjcf
    far = TaskScene(mjcf.replace('name="stud_1" pos="0.2', 'name="stud_1" pos="2.2'))
    task = vary(pick_place.PickPlace, id="Far-v0", make_scene=lambda self: far)
    with pytest.raises(ConfigError, match=r"Far-v0: object 'stud_1' at \(1\.47"):
        HRCEnv(task, perception="none")


def test_a_command_for_a_hand_that_an_arm_has_not_is_refused():
    env = HRCEnv("HRCReach-v0", perception="none", n_workers=0)
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=r"\(6,\).*\(7,\)"):
        env.step(np.zeros(7, np.float32))
    env.close()


@pytest.mark.parametrize(("size", "fits"), [(1.0, True), (0.7, True), (0.35, False)])
def test_an_arm_that_is_too_short_for_most_goals_is_refused(size, fits):
    """The package's arm, scaled, would reach the nearest goals with a third of its length."""
    own = ARM.parent_from_joint.copy()
    own[1:, :3, 3] *= size
    tool = ARM.link_from_tool.copy()
    tool[:3, 3] *= size
    short = replace(ARM, parent_from_joint=own, link_from_tool=tool)
    for task in ("HRCReach-v0", "HRCReachGoal-v0"):
        nearest, middle = find_task(task)().reach_targets()
        check_reach(task, "short", short, [nearest])
        if fits:
            check_reach(task, "short", short, [middle])
        else:
            with pytest.raises(ConfigError, match=r"the center of its goals at .* out of reach"):
                check_reach(task, "short", short, [middle])
