"""The motion bench, small: every number, every target, and the files."""

import json
import math

import pytest

from benchmarks.motion import bench
from benchmarks.motion.report import inside
from benchmarks.motion.targets import TARGETS, list_targets
from hrc_env.core.errors import ConfigError
from hrc_env.experiments.runner import run_experiment
from hrc_env.motion.repertoire import SCENES

PLAYED = ("stand", "walk 1.1 m/s", "saw")
TINY = bench.MotionBench(n_seeds=1, bodies=("worker_1",))


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    out, said = tmp_path_factory.mktemp("motion"), []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bench, "SCENES", {name: SCENES[name] for name in PLAYED})
        metrics = run_experiment(TINY, out, lambda share, label: said.append(share))
    return out, metrics, said


def test_every_number_is_finite_and_every_target_has_one(done):
    _, metrics, _ = done
    assert all(math.isfinite(metric.value) for metric in metrics.values())
    for scene in PLAYED:
        assert {f"{scene}.{target.statistic}" for target in list_targets(scene)} <= set(metrics)


def test_the_first_worker_walks_and_saws_like_people(done):
    _, metrics, _ = done
    for scene in ("walk 1.1 m/s", "saw"):
        for target in list_targets(scene):
            if target.statistic not in ("wrist_p95_m_s", "step_width_m"):
                assert inside(target, metrics[f"{scene}.{target.statistic}"]), target


def test_files_are_written_and_the_progress_ends_at_one(done):
    out, metrics, said = done
    content = json.loads((out / "results.json").read_text())
    assert set(content["metrics"]) == set(metrics)
    assert sum(said) == pytest.approx(1.0)
    assert "| saw | wrist_p95_m_s |" in (out / "report.md").read_text()


def test_every_target_names_a_scene_that_exists():
    assert {target.scene for target in TARGETS} - {"*"} <= set(SCENES)


def test_an_empty_bench_is_refused():
    with pytest.raises(ConfigError, match="seeds"):
        bench.MotionBench(n_seeds=0)
    with pytest.raises(ConfigError, match="bodies"):
        bench.MotionBench(bodies=())
