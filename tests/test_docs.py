"""README and docs stay true: generated parts are up to date, code runs, links lead somewhere."""

import importlib.util
import io
import math
import pydoc
import re
from contextlib import redirect_stdout, suppress
from functools import cache
from pathlib import Path

import pytest

from benchmarks import __main__ as benchmarks
from benchmarks import results
from docs import generate, tables
from hrc_env.__main__ import main
from hrc_env.tasks import BUILT_IN

ROOT = Path(__file__).resolve().parent.parent
README = ROOT / "README.md"
LEADERBOARD = ROOT / "docs" / "reference" / "leaderboard.md"
WRITTEN = [*generate.PAGES, ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
PAGES = [*WRITTEN, *generate.REFERENCE]
PYTHON = re.compile(r"(<!-- not run: [^>]*-->\n)?```python\n(.*?)```", re.S)
HASH = re.compile(r"\b(?=[0-9a-f]*[a-f])(?=[0-9a-f]*[0-9])[0-9a-f]{7,40}\b")


def by_hand(page: Path) -> str:
    """What of a page is written by hand."""
    text = page.read_text()
    for generated in tables.GENERATED:
        text = generated.sub("", text)
    return text


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("page", generate.REFERENCE, ids=name_of)
def test_the_reference_is_what_the_code_says(page):
    """If this fails: python -m docs.generate"""
    assert page.read_text() == generate.REFERENCE[page]()


@pytest.mark.parametrize("page", generate.PAGES, ids=name_of)
def test_tables_are_those_of_the_results(page):
    """If this fails: python -m docs.generate"""
    assert page.read_text() == tables.filled(page.read_text())


def test_every_table_is_shown_with_where_it_comes_from():
    shown = set()
    for page in generate.PAGES:
        names = [found["name"] for found in tables.BLOCK.finditer(page.read_text())]
        assert bool(names) == bool(tables.PROVENANCE.search(page.read_text())), page
        shown |= set(names)
    assert shown == set(tables.names())


def test_the_baselines_are_in_the_readme_and_in_learning():
    for page in (README, ROOT / "docs" / "learning.md"):
        text = page.read_text()
        assert "| `pixels` | PPO with it |" in text
        assert tables.filled(text.replace("| `random` |", "| `other` |")) == text


FILES = sorted(path.stem for path in tables.RESULTS.glob("*.json"))
"""Tables whose columns stand beside their numbers; of the others experiments declare them."""


def results_of(name: str, path: Path) -> Path:
    """A results.json with all that a file needs."""
    metric = {"value": 1.0, "low": 0.5, "high": 2.0, "unit": "1", "n": 3}
    metrics = dict.fromkeys(tables.asked(name), metric)
    content = {"hrc_env": "0.2.0", "depends": {"env": 3}, "machine": {"cores": 2}}
    path.write_text(tables.written({**content, "metrics": metrics}))
    return path


@pytest.mark.parametrize("name", FILES)
def test_a_file_is_renewed_from_what_its_command_wrote(name, tmp_path):
    table = tables.read(name)
    renewed = tables.renewed(table, results_of(name, tmp_path / "results.json"))
    assert (renewed["version"], renewed["depends"]) == ("0.2.0", {"env": 3})
    old, new = ([sum(cell is None for cell in row) for row in each["rows"]] for each in
                (table, renewed))  # fmt: skip
    assert old == new
    numbers = [each["value"] for each in renewed.get("numbers", {}).values()]
    cells = [cell for row in renewed["rows"] for cell in row if isinstance(cell, list)]
    for value, low, high in cells + [each for each in numbers if isinstance(each, list)]:
        assert low <= value <= high
        assert {abs(value)} <= {1.0, 100.0, 1000.0} or name == "site"


@pytest.mark.parametrize("name", FILES)
def test_every_number_of_a_file_has_its_metric(name):
    """What is not measured is a text, or stands in a row without a key."""
    table = tables.read(name)
    keys = table.get("keys", [()] * len(table["rows"]))
    by_hand = [
        (column["name"], cell)
        for key, row in zip(keys, table["rows"], strict=True)
        for column, cell in zip(table["columns"], row, strict=True)
        if key is not None and "metric" not in column and isinstance(cell, int | float | list)
    ]
    assert by_hand == []
    assert all("metric" in number for number in table.get("numbers", {}).values())


def test_a_metric_that_a_command_does_not_write_is_missed(tmp_path):
    path = results_of("lab", tmp_path / "results.json")
    path.write_text(path.read_text().replace("error_m.particle.multi.all.median", "other"))
    with pytest.raises(KeyError, match=r"error_m\.particle\.multi\.all\.median"):
        tables.renewed(tables.read("lab"), path)


def test_a_table_that_an_experiment_declares_has_the_numbers_of_its_last_run():
    table, whole = tables.read("shielded"), results.whole("shielded")
    assert not (tables.RESULTS / "shielded.json").exists()
    assert [cell for row in table["rows"] for cell in row[2:]].count(None) == 0
    four = whole["metrics"]["four.share"]
    assert table["rows"][1][1] == four["n"]
    assert table["rows"][1][2][0] == pytest.approx(100 * four["value"], abs=1e-3)
    assert table["depends"] == whole["depends"]
    assert "four.share" in tables.asked("shielded")
    with pytest.raises(KeyError, match="no experiment declares 'shields'"):
        tables.read("shields")
    with pytest.raises(SystemExit, match=r"no docs/results/shielded.json to renew"):
        generate.main(["--renew", "shielded", "out/shielded/results.json"])


def test_cells_are_intervals_counts_and_pairs():
    metrics = {"a": {"value": 0.25, "low": 0.2, "high": 0.5, "n": 8},
               "b": {"value": math.nan, "low": 0.0, "high": 0.0, "n": 0}}  # fmt: skip
    columns = [
        {"name": "interval", "digits": 1, "metric": "a", "factor": 100},
        {"name": "plain", "digits": 2, "metric": "{0}", "plain": True},
        {"name": "less", "digits": 1, "metric": "a", "factor": -1},
        {"name": "count", "metric": "a", "form": "count"},
        {"name": "n", "metric": "a", "form": "n"},
        {"name": "pair", "metric": "a", "beside": "a", "factor": 100},
        {"name": "unknown", "metric": "b"},
    ]
    row = [tables._measured(metrics, column, 0.0, ["a"]) for column in columns]
    assert row[:3] == [[25.0, 20.0, 50.0], [0.25, 0.2, 0.5], [-0.25, -0.5, -0.2]]
    assert row[3:] == ["2 of 8", 8, "25 (25)", None]
    table = {"title": "T", "columns": columns, "rows": [row]}
    shown = "| 25.0 (20.0 to 50.0) | 0.25 | -0.2 (-0.5 to -0.2) | 2 of 8 | 8 | 25 (25) |  |"
    assert shown in tables.markdown(table)


INTERVAL = re.compile(r"\((-?[\d,.]+)(?: to |-)(-?[\d,.]+)\)")


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_no_interval_has_no_width(page):
    """Zero contacts in some minutes do not say that there are none."""
    lines = page.read_text().splitlines()
    wrong = [line for line in lines for low, high in INTERVAL.findall(line) if low == high]
    assert wrong == []


def test_counts_stand_with_their_intervals():
    counted = [
        (name, column, cell)
        for name in tables.names()
        for k, column in enumerate(tables.read(name)["columns"])
        for cell in (row[k] for row in tables.read(name)["rows"])
        if "contact" in column["name"] or column.get("unit") == "in 1,000"
    ]
    assert len({name for name, _, _ in counted}) >= 7
    for name, column, cell in counted:
        assert column["counted"], (name, column)
        assert INTERVAL.search(tables._cell(cell, column, intervals=False)), (name, cell)


def test_the_leaderboard_shows_no_count_without_its_interval():
    rows = [line for line in generate.REFERENCE[LEADERBOARD]().splitlines() if "| 64 |" in line]
    assert len(rows) > 30
    for row in rows:
        assert all(INTERVAL.search(cell) for cell in row.split("|")[-3:-1]), row


@pytest.mark.parametrize("name", FILES)
def test_a_file_holds_what_its_study_found_last(name):
    """If this fails: a number was changed by hand, or the study's are newer; make results."""
    owners = [key for key, each in results.COMMANDS.items() if name in each.tables]
    assert len(owners) == 1, f"{name}: name it in one of STUDIES, benchmarks/studies.py"
    study = owners[0]
    table, found = tables.read(name), results.whole(study)
    if found:
        assert table["command"] == found["command"]
        renewed = tables.renewed(table, results.WHOLE / f"{study}.json")
        for part in ("rows", "numbers", "commit"):
            assert table.get(part) == renewed.get(part), part


def test_every_picture_is_made_by_a_command():
    made = {name for command in results.COMMANDS.values() for name in command.pictures}
    drawn = re.findall(r"^([\w.]+\.(?:jpg|png)) ", (ROOT / "docs" / "make_pictures.py").read_text(),
                       re.M)  # fmt: skip
    assert made.isdisjoint(drawn)
    films = {f"{task_id}.webp" for task_id in BUILT_IN}
    assert made | {*drawn} | films == {path.name for path in results.PICTURES.iterdir()}
    sizes = [(results.PICTURES / each).stat().st_size for each in films]
    assert max(sizes) < 3e6


@pytest.mark.parametrize("page", WRITTEN, ids=name_of)
def test_no_commit_stands_in_prose(page):
    assert HASH.findall(by_hand(page)) == []


def test_the_documentation_is_short():
    assert len(README.read_text().splitlines()) <= 150
    docs = [page for page in generate.PAGES if page != README]
    assert sum(len(by_hand(page).split()) for page in docs) <= 14_000
    assert len((ROOT / "CHANGELOG.md").read_text().split("## 0.1.0")[1].split()) <= 500


def anchors(page: Path) -> set[str]:
    """Of a page's sections, as GitHub makes them."""
    heads = re.findall(r"^#+ (.*)$", page.read_text(), re.M)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_somewhere(page):
    text = page.read_text()
    for target, section in re.findall(r"\]\(([^)#\s]*)(?:#([^)]*))?\)", text):
        if not target.startswith("http"):
            path = page.parent / target if target else page
            assert path.exists(), f"{page.name} -> {target}"
            assert not section or section in anchors(path), f"{page.name} -> {target}#{section}"


@pytest.mark.usefixtures("brought")  # so that what pages register is gone afterwards
@pytest.mark.parametrize("page", [*generate.PAGES, *generate.REFERENCE], ids=name_of)
def test_code_runs(page):
    """The blocks of a page, one after the other, as a reader would type them; files of examples
    that a page shows are imported before."""
    names = {}
    for skipped, code in PYTHON.findall(tables.EXAMPLE.sub("", page.read_text())):
        if not skipped:
            exec(compile(code, page.name, "exec"), names)


def test_commands_of_the_readme_exist():
    text, makefile = README.read_text(), (ROOT / "Makefile").read_text()
    for goal in re.findall(r"\bmake ([a-z][\w-]+)`", text) + re.findall(
        r"^make ([\w-]+)", text, re.M
    ):
        assert re.search(rf"^{goal}:", makefile, re.M), goal


ROOMS = ("", "hrc_env", "hrc_env/tracking")
"""Where the paths that pages name begin."""


@pytest.mark.parametrize("page", WRITTEN, ids=name_of)
def test_files_that_a_page_names_exist(page):
    named = re.findall(r"`((?:\w+/)*\w+\.py|(?:hrc_env|assets|tests|benchmarks|examples)/[\w/.]*)`",
                       by_hand(page))  # fmt: skip
    assert [
        path for path in named if not any((ROOT / room / path).exists() for room in ROOMS)
    ] == []


@pytest.mark.parametrize("page", WRITTEN, ids=name_of)
def test_names_of_modules_and_what_is_in_them_exist(page):
    for name in re.findall(r"`(hrc_env(?:\.\w+)+)`", by_hand(page)):
        assert pydoc.locate(name) is not None, name


def test_what_a_page_says_is_in_a_file_is_in_it():
    said = [
        pair
        for page in WRITTEN
        for pair in re.findall(r"`([\w.]+)` in `([\w/]+\.py)`", by_hand(page))
    ]
    assert ("Simulation.step", "hrc_env/simulation.py") in said
    for name, path in said:
        assert re.search(rf"\b{name.split('.')[-1]}\b", (ROOT / path).read_text()), (name, path)


@pytest.mark.parametrize("study", results.COMMANDS)
def test_what_measured_a_table_can_be_called(study):
    command = results.COMMANDS[study].command
    module, script = re.match(r"python (?:-m ([\w.]+)|([\w/]+\.py))", command).groups()
    assert (ROOT / script).exists() if script else importlib.util.find_spec(module)


@cache
def options_of(program: str, *words: str) -> set[str]:
    """What a command's help lists."""
    out = io.StringIO()
    with redirect_stdout(out), suppress(SystemExit):
        {"hrc_env": main, "benchmarks": benchmarks.main}[program]([*words, "--help"])
    return set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", out.getvalue()))


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_options_that_a_page_names_exist(page):
    calls = r"python -m (hrc_env|benchmarks) (?:--import \S+ )?([a-z-]+)([^`#\n]*)"
    for program, command, line in re.findall(calls, page.read_text()):
        which = re.match(r" (\w+)", line) if command == "experiment" else None
        known = options_of(program, command, *which.groups() if which else ())
        assert {*re.findall(r" (--[a-z-]+)", line)} <= {*known, "--import"}, (command, line)


UNIT = (
    r"(?:(?:mm|cm|m|km|s|ms|us|min|h|px|Hz|rad|kB|MB|GB|degrees?|times|steps|frames|images|resets"
    r"|episodes|goals|contacts|seconds|minutes|hours)\b|%)"
)
ONE = r"\d+(?:,\d{3})*(?:\.\d+)?"
AMOUNT = rf"(?<![\w.^-]){ONE}(?:(?: to | x | or |-){ONE})*"
MEASURED_LOOKING = re.compile(
    rf"{AMOUNT} ?{UNIT}|{AMOUNT} of (?:the )?{ONE}|factor of {ONE}|{AMOUNT} \({ONE} to"
)
SETTINGS = {
    # Other people's packages; the rate of contacts that was asked for (PriceConfig.level).
    "README.md": "1.1 GB, 2.0 GB, 5.8 GB, 30 times, 1,000 episodes, 10.8 times",
    "third_party_perception.md": "41 MB, 59 MB, 180 MB",
    "architecture.md": "1 s",
    "conventions.md": "0.04 s",
    "start.md": "250 steps, 0.04 s, 25 frames",
    "experiments.md": "72 degrees, 0.9 m, 0 to 320 ms, 5 %, 95 %, 25 images",
    "many_environments.md": "8 ms",
    "people_and_scenes.md": (
        "0.4 to 0.8 s, 1.55 to 1.92 m, 6.1 x 5.5 x 2.6 m, 20 x 20 m, 5 m, 2.5 x 4.0 m, "
        "11.6 x 12.3 m, 0.6 m, 120 Hz, 1.3 to 2.2 m, 0.25 s, 5 to 1000 Hz, 0.5 s, 20 s, "
        "1 to 4 degrees, 8 cm, 0.7 s, 6 cm, "
        "2.5 to 3.5 m, 3 m, 2.4 m, 0.6 s, 0.9 s, 50 degrees, 15 to 40 s, 40 degrees"
    ),
    "perception_and_estimators.md": (
        "80 degrees, 118.2 degrees, 0.2 s, 0.02 rad, 0.05 m, 0.1 rad, 0.04 s, 8 px"
    ),
    "tracking.md": "1 s, 2 cm, 10 %, 20 degrees, 25 degrees, 50 degrees, 0.5 m, 2 ms, 0.1 s",
}
"""Sizes, limits and defaults by page: numbers with a unit that nobody measured of this project."""
BOUNDS = {
    "emulator.md": "15 %",
    "learning.md": "120,000 steps, 80 %",
    "people_and_scenes.md": "30 to 35 %, 6 to 25 %",
    "perception_and_estimators.md": "90 %, 95 %",
    "tracking.md": "0.3 m, 0.4 s, 1 m, 2.5 %, 5 %, 75 %",
}
"""Bounds by page, which `tests/properties/` holds."""


@pytest.mark.parametrize("page", generate.PAGES, ids=name_of)
def test_numbers_in_sentences_come_from_results(page):
    """If this fails: a measured number is drawn from `docs/results/` (docs/tables.py); a setting
    goes to SETTINGS."""
    said = re.sub(r"```.*?```|`[^`\n]*`", "", by_hand(page), flags=re.S)
    found = {" ".join(each.split()) for each in MEASURED_LOOKING.findall(said)}
    stated = (SETTINGS.get(page.name, ""), BOUNDS.get(page.name, ""))
    known = {each for text in stated for each in text.split(", ") if each}
    assert found - known == set()
    assert known - found == set(), "no longer said"


def test_numbers_that_look_measured_are_found():
    text = "13.6 mm, 32 %, 4,500 steps/s, 40 (29 to 51) stops, 8 of 8, 5 to 12 times, a factor of 7"
    assert MEASURED_LOOKING.findall(text) == [
        "13.6 mm", "32 %", "4,500 steps", "40 (29 to", "8 of 8", "5 to 12 times", "factor of 7",
    ]  # fmt: skip
    assert MEASURED_LOOKING.findall("15 joints, four cameras, Algorithm 1, 1280 x 720") == []


def test_a_number_of_a_sentence_is_filled_in():
    page = "<!-- number: speed_organs.reset_one -->99<!-- end --> ms a reset"
    table = tables.read("speed_organs")
    assert tables.filled(page) == page.replace("99", tables.said(table, "reset_one"))
    assert table["numbers"]["reset_one"]["metric"] == "reset_ms.1_of_1"
