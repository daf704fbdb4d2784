"""Check that the recorded results of studies can be reproduced.

This command replays a random sample of all recorded parts and compares them with
`docs/results/parts/`. The sample contains at least one part of each row, which is a group of parts
with labels that begin with the same words, such as a scene, a task or a perception setup. A
training run is not repeated, but the evaluation of its policy is replayed if the policy is on this
machine. A part that differs makes its study stale: `python -m benchmarks.results --list` reports
it, and the next `make results` computes all parts of the study again.

    python -m benchmarks.verify                      # 2 % of all parts, with the seed of the day
    python -m benchmarks.verify --only site lab --share 1 --longest 60
    python -m benchmarks.verify --strict             # also fails if there are no records
"""

import datetime
import json
import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import tyro
from rich.console import Console
from scipy.stats import hypergeom

from benchmarks import records, results
from benchmarks.replays import REPLAYS, ReplayInput, find_row
from benchmarks.studies import COMMANDS, list_commands
from hrc_env.core.errors import (
    ConfigError,
    DownloadError,
    MissingExtraError,
    RenderingError,
)
from hrc_env.core.results import write_whole
from hrc_env.experiments.cache import Part, PartCache, PartProgress

CONFIDENCE = 0.95
"""Probability with which a sample should contain a part that is not reproducible."""
LACKING = (DownloadError, MissingExtraError, RenderingError)
"""Exceptions due to missing software or downloads, which do not count as differences of a part."""


@dataclass(frozen=True)
class Arguments:
    """Replay some recorded parts and compare them with their records."""

    share: float = 0.02
    """Fraction of all parts to replay; at least one part of each row is replayed."""
    only: tuple[str, ...] = ()
    """Names of studies to check (default: all)."""
    seed: int | None = None
    """Seed of the random sample (default: the date as a number)."""
    longest: float = 5.0
    """Maximum computing time of a part [min]; longer parts are listed, but not replayed."""
    strict: bool = False
    """Also fail if a study has no recorded parts, or parts that this machine cannot replay."""
    out: Path = Path("out/verify.json")
    """File to which the outcome is written."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a number is invalid, or a study does not exist."""
        if not 0 <= self.share <= 1:
            raise ConfigError(f"--share must be in [0, 1], got {self.share}.")
        if not self.longest > 0:
            raise ConfigError(f"--longest must be positive, got {self.longest}.")
        list_commands(self.only)


@dataclass(slots=True)
class Outcome:
    """The outcome of a verification."""

    seed: int
    """Seed of the random sample."""
    share: float
    """Requested fraction of parts."""
    n_parts: int = 0
    """Number of parts from which the sample was taken."""
    drawn: dict[str, list[str]] = field(default_factory=dict)
    """Labels of the sampled parts, by study."""
    spoiled: dict[str, dict[str, str]] = field(default_factory=dict)
    """Descriptions of the differences that were found, by study and label."""
    skipped: dict[str, str] = field(default_factory=dict)
    """Reasons why no part of a study was replayed, by study."""
    lacking: dict[str, list[str]] = field(default_factory=dict)
    """Labels of sampled parts that cannot be replayed on this machine, by study."""
    too_long: dict[str, list[str]] = field(default_factory=dict)
    """Labels of parts that were not sampled since they take too long, by study."""
    finds_share: float | None = None
    """Minimum fraction of irreproducible parts, in any rows, that is detected in 95 % of runs."""
    finds_scattered_share: float | None = None
    """Minimum fraction that is detected if the irreproducible parts are distributed at random over
    all rows.
    """
    seconds: float = 0.0
    """Duration of the run [s]."""


class AllReplayed(Exception):  # noqa: N818  it ends a replay and is not an error
    """Exception that ends a replay when all sampled parts of a study have been replayed."""


class Unplayed(dict[str, Any]):
    """Placeholder for a part that was not sampled; each of its keys has an empty list."""

    def __missing__(self, key: str) -> list[Any]:
        return []


@dataclass(frozen=True, slots=True)
class ReplayCache(PartCache):
    """A cache that computes the sampled parts again and compares them with their records."""

    drawn: Mapping[str, records.Part]
    """Records of the sampled parts, by label."""
    left: set[str]
    """Labels of parts that are still to be replayed."""
    spoiled: dict[str, str]
    """Descriptions of the differences that were found, by label."""
    is_training: Callable[[str], bool]
    """Function that returns whether a label is that of a training run, which is read from the cache
    instead of being repeated.
    """

    def make_part(
        self,
        label: str,
        make: Callable[[PartProgress], dict[str, Any]],
        key: str | None = None,
        notes: Mapping[str, float] | None = None,
    ) -> dict[str, Any]:
        """Compute a part and compare it if it is in the sample; otherwise return an empty part.

        Raises:
            AllReplayed: this was the last part of the sample.
        """
        del notes
        if label not in self.left:
            part = Part(label, make, key)
            kept = self._load(part) if self.is_training(label) else None
            return Unplayed() if kept is None else kept
        recorded = self.drawn[label]
        if (key or self.key) == recorded.key:
            replayed = _replay_part(make, recorded)
        else:
            difference = "its settings differ from those of its record"
            replayed = ReplayedPart(Unplayed(), difference)
        if replayed.difference:
            self.spoiled[label] = replayed.difference
        self.left.discard(label)
        self.progress(1.0, label)
        if not self.left:
            raise AllReplayed
        return replayed.part

    def make_parts(self, parts: Sequence[Part], one_core: bool = False) -> list[dict[str, Any]]:
        """Call `make_part` for each part, one after the other."""
        del one_core
        return [self.make_part(part.label, part.make, part.key, part.notes) for part in parts]


class ReplayedPart(NamedTuple):
    """A part that was computed again, and its difference from the record."""

    part: dict[str, Any]
    difference: str
    """Description of the difference from the record, or "" if there is none."""


def _replay_part(
    make: Callable[[PartProgress], dict[str, Any]], recorded: records.Part
) -> ReplayedPart:
    """Compute a part again, and compare it with its record."""
    try:
        part = json.loads(json.dumps(make(lambda share: None)))
    except LACKING:
        raise
    except Exception as error:  # any error means that the part is not reproduced
        return ReplayedPart(Unplayed(), f"it fails with {type(error).__name__}: {error}")
    difference = records.describe_difference(recorded.summary, records.summarize(part))
    return ReplayedPart(part, difference)


def main(arguments: Arguments) -> int:
    """Sample, replay and compare parts, and print the outcome; return 0 if nothing differs."""
    console, began_s = Console(), time.monotonic()
    seed = arguments.seed
    if seed is None:
        seed = int(datetime.date.today().strftime("%Y%m%d"))
    outcome = Outcome(seed, arguments.share)
    known = {}
    for name in list_commands(arguments.only) or COMMANDS:
        known[name] = records.read(name)
        if why := explain_skip(name, known[name]):
            outcome.skipped[name] = why
            console.print(f"{name}: not replayed, {why}", highlight=False, soft_wrap=True)
    able = {name: record for name, record in known.items() if name not in outcome.skipped}
    choices, outcome.too_long = list_candidates(able, 60 * arguments.longest)
    outcome.n_parts = len(choices)
    rng = np.random.default_rng(seed)
    outcome.drawn, n_anywhere = draw(choices, arguments.share, rng)
    minutes = sum(able[name].parts[label].seconds
                  for name, labels in outcome.drawn.items() for label in labels) / 60  # fmt: skip
    n_drawn = sum(map(len, outcome.drawn.values()))
    console.print(f"{n_drawn} of {len(choices)} parts, about {minutes:.1f} min; seed {seed}",
                  style="bold", highlight=False)  # fmt: skip
    for name, labels in outcome.drawn.items():
        replay(name, able[name], labels, outcome, console)
    n_drawn -= sum(map(len, outcome.lacking.values()))
    outcome.finds_share = compute_found_share(len(choices), n_anywhere)
    outcome.finds_scattered_share = compute_found_share(len(choices), n_drawn)
    outcome.seconds = round(time.monotonic() - began_s, 1)
    write_whole(arguments.out, json.dumps(asdict(outcome), indent=1))
    for sentence in describe(outcome):
        console.print(sentence, highlight=False, soft_wrap=True)
    is_incomplete = bool(outcome.skipped or outcome.lacking)
    return int(bool(outcome.spoiled) or (arguments.strict and is_incomplete))


def explain_skip(name: str, record: records.Record) -> str:
    """Return the reason why no part of a study can be replayed, or "" if a part can."""
    if name not in REPLAYS:
        return "it stores no parts; only a complete run verifies its numbers"
    if why := results.explain_stale(name):
        return f"it is stale already: {why}"
    if not record.parts:
        return "it has no recorded parts; the next `make results` records them"
    return ""


class Candidates(NamedTuple):
    """Parts of studies from which the sample is taken, and parts that take too long."""

    choices: dict[tuple[str, str], float]
    """Computing times of the parts from which the sample is taken, by study and label [s]."""
    too_long: dict[str, list[str]]
    """Labels of parts that take too long, by study."""


def list_candidates(able: Mapping[str, records.Record], longest_s: float) -> Candidates:
    """Separate the reproducible parts into candidates and those that take too long."""
    choices, too_long = dict[tuple[str, str], float](), dict[str, list[str]]()
    for name, record in able.items():
        for label, part in record.parts.items():
            if REPLAYS[name].is_repeatable(label):
                if part.seconds > longest_s:
                    too_long.setdefault(name, []).append(label)
                else:
                    choices[name, label] = part.seconds
    return Candidates(choices, too_long)


class Draw(NamedTuple):
    """The random sample of parts."""

    drawn: dict[str, list[str]]
    """Labels of the sampled parts, by study."""
    n_anywhere: int
    """Number of parts that were sampled from all parts with equal probability."""


def draw(choices: Mapping[tuple[str, str], float], share: float, rng: np.random.Generator) -> Draw:
    """Sample a fraction of all parts, and one part of each row that is not represented yet.

    Args:
        choices: computing times of the parts [s], by study and label. The fraction is sampled with
            equal probabilities; the additional parts are sampled with a preference for short times.
        share: fraction of all parts that is sampled.
        rng: random generator.
    """
    n_anywhere = math.ceil(share * len(choices))
    parts = list(choices)
    picked = {parts[k] for k in rng.permutation(len(parts))[:n_anywhere].tolist()}
    rows: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for name, label in choices:
        rows.setdefault((name, find_row(name, label)), []).append((name, label))
    for row in rows.values():
        if picked.isdisjoint(row):
            weights = np.array([1 / (1 + choices[part]) for part in row])
            picked.add(row[int(rng.choice(len(row), p=weights / weights.sum()))])
    drawn: dict[str, list[str]] = {}
    for name, label in choices:
        if (name, label) in picked:
            drawn.setdefault(name, []).append(label)
    return Draw(drawn, n_anywhere)


def replay(
    name: str, record: records.Record, labels: Sequence[str], outcome: Outcome, console: Console
) -> None:
    """Replay parts of a study, and store the differences in its record."""
    study, out = REPLAYS[name], results.OUT / name
    drawn = {label: record.parts[label] for label in labels}

    def say(share: float, label: str) -> None:
        del share
        words = cache.spoiled.get(label, "the same")
        console.print(f"{name} {label}: {words}", highlight=False, soft_wrap=True)

    cache = ReplayCache(out / "parts", "", 1, say, drawn, set(labels), {}, study.is_training)
    try:
        with suppress(AllReplayed):
            notes = {label: part.notes for label, part in drawn.items()}
            study.walk(ReplayInput(cache, out, notes))
    except LACKING as error:
        console.print(f"{name}: {error}", highlight=False, soft_wrap=True)
        outcome.lacking[name] = sorted(cache.left)
    else:
        for label in sorted(cache.left):
            if study.is_learnt(label):
                outcome.lacking.setdefault(name, []).append(label)
            else:
                cache.spoiled[label] = "the study no longer computes it"
    if cache.spoiled:
        outcome.spoiled[name] = dict(cache.spoiled)
        records.save(name, replace(record, spoiled={**record.spoiled, **cache.spoiled}))


def compute_found_share(n_parts: int, n_drawn: int) -> float | None:
    """Return the minimum fraction of irreproducible parts that a sample detects in 95 % of cases.

    `n_drawn` of `n_parts` parts are sampled with equal probability and without replacement; the
    number of irreproducible parts among them has a hypergeometric distribution. The result is None
    if no fraction is detected with that probability.
    """
    for n_spoiled in range(1, n_parts + 1):
        if 1 - hypergeom.pmf(0, n_parts, n_spoiled, n_drawn) >= CONFIDENCE:
            return n_spoiled / n_parts
    return None


def describe(outcome: Outcome) -> list[str]:
    """Describe the outcome of a verification in sentences."""
    lines = []
    for name, labels in outcome.lacking.items():
        lines.append(f"{name}: {', '.join(labels)} not replayed, as this machine lacks something "
                    "(a trained policy, a download, or OpenGL).")  # fmt: skip
    for name, labels in outcome.too_long.items():
        lines.append(f"{name}: {', '.join(labels)} left out, as they take longer than --longest.")
    for name, spoiled in outcome.spoiled.items():
        lines.append(f"{name} is stale: {len(spoiled)} of its parts differ. "
                    "`python -m benchmarks.results` computes them again.")  # fmt: skip
    n_drawn = sum(map(len, outcome.drawn.values()))
    n_spoiled = sum(map(len, outcome.spoiled.values()))
    lines.append(f"{n_drawn} parts were drawn, and {n_spoiled} differ, in {outcome.seconds:.0f} s.")
    if outcome.finds_share is not None and outcome.finds_scattered_share is not None:
        lines.append(
            "Such a draw finds a spoiled part with a probability of 95 % if at least "
            f"{100 * outcome.finds_share:.1f} % of the parts are spoiled, at any positions; "
            f"{100 * outcome.finds_scattered_share:.1f} % suffice if they are scattered at random; "
            "it always does if all parts of a row are spoiled."
        )
    return lines


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments, description=__doc__)))
