"""Episodes of one policy with one perception setup: always the same seeds and the same workers.

Distances are between true capsules, as in the cost; directed speeds and contacts are those of
`safety.incidents`.
"""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.infos import Info
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Ints
from hrc_env.evaluation.counts import ERRORS_M, GAPS_M, SPEEDS_MPS
from hrc_env.evaluation.rollout import rollout
from hrc_env.experiments.cache import PartProgress
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.experiments.stage import Endless, Rows, Stage
from hrc_env.geometry import chains
from hrc_env.geometry.distances import least_separation
from hrc_env.motion import generator
from hrc_env.safety.incidents import KINDS, MOVING_M_S
from hrc_env.simulation import Simulation
from hrc_env.vector.shards import Shards
from hrc_env.worker.body import worker_truth

STOP_M, SLOW_M = 0.10, 0.60
"""Separations that call for standing still and for slowing down [m]: `agents.scripted.Yielding`."""
MakeAgent = Callable[[Simulation], Any]
"""The agent for a simulation's robot (`agents.env_info.Agent`)."""
STEP = np.dtype([
    ("true_separation_m", float), ("believed_separation_m", float),
    ("robot_mps", float), ("worker_mps", float),
    ("error_m", float, N_JOINTS), ("joints_world", float, (N_JOINTS, 3)),
])  # fmt: skip
"""What happened in a step: the separation at its end, truly and as the robot believes it (infinite
where it knows of nobody), speeds towards the other, errors of the estimated joints, true joints."""
Steps = NDArray[np.void]


def play(
    stage: Stage,
    seeds: Sequence[int],
    n_steps: int,
    make_agent: MakeAgent,
    margin_m: float,
    tick: PartProgress,
) -> Rows:
    """Return sums of every episode of a policy, in the order of the seeds.

    Args:
        stage: the environments.
        seeds: one an episode.
        n_steps: control steps of each.
        make_agent: makes the policy, which gets observations only.
        margin_m: what it adds to the distances that it keeps [m].
        tick: called with the growth of the share that is done.
    """

    def play_block(env: Shards, seeds: list[int], tick: PartProgress) -> Rows:
        steps, infos = run(env, make_agent, seeds, n_steps, partial(tick, 1 / n_steps))
        return sums_of(steps, infos, margin_m, env.first.config.ctrl_dt, env.first.task.achieved)

    return stage.play(seeds, play_block, tick)


def play_row(
    setup: PerceptionSetup,
    made_with: Mapping[str, Any],
    seeds: Sequence[int],
    n_steps: int,
    make_agent: MakeAgent,
    margin_m: float,
    tick: PartProgress,
) -> Rows:
    """Return what `play` does, in environments of its own.

    Args:
        setup: what the robot sees with.
        made_with: other arguments of the environments.
        seeds: here and below: as of `play`.
    """
    with closing(Stage(setup, setup.turns, made_with)) as stage:
        return play(stage, seeds, n_steps, make_agent, margin_m, tick)


def run(
    env: Shards,
    make_agent: MakeAgent,
    seeds: Sequence[int],
    n_steps: int,
    stepped: Callable[[], None],
) -> tuple[Steps, list[Info]]:
    """One episode of every seed, side by side: what happened (T, B, ...), the infos of T steps."""
    agent, endless = make_agent(env.first), Endless(env)
    steps, infos = [], []
    for made in rollout(endless, agent, endless.reset(seeds), n_steps):
        now = np.concatenate(list(map(judge, env.parts)))
        for who in ("robot", "worker"):
            now[f"{who}_mps"] = np.nan_to_num(made.info[f"safety/{who}_towards_m_s"])
        steps.append(now)
        infos.append(made.info)
        stepped()
    return np.stack(steps), infos


def judge(part: Simulation) -> Steps:
    """(B,) where one worker is in a simulation now, truly and as is believed."""
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


def sums_of(
    steps: Steps,
    infos: Sequence[Info],
    margin_m: float,
    dt_s: float,
    achieved: str = "task/goals_reached",
) -> Rows:
    """Everything that numbers are made of, a list over episodes each, from T steps of B; what was
    `achieved` (`Task.achieved`) counts as goals."""
    nearest_m = np.stack([info["safety/min_separation_m"] for info in infos])
    cost = np.stack([info["cost"] for info in infos])
    sums = {
        "cost": cost.sum(0),
        "cost_towards": (cost * (steps["robot_mps"] > MOVING_M_S)).sum(0),
        "separation_min_m": np.fmin.reduce(nearest_m, axis=0, initial=np.inf),
        "goals": infos[-1][achieved],
        "minutes": np.full(cost.shape[1], len(infos) * dt_s / 60),
        **_decisions(steps, margin_m),
        **{f"contacts_{how}": infos[-1][f"safety/contacts_{how}"] for how in KINDS},
        **_counts(steps),
    }
    rows = {name: value.tolist() for name, value in sums.items()}
    walks = np.ascontiguousarray(np.swapaxes(steps["joints_world"], 0, 1))
    rows["walk"] = [hashlib.sha256(walk).hexdigest()[:16] for walk in walks]
    return rows


def _decisions(steps: Steps, margin_m: float) -> dict[str, Ints]:
    """(B,) how often the belief decides otherwise than the truth, and what came of it."""
    found = {}
    for name, limit_m in (("stops", STOP_M), ("slowings", SLOW_M)):
        called = steps["true_separation_m"] < limit_m
        given = steps["believed_separation_m"] - margin_m < limit_m
        found[f"called_{name}"] = called.sum(0)
        found[f"missed_{name}"] = (called & ~given).sum(0)
        found[f"false_{name}"] = (given & ~called).sum(0)
    approaches = (steps["robot_mps"] > MOVING_M_S) & (steps["true_separation_m"] < STOP_M)
    return found | {"approaches": approaches.sum(0)}


def _counts(steps: Steps) -> dict[str, Any]:
    """(B, bins) errors always; separations and speeds where the separation matters."""
    near = (steps["true_separation_m"] < SLOW_M).T
    optimism_m = (steps["believed_separation_m"] - steps["true_separation_m"]).T
    return {
        "error_counts": ERRORS_M.count(np.swapaxes(steps["error_m"], 0, 1)),
        "optimism_counts": GAPS_M.count(optimism_m, near),
        "robot_speed_counts": SPEEDS_MPS.count(steps["robot_mps"].T, near),
        "worker_speed_counts": SPEEDS_MPS.count(steps["worker_mps"].T, near),
    }
