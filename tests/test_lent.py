"""What users' functions are given they can only read: nobody disarms a shield by a slip."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import hrc_env
from hrc_env.core.lending import read_only
from hrc_env.tracking.estimators import ESTIMATORS
from hrc_env.vector.env import HRCVectorEnv
from tests.tasks.variants import vary

REACH, WITH_GOAL = (hrc_env.find_task(f"HRCReach{each}-v0") for each in ("", "Goal"))


def near(belief, step, previous, config):
    off = belief.estimate.mean_world
    off -= belief.robot.tool_world[:, None, None]  # the slip
    return -np.exp(-np.linalg.norm(off, axis=-1).min((1, 2)))


def zeroed(field):
    def term(belief, step=None, previous=None, config=None):
        value = belief
        for name in field.split("."):
            value = getattr(value, name)
        value[...] = 0
        return np.zeros(len(belief.action))

    return term


FIELDS = (
    "estimate.mean_world", "separation.distance_m", "robot.tool_world", "task.goal_world", "action",
    "model.fastest_rad_s", "command",
)  # fmt: skip


def rewarded(function):
    term = hrc_env.RewardTerm("slip", "A slip.", function)
    return hrc_env.with_rewards("HRCReach-v0", term, id="Slip-v0")


def observed(function):
    term = hrc_env.ObservationTerm("slip", 1, "-", "-", 1.0, 1.0, "A slip.", function)
    return vary(REACH, id="Slip-v0", observations=(*REACH.observations, term))


def hooked(name, write):
    """A task of whom one method writes what it must not, and does else as it did."""
    usual = getattr(REACH, name)

    def hook(self, *given):
        write(*given)
        return usual(self, *given)

    return vary(REACH, id="Slip-v0", **{name: hook})


def zero(array):
    array[...] = 0


SLIPS = {
    "a reward": (rewarded(near), "Reward term 'slip' writes"),
    "of the last action": (
        rewarded(lambda now, step, previous, config: zero(previous)), "Reward term 'slip' writes"),
    "of the step": (
        rewarded(lambda now, step, previous, config: zero(step)), "Reward term 'slip' writes"),
    **{f"a reward at {name}": (rewarded(zeroed(name)), "Reward term 'slip'") for name in FIELDS},
    **{f"an entry at {name}": (observed(zeroed(name)), "Observation term 'sl") for name in FIELDS},
    "a view": (hooked("view", lambda state, ids: zero(state)), "view writes"),
    "a view's ids": (hooked("view", lambda state, ids: zero(ids)), "view writes"),
    "an info": (hooked("info", zero), "info writes"),
    "advance": (hooked("advance", lambda *given: zero(given[2].robot.q)), "advance writes"),
    "reset": (hooked("reset", lambda *given: zero(given[3].robot.q)), "reset writes"),
    "the end": (hooked("is_terminal", zero), "is_terminal writes"),
    "contact": (
        hooked("allowed_contact", lambda now: zero(now.robot.q)), "allowed_contact writes"),
    "starts": (hooked("draw_start", lambda *given: zero(given[2])), "draw_start writes"),
    "what is achieved": (
        vary(WITH_GOAL, goal=replace(WITH_GOAL.goal, achieved=zeroed("robot.tool_world"))),
        "Goal.achieved writes"),
    "what is desired": (
        vary(WITH_GOAL, goal=replace(WITH_GOAL.goal, desired=zeroed("task.goal_world"))),
        "Goal.desired writes"),
    "a goal's reward": (
        vary(WITH_GOAL, goal=replace(WITH_GOAL.goal, reward=lambda a, d, config: zero(a))),
        "Goal.reward writes"),
}  # fmt: skip


@pytest.mark.parametrize("what", SLIPS)
def test_a_task_that_writes_into_what_it_is_given_is_refused(what):
    task, said = SLIPS[what]
    with pytest.raises(hrc_env.ConfigError, match=f"{said}.*copy"):
        hrc_env.register_task(vary(task, id="Slip-v0"))


@pytest.mark.parametrize("field", FIELDS)
def test_a_shield_that_writes_into_the_belief_is_refused(field):
    def shield(now, velocities, dt_s):
        zeroed(field)(now)
        return velocities, {}

    with pytest.raises(hrc_env.ConfigError, match=r"A shield writes.*copy"):
        HRCVectorEnv(2, perception="none", shield=shield).reset(seed=0)


def test_the_velocities_are_a_shields_own():
    def shield(now, velocities, dt_s):
        velocities *= 0.5
        return velocities, {}

    env = HRCVectorEnv(2, perception="none", shield=shield)
    env.reset(seed=0)
    assert np.allclose(env.step(np.ones((2, 6)))[-1]["shield/scale"], 0.5)


def test_an_estimator_gets_keypoints_of_its_own():
    class Slips:
        """Forgets what it was shown where others look it up."""

        def __init__(self, inner):
            self.inner = inner

        def __getattr__(self, name):
            return getattr(self.inner, name)

        def update(self, state, keypoints, rngs):
            self.inner.update(state, keypoints, rngs)
            keypoints.px[...], keypoints.sigma_px[...] = 0, 0

    def make(P, ctrl_dt, config):
        return Slips(ESTIMATORS["triangulation"].make(P, ctrl_dt, config))

    spec = replace(ESTIMATORS["triangulation"], name="slips", make=make)
    envs = [HRCVectorEnv(2, perception="keypoints", estimator=each)
            for each in (spec, "triangulation")]  # fmt: skip
    one, other = ([env.reset(seed=0), *(env.step(np.zeros((2, 6))) for _ in range(5))]
                  for env in envs)  # fmt: skip
    np.testing.assert_equal(one, other)


def test_goals_of_others_are_only_read():
    wrong = replace(WITH_GOAL.goal, reward=lambda a, d, config: zero(a))
    with pytest.raises(hrc_env.ConfigError, match=r"Goal\.reward writes"):
        hrc_env.tasks.goal.compute_reward(wrong, np.zeros((4, 3)), np.zeros((4, 3)), None, None)


@dataclass(frozen=True)
class Nested:
    """Arrays in all that holds arrays."""

    array: np.ndarray
    several: tuple[np.ndarray, ...]
    named: dict[str, np.ndarray]


def test_arrays_are_lent_and_stay_their_owners():
    mine = Nested(np.ones(3), (np.ones(2),), {"a": np.ones(1)})
    lent = read_only(mine)
    for yours, own in ((lent.array, mine.array), (lent.several[0], mine.several[0]),
                       (lent.named["a"], mine.named["a"])):  # fmt: skip
        assert np.shares_memory(yours, own)
        with pytest.raises(ValueError, match="read-only"):
            yours += 1
        own += 1
        assert (yours == 2).all()
