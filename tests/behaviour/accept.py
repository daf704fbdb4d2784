"""Accept values that moved: record them, and raise the version of the subsystems they are of.

Three promises are kept here. New values come from committed code alone. Every raised version has a
line in CHANGELOG.md that names it, the ids that moved, and which of observation, reward, cost,
info and dynamics did. And no commit changes `doors.py`, the probes' view of the code, together
with recorded values: a mistake in the one would hide behind the other.
"""

import re
import subprocess
from collections.abc import Iterable
from pathlib import Path

from rich.console import Console

from tests.behaviour import doors
from tests.behaviour.probe import (
    Difference,
    Played,
    Probe,
    RecordingError,
    Values,
    compare,
    path_of,
    read,
    write,
)
from tests.behaviour.rooms import ROOMS, Placed

ROOT = Path(__file__).resolve().parents[2]
VERSIONS = ROOT / "hrc_env" / "behaviour.toml"
CHANGELOG = ROOT / "CHANGELOG.md"
DOORS = "tests/behaviour/doors.py"
RECORDED = "tests/behaviour/recorded"
OWN = (RECORDED, "hrc_env/behaviour.toml", "CHANGELOG.md")
"""Paths that may differ from the last commit while values are accepted."""
KINDS = {
    "observation/": "observation",
    "reward": "reward",
    "return": "reward",
    "cost": "cost",
    "episode_cost": "cost",
}
"""Names of values begin so, and the kind of change that they show."""
DYNAMICS = (
    "observation/joint", "observation/tool", "observation/object", "observation/slide",
    "terminated", "truncated", "steps before",
)  # fmt: skip
"""Names of values begin so that show that the world itself moves otherwise."""


class RefusedError(Exception):
    """Something was asked for that the rules of this folder do not allow."""


def check_ready() -> None:
    """Raise `RefusedError` while there are changes elsewhere that are not committed."""
    lines = _git("status", "--porcelain").splitlines()
    changed = [line[3:].split(" -> ")[-1].strip('"') for line in lines]
    others = [path for path in changed if not path.startswith(OWN)]
    if others:
        listed = ", ".join(others[:5]) + (", ..." if len(others) > 5 else "")
        raise RefusedError(
            "values are accepted from committed code only, and these have changes that are not "
            f"committed: {listed}. Commit them first; only {', '.join(OWN)} may differ."
        )


def accept(moved: list[Placed], console: Console) -> int:
    """Record probes anew and raise the versions of their subsystems; return 0.

    Raises:
        RefusedError: CHANGELOG.md does not say what moves.
    """
    if not moved:
        console.print("Nothing differs; there is nothing to accept.")
        return 0
    versions = doors.read_versions(VERSIONS)
    played = {each.label: _play(each) for each in moved}
    tracked = set(_git("ls-files", RECORDED).splitlines())  # a deleted recording is not a new one
    is_first = {
        each.label: path_of(each.room, each.probe).relative_to(ROOT).as_posix() not in tracked
        for each in moved
    }
    raised: dict[str, list[str]] = {}
    for each in moved:
        if not is_first[each.label]:
            _, now, differences = played[each.label]
            raised.setdefault(ROOMS[each.room], []).extend(describe(each, differences))
    new = {name: versions[name] + 1 for name in raised}
    check_changelog(CHANGELOG.read_text(), {(k, n): raised[k] for k, n in new.items()})
    for each in moved:
        inputs, now, _ = played[each.label]
        write(path_of(each.room, each.probe), inputs, now)
    write_versions(versions | new)
    said = ", ".join(f"{name} {versions[name]} -> {n}" for name, n in new.items())
    console.print(f"Recorded {len(moved)} probes; {said or 'no version moves: all are new'}.")
    return 0


def _play(placed: Placed) -> tuple[Values, Played, list[Difference]]:
    """Return the inputs of a probe, new values, and what differs from the recorded ones."""
    probe: Probe = placed.probe
    try:
        inputs, recorded = read(path_of(placed.room, probe))
    except RecordingError:
        inputs = probe.inputs()
        return inputs, probe.play(inputs), []
    now = probe.play(inputs)
    return inputs, now, compare(recorded, now, probe.tolerance)


def describe(placed: Placed, differences: Iterable[Difference]) -> list[str]:
    """Return words that a line of CHANGELOG.md must have for a probe that moved."""
    if ROOMS[placed.room] != "env":
        return []
    kinds = set()
    for each in differences:
        kind = next((k for start, k in KINDS.items() if each.name.startswith(start)), "info")
        kinds.add("dynamics" if each.name.startswith(DYNAMICS) else kind)
    return [placed.probe.subject, *sorted(kinds)]


def check_changelog(text: str, raised: dict[tuple[str, int], list[str]]) -> None:
    """Raise `RefusedError` unless there is an entry for each new version with its words."""
    entries = [" ".join(each.split()) for each in re.split(r"\n\s*\n|\n(?=[-*] )", text)]
    for (subsystem, version), words in raised.items():
        wanted = [f"{subsystem} {version}", *dict.fromkeys(words)]
        if not any(all(_holds(entry, word) for word in wanted) for entry in entries):
            raise RefusedError(
                f"CHANGELOG.md needs an entry with the words {', '.join(map(repr, wanted))}, and "
                "why. Write it, then accept again."
            )


def _holds(entry: str, word: str) -> bool:
    return re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", entry) is not None


def write_versions(versions: dict[str, int]) -> None:
    """Write new numbers into `behaviour.toml`, whose comments stay."""
    text = VERSIONS.read_text()
    for name, number in versions.items():
        text = re.sub(rf"(?m)^{name} *= *\d+", f"{name} = {number}", text)
    draft = VERSIONS.with_suffix(".draft")
    draft.write_text(text)
    draft.replace(VERSIONS)


def check_commits(console: Console) -> int:
    """Return 1 and name the commits that change doors and recorded values at once."""
    wrong = find_mixed_commits()
    for each in wrong:
        console.print(f"{each} changes {DOORS} and {RECORDED} at once; make it two commits.")
    return int(bool(wrong))


def find_mixed_commits() -> list[str]:
    """Return the commits, and "the index", that change doors and recorded values at once."""
    staged = _git("diff", "--cached", "--name-only").splitlines()
    is_mixed = DOORS in staged and any(path.startswith(RECORDED) for path in staged)
    both = [set(_git("log", "--format=%h", "--", path).split()) for path in (DOORS, RECORDED)]
    return sorted(both[0] & both[1]) + ["the index"] * is_mixed


def _git(*words: str) -> str:
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RefusedError(f"git {words[0]} failed: {done.stderr.strip()}. This needs a clone.")
    return done.stdout
