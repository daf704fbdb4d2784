"""The perception bench, small: every number is there, and each says what it should."""

import json
import math

import numpy as np
import pytest

from benchmarks.perception import bench, sheet, speed
from benchmarks.perception.families import FAMILIES, FAMILY_OF
from benchmarks.perception.loops import Episode, episode_of, rotated, some_steps
from benchmarks.perception.measured import EMULATED, NO_FAULT, PIXELS, Measured, metrics_of
from benchmarks.perception.report import markdown
from benchmarks.perception.settings import PerceptionBenchConfig
from benchmarks.perception.views import View, rows_of
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric
from hrc_env.motion.generator import activity_names

TINY = PerceptionBenchConfig(
    episodes=(("lab", 1),), n_steps=4, n_faults=1, fault_steps=3, n_emulated=1, kinds=("lost",),
    bodies=("worker_1",), n_instants=1, n_empty=1, emulator_rounds=None, cameras=(1,),
    workers=(1,), speed_steps=2,
)  # fmt: skip


def episode(error_m, n_steps=10, n_cameras=4):
    error = np.full((n_steps, 15), error_m)
    seen = np.full((n_steps, n_cameras), 2.0)
    family = np.arange(n_steps) % len(FAMILIES)
    named = np.zeros((n_steps, n_cameras), bool)
    named[n_steps // 2 :, 1] = True
    return Episode(error, error.copy(), np.full(n_steps, 14), seen, family, named)


def found():
    """Faults that double the error; four cameras have them in turns."""
    views = [
        View("plain", "lab", "worker_1", "walk", "camera_1", 3.5, 10.0, 0.02, None),
        View("plain", "lab", "worker_1", "kneel", "camera_2", 7.0, 179.0, None, None),
        View("lens fisheye", "lab", "worker_1", "walk", "camera_1", 3.5, 10.0, 0.04, None),
    ]
    base, twice = [episode(0.02)] * 4, [episode(0.04)] * 4
    faults = {(level, NO_FAULT): base for level in (PIXELS, EMULATED)}
    faults |= {(level, "lost"): twice for level in (PIXELS, EMULATED)} | {(PIXELS, "glare"): twice}
    pace = {"steps_per_s": 50.0, "n": 9, "stages": dict.fromkeys((*speed.STAGES, "rest"), 4)}
    ghosts = [{"images": 8, "phantoms": 1, "tracked": 0}] * 2
    emulator = {
        f"{name}.walk": Metric(1.1, 1.0, 1.2, "", 9)
        for name in ("emulator_error_ratio", "emulator_coverage_difference")
    }
    emulator["emulator_error_ratio.walk.p95"] = Metric(0.9, 0.9, 1.0, "", 9)
    return Measured({"4.1": pace}, {"litert": 20.0}, views, {"lab": base}, faults, emulator, ghosts)


def test_what_is_not_usual_is_named():
    setting = speed.Setting
    names = [setting(4, 1), setting(4, 1, scene="site"), setting(4, 1, runtime="openvino")]
    assert [each.name for each in names] == ["4.1", "4.1.site", "4.1.openvino"]


def test_every_activity_is_in_one_family():
    assert set(FAMILY_OF) == set(activity_names)
    assert sum(map(len, FAMILIES.values())) == len(FAMILY_OF)


def test_an_episode_survives_being_written_down():
    one = episode(0.0123)
    one.error_m[2] = np.nan
    again = episode_of(json.loads(json.dumps(one.to_json())))
    np.testing.assert_allclose(again.error_m, one.error_m)
    np.testing.assert_array_equal(again.inside95, one.inside95)
    assert len(some_steps(again, slice(3)).off_px) == 3


def test_numbers_say_what_was_found():
    metrics = metrics_of(found())
    assert metrics["error_m.lab.median"].value == pytest.approx(0.02)
    assert metrics["coverage95.lab"].value == pytest.approx(14 / 15)
    assert metrics["error_ratio.lost"].value == pytest.approx(2.0)
    assert metrics["error_ratio.lost.camera_3"].value == pytest.approx(2.0)
    assert metrics["std_over_error.fault.glare"].value == pytest.approx(1.0)
    assert metrics["detected.fault.glare"].value == 1.0
    assert metrics["miscalibrated.lost.named"].value == 0.25
    assert metrics["miscalibrated.lost.after_s"].value == pytest.approx(0.2)
    assert metrics["miscalibrated.lost.others"].value == pytest.approx(3 / 8)
    assert metrics["detected.pose.fold"].value == 0.0
    assert metrics["error_share.lens.fisheye.median"].value == pytest.approx(0.04)
    assert metrics["detected.distance.6_9_m"].n == 1
    assert metrics["phantom_frames"].value == 2
    assert metrics["phantom_frames"].n == 16
    assert metrics["steps_per_s.4.1"].value == 50.0
    assert metrics["network_ms.litert"].value == 20.0


def test_the_report_has_a_row_for_every_fault_that_was_played():
    said = markdown(metrics_of(found()))
    assert "| `lost` | 2.00" in said
    assert "| `glare` | 2.00" in said
    assert "`defocus`" not in said
    assert "| walk | 1.10 (1.00-1.20) | 0.90 (0.90-1.00) | +1.100 (+1.000 to +1.200) | 9 |" in said


def test_distances_are_rows_in_order():
    assert list(rows_of(found().views, "distance")) == ["3_4_m", "6_9_m"]
    assert list(rows_of(found().views, "angle")) == ["0_45_deg", "135_180_deg"]


def test_the_sheet_shows_the_worst_first_and_some_that_were_missed():
    errors = [*np.linspace(0.01, 0.5, 30), *[math.nan] * 10]
    worst = sheet.worst_of(errors)
    assert worst[0] == 29
    assert len(worst) == sheet.N_CROPS
    assert sum(k >= 30 for k in worst) == sheet.MOST_MISSED


def test_cameras_have_a_fault_in_turns():
    assert [rotated("lost", k, 4).cameras for k in (0, 3, 4)] == [
        ("camera_1",), ("camera_4",), ("camera_1",)
    ]  # fmt: skip


def test_more_faulty_episodes_than_faultless_ones_are_refused():
    with pytest.raises(ConfigError, match="lab's first episodes"):
        PerceptionBenchConfig(n_faults=31)


def test_a_bench_writes_everything_and_goes_on_where_it_was(pixels, tmp_path):
    said = []
    bench.run(TINY, tmp_path, lambda share, label: said.append(share))
    assert sum(said) == pytest.approx(1.0)
    for name in ("perception.md", "speed.png", "detection.png", "faults.png", "results.json"):
        assert (tmp_path / name).stat().st_size > 0
    content = json.loads((tmp_path / "results.json").read_text())
    assert "error_ratio.lost" in content["metrics"]
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").glob("*.json")}
    bench.run(TINY, tmp_path, lambda share, label: None)
    assert before == {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").glob("*.json")}
