"""The paper's laboratory, in its smallest form."""

import json

import numpy as np
import pytest

from docs import tables
from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINT
from hrc_env.experiments.lab import experiment
from hrc_env.experiments.lab.experiment import Lab, make_experiment, make_laboratory
from hrc_env.experiments.lab.motions import MOTIONS, play
from hrc_env.experiments.lab.sides import LEFT, RIGHT, find_averted_side
from hrc_env.experiments.recording import replay
from hrc_env.experiments.report import Report
from hrc_env.experiments.runner import run_experiment

TINY = Lab(n_seeds=1, max_frames=26)
CAMERAS = (*(f"camera_{k}" for k in range(1, 5)), "multi")


@pytest.fixture(scope="module")
def end_to_end(weights, tmp_path_factory):
    out = tmp_path_factory.mktemp("lab")
    return out, run_experiment(TINY, out, lambda share, label: None)


def test_every_number_is_there(end_to_end):
    out, metrics = end_to_end
    written = json.loads((out / "results.json").read_text())["metrics"]
    assert tables.asked("lab") <= written.keys() == metrics.keys()
    for motion in MOTIONS:
        for camera in CAMERAS:
            for word in ("median", "p95"):
                assert metrics[f"error_m.particle.{camera}.{motion}.{word}"].value > 0
            assert 0 <= metrics[f"missed.{camera}.{motion}"].value <= 1


def test_four_cameras_know_all_joints_better_than_any_one(end_to_end):
    _, metrics = end_to_end
    four = metrics["error_m.particle.multi.all.median"].value
    assert four < 0.05
    for camera in CAMERAS[:4]:
        assert metrics[f"error_m.particle.{camera}.all.median"].value > four


def test_report_and_figures_are_written(end_to_end):
    out, _ = end_to_end
    assert [path.name for path in (out / "figures").iterdir()] == ["figure_6.png"]
    assert (out / "report.html").read_text().count("data:image/png") == 1


def test_what_is_finished_is_used_again(end_to_end, monkeypatch):
    out, _ = end_to_end

    def never(*args):
        raise AssertionError("made again")

    monkeypatch.setattr(experiment, "measure_film", never)
    monkeypatch.setattr(experiment, "make_report", lambda *args: Report("", "", ()))
    before = (out / "results.json").read_text()
    run_experiment(TINY, out, lambda share, label: None)
    assert (out / "results.json").read_text() == before


@pytest.mark.parametrize("motion", MOTIONS)
def test_motions_stay_in_the_walkable_area(motion):
    scene, config = make_laboratory(200)
    for seed in range(4):
        path = play(scene, motion, seed, 250, config.ctrl_dt).position_world[:, 0, 0]
        (x0, x1), (y0, y1) = scene.grounds.walkable_x_m, scene.grounds.walkable_y_m
        assert x0 - 0.3 < path[:, 0].min() <= path[:, 0].max() < x1 + 0.3
        assert y0 - 0.3 < path[:, 1].min() <= path[:, 1].max() < y1 + 0.3


def test_the_side_turned_away_is_the_far_one():
    joints = np.zeros((15, 3))
    for side, y in (("left", 0.2), ("right", -0.2)):
        for part in ("shoulder", "hip"):
            joints[JOINT[f"{side}_{part}"], 1] = y
    np.testing.assert_array_equal(find_averted_side(joints, np.array([0.0, 5.0, 0.0])), RIGHT)
    np.testing.assert_array_equal(find_averted_side(joints, np.array([0.0, -5.0, 0.0])), LEFT)
    assert not find_averted_side(joints, np.array([5.0, 0.0, 0.0])).any()


def test_what_cannot_work_is_explained():
    with pytest.raises(ConfigError, match="--seeds must be at least 1"):
        make_experiment(True, 0)


def test_a_replay_with_all_cameras_believes_what_was_believed_when_filming(pixels):
    """The same joints too: those of the body, without the detector's mean offsets."""
    taken = experiment.record_film(TINY, "standing", 3, lambda share: None)
    said = replay(taken, experiment.CROPS, range(4), 0, 3)
    assert said.tracked[-1].all()
    np.testing.assert_allclose(said.mean_world, taken.beliefs.mean_world, atol=1e-9)
