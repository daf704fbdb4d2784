"""Multilevel splitting with fixed effort, an estimator of the number of rare events in an episode.

A level function measures how close an episode is to an event. Episodes are simulated until they
reach the first level; the states in which they do so are the starts of new, independent futures,
which are simulated until they reach the second level, and so on. The same number of futures starts
at every level. The product of the shares that reach the levels, times the mean number of events of
the last futures, is an unbiased estimate for any levels and any level function; a good one only
makes its variance small (Garvels 2000, The splitting method in rare event simulation, University of
Twente; Au and Beck 2001, doi:10.1016/S0266-8920(01)00019-4; Cerou and Guyader 2007,
doi:10.1080/07362990601139628, for levels that are adapted). The interval comes from independent
replications.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from scipy import stats

from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric
from hrc_env.core.typing import Bools, Floats, Ints

REFILLED = 0.25
"""Share of idle rows from which on they are filled again; each filling has fixed costs."""


class Moment(NamedTuple):
    """The state of the rows of a process after a step."""

    score: Floats
    """(B,) level function; infinite in a step with an event."""
    is_over: Bools
    """(B,) whether the episode has ended."""
    events: Ints
    """(B,) number of events in the episode until now."""


class Start(NamedTuple):
    """The state in which an episode reached a level."""

    kept: Any
    """The state, from which a `Process` can go on."""
    score: float
    """Level function in this state."""
    is_over: bool
    """Whether the episode ends in this state."""
    events: int
    """Number of events in the episode until now."""


class Process(Protocol):
    """A batch of random processes, with rows that can be copied in the middle of episodes.

    An episode depends only on its start and its seed.
    """

    n_rows: int
    """Number of rows B."""

    def begin(self, rows: Ints, seeds: Ints) -> None:
        """Begin episodes in some rows."""
        ...

    def branch(self, rows: Ints, kept: Sequence[Any], seeds: Ints) -> None:
        """Let some rows go on from states that `keep` has returned, with new random numbers."""
        ...

    def step(self) -> Moment:
        """Advance all rows by one step."""
        ...

    def keep(self, row: int) -> Any:
        """Return a copy of the state of a row."""
        ...


@dataclass(frozen=True, slots=True)
class Stage:
    """Futures that started at one level."""

    starts: list[Start]
    """States in which futures reached the next level, in the order of their seeds."""
    events: Ints
    """(n,) number of events in the whole episode of each future that did not reach it."""
    n_steps: int
    """Number of steps of all futures."""


@dataclass(frozen=True, slots=True)
class Replication:
    """One estimate by splitting."""

    n: int
    """Number of futures per level."""
    reached: tuple[int, ...]
    """Number of futures that reached each level, from the first one on."""
    n_events: int
    """Number of events in the episodes of the last futures; 0 if no future reached the last
    level."""
    n_steps: int = 0
    """Number of simulated steps."""

    @property
    def events_per_episode(self) -> float:
        """Estimated mean number of events in an episode."""
        return float(np.prod(self.reached) / self.n ** len(self.reached) * self.n_events / self.n)


class _Work:
    """The futures of a stage, which share the rows of a process."""

    def __init__(self, process: Process, starts: Sequence[Start] | None, seeds: Ints) -> None:
        self.process, self.starts, self.seeds = process, starts, seeds
        self.waiting = list(range(len(seeds)))
        self.future = np.full(process.n_rows, -1)
        """(B,) index of the future in each row; -1 for an idle row."""

    def fill_rows(self) -> None:
        """Begin waiting futures in idle rows, if enough rows are idle."""
        idle = np.flatnonzero(self.future < 0)
        if not self.waiting or len(idle) < min(REFILLED * self.process.n_rows, len(self.waiting)):
            return
        now, self.waiting = self.waiting[: len(idle)], self.waiting[len(idle) :]
        rows = idle[: len(now)]
        self.future[rows] = now
        if self.starts is None:
            self.process.begin(rows, self.seeds[now])
        else:
            self.process.branch(rows, [self.starts[k].kept for k in now], self.seeds[now])


def run_stage(
    process: Process,
    starts: Sequence[Start] | None,
    seeds: Ints,
    level: float | None,
    tick: Callable[[float], None] = lambda share: None,
) -> Stage:
    """Simulate futures until they reach a level, or to the end of their episodes.

    Args:
        process: the process; its number of rows has no effect on the result.
        starts: (n,) states at which the futures start; None for the beginning of episodes.
        seeds: (n,) seeds of the futures.
        level: the level; None for no level, so that all episodes are simulated to their end.
        tick: callback that receives the share of futures that have ended since its last call.
    """
    n, most = len(seeds), np.inf if level is None else level
    reached, events, n_steps = dict[int, Start](), np.zeros(n, int), 0
    work = _Work(process, starts, seeds)
    for k, start in enumerate(starts or ()):
        events[k] = start.events
        if level is not None and start.score >= most:
            reached[k] = start
        if k in reached or start.is_over:
            work.waiting.remove(k)
    while work.waiting or (work.future >= 0).any():
        work.fill_rows()
        moment, is_active = process.step(), work.future >= 0
        n_steps += int(is_active.sum())
        crosses = is_active & (moment.score >= most) & (level is not None)
        for row in np.flatnonzero(crosses).tolist():
            values = (each[row].item() for each in moment)
            reached[int(work.future[row])] = Start(process.keep(row), *values)
        ends = is_active & (crosses | moment.is_over)
        events[work.future[ends]] = moment.events[ends]
        work.future[ends] = -1
        tick(float(ends.sum()) / n)
    return Stage([reached[k] for k in sorted(reached)], events, n_steps)


def replicate(
    process: Process,
    levels: Sequence[float],
    n: int,
    first_seed: int,
    tick: Callable[[float], None] = lambda share: None,
) -> Replication:
    """Estimate the number of events in an episode once.

    Args:
        process: the process.
        levels: increasing levels.
        n: number of futures per level.
        first_seed: first of the `count_seeds` seeds of the futures.
        tick: callback that receives the increase of the completed fraction.

    Raises:
        ConfigError: there are no levels, or they do not increase.
    """
    if not len(levels) or not np.isfinite(levels).all() or not (np.diff(levels) > 0).all():
        raise ConfigError(f"levels must be one or more increasing numbers, got {list(levels)}.")
    starts: list[Start] | None = None
    reached, n_steps, n_events = list[int](), 0, 0
    for k, level in enumerate((*levels, None)):
        if starts is not None and not starts:
            reached.append(0)
            continue
        seeds = np.arange(first_seed + k * n, first_seed + (k + 1) * n)
        stage = run_stage(process, starts, seeds, level, lambda of: tick(of / (len(levels) + 1)))
        n_steps += stage.n_steps
        reached.append(len(stage.starts))
        n_events = int(stage.events.sum())
        starts = choose_starts(stage.starts, n, np.random.default_rng(seeds[-1]))
    is_through = 0 not in reached[: len(levels)]
    return Replication(n, tuple(reached[: len(levels)]), n_events if is_through else 0, n_steps)


def count_seeds(levels: Sequence[float], n: int) -> int:
    """Return the number of seeds of a replication."""
    return (len(levels) + 1) * n


def choose_starts(found: Sequence[Start], n: int, rng: np.random.Generator) -> list[Start]:
    """Return `n` starts, each of those found as often as any other, give or take one."""
    if not found:
        return []
    whole, rest = divmod(n, len(found))
    extra = rng.choice(len(found), rest, replace=False)
    return [found[k] for k in np.sort(np.concatenate([np.repeat(np.arange(len(found)), whole),
                                                      extra])).tolist()]  # fmt: skip


def estimate(replications: Sequence[Replication], per_episode: float, unit: str) -> Metric:
    """Return the rate of events with its 95 % interval from independent replications.

    The interval is that of Student's t for the logarithm of the mean, because estimates are skewed
    and positive. If no replication saw an event, the upper end is the exact one for the level that
    no future passed (Garwood 1936, doi:10.2307/2333958), times the share that reached it.

    Args:
        replications: R replications with the same levels and the same number of futures.
        per_episode: factor that converts events per episode to the rate.
        unit: unit of the rate.

    Raises:
        ConfigError: there are fewer than two replications.
    """
    n = len(replications)
    if n < 2:
        raise ConfigError(f"An interval needs at least 2 replications, got {n}.")
    values = per_episode * np.array([each.events_per_episode for each in replications])
    mean = float(values.mean())
    if mean > 0:
        error = float(values.std(ddof=1)) / (mean * np.sqrt(n))
        half = float(stats.t.ppf(0.975, n - 1)) * error
        low, high = (float(mean * np.exp(sign * half)) for sign in (-1, 1))
        return Metric(mean, low, high, unit, n)
    passed = np.array([(*each.reached, each.n_events) for each in replications]).sum(0)
    total = sum(each.n for each in replications)
    stuck = int(np.flatnonzero(passed == 0)[0])
    share = float(np.prod(passed[:stuck] / total)) if stuck else 1.0
    most = float(stats.gamma.ppf(0.975, 1.0)) / total
    return Metric(0.0, 0.0, per_episode * share * most, unit, n)
