"""Reward terms: shapes, signs, and that their sum is the reward."""

from dataclasses import replace

import numpy as np
import pytest

from hrc_env.belief import Belief
from hrc_env.core.records import PoseEstimate, RobotState
from hrc_env.env import HRCEnv
from hrc_env.geometry.distances import Separation
from hrc_env.rewards import SHARED_TERMS, RewardConfig, closeness, evaluate_terms, sum_terms
from hrc_env.tasks.reach import Reach, ReachConfig
from hrc_env.vector.env import HRCVectorEnv


def believed(gap_m: float, action: float = 0.0, workers: int = 1) -> Belief:
    shape = (1, workers, 15)
    pose = PoseEstimate(
        np.zeros((*shape, 3)), np.zeros((*shape, 3, 3)), np.zeros((*shape, 3)), np.zeros(shape),
        np.ones(shape[:2], bool),
    )  # fmt: skip
    robot = RobotState(
        np.zeros((1, 6)), np.zeros((1, 6)), np.zeros((1, 3)), np.zeros((1, 3)), np.eye(3)[None],
        np.zeros((1, 9, 2, 3)), np.zeros(9),
    )  # fmt: skip
    gap = Separation(
        np.full((1, workers), gap_m), np.zeros((1, workers, 3)), np.zeros((1, workers, 3))
    )
    return Belief(robot, pose, gap, None, np.full((1, 6), action))


def reward(now, step, before, shared, own=None):
    """All terms, of which the task's come first."""
    own = own or ReachConfig()
    terms = {
        **evaluate_terms(Reach().rewards, now, step, before, own),
        **evaluate_terms(SHARED_TERMS, now, step, before, shared),
    }
    return sum_terms(terms, 1), terms


def progress(metres: float = 0.0, reached: bool = False) -> dict[str, np.ndarray]:
    return {"progress_m": np.array([metres]), "reached": np.array([reached])}


@pytest.mark.parametrize(
    ("gap_m", "expected"),
    [(1.0, 0.0), (0.3, 0.0), (0.15, 0.25), (0.0, 1.0), (-0.15, 2.25), (-5.0, 2.25), (np.inf, 0.0)],
)
def test_closeness_grows_from_its_reach_to_touch_and_saturates(gap_m, expected):
    assert closeness(np.array(gap_m), 0.3) == pytest.approx(expected)


def test_the_reward_is_the_sum_of_its_terms():
    whole, terms = reward(
        believed(0.1, 0.5), progress(0.02, True), np.zeros((1, 6)), RewardConfig()
    )
    assert list(terms) == [term.name for term in Reach().reward_terms]
    assert whole[0] == sum(value[0] for value in terms.values())


def test_each_weight_scales_its_own_term_only():
    now, step, before = believed(0.1, 0.5), progress(0.02, True), np.zeros((1, 6))
    base = reward(now, step, before, RewardConfig())[1]
    fields = {"progress": "progress_per_m", "goal": "goal_bonus", "effort": "effort",
              "smoothness": "smoothness", "proximity": "proximity"}  # fmt: skip
    for term, field in fields.items():
        own, shared = ReachConfig(), RewardConfig()
        if hasattr(own, field):
            own = replace(own, **{field: 2 * getattr(own, field)})
        else:
            shared = replace(shared, **{field: 2 * getattr(shared, field)})
        changed = reward(now, step, before, shared, own)[1]
        assert changed[term][0] == pytest.approx(2 * base[term][0])
        assert base[term][0] != 0
        assert all(changed[other][0] == base[other][0] for other in fields if other != term)


def test_the_nearest_of_several_workers_counts_and_nobody_costs_nothing():
    near = reward(believed(0.0, workers=2), progress(), np.zeros((1, 6)), RewardConfig())[1]
    nobody = reward(believed(0.0, workers=0), progress(), np.zeros((1, 6)), RewardConfig())[1]
    assert near["proximity"][0] == pytest.approx(-2.0)
    assert nobody["proximity"][0] == 0.0


def test_a_term_that_is_not_a_number_is_a_fault_and_raises():
    with pytest.raises(FloatingPointError, match="progress"):
        reward(believed(1.0), progress(np.nan), np.zeros((1, 6)), RewardConfig())


def test_one_environment_of_two_whose_reward_is_not_finite_raises():
    for wrong in (np.nan, np.inf):
        terms = {"reach": np.ones(2), "effort": np.array([0.5, wrong])}
        with pytest.raises(FloatingPointError, match="finite: effort"):
            sum_terms(terms, 2)
    assert sum_terms({"reach": np.ones(2), "effort": np.full(2, 0.5)}, 2).tolist() == [1.5, 1.5]


def test_the_term_of_the_shield_is_its_mean_squared_change_of_what_can_be_commanded():
    """Of the belief, in the step in which it acts; without a weight or a shield it is 0."""
    arguments = {"perception": "truth", "people": "unaware", "num_threads": 1}
    weighed = {"reward": {"shield_change": 2.0}}
    envs = HRCVectorEnv(8, shield="qp", config=weighed, **arguments)
    free = HRCVectorEnv(8, shield="qp", **arguments)
    bare = HRCVectorEnv(8, config=weighed, **arguments)
    for each in (envs, free, bare):
        each.reset(seed=4)
    rng, seen = np.random.default_rng(0), []
    for _ in range(40):
        action = rng.uniform(-1, 1, envs.action_space.shape).astype(np.float32)
        *_, infos = envs.step(action)
        now = envs.simulation.belief
        share = now.shield_change / now.model.fastest_rad_s
        np.testing.assert_allclose(
            infos["reward/shield_change"], -2.0 * np.square(share).mean(1), atol=1e-12
        )
        np.testing.assert_allclose(
            np.linalg.norm(now.shield_change, axis=1), infos["shield/change"], atol=1e-12
        )
        seen += infos["reward/shield_change"].tolist()
        for each in (free, bare):
            assert (each.step(action)[-1]["reward/shield_change"] == 0).all()
    assert min(seen) < 0


def proximity_of(env, weight):
    """The proximity term of a first step with this weight, and a reach as wide as the room."""
    env.reset(seed=3)
    env.set_reward(RewardConfig(proximity=weight, proximity_reach_m=20.0))
    action = np.zeros(env.action_space.shape, np.float32)
    return env.step(action)[-1]["reward/proximity"]


def test_weights_that_change_in_the_course_of_a_run_count_from_the_next_step_on():
    single = HRCEnv(perception="truth")
    several = HRCVectorEnv(2, perception="truth")
    for env in (single, several):
        once, thrice = proximity_of(env, 1.0), proximity_of(env, 3.0)
        assert np.all(once < 0)
        np.testing.assert_allclose(thrice, 3 * once)
    assert single.simulation.get_state()["reward_weights"].proximity == 3.0
