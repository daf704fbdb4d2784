"""The benchmark of rare contacts: its process, its level function, and its rows."""

import json
from contextlib import closing

import numpy as np
import pytest

from benchmarks.rare import bench, contacts
from benchmarks.rare.bench import QUICK, RareBench
from benchmarks.rare.contacts import ShieldedRobot, measure_score
from benchmarks.rare.splitting import replicate, run_stage
from hrc_env.core.errors import ConfigError
from hrc_env.evaluation.episodes import play_episodes
from hrc_env.experiments.runner import run_experiment

CARELESS = {"perception": "truth", "config": {"worker": "any"}}
"""A robot without a shield, which touches workers often."""
FIRST = 11_050_000


def test_the_level_function_is_minus_the_time_to_contact():
    gap, robot = np.array([0.2, 0.2, 0.2, 0.2, -0.01]), np.array([0.3, 0.3, 0.04, -0.5, 0.5])
    worker, begins = np.array([0.1, -0.4, 1.0, 1.0, 0.0]), np.zeros(5, bool)
    score = measure_score(gap, robot, worker, begins)
    np.testing.assert_allclose(score, [-0.5, -2 / 3, -np.inf, -np.inf, 0.0])
    assert measure_score(gap, robot, worker, ~begins).tolist() == [np.inf] * 5


@pytest.mark.filterwarnings("ignore:num_threads")
def test_a_replication_depends_neither_on_rows_nor_on_threads():
    found = []
    for n_rows, threads in ((4, 1), (9, 2), (16, 3)):
        with closing(ShieldedRobot(n_rows, CARELESS, threads)) as robot:
            found.append(replicate(robot, (-0.6, -0.3), 12, FIRST))
    assert found[0].reached[0] > 0
    assert found[0] == found[1] == found[2]


def test_whole_episodes_of_the_process_are_those_of_an_evaluation():
    """Contacts of each episode, without a level."""
    n = 40
    with closing(ShieldedRobot(13, CARELESS)) as robot:
        stage = run_stage(robot, None, np.arange(FIRST, FIRST + n), None)
        assert robot.episode_h == pytest.approx(10 / 3600)
    make = bench.partial(bench.make_agent, contacts.AGENT)
    episodes = play_episodes(make, n, FIRST, **CARELESS)
    assert stage.events.tolist() == [each["contacts_towards"] for each in episodes]
    assert stage.events.sum() > 3


def test_a_contact_is_always_beyond_the_last_level():
    """So that no contact is left out: without a level above it, contacts cross it, too."""
    n = 40
    with closing(ShieldedRobot(40, CARELESS)) as robot:
        seeds = np.arange(FIRST, FIRST + n)
        whole = run_stage(robot, None, seeds, None)
        crossed = run_stage(robot, None, seeds, 1e9)
        assert len(crossed.starts) == np.count_nonzero(whole.events) > 3
        assert {start.events for start in crossed.starts} == {1}
        kept = [start.kept for start in crossed.starts]
        robot.branch(np.arange(len(kept)), kept, np.arange(FIRST, FIRST + len(kept)))
        moment = robot.step()
    assert not (np.isposinf(moment.score) & (moment.events == 1))[: len(kept)].any()


@pytest.mark.slow
def test_the_benchmark_writes_its_rows_and_goes_on_after_a_stop(tmp_path):
    short = RareBench(2, 6, 5, n_rows=6)
    metrics = run_experiment(short, tmp_path)
    names = {"counted_qp", "split_qp", "split_far"}
    assert {name.partition(".")[0] for name in metrics} == names
    for name in names:
        rate = metrics[f"{name}.contacts"]
        assert rate.low <= rate.value <= rate.high
        assert rate.high > 0
    shares = [metrics[f"split_qp.reached_{k}"].value for k in range(4)]
    assert shares == sorted(shares, reverse=True)
    path = tmp_path / "parts" / "split_qp.1.json"
    before = json.loads(path.read_text())["part"]
    (tmp_path / "parts" / "split_qp.0.json").unlink()
    stamps = {each: each.read_bytes() for each in (tmp_path / "parts").iterdir()}
    assert run_experiment(short, tmp_path) == metrics
    assert all(each.read_bytes() == content for each, content in stamps.items())
    assert before["n"] == 6


def test_seeds_never_overlap():
    parts = RareBench()._list_parts()
    ranges = []
    for part in parts:
        given = part.make.args
        first, n = (given[1], given[2]) if "counted" in part.label else (given[2], given[1] * 5)
        ranges.append(range(first, first + n))
    used = [seed for each in ranges for seed in each]
    assert len(set(used)) == len(used)
    assert set(used) <= set(RareBench().seeds)
    assert QUICK.n_parts < RareBench().n_parts


def test_too_many_seeds_or_too_few_replications_are_refused():
    with pytest.raises(ConfigError, match="at least 2 replications"):
        RareBench(n_replications=1)
    with pytest.raises(ConfigError, match="66666 seeds for each shield, but 1000 replications"):
        RareBench(n_replications=1000)
