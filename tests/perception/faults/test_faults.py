"""Faults of cameras: who has them, when, and that they change nothing else."""

import pickle
from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.env import HRCEnv
from hrc_env.perception.faults.fault import KINDS, FaultConfig
from hrc_env.perception.faults.schedule import Frame, Schedule
from hrc_env.scene.rig import LAB_CAMERAS, make_cameras
from hrc_env.vector.env import HRCVectorEnv

RIG = LAB_CAMERAS[:2]
DT = 0.04
NOT_OF_IMAGES = [kind for kind, each in KINDS.items() if each.group != "image"]


def schedule(*faults, rig=RIG):
    return Schedule(rig, faults, DT)


def first(kind, amount=None, **when):
    return FaultConfig(kind, ("camera_1",), amount, **when)


def film(plan, c=0, n=12, seed=7):
    return [plan.frame(seed, step, c) for step in range(n)]


def rolled(n_steps=40, seed=7, **kwargs):
    env = HRCEnv(**{"perception": "keypoints", **kwargs})
    env.reset(seed=seed)
    infos = [env.step(np.zeros(6))[4] for _ in range(n_steps)]
    env.close()
    return infos


def test_without_faults_every_image_is_of_now():
    assert film(schedule(), n=3) == [Frame(0, 0), Frame(1, 1), Frame(2, 2)]
    assert schedule().is_plain


def test_a_fault_is_of_its_cameras_and_of_its_time_only():
    plan = schedule(first("lost", start_s=0.12, end_s=0.24))
    assert [frame is None for frame in film(plan, n=8)] == [False] * 3 + [True] * 3 + [False] * 2
    assert film(plan, c=1) == film(schedule(), c=1)


def test_cameras_of_a_fault_are_named_or_counted_among_those_in_use():
    named = schedule(FaultConfig("lost", ("camera_2",)))
    counted = schedule(FaultConfig("lost", (1,)))
    turned = schedule(FaultConfig("lost", (0, "camera_2")), rig=RIG[::-1])
    for c in range(2):
        assert film(named, c) == film(counted, c)
        assert film(turned, c) == film(named, 1 - c)
    assert film(counted, 1) == [None] * 12


@pytest.mark.parametrize("choice", [2, -1, 7])
def test_an_index_of_no_camera_is_refused_with_those_that_are(choice):
    with pytest.raises(ConfigError, match=r"camera_1, camera_2.* 0 to 1"):
        schedule(FaultConfig("lost", (choice,)))


def test_the_environment_counts_a_faults_cameras_among_those_that_it_uses():
    """As the rows of its arrays are; `cameras` itself counts those that hang in the scene."""
    env = HRCEnv(
        perception="keypoints", cameras=["camera_3", 0],
        faults=[{"kind": "lost", "cameras": [np.int64(0)]}],
    )  # fmt: skip
    env.reset(seed=0)
    env.step(np.zeros(6))
    seen = env.simulation.pipeline.last_detections(0)[0]
    assert env.simulation.settings["cameras"] == ("camera_3", "camera_1")
    assert np.isnan(seen.px).all((-3, -2, -1)).ravel().tolist() == [True, False]


def test_a_frozen_camera_shows_its_last_image_as_if_new():
    assert film(schedule(first("frozen", start_s=0.16)), n=7)[3:] == [
        Frame(3, 3), Frame(3, 4), Frame(3, 5), Frame(3, 6),
    ]  # fmt: skip


def test_late_images_say_when_they_were_taken():
    late = film(schedule(first("late", 0.1)), n=6)
    assert late == [None, None, None, Frame(0, 0), Frame(1, 1), Frame(2, 2)]


def test_a_camera_out_of_step_says_now_and_shows_before():
    assert film(schedule(first("out_of_step", 2)), n=5)[2:] == [
        Frame(0, 2),
        Frame(1, 3),
        Frame(2, 4),
    ]


def test_dropped_images_are_missing_at_random_and_the_same_for_the_same_episode():
    plan = schedule(first("dropped", 0.3))
    missing = [frame is None for frame in film(plan, n=2000)]
    assert np.mean(missing) == pytest.approx(0.3, abs=0.04)
    assert film(plan, n=50) == film(plan, n=50)
    assert film(plan, n=50) != film(plan, n=50, seed=8)


def test_a_slow_camera_gives_images_at_its_rate_and_latency():
    slow = replace(RIG[0], rate_hz=12.5, latency_s=0.04)
    frames = film(schedule(rig=(slow, RIG[1])), n=6)
    assert frames == [None, Frame(0, 0), None, Frame(2, 2), None, Frame(4, 4)]


def test_wrong_calibrations_are_as_large_as_said_and_drawn_for_the_episode():
    rig = make_cameras(RIG)
    amounts = {"wrong_rotation": 0.1, "wrong_translation": 0.2, "wrong_focal": 0.1, "knocked": 0.3}
    for kind, amount in amounts.items():
        plan = schedule(first(kind, amount, start_s=1.0))
        assert plan.actual_cameras(rig, 5, 0) is rig
        real, told = plan.actual_cameras(rig, 5, 25)[0], rig[0]
        assert plan.actual_cameras(rig, 5, 30)[0] is real
        turn = real.T_world_from_cam[:3, :3].T @ told.T_world_from_cam[:3, :3]
        angle = np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))
        turned = amount if kind in ("wrong_rotation", "knocked") else 0.0
        assert angle == pytest.approx(turned, abs=1e-6)
        moved = np.linalg.norm(real.eye_world - told.eye_world)
        assert moved == pytest.approx(amount if kind == "wrong_translation" else 0.0, abs=1e-9)
        longer = real.K[0, 0] / told.K[0, 0] - 1
        assert longer == pytest.approx(amount if kind == "wrong_focal" else 0.0)
        assert plan.actual_cameras(rig, 5, 25)[1] is rig[1]


@pytest.mark.parametrize("kind", NOT_OF_IMAGES)
def test_a_fault_changes_what_is_seen_and_nothing_of_the_world(kind):
    plain = rolled()
    spoilt = rolled(faults=[{"kind": kind, "cameras": ["camera_1"], "start_s": 0.4}])
    for name in ("safety/min_separation_m", "worker_0/activity", "task/goals_reached"):
        assert [info.get(name) for info in plain] == [info.get(name) for info in spoilt]
    error = [[info.get("tracking/mpjpe_m") for info in each] for each in (plain, spoilt)]
    assert error[0][:9] == error[1][:9]
    assert error[0] != error[1]


@pytest.mark.parametrize("kind", NOT_OF_IMAGES)
def test_a_batch_with_faults_is_its_environments_one_by_one(kind):
    faults = [FaultConfig(kind, ("camera_1", "camera_3"), start_s=0.2)]
    batch = HRCVectorEnv(3, faults=faults, num_threads=1)
    together = [batch.reset(seed=10)[0]]
    together += [batch.step(np.zeros((3, 6)))[0] for _ in range(12)]
    for k in range(3):
        env = HRCEnv(perception="keypoints", faults=faults)
        alone = [env.reset(seed=10 + k)[0]]
        alone += [env.step(np.zeros(6))[0] for _ in range(12)]
        np.testing.assert_array_equal([each[k] for each in together], alone)
    batch.close()


def test_an_episode_goes_on_from_a_pickle_in_the_middle_of_a_fault():
    faults = [
        FaultConfig("late", ("camera_1",), 0.12),
        FaultConfig("frozen", ("camera_2",), None, 0.2),
    ]
    env = HRCEnv(perception="keypoints", faults=faults)
    env.reset(seed=1)
    for _ in range(8):
        env.step(np.zeros(6))
    other = pickle.loads(pickle.dumps(env))
    for _ in range(10):
        np.testing.assert_array_equal(env.step(np.zeros(6))[0], other.step(np.zeros(6))[0])


def test_all_cameras_may_be_lost_for_a_while():
    infos = rolled(100, faults=[FaultConfig("lost", ("all",), None, 0.8, 2.8)])
    assert infos[66]["tracking/lost"] == 1.0
    assert infos[-1]["tracking/lost"] == 0.0


def test_of_somebody_who_walks_late_images_tell_more_than_images_that_claim_to_be_new():
    """The tracker uses images at their own time, where they say it."""
    errors = {}
    for kind, amount in (("late", 0.2), ("out_of_step", 5.0)):
        infos = rolled(100, seed=7, faults=[FaultConfig(kind, ("all",), amount)])[60:]
        errors[kind] = np.median([info["tracking/mpjpe_m"] for info in infos])
    assert errors["late"] < 0.8 * errors["out_of_step"]


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ({"kind": "lost"}, "cameras is missing"),
        ({"kind": "lost", "cameras": []}, "must name its cameras"),
        ({"kind": "lost", "cameras": ["camera_9"]}, "camera_1"),
        ({"kind": "broken", "cameras": ["camera_1"]}, "Unknown fault"),
        ({"kind": "late", "cameras": ["camera_1"], "amount": 3.0}, "from 0 to 1 s"),
        ({"kind": "late", "cameras": ["camera_1"], "amount": "much"}, "from 0 to 1 s"),
        ({"kind": "lost", "cameras": ["camera_1"], "start_s": 2.0, "end_s": 1.0}, "end after"),
        ({"kind": "defocus", "cameras": ["camera_1"]}, 'use perception="pixels"'),
        ({"kind": "lost", "cameras": ["camera_1"], "to_s": 1.0}, "Unknown config field"),
    ],
)
def test_what_is_no_fault_is_refused_in_words(fault, said):
    with pytest.raises(ConfigError, match=said):
        HRCEnv(perception="keypoints", faults=[fault])


@pytest.mark.parametrize("faults", ["lost", {"kind": "lost"}, 3, FaultConfig("lost", ("all",))])
def test_faults_are_a_list(faults):
    with pytest.raises(ConfigError, match="list"):
        HRCEnv(perception="keypoints", faults=faults)


def test_faults_without_cameras_are_refused():
    with pytest.raises(ConfigError, match="Faults need cameras"):
        HRCEnv(perception="truth", faults=[FaultConfig("lost", ("all",))])


def test_faults_are_part_of_the_config_too():
    fault = {"kind": "lost", "cameras": ["camera_1"]}
    env = gymnasium.make("HRCReach-v0", perception="keypoints", config={"faults": [fault]})
    assert env.unwrapped.config.faults == (FaultConfig("lost", ("camera_1",)),)
