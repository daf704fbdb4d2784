"""Episodes of the scripted robot under a shield, seen with some eyes: what came of each.

As in `experiments.impact`: the same seeds and workers for everybody, who take no notice of the
robot; a contact is called by what the robot did in the step before it began.
"""

import warnings
import zlib
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from numpy.typing import NDArray

from hrc_env.config import settle
from hrc_env.control import checked_action
from hrc_env.core.checkout import agents
from hrc_env.core.machine import n_cores
from hrc_env.core.records import WorkerTruth
from hrc_env.core.typing import Bools, Capsules, Floats
from hrc_env.experiments.impact.episodes import PEOPLE, MakeAgent, Rows
from hrc_env.experiments.price.eyes import Eyes
from hrc_env.experiments.price.shield import Widened
from hrc_env.experiments.study.cache import PartProgress
from hrc_env.experiments.study.rigs import Turn
from hrc_env.geometry.distances import least_separation
from hrc_env.motion import generator
from hrc_env.safety.incidents import AGAIN_S, MOVING_M_S
from hrc_env.simulation import Simulation
from hrc_env.tasks.task import task_called
from hrc_env.vector.shards import Shards
from hrc_env.worker.body import worker_truth

TOGETHER = 300
"""So many episodes are played side by side."""
STEP = np.dtype([
    ("towards_mps", float), ("touching", bool), ("cost", float), ("achieved", float),
    ("over", bool),
])  # fmt: skip
"""What happened in a step; how fast the robot came nearer to the nearest worker."""
Bodies = tuple[tuple[Capsules, Floats], WorkerTruth]
"""The robot's capsules (B, K, 2, 3) and radii (B, K) [m], with what it carries; the workers."""


class Stage:
    """A task's episodes with one pair of eyes."""

    def __init__(self, eyes: Eyes, task: str, n_steps: int, is_shielded: bool = True) -> None:
        self.eyes, self.task, self.n_steps = eyes, task, n_steps
        self.is_shielded, self._shield = is_shielded, Widened(eyes.covariance)
        self._envs: dict[tuple[int, int], Shards] = {}

    def play(self, seeds: Sequence[int], margin_m: float, tick: PartProgress) -> Rows:
        """Sums of every episode, in the order of the seeds, of which the k-th has turn k modulo
        their number; the shield keeps `margin_m` more than it does by itself."""
        self._shield.margin_m = margin_m
        rows, turns = Rows(), self.eyes.turns(task_called(self.task).scene)
        for k, turn in enumerate(turns[: len(seeds)]):
            mine = np.arange(k, len(seeds), len(turns))
            for ids in np.array_split(mine, -(-len(mine) // TOGETHER)):
                env = self._env(k, turn, len(ids))
                stepped = partial(tick, len(ids) / len(seeds) / self.n_steps)
                played = run(env, scripted, [seeds[i] for i in ids], self.n_steps, stepped)
                for name, values in played.items():
                    row = rows.setdefault(name, [None] * len(seeds))
                    for i, value in zip(ids.tolist(), values, strict=True):
                        row[i] = value
        return rows

    def close(self) -> None:
        """Release threads and graphics contexts."""
        for env in self._envs.values():
            env.close()

    def _env(self, k: int, turn: Turn, batch: int) -> Shards:
        if (k, batch) not in self._envs:
            setup = self.eyes.setup
            settings = settle(
                task=self.task, perception=setup.level, estimator=setup.estimator, people=PEOPLE,
                faults=list(turn.faults), cameras=list(turn.cameras),
                shield=self._shield if self.is_shielded else None,
            )  # fmt: skip
            threads = 1 if setup.level == "pixels" else min(n_cores(), batch)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # that one camera is a poor rig is what we ask
                self._envs[k, batch] = Shards(
                    batch, threads, partial(Simulation, settings=settings)
                )
        return self._envs[k, batch]


def scripted(part: Simulation) -> Any:
    """The agent that drives to its goals whoever is near."""
    return agents("registry").make_agent("scripted", agents("env_info").env_info(part))


def run(
    env: Shards, make_agent: MakeAgent, seeds: Sequence[int], n_steps: int, stepped: Any
) -> Rows:
    """One episode of every seed, side by side."""
    agent, shape, task = make_agent(env.first), (len(seeds), env.first.n_actions), env.first.task
    result = env.reset(np.arange(len(seeds)), [seeding.np_random(seed)[0] for seed in seeds])
    steps, walks = np.zeros((n_steps, len(seeds)), STEP), [0] * len(seeds)
    before = list(map(bodies_of, env.parts))
    for step in steps:
        result = env.step(checked_action(agent.act(result.observation), shape))
        now = list(map(bodies_of, env.parts))
        step["towards_mps"] = np.concatenate(list(map(towards_m, before, now)))
        step["towards_mps"] /= env.first.config.ctrl_dt
        step["touching"], step["cost"] = result.info["cost_contact"] > 0, result.info["cost"]
        step["achieved"], step["over"] = result.info[task.achieved], result.terminated
        joints = np.concatenate([worker.joints_world for _, worker in now])
        walks = [zlib.crc32(of_one, walk) for of_one, walk in zip(joints, walks, strict=True)]
        before = now
        stepped()
    return {**sums_of(steps, env.first.config.ctrl_dt), "walk": walks}


def bodies_of(part: Simulation) -> Bodies:
    """Where everybody truly is; of itself a robot knows the truth."""
    robot = part.belief.robot
    radius_m = np.broadcast_to(robot.capsule_radius_m, robot.capsules_world.shape[:2])
    truth = worker_truth(part.bodies, generator.current(part.motion))
    return (robot.capsules_world, radius_m), truth


def towards_m(before: Bodies, now: Bodies) -> Floats:
    """(B,) by how much the robot's motion narrowed the gap to whoever is nearest [m]: workers are
    held where they are at the end."""
    (robot_before, _), (robot, workers) = before, now
    batch = len(workers.joints_world)
    capsules_world = workers.capsules_world.reshape(batch, -1, 2, 3)
    radius_m = workers.capsule_radius_m.reshape(batch, -1)
    gap_before_m, gap_m = (
        least_separation(capsules, thick_m, capsules_world, radius_m).distance_m
        for capsules, thick_m in (robot_before, robot)
    )
    return gap_before_m - gap_m


def sums_of(steps: NDArray[np.void], dt_s: float) -> Rows:
    """What episodes came to, a list over episodes each, from steps (T, B) of `STEP`; what happens
    after the end of an episode does not count."""
    ended = np.logical_or.accumulate(steps["over"], axis=0)
    counts = np.vstack([np.ones((1, steps.shape[1]), bool), ~ended[:-1]])
    n_steps, begins = counts.sum(0), first_touches(steps["touching"], round(AGAIN_S / dt_s))
    begins = (begins & counts)[1:]
    speed = steps["towards_mps"][:-1]
    towards, away = speed > MOVING_M_S, speed < -MOVING_M_S
    sums = {
        "minutes": n_steps * dt_s / 60,
        "achieved": steps["achieved"][n_steps - 1, np.arange(steps.shape[1])],
        "towards": (begins & towards).sum(0),
        "standing": (begins & ~towards & ~away).sum(0),
        "away": (begins & away).sum(0),
        "cost": (steps["cost"] * counts).sum(0),
    }
    return {name: values.tolist() for name, values in sums.items()}


def first_touches(touching: Bools, n_apart: int) -> Bools:
    """(T, B) where touches begin of whom nobody touched in the `n_apart` steps before."""
    n_steps, so_far = len(touching), np.cumsum(np.pad(touching, ((1, 0), (0, 0))), axis=0)[:-1]
    long_ago = np.pad(so_far, ((n_apart, 0), (0, 0)))[:n_steps]
    return touching & (so_far == long_ago)
