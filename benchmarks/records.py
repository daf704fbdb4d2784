"""Summaries of the finished parts of studies: `docs/results/parts/STUDY.json`.

Parts themselves are large and stay in `out/`. A summary has, for each list of numbers in a part,
five numbers that can be compared with those of another run of it: how many there are, how many
are finite, their mean, their root mean square, and their mean with a fixed weight each, which
tells the order. If all numbers of a list agree to a tolerance, relative to their size, so do these.
"""

import json
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from docs import tables

TOLERANCE = 1e-6
"""Largest difference of a number between two runs of a part, of numbers up to 1; of larger numbers
it is relative."""
CLOCK = frozenset({"t"})
"""Keys in parts of numbers that a clock gave, which no other run repeats."""
Summary = dict[str, list[float]]
"""Five numbers by the place of a list in a part: keys, with * for each position in a list."""


@dataclass(frozen=True, slots=True)
class Part:
    """A finished part as it was recorded."""

    key: str
    """Of the settings and versions that it was made from."""
    seconds: float
    """How long it took."""
    notes: Mapping[str, float]
    """What a replay needs besides its label (`PartCache.part`)."""
    summary: Summary


@dataclass(frozen=True, slots=True)
class Record:
    """The parts of a study."""

    depends: Mapping[str, int] = field(default_factory=dict)
    """Versions that they were made at."""
    parts: Mapping[str, Part] = field(default_factory=dict)
    """By label."""
    spoiled: Mapping[str, str] = field(default_factory=dict)
    """Labels of parts that came out otherwise when they were replayed, and in which way."""


def path_of(study: str) -> Path:
    """Return the path of a study's record."""
    return tables.RESULTS / "parts" / f"{study}.json"


def read(study: str) -> Record:
    """Return the record of a study, which is empty if there is none."""
    path = path_of(study)
    if not path.exists():
        return Record()
    content = json.loads(path.read_text())
    parts = {label: Part(**part) for label, part in content["parts"].items()}
    return Record(content["depends"], parts, content.get("spoiled", {}))


def write(study: str, depends: Mapping[str, int], folder: Path, began_s: float) -> None:
    """Write the record of a study from the parts that its latest run made or used.

    Args:
        study: name of the study.
        depends: versions of the subsystems that it depends on.
        folder: where its parts are; without any there is no record.
        began_s: when the run began, as `time.time` gives it [s]; parts that were last used before
            are left out.
    """
    made = [path for path in sorted(folder.glob("*.json")) if path.stat().st_atime >= began_s - 1]
    parts = {}
    for path in made:
        content = json.loads(path.read_text())
        parts[path.name.removesuffix(".json")] = Part(
            content["key"], content["seconds"], content["notes"], summarize(content["part"])
        )
    path_of(study).unlink(missing_ok=True)
    if parts:
        save(study, Record(depends, parts))


def save(study: str, record: Record) -> None:
    """Write a record: a line for each part."""
    lines = [
        f"  {json.dumps(label)}: "
        + json.dumps({name: getattr(part, name) for name in Part.__slots__}, separators=(",", ":"))
        for label, part in record.parts.items()
    ]
    head = {"depends": dict(record.depends), "spoiled": dict(record.spoiled)}
    text = json.dumps(head)[:-1] + ', "parts": {\n' + ",\n".join(lines) + "\n}}\n"
    path = path_of(study)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def summarize(part: Mapping[str, Any]) -> Summary:
    """Return the summary of a part."""
    lists: dict[str, list[float]] = {}
    for place, value in _leaves(part, ""):
        lists.setdefault(place, []).append(value)
    return {place: _summarize_list(np.array(values, float)) for place, values in lists.items()}


def _leaves(value: Any, place: str) -> Iterator[tuple[str, float]]:
    """Yield every number of a part with its place; of words a number that stands for them."""
    if isinstance(value, Mapping):
        for key, each in value.items():
            if key not in CLOCK:
                yield from _leaves(each, f"{place}/{key}" if place else str(key))
    elif isinstance(value, list | tuple | np.ndarray):
        for each in value:
            yield from _leaves(each, place if place.endswith("*") else f"{place}*")
    elif isinstance(value, str):
        yield place, float(zlib.crc32(value.encode()))
    else:
        yield place, np.nan if value is None else float(value)


def _summarize_list(values: np.ndarray) -> list[float]:
    is_finite = np.isfinite(values)
    values = np.where(is_finite, values, 0.0)
    weighted = values * np.cos(np.arange(len(values)))
    found = [np.mean(values), np.sqrt(np.mean(values**2)), np.mean(weighted)]
    return [len(values), int(is_finite.sum()), *(float(f"{each:.10g}") for each in found)]


def describe_difference(recorded: Summary, now: Summary) -> str:
    """Return where two summaries differ first, and by how much; "" if they do not."""
    for place in dict.fromkeys([*recorded, *now]):
        if place not in now:
            return f"{place} is no longer there"
        if place not in recorded:
            return f"{place} was not there"
        (n, n_finite, *old), (m, m_finite, *new) = recorded[place], now[place]
        if (n, n_finite) != (m, m_finite):
            return f"{place} has {m} numbers, {m_finite} of them finite, not {n} and {n_finite}"
        size = TOLERANCE * (1 + old[1])
        if any(abs(a - b) > size for a, b in zip(old, new, strict=True)):
            return f"{place} has mean {new[0]:.6g} and root mean square {new[1]:.6g}, " \
                   f"not {old[0]:.6g} and {old[1]:.6g}"  # fmt: skip
    return ""
