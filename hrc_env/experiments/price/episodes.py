"""Episodes of a robot under a shield, seen with some eyes, and their outcomes.

As in `experiments.impact`: the same seeds and workers for everybody, who take no notice of the
robot; contacts are those of `safety.incidents`.
"""

import zlib
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.agents.env_info import Agent, env_info
from hrc_env.agents.registry import control_of, make_agent
from hrc_env.core.typing import Points3
from hrc_env.evaluation.rollout import rollout
from hrc_env.experiments.agents import described
from hrc_env.experiments.cache import PartProgress
from hrc_env.experiments.price.eyes import Eyes
from hrc_env.experiments.price.shield import Widened
from hrc_env.experiments.stage import Endless, Rows, Stage
from hrc_env.motion import generator
from hrc_env.simulation import Simulation
from hrc_env.tasks.task import find_task
from hrc_env.vector.shards import Shards
from hrc_env.worker.body import worker_truth

SCRIPTED = "scripted"
"""The agent that drives to its goals whoever is near."""
CONTACTS = {
    "towards": "safety/contacts_towards", "standing": "safety/contacts_standing",
    "away": "safety/contacts_fleeing",
}  # fmt: skip
"""Contacts of an episode so far, by what the robot did: their keys in infos."""
STEP = np.dtype([
    *((name, float) for name in (*CONTACTS, "achieved", "cost")), ("over", bool),
])  # fmt: skip
"""What the episode has come to after a step, the step's cost, and whether that was the end."""


@dataclass(frozen=True, slots=True)
class Driver:
    """The agent that drives the robot."""

    agent: str = SCRIPTED
    """As `hrc_env.make_agent` takes it."""
    control: str | None = None
    """Its control, if its file does not name one; None: the default."""
    trust: bool = False
    """Whether pickles in its checkpoint are read, as of `make_agent`."""

    @property
    def words(self) -> str:
        """As in reports."""
        usual = self.agent == SCRIPTED
        return "the scripted robot" if usual else f"the robot that the agent `{self.agent}` drives"

    @property
    def given(self) -> dict[str, Any]:
        """The argument of the environment that follows from it."""
        control = control_of(self.agent) or self.control
        return {} if control is None else {"control": control}

    def settings(self) -> dict[str, Any]:
        """Return the settings of the agent that episodes depend on, as JSON can hold them; none of
        the default agent."""
        found = {} if self.agent == SCRIPTED else {"agent": described(self.agent)}
        return found | self.given

    def make(self, part: Simulation) -> Agent:
        """Return the agent for a robot."""
        return make_agent(self.agent, env_info(part), trust=self.trust)


class Watched:
    """A task's episodes with one pair of eyes."""

    def __init__(
        self,
        eyes: Eyes,
        task: str,
        n_steps: int,
        is_shielded: bool = True,
        driver: Driver = Driver(),
    ) -> None:
        self.eyes, self.task, self.n_steps, self.driver = eyes, task, n_steps, driver
        self.is_shielded, self._shield = is_shielded, Widened(eyes.covariance)
        shield = self._shield if is_shielded else None
        made_with = {"task": task, "shield": shield, **driver.given}
        self._stage = Stage(eyes.setup, eyes.turns(find_task(task).scene), made_with)

    def play(self, seeds: Sequence[int], margin_m: float, tick: PartProgress) -> Rows:
        """Return sums of every episode; the shield keeps `margin_m` more than by itself."""
        self._shield.margin_m = margin_m
        play = partial(run, n_steps=self.n_steps, driver=self.driver)
        return self._stage.play(seeds, play, tick)

    def close(self) -> None:
        """Release threads and graphics contexts."""
        self._stage.close()


def play_episodes(
    eyes: Eyes,
    task: str,
    n_steps: int,
    is_shielded: bool,
    driver: Driver,
    seeds: Sequence[int],
    margin_m: float,
    tick: PartProgress,
) -> Rows:
    """Return what `Watched.play` does, in environments of its own.

    Args:
        eyes, task, n_steps, is_shielded, driver: as of `Watched`.
        seeds, margin_m, tick: as of `Watched.play`.
    """
    with closing(Watched(eyes, task, n_steps, is_shielded, driver)) as watched:
        return watched.play(seeds, margin_m, tick)


def run(
    env: Shards, seeds: Sequence[int], tick: PartProgress, n_steps: int, driver: Driver
) -> Rows:
    """Return what one episode of every seed came to, played side by side."""
    agent, endless, task = driver.make(env.first), Endless(env), env.first.task
    steps, walks = np.zeros((n_steps, len(seeds)), STEP), [0] * len(seeds)
    so_far = {**CONTACTS, "achieved": task.achieved}
    played = rollout(endless, agent, endless.reset(seeds), n_steps)
    for step, made in zip(steps, played, strict=True):
        for name, key in so_far.items():
            step[name] = made.info[key]
        step["cost"], step["over"] = made.info["cost"], endless.terminated
        joints = np.concatenate(list(map(true_joints, env.parts)))
        walks = [zlib.crc32(of_one, walk) for of_one, walk in zip(joints, walks, strict=True)]
        tick(1 / n_steps)
    return {**sums_of(steps, env.first.config.ctrl_dt), "walk": walks}


def true_joints(part: Simulation) -> Points3:
    """(B, W, J, 3) where workers truly are."""
    return worker_truth(part.bodies, generator.current(part.motion)).joints_world


def sums_of(steps: NDArray[np.void], dt_s: float) -> Rows:
    """What episodes came to, a list over episodes each, from steps (T, B) of `STEP`; what happens
    after the end of an episode does not count."""
    ended = np.logical_or.accumulate(steps["over"], axis=0)
    counts = np.vstack([np.ones((1, steps.shape[1]), bool), ~ended[:-1]])
    n_steps = counts.sum(0)
    last = steps[n_steps - 1, np.arange(steps.shape[1])]
    sums = {
        "minutes": n_steps * dt_s / 60,
        **{name: last[name] for name in ("achieved", *CONTACTS)},
        "cost": (steps["cost"] * counts).sum(0),
    }
    return {name: values.tolist() for name, values in sums.items()}
