"""Docstrings and pages are written in the field's plain English, and no change makes them worse."""

import sys
import tomllib

import pytest

from tests import language
from tests.language import LIMITS, PAGES, ROOT, Count, compare, find_slack, format_limits

PLAIN = "Return the distance between robot and worker [m]."
IDIOM = {
    "what": "What the camera sees.",
    "who": "Return nobody that a camera detects.",
    "so_near": "Distance from which workers are so near.",
    "told": "Deviation that the tracker is told.",
    "half": "of the camera,",
}


def count(*texts: str) -> Count:
    counted = Count()
    for text in texts:
        counted.add(text, is_docstring=True)
    return counted


def test_no_count_is_above_its_limit():
    """If this fails, rewrite some of: python -m tests.language --worst 40"""
    texts = language.read_texts(ROOT)
    counts = {name: count(*(text.text for text in texts[name])) for name in texts}
    assert compare(counts, tomllib.loads(LIMITS.read_text())) == []


@pytest.mark.parametrize("name", IDIOM)
def test_idiom_in_a_docstring_is_above_the_limit(name, tmp_path, monkeypatch, capsys):
    for folder in language.FOLDERS:
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "module.py").write_text(f'"""{PLAIN}"""\n')
    (tmp_path / "docs").mkdir()
    (tmp_path / "README.md").write_text(PLAIN)
    limits = tmp_path / "language.toml"
    limits.write_text("")
    monkeypatch.setattr(language, "ROOT", tmp_path)
    monkeypatch.setattr(language, "LIMITS", limits)
    assert run("--lower", monkeypatch) == 0
    assert run("", monkeypatch) == 0
    module = tmp_path / "agents" / "module.py"
    module.write_text(f'"""{PLAIN}"""\nLIMIT = 1.0\n"""{IDIOM[name]}"""\n')
    capsys.readouterr()
    assert run("--worst 1", monkeypatch) == 1
    printed = capsys.readouterr().out
    assert f'agents: "{name}" has' in printed
    assert f"{module}:3: {IDIOM[name]}" in printed
    assert run("--lower", monkeypatch) == 0
    assert run("", monkeypatch) == 1, "a limit was raised"


def run(words: str, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr(sys, "argv", ["language", *words.split()])
    return language.main()


def test_pages_are_counted_outside_of_code_tables_and_generated_blocks(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "Title of a page\n\n"
        "```python\nwhat = said\n```\n\n"
        "| what | who |\n|---|---|\n| told | nobody |\n\n"
        "<!-- results: speed -->\nwhat nobody said\n<!-- end of results -->\n\n"
        "The option `--what` <!-- number: what -->3<!-- end --> is\nwhat nobody knows.\n"
    )
    title, prose = language.read_paragraphs(page)
    assert title.text == "Title of a page"
    assert prose.text == "The option 3 is what nobody knows."
    assert prose.place == f"{page}:15"
    assert count(prose.text).found == {"what": 1, "who": 1, "so_near": 0, "told": 0, "half": 0}


def test_a_limit_far_above_its_count_is_to_be_lowered_and_never_raised():
    counts = {"agents": count(PLAIN), PAGES: count(*IDIOM.values())}
    limits = {"agents": {"what": 0.2, "who": 5.0}, PAGES: {"what": 1.0}}
    assert find_slack(counts, limits) == ['agents: "who" fell to 0, and its limit is 5.']
    lowered = tomllib.loads(format_limits(counts, limits))
    assert lowered["agents"]["who"] == lowered["agents"]["what"] == 0.0
    assert lowered[PAGES]["what"] == 1.0


@pytest.mark.parametrize("text", [PLAIN, "Cells so large that all fit.", "Whether it is as told."])
def test_whole_sentences_are_no_half_ones(text):
    assert not language.is_half(text)
