"""Benches and experiments take every id."""

from contextlib import closing

import pytest

from benchmarks.speed.bench import SpeedBench
from benchmarks.speed.contenders import Starts
from hrc_env.core.errors import ConfigError
from hrc_env.experiments.impact.episodes import play
from hrc_env.experiments.impact.experiment import Impact, make_experiment
from hrc_env.experiments.impact.policies import Policy, get_maker
from hrc_env.experiments.setups import REFERENCE, find_setup
from hrc_env.experiments.stage import Stage
from hrc_env.tasks.task import find_task

pytestmark = pytest.mark.slow  # studies are played

IDS = ("HRCPickPlace-v0", "HRCReachGoal-v0")


@pytest.mark.parametrize("task", IDS)
def test_impact_plays_it(task, tmp_path):
    setup, make = find_setup(REFERENCE), get_maker(Policy("scripted_slowed"), tmp_path / "none")
    with closing(Stage(setup, setup.turns, {"task": task})) as stage:
        rows = play(stage, [5, 6], 8, make, 0.0, lambda share: None)
    assert [len(values) for values in rows.values()] == [2] * len(rows)
    assert rows["goals"] == [0.0, 0.0]


def test_an_episode_of_impact_is_as_long_as_the_tasks():
    for task in ("HRCReach-v0", *IDS):
        config = make_experiment(task=task)
        assert (config.task, config.n_steps) == (task, find_task(task).max_episode_steps)
    assert make_experiment(quick=True, task=IDS[0]).n_steps == 100


@pytest.mark.parametrize("task", IDS)
def test_speed_times_its_resets(task):
    starts = Starts(task)
    assert set(starts.run(1)) == {"1_of_1", "8_of_64"}
    assert starts.single.spec.id == starts.vector.spec.id == task
    starts.close()


@pytest.mark.parametrize("config", [SpeedBench, Impact])
def test_a_task_that_there_is_not_is_refused_in_words(config):
    with pytest.raises(ConfigError, match="Did you mean 'HRCReach-v0'"):
        config(task="HRCReach-v1")
