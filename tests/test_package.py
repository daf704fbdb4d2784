"""What the package says of itself: ranges of versions, metadata, the forms of a repository."""

import os
import subprocess
import sys
import tomllib
from importlib.metadata import requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import hrc_env

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
CORE = {each.name: each for each in map(Requirement, PROJECT["dependencies"])}


def pins(name: str) -> dict[str, str]:
    """Versions by package that a file of constraints names."""
    lines = (ROOT / name).read_text().lower().splitlines()
    return dict(line.split("==") for line in lines if "==" in line and not line.startswith("#"))


@pytest.mark.parametrize("name", ["constraints.txt", ".github/oldest.txt"])
def test_what_is_tested_is_within_the_ranges(name):
    tested = pins(name)
    assert set(CORE) <= set(tested)
    for each in CORE.values():
        assert each.specifier.contains(tested[each.name]), each


def test_the_oldest_that_is_admitted_is_the_oldest_that_is_tested():
    oldest = pins(".github/oldest.txt")
    for each in CORE.values():
        (least,) = [one.version for one in each.specifier if one.operator == ">="]
        assert f"{oldest[each.name]}.".startswith(f"{least}."), each


def test_an_upper_bound_names_the_test_that_shows_the_break():
    for line in (ROOT / "pyproject.toml").read_text().partition("[project.optional")[0].split("\n"):
        if ",<" in line:
            shown = line.partition("# ")[2].split(": ")[-1]
            assert (ROOT / shown).is_file(), line


def test_gymnasium_beside_rllib_is_admitted():
    """ray[rllib] 2.60 pins 1.2.2."""
    assert CORE["gymnasium"].specifier.contains("1.2.2")
    assert requires("hrc_env") is not None


def test_the_version_is_the_same_everywhere():
    assert PROJECT["version"] == hrc_env.__version__
    assert f"\nversion: {PROJECT['version']}\n" in (ROOT / "CITATION.cff").read_text()


def test_authors_urls_and_pythons_are_named():
    (author,) = PROJECT["authors"]
    assert f"- name: {author['name']}" in (ROOT / "CITATION.cff").read_text()
    home = PROJECT["urls"]["Homepage"]
    assert all(url.startswith(home) for url in PROJECT["urls"].values())
    for minor in range(11, 15):
        assert f"Programming Language :: Python :: 3.{minor}" in PROJECT["classifiers"]


OURS = ("agents", "assets", "benchmarks", "docs", "examples", "tests", "train")
"""Modules at the top of the checkout, beside the package."""


def test_no_other_module_of_ours_is_importable_outside_of_the_checkout(tmp_path: Path):
    code = f"""
import hrc_env, hrc_env.agents.registry
from importlib.util import find_spec
print([name for name in {OURS} if find_spec(name) is not None])
"""
    usual = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=usual, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert done.stdout == "[]\n"


def test_pytest_alone_finds_modules_that_only_the_checkout_has():
    """As `python -m pytest` does."""
    usual = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("PYTHONPATH", "PYTEST_"))
    }
    done = subprocess.run(
        [Path(sys.executable).with_name("pytest"), "--collect-only", "-q", "tests/test_docs.py",
         "tests/benchmarks/test_tracks.py", "tests/behaviour/test_mutations.py"],
        cwd=ROOT, env=usual, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
