"""A probe plays one fixed scenario and compares what happened with what was recorded.

A recording is one `.npz` file: the inputs that are replayed (the actions of an expert), the values
that came of them step by step, and how many steps are compared in full. Names in it are the
probes' own; `doors` maps them to the names of today's code.
"""

import zipfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

FOLDER = Path(__file__).parent / "recorded"
FORMAT = 1
"""Version of the files' layout."""
TOLERANCE = 1e-6
"""Largest difference that rounding on another processor may make, of values up to 1; of larger
values it is relative."""
EVENT_TOLERANCE = 1e-3
"""The same of events after the first contact, where rounding grows."""

Values = dict[str, NDArray[Any]]
"""Arrays by name; the first axis counts steps."""


class RecordingError(Exception):
    """A recording that is missing, or of a layout that this code does not read."""


@dataclass(frozen=True, slots=True)
class Played:
    """What happened in one run of a probe."""

    values: Values
    """Everything that is compared."""
    n_settled: int | None = None
    """Number of first steps that are compared in full; None: all."""
    events: frozenset[str] = frozenset()
    """Names of the values that are compared in the steps after those, too."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Probe:
    """One scenario of a room."""

    name: str
    play: Callable[[Values], Played]
    """Play the scenario with the recorded inputs."""
    inputs: Callable[[], Values] = dict
    """Make the inputs when the probe is recorded for the first time."""
    subject: str = ""
    """The environment id that the scenario is of, if it is of one."""
    is_short: bool = False
    """Whether it belongs to the short form that `make test` plays."""
    needs_pixels: bool = False
    """Whether images are drawn in it."""
    tolerance: float = TOLERANCE


@dataclass(frozen=True, slots=True)
class Difference:
    """How one value of a probe differs from its recording."""

    name: str
    step: int
    """The first step in which it does; -1: in all, as its shape or existence differs."""
    size: float
    """The largest difference; infinite where it is none of numbers."""
    words: str
    """What was expected and what came."""

    def __str__(self) -> str:
        where = "" if self.step < 0 else f" from step {self.step} on, by up to {self.size:.3g}"
        return f"{self.name}{where}: {self.words}"


def path_of(room: str, probe: Probe) -> Path:
    """The file of a probe's recording."""
    return FOLDER / room / f"{probe.name}.npz"


def read(path: Path) -> tuple[Values, Played]:
    """Return the inputs and the values of a recording.

    Raises:
        RecordingError: there is no such file, or it is of another format.
    """
    if not path.exists():
        raise RecordingError(
            f"There is no recording {path.relative_to(FOLDER)}. If the probe is new, record it: "
            "python -m tests.behaviour --accept"
        )
    try:
        with np.load(path) as file:
            content = {name: file[name] for name in file.files}
    except (ValueError, OSError, zipfile.BadZipFile) as error:
        raise RecordingError(f"{path.relative_to(FOLDER)} is no recording: {error}") from error
    version = int(content.pop("format", -1))
    if version != FORMAT:
        raise RecordingError(
            f"{path.relative_to(FOLDER)} is of format {version}, and this code reads format "
            f"{FORMAT}. Check out the commit that wrote it, or record it anew: "
            "python -m tests.behaviour --accept"
        )
    n_settled = int(content.pop("n_settled"))
    events = frozenset(content.pop("events").tolist())
    inputs, values = (
        {name.removeprefix(kind): value for name, value in content.items() if name.startswith(kind)}
        for kind in ("input/", "value/")
    )
    return inputs, Played(values, None if n_settled < 0 else n_settled, events)


def write(path: Path, inputs: Values, played: Played) -> None:
    """Write a recording: to a draft first, which then takes its place."""
    content: dict[str, Any] = {
        "format": np.array(FORMAT),
        "n_settled": np.array(-1 if played.n_settled is None else played.n_settled),
        "events": np.array(sorted(played.events), "U"),
        **{f"input/{name}": value for name, value in inputs.items()},
        **{f"value/{name}": _compact(value) for name, value in played.values.items()},
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".draft")
    with draft.open("wb") as file:
        np.savez_compressed(file, **content)
    draft.replace(path)


def _compact(values: NDArray[Any]) -> NDArray[Any]:
    """Numbers in single precision, whose rounding is a sixteenth of the tolerance."""
    values = np.asarray(values)
    return values.astype(np.float32) if values.dtype.kind == "f" else values


def compare(recorded: Played, now: Played, tolerance: float = TOLERANCE) -> list[Difference]:
    """Return what differs, by name: values in the settled steps, events in all."""
    found = []
    for name in [*recorded.values, *(name for name in now.values if name not in recorded.values)]:
        if name not in now.values:
            found.append(Difference(name, -1, np.inf, "recorded, and no longer there"))
        elif name not in recorded.values:
            found.append(Difference(name, -1, np.inf, "there, and not recorded"))
        else:
            old, new = recorded.values[name], np.asarray(now.values[name])
            found += _compare_value(name, old, new, recorded, tolerance)
    if recorded.n_settled != now.n_settled:
        words = f"expected {recorded.n_settled}, got {now.n_settled}"
        found.append(Difference("steps before the first contact or reset", -1, np.inf, words))
    return found


def _compare_value(
    name: str, old: NDArray[Any], new: NDArray[Any], recorded: Played, tolerance: float
) -> Iterable[Difference]:
    if old.shape != new.shape:
        yield Difference(name, -1, np.inf, f"expected shape {old.shape}, got {new.shape}")
        return
    off = _distances(old, new)
    allowed = np.full(len(off), tolerance)
    if recorded.n_settled is not None:
        late = EVENT_TOLERANCE if name in recorded.events else np.inf
        allowed[recorded.n_settled :] = max(late, tolerance)
    wrong = ~(off <= allowed) & ~((allowed == np.inf) & (off == np.inf))
    if wrong.any():
        step = int(np.argmax(wrong))
        was, came = np.ravel(old[step]), np.ravel(new[step])
        entry = int(np.argmax(_distances(was, came))) if was.size else 0
        words = f"expected {was[entry]}, got {came[entry]} (entry {entry})"
        yield Difference(name, step, float(off[wrong].max()), words)


def _distances(old: NDArray[Any], new: NDArray[Any]) -> NDArray[np.float64]:
    """(n,) the largest difference of each step, relative where values are above 1."""
    n = len(old)
    if n == 0:
        return np.zeros(0)
    if old.dtype.kind in "USO" or new.dtype.kind in "USO":
        same = np.asarray(old.astype(str) == new.astype(str)).reshape(n, -1)
        return np.where(same.all(axis=1), 0.0, np.inf)
    a, b = old.astype(float).reshape(n, -1), new.astype(float).reshape(n, -1)
    is_same = (a == b) | (np.isnan(a) & np.isnan(b))
    with np.errstate(invalid="ignore"):
        off = np.where(is_same, 0.0, np.abs(a - b) / np.maximum(np.abs(a), 1.0))
    off = np.where(np.isnan(off), np.inf, off)
    return off.max(axis=1, initial=0.0)


def stack(moments: list[Mapping[str, Any]]) -> Values:
    """Return arrays over steps of the values of each, which must all have the same names."""
    return {name: np.stack([np.asarray(moment[name]) for moment in moments]) for name in moments[0]}
