"""Nobody earns by going round in circles: what is gained on a way is lost on the way back."""

import numpy as np
import pytest

from hrc_env.agents.env_info import env_info
from hrc_env.agents.experts import PickPlacer
from hrc_env.core.records import ObjectState
from hrc_env.env import HRCEnv
from hrc_env.observations import split
from hrc_env.tasks.pick_place import PLACES_WORLD, PickPlace
from hrc_env.world import World

TASK = PickPlace()
CONFIG = TASK.config
TASK_TERMS = ("reward/progress", "reward/placed")


class Robot:
    """What the task reads of one."""

    def __init__(self, tool_world):
        self.tool_world = tool_world


def begun(n: int = 1):
    state = TASK.make_state(n)
    rngs = [np.random.default_rng(b) for b in range(n)]
    tool = np.tile([-0.3, 0.0, 1.2], (n, 1))
    TASK.reset(state, np.arange(n), rngs, World(Robot(tool)))
    return state, rngs, tool


def worth(state, rngs, studs, tool, held=False):
    """The task's reward (B,) for pieces that are there now, at rest."""
    straight = np.zeros((*studs.shape[:2], 4))
    straight[..., 0] = 1.0
    still = np.zeros_like(studs)
    hands = np.full(studs.shape[:2], held)
    world = World(Robot(tool), None, ObjectState(studs, straight, still, still, hands))
    step = TASK.advance(state, rngs, world, 0.04)
    return CONFIG.progress_per_m * step["progress_m"] + CONFIG.placed_bonus * step["placed"]


def potential(state):
    return CONFIG.placed_bonus * state["placed"].sum(1) - CONFIG.progress_per_m * state["left_m"]


def test_pieces_that_are_pushed_to_and_fro_earn_nothing():
    """Whatever their way: pieces jump anywhere, in and out of their places, held or not."""
    state, rngs, tool = begun(8)
    rng, first, earned = np.random.default_rng(0), potential(state), np.zeros(8)
    before = state["poses"][..., :3].copy()
    for _ in range(300):
        near = PLACES_WORLD + rng.normal(0, 0.005, (8, 3, 3))
        far = before + rng.normal(0, 0.3, (8, 3, 3))
        studs = np.where(rng.random((8, 3, 1)) < 0.5, near, far)
        tool = tool + rng.normal(0, 0.2, (8, 3))
        earned += worth(state, rngs, studs, tool, held=bool(rng.random() < 0.3))
        np.testing.assert_allclose(earned, potential(state) - first, atol=1e-9)
        assert (earned <= CONFIG.placed_bonus * 3 - first + 1e-9).all()
    there, back = np.tile(PLACES_WORLD, (8, 1, 1)), before
    cycles = []
    for _ in range(10):
        once = worth(state, rngs, there, tool)
        cycles.append(once + worth(state, rngs, back, tool))
    np.testing.assert_allclose(cycles[1:], 0.0, atol=1e-9)
    assert (once > 30.0).all()  # there alone is worth something


@pytest.mark.parametrize("reward", ["dense", "sparse"])
def test_picking_up_and_laying_down_again_and_again_earns_nothing(reward):
    """An expert that is told other places in turn: it takes a piece out of the rack again, too."""
    config = {"task": {"reward": reward}, "objects": {"noise_m": 0.0, "noise_rad": 0.0}}
    env = HRCEnv("HRCPickPlace-v0", perception="none", n_workers=0, control="twist", config=config)
    agent, layout = PickPlacer(env_info(env.simulation)), env.simulation.layout
    observation, _ = env.reset(seed=3)
    state = env.simulation.task_state
    first = -state["left_m"][0] * (reward == "dense")
    earned, lifts, outs, was_held, was_placed, bests = 0.0, 0, 0, False, 0, []
    for k in range(1200):
        terms = split(observation, layout)
        if k % 400 > 200:  # its place is said to be beside the rack: out again, down there
            terms["place_from_object"] = terms["place_from_object"] + np.tile([0.0, -0.12, 0.0], 3)
            terms["object_placed"] = np.zeros(3)
        observation, _, _, _, info = env.step(agent.act_on(terms))
        earned += sum(info[name] for name in TASK_TERMS)
        held = bool(terms["object_held"].any())
        placed = int(info["task/studs_placed"])
        lifts, outs = lifts + (held and not was_held), outs + (placed < was_placed)
        was_held, was_placed = held, placed
        now = -state["left_m"][0] * (reward == "dense")
        expected = CONFIG.progress_per_m * (now - first) + CONFIG.placed_bonus * placed
        assert earned == pytest.approx(expected, abs=1e-6)
        bests.append(earned)
    assert lifts >= 4
    assert outs >= 1
    assert max(bests) <= CONFIG.placed_bonus * 3 - CONFIG.progress_per_m * first
    env.close()
