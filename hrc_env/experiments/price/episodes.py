"""Episodes of a robot with one perception setup and one setting of the shield, and their outcomes.

As in `experiments.impact`, all setups have the same seeds and the same workers, which ignore the
robot. `safety.incidents` defines contacts.
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
from hrc_env.agents.registry import make_agent
from hrc_env.core.typing import Points3
from hrc_env.evaluation.rollout import rollout
from hrc_env.evaluation.sums import ABOVE, ACTIVE, FORCE, INTERVENTIONS, RATED, SEVERITY
from hrc_env.experiments.agents import describe_agent, find_env_arguments
from hrc_env.experiments.cache import PartProgress
from hrc_env.experiments.price.setups import PriceSetup
from hrc_env.experiments.price.true_bodies import TrueBodyShield
from hrc_env.experiments.stage import EndlessEpisodes, Rows, Stage
from hrc_env.motion import generator
from hrc_env.safety.config import ShieldConfig
from hrc_env.simulation import Simulation
from hrc_env.tasks.task import find_task
from hrc_env.vector.shards import Shards
from hrc_env.worker.body import worker_truth

SCRIPTED = "scripted"
"""Name of the agent that moves to its goals and ignores the worker."""
CONTACTS = {
    "towards": "safety/contacts_towards", "standing": "safety/contacts_standing",
    "away": "safety/contacts_fleeing",
}  # fmt: skip
"""Infos that count the contacts of the current episode, by the motion of the robot."""
STEP = np.dtype([
    *((name, float) for name in (*CONTACTS, "achieved", "cost", "severity", "force", "active")),
    ("over", bool),
])  # fmt: skip
"""Data type of the state of an episode after a step: counts since the start of the episode; cost of
the step; severity of a contact that begins, and its force over the limit of the touched region;
whether the shield is active, NaN without a shield; and whether the episode has ended."""


@dataclass(frozen=True, slots=True)
class Driver:
    """The agent that controls the robot."""

    agent: str = SCRIPTED
    """Agent as `hrc_env.make_agent` accepts it."""
    control: str | None = None
    """Control mode of the agent if the agent's file does not name one; None: the default."""
    trust: bool = False
    """Whether pickles in the agent's checkpoint may be loaded, as in `make_agent`."""

    @property
    def words(self) -> str:
        """Description of the robot in reports."""
        if self.agent == SCRIPTED:
            return "the scripted robot"
        return f"the robot that the agent `{self.agent}` drives"

    @property
    def env_arguments(self) -> dict[str, Any]:
        """Arguments of the environment: control mode and observation of the agent."""
        return find_env_arguments(self.agent, self.control)

    def settings(self) -> dict[str, Any]:
        """Return the settings of the agent on which episodes depend, as JSON values.

        They are empty for the default agent with the default control mode.
        """
        settings = {} if self.agent == SCRIPTED else {"agent": describe_agent(self.agent)}
        return settings | self.env_arguments

    def make(self, part: Simulation) -> Agent:
        """Make the agent for the robot of a simulation."""
        return make_agent(self.agent, env_info(part), trust=self.trust)


def play_episodes(
    setup: PriceSetup,
    shield: ShieldConfig | None,
    task: str,
    n_steps: int,
    driver: Driver,
    seeds: Sequence[int],
    tick: PartProgress,
) -> Rows:
    """Play one episode per seed and return the sums of the episodes.

    Args:
        setup: the perception setup.
        shield: settings of the shield; None without a shield.
        task: id of the environment.
        n_steps: length of an episode [control steps].
        driver: the agent.
        seeds: seeds of the episodes.
        tick: callback that receives the increase of the completed fraction.
    """
    arguments = {"task": task, "shield": shield, **driver.env_arguments}
    stage = Stage(setup.perception, setup.turns(find_task(task).scene), arguments)
    with closing(stage):
        return stage.play(seeds, partial(run, setup, shield, n_steps, driver), tick)


def run(
    setup: PriceSetup,
    shield: ShieldConfig | None,
    n_steps: int,
    driver: Driver,
    env: Shards,
    seeds: Sequence[int],
    tick: PartProgress,
) -> Rows:
    """Play one episode per seed as one batch; arguments as in `play_episodes`."""
    if setup.knows_bodies and shield is not None:
        for part in env.parts:
            part.shield = TrueBodyShield(part, shield)
    agent, endless, task = driver.make(env.first), EndlessEpisodes(env), env.first.task
    steps, walks = np.zeros((n_steps, len(seeds)), STEP), [0] * len(seeds)
    keys = {**CONTACTS, "achieved": task.achieved}
    transitions = rollout(endless, agent, endless.reset(seeds), n_steps)
    for step, transition in zip(steps, transitions, strict=True):
        for name, key in keys.items():
            step[name] = transition.info[key]
        step["cost"], step["over"] = transition.info["cost"], endless.terminated
        step["severity"], step["force"] = transition.info[SEVERITY], transition.info[FORCE]
        step["active"] = transition.info.get(ACTIVE, np.nan)
        joints = np.concatenate(list(map(read_true_joints, env.parts)))
        walks = [zlib.crc32(row, walk) for row, walk in zip(joints, walks, strict=True)]
        tick(1 / n_steps)
    return {**sum_episodes(steps, env.first.config.ctrl_dt), "walk": walks}


def read_true_joints(part: Simulation) -> Points3:
    """Return the true joint positions (B, W, J, 3) of all workers [m]."""
    return worker_truth(part.bodies, generator.current(part.motion)).joints_world


def sum_episodes(steps: NDArray[np.void], dt_s: float) -> Rows:
    """Return the sums of episodes, as lists over episodes.

    Args:
        steps: records (T, B) of type `STEP`; steps after the end of an episode are ignored.
        dt_s: duration of a control step [s].
    """
    ended = np.logical_or.accumulate(steps["over"], axis=0)
    counts = np.vstack([np.ones((1, steps.shape[1]), bool), ~ended[:-1]])
    n_steps = counts.sum(0)
    last = steps[n_steps - 1, np.arange(steps.shape[1])]
    sums = {
        "minutes": n_steps * dt_s / 60,
        **{name: last[name] for name in ("achieved", *CONTACTS)},
        "cost": (steps["cost"] * counts).sum(0),
        RATED: ((steps["severity"] > 0) & counts).sum(0),
        ABOVE: ((steps["force"] > 1.0) & counts).sum(0),
    }
    if not np.isnan(steps["active"]).any():
        begins = np.diff(steps["active"], axis=0, prepend=0.0) > 0
        sums[INTERVENTIONS] = (begins & counts).sum(0)
    return {name: values.tolist() for name, values in sums.items()}
