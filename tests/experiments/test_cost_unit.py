"""Costs are in control steps wherever they are measured."""

import numpy as np

from hrc_env.evaluation.episodes import measure
from hrc_env.evaluation.sums import ACHIEVED, FAILED, STATISTICS
from hrc_env.experiments import columns
from hrc_env.experiments.impact.metrics import AN_EPISODE
from hrc_env.experiments.price.episodes import CONTACTS
from hrc_env.experiments.price.metrics import _measure

EPISODES = [{**dict.fromkeys(STATISTICS, 1.0), "seconds": 10.0} for _ in range(4)]


def test_columns_have_the_unit_of_their_statistic():
    def unit(column: columns.Column) -> str:
        assert column.measure is not None
        return column.measure(EPISODES, EPISODES).unit

    assert unit(columns.mean("cost")) == "control steps"
    assert unit(columns.per_minute("cost")) == "control steps/min"
    assert unit(columns.mean("cost", unit="own")) == "own"
    assert unit(columns.mean("success")) == "1"
    assert unit(columns.per_minute("contacts")) == "1/min"


def test_evaluations_and_experiments_say_it_too():
    column = {ACHIEVED: 1.0, FAILED: 0.0, **EPISODES[0]}
    assert measure([column] * 3)["cost_per_episode"].unit == "control steps"
    assert set(AN_EPISODE.values()) == {"control steps per episode"}
    ones = dict.fromkeys(("achieved", "cost", "minutes", *columns.STATISTICS), np.ones(3))
    kinds = dict.fromkeys(CONTACTS, np.ones(3))
    assert _measure({**ones, **kinds})["cost"].unit == "control steps per episode of 10 s"
