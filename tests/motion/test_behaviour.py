"""What workers do next, among each other and beside the robot."""

import dataclasses
import re

import numpy as np
import pytest
from recorded import started

from hrc_env.core.errors import ConfigError
from hrc_env.motion import generator
from hrc_env.motion import state as st
from hrc_env.motion.schedule import JOBS, WORK, Choice, Job, make_schedule, pick_job
from hrc_env.motion.traffic import APART_M
from hrc_env.worker.body import load_body, worker_truth
from hrc_env.worker.props import PROP_NAMES

NO_REACTIONS = generator.PEOPLE["unaware"]


def go_on(state, rngs, seconds, robot=None):
    """Roots (T, B, W, 2) and activities (T, B, W) every 0.1 s; the robot's points stay."""
    roots, doing = [], []
    for _ in range(round(seconds / 0.1)):
        _, motion = generator.advance(state, rngs, 0.1, 1)
        if robot is not None:
            generator.watch(state, np.broadcast_to(robot, (len(state.workers), 2, 3)), motion, 0.1)
        roots.append(motion.position_world[:, :, 0, :2])
        doing.append(generator.activity(state))
    return np.array(roots), np.array(doing)


def test_three_workers_keep_apart_for_a_minute():
    state, rngs = started(6, 3, seed=3)
    roots, _ = go_on(state, rngs, 60.0)
    assert np.isfinite(roots).all()
    for i, j in ((0, 1), (0, 2), (1, 2)):
        assert np.linalg.norm(roots[:, :, i] - roots[:, :, j], axis=-1).min() > APART_M - 0.15


def test_nobody_waits_long_for_a_way():
    state, rngs = started(6, 3, seed=4)
    longest = 0.0
    for _ in range(60):
        go_on(state, rngs, 1.0)
        since = state.workers["waiting_since_s"]
        longest = max(longest, np.where(since > 0.0, state.workers["clock_s"] - since, 0.0).max())
    assert longest < 9.0


def test_a_workers_day_does_not_depend_on_the_other_environments():
    many, few = started(3, 2, seed=5), started(1, 2, seed=5)
    a, b = go_on(*many, 30.0), go_on(*few, 30.0)
    np.testing.assert_array_equal(a[0][:, :1], b[0])


def test_every_task_leads_to_tasks_that_there_are():
    schedule = make_schedule(JOBS, ("wall", "pile"))
    assert {job.at for job in schedule.jobs} == {"robot", "here", "wall", "pile"}
    for shares in schedule.then:
        assert not shares or shares[-1][1] == pytest.approx(1.0)
        assert all(0 <= k < len(schedule.jobs) for k, _ in shares)
    choices = (Choice(4, 0.25), Choice(7, 1.0))
    assert pick_job(choices, 0.2) == 4
    assert pick_job(choices, 0.3) == 7


def test_a_task_of_ones_own_is_what_workers_do():
    jobs = (Job("drive nails", "hammer", "robot", (("drive nails", 1.0),)),)
    config = generator.MotionConfig(jobs=jobs, people=NO_REACTIONS)
    _, doing = go_on(*started(2, config=config), 20.0)
    allowed = {st.HAMMER, st.WALK, st.STEP_BACK, st.STUMBLE}
    assert st.HAMMER in doing
    assert set(np.unique(doing)) <= allowed


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"activity": "hamer"}, "hammer"),
        ({"at": "roof"}, "robot"),
        ({"prop": "piano"}, "prop"),
        ({"height_m": -0.1}, "height_m must be 0 to 2.2 m"),
    ],
)
def test_a_task_that_cannot_be_is_refused_with_what_can(change, message):
    job = dataclasses.replace(Job("work", "reach", "robot", (("work", 1.0),)), **change)
    with pytest.raises(ConfigError, match=message):
        generator.MotionConfig(jobs=(Job("x", "reach", "robot"), job))


def test_who_works_at_the_robots_foot_kneels_clear_of_its_pedestal_and_uses_tools():
    config = generator.MotionConfig(jobs=WORK["low_work"], near_probability=1.0)
    state, rngs = started(24, seed=2, config=config)
    body, axis_m = load_body(), np.array(state.mind.plan.grounds.robot_xy_m)
    is_leg = [name.endswith(("thigh", "shank", "foot")) for name in body.capsule_names]
    lowest_m, held, done = np.inf, set(), set()
    for _ in range(300):
        _, motion = generator.advance(state, rngs, 0.1, 1)
        truth = worker_truth(body, motion)
        legs, radius_m = truth.capsules_world[:, 0, is_leg], truth.capsule_radius_m[:, 0, is_leg]
        for share in (0.0, 0.5, 1.0):
            along = legs[..., 0, :2] * (1.0 - share) + legs[..., 1, :2] * share
            away_m = np.abs(along - axis_m).max(-1) - radius_m
            assert away_m.min() > 0.28  # half the foot plate's side
        lowest_m = min(lowest_m, truth.joints_world[:, 0, 9:11, 2].min())
        held |= set(np.unique(motion.held.kind).tolist())
        done |= {state.mind.schedule.jobs[k].name for k in state.workers["job"][:, 0].tolist()}
    assert lowest_m < 0.1  # a knee is on the floor
    assert {PROP_NAMES.index("drill"), PROP_NAMES.index("hammer")} <= held
    assert {name for name, _ in WORK["low_work"][0].then} <= done


def test_more_workers_than_fit_are_refused():
    with pytest.raises(ConfigError, match="n_workers=40"):
        generator.make_state(1, 40, load_body(), generator.MotionConfig())


def certain(**changes):
    """People who surely react."""
    people = generator.PeopleConfig(
        notice_m=9.0, careless_probability=0.0, detour_m=0.0, calm_s=99.0, **changes
    )
    return generator.MotionConfig(near_probability=1.0, people=people)


def test_who_notices_the_robot_pauses_after_a_while_and_goes_on():
    config = certain(pause_probability=1.0, step_back_probability=0.0, pause_s=(1.0, 1.0))
    state, rngs = started(8, config=config, seed=1)
    paces = []
    for _ in range(40):
        go_on(state, rngs, 0.1, robot=np.zeros(3))
        paces.append(state.workers["pace"][:, 0].copy())
    halted = np.array(paces) == 0.0
    assert halted.any(0).mean() > 0.7
    first = halted.argmax(0)[halted.any(0)] * 0.1
    assert first.min() >= 0.4
    assert (np.array(paces)[-1] == 1.0).all()


def test_who_steps_back_is_farther_from_the_robot_and_looks_the_same_way():
    config = certain(pause_probability=0.0, step_back_probability=1.0)
    state, rngs = started(8, config=config, seed=2)
    before = generator.current(state).position_world[:, 0, 0, :2]
    roots, doing = go_on(state, rngs, 7.0, robot=np.zeros(3))
    stepped = (doing == st.STEP_BACK).any(0)[:, 0]
    assert stepped.mean() > 0.6
    base = np.array(generator.OPEN_FLOOR.robot_xy_m)
    farthest = np.linalg.norm(roots[:, :, 0] - base, axis=-1).max(0)
    assert (farthest - np.linalg.norm(before - base, axis=-1))[stepped].min() > 0.2


def test_the_unaware_do_as_if_there_were_no_robot():
    config = generator.MotionConfig(people=NO_REACTIONS)
    seen, unseen = started(4, config=config, seed=6), started(4, config=config, seed=6)
    a = go_on(*seen, 20.0, robot=np.array([0.2, 0.0, 1.1]))[0]
    np.testing.assert_array_equal(a, go_on(*unseen, 20.0)[0])


def test_walkers_come_to_a_stand_and_then_go_where_they_wanted():
    config = certain(pause_probability=1.0, step_back_probability=0.0, pause_s=(0.8, 0.8))
    config = dataclasses.replace(config, dwell_s=(0.1, 0.2), near_probability=0.2)
    state, rngs = started(24, config=config, seed=7)
    runs = ["" for _ in range(24)]
    for _ in range(300):
        setting_out = (state.workers["activity"] == st.WALK) & (state.workers["time_s"] < 1.0)
        state.workers["calm_until_s"] = np.where(setting_out, 0.0, np.inf)  # only these startle
        _, doing = go_on(state, rngs, 0.1, robot=np.full(3, 0.5))
        runs = [run + "sw"[int(k == st.WALK)] for run, k in zip(runs, doing[0, :, 0], strict=True)]
    braked = [re.search("sw{5,30}s{7,9}w{8}", run) for run in runs]
    assert sum(match is not None for match in braked) > 5


def test_the_number_of_workers_is_drawn_and_the_others_are_far():
    state = generator.make_state(30, 3, load_body(), generator.MotionConfig(), fewest=1)
    rngs = [np.random.default_rng([8, b]) for b in range(30)]
    generator.reset(state, np.arange(30), rngs)
    assert set(state.workers["is_present"].sum(1)) == {1, 2, 3}
    roots, _ = go_on(state, rngs, 5.0)
    away = np.abs(roots).max((0, 3)) > 20.0
    np.testing.assert_array_equal(away, ~state.workers["is_present"])
