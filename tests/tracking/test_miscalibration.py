"""Cameras that are not where they are said to be are named in info, at levels that have cameras."""

import numpy as np
import pytest

from hrc_env.core.infos import MISCALIBRATED, MORE_PEOPLE
from hrc_env.core.vacancy import Coverage, Vacancy, no_others
from hrc_env.env import HRCEnv
from hrc_env.infos import perception_info
from hrc_env.vector.env import HRCVectorEnv

KNOCKED = ({"kind": "knocked", "cameras": ["camera_3"]},)
REST = np.zeros(6, np.float32)


def last_info(env, steps, seed=3):
    _, info = env.reset(seed=seed)
    assert info[MISCALIBRATED] == 0
    for _ in range(steps):
        info = env.step(REST)[-1]
    return info


def test_a_knocked_camera_is_named():
    env = HRCEnv(perception="keypoints", faults=KNOCKED)
    assert env.words(last_info(env, 60))[MISCALIBRATED] == ("camera_3",)


def test_nobody_is_named_without_a_fault():
    env = HRCEnv(perception="keypoints")
    assert last_info(env, 60)[MISCALIBRATED] == 0


@pytest.mark.parametrize("kind", ["frozen", "out_of_step", "late"])
def test_bad_cameras_in_their_right_place_are_not_named(kind):
    env = HRCEnv(perception="keypoints", faults=[{"kind": kind, "cameras": ["camera_3"]}])
    assert last_info(env, 100)[MISCALIBRATED] == 0


@pytest.mark.parametrize("level", ["truth", "none"])
def test_levels_without_cameras_say_nothing(level):
    env = HRCEnv(perception=level)
    assert MISCALIBRATED not in env.reset(seed=0)[1]
    assert MISCALIBRATED not in env.step(REST)[-1]


def test_a_vector_names_what_its_environments_would():
    env = HRCVectorEnv(3, perception="keypoints", faults=KNOCKED, num_threads=1)
    single = HRCEnv(perception="keypoints", faults=KNOCKED)
    env.reset(seed=2)
    last_info(single, 40)
    for _ in range(40):
        infos = env.step(np.tile(REST, (3, 1)))[-1]
    pipeline, one = single.simulation.pipeline, np.array([0])
    suspected, vacancy = pipeline.suspected_cameras(one), pipeline.vacancy(one)
    cameras = single.simulation.settings["cameras"]
    assert infos[MISCALIBRATED][1] == perception_info(cameras, suspected, vacancy)[MISCALIBRATED][0]
    assert infos[f"_{MISCALIBRATED}"].all()
    one, many = single.simulation.pipeline.monitored, env.shards.parts[0].pipeline.monitored
    np.testing.assert_array_equal(one[0], many[1])


def test_what_is_suspected_is_part_of_the_state():
    env = HRCEnv(perception="keypoints", faults=KNOCKED)
    last_info(env, 35)
    state = env.get_state()
    first = [env.step(REST)[-1][MISCALIBRATED] for _ in range(20)]
    env.set_state(state)
    assert [env.step(REST)[-1][MISCALIBRATED] for _ in range(20)] == first


def test_a_reset_forgets():
    env = HRCEnv(perception="keypoints", faults=KNOCKED)
    assert env.words(last_info(env, 60))[MISCALIBRATED] == ("camera_3",)
    assert env.reset(seed=4)[1][MISCALIBRATED] == 0


def test_cameras_are_named():
    flags = np.array([[False, True], [True, False], [False, False]])
    coverage = Coverage(np.zeros((0, 3)), 0.1, np.zeros(0, int), np.ones((1, 2), bool))
    vacancy = Vacancy(coverage, np.zeros((3, 1, 1), int), np.zeros((3, 1)), no_others(3))
    info = perception_info(("a", "b"), flags, vacancy)
    assert info[MISCALIBRATED].tolist() == [1, 1, 0]
    assert info[f"{MISCALIBRATED}_a"].tolist() == [0, 1, 0]
    assert info[f"{MISCALIBRATED}_b"].tolist() == [1, 0, 0]
    assert not info[MORE_PEOPLE].any()
    assert perception_info((), flags[:, :0], None) == {}
