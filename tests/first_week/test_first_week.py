"""Every script of this folder runs as a user would run it."""

from pathlib import Path

import pytest

SCRIPTS = sorted(Path(__file__).parent.glob("[0-9]*.py"))


@pytest.mark.parametrize("script", SCRIPTS, ids=[script.stem for script in SCRIPTS])
def test_a_script_of_the_first_week_runs(script, process, tmp_path):
    done = process(script, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
