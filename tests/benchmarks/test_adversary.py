"""The search for reaches that lead to contacts, and the benchmark of what it finds."""

import json
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.adversary import bench
from benchmarks.adversary.bench import QUICK, AdversaryBench, find_worst, search_once
from benchmarks.adversary.cross_entropy import CrossEntropy
from benchmarks.adversary.episodes import NEVER_S, make_env, make_people, score_scripts
from hrc_env.core.errors import ConfigError
from hrc_env.engines.local import Serial
from hrc_env.experiments.runner import run_experiment
from hrc_env.motion.config import MotionConfig
from hrc_env.motion.reaches import make_script
from hrc_env.motion.scripted import read_found_reaches

FIRST = 18_350_000 + 49_000
"""Seeds of the search that its runs do not use."""


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_the_search_finds_the_best_parameters(noise):
    """The maximum of a function with a flat side, in the presence of noise, near a bound."""
    rng, best = np.random.default_rng(0), np.array([[0.2, 0.9], [1.0, 0.5]])
    search = CrossEntropy(200)
    normal = search.begin(best.shape)
    for _ in range(25):
        samples = normal.draw(200, rng)
        off = np.square(samples - best).sum((1, 2))
        scores = -np.minimum(off, 0.5) + noise * rng.normal(size=200)
        normal = search.update(normal, samples, scores)
    np.testing.assert_allclose(normal.mean, best, atol=0.06)
    assert (normal.deviation < 0.12).all()
    assert (normal.deviation >= search.min_deviation).all()


def test_samples_stay_in_their_range_and_follow_the_seed():
    normal = CrossEntropy().begin((6, 6))
    a, b = (normal.draw(100, np.random.default_rng(3)) for _ in range(2))
    np.testing.assert_array_equal(a, b)
    assert a.min() == 0.0
    assert a.max() == 1.0


@pytest.mark.parametrize("make", [
    lambda: CrossEntropy(8), lambda: CrossEntropy(smoothing=0.0),
    lambda: AdversaryBench(0), lambda: AdversaryBench(10, 8), lambda: AdversaryBench(1000, 1000),
    lambda: AdversaryBench(n_judged=200_000), lambda: AdversaryBench(shields=("ssm",)),
])  # fmt: skip
def test_settings_without_a_result_are_refused(make):
    with pytest.raises(ConfigError):
        make()


def test_a_score_that_is_no_number_is_refused():
    search = CrossEntropy(16)
    with pytest.raises(ConfigError, match="finite"):
        search.update(search.begin((1,)), np.zeros((16, 1)), np.full(16, np.nan))


def test_contacts_score_above_every_approach_and_fewer_rows_change_nothing(monkeypatch):
    samples = CrossEntropy().begin((6, 6)).draw(24, np.random.default_rng(1))
    scripts = [make_script(each, MotionConfig().reach_limits) for each in samples]
    scores = score_scripts(scripts, FIRST, {**make_env(None), "perception": "truth"})
    touched = scores > 0
    assert 0 < touched.sum() < 24
    assert (scores[touched] >= 1).all()
    assert (scores[~touched] >= -NEVER_S).all()
    monkeypatch.setattr("benchmarks.adversary.episodes.TOGETHER", 7)
    again = score_scripts(scripts, FIRST, {**make_env(None), "perception": "truth"})
    np.testing.assert_array_equal(scores, again)


def test_the_worst_episode_is_the_one_that_is_filmed():
    """Its seed and script give the same contacts in an environment of its own."""
    tick = lambda share: None  # noqa: E731
    search = CrossEntropy(16)
    found = search_once("none", search, search.begin((6, 6)), FIRST + 100, tick)
    worst = find_worst([found, {"worst": {"score": -1.0}}])
    script = tuple(bench.Reach(**each) for each in worst["reaches"])
    env = {**make_env(None), "people": make_people(script)}
    (again,) = bench.judge(env, worst["seed"], 1, tick)["episodes"]
    assert again["contacts_towards"] == worst["score"] >= 1


@pytest.mark.slow
def test_the_benchmark_writes_what_it_found_and_goes_on_after_a_stop(tmp_path, monkeypatch):
    short = replace(QUICK, n_judged=3)
    whole = run_experiment(short, tmp_path / "whole")
    searched, stop = bench.search_once, {"at": 3}

    def fail(*args):
        stop["at"] -= 1
        if stop["at"] == 0:
            raise KeyboardInterrupt
        return searched(*args)

    monkeypatch.setattr(bench, "search_once", fail)
    engine = Serial()
    with pytest.raises(KeyboardInterrupt):
        run_experiment(short, tmp_path / "stopped", engine=engine)
    parts = sorted(path.name for path in (tmp_path / "stopped" / "parts").iterdir())
    assert parts == ["search_none.0.json", "search_qp.0.json"]
    stop["at"] = 10
    resumed = run_experiment(short, tmp_path / "stopped", engine=engine)
    assert stop["at"] == 8  # the second iteration of each search
    assert {k: m.value for k, m in resumed.items()} == pytest.approx(
        {k: m.value for k, m in whole.items()}, nan_ok=True
    )
    found = [read_found_reaches(tmp_path / name / bench.FILE) for name in ("whole", "stopped")]
    assert found[0] == found[1]
    content = json.loads((tmp_path / "whole" / bench.FILE).read_text())
    assert set(content["worst"]) == {"qp", "none"}
    assert content["versions"]["shield"] >= 1
    assert "adversary" in content["made"]["command"]
    report = (tmp_path / "whole" / "report.md").read_text()
    assert "| `qp`" in report
    for row in ("qp.unaware", "qp.adversary", "none.unaware", "none.adversary"):
        rate = whole[f"{row}.towards_per_hour"]
        assert rate.low <= rate.value < rate.high


def test_a_film_needs_found_reaches(tmp_path):
    with pytest.raises(ConfigError, match="must be the found reaches"):
        bench.film_worst(tmp_path, print)
