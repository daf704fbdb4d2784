"""A part of the tracking bench: the estimators and the sequences that somebody asks for."""

from dataclasses import replace

import pytest

from benchmarks.tracking import bench, sequences
from benchmarks.tracking.bench import TrackingBench
from benchmarks.tracking.names import DLT, EVERYTHING, SMOOTHER, Selection
from hrc_env.cli.estimators import resolve_estimators
from hrc_env.core.errors import ConfigError
from hrc_env.engines.local import Serial
from hrc_env.experiments import runner
from hrc_env.experiments.cache import PartCache
from hrc_env.experiments.runner import describe_experiment
from hrc_env.experiments.versions import make_key
from hrc_env.tracking.estimators import ESTIMATORS

TINY = TrackingBench(n_seeds=2, n_matched=2, n_smoothed=1, timing_repeats=1)


def test_everybody_runs_on_everything_if_nobody_chooses():
    names = EVERYTHING.names_of("clean")
    assert names[0] == "particle"
    assert {*names} == {*ESTIMATORS, DLT, SMOOTHER}
    assert SMOOTHER not in EVERYTHING.names_of("matched")
    assert EVERYTHING.timed() == [*ESTIMATORS]
    assert len(EVERYTHING.conditions()) == 20


def test_who_is_chosen_runs_beside_the_default():
    some = Selection(("ransac", DLT))
    assert some.names_of("clean") == ["particle", "ransac", DLT]
    assert some.timed() == ["particle", "ransac"]
    assert Selection(("particle",)).rivals() == []
    assert Selection((SMOOTHER,)).names_of("clean") == ["particle", SMOOTHER]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("lab.clean",), {("lab", "clean")}),
        (("matched",), {("lab", "matched"), ("site", "matched")}),
        (("env",), {("env", c) for c in ("four_cameras", "two_cameras", "one_camera", "occluded")}),
        (("lab.clean", "env.occluded"), {("lab", "clean"), ("env", "occluded")}),
    ],
)
def test_sequences_are_chosen_by_rig_condition_or_both(words, expected):
    assert {*Selection((), words).conditions()} == expected


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"estimators": ("particel",)}, "Unknown estimator 'particel'. Did you mean 'particle'"),
        ({"sequences": ("lab.clen",)}, "Unknown sequences 'lab.clen'. Did you mean 'lab.clean'"),
        ({"sequences": ("env.hard",)}, "Unknown sequences 'env.hard'"),
    ],
)
def test_what_there_is_not_is_refused(change, said):
    with pytest.raises(ConfigError, match=said):
        replace(TINY, **change)


def test_the_settings_of_the_whole_bench_are_what_they_were():
    """Finished parts are kept by them."""
    assert not {"estimators", "sequences"} & TINY.settings()["bench"].keys()
    some = replace(TINY, estimators=("ransac",))
    assert some.settings()["bench"]["estimators"] == ("ransac",)


def test_parts_are_the_same_whatever_else_is_run(tmp_path, monkeypatch):
    short = {name: min(n, 20) for name, n in sequences.N_FRAMES.items()}
    windows = {name: dict.fromkeys(inner, (10, 20)) for name, inner in sequences.WINDOWS.items()}
    monkeypatch.setattr(sequences, "N_FRAMES", short)
    monkeypatch.setattr(sequences, "WINDOWS", windows)
    times = {"1": [2.0], "64": [1.0], "hard_64": [1.5]}
    monkeypatch.setattr(bench, "time_estimator", lambda *a: a[-1](1.0) or times)
    whole = PartCache(
        tmp_path / "parts",
        make_key(describe_experiment(TINY), TINY.depends),
        1,
        lambda *a: None,
        engine=Serial(),
    )
    own = replace(TINY, estimators=("ransac",))
    names = own.selection.names_of("clean")
    whole.make_parts([bench.make_part(own, "lab", "clean", name, whole.key) for name in names])
    made = {path: path.stat().st_mtime_ns for path in (tmp_path / "parts").iterdir()}
    assert {path.name for path in made} == {"lab.clean.particle.json", "lab.clean.ransac.json"}
    some = replace(TINY, estimators=("ransac",), sequences=("lab.clean", "site.matched"))
    metrics = runner.run_experiment(some, tmp_path, engine=Serial())
    assert all(path.stat().st_mtime_ns == t for path, t in made.items())
    assert "rmse_m.lab.clean.ransac" in metrics
    assert "ratio_to_bound.ransac" in metrics
    assert not any("paper" in name for name in metrics)
    text = (tmp_path / "report.md").read_text()
    assert "Two workers" not in text
    assert "paper, cm" not in text
    assert text.count("Quick run, 2 seeds") == text.count("\n|---") + 1


SPEC = """
import hrc_env


def calm(P, ctrl_dt, config):
    return hrc_env.make_estimator("triangulation", P, ctrl_dt, config)


def broken(P):
    return None
"""


def test_a_function_is_registered_by_its_name(tmp_path, monkeypatch):
    (tmp_path / "calm_estimators.py").write_text(SPEC)
    monkeypatch.syspath_prepend(tmp_path)
    try:
        for _ in range(2):  # twice the same is once
            assert resolve_estimators(["calm_estimators:calm", "ransac"]) == ("calm", "ransac")
        assert bench.extend_key("calm", "key") != "key" == bench.extend_key("ransac", "key")
        with pytest.raises(ConfigError, match="must be a function of"):
            resolve_estimators(["calm_estimators:broken"])
        with pytest.raises(ConfigError, match="There is no estimator 'calm_estimators:gone'"):
            resolve_estimators(["calm_estimators:gone"])
    finally:
        ESTIMATORS.pop("calm", None)
