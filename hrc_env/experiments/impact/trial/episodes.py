"""Episodes of one policy with one pair of eyes: always the same seeds and the same workers."""

import warnings
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from gymnasium.utils import seeding

from hrc_env.config import settle
from hrc_env.experiments.impact.trial.eyes import Eyes, Rig
from hrc_env.experiments.impact.trial.judge import judge, scene_of
from hrc_env.experiments.impact.trial.tally import Tally
from hrc_env.experiments.study.cache import PartProgress
from hrc_env.simulation import Simulation, checked_action
from hrc_env.step import rows_of
from hrc_env.vector.shards import Shards

PEOPLE = "unaware"
"""Workers who take no notice of the robot: their walk is then the same whatever it does."""
MakeAgent = Callable[[Simulation], Any]
"""The agent for a simulation's robot (`agents.base.Agent`)."""
Rows = dict[str, list[Any]]
"""Sums by name, one an episode."""


class Stages:
    """The environments of one pair of eyes, built when they are needed, used by every policy.

    Args:
        eyes: how the robots see.
        seeds: one an episode; the k-th episode has rig k modulo the number of rigs.
        n_steps: control steps of an episode.
        n_threads: of the environments; nothing depends on it.
    """

    def __init__(self, eyes: Eyes, seeds: Sequence[int], n_steps: int, n_threads: int) -> None:
        self.eyes, self.seeds, self.n_steps, self.n_threads = eyes, seeds, n_steps, n_threads
        self._built: dict[Rig, Shards] = {}

    def play(self, make_agent: MakeAgent, margin_m: float, tick: PartProgress) -> Rows:
        """Sums of every episode, in the order of the seeds.

        Args:
            make_agent: the policy; it gets observations only.
            margin_m: what it adds to the distances that it keeps [m].
            tick: told the share that is done.
        """
        rows: Rows = {}
        for r, rig in enumerate(self.eyes.rigs):
            mine = range(r, len(self.seeds), len(self.eyes.rigs))
            if not mine:
                continue
            share = len(mine) / len(self.seeds) / self.n_steps
            env, seeds = self._env(rig, len(mine)), [self.seeds[k] for k in mine]
            found = _run(env, make_agent, margin_m, seeds, self.n_steps, lambda s=share: tick(s))
            for name, values in found.items():
                row = rows.setdefault(name, [None] * len(self.seeds))
                row[mine.start :: mine.step] = values
        return rows

    def close(self) -> None:
        """Release threads and graphics contexts."""
        for env in self._built.values():
            env.close()
        self._built.clear()

    def _env(self, rig: Rig, n_episodes: int) -> Shards:
        if rig not in self._built:
            self._built[rig] = _build(self.eyes, rig, n_episodes, self.n_threads)
        return self._built[rig]


def _build(eyes: Eyes, rig: Rig, n_episodes: int, n_threads: int) -> Shards:
    """Environments with such eyes, through these cameras."""
    settings = settle(
        perception=eyes.perception, estimator=eyes.estimator, people=PEOPLE,
        faults=eyes.faults(rig), cameras=list(eyes.cameras(rig)),
    )  # fmt: skip
    threads = 1 if eyes.perception == "pixels" else min(n_threads, n_episodes)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that one camera is a poor rig is what we ask about
        return Shards(n_episodes, threads, partial(Simulation, settings=settings))


def _run(
    env: Shards,
    make_agent: MakeAgent,
    margin_m: float,
    seeds: Sequence[int],
    n_steps: int,
    stepped: Callable[[], None],
) -> Rows:
    """One episode of every seed, side by side."""
    agent, first = make_agent(env.parts[0]), env.parts[0]
    outcome = env.reset(np.arange(len(seeds)), [seeding.np_random(seed)[0] for seed in seeds])
    tallies = [Tally(part.batch, margin_m) for part in env.parts]
    spans = [np.arange(*env.bounds[k : k + 2]) for k in range(len(env.parts))]
    before = [scene_of(part) for part in env.parts]
    shape = (len(seeds), first.n_actions)
    for _ in range(n_steps):
        outcome = env.step(checked_action(agent.act(outcome.observation), shape))
        now = [scene_of(part) for part in env.parts]
        for part, tally, ids, was, is_ in zip(env.parts, tallies, spans, before, now, strict=True):
            tally.add(judge(part, was, is_), is_.joints_world, rows_of(outcome.info, ids))
        before = now
        stepped()
    seconds = n_steps * first.config.ctrl_dt
    parts = [
        tally.rows(rows_of(outcome.info, ids), seconds)
        for tally, ids in zip(tallies, spans, strict=True)
    ]
    return {name: [value for part in parts for value in part[name]] for name in parts[0]}
