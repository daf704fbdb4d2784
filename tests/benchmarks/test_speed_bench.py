"""The speed bench, small: every number is there, and no organ can hide."""

import json
import math
import threading
from types import SimpleNamespace

import pytest

from benchmarks.speed import bench, organs
from benchmarks.speed.contenders import OURS, Pace, Single, Vector
from benchmarks.speed.organs import REST, TOTAL
from benchmarks.speed.stopwatch import Stopwatch
from benchmarks.speed.tasks import shares
from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.experiments.runner import run_experiment
from hrc_env.tasks import BUILT_IN

TINY = bench.SpeedBench(
    n_rounds=1, least_steps=1, n_resets=1, levels=("keypoints",), sizes=(1, 3), threads=(1, 2),
    task_steps=1,
)  # fmt: skip


@pytest.fixture(scope="module")
def end_to_end(tmp_path_factory):
    out, said = tmp_path_factory.mktemp("speed"), []
    metrics = run_experiment(TINY, out, lambda share, label: said.append(share))
    return out, metrics, said


def test_every_number_is_there_and_finite(end_to_end):
    _, metrics, _ = end_to_end
    sizes = ("single", "1.1", "3.1", "3.2")
    for size in sizes:
        assert metrics[f"env_steps_per_s.keypoints.{size}"].value > 0
        for organ in (*organs.ORGANS, REST, TOTAL):
            assert f"us_per_env_step.{organ}.{size}" in metrics
    assert metrics["env_steps_per_s.reacher.single"].value > 0
    assert metrics["env_steps_per_s.reacher.64.1"].value > 0
    assert {"reset_ms.1_of_1", "reset_ms.8_of_64"} <= set(metrics)
    assert "env_steps_per_s.keypoints.1.2" not in metrics
    assert all(math.isfinite(metric.value) for metric in metrics.values())


def test_every_id_has_its_share_of_the_firsts_speed(end_to_end):
    out, metrics, _ = end_to_end
    for task in BUILT_IN:
        assert metrics[f"task_steps_per_s.{task}"].value > 0
    assert metrics["task_share.HRCReach-v0"].value == 1.0
    assert "| `HRCDrywall-v0` | " in (out / "report.md").read_text()


def test_of_every_id_nothing_else_is_timed(tmp_path, monkeypatch):
    monkeypatch.setattr(bench.Tasks, "__init__", lambda self: None)
    monkeypatch.setattr(bench.Tasks, "close", lambda self: None)
    monkeypatch.setattr(bench.Tasks, "run", lambda self, n: {"HRCReach-v0": 10.0 * n})
    said = []
    config = bench.SpeedBench(task="every", n_rounds=2)
    metrics = run_experiment(config, tmp_path, lambda share, label: said.append(share))
    assert set(metrics) == {"task_steps_per_s.HRCReach-v0", "task_share.HRCReach-v0"}
    assert sum(said) == pytest.approx(1.0)


def test_shares_are_of_the_same_round():
    found = shares({"HRCReach-v0": [100.0, 50.0, 200.0], "HRCDrywall-v0": [50.0, 50.0, 50.0]})
    share = found["task_share.HRCDrywall-v0"]
    assert (share.value, share.low, share.high) == (0.5, 0.25, 1.0)


def test_organs_and_rest_are_the_whole_and_organs_are_most_of_it(end_to_end):
    _, metrics, _ = end_to_end
    for size in ("single", "1.1", "3.1", "3.2"):
        us = {
            organ: metrics[f"us_per_env_step.{organ}.{size}"].value
            for organ in (*organs.ORGANS, REST)
        }
        total = metrics[f"us_per_env_step.{TOTAL}.{size}"].value
        assert all(value > 0 for value in us.values())
        assert sum(us.values()) == pytest.approx(total)
        assert us[REST] < total / 2 or size == "3.2"


def test_files_are_written_and_the_progress_ends_at_one(end_to_end):
    out, metrics, said = end_to_end
    content = json.loads((out / "results.json").read_text())
    assert set(content["metrics"]) == set(metrics)
    assert content["config"]["bench"]["n_rounds"] == 1
    table = (out / "report.md").read_text()
    for word in ("single", "3 on 2 threads", "physics", "Reacher", "8 of 64"):
        assert word in table
    assert (out / "figures" / "organs.png").stat().st_size > 10_000
    assert sum(said) == pytest.approx(1.0)


def test_every_function_of_the_table_is_called_and_given_back():
    """A function that moved would have its time counted nowhere."""
    before = [vars(owner)[name] for places in organs.ORGANS.values() for owner, name in places]
    measuring, level = organs.Organs(), bench.WATCHED
    for contender in (Single(OURS, perception=level), Vector(OURS, 2, perception=level)):
        measuring.us_per_env_step(contender, 1, 1)
        contender.close()
    measuring.check_all_called()
    after = [vars(owner)[name] for places in organs.ORGANS.values() for owner, name in places]
    assert after == before


def test_a_function_that_nobody_calls_stops_the_bench():
    room = SimpleNamespace(used=lambda: None, forgotten=lambda: None, __name__="room")
    measuring = organs.Organs({"a": [(room, "used"), (room, "forgotten")]})
    contender = SimpleNamespace(run=lambda n: (room.used(), Pace(1, 1.0))[1])
    measuring.us_per_env_step(contender, 1, 1)  # type: ignore[arg-type]
    with pytest.raises(HRCError, match=r"room\.forgotten"):
        measuring.check_all_called()


def test_time_inside_another_organ_counts_once_and_threads_are_summed():
    seconds = iter(range(100))
    room = SimpleNamespace(__name__="room", inner=lambda: None)
    room.outer = lambda: room.inner()
    watch = Stopwatch({"inner": [(room, "inner")], "outer": [(room, "outer")]})
    with watch.running(), pytest.MonkeyPatch.context() as patch:
        patch.setattr("time.perf_counter", lambda: next(seconds))
        room.outer()
        thread = threading.Thread(target=room.outer)
        thread.start()
        thread.join()
    assert watch.seconds == {"inner": 2, "outer": 4}


def test_inside_a_whole_nothing_is_told_apart():
    seconds = iter(range(100))
    room = SimpleNamespace(__name__="room", inner=lambda: None)
    room.outer = lambda: room.inner()
    watch = Stopwatch({"inner": [(room, "inner")], "outer": [(room, "outer")]}, whole=["outer"])
    with watch.running(), pytest.MonkeyPatch.context() as patch:
        patch.setattr("time.perf_counter", lambda: next(seconds))
        room.outer()
        room.inner()
    assert watch.seconds == {"inner": 1, "outer": 1}


def test_numbers_that_cannot_work_are_refused():
    with pytest.raises(ConfigError, match="n_rounds"):
        bench.SpeedBench(n_rounds=0)
    with pytest.raises(ConfigError, match="keypoints"):
        bench.SpeedBench(levels=("truth",))
