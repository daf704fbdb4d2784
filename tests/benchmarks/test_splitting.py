"""Multilevel splitting, on a random walk whose number of events is known exactly."""

import numpy as np
import pytest

from benchmarks.rare import splitting
from benchmarks.rare.splitting import Replication, Start, choose_starts, estimate, replicate
from hrc_env.core.errors import ConfigError

N_STEPS, UP, TOP = 40, 0.3, 9
LEVELS = (2.0, 4.0, 6.0, 8.0)


class Walk:
    """Walks on 0, 1, 2, ...; an event is an arrival at `TOP`, also a second one."""

    def __init__(self, n_rows: int) -> None:
        self.n_rows = n_rows
        self.at, self.t, self.events = (np.zeros(n_rows, int) for _ in range(3))
        self.rngs = [np.random.default_rng(0)] * n_rows

    def begin(self, rows, seeds):
        self.at[rows], self.t[rows], self.events[rows] = 0, 0, 0
        self._seed(rows, seeds)

    def branch(self, rows, kept, seeds):
        for row, each in zip(rows, kept, strict=True):
            self.at[row], self.t[row], self.events[row] = each
        self._seed(rows, seeds)

    def step(self):
        ups = np.array([rng.random() < UP for rng in self.rngs])
        self.at = np.maximum(self.at + np.where(ups, 1, -1), 0)
        self.t += 1
        happens = ups & (self.at == TOP)
        self.events = self.events + happens
        score = np.where(happens, np.inf, self.at)
        return splitting.Moment(score, self.t >= N_STEPS, self.events.copy())

    def keep(self, row):
        return int(self.at[row]), int(self.t[row]), int(self.events[row])

    def _seed(self, rows, seeds):
        for row, seed in zip(rows, seeds, strict=True):
            self.rngs[row] = np.random.default_rng([7, seed])


def exact() -> float:
    """Mean number of arrivals at `TOP` from below in an episode."""
    share, total = np.zeros(TOP + N_STEPS + 2), 0.0
    share[0] = 1.0
    for _ in range(N_STEPS):
        total += share[TOP - 1] * UP
        down = (1 - UP) * np.append(share[1:], 0.0)
        down[0] += (1 - UP) * share[0]
        share = UP * np.append(0.0, share[:-1]) + down
    return total


def estimates(n_replications: int, n: int = 100, n_rows: int = 64, levels=LEVELS, first=0) -> list:
    step = splitting.count_seeds(levels, n)
    return [replicate(Walk(n_rows), levels, n, first + k * step) for k in range(n_replications)]


def test_it_finds_the_exact_number_of_rare_events():
    """8e-4 events per episode from 120 x 100 starts: an unbiased mean, and a narrow interval."""
    found = estimates(120)
    metric = estimate(found, 1.0, "1")
    assert 5e-4 < exact() < 5e-3
    assert metric.low < exact() < metric.high
    assert metric.high / metric.low < 1.6


def test_intervals_from_8_replications_contain_it_about_as_often_as_they_say():
    found = estimates(8 * 30, 60)
    metrics = [estimate(found[k : k + 8], 1.0, "1") for k in range(0, len(found), 8)]
    assert sum(each.low <= exact() <= each.high for each in metrics) >= 26


def test_levels_that_are_jumped_over_count_as_reached():
    """Steps of the walk are 1, so that these levels lie between its values."""
    levels = (1.5, 1.7, 1.9, 3.5, 5.5, 7.5, 8.5)
    metric = estimate(estimates(120, levels=levels), 1.0, "1")
    assert metric.low < exact() < metric.high


def test_the_number_of_rows_has_no_effect():
    assert estimates(2, n_rows=3) == estimates(2, n_rows=64) == estimates(2, n_rows=500)


def test_other_seeds_give_other_estimates():
    assert estimates(1) != estimates(1, first=10**6)


def test_an_event_in_the_last_step_counts():
    walk = Walk(4)
    start = Start((TOP - 1, N_STEPS - 1, 2), float(TOP - 1), False, 2)
    ended = start._replace(is_over=True)
    stage = splitting.run_stage(walk, [start] * 200 + [ended] * 50, np.arange(250), None)
    assert set(stage.events[:200].tolist()) == {2, 3}
    assert set(stage.events[200:].tolist()) == {2}
    assert stage.events[:200].sum() == pytest.approx(400 + 200 * UP, abs=25)


def test_a_start_beyond_the_next_level_has_reached_it():
    """Its event may be the only one of its episode."""
    start = Start((TOP, N_STEPS - 3, 1), np.inf, False, 1)
    stage = splitting.run_stage(Walk(4), [start] * 20, np.arange(20), 8.5)
    assert stage.starts == [start] * 20
    assert stage.n_steps == 0


def test_every_start_is_used_alike():
    found = [Start(k, 0.0, False, 0) for k in range(7)]
    used = [start.kept for start in choose_starts(found, 24, np.random.default_rng(0))]
    assert sorted(np.bincount(used).tolist()) == [3, 3, 3, 3, 4, 4, 4]
    some = [start.kept for start in choose_starts(found, 13, np.random.default_rng(1))]
    assert sorted(np.bincount(some).tolist()) == [1] + [2] * 6
    few = [start.kept for start in choose_starts(found, 3, np.random.default_rng(0))]
    assert len(set(few)) == 3


def test_nothing_seen_has_an_upper_end():
    """It shrinks with the number of futures, and grows with the share that came close."""
    none = [Replication(100, (50, 20, 0), 0)] * 8
    metric = estimate(none, 360.0, "1/h")
    assert (metric.value, metric.low) == (0.0, 0.0)
    assert metric.high == pytest.approx(360 * 0.5 * 0.2 * 3.6889 / 800, rel=1e-3)
    assert estimate([Replication(100, (0, 0, 0), 0)] * 8, 1.0, "1").high > 0


def test_one_replication_has_no_interval():
    with pytest.raises(ConfigError, match="at least 2 replications, got 1"):
        estimate([Replication(10, (5,), 1)], 1.0, "1")


@pytest.mark.parametrize("levels", [(), (2.0, 2.0), (3.0, 1.0), (1.0, np.nan)])
def test_levels_must_increase(levels):
    with pytest.raises(ConfigError, match="increasing"):
        replicate(Walk(4), levels, 10, 0)
