"""A task in which environments depend on each other is refused when it is registered."""

from dataclasses import replace

import numpy as np
import pytest

import hrc_env
from hrc_env.registration import IDS
from tests.tasks.variants import vary

REACH, WITH_GOAL = (hrc_env.find_task(f"HRCReach{each}-v0") for each in ("", "Goal"))


def term(function):
    return hrc_env.RewardTerm("own", "Of my own.", function)


def first_generator(self, state, ids, rngs, world):
    REACH.reset(self, state, ids, [rngs[0]] * len(rngs), world)


def all_rows(self, state, ids):
    return REACH.view(self, state, np.arange(len(state)))


def first_rows(self, state, ids):
    return REACH.view(self, state, np.arange(len(ids)))


class Counting(REACH):
    """Keeps in itself what belongs into the state."""

    n = 0

    def advance(self, state, rngs, world, dt_s):
        self.n += 1
        return super().advance(state, rngs, world, dt_s)

    def info(self, state):
        return {**super().info(state), "task/n": np.full(len(state), float(self.n))}


class Lucky(REACH):
    """Draws from a generator of nobody's."""

    def info(self, state):
        return {**super().info(state), "task/luck": np.random.default_rng().random(len(state))}


def everybody(self, state, ids, rngs, world):
    REACH.reset(self, state, ids, rngs, world)
    state["goal_age_s"] += 0.1


def nearby(achieved, desired, config):
    return -np.linalg.norm(achieved - desired, axis=1)


def average(achieved, desired, config):
    return -np.linalg.norm(achieved - desired, axis=-1) * np.mean(achieved)


def goal(reward):
    return vary(WITH_GOAL, goal=replace(WITH_GOAL.goal, reward=reward))


WRONG = {
    "one generator": (vary(REACH, reset=first_generator), "differs between a batch and a single"),
    "a mean": (
        vary(REACH, rewards=(term(lambda now, *_: np.full(len(now.action), now.robot.q.mean())),)),
        "the reward of an environment differs between a batch|'reward/own'"),
    "all rows": (vary(REACH, view=all_rows), "rows|environments"),
    "the first rows": (vary(REACH, view=first_rows), "differs between a batch and a single"),
    "a reset of all": (vary(REACH, reset=everybody), "differs between a batch and a single"),
    "a count in itself": (Counting, "Everything that changes must be in the state"),
    "luck": (Lucky, "all random numbers must come from rngs"),
    "the wrong axis": (goal(nearby), r"Goal\.reward must take"),
    "a mean of goals": (goal(average), "evaluate each pair independently"),
    "no steps": (vary(REACH, max_episode_steps=0), "max_episode_steps must be"),
    "half a step": (vary(REACH, max_episode_steps=2.5), "max_episode_steps must be"),
}  # fmt: skip


@pytest.mark.parametrize("what", WRONG)
def test_what_lets_environments_depend_on_others_is_refused(what):
    task, said = WRONG[what]
    with pytest.raises(hrc_env.ConfigError, match=said):
        hrc_env.register_task(vary(task, id="Wrong-v0"))
    assert "Wrong-v0" not in IDS


@pytest.mark.parametrize("task", ["HRCReach-v0", "HRCReachGoal-v0", "HRCDelivery-v0"])
def test_tasks_of_the_package_are_taken_under_other_names(task):
    again = f"Again{task}"
    hrc_env.register_task(vary(hrc_env.find_task(task), id=again))
    assert again in IDS
