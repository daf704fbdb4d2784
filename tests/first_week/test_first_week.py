"""What a researcher wants on the second day: every script of this folder runs."""

import os
from pathlib import Path

import pytest
from commands import ROOT

SCRIPTS = sorted(Path(__file__).parent.glob("[0-9]*.py"))
LONGEST_LINES = 60


@pytest.mark.parametrize("script", SCRIPTS, ids=[path.stem for path in SCRIPTS])
def test_a_script_of_the_first_week_does_what_it_says(script: Path, process, tmp_path) -> None:
    known = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    done = process(script, cwd=tmp_path, PYTHONPATH=known)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("script", SCRIPTS, ids=[path.stem for path in SCRIPTS])
def test_a_script_of_the_first_week_is_short(script: Path) -> None:
    assert len(script.read_text().splitlines()) <= LONGEST_LINES
