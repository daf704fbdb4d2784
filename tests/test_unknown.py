"""Blind robots: unknown workers in environments, what they cost, and who is slow then."""

import numpy as np
import pytest

from hrc_env.agents.env_info import env_info
from hrc_env.agents.experts import EXPERTS, make_expert
from hrc_env.agents.scripted import Yielding
from hrc_env.core.errors import ConfigError
from hrc_env.env import HRCEnv
from hrc_env.rewards import RewardConfig
from hrc_env.vector.env import HRCVectorEnv

BLIND = [{"kind": "lost", "cameras": ["all"], "start_s": 0.4, "end_s": 2.0}]
EMPTY_SEED = 1
"""Of an episode for one worker or none in which none is there."""


def played(n_steps=75, seed=3, **arguments):
    """Per step: unknown, tracked, seconds blind, and the term of the reward."""
    env = HRCEnv(**{"perception": "keypoints", **arguments})
    env.reset(seed=seed)
    told = []
    for _ in range(n_steps):
        info = env.step(np.zeros(env.action_space.shape, np.float32))[-1]
        now = env.simulation.estimate
        said = (
            now.unknown[0, 0],
            now.tracked[0, 0],
            now.unobserved_s[0, 0],
            info["reward/proximity"],
        )
        told.append(said)
    return env, *map(np.array, zip(*told, strict=True))


@pytest.mark.parametrize("kind", ["lost", "frozen"])
def test_a_worker_whom_all_cameras_lose_is_unknown_until_they_are_seen_again(kind):
    _, unknown, tracked, unobserved_s, _ = played(faults=[{**BLIND[0], "kind": kind}])
    assert (unknown == ~tracked).all()
    assert unknown[40:48].all()
    assert not unknown[:30].any()
    assert not unknown[-10:].any()
    assert unobserved_s[45] == pytest.approx(36 * 0.04, abs=0.05)


def test_losing_sight_is_not_rewarded_like_being_alone():
    _, unknown, _, _, proximity = played(faults=BLIND, config={"reward": {"proximity": 3.0}})
    assert (proximity[unknown] <= -3.0 * 0.25).all()
    _, unknown, _, _, proximity = played(
        faults=BLIND, config={"reward": {"proximity": 3.0, "unknown_closeness": 0.0}}
    )
    assert unknown.any()
    assert (proximity[unknown] == 0).all()


@pytest.mark.parametrize("worth", [-0.1, 1.5, np.nan])
def test_what_an_unknown_worker_counts_must_be_a_share(worth):
    with pytest.raises(ConfigError, match=r"unknown_closeness must be in \[0, 1\]"):
        RewardConfig(unknown_closeness=worth)


def test_an_empty_room_is_known_to_be_empty_and_blind_cameras_make_it_unknown():
    env, unknown, tracked, _, proximity = played(n_workers=(0, 1), seed=EMPTY_SEED)
    assert not env.simulation.present.any()
    assert not tracked.any()
    assert not unknown[1:].any()
    assert (proximity[1:] == 0).all()
    _, unknown, *_ = played(n_workers=(0, 1), seed=EMPTY_SEED, faults=BLIND)
    assert unknown[40:48].all()
    assert not unknown[-10:].any()


def test_the_truth_is_never_unknown_and_without_cameras_everybody_is():
    for n_workers in (1, (0, 1)):
        _, unknown, _, unobserved_s, _ = played(
            5, EMPTY_SEED, perception="truth", n_workers=n_workers
        )
        assert not unknown.any()
        assert not unobserved_s.any()
    env, unknown, _, unobserved_s, _ = played(5, perception="none")
    assert unknown.all()
    assert unobserved_s == pytest.approx(0.04 * np.arange(2, 7))
    env.reset(seed=3)
    assert env.simulation.estimate.unobserved_s == pytest.approx(0.04)
    assert HRCEnv(perception="none", n_workers=0).simulation.estimate.unknown.shape == (1, 0)


def test_the_observation_says_who_is_unknown_and_for_how_long():
    env, *_ = played(45, faults=BLIND)
    terms = env.split_observation(env.step(np.zeros(6, np.float32))[0])
    assert terms["worker_unknown"] == [1.0]
    unobserved_s = env.simulation.estimate.unobserved_s[0]
    assert terms["worker_unobserved_time"] == pytest.approx(unobserved_s, abs=1e-6)


def test_several_environments_know_what_single_ones_do_and_states_keep_it():
    several = HRCVectorEnv(3, perception="keypoints", faults=BLIND, n_workers=(0, 2), num_threads=1)
    single = HRCEnv(perception="keypoints", faults=BLIND, n_workers=(0, 2))
    several.reset(seed=5)
    single.reset(seed=6)
    kept = None
    for step in range(50):
        seen = several.step(np.zeros((3, 6), np.float32))[0]
        alone = single.step(np.zeros(6, np.float32))[0]
        np.testing.assert_array_equal(seen[1], alone)
        if step == 38:
            kept = single.get_state()
    single.set_state(kept)
    for _ in range(11):
        alone = single.step(np.zeros(6, np.float32))[0]
    np.testing.assert_array_equal(seen[1], alone)


@pytest.mark.parametrize("task", sorted(EXPERTS))
@pytest.mark.parametrize("most_m_s", [0.25, 0.0])
def test_every_expert_is_slow_while_somebody_is_unknown_and_free_in_an_empty_room(task, most_m_s):
    env = HRCEnv(task=task, perception="none", n_workers=1)
    careful = make_expert(env_info(env.simulation), Yielding(unknown_m_s=most_m_s))
    bold = make_expert(env_info(env.simulation))
    observation, _ = env.reset(seed=2)
    slow, fast = careful.act(observation), bold.act(observation)
    assert np.abs(slow[:3]).max() <= max(0.8 * np.abs(fast[:3]).max(), 0.02)
    assert most_m_s > 0 or np.abs(slow[: -1 if env.simulation.n_actions == 7 else None]).max() == 0
    cleared = _known_to_be_empty(env, observation)
    np.testing.assert_array_equal(careful.act(cleared), bold.act(cleared))


def _known_to_be_empty(env, observation):
    """The same observation where nobody is unknown."""
    where = env.simulation.layout.slices["worker_unknown"]
    flat = observation["observation"] if isinstance(observation, dict) else observation
    flat = flat.copy()
    flat[where] = 0.0
    return {**observation, "observation": flat} if isinstance(observation, dict) else flat
