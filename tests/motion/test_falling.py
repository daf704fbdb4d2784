"""Falling: quickly down, on the floor and not in it, for a while, and up again."""

import dataclasses

import numpy as np
import pytest
from recorded import started

from benchmarks.motion.statistics import ANKLES, HEAD, WRISTS, knee_flexion_deg
from hrc_env.core.errors import ConfigError
from hrc_env.motion import generator
from hrc_env.motion import state as st
from hrc_env.motion.activities.falling import plan_fall
from hrc_env.motion.paths import lay_path
from hrc_env.motion.points import Point
from hrc_env.motion.repertoire import HASTY, OPEN, make_worker, perform
from hrc_env.motion.schedule import Job
from hrc_env.motion.state import N_START
from hrc_env.scene.build import build
from hrc_env.worker.body import SEGMENT, load_body, worker_names, worker_truth

DT_S = 0.01
TRUNK = ("pelvis", "abdomen", "torso", "chest", "left_shoulder", "right_shoulder")


@pytest.fixture(scope="module", params=worker_names())
def falls(request):
    """The films of a worker's falls, and the lowest points (T, K) of their capsules."""
    body, films = load_body(request.param), []
    for k in range(4):
        me = make_worker(body, (0.3, -0.2), 0.7, right=k < 2)
        film = perform(HASTY["fall"], me, np.random.default_rng([2, k]), DT_S)[0]
        truth = worker_truth(body, film.motion)
        low = truth.capsules_world[:, 0, :, :, 2].min(-1) - truth.capsule_radius_m[:, 0]
        films.append((film, dict(zip(body.capsule_names, low.T, strict=True))))
    return films


def since(film):
    """(T,) time after the foot was caught, and when they lie and when they begin to get up."""
    time_s = film.time_s - film.worker["trip_at"]
    lies = 1.2 / film.worker["fall_pace"]
    return time_s, (time_s > lies) & (time_s < lies + film.worker["lie_s"])


def test_they_are_on_the_floor_within_a_second_or_so(falls):
    for film, low in falls:
        time_s, _ = since(film)
        hands = np.minimum(low["left_hand"], low["right_hand"])
        lands = time_s[(hands < 0.03) & (time_s > 0.2)][0]
        trunk = np.min([low[name] for name in TRUNK], 0)
        lies = time_s[(trunk < 0.03) & (time_s > 0.0)][0]
        assert 0.45 < lands < 0.8
        assert 0.6 < lies < 1.1


def test_they_lie_on_the_floor_and_not_in_it(falls):
    for film, low in falls:
        _, lying = since(film)
        trunk = np.min([low[name] for name in TRUNK], 0)
        assert lying.sum() * DT_S == pytest.approx(film.worker["lie_s"], abs=0.03)
        assert np.abs(trunk[lying]).max() < 0.02
        assert film.motion.position_world[lying, 0, HEAD, 2].max() < 0.5


def test_nothing_is_far_in_the_floor_at_any_time(falls):
    """Kneeling knees and gripping hands are less round than their capsules."""
    for _, low in falls:
        for name, height in low.items():
            soft = name.endswith(("thigh", "hand", "foot", "upper_arm"))
            assert height.min() > (-0.075 if soft else -0.03), name
        assert np.min([low[name] for name in TRUNK]) > -0.005


def test_they_get_up_and_stand_where_it_was_planned(falls):
    for film, _ in falls:
        place = film.motion.position_world[:, 0]
        assert place[-1, 0, 2] == pytest.approx(place[0, 0, 2], abs=0.01)
        end = [film.worker["end_x"], film.worker["end_y"]]
        assert np.linalg.norm(place[-1, 0, :2] - end) < 0.05
        assert np.linalg.norm(film.motion.velocity_world[-1, 0], axis=-1).max() < 0.2


def test_nothing_jumps(falls):
    for film, _ in falls:
        velocity = film.motion.velocity_world[:, 0]
        rate = np.linalg.norm(np.diff(velocity, axis=0), axis=-1) / DT_S
        assert rate[:, [0, 3, *HEAD]].max() < 90.0
        assert np.percentile(rate[:, WRISTS], 99.5) < 90.0
        assert np.percentile(rate[:, ANKLES], 99.9) < 60.0
        assert np.linalg.norm(velocity, axis=-1).max() < 7.0


def test_joints_stay_within_what_people_can_do(falls):
    for film, _ in falls:
        place = film.motion.position_world[:, 0]
        for side in ("left", "right"):
            assert knee_flexion_deg(place, side).min() > -1.0
            assert knee_flexion_deg(place, side).max() < 158.0
            upper, fore, hand = (
                place[:, SEGMENT[f"{side}_{n}"]] for n in ("upper_arm", "forearm", "hand")
            )
            a, b = fore - upper, hand - fore
            cosine = (a * b).sum(-1) / np.linalg.norm(a, axis=-1) / np.linalg.norm(b, axis=-1)
            assert np.degrees(np.arccos(cosine.clip(-1, 1))).max() < 155.0


def test_hands_and_knees_that_bear_weight_stay_where_they_are(falls):
    """From where they begin to push themselves up until the hands leave the floor."""
    for film, _ in falls:
        time_s, lying = since(film)
        up = time_s - time_s[lying][-1]
        hands = film.controls[(up > 0.2) & (up < 1.8), 20:26]
        assert np.ptp(hands, 0).max() < 0.04


def falling(**people):
    settings = {"fall_probability": 1.0, "tempo": 0.3, "lie_s": (1.0, 2.0), **people}
    config = generator.MotionConfig(people=generator.PeopleConfig(**settings))
    return dataclasses.replace(config, near_probability=0.3)


def gone_on(state, rngs, seconds, robot=None):
    """Motions and activities (T, B, W) every 0.1 s."""
    motions, doing = [], []
    for _ in range(round(seconds / 0.1)):
        _, motion = generator.advance(state, rngs, 0.1, 1)
        if robot is not None:
            generator.watch(state, np.broadcast_to(robot, (len(state.workers), 2, 3)), motion, 0.1)
        motions.append(motion)
        doing.append(generator.activity(state))
    return motions, np.array(doing)


@pytest.mark.parametrize("scene", ["lab", "site"])
def test_who_falls_falls_where_there_is_room(scene):
    body, grounds = load_body(), build(name=scene).grounds
    state = generator.make_state(12, 1, body, falling(), grounds)
    rngs = [np.random.default_rng([3, b]) for b in range(12)]
    generator.reset(state, np.arange(12), rngs)
    motions, doing = gone_on(state, rngs, 90.0)
    fallen, n = doing[:, :, 0] == st.FALL, 0
    for motion, falls in zip(motions, fallen, strict=True):
        points = (
            worker_truth(body, motion).capsules_world[falls, 0].mean(-2)[..., :2].reshape(-1, 2)
        )
        n += len(points)
        for x, y, half_x, half_y, yaw in grounds.blocked:
            away = points - (x, y)
            along = np.abs(away @ (np.cos(yaw), np.sin(yaw))) - half_x
            across = np.abs(away @ (-np.sin(yaw), np.cos(yaw))) - half_y
            assert np.maximum(along, across).min(initial=1.0) > 0.02
    assert fallen.any(0).sum() > 5
    assert n > 1000


def test_where_there_is_no_room_nobody_falls():
    me = make_worker(load_body())
    lay_path(Point(0.0, 0.0), np.zeros((0, 3)), Point(4.0, 0.0), me)
    draws = np.random.default_rng(0).random(N_START)
    assert plan_fall(draws, 0.0, 1.2, 2.0, OPEN, me) > 6.0
    narrow = OPEN._replace(slack=np.full((401, 401), -0.1))
    assert plan_fall(draws, 0.0, 1.2, 2.0, narrow, me) == -1.0
    lay_path(
        Point(0.0, 0.0), np.zeros((0, 3)), Point(1.0, 0.0), me
    )  # too short a way to stumble on
    assert plan_fall(draws, 0.0, 1.2, 2.0, OPEN, me) == -1.0


def test_others_keep_clear_of_who_lies():
    state, rngs = started(8, 3, seed=2, config=falling())
    nearest = np.inf
    for _ in range(600):
        _, motion = generator.advance(state, rngs, 0.1, 1)
        place = motion.position_world
        for b, w in np.argwhere(generator.activity(state) == st.FALL):
            if place[b, w, 3, 2] < 0.4:
                others = np.delete(place[b, :, 0, :2], w, 0)
                mine = place[b, w, [0, 5, SEGMENT["left_foot"]], :2]
                nearest = min(nearest, np.linalg.norm(others[:, None] - mine, axis=-1).min())
    assert 0.3 < nearest < 2.0


def test_the_same_seed_is_the_same_fall_alone_or_among_others():
    config = falling(run_probability=0.5)
    many, few = started(3, 2, seed=5, config=config), started(1, 2, seed=5, config=config)
    a, doing = gone_on(*many, 40.0)
    b, _ = gone_on(*few, 40.0)
    assert (doing[:, 0] == st.FALL).any()
    for one, other in zip(a, b, strict=True):
        np.testing.assert_array_equal(one.position_world[:1], other.position_world)


def test_some_stay_down():
    state, rngs = started(8, seed=1, config=falling(stay_down_probability=1.0))
    motions, _ = gone_on(state, rngs, 30.0)
    lying = np.array([motion.position_world[:, 0, 3, 2] < 0.4 for motion in motions])
    longest = max(
        len(run) for b in range(8) for run in "".join(".x"[k] for k in lying[:, b] * 1).split(".")
    )
    assert longest * 0.1 > 12.0


def test_the_robot_halts_nobody_in_a_fall():
    people = {"notice_m": 9.0, "pause_probability": 1.0, "step_back_probability": 0.0}
    state, rngs = started(8, seed=2, config=falling(**people, calm_s=0.0))
    seen = 0
    for _ in range(300):
        _, motion = generator.advance(state, rngs, 0.1, 1)
        generator.watch(state, np.full((8, 2, 3), 0.5), motion, 0.1)
        falls = state.workers["activity"] == st.FALL
        seen += falls.sum()
        assert (state.workers["pace"][falls & (state.workers["time_s"] > 0.4)] == 1.0).all()
    assert seen > 100


@pytest.mark.parametrize("activity", ["fall", "run", "walk"])
def test_a_way_to_go_is_no_job(activity):
    with pytest.raises(ConfigError, match="reach"):
        generator.MotionConfig(jobs=(Job("work", activity, "robot"),))


@pytest.mark.parametrize(
    "wrong", [{"fall_probability": 1.5}, {"lie_s": (3.0, 1.0)}, {"stay_down_probability": -0.1}]
)
def test_falls_that_cannot_be_are_refused(wrong):
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        generator.PeopleConfig(**wrong)
