"""The perception bench, small: every number is there, and each says what it should."""

import json
from dataclasses import asdict

import numpy as np
import pytest

from benchmarks.perception import speed
from benchmarks.perception.bench import PerceptionBench
from benchmarks.perception.episodes import Episode, read_episode, select_steps
from benchmarks.perception.metrics import EMULATED, NO_FAULT, PIXELS, compute_metrics
from benchmarks.perception.report import report
from benchmarks.perception.views import FAMILIES, FAMILY_OF, View, group_rows
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric
from hrc_env.experiments.runner import run_experiment
from hrc_env.motion.generator import activity_names

TINY = PerceptionBench(
    episodes=(("lab", 1),), n_steps=4, n_faults=1, fault_steps=3, n_emulated=1,
    kinds=("lost",), bodies=("worker_1",), n_instants=1, emulator_rounds=None,
    cameras=(1,), workers=(1,), speed_steps=2,
)  # fmt: skip


def episode(error_m, n_steps=10, n_cameras=4):
    error = np.full((n_steps, 15), error_m)
    seen = np.full((n_steps, n_cameras), 2.0)
    family = np.arange(n_steps) % len(FAMILIES)
    named = np.zeros((n_steps, n_cameras), bool)
    named[n_steps // 2 :, 1] = True
    return Episode(error, error.copy(), np.full(n_steps, 14), seen, family, named)


VIEWS = [
    View("plain", "lab", "worker_1", "walk", 3.5, 10.0, 0.02),
    View("plain", "lab", "worker_1", "kneel", 7.0, 179.0, None),
    View("lens fisheye", "lab", "worker_1", "walk", 3.5, 10.0, 0.04),
]


def found():
    """Faults that double the error; four cameras have them in turns."""
    base, twice = ({"episodes": [episode(error_m).to_json()] * 4} for error_m in (0.02, 0.04))
    pace = {"steps_per_s": 50.0, "n": 9, "stages": dict.fromkeys((*speed.STAGES, "rest"), 4)}
    ratio = asdict(Metric(1.1, 1.0, 1.2, "", 9))
    return {
        "crops.plain.lab.worker_1": {"views": [asdict(view) for view in VIEWS]},
        "loop.lab.0": base,
        f"fault.{PIXELS}.lost": twice,
        f"fault.{PIXELS}.glare": twice,
        f"fault.{EMULATED}.{NO_FAULT}": base,
        f"fault.{EMULATED}.lost": twice,
        "emulator": {
            "emulator_error_ratio.walk": ratio,
            "emulator_error_ratio.walk.p95": ratio,
            "emulator_coverage_difference.walk": ratio,
        },
        "speed.4.1": pace,
        "network.litert": {"ms": 20.0},
    }


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
    again = read_episode(json.loads(json.dumps(one.to_json())))
    np.testing.assert_allclose(again.error_m, one.error_m)
    np.testing.assert_array_equal(again.inside95, one.inside95)
    assert len(select_steps(again, slice(3)).off_px) == 3


def test_numbers_say_what_was_found():
    metrics = compute_metrics(found(), 4, 10)
    assert metrics["error_m.lab.median"].value == pytest.approx(0.02)
    assert metrics["coverage95.lab"].value == pytest.approx(14 / 15)
    assert metrics["error_ratio.lost"].value == pytest.approx(2.0)
    assert metrics["std_over_error.fault.glare"].value == pytest.approx(1.0)
    assert metrics["detected.fault.glare"].value == 1.0
    assert metrics["miscalibrated.lost.named"].value == 0.25
    assert metrics["miscalibrated.lost.after_s"].value == pytest.approx(0.2)
    assert metrics["miscalibrated.lost.others"].value == pytest.approx(3 / 8)
    assert metrics["detected.pose.fold"].value == 0.0
    assert metrics["error_share.lens.fisheye.median"].value == pytest.approx(0.04)
    assert metrics["detected.distance.6_9_m"].n == 1
    assert metrics["steps_per_s.4.1"].value == 50.0
    assert metrics["network_ms.litert"].value == 20.0


def test_the_report_has_a_row_for_every_fault_that_was_played(tmp_path):
    metrics = compute_metrics(found(), 4, 10)
    report(TINY, found(), metrics, tmp_path / "figures").write(tmp_path, {}, [0], metrics)
    said = (tmp_path / "report.md").read_text()
    assert "| `lost` | 2.00" in said
    assert "| `glare` | 2.00" in said
    assert "`defocus`" not in said
    assert "| +1.100 (+1.000 to +1.200) |" in said  # without a p-value, nothing is marked


def test_distances_are_rows_in_order():
    assert list(group_rows(VIEWS, "distance")) == ["3_4_m", "6_9_m"]
    assert list(group_rows(VIEWS, "angle")) == ["0_45_deg", "135_180_deg"]


def test_more_faulty_episodes_than_faultless_ones_are_refused():
    with pytest.raises(ConfigError, match="lab's first episodes"):
        PerceptionBench(n_faults=31)


def test_a_bench_writes_everything_and_goes_on_where_it_was(pixels, tmp_path):
    said = []
    run_experiment(TINY, tmp_path, lambda share, label: said.append(share))
    assert sum(said) == pytest.approx(1.0)
    for name in ("report.md", "report.html", "results.json"):
        assert (tmp_path / name).stat().st_size > 0
    content = json.loads((tmp_path / "results.json").read_text())
    assert "error_ratio.lost" in content["metrics"]
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").glob("*.json")}
    run_experiment(TINY, tmp_path, lambda share, label: None)
    assert before == {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").glob("*.json")}
