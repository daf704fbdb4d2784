"""Episodes of one policy with one perception setup: always the same seeds and the same workers.

Distances are between true capsules, as in the cost; directed speeds and contacts are those of
`safety.incidents`.
"""

import hashlib
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from numpy.typing import NDArray

from hrc_env.config import settle
from hrc_env.control import checked_action
from hrc_env.core.infos import Info
from hrc_env.core.machine import n_cores
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.evaluation.counts import ERRORS_M, GAPS_M, SPEEDS_MPS
from hrc_env.evaluation.rollout import rollout
from hrc_env.experiments.cache import PartProgress
from hrc_env.experiments.rigs import Turn
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.geometry import chains
from hrc_env.geometry.distances import least_separation
from hrc_env.motion import generator
from hrc_env.safety.incidents import KINDS, MOVING_M_S
from hrc_env.simulation import Simulation
from hrc_env.step_result import Observation
from hrc_env.tasks import DEFAULT
from hrc_env.vector.shards import Shards
from hrc_env.worker.body import worker_truth

PEOPLE = "unaware"
"""Workers who take no notice of the robot: their walk is then the same whatever it does."""
STOP_M, SLOW_M = 0.10, 0.60
"""Separations that call for standing still and for slowing down [m]: `agents.scripted.Yielding`."""
MakeAgent = Callable[[Simulation], Any]
"""The agent for a simulation's robot (`agents.env_info.Agent`)."""
Rows = dict[str, list[Any]]
"""Sums by name, one an episode."""
STEP = np.dtype([
    ("true_separation_m", float), ("believed_separation_m", float),
    ("robot_mps", float), ("worker_mps", float),
    ("error_m", float, N_JOINTS), ("joints_world", float, (N_JOINTS, 3)),
])  # fmt: skip
"""What happened in a step: the separation at its end, truly and as the robot believes it (infinite
where it knows of nobody), speeds towards the other, errors of the estimated joints, true joints."""
Steps = NDArray[np.void]


class Stage:
    """The environments of one setup, built when they are needed, used by every policy: an episode
    a seed, of which the k-th has turn k modulo the number of turns."""

    def __init__(
        self,
        setup: PerceptionSetup,
        seeds: Sequence[int],
        n_steps: int,
        task: str = DEFAULT,
        shield: str | None = None,
    ) -> None:
        self.setup, self.seeds, self.n_steps = setup, seeds, n_steps
        self.made_with = {"task": task, "shield": shield}
        self._envs: list[Shards] = []

    def play(self, make_agent: MakeAgent, margin_m: float, tick: PartProgress) -> Rows:
        """Sums of every episode, in the order of the seeds; the policy, which gets observations
        only, adds `margin_m` to the distances that it keeps."""
        rows, n = Rows(), len(self.seeds)
        turns = self.setup.turns[:n]
        in_turns = [slice(k, None, len(turns)) for k in range(len(turns))]
        self._envs = self._envs or [
            build(self.setup, turn, len(self.seeds[mine]), self.made_with)
            for turn, mine in zip(turns, in_turns, strict=True)
        ]
        for env, mine in zip(self._envs, in_turns, strict=True):
            seeds = self.seeds[mine]
            stepped = partial(tick, len(seeds) / n / self.n_steps)
            steps, infos = run(env, make_agent, seeds, self.n_steps, stepped)
            sums = sums_of(
                steps, infos, margin_m, env.first.config.ctrl_dt, env.first.task.achieved
            )
            for name, values in sums.items():
                rows.setdefault(name, [None] * n)[mine] = values
        return rows

    def close(self) -> None:
        """Release threads and graphics contexts."""
        for env in self._envs:
            env.close()


def build(
    setup: PerceptionSetup, turn: Turn, n_episodes: int, made_with: Mapping[str, Any]
) -> Shards:
    """Environments with such a setup, through these cameras, with these other arguments."""
    settings = settle(
        perception=setup.level, estimator=setup.estimator, people=PEOPLE,
        faults=list(turn.faults), cameras=list(turn.cameras), **made_with,
    )  # fmt: skip
    threads = 1 if setup.level == "pixels" else min(n_cores(), n_episodes)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that one camera is a poor rig is what we ask about
        return Shards(n_episodes, threads, partial(Simulation, settings=settings))


class Endless:
    """Environments whose episodes go on after their end, for studies of a fixed length."""

    def __init__(self, env: Shards) -> None:
        self.env = env
        self.terminated: Bools = np.zeros(env.bounds[-1], np.bool_)
        """(B,) whether an episode ended with the last step."""

    def reset(self, seeds: Sequence[int]) -> Observation:
        """Begin an episode of every seed; return the observation."""
        rngs = [seeding.np_random(seed)[0] for seed in seeds]
        return self.env.reset(np.arange(len(seeds)), rngs).observation

    def step(self, action: Any) -> tuple[Observation, Floats, Bools, Bools, Info]:
        """Step every environment; no episode is over."""
        shape = len(self.terminated), self.env.first.n_actions
        result = self.env.step(checked_action(action, shape))
        self.terminated, never = result.terminated, np.zeros_like(result.terminated)
        return result.observation, result.reward, never, never, result.info


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
