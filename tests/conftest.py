"""What tests of several rooms need, and which tests are slow: by what they ask for."""

import os
import subprocess
import sys
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # workers share the cores; read by NumPy and torch

import pytest
from commands import ROOT
from figures import Figures, collect, write

from hrc_env.perception.weights import fetch_weights
from hrc_env.registration import import_files
from hrc_env.vector import options
from tests.registrations import registrations_restored

options.MIN_PER_THREAD = 1  # small batches of tests have as many threads as they ask for
SLOW = {"process", "pixels", "end_to_end"}
"""Fixtures that take their time: `make test` leaves out who asks for one. `end_to_end` is a whole
run of an experiment, of which each has its own."""
SLOW_WORDS = {"pixels"}
"""And parameters that do."""


@pytest.hookimpl(tryfirst=True)  # before -m deselects
def pytest_collection_modifyitems(items: list[pytest.Function]) -> None:
    for item in items:
        given = item.callspec.params.values() if hasattr(item, "callspec") else ()
        words = {each for each in given if isinstance(each, str)}
        if SLOW & set(item.fixturenames) or SLOW_WORDS & words:
            item.add_marker(pytest.mark.slow)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the figures that the tests of this run measured, and write them."""
    stats = terminalreporter.stats
    figures = collect(each for kind in ("passed", "failed") for each in stats.get(kind, ()))
    if figures:
        terminalreporter.section("figures")
        for line in write(figures):
            terminalreporter.line(line)


@pytest.fixture
def figures(request: pytest.FixtureRequest) -> Figures:
    """The figures of one test: `figures.hold(Figure(...))` notes and bounds them."""
    return Figures(request.node.user_properties)


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
    """Runs Python with some words in a process of its own, and returns what came of it.

    Other variables of the environment are keywords; None takes one away.
    """

    def run(
        *words: object, cwd: Path | None = None, **env: str | None
    ) -> subprocess.CompletedProcess[str]:
        kept = {name: value for name, value in os.environ.items() if name not in env}
        given = {name: value for name, value in env.items() if value is not None}
        return subprocess.run(
            [sys.executable, *map(str, words)], cwd=cwd, env={**kept, **given},
            capture_output=True, text=True, check=False, timeout=600,
        )  # fmt: skip

    return run


@pytest.fixture(autouse=True)
def registrations():
    """No test leaves something registered to the next one in its process."""
    with registrations_restored():
        yield


@pytest.fixture(scope="module")
def brought():
    """What examples/bring_your_own registers is known, for the tests of one file."""
    examples = sorted((ROOT / "examples" / "bring_your_own").glob("*.py"))
    with registrations_restored():
        import_files(os.pathsep.join(map(str, examples)))
        yield [path.stem for path in examples]
