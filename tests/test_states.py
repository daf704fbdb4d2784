"""States: an environment goes on from a saved one, or from a pickle, bit for bit."""

import pickle

import gymnasium
import numpy as np
import pytest

import hrc_env  # noqa: F401  registers the ids
from hrc_env.core.errors import ConfigError
from hrc_env.env import HRCEnv
from hrc_env.vector.env import HRCVectorEnv

STEPS = [("pixels", 3), ("keypoints", 30), ("truth", 30), ("none", 30)]


def go_on(env, n_steps: int, seed: int) -> list:
    """Steps, a reset that continues the random stream, and steps again."""
    rng, shape = np.random.default_rng(seed), env.action_space.shape
    draw = rng.uniform(-1, 1, (2, n_steps, *shape)).astype(np.float32)
    return [
        *(env.step(action) for action in draw[0]),
        env.reset(),
        *(env.step(action) for action in draw[1]),
    ]


def same(a, b) -> bool:
    """Whether steps' results are equal, NaNs and masks included."""
    np.testing.assert_equal(a, b)
    return True


@pytest.mark.parametrize(("level", "n_steps"), STEPS)
def test_the_single_environment_goes_on_from_a_state(level, n_steps):
    """A state is not touched by what comes after, and another environment can take it."""
    env = HRCEnv(perception=level)
    env.reset(seed=2)
    go_on(env, n_steps, seed=0)
    state = env.get_state()
    first = go_on(env, n_steps, seed=1)
    env.set_state(state)
    assert same(first, go_on(env, n_steps, seed=1))
    other = HRCEnv(perception=level)
    other.set_state(pickle.loads(pickle.dumps(state)))
    assert same(first, go_on(other, n_steps, seed=1))
    env.close(), other.close()


@pytest.mark.parametrize(
    "kwargs",
    [
        {"estimator": "kalman"},
        {"estimator": "paper"},
        {"estimator": "paper_restarts"},
        {"estimator": "triangulation"},
        {"n_workers": 2, "control": "tool"},
        {"config": {"forecast_s": (0.2,), "tracker": {"max_delay_s": 0.2}}},
    ],
    ids=str,
)
def test_every_estimators_state_is_in_it(kwargs):
    env = HRCEnv(perception="keypoints", **kwargs)
    env.reset(seed=2)
    go_on(env, 8, seed=0)
    state = env.get_state()
    first = go_on(env, 8, seed=1)
    env.set_state(state)
    assert same(first, go_on(env, 8, seed=1))


def test_who_was_whose_track_is_in_the_state_and_ends_with_the_episode():
    env = HRCVectorEnv(3, perception="truth", n_workers=2)
    env.reset(seed=0)
    env.shards.first.identities.workers["switches"][:] = 2
    state, still = env.get_state(), np.zeros((3, 6))
    env.step(still)
    mask = np.array([True, False, True])
    _, begun = env.reset(options={"reset_mask": mask})
    assert begun["tracking/id_switches"][mask].tolist() == [0, 0]
    env.set_state(state)
    assert env.step(still)[4]["tracking/id_switches"][0] == 4


@pytest.mark.parametrize(("level", "n_steps"), STEPS[1:])
def test_a_pickle_goes_on_over_resets_with_its_time_limit(level, n_steps):
    env = gymnasium.make("HRCReach-v0", perception=level, max_episode_steps=n_steps + 5)
    env.reset(seed=4)
    for _ in range(5):
        env.step(np.zeros(6, np.float32))
    twin = pickle.loads(pickle.dumps(env))
    ours = go_on(env, n_steps, seed=1)
    assert same(ours, go_on(twin, n_steps, seed=1))
    assert ours[n_steps - 1][3]


@pytest.mark.parametrize("level", ["keypoints", "truth"])
def test_the_vector_environment_goes_on_from_a_state_and_from_a_pickle(level):
    env = HRCVectorEnv(3, perception=level, num_threads=2, max_episode_steps=7)
    env.reset(seed=0)
    go_on(env, 5, seed=0)
    state, twin = env.get_state(), pickle.loads(pickle.dumps(env))
    first = go_on(env, 9, seed=1)
    env.set_state(state)
    assert same(first, go_on(env, 9, seed=1))
    assert same(first, go_on(twin, 9, seed=1))


def test_a_state_before_the_first_reset_can_be_taken_too():
    env = HRCVectorEnv(2, perception="none")
    state = env.get_state()
    env.reset(seed=0)
    env.set_state(state)
    with pytest.raises(ConfigError, match="reset"):
        env.step(np.zeros((2, 6)))


def test_a_state_of_other_settings_is_refused_by_their_name():
    state = HRCEnv(perception="truth").get_state()
    with pytest.raises(ConfigError, match="perception='truth'"):
        HRCEnv(perception="none").set_state(state)
    with pytest.raises(ConfigError, match="control='joint'"):
        HRCEnv(perception="truth", control="tool").set_state(state)
    with pytest.raises(ConfigError, match="was taken with cameras="):
        HRCEnv(perception="truth", cameras=[0, 1]).set_state(state)
    two = HRCVectorEnv(4, perception="none", num_threads=2).get_state()
    with pytest.raises(ConfigError, match="num_threads=2"):
        HRCVectorEnv(4, perception="none", num_threads=1).set_state(two)


def test_a_closed_environment_says_so():
    env = HRCEnv(perception="none")
    env.reset(seed=0)
    env.close()
    env.close()
    for call in (env.reset, lambda: env.step(np.zeros(6))):
        with pytest.raises(ConfigError, match="closed"):
            call()


LASTING = {"goal": (0.5, 0.3, 1.1), "n_workers": 0}


@pytest.mark.parametrize("again", ["set_state", "pickle"])
def test_a_state_holds_options_of_all_resets(again):
    env, other = (HRCEnv(perception="truth", n_workers=(0, 1)) for _ in range(2))
    env.set_options(LASTING)
    env.next_options = {"n_workers": 1}
    env.reset(seed=3)
    env.next_options = {"n_workers": 1}
    if again == "pickle":
        other = pickle.loads(pickle.dumps(env))
    else:
        other.set_options({"n_workers": 1})
        other.set_state(env.get_state())
    assert (other.options, other.next_options) == (LASTING, {"n_workers": 1})
    for _ in range(2):
        assert same(env.reset(), other.reset())
        assert same(env.step(np.ones(6, np.float32)), other.step(np.ones(6, np.float32)))


def test_a_state_of_a_vector_holds_options_of_each_environment():
    envs, other = (
        HRCVectorEnv(3, perception="truth", n_workers=(0, 1), num_threads=1, max_episode_steps=4)
        for _ in range(2)
    )
    envs.set_options({"each": [LASTING, None, {"n_workers": 1}]})
    envs.reset(seed=3)
    other.set_options({"n_workers": 0})
    other.set_state(envs.get_state())
    actions = np.ones((3, 6), np.float32)
    for _ in range(10):
        assert same(envs.step(actions), other.step(actions))
    other.set_options(None)
    assert envs.options_of(0) == LASTING
