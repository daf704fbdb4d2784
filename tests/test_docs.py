"""README and docs stay true: snippets run, generated pages are up to date, links lead somewhere."""

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def test_the_ten_lines_of_the_readme_run():
    snippet = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.S)
    assert snippet is not None
    exec(compile(snippet.group(1), "README.md", "exec"), {})


def generator():
    """docs/generate.py"""
    spec = importlib.util.spec_from_file_location("generate", ROOT / "docs" / "generate.py")
    assert spec is not None
    assert spec.loader is not None
    generate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generate)
    return generate


def test_the_environment_page_is_what_the_code_says():
    """If this fails: python docs/generate.py"""
    generate = generator()
    assert generate.PAGE.read_text() == generate.page()


@pytest.mark.parametrize("name", ["README.md", "docs/learning.md"])
def test_the_baselines_are_those_of_the_committed_results(name):
    """If this fails: python docs/generate.py"""
    generate, text = generator(), (ROOT / name).read_text()
    assert ROOT / name in generate.WITH_BASELINES
    assert "| `pixels` | PPO with it |" in text
    assert generate.with_baselines(text) == text
    assert generate.with_baselines(text.replace("| `random` |", "| `other` |")) == text


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_to_files_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)\)", page.read_text()):
        if not target.startswith("http"):
            assert (page.parent / target).exists(), f"{page.name} -> {target}"


def test_commands_of_the_readme_exist():
    text, makefile = (ROOT / "README.md").read_text(), (ROOT / "Makefile").read_text()
    for goal in re.findall(r"^make ([\w-]+)", text, re.M):
        assert re.search(rf"^{goal}:", makefile, re.M), goal
