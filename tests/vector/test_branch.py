"""Branches: environments that go on from the middle of another one, with other random numbers."""

import numpy as np
import pytest

import hrc_env
from hrc_env.core import batching
from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.core.streams import aside, restart
from hrc_env.vector.env import HRCVectorEnv
from tests.vector import identity

N = 5
LATE = [{"kind": "late", "cameras": ["all"], "amount": (0.0, 0.12)}, {"kind": "dropped",
        "cameras": ["camera_1"], "amount": 0.3}]  # fmt: skip
SETTINGS = {
    "reach": {"shield": "qp"},
    "late": {"faults": LATE, "cameras": hrc_env.RigDistribution(max_shift_m=0.1, n_cameras=(2, 4))},
    "two": {"n_workers": (1, 2), "control": "tool", "config": {"forecast_s": (0.2,)}},
    "kalman": {"estimator": "kalman"},
    "paper": {"estimator": "paper_restarts"},
    "truth": {"perception": "truth", "task": "HRCPickPlace-v0"},
    "none": {"perception": "none"},
    "delivery": {"task": "HRCDelivery-v0"},
    "drywall": {"task": "HRCDrywall-v0"},
    "handover": {"task": "HRCHandover-v0"},
    "goal": {"task": "HRCReachGoal-v0"},
}
"""Settings whose states differ in kind."""


def make(threads: int = 2, num_envs: int = N, n_steps: int = 12, **kwargs) -> HRCVectorEnv:
    """A vector environment in the middle of its episodes."""
    envs = HRCVectorEnv(num_envs, num_threads=threads, **kwargs)
    envs.reset(seed=20)
    play(envs, n_steps, 1)
    return envs


def play(envs: HRCVectorEnv, n_steps: int, seed: int, alike: bool = False) -> list:
    """Results of steps with random actions, which may be alike for all environments."""
    rng, shape = np.random.default_rng(seed), envs.action_space.shape
    n_rows = 1 if alike else shape[0]
    draws = rng.uniform(-1, 1, (n_steps, n_rows, shape[1])).astype(np.float32)
    return [envs.step(np.broadcast_to(each, shape)) for each in draws]


def row(results: list, k: int) -> list:
    """Results of one environment."""
    return [_row(each, k) for each in results]


def _row(result, k: int):
    if isinstance(result, dict):
        return {name: _row(each, k) for name, each in result.items()}
    if isinstance(result, tuple):
        return tuple(_row(each, k) for each in result)
    return result[k : k + 1].copy()


def same(a, b) -> bool:
    return identity.differences(tuple(a), tuple(b)) == 0


@pytest.mark.parametrize("name", SETTINGS)
def test_a_branch_goes_on_as_its_source_would_with_these_random_numbers(name):
    """A copy in the other simulation equals the source itself with new streams of that seed."""
    envs, other = (make(**SETTINGS[name]) for _ in range(2))
    envs.branch([0, 1, 2, 3, 0], [None, None, None, None, 77])
    other.branch([0, 1, 2, 3, 4], [77, None, None, None, None])
    assert same(row(play(envs, 30, 2, True), 4), row(play(other, 30, 2, True), 0))


@pytest.mark.parametrize("name", SETTINGS)
def test_an_environment_that_is_not_branched_is_untouched(name):
    envs, other = (make(**SETTINGS[name]) for _ in range(2))
    envs.branch([3, 1, 2, 0, 4], [5, None, None, 6, None])
    ours, theirs = play(envs, 30, 2), play(other, 30, 2)
    for k in (1, 2, 4):
        assert same(row(ours, k), row(theirs, k))
    assert not same(row(ours, 0), row(theirs, 0))


@pytest.mark.parametrize("name", ["reach", "late", "two"])
def test_different_seeds_have_the_same_past_and_different_futures(name):
    envs = make(**SETTINGS[name])
    last = envs.branch([2] * N, range(N))
    assert all(same([last[:1]], [last[k : k + 1]]) for k in range(N))
    steps = play(envs, 40, 2, True)
    observed = {row(steps, k)[-1][0].tobytes() for k in range(N)}
    assert len(observed) == N


@pytest.mark.filterwarnings("ignore:num_threads")
def test_branches_are_the_same_with_every_number_of_threads():
    found = []
    for threads in (1, 2, 3):
        envs = make(threads, **SETTINGS["late"])
        observation = envs.branch([4, 4, 0, 0, 1], [9, 8, 7, 6, 5])
        found.append([observation, *play(envs, 30, 2)])
    assert same(found[0], found[1])
    assert same(found[0], found[2])


def test_a_branch_also_goes_on_over_the_end_of_its_episode():
    """Time limit, options of later episodes and the seed of the stream are those of the source."""
    envs, other = (
        make(max_episode_steps=20, n_workers=(0, 1), perception="truth") for _ in range(2)
    )
    for each in (envs, other):
        each.set_options({"each": [{"n_workers": 0}, *[{"n_workers": 1}] * 4]})
        each.reset(options={"reset_mask": np.arange(N) == 0})
        play(each, 4, 3)
    envs.branch([0, 1, 2, 3, 0], [None, None, None, None, 11])
    other.branch([0, 1, 2, 3, 4], [11, None, None, None, None])
    ours, theirs = row(play(envs, 60, 2, True), 4), row(play(other, 60, 2, True), 0)
    assert same(ours, theirs)
    assert [step[3][0] for step in ours].index(True) == 15
    assert (envs.np_random_seed[4], other.np_random_seed[0]) == (11, 11)
    assert envs.options_of(4) == {"n_workers": 0}


def test_every_random_stream_is_spawned_anew():
    """Also the one that measures loose objects; each has its own numbers."""
    envs = make(1, 2, 2, task="HRCPickPlace-v0", perception="truth")
    envs.branch([0, 0], [None, 3])
    drawn = [each[b].random() for each in envs.shards.first.streams.values() for b in range(2)]
    assert len(set(drawn)) == 12


def test_the_behaviour_of_the_episode_is_copied():
    envs, other = (make(perception="none", max_episode_steps=400, n_steps=0) for _ in range(2))
    for each in (envs, other):
        each.reset(options={"each": [{"people": "hurried"}, {}, {}, {"people": "unaware"}, {}]})
    envs.branch([3, 1, 2, 3, 0], [1, None, None, None, 11])
    other.branch([0, 1, 2, 3, 4], [11, None, None, 1, None])
    ours, theirs = play(envs, 250, 2, True), play(other, 250, 2, True)
    assert same(row(ours, 4), row(theirs, 0))
    assert same(row(ours, 0), row(theirs, 3))


def test_what_was_drawn_for_the_episode_stays():
    envs = make(**SETTINGS["late"])
    rig, faults = envs.member(1).rig, envs.member(1).faults
    assert rig != envs.member(4).rig
    envs.branch([0, 1, 2, 3, 1], [None, None, None, None, 3])
    assert envs.member(4).rig == rig
    assert envs.member(4).faults == faults


def test_the_appearance_stays_too():
    envs = make(1, 3, 2, appearance={"light": (0.15, 1.0)})
    envs.branch([1, 1, 1], [3, None, 4])
    streams = envs.shards.first.streams["sensor"]
    lights = [envs.shards.first.cameras.look_of(b, streams[b]).light for b in range(3)]
    assert lights[0] == lights[1] == lights[2]
    assert envs.shards.first.pipeline.light_of(0) == lights[0]


def test_a_restarted_generator_keeps_what_was_drawn_aside():
    rng, fresh, again = (np.random.default_rng(seed) for seed in (1, 2, 2))
    before = aside(rng, 1000).random(3)
    restart(rng, fresh)
    np.testing.assert_array_equal(aside(rng, 1000).random(3), before)
    np.testing.assert_array_equal(rng.random(3), again.random(3))


REFUSED = {
    "too few ids": ([0, 1], [1, 2, 3], "ids must be 3 whole numbers from 0 to 2"),
    "an id too high": ([0, 1, 3], [1, 2, 3], "ids must be 3 whole"),
    "a negative id": ([0, 1, -1], [1, 2, 3], "ids must be 3 whole"),
    "a missing id": ([0, 1, np.nan], [1, 2, 3], "ids must be 3 whole"),
    "no indices": ([True, False, True], [1, 2, 3], "ids must be 3 whole"),
    "ragged ids": ([0, [1], 2], [1, 2, 3], "ids must be 3 whole"),
    "too few seeds": ([0, 1, 2], [1, 2], "seeds must be a whole number >= 0 or a list of 3"),
    "one seed": ([0, 1, 2], 5, "seeds must be a list of 3"),
    "a negative seed": ([0, 1, 2], [1, 2, -3], "seeds must be a whole number"),
    "a seed that is not a number": ([0, 1, 2], [1, 2, np.nan], "seeds must be a whole number"),
    "the same seed twice": ([0, 0, 1], [4, 4, 5], "seeds must differ, .* got 4 more than once"),
    "a copy without a seed": ([0, 0, 2], [None] * 3, r"seeds\[1\] is None, but environment 1"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_wrong_argument_is_refused_in_words_and_changes_nothing(case):
    ids, seeds, words = REFUSED[case]
    envs, other = (make(2, 3, 2, perception="truth") for _ in range(2))
    with pytest.raises(ConfigError, match=words):
        envs.branch(ids, seeds)
    assert same(play(envs, 3, 2), play(other, 3, 2))


@pytest.mark.parametrize("name", SETTINGS)
def test_a_kept_environment_goes_on_later_as_it_would_have_then(name):
    envs, other = (make(**SETTINGS[name]) for _ in range(2))
    kept = [envs.keep([1]), envs.keep([4, 2])]
    play(envs, 10, 5)
    envs.branch([7, 5, 2, 6, 4], [1, 2, None, 3, None], kept)
    other.branch([2, 1, 2, 4, 4], [1, 2, 9, 3, 8])
    ours, theirs = play(envs, 30, 2), play(other, 30, 2)
    for k in (0, 1, 3):
        assert same(row(ours, k), row(theirs, k))


def test_a_kept_environment_fits_any_number_of_environments_and_threads():
    envs, few = (make(perception="truth", num_envs=n, threads=t) for n, t in ((5, 2), (2, 1)))
    kept = [envs.keep([4])]
    envs.branch([0, 1, 2, 3, 4], [None] * 4 + [6])
    few.branch([2, 1], [6, None], kept)
    assert same(row(play(few, 30, 2, True), 0), row(play(envs, 30, 2, True), 4))


def test_a_kept_environment_of_other_settings_is_refused_by_their_name():
    kept = make(perception="truth").keep([0])
    with pytest.raises(ConfigError, match="was taken with perception='truth'"):
        make(perception="none").branch([5, 1, 2, 3, 4], [1, *[None] * 4], [kept])
    with pytest.raises(ConfigError, match="from 0 to 5, indices"):
        make(perception="truth").branch([6, 1, 2, 3, 4], [1, *[None] * 4], [kept])
    with pytest.raises(ConfigError, match="one or more whole numbers from 0 to 4"):
        make(perception="truth").keep([])


def test_there_must_be_something_to_branch():
    envs = HRCVectorEnv(2, perception="none")
    with pytest.raises(ConfigError, match="reset"):
        envs.branch([0, 0], [1, 2])
    envs.close()
    with pytest.raises(ConfigError, match="closed"):
        envs.branch([0, 0], [1, 2])


def test_a_state_without_rows_is_refused():
    """Also one whose length happens to be the number of environments of one part only."""
    bounds, ids = [0, 2, 5], np.array([4, 0])
    kept = [{"x": np.arange(2), "of": "it"}, {"x": np.arange(3), "of": "it"}]
    taken = batching.gather(kept, bounds, ids)
    assert (taken["x"].tolist(), taken["of"]) == ([2, 0], "it")
    for wrong in (np.arange(2), [1, 2], 4.0, object()):
        with pytest.raises(HRCError, match="cannot be branched"):
            batching.gather([{"x": np.arange(2)}, {"x": wrong}], bounds, ids)
        with pytest.raises(HRCError, match="cannot be branched"):
            batching.gather([{"x": 3.0}, {"x": wrong}], bounds, ids)
