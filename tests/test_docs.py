"""README and docs stay true: generated parts are up to date, code runs, links lead somewhere."""

import importlib.util
import pydoc
import re
from pathlib import Path

import pytest

from docs import generate, tables

ROOT = Path(__file__).resolve().parent.parent
README = ROOT / "README.md"
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
    assert shown == {path.stem for path in tables.RESULTS.glob("*.json")}


def test_the_baselines_are_in_the_readme_and_in_learning():
    for page in (README, ROOT / "docs" / "learning.md"):
        text = page.read_text()
        assert "| `pixels` | PPO with it |" in text
        assert tables.filled(text.replace("| `random` |", "| `other` |")) == text


def test_a_table_is_renewed_from_what_its_command_wrote(tmp_path):
    metric = {"value": 1.0, "low": 0.5, "high": 2.0, "unit": "1", "n": 3}
    table = tables.read("baselines")
    names = {
        column["metric"].format(*key): metric
        for column in table["columns"]
        for key in table["keys"]
        if "metric" in column
    }
    path = tmp_path / "results.json"
    path.write_text(tables.written({"git": "abc", "metrics": names}))
    renewed = tables.renewed(table, path)
    assert renewed["commit"] == "abc"
    assert renewed["rows"][0] == ["`truth`", "`random`", *[[1.0, 0.5, 2.0]] * 4]
    assert "| `truth` | `random` | 1.0 (0.5 to 2.0) |" in tables.markdown(renewed)


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


@pytest.mark.parametrize("page", [*generate.PAGES, *generate.REFERENCE], ids=name_of)
def test_code_runs(page):
    """The blocks of a page, one after the other, as a reader would type them."""
    names = {}
    for skipped, code in PYTHON.findall(page.read_text()):
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


@pytest.mark.parametrize("path", sorted(tables.RESULTS.glob("*.json")), ids=lambda path: path.stem)
def test_what_measured_a_table_can_be_called(path):
    command = tables.read(path.stem)["command"]
    module, script = re.match(r"python (?:-m ([\w.]+)|([\w/]+\.py))", command).groups()
    assert (ROOT / script).exists() if script else importlib.util.find_spec(module)


@pytest.mark.parametrize("page", generate.PAGES, ids=name_of)
def test_options_that_a_page_names_exist(page):
    known = (ROOT / "docs" / "reference" / "command_line.md").read_text()
    for line in re.findall(r"python -m hrc_env [^`#\n]*", page.read_text()):
        for option in re.findall(r" (--[a-z-]+)", line):
            assert f"`{option}`" in known or option == "--import", line
