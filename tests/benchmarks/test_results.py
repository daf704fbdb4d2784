"""make results: what is stale is run, what is finished is kept, numbers reach their tables."""

import json
import os
import sys
from dataclasses import replace
from types import SimpleNamespace

import pytest
from rich.console import Console

from assets.emulator import shelf
from benchmarks import records, results
from benchmarks.replays import REPLAYS
from benchmarks.results import COMMANDS, STUDIES, Arguments, Command, explain_stale, main
from benchmarks.studies import Study, list_commands
from docs import tables
from hrc_env.core.errors import ConfigError
from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import Table

WRITES = """
import json, sys, time
from pathlib import Path
out = Path(sys.argv[sys.argv.index("--out") + 1])
(out / "figures").mkdir(parents=True, exist_ok=True)
(out / "figures" / "a.png").write_bytes(b"picture")
with open(out / "begun", "a") as begun:
    begun.write("x")
time.sleep(SECONDS)
metric = {"value": 0.25, "low": 0.2, "high": 0.3, "unit": "share", "n": 8}
content = {"hrc_env": "0.2.0", "machine": {"cores": 2}, "metrics": {"found.lab": metric}}
content["config"] = {"asked": 1}
(out / "parts").mkdir(exist_ok=True)
part = {"key": "k", "seconds": 1.0, "notes": {}, "part": {"x": [1.0, 2.0]}}
(out / "parts" / "lab.1.json").write_text(json.dumps(part))
(out / "results.json").write_text(json.dumps(content))
"""
TABLE = Table("found", "Found", {"lab": ("lab",)}, [Column("found.{}", "found [%]", 0, 100)])


def declare(monkeypatch, command):
    """Declare one study, of one command."""
    for known, one in ((STUDIES, Study({"one": command})), (COMMANDS, command)):
        for name in list(known):
            monkeypatch.delitem(known, name)
        monkeypatch.setitem(known, "one", one)


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A study of its own, and folders that are nobody's: a function to give it a duration."""
    for name, value in {
        "ROOT": results.ROOT, "OUT": tmp_path / "out", "QUICK_OUT": tmp_path / "quick",
        "WHOLE": tmp_path / "whole", "PICTURES": tmp_path, "STOPPING_S": 0.2,
    }.items():  # fmt: skip
        monkeypatch.setattr(results, name, value)
    monkeypatch.setattr(tables, "RESULTS", tmp_path)
    monkeypatch.setattr(results.generate, "main", lambda: None)
    monkeypatch.setattr(results, "provenance", lambda: {"git": "abc1234"})
    monkeypatch.setattr(results, "select_versions", lambda names: dict.fromkeys(names, 1))
    monkeypatch.setitem(sys.modules, "made_tables", SimpleNamespace(TABLES=[TABLE]))
    tables.declared.cache_clear()

    def study(seconds=0.0, **changes):
        script = tmp_path / "made.py"
        script.write_text(WRITES.replace("SECONDS", str(seconds)))
        made = Command(f"python {script}", 0.1, ("env",), ("found",), {"shown.png": "a.png"},
                       tables_in="made_tables")  # fmt: skip
        declare(monkeypatch, replace(made, **changes))
        return tmp_path

    return study


def n_runs(folder):
    path = folder / "out" / "one" / "begun"
    return len(path.read_text()) if path.exists() else 0


def test_numbers_pictures_and_what_they_depend_on_reach_the_documentation(desk):
    folder = desk()
    assert main(Arguments()) == 0
    result = tables.read("found")
    assert "| lab | 25 (20 to 30) |" in result.table.to_markdown(result.metrics)
    assert (result.version, result.machine) == ("0.2.0", "2 cores, no GPU")
    whole = json.loads((folder / "whole" / "one.json").read_text())
    assert result.depends == whole["depends"] == {"env": 1}
    assert (folder / "shown.png").read_bytes() == b"picture"
    assert tables.provenance(["found"]) == (
        f"*Measured by `{result.command}` on 2 cores, no GPU; version 0.2.0 (env 1), "
        f"{result.date}.*"
    )


def test_a_summary_of_every_part_of_the_latest_run_is_recorded(desk):
    folder = desk()
    old = folder / "out" / "one" / "parts" / "old.json"
    old.parent.mkdir(parents=True)
    old.write_text("{}")
    os.utime(old, (0, 0))
    main(Arguments())
    record = records.read("one")
    assert (record.depends, record.parts.keys()) == ({"env": 1}, {"lab.1"})
    assert record.parts["lab.1"].summary["x*"][:3] == [2, 2, 1.5]


def test_only_what_is_stale_is_run_unless_it_is_named(desk, monkeypatch):
    folder = desk()
    assert "no record" in explain_stale("one")
    main(Arguments())
    assert explain_stale("one") == ""
    main(Arguments())
    assert n_runs(folder) == 1
    main(Arguments(only=("one",)))
    assert n_runs(folder) == 2
    monkeypatch.setattr(results, "select_versions", lambda names: dict.fromkeys(names, 2))
    assert explain_stale("one") == "env 1 -> 2"
    main(Arguments())
    assert n_runs(folder) == 3
    declare(monkeypatch, replace(COMMANDS["one"], depends=("env", "shield")))
    assert explain_stale("one") == "shield not recorded -> 2"


def test_another_command_makes_a_study_stale(desk, monkeypatch):
    folder = desk()
    main(Arguments())
    command = COMMANDS["one"]
    declare(monkeypatch, replace(command, command=f"{command.command} --more"))
    assert explain_stale("one") == "another command"
    main(Arguments())
    assert n_runs(folder) == 2


def test_another_value_of_a_setting_makes_a_study_stale_and_another_name_does_not(
    desk, monkeypatch
):
    folder = desk()
    main(Arguments())
    path = folder / "whole" / "one.json"
    config = {"n_seeds": 10, "bench": {"levels": ["truth"], "old_name": 3}}
    path.write_text(json.dumps(json.loads(path.read_text()) | {"config": config}))
    now = {"n_seeds": 10, "bench": {"levels": ["truth"], "new_name": 3}, "added": 1}
    monkeypatch.setattr(results, "read_settings", lambda name: now)
    assert explain_stale("one") == ""
    now["bench"]["levels"] = ["truth", "none"]
    now["n_seeds"] = 9
    assert explain_stale("one") == 'n_seeds 10 -> 9, levels ["truth"] -> ["truth", "none"]'


def test_the_settings_of_a_command_are_called_as_its_results_call_them():
    for name, command in COMMANDS.items():
        if command.made is None or command.declared_tables:  # results are older than rows in them
            continue
        recorded, now = results.read_results(name).get("config"), results.read_settings(name)
        assert recorded is None or now.keys() & recorded.keys(), name


def test_a_part_that_came_out_otherwise_makes_a_study_stale_and_all_its_parts_anew(desk):
    folder = desk()
    main(Arguments())
    record = records.read("one")
    records.save("one", replace(record, spoiled={"lab.1": "x* has mean 2"}))
    assert explain_stale("one") == "replayed, part lab.1 differs: x* has mean 2"
    main(Arguments())
    assert n_runs(folder) == 1  # in a folder that was emptied
    assert explain_stale("one") == ""


def test_a_run_that_is_out_of_time_is_stopped_and_resumable(desk):
    folder = desk(60.0)
    main(Arguments(hours=5.0 / 3600))
    assert n_runs(folder) == 1
    assert not (folder / "whole").exists()
    spent = json.loads((folder / "out" / "one" / results.MARK).read_text())["minutes"]
    desk(0.0)
    main(Arguments())
    assert n_runs(folder) == 2
    assert json.loads((folder / "whole" / "one.json").read_text())["minutes"] > spent > 0


@pytest.mark.parametrize("is_resumable", [True, False])
def test_how_long_a_study_takes_is_what_it_takes_from_nothing(desk, is_resumable):
    folder = desk(is_resumable=is_resumable)
    (folder / "whole").mkdir()
    whole = folder / "whole" / "one.json"
    earlier = {"minutes": 42.0, "config": {"asked": 1}}  # parts of that run may be used again
    whole.write_text(json.dumps(earlier))
    main(Arguments())
    took = results.read_results("one")["minutes"]
    assert took == 42.0 if is_resumable else took < 1.0
    mark = folder / "out" / "one" / results.MARK
    mark.write_text(json.dumps(json.loads(mark.read_text()) | {"minutes": 60.0}))
    main(Arguments(only=("one",)))
    took = results.read_results("one")["minutes"]
    assert took > 60.0 if is_resumable else took < 1.0


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
    folder = desk(is_resumable=False, minutes=60)
    main(Arguments(hours=0.5))
    assert n_runs(folder) == 0
    main(Arguments(hours=1.5))
    assert n_runs(folder) == 1


def test_numbers_of_a_tree_with_changes_are_refused_or_marked(desk, monkeypatch, capsys):
    folder = desk()
    monkeypatch.setattr(results, "provenance", lambda: {"git": "abc1234+changes"})
    assert main(Arguments()) == 2
    assert "clean commit" in capsys.readouterr().out
    assert n_runs(folder) == 0
    assert main(Arguments(dirty=True)) == 0


def test_a_short_form_says_which_metrics_are_missing(desk, capsys):
    desk(quick="--quick")
    assert main(Arguments(quick=True)) == 0
    other = replace(TABLE, rows={"site": ("site",)})
    sys.modules["made_tables"].TABLES = [other]
    tables.declared.cache_clear()
    assert main(Arguments(quick=True)) == 1
    assert "missing ['found.site']" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("depends", "words"), [((), "got none"), (("envs",), "Unknown subsystem 'envs'")]
)
def test_a_study_that_names_no_subsystem_or_an_unknown_one_is_refused(depends, words):
    with pytest.raises(ConfigError, match=words):
        Command("python -m made", 1, depends)


def test_a_study_names_the_subsystems_that_its_parts_are_keyed_by():
    for name, command in COMMANDS.items():
        if command.made is not None:
            assert set(command.depends) == set(command.made.make(results.OUT / name).depends), name
    assert set(COMMANDS["trueness"].depends) == set(shelf.DEPENDS)


def test_every_study_can_be_replayed_or_keeps_no_parts():
    assert COMMANDS.keys() - REPLAYS.keys() == {
        "speed", "speed_tasks", "peers", "pixels", "cluster", "pictures",
    }  # fmt: skip
    assert REPLAYS.keys() <= COMMANDS.keys()


def test_every_table_is_one_studys_and_shows_its_last_run():
    for name, command in COMMANDS.items():
        assert {*command.tables} <= command.declared_tables.keys(), name
        for each in command.tables:
            made = results.read_results(name).get("command", command.command)
            assert tables.read(each).command == made, name
    whole = {path.stem for path in (tables.RESULTS / "whole").glob("*.json")}
    assert whole <= COMMANDS.keys()


def test_the_plan_names_every_study_and_sums_what_is_stale():
    console = Console(width=120, record=True, file=sys.stderr)
    console.print(results.make_plan({"site": "", "impact": "tracker 1 -> 2"}))
    said = console.export_text()
    assert "stale: tracker 1 -> 2" in said
    assert "fresh" in said
    assert "20 min for stale studies, 30 min for all" in said


def test_ten_studies_take_three_and_a_half_hours_without_trainings():
    assert len(STUDIES) <= 10
    assert sum(study.minutes for study in STUDIES.values()) <= 3.5 * 60
    assert len(COMMANDS) == sum(len(study.commands) for study in STUDIES.values())
    trained = {name for name, command in COMMANDS.items() if command.is_release}
    assert trained == {"learners", "limited", "price", "under_shield", "rare", "adversary"}


def test_a_name_of_a_study_stands_for_all_its_commands():
    assert list_commands(["perception", "trueness"]) == ("perception", "trueness")
    with pytest.raises(ConfigError, match="Unknown study 'fuzz'"):
        list_commands(["fuzz"])


def test_what_is_for_a_release_only_is_left_out(desk):
    folder = desk(is_release=True)
    main(Arguments())
    assert n_runs(folder) == 0
    main(Arguments(trainings=True))
    assert n_runs(folder) == 1


def test_other_settings_took_another_time(desk):
    folder = desk()
    (folder / "whole").mkdir()
    (folder / "whole" / "one.json").write_text(json.dumps({"minutes": 42.0, "config": {}}))
    main(Arguments())
    assert results.read_results("one")["minutes"] < 1.0


def test_consecutive_seeds_are_published_by_their_ends():
    """A list of 200,000 made a file of two megabytes."""
    assert results._shorten_seeds([7, 8, 9]) == {"first": 7, "last": 9}
    for seeds in ([], [7], [7, 9], [8, 7]):
        assert results._shorten_seeds(seeds) == seeds
