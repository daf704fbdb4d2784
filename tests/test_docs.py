"""README and docs stay true: generated parts are up to date, code runs, links lead somewhere."""

import importlib.util
import io
import pydoc
import re
from contextlib import redirect_stdout, suppress
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from benchmarks import __main__ as benchmarks
from benchmarks import results
from docs import generate, tables
from hrc_env.__main__ import main
from hrc_env.core.errors import ConfigError
from hrc_env.tasks import BUILT_IN

ROOT = Path(__file__).resolve().parent.parent
README = ROOT / "README.md"
RESULTS = ROOT / "docs" / "results.md"
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
    for page in generate.PAGES:
        names = [found["name"] for found in tables.BLOCK.finditer(page.read_text())]
        assert bool(names) == bool(tables.PROVENANCE.search(page.read_text())), page
    whole = [found for found in tables.BLOCK.finditer(RESULTS.read_text()) if not found["head"]]
    assert sorted(found["name"] for found in whole) == tables.names()


def test_the_baselines_stand_whole_in_results_and_for_one_level_in_the_readme():
    level = "| `pixels` | PPO with the safety term |"
    text = RESULTS.read_text()
    assert level in text
    assert tables.filled(text.replace("| `random` |", "| `other` |")) == text
    rows = [line for line in README.read_text().splitlines() if line.startswith("| `keypoints` |")]
    assert len(rows) == 5
    assert level not in README.read_text()


def test_a_page_can_show_some_rows_of_a_table():
    block = "<!-- results: baselines where {} -->\n<!-- end of results -->"
    shown = tables.filled(block.format("agent is PPO with the safety term without intervals"))
    rows = [line for line in shown.splitlines() if line.startswith("| `")]
    assert len(rows) == 4
    assert all("| PPO with the safety term |" in row for row in rows)
    assert tables.filled(shown) == shown
    with pytest.raises(ConfigError, match=r"'levels'.*'perception', 'agent'"):
        tables.filled(block.format("levels is keypoints"))
    with pytest.raises(ConfigError, match=r"'keypoint'.*'truth', 'keypoints'"):
        tables.filled(block.format("perception is keypoint"))


def test_tables_of_several_commands_have_a_row_of_provenance_for_each():
    text = tables.provenance(["site", "impact", "lateness"])
    rows = [line for line in text.splitlines() if "`python -m" in line]
    assert [row.split("|")[1].count(";") for row in rows] == [0, 1]
    assert "`python -m hrc_env experiment site`" in rows[0]


NO_NUMBERS = re.compile(r'"(?:columns|heads|heading|digits|beside|title|note)":')
"""Keys of a table that is declared."""


def test_results_are_numbers_and_no_second_declaration_of_tables():
    """If this fails: a table is declared in its study, and here are the numbers that it found."""
    paths = [*tables.RESULTS.rglob("*.json")]
    assert len(paths) > 30
    assert {path.parent.name for path in paths} == {"whole", "parts", "leaderboard"}
    assert [path for path in paths if NO_NUMBERS.search(path.read_text())] == []


def test_a_table_is_declared_once():
    found = [
        (name, each)
        for command in results.COMMANDS.values()
        for name, each in command.declared_tables.items()
        if name in command.tables
    ]
    assert sorted(name for name, _ in found) == tables.names()
    for name, table in found:
        shown = [(each.metric, each.shows, each.beside) for each in table.columns]
        assert len(set(shown)) == len(shown), name


@pytest.mark.parametrize("name", tables.names())
def test_a_table_finds_a_number_for_every_column(name):
    """Of old numbers, columns that they lack are named below the table."""
    result = tables.read(name)
    missing = result.table.list_unmeasured(result.metrics)
    stale = tables.describe_stale(name, result)
    if not result.metrics:
        assert f"Not measured yet: `{result.command}`" in stale
        return
    assert all(column.heading in stale for column in missing)
    shown = [each for each in result.table.columns if each not in missing]
    replace(result.table, columns=shown).check(result.metrics)
    unknown = {each.metric for each in result.table.numbers.values()} - result.metrics.keys()
    assert unknown == set()
    assert result.table.printed.keys().isdisjoint(result.metrics)


def test_a_table_shows_the_numbers_of_the_last_run():
    result, whole = tables.read("shielded"), results.read_results("shielded")
    four = whole["metrics"]["four.share"]
    line = next(each for each in result.table.to_markdown(result.metrics).splitlines()
                if each.startswith("| four cameras |"))  # fmt: skip
    assert f"| four cameras | {four['n']:,} | {100 * four['value']:.1f} (" in line
    assert " - " not in line
    assert result.depends == whole["depends"]
    assert "four.share" in tables.asked("shielded")
    with pytest.raises(KeyError, match="No study declares the table 'shields'"):
        tables.read("shields")


INTERVAL = re.compile(r"\((-?[\d,.]+)(?: to |-)(-?[\d,.]+)\)")


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_no_interval_has_no_width(page):
    """Zero contacts in some minutes do not say that there are none."""
    lines = page.read_text().splitlines()
    wrong = [line for line in lines for low, high in INTERVAL.findall(line) if low == high]
    assert wrong == []


def test_counts_stand_with_their_intervals():
    """Also where a page shows no other intervals."""
    known = set()
    for name in tables.names():
        result = tables.read(name)
        missing = result.table.list_unmeasured(result.metrics)
        for column in result.table.columns:
            if name == "ranks":  # correlations
                continue
            if "contact" in column.heading or "[in 1,000]" in column.heading:
                assert column.counted, (name, column)
                if column in missing:
                    continue
                one = replace(result.table, columns=[column], numbers={}, note="")
                text = one.to_markdown(result.metrics, intervals=False)
                lines = [line for line in text.splitlines() if line.startswith("| ")]
                cells = [line.split("|")[-2] for line in lines[1:]]
                assert cells, (name, column)
                assert all(INTERVAL.search(each) for each in cells if each != " - "), (name, column)
                known.add(name)
    assert len(known) >= 5


def test_the_leaderboard_shows_no_count_without_its_interval():
    kinds = re.compile(r"\| (judged|public seeds|no digest) \|")
    rows = [line for line in generate.REFERENCE[LEADERBOARD]().splitlines() if kinds.search(line)]
    assert len(rows) > 30
    for row in rows:
        assert all(INTERVAL.search(cell) for cell in row.split("|")[-3:-1]), row


def test_every_picture_is_made_by_a_command():
    made = {
        name
        for study, command in results.COMMANDS.items()
        for name in command.pictures
        if results.read_results(study)
    }
    text = (ROOT / "docs" / "make_pictures.py").read_text()
    drawn = {*re.findall(r"^([\w.]+\.(?:jpg|png|webp)) ", text, re.M)} - {"ID.webp"}
    assert made.isdisjoint(drawn)
    films = {f"{task_id}.webp" for task_id in BUILT_IN}
    assert made | drawn | films == {path.name for path in results.PICTURES.iterdir()}
    sizes = [(results.PICTURES / each).stat().st_size for each in films]
    assert max(sizes) < 3e6


@pytest.mark.parametrize("page", WRITTEN, ids=name_of)
def test_no_commit_stands_in_prose(page):
    assert HASH.findall(by_hand(page)) == []


def count_words(text: str) -> int:
    """Bars of tables and signs between words are none."""
    return sum(bool(re.search(r"\w", each)) for each in text.split())


def test_the_documentation_is_short():
    assert len(README.read_text().splitlines()) <= 150
    docs = [page for page in generate.PAGES if page != README]
    assert sum(count_words(by_hand(page)) for page in docs) <= 15_000
    first = (ROOT / "CHANGELOG.md").read_text().split("\n## [0.1.0]")[1].split("\n## ")[0]
    assert len(first.split()) <= 500


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
    calls = r"python -m (hrc_env|benchmarks) (?:--import \S+ )?([a-z][a-z-]*)([^`#\n]*)"
    for program, command, line in re.findall(calls, page.read_text()):
        which = re.match(r" (\w+)", line) if command == "experiment" else None
        known = options_of(program, command, *which.groups() if which else ())
        assert {*re.findall(r" (--[a-z-]+)", line)} <= {*known, "--import"}, (command, line)


PYTHONS_OWN = ("An attempt has been made to start a new process",)
"""Errors of other programs that the page on problems quotes."""


def test_errors_that_the_page_on_problems_quotes_are_raised():
    files = [*(ROOT / "hrc_env").rglob("*.py"), *(ROOT / "agents").rglob("*.py")]
    source = "".join(re.sub(r'"\s*\n\s*f?"', "", path.read_text()) for path in files)
    page = (ROOT / "docs" / "troubleshooting.md").read_text()
    quotes = re.findall(r"^\*\*`([^`]+)`", page, re.M)
    parts = [part.strip(" :;") for quote in quotes for part in quote.split("...")]
    long = [part for part in parts if len(part) > 10 and part not in PYTHONS_OWN]
    assert len(long) > 5
    assert [part for part in long if part not in source] == []


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
    # Other people's packages.
    "README.md": "1.1 GB, 2.0 GB, 5.8 GB",
    "third_party_perception.md": "41 MB, 59 MB, 180 MB",
    "compare_estimator.md": "40 episodes, 95 %",
    "conventions.md": "0.04 s",
    "first_policy.md": "64 episodes, 95 %",
    "glossary.md": "0.05 m, 0.10 m, 0.15 m, 95 %",
    "start.md": "250 steps, 0.04 s",
    "experiments.md": "72 degrees, 0.9 m, 5 %, 25 images",
    "motion_capture.md": (
        "120 Hz, 1.3 to 2.2 m, 0.25 s, 5 to 1000 Hz, 0.5 s, 20 s, 1 to 4 degrees, 8 cm, 0.7 s, 6 cm"
    ),
    "results.md": "0.15 m, 95 %, 1,000 steps",
    "workers_and_scenes.md": (
        "0.4 to 0.8 s, 1.55 to 1.92 m, 6.1 x 5.5 x 2.6 m, 20 x 20 m, 5 m, 2.5 x 4.0 m, "
        "11.6 x 12.3 m, 0.6 m, 2.5 to 3.5 m, 2.4 m, 0.9 s, 15 to 40 s"
    ),
    "cameras.md": "80 degrees, 118.2 degrees, 0.2 s, 0.02 rad, 0.05 m, 0.1 rad, 0.04 s, 8 px",
    "tracking.md": (
        "1 s, 2 cm, 10 %, 95 %, 20 degrees, 25 degrees, 50 degrees, 0.05 rad, 0.014 to 0.14 rad, "
        "0.5 m"
    ),
}
"""Sizes, limits and defaults by page: numbers with a unit that nobody measured of this project."""
BOUNDS = {
    "emulator.md": "15 %",
    "learning.md": "120,000 steps, 80 %",
    "perception.md": "90 %, 95 %",
    "tracking.md": "0.3 m, 0.4 s, 1 m, 2.5 %, 5 %, 75 %",
    "workers_and_scenes.md": "30 to 35 %, 6 to 25 %",
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
    result = tables.read("speed_organs")
    said = result.table.format_number("reset_one", result.metrics)
    assert said == f"{result.metrics['reset_ms.1_of_1'].value:.1f}"
    assert tables.filled(page) == page.replace("99", said)
