"""Evaluation of agents with fixed seeds, deterministic actions and costs from the ground truth."""

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, fields
from functools import partial
from importlib import import_module
from typing import Any

import gymnasium
import numpy as np

from hrc_env.agents.env_info import Agent, AgentFactory, EnvInfo, env_info
from hrc_env.core.brought import check_arguments, describe
from hrc_env.core.errors import ConfigError, check_integer
from hrc_env.core.machine import n_cores
from hrc_env.core.results import Metric, describe_metric
from hrc_env.engines.engine import Engine, Tick, engine_called
from hrc_env.engines.files import carried
from hrc_env.engines.local import Processes, Serial
from hrc_env.env import HRCEnv
from hrc_env.evaluation.intervals import (
    estimate_burst_rate,
    estimate_goal_rate,
    estimate_mean,
    estimate_rate,
    estimate_share_of,
)
from hrc_env.evaluation.rollout import Transition, rollout
from hrc_env.evaluation.sums import (
    ABOVE,
    ACHIEVED,
    COST_UNIT,
    FAILED,
    INTERVENTIONS,
    RATED,
    EpisodeSums,
)
from hrc_env.safety.incidents import KINDS
from hrc_env.tasks import DEFAULT
from hrc_env.vector.env import HRCVectorEnv
from hrc_env.vector.member import info_of

EVALUATION_SEED = 1_000_000
"""Seed of the first evaluation episode, far from the seeds used in training."""
TOGETHER = 64
"""Number of episodes in a shard, which are played as one batch."""
DRAWN_TOGETHER = 4
"""Number of episodes in a shard at the level `pixels`."""


@dataclass(frozen=True, slots=True)
class Score:
    """Summary of an agent's episodes."""

    episodes: int
    """Number of episodes."""
    success_rate: float
    """Fraction of attempts that succeeded (`Task.achieved` and `Task.failed`)."""
    is_success: float
    """Fraction of episodes that end with an `info["is_success"]` of 1."""
    goals_per_minute: float
    """Goals reached per minute over all episodes [1/min]."""
    contacts_per_episode: float
    """Mean number of contacts with a true worker; a lasting contact counts once."""
    contacts_per_hour: Metric
    """Contacts of all kinds that began per hour of simulated time, with the exact interval [1/h].
    Touches within half a second of each other are one contact (`hrc_env.safety.incidents`)."""
    contacts_towards_per_hour: Metric
    """Contacts that began while the robot moved towards the worker [1/h]."""
    contacts_fleeing_per_hour: Metric
    """Contacts that began while the robot moved away from the worker [1/h]."""
    contacts_standing_per_hour: Metric
    """Contacts that began while the robot hardly moved [1/h]."""
    contacts_above_limit: Metric
    """Fraction of contacts with an estimated force above the limit of the touched body region
    (`safety/contact_force_ratio` > 1), with the exact interval; `n` is the number of contacts.
    Without a contact, the fraction is NaN."""
    interventions_per_hour: Metric
    """Number of times that the shield becomes active (`shield/active` rises from 0 to 1, or is 1 in
    the first step) per hour of simulated time [1/h]; NaN without a shield."""
    cost_per_episode: float
    """Mean over episodes of the sum of `info["cost"]`, which is computed from the truth [control
    steps]."""
    close_steps_per_episode: float
    """Mean number of steps in which the distance to the true worker is below the proximity
    limit."""
    median_min_separation_m: float
    """Median over episodes of the smallest distance to a true worker [m]."""
    return_mean: float
    """Mean sum of rewards."""

    def metrics(self) -> dict[str, Metric]:
        """Return the rates of contacts and interventions and the share of severe contacts."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in values.items() if isinstance(value, Metric)}

    def numbers(self) -> dict[str, float]:
        """Return all numbers by name; of those with an interval, the value."""
        metrics = self.metrics()
        return {
            field.name: metrics[field.name].value if field.name in metrics else number
            for field in fields(self)
            for number in (getattr(self, field.name),)
        }

    def describe(self) -> dict[str, str]:
        """Return all numbers as text by name, with intervals and numbers of observations."""
        texts = {name: f"{number:.3f}" for name, number in self.numbers().items()}
        return texts | {name: describe_metric(each) for name, each in self.metrics().items()}


def evaluate(
    make: str | AgentFactory,
    n_episodes: int = 64,
    seed: int = EVALUATION_SEED,
    *,
    engine: str | Engine | None = None,
    tick: Callable[[float], None] = lambda share: None,
    trust: bool = False,
    **kwargs: Any,
) -> Score:
    """Evaluate an agent over whole episodes with fixed seeds and return its score.

    Args:
        make: function that makes the agent for an `EnvInfo`; or an agent as `make_agent` accepts
            it: a name, a file or "module:function".
        n_episodes: number of episodes; episode k, from 0, begins with `reset(seed=seed + k)`.
        seed: seed of the first episode.
        engine: engine that plays the episodes, without effect on the score: "serial", "processes"
            or "ray" (the cluster to which this process is connected, or one on this machine); None:
            the fastest on this machine.
        tick: callback that receives the fraction of the work completed since its last call.
        trust: whether pickles in a checkpoint may be loaded, as in `make_agent`.
        kwargs: arguments of `HRCVectorEnv`, such as task, perception and estimator.

    Returns:
        Means and rates over the episodes.

    Raises:
        ConfigError: the agent or the engine does not exist, or `n_episodes` is below 1.
    """
    given = {"engine": engine, "tick": tick, "trust": trust, **kwargs}
    return summarize(evaluate_episodes(make, n_episodes, seed, **given))


def evaluate_episodes(
    make: str | AgentFactory,
    n_episodes: int = 64,
    seed: int = EVALUATION_SEED,
    *,
    engine: str | Engine | None = None,
    tick: Callable[[float], None] = lambda share: None,
    trust: bool = False,
    **kwargs: Any,
) -> list[dict[str, float]]:
    """Play the episodes of `evaluate` and return the statistics of each, in the order of seeds.

    To compare two agents on the same seeds, pair by pair:

        ours, theirs = (evaluate_episodes(agent, 64) for agent in ("a.zip", "b.zip"))
        compare_means([e["cost"] for e in ours], [e["cost"] for e in theirs])

    Args:
        make: the agent, as in `evaluate`.
        n_episodes: number of episodes.
        seed: seed of the first episode.
        engine: engine that plays the episodes, as in `evaluate`.
        tick: callback that receives the fraction of the work completed since its last call.
        trust: whether pickles in a checkpoint may be loaded.
        kwargs: arguments of the environment, as in `evaluate`.

    Returns:
        One dictionary per episode: the return `r`, the length `l` [control steps] and `seconds`
            [s]; `cost`, and the numbers of steps near a worker (`cost_steps`) and in contact
            (`contact_steps`) [control steps]; `approaches`, in which the robot comes near a worker
            at more than 0.05 m/s; `contacts`, and of these `contacts_towards`,
            `contacts_fleeing` and `contacts_standing`;
            `contacts_rated`, those with an estimated force, and of these `contacts_above_limit`;
            `interventions` of the shield, NaN without one; `goals_reached` and `goals_missed`;
            `success`; and `min_separation_m` [m].

    Raises:
        ConfigError: the agent or the engine does not exist, or `n_episodes` is below 1.
    """
    check_integer("n_episodes", n_episodes, 1, 10**9)
    if isinstance(engine, str):
        engine = engine_called(engine)
    if isinstance(make, str):
        registry = import_module("hrc_env.agents.registry")  # here: it reads learners' files
        registry.check_agent(make)
        make = partial(registry.make_agent, carried(make), trust=trust)
    if not callable(make):
        raise ConfigError(
            "evaluate takes a function that makes an agent for an EnvInfo, or an agent that "
            f"make_agent accepts, got {type(make).__name__}."
        )
    return play_shards(make, n_episodes, seed, engine, tick, **kwargs)


def play_shards(
    make: AgentFactory,
    n_episodes: int,
    seed: int = EVALUATION_SEED,
    engine: Engine | None = None,
    tick: Callable[[float], None] = lambda share: None,
    **kwargs: Any,
) -> list[dict[str, float]]:
    """Play episodes in shards by an engine and return their statistics, as `play_episodes` does.

    Shards are the same for every engine, because the rounding errors of an agent's network may
    depend on the number of observations in a batch.

    Args:
        make: function that makes the agent for an `EnvInfo`.
        n_episodes: number of episodes.
        seed: seed of the first episode.
        engine: engine that plays the shards; None: several processes at the level `pixels`,
            otherwise this process.
        tick: callback that receives the fraction of the work completed since its last call.
        kwargs: arguments of the environment, as in `play_episodes`.
    """
    is_drawn = kwargs.get("perception") == "pixels"
    together = DRAWN_TOGETHER if is_drawn else TOGETHER
    firsts = range(0, n_episodes, together)
    sizes = [min(together, n_episodes - first) for first in firsts]
    calls = [
        partial(_play_shard, make, n, seed + first, kwargs)
        for first, n in zip(firsts, sizes, strict=True)
    ]
    engine = engine or (Processes() if is_drawn and min(len(calls), n_cores()) > 1 else Serial())
    shards: list[list[dict[str, float]]] = [[] for _ in calls]
    for done in engine.run(calls, lambda k, share: tick(share * sizes[k] / n_episodes)):
        shards[done.k] = done.result
    return [episode for shard in shards for episode in shard]


def _play_shard(
    make: AgentFactory, n: int, seed: int, kwargs: dict[str, Any], tick: Tick
) -> list[dict[str, float]]:
    return play_episodes(make, n, seed, tick, **kwargs)


def play_episodes(
    make: AgentFactory,
    n_episodes: int,
    seed: int = EVALUATION_SEED,
    tick: Callable[[float], None] = lambda share: None,
    **kwargs: Any,
) -> list[dict[str, float]]:
    """Play whole episodes and return the statistics of each by name.

    Episode k, counted from 0, begins with `reset(seed=seed + k)`. Agents and perception levels can
    therefore be compared episode by episode.

    Args:
        make: function that makes the agent for an `EnvInfo`.
        n_episodes: number of episodes.
        seed: seed of the first episode.
        tick: callback that receives the fraction of the work completed since its last call.
        kwargs: arguments of `HRCVectorEnv`; with perception="pixels", which is not batched, those
            of `gymnasium.make`.
    """
    if kwargs.get("perception") == "pixels":
        return play_one_by_one(make, n_episodes, seed, tick, **kwargs)
    with closing(HRCVectorEnv(n_episodes, **kwargs)) as env:
        inner = env.shards.first
        agent, sums = _make_agent(make, env_info(inner)), EpisodeSums(n_episodes)
        episodes: list[dict[str, float]] = [{} for _ in range(n_episodes)]
        for step in rollout(env, agent, env.reset(seed=seed)[0]):
            sums.add(step.reward, step.info)
            for b in np.flatnonzero(step.ends).tolist():
                last, dt_s = info_of(step.info, b), inner.config.ctrl_dt
                episodes[b] = sums.summarize(b, last, inner.task, dt_s)
            tick(1 / env.max_episode_steps)
        return episodes


def play_one_by_one(
    make: AgentFactory,
    n_episodes: int,
    seed: int,
    tick: Callable[[float], None] = lambda share: None,
    **kwargs: Any,
) -> list[dict[str, float]]:
    """Play the episodes of `play_episodes` one after the other in a single environment."""
    with closing(gymnasium.make(kwargs.pop("task", DEFAULT), **kwargs)) as env:
        inner: HRCEnv = env.unwrapped  # type: ignore[assignment]  # as every id of ours
        agent, done = _make_agent(make, env_info(inner.simulation)), []
        for k in range(n_episodes):
            sums, last = EpisodeSums(1), {}
            for step in rollout(env, agent, env.reset(seed=seed + k)[0]):
                sums.add(np.array([step.reward]), to_batch(step))
                last = step.info
            done.append(sums.summarize(0, last, inner.simulation.task, inner.config.ctrl_dt))
            tick(1 / n_episodes)
        return done


def _make_agent(make: AgentFactory, info: EnvInfo) -> Agent:
    """Return the agent that a factory makes; raise `ConfigError` if its signature is wrong."""
    check_arguments("The function that makes an agent", make, "env_info")
    agent = make(info)
    if not callable(getattr(agent, "act", None)):
        raise ConfigError(f"An agent must have act(observation) -> actions, got {describe(agent)}.")
    check_arguments("act", agent.act, "observation")
    return agent


def to_batch(step: Transition) -> dict[str, Any]:
    """Return the infos of a step of a single environment as those of a batch of size one."""
    arrays = {name: np.array([value]) for name, value in step.info.items()}
    return arrays | {f"_{name}": np.ones(1, np.bool_) for name in arrays}


def summarize(episodes: list[dict[str, float]]) -> Score:
    """Return the score of finished episodes."""
    column = {name: np.array([row[name] for row in episodes]) for name in episodes[0]}
    reached, missed = column[ACHIEVED].sum(), column[FAILED].sum()
    minutes, hours = column["seconds"].sum() / 60, column["seconds"] / 3600
    return Score(
        episodes=len(episodes),
        success_rate=float(reached / max(reached + missed, 1)),
        is_success=float(column["success"].mean()),
        goals_per_minute=float(reached / minutes),
        contacts_per_episode=float(column["contacts"].mean()),
        contacts_per_hour=estimate_rate(
            np.sum([column[f"contacts_{kind}"] for kind in KINDS], axis=0), hours, "1/h"
        ),
        **{
            f"contacts_{kind}_per_hour": estimate_rate(column[f"contacts_{kind}"], hours, "1/h")
            for kind in KINDS
        },
        contacts_above_limit=estimate_share_of(column[ABOVE], column[RATED]),
        interventions_per_hour=estimate_burst_rate(column[INTERVENTIONS], hours, "1/h"),
        cost_per_episode=float(column["cost"].mean()),
        close_steps_per_episode=float(column["cost_steps"].mean()),
        median_min_separation_m=float(np.median(column["min_separation_m"])),
        return_mean=float(column["r"].mean()),
    )


def describe_contradiction(score: Score) -> str:
    """Return a warning if most attempts succeeded but no episode did, otherwise ""."""
    if score.is_success > 0 or score.success_rate < 0.5:
        return ""
    return (
        f"{score.success_rate:.0%} of the attempts were achieved (Task.achieved / (Task.achieved + "
        "Task.failed)), but no episode ended with is_success: the task defines achieved attempts "
        "and success differently."
    )


def measure(episodes: list[dict[str, float]]) -> dict[str, Metric]:
    """Return means over episodes with 95 % intervals.

    The interval is exact for contacts, and computed by bootstrap for the other statistics.
    """
    column = {name: [row[name] for row in episodes] for name in episodes[0]}
    minutes = [seconds / 60 for seconds in column["seconds"]]
    return {
        "return": estimate_mean(column["r"], "1"),
        "goals_per_minute": estimate_goal_rate(column["goals_reached"], minutes),
        "cost_per_episode": estimate_mean(column["cost"], COST_UNIT),
        "contacts_per_episode": estimate_rate(column["contacts"], len(episodes), "1"),
    }
