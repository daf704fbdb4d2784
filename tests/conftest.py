"""What tests of several rooms need, and which tests are slow, by fixture and perception level."""

import os
import subprocess
import sys

os.environ.setdefault("OMP_NUM_THREADS", "1")  # workers share the cores; read by NumPy and torch

import pytest

from hrc_env.perception.weights import fetch_weights

SLOW = {"process", "pixels"}
"""Fixtures that take their time: `make test` leaves out who asks for one."""


@pytest.hookimpl(tryfirst=True)  # before -m deselects
def pytest_collection_modifyitems(items: list[pytest.Function]) -> None:
    """Mark who uses a slow fixture, or has pixels among its parameters."""
    for item in items:
        called = item.callspec.params.values() if hasattr(item, "callspec") else ()
        if SLOW & set(item.fixturenames) or "pixels" in [c for c in called if isinstance(c, str)]:
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def weights():
    """The official weights; downloaded at the first run, offline afterwards."""
    return fetch_weights()


@pytest.fixture(scope="session")
def pixels(weights):
    """For episodes whose every image is drawn and looked at."""
    return weights


@pytest.fixture
def process():
    """Runs Python with some words in a process of its own, and returns what came of it."""

    def run(*words: object) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, *map(str, words)]
        return subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)

    return run
