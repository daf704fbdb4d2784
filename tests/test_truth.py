"""Truth never reaches belief: another truth moves cost and errors and nothing else; where truth is
made to leak, the same proof says so."""

import dataclasses
from functools import partial

import gymnasium
import numpy as np
import pytest
from leaks import PERTURBED, another_worker, differences, displaced, leaks, shifted

from hrc_env import simulation
from hrc_env.agents import checkpoints, ppo
from hrc_env.agents.registry import AGENTS
from hrc_env.motion import generator
from hrc_env.pipeline.emulated import EmulatorPipeline
from hrc_env.pipeline.levels import NoPerception
from hrc_env.pipeline.rendered import PixelPipeline
from hrc_env.pipeline.tracking import PoseTracking
from hrc_env.safety.built_in import limit_command
from hrc_env.safety.config import ShieldConfig
from hrc_env.sb3 import HRCVecEnv
from hrc_env.simulation import Simulation
from hrc_env.tasks import BUILT_IN, DEFAULT

ID = "hrc_env:HRCReach-v0"
LEVELS = ("pixels", "keypoints", "none")
BLIND = [{"kind": "lost", "cameras": ["all"], "start_s": 0.2, "end_s": 1.4}]
"""Nobody is seen for longer than a track lives: it is lost, and they are searched for again."""
pytestmark = pytest.mark.usefixtures("brought")


CHOSEN = {
    "shield": "slow_down",
    "config": {"worker": "any", "reward": {"proximity_reach_m": 3.0}},
}
"""Any body; a reward that feels them from afar."""


def single(level: str, **arguments):
    return gymnasium.make(ID, perception=level, **{**CHOSEN, **arguments})


def vector(level: str, **arguments):
    return gymnasium.make_vec(ID, 3, perception=level, num_threads=2, **{**CHOSEN, **arguments})


def assert_only_told(moved: dict[str, int], level: str) -> None:
    assert leaks(moved) == {}
    assert "info/safety/min_separation_m/" in moved
    assert ("info/tracking/mpjpe_m/" in moved) == (level != "none")


@pytest.mark.parametrize("perturb", PERTURBED.values(), ids=PERTURBED)
@pytest.mark.parametrize("level", LEVELS)
def test_another_truth_moves_cost_and_errors_and_nothing_else(level, perturb):
    moved = differences(partial(single, level), perturb, n_steps=12 if level == "pixels" else 60)
    assert_only_told(moved, level)


@pytest.mark.parametrize("level", LEVELS[:2])
def test_nor_does_it_where_a_worker_is_lost_and_found_again(level):
    followed = []

    def watching(now, velocities, dt_s):
        followed.append(bool(now.estimate.tracked.any()))
        return 0.5 * velocities, {"nearest_m": now.separation.distance_m.min(-1)}

    n_workers = 1 if level == "pixels" else 2
    make = partial(single, level, faults=BLIND, n_workers=n_workers, shield=watching)
    assert_only_told(differences(make, another_worker, n_steps=50), level)
    followed = followed[-102:]  # also after each reset, but not the trial when it was made
    assert followed[:51] == followed[51:]
    lost = followed.index(False)
    assert lost > 0
    assert followed[50]


@pytest.mark.parametrize("make", [single, vector])
def test_nor_does_a_built_in_shield_act_otherwise(make):
    shielded = {"shield": "qp", "people": "unaware", "config": {"observe_shield": True}}
    moved = differences(partial(make, "keypoints", **shielded), another_worker, n_steps=60)
    assert_only_told(moved, "keypoints")


@pytest.fixture(scope="module")
def policy(tmp_path_factory):
    """A network that nobody has taught anything."""
    envs = HRCVecEnv(1, perception="none", config={"worker": "any"})
    path = tmp_path_factory.mktemp("policy") / "policy.zip"
    learner = ppo.make_learner(envs, ppo.PPOSettings(), seed=0)
    checkpoints.save(learner, path, {})
    envs.close()
    return str(path)


@pytest.mark.parametrize("agent", [*AGENTS, "learner"])
def test_no_agent_acts_otherwise(agent, policy):
    agent = policy if agent == "learner" else agent
    moved = differences(partial(single, "keypoints"), another_worker, agent=agent)
    assert_only_told(moved, "keypoints")


def of(task: str, **arguments):
    return gymnasium.make(f"hrc_env:{task}", perception="keypoints", **{**CHOSEN, **arguments})


@pytest.mark.parametrize("perturb", ["another worker", "shifted"])
@pytest.mark.parametrize("task", [each for each in BUILT_IN if each != DEFAULT])
def test_nor_does_it_in_any_other_task(task, perturb):
    assert_only_told(differences(partial(of, task), PERTURBED[perturb], n_steps=25), "keypoints")


def test_the_hand_that_a_tool_is_brought_to_is_the_estimated_one():
    """Until it is taken and let go, which the same hand does: only what is shown is elsewhere. Nor
    do shields let come any other."""
    taken, welcome, n_steps, n_calls = [], [], 300, 301  # also after the reset

    def watching(now, velocities, dt_s):
        if len(velocities) == 1:  # the two environments that are played at make are of no interest
            taken.append(bool(now.task.taken[0]))
            welcome.append(now.allowed_contact)
        return limit_command(now, velocities, dt_s, ShieldConfig())

    make = partial(of, "HRCHandover-v0", shield=watching, config=None)
    moved = differences(make, displaced(shifted), agent="scripted", n_steps=n_steps)
    assert_only_told(moved, "keypoints")
    assert taken[n_calls - 1]
    assert taken[:n_calls] == taken[n_calls:]
    assert 0 < np.any(welcome[:n_calls], axis=(1, 2, 3)).sum() < n_calls
    np.testing.assert_array_equal(welcome[:n_calls], welcome[n_calls:])


def onto_the_robot(points):
    return 0.0 * points + np.array([-0.75, 0.0, 1.0])


@pytest.mark.parametrize("level", LEVELS[1:])
def test_cost_follows_the_truth_and_not_the_belief(level):
    """Bodies that truly stand in the robot, unseen, are near and touched; nothing else moves."""
    moved = differences(partial(single, level), displaced(onto_the_robot), n_steps=8)
    assert leaks(moved) == {}
    assert {"info/cost_proximity/", "info/cost_contact/"} <= moved.keys()


def beside_the_robot(points):
    return 0.3 * points + np.array([-0.6, 0.5, 0.8])


@pytest.mark.parametrize("level", LEVELS[1:])
def test_whom_the_robot_endangers_is_the_true_worker(level):
    """Who truly stands beside the robot, unseen, is endangered by it: only the cost moves."""
    make = partial(single, level, config={**CHOSEN["config"], "cost": {"proximity_m": 1.0}})
    perturb = displaced(beside_the_robot)
    moved = differences(make, perturb, agent="scripted", n_steps=30)
    assert leaks(moved) == {}
    assert {"info/cost/", "info/cost_unsafe/", "info/episode_cost/"} <= moved.keys()


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
@pytest.mark.parametrize("level", LEVELS[1:])
def test_nor_is_anything_else_in_a_vector_through_resets(level, mode):
    """At `pixels` a vector is single environments in processes."""
    make = partial(vector, level, autoreset_mode=mode, max_episode_steps=12)
    assert_only_told(differences(make, another_worker, n_steps=40), level)


def test_of_the_level_truth_the_reward_follows_the_belief_and_cost_the_truth():
    """There the belief is the truth by definition: that of whom the oracle was shown."""
    make = partial(single, "truth")
    told = differences(make, displaced(shifted, shown=False))
    assert leaks(told) == {}
    assert {"info/safety/min_separation_m/", "info/tracking/mpjpe_m/"} <= told.keys()
    shown = differences(make, displaced(shifted, told=False), agent="random")
    assert {"observation/", "reward and ends/", "info/reward/proximity/"} <= shown.keys()
    assert not [name for name in shown if name.startswith("info/cost")]
    assert "info/safety/min_separation_m/" not in shown


def after(patch, kind, name, spoil):
    """Let `spoil(self, what the method returned)` change what a method returns."""
    method = getattr(kind, name)
    patch.setattr(kind, name, lambda self, *given: spoil(self, method(self, *given)))


def half_of_the_truth(patch, share=0.5):
    """Blended into every estimate, by the simulation."""

    def spoil(self, belief):
        motion = generator.current(self.motion)
        joints = simulation.worker_truth(self.bodies, motion).joints_world
        belief.estimate.mean_world[...] += share * (joints - belief.estimate.mean_world)
        return belief

    after(patch, Simulation, "_perceive", spoil)


def half_of_what_the_sensor_was_shown(patch):
    """The same by the pipeline."""

    def spoil(self, estimate):
        joints = hips_of(self)
        estimate.mean_world[...] += 0.5 * (joints - estimate.mean_world)
        return estimate

    for kind in (PoseTracking, NoPerception):
        after(patch, kind, "perceive", spoil)


def hips_of(pipeline):
    """(B, W, 1, 3) where the sensor was shown every body's first segment."""
    return pipeline.sensor.now.motion.position_world[:, :, :1]


def crops_round_the_true_body(patch):
    """Which is to say: windows."""
    detect = PixelPipeline.detect

    def leaking(self, ids, expected, due, rngs):
        middle = expected.mean_world.mean(2, keepdims=True)
        joints = expected.mean_world + hips_of(self) - middle
        return detect(self, ids, dataclasses.replace(expected, mean_world=joints), due, rngs)

    patch.setattr(PixelPipeline, "detect", leaking)


def a_tracker_that_keeps_the_truth(patch):
    """A millionth of it, in its state."""

    def spoil(self, keypoints):
        body = self.state.trees["body"][..., :3]
        body[...] += 1e-6 * (hips_of(self)[:, :, None] - body)
        return keypoints

    for kind in (PixelPipeline, EmulatorPipeline):
        after(patch, kind, "detect", spoil)


def a_reward_for_the_true_separation(patch):
    def spoil(self, terms):
        return {**terms, "proximity": -self.separation_m}

    after(patch, Simulation, "_reward_terms", spoil)


def a_belief_in_the_true_separation(patch):
    """Which observation, reward and shield read."""

    def spoil(self, belief):
        gap_m = np.broadcast_to(self.separation_m[:, None], belief.separation.distance_m.shape)
        wrong = dataclasses.replace(belief.separation, distance_m=gap_m)
        return dataclasses.replace(belief, separation=wrong)

    after(patch, Simulation, "_believe", spoil)


LEAKS = {
    half_of_the_truth: (LEVELS, "observation"),
    half_of_what_the_sensor_was_shown: (LEVELS, "observation"),
    crops_round_the_true_body: (("pixels",), "windows"),
    a_tracker_that_keeps_the_truth: (LEVELS[:2], "pipeline"),
    a_reward_for_the_true_separation: (LEVELS, "reward"),
    a_belief_in_the_true_separation: (LEVELS, "belief"),
}
"""What leaks, at which levels, and what moves then."""
CASES = [(level, leak, says) for leak, (levels, says) in LEAKS.items() for level in levels]


@pytest.mark.parametrize("perturb", ["another worker", "shifted"])
@pytest.mark.parametrize(("level", "leak", "says"), CASES)
def test_a_leak_is_seen(level, leak, says, perturb):
    moved = leaks(differences(partial(single, level), PERTURBED[perturb], leak, n_steps=5))
    assert [name for name in moved if name.startswith(says)], moved


@pytest.mark.parametrize("task", ["HRCHandover-v0", "HRCPickPlaceGoal-v0", "HRCDelivery-v0"])
@pytest.mark.parametrize(
    ("leak", "says"),
    [(half_of_the_truth, "observation"), (a_reward_for_the_true_separation, "reward")],
)
def test_a_leak_is_seen_in_other_tasks(task, leak, says):
    moved = leaks(differences(partial(of, task), PERTURBED["shifted"], leak, n_steps=3))
    assert [name for name in moved if name.startswith(says)], moved


def test_a_millionth_of_the_truth_is_a_leak():
    """In one step of one estimate, to the bit."""
    leak = partial(half_of_the_truth, share=1e-6)
    moved = leaks(differences(partial(single, "none"), PERTURBED["shifted"], leak, n_steps=1))
    assert any(name.startswith("belief") for name in moved)
