"""Recorded summaries of completed parts of studies: `docs/results/parts/STUDY.json`.

A part is an independently cached section of a study's results. Parts are large and stay in `out/`.
For each list of numbers in a part, the summary contains five numbers that can be compared with
those of another run: the count, the count of finite numbers, the mean, the root mean square, and a
mean with fixed weights, which depends on the order. If two lists agree to a relative tolerance,
their summaries agree to the same tolerance.
"""

import json
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from docs import tables

TOLERANCE = 1e-6
"""Maximum difference of a summary's numbers between two runs of a part, relative for numbers above
1.
"""
CLOCK = frozenset({"t"})
"""Keys of measured times in parts, which are ignored since they differ between runs."""
Summary = dict[str, list[float]]
"""The five numbers of each list in a part, by the path of the list: its keys, with * for each
position in a list.
"""


@dataclass(frozen=True, slots=True)
class Part:
    """The record of a completed part of a study."""

    key: str
    """Cache key, derived from the settings and versions with which the part was computed."""
    seconds: float
    """Computing time of the part [s]."""
    notes: Mapping[str, float]
    """Additional numbers that a replay of the part needs (`PartCache.make_part`)."""
    summary: Summary
    """Summary of the part's numbers."""


@dataclass(frozen=True, slots=True)
class Record:
    """The records of all parts of a study."""

    depends: Mapping[str, int] = field(default_factory=dict)
    """Versions of the subsystems with which the parts were computed, by name."""
    parts: Mapping[str, Part] = field(default_factory=dict)
    """Records of the parts, by label."""
    spoiled: Mapping[str, str] = field(default_factory=dict)
    """Descriptions of the differences that a replay found, by label of the part."""


def get_path(study: str) -> Path:
    """Return the path of the file with a study's record."""
    return tables.RESULTS / "parts" / f"{study}.json"


def read(study: str) -> Record:
    """Read the record of a study; without a file, return an empty record."""
    path = get_path(study)
    if not path.exists():
        return Record()
    content = json.loads(path.read_text())
    parts = {label: Part(**part) for label, part in content["parts"].items()}
    return Record(content["depends"], parts, content.get("spoiled", {}))


def write(study: str, depends: Mapping[str, int], folder: Path, began_s: float) -> None:
    """Write the record of a study for the parts that its latest run computed or reused.

    Args:
        study: name of the study.
        depends: versions of the subsystems on which the study depends, by name.
        folder: folder of the study's parts; if it contains none, the record is deleted.
        began_s: start of the run as returned by `time.time` [s]; parts that were last used earlier
            are left out.
    """
    made = [path for path in sorted(folder.glob("*.json")) if path.stat().st_atime >= began_s - 1]
    parts = {}
    for path in made:
        content = json.loads(path.read_text())
        parts[path.name.removesuffix(".json")] = Part(
            content["key"], content["seconds"], content["notes"], summarize(content["part"])
        )
    get_path(study).unlink(missing_ok=True)
    if parts:
        save(study, Record(depends, parts))


def save(study: str, record: Record) -> None:
    """Write a study's record to its file, with one line per part."""
    lines = [
        f"  {json.dumps(label)}: "
        + json.dumps({name: getattr(part, name) for name in Part.__slots__}, separators=(",", ":"))
        for label, part in record.parts.items()
    ]
    head = {"depends": dict(record.depends), "spoiled": dict(record.spoiled)}
    text = json.dumps(head)[:-1] + ', "parts": {\n' + ",\n".join(lines) + "\n}}\n"
    path = get_path(study)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def summarize(part: Mapping[str, Any]) -> Summary:
    """Compute the summary of a part."""
    lists: dict[str, list[float]] = {}
    for leaf in _list_leaves(part, ""):
        lists.setdefault(leaf.path, []).append(leaf.value)
    return {path: _summarize_list(np.array(values, float)) for path, values in lists.items()}


class Leaf(NamedTuple):
    """A number in a part."""

    path: str
    """Path of the number in the part: its keys, with * for each position in a list."""
    value: float


def _list_leaves(value: Any, path: str) -> Iterator[Leaf]:
    """Yield all numbers of a part with their paths; a string is represented by its checksum."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            if key not in CLOCK:
                yield from _list_leaves(item, f"{path}/{key}" if path else str(key))
    elif isinstance(value, list | tuple | np.ndarray):
        for item in value:
            yield from _list_leaves(item, path if path.endswith("*") else f"{path}*")
    elif isinstance(value, str):
        yield Leaf(path, float(zlib.crc32(value.encode())))
    else:
        yield Leaf(path, np.nan if value is None else float(value))


def _summarize_list(values: np.ndarray) -> list[float]:
    is_finite = np.isfinite(values)
    values = np.where(is_finite, values, 0.0)
    weighted = values * np.cos(np.arange(len(values)))
    statistics = [np.mean(values), np.sqrt(np.mean(values**2)), np.mean(weighted)]
    return [len(values), int(is_finite.sum()), *(float(f"{x:.10g}") for x in statistics)]


def describe_difference(recorded: Summary, current: Summary) -> str:
    """Describe the first difference between two summaries, or return "" if there is none."""
    for path in dict.fromkeys([*recorded, *current]):
        if path not in current:
            return f"{path} is missing"
        if path not in recorded:
            return f"{path} is new"
        (n, n_finite, *old), (m, m_finite, *new) = recorded[path], current[path]
        if (n, n_finite) != (m, m_finite):
            return f"{path} has {m} numbers, {m_finite} of them finite, not {n} and {n_finite}"
        size = TOLERANCE * (1 + old[1])
        if any(abs(a - b) > size for a, b in zip(old, new, strict=True)):
            return f"{path} has mean {new[0]:.6g} and root mean square {new[1]:.6g}, " \
                   f"not {old[0]:.6g} and {old[1]:.6g}"  # fmt: skip
    return ""
