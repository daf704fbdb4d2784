"""The paper's simulation, in its smallest form."""

import json

import numpy as np
import pytest

from docs import tables
from hrc_env.core.errors import ConfigError
from hrc_env.experiments.report import Report
from hrc_env.experiments.runner import run_experiment
from hrc_env.experiments.site import experiment
from hrc_env.experiments.site.experiment import Site, make_experiment

TINY = Site(n_seeds=1, seconds=2.0, estimators=("particle",))
CAMERAS = (*(f"camera_{k}" for k in range(1, 5)), "multi")


@pytest.fixture(scope="module")
def end_to_end(weights, tmp_path_factory):
    out = tmp_path_factory.mktemp("site")
    shares: list[float] = []
    metrics = run_experiment(TINY, out, lambda share, label: shares.append(share))
    return out, metrics, shares


def test_every_number_is_there(end_to_end):
    out, metrics, _ = end_to_end
    written = json.loads((out / "results.json").read_text())["metrics"]
    for name in ("particle", "kalman"):
        for camera in CAMERAS:
            assert metrics[f"rmse_m.{name}.{camera}"].value > 0
    for camera in CAMERAS:
        assert metrics[f"rmse_m.alone.particle.{camera}"].value > 0
        assert metrics[f"closed_rmse_m.particle.{camera}"].value > 0
    assert written.keys() == metrics.keys()
    for name in ("kalman", "paper_restarts"):
        assert f"difference.rmse_m.{name}.multi" in metrics
        assert np.isnan(metrics[f"p.rmse_m.{name}.camera_1"].value), "one seed shows no difference"
    asked = tables.asked("site")
    assert {name for name in asked if name.split(".")[-2] in TINY.estimators} <= metrics.keys()


def test_four_cameras_know_the_head_and_one_does_not(end_to_end):
    _, metrics, _ = end_to_end
    four = metrics["rmse_m.particle.multi"].value
    assert four < 0.1
    assert metrics["rmse_m.kalman.camera_1"].value > 2 * four


def test_a_camera_that_was_alone_from_the_first_frame_follows_too(end_to_end):
    _, metrics, _ = end_to_end
    alone = [metrics[f"tracked.alone.particle.camera_{k}"].value for k in range(1, 5)]
    assert max(alone) > 0.8
    four = metrics["rmse_m.particle.multi"].value
    assert metrics["rmse_m.alone.particle.multi"].value == four


def test_report_and_figures_are_written_and_the_progress_is_complete(end_to_end):
    out, _, shares = end_to_end
    assert sum(shares) == pytest.approx(1.0)
    names = {path.name for path in (out / "figures").iterdir()}
    assert names == {"figure_3.png", "figure_4_particle.png"}
    page = (out / "report.html").read_text()
    assert page.count("data:image/png") == 2
    assert "6.771" in page


def test_what_is_finished_is_used_again(end_to_end, monkeypatch):
    out, _, _ = end_to_end

    def never(*args):
        raise AssertionError("made again")

    monkeypatch.setattr(experiment, "film_walk", never)
    monkeypatch.setattr(experiment, "film_own_crops", never)
    monkeypatch.setattr(experiment, "make_report", lambda *args: Report("", "", ()))
    before = (out / "results.json").read_text()
    run_experiment(TINY, out, lambda share, label: None)
    assert (out / "results.json").read_text() == before


def test_what_cannot_work_is_explained(tmp_path):
    with pytest.raises(ConfigError, match="Did you mean 'particle'"):
        make_experiment(True, None, ("partical",))
    with pytest.raises(ConfigError, match="--seeds must be at least 1"):
        make_experiment(True, 0, ("particle",))
    (tmp_path / "experiment.json").write_text('{"experiment": "lab"}')
    with pytest.raises(ConfigError, match="--overwrite"):
        run_experiment(TINY, tmp_path, lambda share, label: None)
