"""Whether recorded numbers still come out: python -m benchmarks.verify --share .02

Replays a share of all recorded parts, drawn at random, and at least one of every row of parts
(those whose labels begin with the same words: a scene, a task, a pair of eyes), and compares them
with what `docs/results/parts/` holds. Of a training the evaluation of its kept policy is replayed,
where the policy is on this machine. A part that differs makes its study stale:
`python -m benchmarks.results --list` says so, and the next `make results` makes all of its parts
again.

    python -m benchmarks.verify                      # 2 % of all parts, with the day's seed
    python -m benchmarks.verify --only site lab --share 1 --longest 60
    python -m benchmarks.verify --strict             # fails as well where nothing is recorded
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
from typing import Any

import numpy as np
import tyro
from rich.console import Console
from scipy.stats import hypergeom

from benchmarks import records, results
from benchmarks.replays import REPLAYS, Replayed, row_of
from benchmarks.studies import COMMANDS, commands_of
from hrc_env.core.errors import (
    ConfigError,
    DownloadError,
    MissingExtraError,
    RenderingError,
)
from hrc_env.core.results import write_whole
from hrc_env.experiments.cache import Part, PartCache, PartProgress

CONFIDENCE = 0.95
LACKING = (DownloadError, MissingExtraError, RenderingError)
"""Errors of a machine that lacks something; they say nothing of a part."""


@dataclass(frozen=True)
class Arguments:
    """Replay some recorded parts and compare them with what is kept."""

    share: float = 0.02
    """Share of all parts that is replayed; at least one of every row is."""
    only: tuple[str, ...] = ()
    """Studies; all if not given."""
    seed: int | None = None
    """Seed of the draw; the date as a number if not given."""
    longest: float = 5.0
    """Parts that took more minutes than this are left out, and named."""
    strict: bool = False
    """Fail as well if a study has no recorded parts, or parts that cannot be replayed here."""
    out: Path = Path("out/verify.json")
    """File for the outcome."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` for numbers that cannot work."""
        if not 0 <= self.share <= 1:
            raise ConfigError(f"--share must be in [0, 1], got {self.share}.")
        if not self.longest > 0:
            raise ConfigError(f"--longest must be positive, got {self.longest}.")
        commands_of(self.only)


@dataclass(slots=True)
class Outcome:
    """The outcome of a run."""

    seed: int
    share: float
    n_parts: int = 0
    """Number of parts that could be drawn."""
    drawn: dict[str, list[str]] = field(default_factory=dict)
    """Labels by study."""
    spoiled: dict[str, dict[str, str]] = field(default_factory=dict)
    """Labels by study, and in which way they differ."""
    skipped: dict[str, str] = field(default_factory=dict)
    """Studies of which nothing could be replayed, and why."""
    lacking: dict[str, list[str]] = field(default_factory=dict)
    """Labels by study that were drawn and could not be replayed on this machine."""
    too_long: dict[str, list[str]] = field(default_factory=dict)
    """Labels by study that were left out of the draw."""
    finds_share: float | None = None
    """If this share of the parts is spoiled, wherever they are, one is found in 95 of 100 runs."""
    finds_scattered_share: float | None = None
    """The same where spoiled parts are scattered at random over all rows."""
    seconds: float = 0.0


class AllReplayed(Exception):  # noqa: N818  this ends a replay, and is no error
    """Everything that was drawn of a study has been replayed."""


class Unplayed(dict[str, Any]):
    """A part that was not drawn: an empty list under every key."""

    def __missing__(self, key: str) -> list[Any]:
        return []


@dataclass(frozen=True, slots=True)
class ReplayCache(PartCache):
    """A cache that makes the parts that were drawn, and compares them with the recorded ones."""

    drawn: Mapping[str, records.Part]
    """By label."""
    left: set[str]
    """Labels that are still to be replayed."""
    spoiled: dict[str, str]
    """Labels of parts that differ, and in which way."""
    is_training: Callable[[str], bool]
    """Whether the part of a label is a training, whose kept part is handed out."""

    def part(
        self,
        label: str,
        make: Callable[[PartProgress], dict[str, Any]],
        key: str | None = None,
        notes: Mapping[str, float] | None = None,
    ) -> dict[str, Any]:
        """Make the part and compare it, if it was drawn; else return an empty one.

        Raises:
            AllReplayed: it was the last.
        """
        del notes
        if label not in self.left:
            asked = Part(label, make, key)
            kept = self._load(asked) if self.is_training(label) else None
            return Unplayed() if kept is None else kept
        recorded = self.drawn[label]
        if (key or self.key) == recorded.key:
            part, words = _make(make, recorded)
        else:
            part, words = Unplayed(), "it is made with other settings than it was recorded with"
        if words:
            self.spoiled[label] = words
        self.left.discard(label)
        self.progress(1.0, label)
        if not self.left:
            raise AllReplayed
        return part

    def parts(self, parts: Sequence[Part], one_core: bool = False) -> list[dict[str, Any]]:
        """Return what `part` does, one after the other."""
        del one_core
        return [self.part(each.label, each.make, each.key, each.notes) for each in parts]


def _make(
    make: Callable[[PartProgress], dict[str, Any]], recorded: records.Part
) -> tuple[dict[str, Any], str]:
    """Return a part that is made again, and how it differs from the recorded one."""
    try:
        part = json.loads(json.dumps(make(lambda share: None)))
    except LACKING:
        raise
    except Exception as error:  # whatever it is, the part no longer comes out
        return Unplayed(), f"it fails with {type(error).__name__}: {error}"
    return part, records.describe_difference(recorded.summary, records.summarize(part))


def main(arguments: Arguments) -> int:
    """Draw, replay, compare, report; 0 if nothing differs."""
    console, began_s = Console(), time.monotonic()
    seed = arguments.seed
    if seed is None:
        seed = int(datetime.date.today().strftime("%Y%m%d"))
    outcome = Outcome(seed, arguments.share)
    known = {}
    for name in commands_of(arguments.only) or COMMANDS:
        known[name] = records.read(name)
        if why := why_not(name, known[name]):
            outcome.skipped[name] = why
            console.print(f"{name}: not replayed, {why}", highlight=False, soft_wrap=True)
    able = {name: record for name, record in known.items() if name not in outcome.skipped}
    choices, outcome.too_long = candidates(able, 60 * arguments.longest)
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
    outcome.finds_share = found_share(len(choices), n_anywhere)
    outcome.finds_scattered_share = found_share(len(choices), n_drawn)
    outcome.seconds = round(time.monotonic() - began_s, 1)
    write_whole(arguments.out, json.dumps(asdict(outcome), indent=1))
    for sentence in describe(outcome):
        console.print(sentence, highlight=False, soft_wrap=True)
    is_incomplete = bool(outcome.skipped or outcome.lacking)
    return int(bool(outcome.spoiled) or (arguments.strict and is_incomplete))


def why_not(name: str, record: records.Record) -> str:
    """Return why nothing of a study can be replayed; "" if something can."""
    if name not in REPLAYS:
        return "it keeps no parts; only a whole run of it verifies its numbers"
    if why := results.why_stale(name):
        return f"it is stale already: {why}"
    if not record.parts:
        return "no parts of it are recorded; the next `make results` records them"
    return ""


def candidates(
    able: Mapping[str, records.Record], longest_s: float
) -> tuple[dict[tuple[str, str], float], dict[str, list[str]]]:
    """Return how long parts take that can be drawn [s], by study and label; and those that take
    too long."""
    choices, too_long = dict[tuple[str, str], float](), dict[str, list[str]]()
    for name, record in able.items():
        for label, part in record.parts.items():
            if REPLAYS[name].is_repeatable(label):
                if part.seconds > longest_s:
                    too_long.setdefault(name, []).append(label)
                else:
                    choices[name, label] = part.seconds
    return choices, too_long


def draw(
    choices: Mapping[tuple[str, str], float], share: float, rng: np.random.Generator
) -> tuple[dict[str, list[str]], int]:
    """Draw a share of all parts, then one of every row that has none.

    Args:
        choices: how long each part takes [s], by study and label. The first draw takes all alike;
            the second takes a part the more often the sooner it is replayed.
        share: of all parts.
        rng: draws.

    Returns:
        Labels by study, and how many were drawn from all parts alike.
    """
    n_anywhere = math.ceil(share * len(choices))
    parts = list(choices)
    picked = {parts[k] for k in rng.permutation(len(parts))[:n_anywhere].tolist()}
    rows: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for name, label in choices:
        rows.setdefault((name, row_of(name, label)), []).append((name, label))
    for row in rows.values():
        if picked.isdisjoint(row):
            weights = np.array([1 / (1 + choices[each]) for each in row])
            picked.add(row[int(rng.choice(len(row), p=weights / weights.sum()))])
    drawn: dict[str, list[str]] = {}
    for name, label in choices:
        if (name, label) in picked:
            drawn.setdefault(name, []).append(label)
    return drawn, n_anywhere


def replay(
    name: str, record: records.Record, labels: Sequence[str], outcome: Outcome, console: Console
) -> None:
    """Replay parts of a study; note in its record those that differ."""
    how, out = REPLAYS[name], results.OUT / name
    drawn = {label: record.parts[label] for label in labels}

    def say(share: float, label: str) -> None:
        del share
        words = cache.spoiled.get(label, "the same")
        console.print(f"{name} {label}: {words}", highlight=False, soft_wrap=True)

    cache = ReplayCache(out / "parts", "", 1, say, drawn, set(labels), {}, how.is_training)
    try:
        with suppress(AllReplayed):
            how.walk(Replayed(cache, out, {label: part.notes for label, part in drawn.items()}))
    except LACKING as error:
        console.print(f"{name}: {error}", highlight=False, soft_wrap=True)
        outcome.lacking[name] = sorted(cache.left)
    else:
        for label in sorted(cache.left):
            if how.is_learnt(label):
                outcome.lacking.setdefault(name, []).append(label)
            else:
                cache.spoiled[label] = "the study no longer makes it"
    if cache.spoiled:
        outcome.spoiled[name] = dict(cache.spoiled)
        records.save(name, replace(record, spoiled={**record.spoiled, **cache.spoiled}))


def found_share(n_parts: int, n_drawn: int) -> float | None:
    """Return the least share of spoiled parts of which a draw finds one with 95 %.

    Of `n_parts` parts `n_drawn` are drawn, all alike and each once, so that the number of spoiled
    parts among them is hypergeometric. None: no share is found so surely.
    """
    for n_spoiled in range(1, n_parts + 1):
        if 1 - hypergeom.pmf(0, n_parts, n_spoiled, n_drawn) >= CONFIDENCE:
            return n_spoiled / n_parts
    return None


def describe(outcome: Outcome) -> list[str]:
    """Return lines about an outcome."""
    lines = []
    for name, labels in outcome.lacking.items():
        lines.append(f"{name}: {', '.join(labels)} not replayed, as this machine lacks something "
                    "(a policy that was learnt, a download, or what draws images).")  # fmt: skip
    for name, labels in outcome.too_long.items():
        lines.append(f"{name}: {', '.join(labels)} left out, as they take longer than --longest.")
    for name, spoiled in outcome.spoiled.items():
        lines.append(f"{name} is stale: {len(spoiled)} of its parts differ. "
                    "`python -m benchmarks.results` makes it again.")  # fmt: skip
    n_drawn = sum(map(len, outcome.drawn.values()))
    n_spoiled = sum(map(len, outcome.spoiled.values()))
    lines.append(f"{n_drawn} parts were drawn, and {n_spoiled} differ, in {outcome.seconds:.0f} s.")
    if outcome.finds_share is not None and outcome.finds_scattered_share is not None:
        lines.append(
            "Such a draw finds a spoiled part with 95 % if at least "
            f"{100 * outcome.finds_share:.1f} % of the parts are spoiled, wherever they are; "
            f"{100 * outcome.finds_scattered_share:.1f} % suffice if they are scattered at random; "
            "and always if all parts of a row are."
        )
    return lines


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments, description=__doc__)))
