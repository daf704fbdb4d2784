"""Judge one mutant: the part that runs in a copy of the checkout, in a process of its own.

Each line of output that begins with `MARK` is a JSON object: the name of the probe or test that
begins ("playing"), or a notice ("noticed", "how", "words").
"""

import json
import os
import signal
import sys
import threading
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

MARK = "MUTANT "
SAME, NOTICED, ELSEWHERE = 0, 1, 3
"""Exit statuses: nothing was noticed, something was, and another checkout was imported."""


def play_probes(rooms: tuple[str, ...], hints: tuple[str, ...]) -> int:
    """Play the probes of some rooms and stop at the first that differs; return an exit status."""
    _follow_parent()
    say(playing="the import of the package")
    import hrc_env

    if not Path(hrc_env.__file__).is_relative_to(Path.cwd()):
        return ELSEWHERE
    from tests.behaviour.playing import play

    for label in order_probes(rooms, hints):
        say(playing=label)
        outcome = play(label)
        if not outcome.is_same:
            how = "exception" if outcome.error else "probe"
            words = outcome.error or "; ".join(map(str, outcome.differences[:3]))
            say(noticed=label, how=how, words=words)
            return NOTICED
    return SAME


def order_probes(rooms: tuple[str, ...], hints: Iterable[str]) -> list[str]:
    """Return labels of probes: those that are named as the changed files are, then the short form,
    then the rest, each in the order of the rooms and without pixels first."""
    from tests.behaviour.rooms import Placed, probes

    words = [_plain(hint) for hint in hints]

    def rank(each: Placed) -> tuple[bool, bool, bool, int]:
        text = _plain(f"{each.label} {each.probe.subject}")
        is_named = any(word in text for word in words)
        probe = each.probe
        return not is_named, not probe.is_short, probe.needs_pixels, rooms.index(each.room)

    return [each.label for each in sorted(probes(rooms), key=rank)]


def _plain(text: str) -> str:
    return text.lower().replace("_", "").replace("-", "").replace(" ", "")


def run_tests(paths: Sequence[str], marks: str) -> int:
    """Run unit tests and stop at the first that fails; return an exit status."""
    _follow_parent()
    import pytest

    options = ["-x", "-q", "--no-header", "-p", "no:cacheprovider", "-m", marks]
    status = pytest.main([*options, *paths], plugins=[_Witness()])
    none_chosen = status == pytest.ExitCode.NO_TESTS_COLLECTED
    return SAME if status == pytest.ExitCode.OK or none_chosen else NOTICED


class _Witness:
    """A plugin of pytest that names the first failure."""

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        say(playing=nodeid)

    def pytest_runtest_logreport(self, report: "pytest.TestReport") -> None:  # noqa: F821
        if report.failed:
            say(noticed=report.nodeid, how="test", words=_last_line(report.longreprtext))

    def pytest_collectreport(self, report: "pytest.CollectReport") -> None:  # noqa: F821
        if report.failed:
            say(noticed=report.nodeid, how="exception", words=_last_line(report.longreprtext))


def _last_line(text: str) -> str:
    return text.strip().rpartition("\n")[2]


def say(**values: str) -> None:
    """Write a line that the parent reads."""
    sys.stdout.write(f"\n{MARK}{json.dumps(values)}\n")
    sys.stdout.flush()


def _follow_parent() -> None:
    """End this process and those that it began when its parent has ended."""
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os.killpg(0, signal.SIGKILL)

    threading.Thread(target=watch, daemon=True).start()
