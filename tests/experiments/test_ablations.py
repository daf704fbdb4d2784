"""The ablations, in their smallest form: every key, the same after a kill, bad input in words."""

import json
import signal
from dataclasses import replace

import numpy as np
import pytest

from docs import tables
from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.evaluation.intervals import MIN_SEEDS
from hrc_env.experiments.ablations import experiment
from hrc_env.experiments.ablations import play as playing
from hrc_env.experiments.ablations.ablation import Setting
from hrc_env.experiments.ablations.experiment import (
    ABLATIONS,
    Ablations,
    compute_metrics,
    make_experiment,
)
from hrc_env.experiments.ablations.handicaps import compute_lengths_m, handicap
from hrc_env.experiments.ablations.play import (
    make_setting_pipeline,
    make_walks,
    match_tracks,
    play,
    watch,
)
from hrc_env.experiments.ablations.questions.rigs import CORNERS, WALLS, spread_cameras
from hrc_env.experiments.report import Report
from hrc_env.experiments.rigs import DT_S, N_WARM_UP, make_turns
from hrc_env.experiments.runner import run_experiment
from hrc_env.tracking.tree.gaussian import PARENT, ROOT

TINY = Ablations(n_seeds=1, seconds=1.24)
SEEDS = (7, 8, 9)
N_STEPS = N_WARM_UP + 5


def silent(share, label):
    """Say nothing."""


def sums(setting):
    """What a setting's episodes come to."""
    walks = make_walks(setting.scene, setting.n_workers, SEEDS, N_STEPS)
    return play(setting, walks, SEEDS, lambda share: None)


def state_of(setting):
    """A tracker's state after an episode, and the true bones."""
    walks, turn = make_walks("lab", 1, SEEDS, N_STEPS), setting.turns[0]
    pipeline, ids = make_setting_pipeline(setting, turn, 1), np.zeros(1, int)
    frames = list(watch(setting, turn, walks, SEEDS, ids))
    rngs = [np.random.default_rng(0)]
    pipeline.tracker.reset(pipeline.state, ids, rngs)
    for _, _, keypoints in frames:
        pipeline.tracker.predict(pipeline.state, DT_S, rngs)
        pipeline.tracker.update(pipeline.state, keypoints, rngs)
    return pipeline.state, compute_lengths_m(frames[0][1].truth.joints_world)


@pytest.fixture(scope="module")
def end_to_end(tmp_path_factory):
    """A run of all studies: folder, numbers, told progress."""
    out, shares = tmp_path_factory.mktemp("ablations"), []
    metrics = run_experiment(TINY, out, lambda share, label: shares.append(share))
    return out, metrics, shares


def test_every_number_of_every_setting_is_there_and_finite(end_to_end):
    out, metrics, _ = end_to_end
    written = json.loads((out / "results.json").read_text())["metrics"]
    assert tables.asked("ablations") <= written.keys() == metrics.keys()
    for study in ABLATIONS.values():
        for setting in study.settings:
            key = f"{study.name}.{setting.name}"
            assert f"error_m.{key}.median" in metrics
            assert f"error_m.{key}.p95" in metrics
            is_compared = study.find_reference(setting) not in ("", setting.name)
            assert (f"difference.error_m.{key}.median" in metrics) == is_compared
            assert (f"p.error_m.{key}.p95" in metrics) == is_compared
            assert {f"{what}.{key}" for what in ("rmse_m", "coverage95", "lost")} <= metrics.keys()
            for what in ("id_switches", "idf1"):
                assert (f"{what}.{key}" in metrics) == (setting.n_workers > 1)
    for name, metric in metrics.items():
        if not name.startswith("p"):
            assert np.isfinite(metric.value), name
        assert np.isfinite([metric.low, metric.high]).all() or metric.n < MIN_SEEDS, name


def test_names_are_said_once_and_have_no_dots():
    for study in ABLATIONS.values():
        names = [setting.name for setting in study.settings]
        assert len(set(names)) == len(names)
        assert not any("." in name for name in names)


def test_settings_are_compared_with_what_was_changed_in_them():
    found = {
        (study.name, setting.name): study.find_reference(setting)
        for study in ABLATIONS.values()
        for setting in study.settings
    }
    assert found["cameras", "n1"] == found["cameras", "low"] == "corners"
    assert found["cameras", "site_one"] == "site_four"
    assert found["calibration", "site_all_rotation_1deg"] == "site_as_told"
    assert found["filter", "4cam_no_outliers"] == "4cam_all"
    assert found["filter", "1cam_no_floor"] == "1cam_all"
    assert found["kinematics", "2cam_none"] == "2cam_learnt"
    assert found["workers", "lab_2"] == ""


def test_report_and_figures_are_written_and_the_progress_is_complete(end_to_end):
    out, _, shares = end_to_end
    assert sum(shares) == pytest.approx(1.0)
    assert {path.stem for path in (out / "figures").iterdir()} == set(ABLATIONS)
    page = (out / "report.html").read_text()
    assert page.count("data:image/png") == len(ABLATIONS)
    for study in ABLATIONS.values():
        assert study.title in page
    assert "nan" not in (out / "report.md").read_text()


def test_what_is_finished_is_used_again(end_to_end, monkeypatch):
    out, _, _ = end_to_end

    def never(*args):
        raise AssertionError("made again")

    monkeypatch.setattr(experiment, "play_setting", never)
    monkeypatch.setattr(experiment, "make_report", lambda *args: Report("", "", ()))
    before = (out / "results.json").read_text()
    run_experiment(TINY, out, silent)
    assert (out / "results.json").read_text() == before


def test_a_run_that_is_killed_goes_on_to_the_same_numbers(process, tmp_path):
    config = replace(TINY, n_seeds=2, studies=("workers",))
    script = (
        "import os, sys; from pathlib import Path; "
        "from hrc_env.experiments.ablations.experiment import Ablations\n"
        "from hrc_env.engines.local import Serial\n"
        "from hrc_env.experiments.runner import run_experiment\n"
        "def say(share, label):\n"
        "    if label == 'workers.lab_3': os.kill(os.getpid(), 9)\n"
        f"run_experiment({config!r}, Path(sys.argv[1]), say, engine=Serial())"
    )
    out, other = tmp_path / "killed", tmp_path / "whole"
    killed = process("-c", script, out)
    assert killed.returncode == -signal.SIGKILL
    kept = {path.name: path.stat().st_mtime_ns for path in (out / "parts").iterdir()}
    assert set(kept) == {"workers.lab_1.json", "workers.lab_2.json"}
    assert not (out / "results.json").exists()
    resumed, whole = run_experiment(config, out, silent), run_experiment(config, other, silent)
    assert resumed.keys() == whole.keys()
    for name, metric in whole.items():  # sums of another process may round otherwise
        numbers = (resumed[name].value, resumed[name].low, resumed[name].high)
        assert numbers == pytest.approx(
            (metric.value, metric.low, metric.high), rel=1e-12, nan_ok=True
        )
    assert kept == {name: (out / "parts" / name).stat().st_mtime_ns for name in kept}


def test_what_cannot_work_is_explained(tmp_path):
    with pytest.raises(ConfigError, match="Did you mean 'cameras'"):
        make_experiment(studies=("camera",))
    with pytest.raises(ConfigError, match="--studies requires at least one"):
        make_experiment(studies=())
    with pytest.raises(ConfigError, match="--seeds must be at least 1"):
        make_experiment(seeds=0)
    with pytest.raises(ConfigError, match="longer than the warm-up"):
        replace(TINY, seconds=1.0)
    with pytest.raises(ConfigError, match="got 'paper'"):
        Setting("x", "x", estimator="paper", bones="known")
    (tmp_path / "experiment.json").write_text('{"experiment": "lab"}')
    with pytest.raises(ConfigError, match="--overwrite"):
        run_experiment(TINY, tmp_path, silent)


def test_quick_asks_everything():
    assert make_experiment(quick=True).studies == make_experiment().studies == tuple(ABLATIONS)
    assert make_experiment(seeds=3).n_seeds == 3


def test_nothing_depends_on_the_number_of_threads(monkeypatch):
    setting = Setting("x", "x", turns=make_turns("lab", ((0,), (1,))))
    found = []
    for n_threads in (1, 3):
        monkeypatch.setattr(playing, "n_cores", lambda n=n_threads: n)
        found.append(sums(setting))
    assert found[0] == found[1]


def test_joints_are_sorted_by_the_cameras_that_are_left_to_see_them():
    setting = Setting("lab_x", "x", turns=make_turns("lab", ((0,),)), by_sight=True)
    rows = sums(setting)
    assert sum(sum(rows[f"seen_{k}_joints"]) for k in (2, 3, 4)) == 0
    n_joints = [a + b for a, b in zip(rows["seen_0_joints"], rows["seen_1_joints"], strict=True)]
    assert n_joints == rows["joints"] == [5 * N_JOINTS] * len(SEEDS)
    metrics = compute_metrics({"occlusion": {"lab_x": rows}})
    assert metrics["rmse_m.occlusion.lab_seen_1"].value > 0


def test_cameras_are_spread_round_the_room():
    four = [{camera.eye_world[:2] for camera in turn.cameras} for turn in spread_cameras(4)]
    assert four == [set(CORNERS), set(WALLS)]
    assert [len(turn.cameras) for n in range(2, 9) for turn in spread_cameras(n)[:1]] == [
        *range(2, 9)
    ]
    one = spread_cameras(1)
    assert len(one) == 8
    assert all(len(turn.faults[0].cameras) == 3 for turn in one)


def test_tracks_are_compared_with_the_workers_whom_they_fit():
    truth = np.zeros((1, 2, N_JOINTS, 3))
    truth[:, 1, :, 0] = 2.0
    exchanged = truth[:, ::-1]
    assert match_tracks(exchanged, np.ones((1, 2), bool), truth).tolist() == [[1, 0]]
    one_lost = truth.copy()
    one_lost[:, 1] = [0.1, 0, 0]  # this one is followed, and is the first worker's
    assert match_tracks(one_lost, np.array([[False, True]]), truth).tolist() == [[1, 0]]


def test_bones_are_given_and_taken_away():
    state, lengths = state_of(Setting("x", "x"))
    handicap(state, "known", "model", lengths)
    assert (state.trees["bone_length"] == lengths[:, :, None]).all()
    handicap(state, "none", "model", lengths)
    assert (state.trees["bone_variance"] == 1e6).all()


def test_a_forgotten_velocity_leaves_the_positions_as_they_are():
    state, lengths = state_of(Setting("x", "x"))
    trees = state.trees
    parent = np.where(np.arange(N_JOINTS) == ROOT, ROOT, PARENT)
    positions = trees["cov"][:, 0, 0, :, :3, :3].copy()
    together = (trees["slope"] @ trees["cov"][..., parent, :, :])[:, 0, 0, :, :3, :3].copy()
    handicap(state, "learnt", "forgotten", lengths)
    assert (trees["body"][..., 3:] == 0).all()
    assert np.array_equal(trees["cov"][:, 0, 0, :, :3, :3], positions)
    now = (trees["slope"] @ trees["cov"][..., parent, :, :])[:, 0, 0, :, :3, :3]
    others = np.arange(N_JOINTS) != ROOT
    assert np.allclose(now[:, others], together[:, others], atol=1e-12)
    assert np.linalg.eigvalsh(trees["cov"]).min() > 0
