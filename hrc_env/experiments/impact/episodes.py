"""Episodes of one policy with one perception setup, on fixed seeds and with the same workers.

As for the cost, distances are measured between the true capsules. `safety.incidents` defines
directed speeds and contacts.
"""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.agents.env_info import Agent
from hrc_env.core.infos import Info
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Ints
from hrc_env.evaluation.counts import ERRORS_M, GAPS_M, SPEEDS_MPS
from hrc_env.evaluation.rollout import rollout
from hrc_env.evaluation.sums import count_interventions, count_severe
from hrc_env.experiments.cache import PartProgress
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.experiments.stage import EndlessEpisodes, Rows, Stage
from hrc_env.geometry import chains
from hrc_env.geometry.distances import least_separation
from hrc_env.motion import generator
from hrc_env.safety.incidents import KINDS, MOVING_M_S
from hrc_env.simulation import Simulation
from hrc_env.vector.shards import Shards
from hrc_env.worker.body import worker_truth

STOP_M, SLOW_M = 0.10, 0.60
"""Separations below which the robot should stop and slow down [m] (`agents.scripted.Yielding`)."""
MakeAgent = Callable[[Simulation], Agent]
"""Function that makes the agent for the robot of a simulation."""
STEP = np.dtype([
    ("true_separation_m", float), ("believed_separation_m", float),
    ("robot_mps", float), ("worker_mps", float),
    ("error_m", float, N_JOINTS), ("joints_world", float, (N_JOINTS, 3)),
])  # fmt: skip
"""Data type of a step: true and estimated separation at its end, directed speeds, joint errors.

The estimated separation is infinite if there is no track. Speeds of the robot towards the worker,
and of the worker towards the robot, are positive [m/s]. Errors of the estimated joints and
positions of the true joints are in metres.
"""
Steps = NDArray[np.void]


def play(
    stage: Stage,
    seeds: Sequence[int],
    n_steps: int,
    make_agent: MakeAgent,
    margin_m: float,
    tick: PartProgress,
) -> Rows:
    """Play episodes of a policy and return the sums of each, in the order of the seeds.

    Args:
        stage: the environments.
        seeds: seeds, one per episode.
        n_steps: number of control steps of an episode.
        make_agent: function that makes the policy, which receives only observations.
        margin_m: distance that the policy adds to its limits [m].
        tick: callback that receives the increase of the completed fraction.
    """

    def play_block(env: Shards, seeds: list[int], tick: PartProgress) -> Rows:
        episodes = run(env, make_agent, seeds, n_steps, partial(tick, 1 / n_steps))
        dt_s, achieved = env.first.config.ctrl_dt, env.first.task.achieved
        return sum_episodes(episodes.steps, episodes.infos, margin_m, dt_s, achieved)

    return stage.play(seeds, play_block, tick)


def play_row(
    setup: PerceptionSetup,
    env_arguments: Mapping[str, Any],
    seeds: Sequence[int],
    n_steps: int,
    make_agent: MakeAgent,
    margin_m: float,
    tick: PartProgress,
) -> Rows:
    """Play episodes as `play` does, in environments that are made for this call.

    Args:
        setup: perception of the robot.
        env_arguments: other arguments of the environments.
        seeds: seeds, one per episode.
        n_steps: number of control steps of an episode.
        make_agent: function that makes the policy, which receives only observations.
        margin_m: distance that the policy adds to its limits [m].
        tick: callback that receives the increase of the completed fraction.
    """
    with closing(Stage(setup, setup.turns, env_arguments)) as stage:
        return play(stage, seeds, n_steps, make_agent, margin_m, tick)


class PlayedEpisodes(NamedTuple):
    """Steps of episodes that were played as one batch."""

    steps: Steps
    """Records (T, B) of the T steps, of type `STEP`."""
    infos: list[Info]
    """Infos of the T steps."""


def run(
    env: Shards,
    make_agent: MakeAgent,
    seeds: Sequence[int],
    n_steps: int,
    on_step: Callable[[], None],
) -> PlayedEpisodes:
    """Play one episode per seed as one batch.

    Args:
        env: the environments.
        make_agent: function that makes the policy.
        seeds: seeds, one per episode.
        n_steps: number of control steps of an episode.
        on_step: callback after every step.
    """
    agent, endless = make_agent(env.first), EndlessEpisodes(env)
    steps, infos = [], []
    for transition in rollout(endless, agent, endless.reset(seeds), n_steps):
        step = np.concatenate(list(map(measure_step, env.parts)))
        for name in ("robot", "worker"):
            step[f"{name}_mps"] = np.nan_to_num(transition.info[f"safety/{name}_towards_m_s"])
        steps.append(step)
        infos.append(transition.info)
        on_step()
    return PlayedEpisodes(np.stack(steps), infos)


def measure_step(part: Simulation) -> Steps:
    """Return the current separations and joint errors (B,) of the only worker in each episode."""
    worker = worker_truth(part.bodies, generator.current(part.motion))
    joints_world = worker.joints_world[:, 0]
    steps = np.zeros(len(joints_world), STEP)
    robot = chains.capsules(part.chain, part.physics.q), part.chain.capsule_radius_m
    capsules = worker.capsules_world[:, 0], worker.capsule_radius_m[:, 0]
    steps["true_separation_m"] = least_separation(*robot, *capsules).distance_m
    steps["believed_separation_m"] = part.belief.separation.distance_m[:, 0]
    off_m = part.estimate.mean_world[:, 0] - joints_world
    steps["error_m"], steps["joints_world"] = np.linalg.norm(off_m, axis=-1), joints_world
    return steps


def sum_episodes(
    steps: Steps,
    infos: Sequence[Info],
    margin_m: float,
    dt_s: float,
    achieved: str = "task/goals_reached",
) -> Rows:
    """Return all sums from which metrics are computed, as lists over episodes.

    Args:
        steps: records of T steps (T, B).
        infos: infos of T steps.
        margin_m: distance that the policy adds to its limits [m].
        dt_s: duration of a control step [s].
        achieved: name of the info that counts goals (`Task.achieved`).
    """
    nearest_m = np.stack([info["safety/min_separation_m"] for info in infos])
    cost = np.stack([info["cost"] for info in infos])
    sums = {
        "cost": cost.sum(0),
        "cost_towards": (cost * (steps["robot_mps"] > MOVING_M_S)).sum(0),
        "separation_min_m": np.fmin.reduce(nearest_m, axis=0, initial=np.inf),
        "goals": infos[-1][achieved],
        "minutes": np.full(cost.shape[1], len(infos) * dt_s / 60),
        **_count_decisions(steps, margin_m),
        **{f"contacts_{how}": infos[-1][f"safety/contacts_{how}"] for how in KINDS},
        **count_severe(infos),
        **count_interventions(infos),
        **_count_values(steps),
    }
    rows = {name: value.tolist() for name, value in sums.items()}
    walks = np.ascontiguousarray(np.swapaxes(steps["joints_world"], 0, 1))
    rows["walk"] = [hashlib.sha256(walk).hexdigest()[:16] for walk in walks]
    return rows


def _count_decisions(steps: Steps, margin_m: float) -> dict[str, Ints]:
    """Return the numbers (B,) of required, missed and false reactions, and of approaches."""
    found = {}
    for name, limit_m in (("stops", STOP_M), ("slowings", SLOW_M)):
        called = steps["true_separation_m"] < limit_m
        given = steps["believed_separation_m"] - margin_m < limit_m
        found[f"called_{name}"] = called.sum(0)
        found[f"missed_{name}"] = (called & ~given).sum(0)
        found[f"false_{name}"] = (given & ~called).sum(0)
    approaches = (steps["robot_mps"] > MOVING_M_S) & (steps["true_separation_m"] < STOP_M)
    return found | {"approaches": approaches.sum(0)}


def _count_values(steps: Steps) -> dict[str, Ints]:
    """Return histograms (B, bins): joint errors; near the worker, separation errors and speeds."""
    near = (steps["true_separation_m"] < SLOW_M).T
    optimism_m = (steps["believed_separation_m"] - steps["true_separation_m"]).T
    return {
        "error_counts": ERRORS_M.count(np.swapaxes(steps["error_m"], 0, 1)),
        "optimism_counts": GAPS_M.count(optimism_m, near),
        "robot_speed_counts": SPEEDS_MPS.count(steps["robot_mps"].T, near),
        "worker_speed_counts": SPEEDS_MPS.count(steps["worker_mps"].T, near),
    }
