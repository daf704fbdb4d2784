"""Other people's code: run where it is, named in words where it is not."""

import json

import numpy as np
import pytest

from benchmarks.tracking.baselines import bench
from benchmarks.tracking.baselines.model import F, Q, first_joints, pixels
from benchmarks.tracking.rigs import make_rig
from benchmarks.tracking.sequences import make_sequences
from hrc_env.experiments.runner import run_experiment
from hrc_env.geometry.cameras import project


@pytest.fixture(scope="module")
def lab():
    rig = make_rig("lab")
    return rig, make_sequences(rig, "clean", [1000])


def test_who_is_missing_is_said_with_the_command_that_helps(monkeypatch):
    monkeypatch.setattr(bench, "is_installed", lambda name: name == "aniposelib")
    sentence = bench.describe_missing()
    assert "particles, filterpy" in sentence
    assert "pip install" in sentence
    assert "[baselines]" in sentence
    monkeypatch.setattr(bench, "is_installed", lambda name: True)
    assert "All libraries" in bench.describe_missing()


@pytest.mark.parametrize("name", bench.LIBRARIES)
def test_a_library_follows_a_clean_walk(name, lab):
    if not bench.is_installed(name):
        pytest.skip(f"{name} is not installed")
    rig, sequences = lab
    joints = bench.find_follow(name)(rig.P, sequences.px[:60, 0, :, 0], 0)
    error_m = np.linalg.norm(joints - sequences.joints[:60, 0, 0], axis=-1)
    assert error_m[30:].mean() < 0.04


def test_pixels_are_those_of_the_project(lab):
    rig, sequences = lab
    joints = sequences.joints[0, 0, 0]
    expected, _ = project(rig.P, joints[None])
    assert np.allclose(pixels(rig.P, joints), expected[0].swapaxes(0, 1).reshape(15, -1))


def test_filters_begin_at_the_first_frame_that_shows_a_joint_twice(lab):
    rig, sequences = lab
    px = sequences.px[:10, 0, :, 0].copy()
    px[:4, 1:, 6] = np.nan
    start = first_joints(rig.P, px)
    assert np.linalg.norm(start - sequences.joints[0, 0, 0], axis=-1)[:6].max() < 0.1
    assert np.linalg.norm(start[6] - sequences.joints[4, 0, 0, 6]) < 0.1


def test_constant_velocity_is_a_proper_model():
    assert np.linalg.eigvalsh(Q).min() > 0
    assert np.allclose(F @ np.array([1.0, 2, 3, 4, 5, 6]), [1.16, 2.2, 3.24, 4, 5, 6])


def test_the_bench_writes_what_ran_and_names_what_did_not(tmp_path, monkeypatch):
    monkeypatch.setattr(bench, "CONDITIONS", ("one_camera",))
    monkeypatch.setattr(bench, "ROWS", ("one_camera", "after_return"))
    monkeypatch.setattr(bench, "RIGS", ("lab",))
    monkeypatch.setattr(bench, "OURS", ("dlt",))  # no kernels to compile
    monkeypatch.setattr(bench, "is_installed", lambda name: False)
    shares, config = [], bench.BaselinesBench(n_seeds=2)
    metrics = run_experiment(config, tmp_path, lambda share, _: shares.append(share))
    assert sum(shares) == pytest.approx(1)
    assert "rmse_m.lab.after_return.dlt" in metrics
    assert metrics["rmse_m.lab.one_camera.dlt"].n == 2
    stored = json.loads((tmp_path / "results.json").read_text())
    assert stored["config"]["missing"] == list(bench.LIBRARIES)
    table = (tmp_path / "report.md").read_text()
    assert "Not installed and therefore skipped: aniposelib, particles, filterpy" in table
