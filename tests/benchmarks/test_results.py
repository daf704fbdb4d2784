"""make results: what is stale is run, what is finished is kept, numbers reach their tables."""

import json
import sys
from dataclasses import replace

import pytest
from rich.console import Console

from benchmarks import results
from benchmarks.results import STUDIES, Arguments, Study, depends, main, why_stale
from docs import tables

MODULE = "benchmarks.occlusion"
WRITES = """
import json, sys, time
from pathlib import Path
out = Path(sys.argv[sys.argv.index("--out") + 1])
(out / "figures").mkdir(parents=True, exist_ok=True)
(out / "figures" / "a.png").write_bytes(b"picture")
with open(out / "begun", "a") as begun:
    begun.write("x")
time.sleep(SECONDS)
metric = {"value": 0.25, "low": 0.2, "high": 0.3, "n": 8}
content = {"git": "abc1234", "machine": {"cores": 2}, "metrics": {"found.lab": metric}}
(out / "results.json").write_text(json.dumps(content))
"""
TABLE = {
    "title": "Found", "command": "python made.py", "commit": "", "date": "", "machine": "",
    "columns": [{"name": "scene"}, {"name": "found", "unit": "%", "metric": "found.{0}",
                                    "factor": 100}],
    "keys": [["lab"]], "rows": [["lab", 1]],
}  # fmt: skip


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A study of its own, and folders that are nobody's: a function to give it a duration."""
    for name, value in {
        "ROOT": results.ROOT, "OUT": tmp_path / "out", "QUICK_OUT": tmp_path / "quick",
        "WHOLE": tmp_path / "whole", "PICTURES": tmp_path, "STOPPING_S": 0.2,
    }.items():  # fmt: skip
        monkeypatch.setattr(results, name, value)
    monkeypatch.setattr(tables, "RESULTS", tmp_path)
    monkeypatch.setattr(results.generate, "main", lambda words: None)
    monkeypatch.setattr(results, "provenance", lambda: {"git": "abc1234"})
    (tmp_path / "found.json").write_text(json.dumps(TABLE))

    def study(seconds=0.0, **changes):
        script = tmp_path / "made.py"
        script.write_text(WRITES.replace("SECONDS", str(seconds)))
        made = Study(f"python {script}", 0.1, (MODULE,), ("found",), {"shown.png": "a.png"})
        monkeypatch.setattr(results, "STUDIES", {"one": replace(made, **changes)})
        return tmp_path

    return study


def n_runs(folder):
    path = folder / "out" / "one" / "begun"
    return len(path.read_text()) if path.exists() else 0


def test_numbers_pictures_and_what_they_depend_on_reach_the_documentation(desk):
    folder = desk()
    assert main(Arguments()) == 0
    table = json.loads((folder / "found.json").read_text())
    assert table["rows"] == [["lab", [25.0, 20.0, 30.0]]]
    assert (table["commit"], table["machine"]) == ("abc1234", "2 cores, no GPU")
    whole = json.loads((folder / "whole" / "one.json").read_text())
    assert len(table["depends"]) == 12
    assert whole["depends"].keys() == depends(results.STUDIES["one"]).keys()
    assert (folder / "shown.png").read_bytes() == b"picture"


def test_only_what_is_stale_is_run_unless_it_is_named(desk, monkeypatch):
    folder = desk()
    assert "no record" in why_stale("one")
    main(Arguments())
    assert why_stale("one") == ""
    main(Arguments())
    assert n_runs(folder) == 1
    main(Arguments(only=("one",)))
    assert n_runs(folder) == 2
    kept = results.code_of
    monkeypatch.setattr(results, "code_of", lambda text: kept(text) + b"changed")
    assert "benchmarks/occlusion.py" in why_stale("one")
    main(Arguments())
    assert n_runs(folder) == 3


def test_a_run_that_is_out_of_time_is_stopped_and_goes_on(desk):
    folder = desk(60.0)
    main(Arguments(hours=5.0 / 3600))
    assert n_runs(folder) == 1
    assert not (folder / "whole").exists()
    spent = json.loads((folder / "out" / "one" / "depends.json").read_text())["minutes"]
    desk(0.0)
    main(Arguments())
    assert n_runs(folder) == 2
    assert json.loads((folder / "whole" / "one.json").read_text())["minutes"] > spent > 0


@pytest.mark.parametrize("goes_on", [True, False])
def test_how_long_a_study_takes_is_what_it_takes_from_nothing(desk, goes_on):
    folder = desk(goes_on=goes_on)
    (folder / "whole").mkdir()
    whole = folder / "whole" / "one.json"
    whole.write_text(json.dumps({"minutes": 42.0}))  # parts of that run may be used again
    main(Arguments())
    took = results.expected_min("one")
    assert took == 42.0 if goes_on else took < 1.0
    mark = folder / "out" / "one" / "depends.json"
    mark.write_text(json.dumps(json.loads(mark.read_text()) | {"minutes": 60.0}))
    main(Arguments(only=("one",)))
    took = results.expected_min("one")
    assert took > 60.0 if goes_on else took < 1.0


def test_what_does_not_stop_when_asked_is_killed(desk):
    folder = desk(60.0)
    script = folder / "made.py"
    script.write_text(
        "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)\n" + script.read_text()
    )
    main(Arguments(hours=5.0 / 3600))
    assert n_runs(folder) == 1
    assert not (folder / "whole").exists()


def test_what_keeps_nothing_is_not_begun_without_the_time_for_it(desk):
    folder = desk(goes_on=False, minutes=60)
    main(Arguments(hours=0.5))
    assert n_runs(folder) == 0
    main(Arguments(hours=1.5))
    assert n_runs(folder) == 1


@pytest.mark.parametrize("is_keyed", [True, False])
def test_what_does_not_say_by_what_it_was_made_is_made_anew(desk, is_keyed):
    folder = desk(is_keyed=is_keyed)
    main(Arguments())
    mark = folder / "out" / "one" / "depends.json"
    mark.write_text(mark.read_text().replace(depends(results.STUDIES["one"])["command"], "old"))
    main(Arguments(only=("one",)))
    assert n_runs(folder) == (2 if is_keyed else 1)


def test_numbers_of_a_tree_with_changes_are_refused_or_marked(desk, monkeypatch, capsys):
    folder = desk()
    monkeypatch.setattr(results, "provenance", lambda: {"git": "abc1234+changes"})
    assert main(Arguments()) == 2
    assert "clean commit" in capsys.readouterr().out
    assert n_runs(folder) == 0
    assert main(Arguments(dirty=True)) == 0


def test_a_short_form_says_which_metrics_are_missing(desk, capsys):
    folder = desk(quick="--quick")
    assert main(Arguments(quick=True)) == 0
    (folder / "found.json").write_text(json.dumps(TABLE | {"keys": [["site"]]}))
    assert main(Arguments(quick=True)) == 1
    assert "missing ['found.site']" in capsys.readouterr().out


def test_what_is_said_of_code_does_not_count():
    before = results.code_of("X = 1\ndef f():\n    return X\n")
    assert (
        results.code_of('"""Of X."""\nX =  1  # one\n"""Of f."""\ndef f():\n    "f"\n    return X')
        == before
    )
    assert results.code_of('X = "1"\ndef f():\n    return X\n') != before


def test_a_study_depends_on_what_it_imports_and_not_on_command_lines():
    found = depends(STUDIES["tracking"])
    assert {"benchmarks/tracking", "hrc_env/tracking", "assets/workers", "command"} <= found.keys()
    for study in STUDIES.values():
        assert "hrc_env/cli" not in depends(study)
        assert "constraints.txt" in depends(study)
    assert "hrc_env/sb3.py" not in found
    assert "hrc_env/sb3.py" in depends(STUDIES["baselines"])
    assert "hrc_env/tracking" not in depends(STUDIES["occlusion"])


def test_every_file_of_results_is_one_studys():
    files = [name for study in STUDIES.values() for name in study.tables]
    assert sorted(files) == sorted(path.stem for path in tables.RESULTS.glob("*.json"))
    for name, study in STUDIES.items():
        assert all(tables.read(each)["command"] == study.command for each in study.tables), name


def test_the_plan_names_every_study_and_sums_what_is_stale():
    console = Console(width=120, record=True, file=sys.stderr)
    console.print(results.plan({"occlusion": "", "impact": "hrc_env/tracking"}))
    said = console.export_text()
    assert "stale: hrc_env/tracking" in said
    assert "fresh" in said
    assert f"{results.spoken(results.expected_min('impact'))} for what is stale" in said
