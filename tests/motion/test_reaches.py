"""Scripted reaches: when and where they happen, their limits, and the reaches that were found."""

import json
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from recorded import watched

import hrc_env
from hrc_env.core.errors import ConfigError
from hrc_env.core.versions import read_versions
from hrc_env.motion import generator
from hrc_env.motion import state as ws
from hrc_env.motion.anatomy import GRIP_M
from hrc_env.motion.config import FOUND, PEOPLE, MotionConfig
from hrc_env.motion.reaches import (
    APART_S,
    LEAD_S,
    Reach,
    ReachDistribution,
    draw_script,
    make_script,
    measure_fractions,
)
from hrc_env.motion.scripted import load_found_reaches, read_found_reaches
from hrc_env.settings import resolve_settings
from hrc_env.vector.env import HRCVectorEnv
from hrc_env.worker.body import SEGMENT, load_body

LIMITS = MotionConfig().reach_limits
SCRIPT = (
    Reach(0.5, 0.7, 0.1, 1.1, 2.5, 0.3),
    Reach(2.6, 0.75, -0.3, 1.2, 1.5, 0.4),
    Reach(5.3, 0.8, 0.3, 0.95, 2.0, 0.2),
)
MEAN = ReachDistribution(((0.5,) * 6,) * 4, ((0.1,) * 6,) * 4)
DT_S = 0.02


def begun(reaches, batch=4, seed=0, **settings):
    """Workers who begin an episode with a script, and their generators."""
    people = replace(PEOPLE["unaware"], reaches=reaches)
    state = generator.make_state(batch, 1, load_body(), MotionConfig(people=people, **settings))
    rngs = [np.random.default_rng([seed, b]) for b in range(batch)]
    generator.reset(state, np.arange(batch), rngs)
    return state, rngs


def list_grips(motion):
    """Positions (B, T, 2, 3) where the hands grip."""
    position, both = motion.position_world[:, :, 0], []
    for side in ("left", "right"):
        wrist = position[:, :, SEGMENT[f"{side}_hand"]]
        along = wrist - position[:, :, SEGMENT[f"{side}_forearm"]]
        both.append(wrist + GRIP_M * along / np.linalg.norm(along, axis=-1, keepdims=True))
    return np.stack(both, 2)


def find_target(state, b, reach):
    """The world position (3,) of the target of a reach, before the worker leaves."""
    base = np.array(state.mind.hand_params.robot_xy_m)
    x, y = state.workers["start_x"][b, 0] - base[0], state.workers["start_y"][b, 0] - base[1]
    angle = np.arctan2(y, x) + reach.azimuth_rad
    return np.array([*base + reach.radius_m * np.array([np.cos(angle), np.sin(angle)]), reach.z_m])


def test_a_hand_is_at_the_stated_place_at_the_stated_time():
    state, rngs = begun(SCRIPT)
    targets = [[find_target(state, b, reach) for reach in SCRIPT] for b in range(4)]
    grips = list_grips(watched(state, rngs, DT_S, 400))
    for k, reach in enumerate(SCRIPT):
        for b in range(4):
            near = np.linalg.norm(grips[b] - targets[b][k], axis=-1)
            begin, end = round(reach.start_s / DT_S), round((reach.start_s + 1.2) / DT_S)
            assert near[begin:end].min() < 0.06
            hand = near[begin:end].min(0).argmin()
            assert near[begin - 2, hand] > near[begin:end, hand].min() + 0.1
            moved = np.linalg.norm(grips[b, begin + 12, hand] - grips[b, begin, hand])
            still = np.linalg.norm(grips[b, begin - 1, hand] - grips[b, begin - 6, hand])
            assert moved > 0.04
            assert still < 0.02


def test_between_reaches_the_worker_stands_and_afterwards_goes_on_with_the_work():
    state, rngs = begun(SCRIPT)
    seen = []
    for _ in range(1500):
        generator.advance(state, rngs, DT_S, 1)
        seen.append(state.workers["activity"][:, 0].copy())
    seen = np.array(seen)
    assert set(np.unique(seen[: round(5.3 / DT_S)])) == {ws.STAND, ws.REACH}
    assert len(np.unique(seen[400:])) > 2


def test_a_reach_that_would_begin_before_the_last_one_has_ended_is_left_out():
    slow = Reach(0.5, 0.6, 0.0, 1.1, 0.5, 1.4)
    state, rngs = begun(
        (slow, replace(SCRIPT[0], start_s=0.5 + APART_S), Reach(9, *[0.7, 0, 1, 1]))
    )
    began = []
    for _ in range(490):
        before = state.workers["time_s"][:, 0].copy()
        generator.advance(state, rngs, DT_S, 1)
        restarted = state.workers["time_s"][:, 0] < before
        began.append(restarted & (state.workers["activity"][:, 0] == ws.REACH))
    assert np.sum(began, axis=0).tolist() == [2] * 4


def measure_peaks(reaches, seconds=9.0, **settings):
    """The greatest speed [m/s] and acceleration [m/s2] of any hand."""
    state, rngs = begun(reaches, batch=24, seed=3, near_probability=1.0, **settings)
    motion = watched(state, rngs, 0.01, round(seconds / 0.01))
    hands = [SEGMENT["left_hand"], SEGMENT["right_hand"]]
    velocity = motion.velocity_world[:, :, 0, hands]
    speed = np.linalg.norm(velocity, axis=-1)
    acceleration = np.linalg.norm(np.diff(velocity, axis=1), axis=-1) / 0.01
    return speed.max(), acceleration.max()


def test_scripted_hands_are_no_faster_than_those_of_sudden_reaches():
    """The fastest script against people whose every reach is sudden."""
    fastest = ReachDistribution(
        ((0.2, 0.3, 0.5, 0.5, 1.0, 0.0),) * 6, ((0.2,) * 4 + (0.0,) * 2,) * 6
    )
    speed, acceleration = measure_peaks(fastest)
    people = replace(PEOPLE["unaware"], sudden_probability=1.0, lunge_probability=0.0)
    state = generator.make_state(
        24, 1, load_body(), MotionConfig(people=people, near_probability=1.0)
    )
    rngs = [np.random.default_rng([4, b]) for b in range(24)]
    generator.reset(state, np.arange(24), rngs)
    motion = watched(state, rngs, 0.01, 900)
    velocity = motion.velocity_world[:, :, 0, [SEGMENT["left_hand"], SEGMENT["right_hand"]]]
    assert 1.5 < speed < 1.1 * np.linalg.norm(velocity, axis=-1).max()
    theirs = np.linalg.norm(np.diff(velocity, axis=1), axis=-1).max() / 0.01
    assert acceleration < 1.2 * theirs
    slow = ReachDistribution(((0.5, 0.5, 0.5, 0.5, 0.0, 0.5),) * 6, ((0.0,) * 6,) * 6)
    assert measure_peaks(slow, 4.0)[0] < 0.5 * speed


def test_scripts_and_fractions_are_the_same():
    fractions = np.random.default_rng(0).random((5, 6))
    script = make_script(fractions, LIMITS)
    np.testing.assert_allclose(measure_fractions(script, LIMITS), fractions)
    MotionConfig(people=replace(PEOPLE["unaware"], reaches=script))
    edges = make_script(np.array([[-9.0] * 6, [9.0] * 6]), LIMITS)
    MotionConfig(people=replace(PEOPLE["unaware"], reaches=edges))
    assert edges[0].start_s == LEAD_S


def test_scripts_are_sampled_around_the_mean():
    rng = np.random.default_rng(1)
    drawn = [measure_fractions(draw_script(MEAN, LIMITS, rng), LIMITS) for _ in range(300)]
    np.testing.assert_allclose(np.mean(drawn, axis=0), 0.5, atol=0.03)
    np.testing.assert_allclose(np.std(drawn, axis=0), 0.1, atol=0.02)


def test_the_same_seed_gives_the_same_reaches_and_another_seed_others():
    a, b, c = (begun(MEAN, seed=seed)[0].scripts for seed in (0, 0, 1))
    assert a == b
    assert len({*a.values(), *c.values()}) == 8


def test_without_a_script_no_random_number_is_drawn_for_it():
    (state, rngs), (bare, others) = begun(SCRIPT), begun(())
    assert not bare.scripts
    assert [rng.random() for rng in rngs] == [rng.random() for rng in others]
    assert (state.workers["body"] == bare.workers["body"]).all()


@pytest.mark.parametrize(("change", "words"), [
    ({"radius_m": 2.0}, r"reaches\[0\].radius_m must be from 0.45 to 0.9"),
    ({"azimuth_rad": 1.0}, r"reaches\[0\].azimuth_rad must be from -0.45 to 0.45"),
    ({"z_m": 0.0}, r"reaches\[0\].z_m must be from 0.85"),
    ({"peak_m_s": 3.0}, r"reaches\[0\].peak_m_s must be from 0.5 to 2.5"),
    ({"peak_m_s": float("nan")}, r"reaches\[0\].peak_m_s must be"),
    ({"hold_s": 0.0}, r"reaches\[0\].hold_s must be from 0.15"),
    ({"start_s": 0.0}, r"reaches\[0\].start_s must be 0.05 s or more"),
    ({"start_s": 2.0}, r"reaches\[1\].start_s must be 3.2 s or more"),
])  # fmt: skip
def test_a_reach_that_other_people_cannot_do_is_refused(change, words):
    script = (replace(SCRIPT[0], **change), *SCRIPT[1:])
    with pytest.raises(ConfigError, match=words):
        HRCVectorEnv(1, perception="none", people=replace(PEOPLE["unaware"], reaches=script))


@pytest.mark.parametrize(("reaches", "words"), [
    ("qpp", "Did you mean 'qp'"),
    ([{"start_s": 1.0, "radius_m": 0.7, "azimuth_rad": 0.0, "z_m": 1.0, "speed": 1.0}], "speed"),
    ({"mean": [[0.5] * 5], "deviation": [[0.1] * 5]}, "6 numbers for each reach"),
    ({"mean": [[0.5] * 6], "deviation": [[0.1] * 6] * 2}, "as many reaches"),
    ({"mean": [[1.5] * 6], "deviation": [[0.1] * 6]}, "fractions from 0 to 1"),
])  # fmt: skip
def test_a_script_that_is_none_is_refused(reaches, words):
    with pytest.raises(ConfigError, match=words):
        resolve_settings(people={"reaches": reaches})


@pytest.mark.parametrize(("given", "words"), [
    ({"n_workers": 2}, "requires n_workers=1 or 0, got n_workers=2"),
    ({"n_workers": (1, 3)}, "requires n_workers=1 or 0, got n_workers=3"),
    ({"task": "HRCDelivery-v0", "n_workers": 1}, "requires a robot arm.*'unaware'"),
])  # fmt: skip
def test_what_does_not_combine_with_a_script_is_refused(given, words):
    with pytest.raises(ConfigError, match=words):
        HRCVectorEnv(1, perception="none", people="adversary", **given)
    if "task" not in given:
        env = HRCVectorEnv(1, perception="none", **given)
        with pytest.raises(ConfigError, match=words):
            env.reset(options={"people": "adversary"})


def test_clips_do_not_combine_with_a_script():
    people = replace(PEOPLE["unaware"], reaches=SCRIPT)
    with pytest.raises(ConfigError, match="requires no motions, got motions"):
        generator.make_state(1, 1, load_body(), MotionConfig(people=people, motions=("walk.npz",)))


@pytest.mark.parametrize("task", ["HRCReach-v0", "HRCPickPlace-v0", "HRCHandover-v0",
                                  "HRCDrywall-v0"])  # fmt: skip
def test_the_name_is_accepted_where_other_people_are(task):
    by_config = HRCVectorEnv(
        2, task=task, perception="truth", config={"motion": {"people": "adversary"}}
    )
    by_name = HRCVectorEnv(2, task=task, perception="truth", people="adversary")
    by_option = HRCVectorEnv(2, task=task, perception="truth")
    alone = gymnasium.make(f"hrc_env:{task}", perception="truth", people="adversary")
    first = [
        by_config.reset(seed=4)[0],
        by_name.reset(seed=4)[0],
        by_option.reset(seed=4, options={"people": "adversary"})[0],
    ]
    assert (first[0] == first[1]).all()
    assert (first[0] == first[2]).all()
    alone.reset(seed=4)
    action = np.zeros((2, *by_name.single_action_space.shape), np.float32)
    for _ in range(60):
        seen = [env.step(action)[0] for env in (by_config, by_name, by_option)]
        one = alone.step(action[0])[0]
        assert (seen[0] == seen[1]).all()
        assert (seen[0] == seen[2]).all()
        np.testing.assert_array_equal(seen[0][0], one)
    with pytest.raises(ConfigError, match="Did you mean 'adversary'"):
        HRCVectorEnv(1, perception="truth", people="adversry")


def test_different_seeds_give_different_reaches_and_branches_keep_theirs():
    envs = HRCVectorEnv(3, perception="truth", people="adversary", num_threads=1)
    envs.reset(seed=11)
    scripts = dict(envs.simulation.motion.scripts)
    assert len(set(scripts.values())) == 3
    envs.branch([2, 2, 0], [4, 5, 6])
    after = envs.simulation.motion.scripts
    assert [after[k] for k in range(3)] == [scripts[k] for k in (2, 2, 0)]


def test_a_config_with_a_script_can_be_saved(tmp_path):
    people = replace(PEOPLE["unaware"], reaches=SCRIPT)
    for name, each in {"script": people, "distribution": replace(people, reaches=MEAN)}.items():
        hrc_env.EnvConfig(perception="truth", people=each).save(tmp_path / f"{name}.toml")
        read = hrc_env.EnvConfig.load(tmp_path / f"{name}.toml")
        assert resolve_settings(people=read.people).config.motion.people == each


def test_the_package_has_reaches_for_every_shield_that_was_searched():
    found = load_found_reaches()
    assert set(found) == set(FOUND)
    assert found["qp"] != found["none"]


@pytest.mark.parametrize(("change", "words"), [
    ({"format": 0}, "format 0"),
    ({"versions": {"motion": 0}}, "motion 0"),
    ({"versions": {}}, "KeyError"),
    ({"distributions": {"qp": {}}}, "lacks"),
    ({"distributions": {key: {"mean": [[2] * 6], "deviation": [[0] * 6]} for key in FOUND}},
     "fractions"),
    ({"distributions": {"qp": 3, "none": 4}}, "must be found reaches"),
    (None, "must be found reaches"),
    ("missing", "are missing"),
])  # fmt: skip
def test_a_file_that_is_broken_or_of_another_version_is_refused(tmp_path, change, words):
    path = tmp_path / "reaches.json"
    rows = {"mean": [[0.5] * 6], "deviation": [[0.1] * 6]}
    good = {"format": 1, "versions": read_versions(), "distributions": {"qp": rows, "none": rows}}
    path.write_text(json.dumps(good))
    assert read_found_reaches(path)["qp"] == ReachDistribution(((0.5,) * 6,), ((0.1,) * 6,))
    if change == "missing":
        path.unlink()
    else:
        path.write_text("{" if change is None else json.dumps({**good, **change}))
    with pytest.raises(ConfigError, match=words) as refused:
        read_found_reaches(path)
    assert "python -m benchmarks adversary" in str(refused.value)
