"""No kernel reads or writes past the end of an array."""

import subprocess
import sys

import pytest

from tests.behaviour.mutants import ROOT


@pytest.mark.slow
def test_every_index_of_kernels_is_within_its_array():
    command = [sys.executable, "-m", "tests.behaviour", "--bounds"]
    played = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert played.returncode == 0, played.stdout + played.stderr
