"""The bench as a whole: every key, the shared form, and going on where it was stopped."""

import json
from contextlib import contextmanager

import numpy as np
import pytest

from benchmarks.tracking import bench as tracking_bench
from benchmarks.tracking import sequences
from benchmarks.tracking.bench import TrackingBench
from benchmarks.tracking.cells import tally
from benchmarks.tracking.names import DLT, rows
from benchmarks.tracking.rigs import RIGS, make_rig
from benchmarks.tracking.sequences import make_sequences
from benchmarks.tracking.timing import time_estimator
from docs import tables
from hrc_env.core.errors import ConfigError
from hrc_env.engines.local import Serial
from hrc_env.evaluation.intervals import MIN_SEEDS
from hrc_env.experiments import runner
from hrc_env.tracking.estimators import ESTIMATORS

pytestmark = pytest.mark.slow  # a study is played

TINY = TrackingBench(n_seeds=2, n_matched=2, n_smoothed=1, timing_repeats=1)


def no_time(name, rig, clean, hard, n_repeats, tick):
    """Instead of the clock."""
    tick(1.0)
    return {"1": [2.0], "64": [1.0], "hard_64": [1.5]}


@contextmanager
def small():
    """Few frames and no clock."""
    short = {name: min(n, 20) for name, n in sequences.N_FRAMES.items()}
    windows = {name: dict.fromkeys(inner, (10, 20)) for name, inner in sequences.WINDOWS.items()}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sequences, "N_FRAMES", short)
        patch.setattr(sequences, "WINDOWS", windows)
        patch.setattr(tracking_bench, "time_estimator", no_time)
        yield patch


@pytest.fixture(scope="module")
def end_to_end(tmp_path_factory):
    """The folder of a bench on a few frames of two sequences, and what it said."""
    out, said = tmp_path_factory.mktemp("bench"), []
    with small():
        runner.run_experiment(
            TINY, out, lambda share, label: said.append((share, label)), engine=Serial()
        )
    return out, said


def test_every_key_is_written_in_the_shared_form(end_to_end):
    out, _ = end_to_end
    results = json.loads((out / "results.json").read_text())
    assert set(results) >= {"config", "git", "versions", "machine", "seeds", "metrics"}
    metrics = results["metrics"]
    for name in ("tracking", "tracking_cost"):
        assert tables.asked(name) <= metrics.keys()
    for name in ESTIMATORS:
        assert f"ratio_to_bound.{name}" in metrics
        for batch in ("1", "64", "hard_64"):
            assert f"update_us.{name}.{batch}" in metrics
        for rig in RIGS:
            assert f"identity_swaps.{rig}.two_workers.{name}" in metrics
        for rig, _, window in rows():
            for kind in ("rmse_m", "coverage95", "std_over_rmse", "facing_wrong"):
                assert f"{kind}.{rig}.{window}.{name}" in metrics
    assert f"rmse_m.lab.clean.{DLT}" in metrics
    assert f"default_over.env.four_cameras.{DLT}" in metrics
    for metric in metrics.values():
        assert set(metric) == {"value", "low", "high", "unit", "n"}
        assert np.isfinite(metric["value"])
        assert np.isfinite([metric["low"], metric["high"]]).all() or metric["n"] < MIN_SEEDS


def test_the_report_has_everybody(end_to_end):
    out, _ = end_to_end
    text = (out / "report.md").read_text()
    for name in (*ESTIMATORS, DLT):
        assert name in text


def test_progress_ends_at_the_whole(end_to_end):
    _, said = end_to_end
    assert sum(share for share, _ in said) == pytest.approx(1.0)


def test_a_second_run_makes_only_what_is_missing(end_to_end):
    out, _ = end_to_end
    missing = out / "parts" / "lab.clean.paper.json"
    before = json.loads(missing.read_text())
    missing.unlink()
    made = []
    real = tracking_bench.run_cell
    with small() as patch:
        patch.setattr(tracking_bench, "run_cell", lambda *a: made.append(a[0]) or real(*a))
        runner.run_experiment(TINY, out, lambda share, label: None, engine=Serial())
    assert made == ["paper"]
    again = json.loads(missing.read_text())
    assert {**again, "seconds": before["seconds"]} == before
    assert not list(out.rglob("*.draft"))


def test_time_per_update_is_positive():
    """The clock itself, on a few frames; nothing is said about how fast this machine is."""
    rig = make_rig("lab")
    sequences = make_sequences(rig, "one_camera", list(range(64)))
    shares = []
    times = time_estimator("triangulation", rig, sequences, sequences, 2, shares.append)
    assert set(times) == {"1", "64", "hard_64"}
    assert min(min(values) for values in times.values()) > 0
    assert sum(shares) == pytest.approx(1.0)


def test_sizes_that_cannot_work_are_answered():
    with pytest.raises(ConfigError, match="seeds"):
        TrackingBench(n_seeds=0)


def test_a_right_covariance_is_found_calibrated():
    """Errors drawn from the reported Gaussian: 95 % inside, as large as told."""
    rng = np.random.default_rng(0)
    factor = rng.normal(size=(3, 3))
    truth = rng.normal(size=(50, 20, 1, 15, 3))
    mean = truth + rng.standard_normal(truth.shape) @ factor.T
    cov = np.broadcast_to(factor @ factor.T, (*truth.shape, 3))
    sums = tally(truth, mean, cov)
    n = np.sum(sums["n"])
    assert np.sum(sums["inside"]) / n == pytest.approx(0.95, abs=0.01)
    assert np.sqrt(np.sum(sums["trace"]) / np.sum(sums["squared"])) == pytest.approx(1.0, abs=0.03)
