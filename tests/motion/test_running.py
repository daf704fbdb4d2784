"""Running: as fast as wished where the way is long enough, with flights, arms and leans."""

import dataclasses

import numpy as np
import pytest
from recorded import started

from benchmarks.motion.statistics import ANKLES, HEAD, WRISTS, knee_flexion_deg, slips
from hrc_env.core.errors import ConfigError
from hrc_env.motion import generator
from hrc_env.motion import state as st
from hrc_env.motion.repertoire import HASTY, REPERTOIRE, make_worker, perform
from hrc_env.worker.body import SEGMENT, load_body

DT_S = 0.01
TOES = [SEGMENT["left_toes"], SEGMENT["right_toes"]]
RUNS = {name: float(name.split()[1]) for name in HASTY if name.startswith("run")}


def played(scene, body="worker_1"):
    return perform(scene, make_worker(load_body(body)), np.random.default_rng(0), DT_S)[0]


@pytest.fixture(scope="module", params=[(n, b) for n in RUNS for b in ("worker_1", "worker_5")])
def run(request):
    name, body = request.param
    film = played(HASTY[name], body)
    film_speed = film.motion.velocity_world[:, 0, 0, 0]
    return dataclasses.replace(film, time_s=film.time_s), RUNS[name], film_speed


def fast(run):
    """The frames at the top speed, and the places of all segments in them."""
    film, wished, speed = run
    when = speed > 0.97 * wished
    return when, film.motion.position_world[when, 0]


def aloft(film, when):
    """(n,) whether neither foot is on the floor."""
    place = film.motion.position_world[:, 0]
    low = np.minimum(place[:, TOES, 2] - place[0, TOES, 2], place[:, ANKLES, 2] - 0.1)
    return (low[when] > 0.01).all(1)


def test_they_reach_the_speed_that_is_wished_and_lose_it_again(run):
    _, wished, speed = run
    assert speed.max() == pytest.approx(wished, rel=0.03)
    assert (speed > 0.95 * wished).sum() * DT_S > 0.8
    assert np.abs(speed[[0, -1]]).max() < 0.1
    assert np.abs(np.diff(speed)).max() / DT_S < 9.0


def test_both_feet_leave_the_floor_as_they_never_do_in_a_walk(run):
    film, _, _ = run
    assert 0.1 < aloft(film, fast(run)[0]).mean() < 0.5
    walk = played(REPERTOIRE["walk 1.4 m/s"])
    assert not aloft(walk, np.ones(len(walk.time_s), bool)).any()


def test_cadence_and_knees_are_those_of_runners(run):
    film, wished, _ = run
    assert 150 < 60 / film.worker["step_period"] < 205
    _, place = fast(run)
    for side in ("left", "right"):
        flexion = knee_flexion_deg(place, side)
        assert 90 < flexion.max() < 140
        assert flexion.min() > 2.0 or wished > 3.2  # the smallest come to their full stretch


def test_arms_are_bent_and_swing_against_the_legs(run):
    _, place = fast(run)
    upper, fore, hand = (place[:, SEGMENT[f"left_{n}"]] for n in ("upper_arm", "forearm", "hand"))
    a, b = fore - upper, hand - fore
    cosine = (a * b).sum(-1) / np.linalg.norm(a, axis=-1) / np.linalg.norm(b, axis=-1)
    bent = np.degrees(np.arccos(cosine))
    assert 45 < bent.min() < bent.max() < 130
    ahead = hand[:, 0] - place[:, 0, 0]
    foot = place[:, SEGMENT["left_foot"], 0] - place[:, 0, 0]
    assert np.ptp(ahead) > 0.25
    assert np.corrcoef(ahead, foot)[0, 1] < -0.4


def test_they_lean_into_what_changes_their_speed(run):
    film, wished, speed = run
    place = film.motion.position_world[:, 0]
    lean = place[:, SEGMENT["head"], 0] - place[:, 0, 0]
    gains = np.gradient(speed, DT_S)
    assert lean[gains > 2.0].mean() > lean[speed > 0.97 * wished].mean() + 0.05
    assert lean[gains < -2.0].mean() < lean[speed > 0.97 * wished].mean() - 0.05


def test_no_foot_is_in_the_floor_and_none_slides(run):
    film, _, _ = run
    toes = film.motion.position_world[:, 0, TOES, 2]
    assert toes.min() > toes[0].min() - 0.003
    assert np.percentile(slips(film), 95) < 0.12


def test_nothing_jumps(run):
    film, wished, _ = run
    velocity = film.motion.velocity_world[:, 0]
    rate = np.linalg.norm(np.diff(velocity, axis=0), axis=-1) / DT_S
    assert rate[:, [0, 3, *HEAD]].max() < 90.0
    assert np.percentile(rate[:, WRISTS], 99.9) < 75.0
    assert np.percentile(rate[:, ANKLES], 99.9) < 40.0 * wished
    assert np.percentile(rate[:, ANKLES], 99.9) > 30.0  # as those of people


def running(**people):
    settings = {"run_probability": 1.0, "stumble_probability": 0.0, "tempo": 0.3, **people}
    return generator.MotionConfig(people=generator.PeopleConfig(**settings))


def seen(config, grounds, seconds, batch=8):
    """Activities and speeds over the floor (T, B) every 0.1 s."""
    state = generator.make_state(batch, 1, load_body(), config, grounds)
    rngs = [np.random.default_rng([4, b]) for b in range(batch)]
    generator.reset(state, np.arange(batch), rngs)
    doing, speed = [], []
    for _ in range(round(seconds / 0.1)):
        _, motion = generator.advance(state, rngs, 0.1, 1)
        doing.append(generator.activity(state)[:, 0])
        speed.append(np.linalg.norm(motion.velocity_world[:, 0, 0, :2], axis=-1))
    return np.array(doing), np.array(speed)


def wide(half_m):
    """A square floor with two places in opposite corners."""
    corner = half_m - 0.1
    places = tuple(
        dataclasses.replace(place, xy_m=(x + 3.0, y))
        for place, x, y in zip(
            generator.OPEN_FLOOR.places[2:], (-corner, corner), (-corner, corner), strict=True
        )
    )
    return dataclasses.replace(
        generator.OPEN_FLOOR,
        places=places,
        walkable_x_m=(3.0 - half_m, 3.0 + half_m),
        walkable_y_m=(-half_m, half_m),
    )


def test_who_runs_does_where_there_is_room_and_nowhere_else():
    config = dataclasses.replace(running(), near_probability=0.0)
    doing, speed = seen(config, wide(2.5), 60.0)
    assert (doing == st.RUN).any(0).all()
    top = speed[doing == st.RUN].max()
    assert 3.0 < top < 3.7
    doing, speed = seen(config, wide(0.8), 60.0)
    assert not (doing == st.RUN).any()
    assert (doing == st.WALK).any()


def test_nobody_runs_who_is_not_asked_to():
    state, rngs = started(16, seed=3)
    for _ in range(600):
        generator.advance(state, rngs, 0.1, 1)
        assert not np.isin(generator.activity(state), (st.RUN, st.FALL)).any()


def test_runners_who_notice_the_robot_brake():
    people = {"notice_m": 9.0, "pause_probability": 1.0, "step_back_probability": 0.0}
    config = dataclasses.replace(running(**people), near_probability=0.0)
    state = generator.make_state(16, 1, load_body(), config, wide(2.5))
    rngs = [np.random.default_rng([6, b]) for b in range(16)]
    generator.reset(state, np.arange(16), rngs)
    lasted, braked = np.zeros(16), 0
    for _ in range(400):
        setting_out = (state.workers["activity"] == st.RUN) & (state.workers["time_s"] < 0.6)
        state.workers["calm_until_s"] = np.where(setting_out, 0.0, np.inf)  # only these startle
        planned = state.workers["duration_s"][:, 0].copy()
        _, motion = generator.advance(state, rngs, 0.1, 1)
        generator.watch(state, np.full((16, 2, 3), 0.5), motion, 0.1)
        runs = state.workers["activity"][:, 0] == st.RUN
        braked += (runs & (state.workers["duration_s"][:, 0] < planned - 0.3)).sum()
        lasted = np.where(runs, lasted + 0.1, 0.0)
    assert braked > 5


@pytest.mark.parametrize("speed", [(1.0, 3.0), (2.5, 6.0), (3.5, 2.5), (np.nan, 3.0)])
def test_speeds_at_which_nobody_runs_are_refused(speed):
    with pytest.raises(ConfigError, match="run_m_s must"):
        generator.PeopleConfig(run_m_s=speed)
