"""Mutants: changes that the probes and tests of a room must notice; lists and draws of them.

`named.toml` and `semantic.toml` are written by hand, as old text and new text of a file. A draw
(`draw_A.toml`) is made once, from all candidates that `mutations` finds in the code and from the
semantic ones, and holds its seed and every mutant in full. `unseen.toml` is such a draw from
the modules that say what cameras do not see.
"""

import ast
import json
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tests.behaviour.mutations import find_candidates

ROOT = Path(__file__).resolve().parents[3]
FOLDER = Path(__file__).parent
NAMED, SEMANTIC = "named", "semantic"
FIRST_IN = {"A": NAMED}
"""The list whose mutants come first in a draw."""
LEAST_A_ROOM = 4
"""Least number of mutants of each room in a draw."""


class MutantError(Exception):
    """A mutant that does not fit this code, or a list that cannot be read or drawn."""


@dataclass(frozen=True, slots=True)
class CodeRoom:
    """A part of the code, and the probes and tests that speak for it."""

    path: str
    """Its folder or file."""
    probes: tuple[str, ...]
    """Rooms of probes, in the order in which they are likely to notice something."""
    own_tests: tuple[str, ...]
    """Its unit tests, without `SETTINGS`."""

    @property
    def tests(self) -> tuple[str, ...]:
        """The unit tests that speak for it."""
        return tuple(dict.fromkeys((*self.own_tests, *SETTINGS)))


SETTINGS = (
    "tests/test_limits.py", "tests/test_config.py", "tests/test_env.py",
    "tests/test_bring_your_own.py", "tests/test_refused_values.py",
)  # fmt: skip
"""Unit tests of what settings, arguments and own things must be like, of all rooms."""
CODE: dict[str, CodeRoom] = {
    "tasks": CodeRoom(
        "hrc_env/tasks", ("env", "agents"),
        ("tests/tasks", "tests/test_goals.py", "tests/test_rewards.py"),
    ),
    "safety": CodeRoom(
        "hrc_env/safety", ("shield", "env"), ("tests/safety", "tests/test_metrics.py")
    ),
    "tracking": CodeRoom("hrc_env/tracking", ("tracker", "env"), ("tests/tracking",)),
    "perception": CodeRoom(
        "hrc_env/perception", ("emulator", "detector", "env"), ("tests/perception",)
    ),
    "motion": CodeRoom(
        "hrc_env/motion", ("motion", "env", "importer"), ("tests/motion", "tests/mocap")
    ),
    "geometry": CodeRoom(
        "hrc_env/geometry",
        ("tracker", "shield", "emulator", "detector", "env", "agents", "motion"),
        ("tests/geometry",),
    ),
    "scene": CodeRoom(
        "hrc_env/scene", ("env", "emulator", "detector"),
        ("tests/scene", "tests/geometry/test_rig_files.py", "tests/test_unseen_floor.py"),
    ),
    "pipeline": CodeRoom(
        "hrc_env/pipeline", ("env", "emulator", "detector"),
        ("tests/pipeline", "tests/render", "tests/test_unknown.py", "tests/test_truth.py"),
    ),
    "observations": CodeRoom(
        "hrc_env/observations.py", ("env", "agents"),
        ("tests/test_observations.py", "tests/test_uncertainty.py"),
    ),
    "belief": CodeRoom(
        "hrc_env/belief.py", ("env", "shield"),
        ("tests/test_uncertainty.py", "tests/test_observations.py"),
    ),
    "control": CodeRoom("hrc_env/control.py", ("env", "agents"), ("tests/test_control.py",)),
    "simulation": CodeRoom(
        "hrc_env/simulation.py", ("env",),
        ("tests/test_env.py", "tests/test_states.py", "tests/test_several_workers.py"),
    ),
    "rewards": CodeRoom("hrc_env/rewards.py", ("env",), ("tests/test_rewards.py",)),
    "metrics": CodeRoom(
        "hrc_env/tracking/metrics.py", ("env",),
        ("tests/test_metrics.py", "tests/test_several_workers.py"),
    ),
    "agents": CodeRoom(
        "agents", ("agents", "learning"),
        (
            "tests/test_policies.py", "tests/test_recording.py", "tests/test_lagrangian.py",
            "tests/test_training.py", "tests/test_learners.py", "tests/tasks",
            "tests/test_refused_agents.py",
        ),
    ),
}  # fmt: skip
"""The rooms of the code by name."""
LEFT_OUT = {
    "hrc_env/scene/viewer.py": "opens a window for people",
    "hrc_env/scene/gl.py": "finds a graphics driver",
    "hrc_env/perception/weights.py": "downloads files whose digests are checked",
    "agents/callbacks.py": "reports how a training goes",
}
"""Files that hold no number of any result."""


@dataclass(frozen=True, slots=True)
class Edit:
    """One place that is changed."""

    file: str
    line: int
    before: str
    """The whole lines, without the last end of line."""
    after: str

    def apply(self, text: str) -> str:
        """Return the text of the file with the change made, also where the line has moved.

        Raises:
            MutantError: the lines are no longer there.
        """
        lines, old = text.split("\n"), self.before.split("\n")
        places = [k for k in range(len(lines)) if lines[k : k + len(old)] == old]
        begin = self.line - 1
        if begin not in places and len(places) == 1:
            begin = places[0]  # lines above were added or removed
        if begin not in places:
            raise MutantError(
                f"{self.file}:{self.line} was expected to be {self.before.strip()!r}, and is "
                f"{lines[begin : begin + 1]}; it is in {len(places)} other places. "
                "The code has changed since the mutant was drawn: check out that commit, or make a "
                "new draw under another letter."
            )
        return "\n".join([*lines[:begin], *self.after.split("\n"), *lines[begin + len(old) :]])


@dataclass(frozen=True, slots=True)
class Mutant:
    """A change of the code that is to be noticed."""

    name: str
    room: str
    """Of the code."""
    kind: str
    edits: tuple[Edit, ...]

    @property
    def key(self) -> str:
        """Its changes as a text, without its name."""
        return json.dumps([asdict(edit) for edit in self.edits])

    def write_into(self, folder: Path) -> dict[Path, str]:
        """Change the files of a checkout; return their former texts."""
        before = {folder / edit.file: (folder / edit.file).read_text() for edit in self.edits}
        after = dict(before)
        for edit in self.edits:  # all are known to fit before one file is written
            after[folder / edit.file] = edit.apply(after[folder / edit.file])
        for path, text in after.items():
            path.write_text(text)
        return before


def files_of(room: str, root: Path = ROOT) -> list[Path]:
    """Return the modules of a room of the code."""
    path = root / CODE[room].path
    files = sorted(path.rglob("*.py")) if path.is_dir() else [path]
    return [each for each in files if each.relative_to(root).as_posix() not in LEFT_OUT]


def find_mutants(room: str, root: Path = ROOT) -> dict[tuple[str, int], list[Mutant]]:
    """Return all candidates of a room by file and line."""
    found: dict[tuple[str, int], list[Mutant]] = {}
    for path in files_of(room, root):
        file = path.relative_to(root).as_posix()
        for each in find_candidates(path.read_text()):
            edit = Edit(file, each.line, each.before, each.after)
            found.setdefault((file, each.line), []).append(Mutant("", room, each.kind, (edit,)))
    return found


# Lists.


def read_list(name: str, folder: Path = FOLDER, root: Path = ROOT) -> list[Mutant]:
    """Return the mutants of a list or a draw.

    Raises:
        MutantError: there is no such list, or the text that a mutant changes is not in its file
            exactly once.
    """
    path = folder / f"{name}.toml"
    if not path.exists():
        valid = ", ".join(sorted(each.stem for each in folder.glob("*.toml")))
        raise MutantError(f"There is no list {name!r}. Valid are {valid}; or make a draw: --draw B")
    content = tomllib.loads(path.read_text())
    return [_read_mutant(each, root) for each in content["mutant"]]


def _read_mutant(entry: Mapping[str, Any], root: Path) -> Mutant:
    if entry["room"] not in CODE:
        raise MutantError(f"{entry['name']}: there is no room {entry['room']!r} in the code.")
    edits = tuple(
        Edit(**each) if "line" in each else _find_place(entry["name"], **each, root=root)
        for each in entry["edits"]
    )
    return Mutant(entry["name"], entry["room"], entry["kind"], edits)


def _find_place(name: str, file: str, old: str, new: str, root: Path) -> Edit:
    """Return the change of a text that is in a file exactly once."""
    text = (root / file).read_text()
    if text.count(old) != 1:
        raise MutantError(
            f"{name}: {old!r} was expected in {file} exactly once, and is there "
            f"{text.count(old)} times. Give the text that stands there today."
        )
    at = text.index(old)
    begin, end = text.rfind("\n", 0, at) + 1, text.find("\n", at + len(old))
    before = text[begin:end]
    line = text.count("\n", 0, begin) + 1
    return Edit(file, line, before, before.replace(old, new))


# Draws.


def draw(letter: str, seed: int, n: int, folder: Path = FOLDER, root: Path = ROOT) -> Path:
    """Draw mutants and write them down in full, unless that has been done.

    Raises:
        MutantError: there is a draw of this letter with another seed or number.
    """
    path = folder / f"draw_{letter}.toml"
    if path.exists():
        made = tomllib.loads(path.read_text())
        if (made["seed"], len(made["mutant"])) != (seed, n):
            raise MutantError(
                f"Draw {letter} was made with seed {made['seed']} and has {len(made['mutant'])} "
                f"mutants; asked was seed {seed} and {n}. A draw is made once: choose another "
                "letter."
            )
        return path
    others = {
        each.key for other in folder.glob("draw_*.toml") for each in read_list(other.stem, folder)
    }
    first = read_list(FIRST_IN[letter], folder, root) if letter in FIRST_IN else []
    semantic = read_list(SEMANTIC, folder, root)
    drawn = draw_mutants(np.random.default_rng(seed), n, first, semantic, others, root)
    named = [
        Mutant(f"{letter}{k:02} {each.name}".strip(), each.room, each.kind, each.edits)
        for k, each in enumerate(drawn, 1)
    ]
    _write(path, seed, named)
    return path


def draw_mutants(
    rng: np.random.Generator,
    n: int,
    first: Iterable[Mutant],
    semantic: Iterable[Mutant],
    others: set[str],
    root: Path = ROOT,
) -> list[Mutant]:
    """Return n mutants: the first ones, then enough of each room, then any.

    A line of the code is drawn, then a kind of change that it allows, then such a change; a
    semantic one counts as a line. None is of `others`.
    """
    drawn = list(first)
    if n < len(drawn) + LEAST_A_ROOM * len(CODE):
        raise MutantError(f"A draw must have at least {LEAST_A_ROOM * len(CODE)} mutants, got {n}.")
    lines = {room: list(find_mutants(room, root).values()) for room in CODE}
    for each in semantic:
        lines[each.room].append([each])
    sizes = np.array([len(each) for each in lines.values()])
    waiting = {room: _shuffle_lines(rng, room, lines[room], others, root) for room in CODE}
    taken = Counter(each.room for each in drawn)
    for room in CODE:
        for _ in range(max(LEAST_A_ROOM - taken[room], 0)):
            drawn.append(next(waiting[room]))
    while len(drawn) < n:
        room = list(CODE)[rng.choice(len(sizes), p=sizes / sizes.sum())]
        drawn.append(next(waiting[room]))
    return drawn


def _shuffle_lines(
    rng: np.random.Generator, room: str, lines: list[list[Mutant]], others: set[str], root: Path
) -> Iterator[Mutant]:
    """Yield a mutant of each line of a room, in random order."""
    for k in rng.permutation(len(lines)).tolist():
        left = [each for each in lines[k] if each.key not in others]
        if not left:
            continue
        kinds = sorted({each.kind for each in left})
        kind = kinds[rng.integers(len(kinds))]
        changes = [each for each in left if each.kind == kind]
        mutant = changes[rng.integers(len(changes))]
        if changes_code(mutant, root):
            yield mutant
    raise MutantError(f"Room {room!r} has no more lines to draw from.")


def changes_code(mutant: Mutant, root: Path = ROOT) -> bool:
    """Return whether a mutant is valid Python that differs from the code."""
    for edit in mutant.edits:
        text = (root / edit.file).read_text()
        try:
            if ast.dump(ast.parse(edit.apply(text))) == ast.dump(ast.parse(text)):
                return False
        except SyntaxError:
            return False
    return True


def _write(path: Path, seed: int, mutants: Iterable[Mutant]) -> None:
    """Write a draw: to a draft first, which then takes its place."""
    lines = [
        "# Drawn by `python -m tests.behaviour.mutate --draw`; never changed.",
        f"seed = {seed}",
    ]
    for each in mutants:
        head = {"name": each.name, "room": each.room, "kind": each.kind}
        lines += ["", "[[mutant]]", *_entries(head)]
        for edit in each.edits:
            lines += ["[[mutant.edits]]", *_entries(asdict(edit))]
    draft = path.with_suffix(".draft")
    draft.write_text("\n".join([*lines, ""]))
    draft.replace(path)


def _entries(values: Mapping[str, Any]) -> Iterator[str]:
    for name, value in values.items():
        yield f"{name} = {json.dumps(value, ensure_ascii=False)}"
