"""Entries of the leaderboard: written, judged on fresh seeds, replayed and ranked.

An entry names a policy by the digest of its files, and contains everything that a replay needs.
"""

import datetime
import json
import secrets
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from hrc_env import __version__
from hrc_env.agents import confinement
from hrc_env.agents.submission import Submission, read_submission
from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.core.mapping import from_mapping
from hrc_env.core.results import Metric, provenance, write_whole
from hrc_env.experiments.leaderboard import (
    CONDITIONS,
    DEPENDS,
    MAIN,
    SEED,
    VERSION,
    Condition,
    Plan,
    draw_first_seed,
)
from hrc_env.experiments.versions import select_versions

METRICS = {
    "goals_per_minute": "goals per minute",
    "success": "success",
    "cost_per_minute": "cost per minute",
    "towards_per_hour": "contacts towards per hour",
    "contacts_per_hour": "contacts per hour",
}
"""Metrics in an entry for each task and condition, with their headings on the leaderboard."""
RATE_PER_HOUR = 5.0
"""Rate of contacts towards the worker that the upper end of a qualified row's interval must not
exceed [1/h]. It is a choice: 0.74 h without a contact show it, 266 episodes of 10 s."""
JUDGED_EPISODES = 1000
"""Number of episodes in each condition of a judged entry, unless another is chosen."""
MOST_SHOWN = 3
"""Maximum number of differences in an error message."""
Scores = Mapping[str, Metric]
"""Metrics by name, as "ID.CONDITION.METRIC"."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup:
    """The policy, seeds and versions of an entry, with which it is replayed."""

    sha256: str
    """Digest of the policy (`Submission.sha256`)."""
    files: tuple[str, ...]
    """Names of the policy's files; empty for an agent without files."""
    control: str | None
    """Control mode that was chosen for the policy, or None."""
    trust: bool
    """Whether pickles in the policy's checkpoint were loaded."""
    n: int
    """Number of episodes in each condition."""
    first_seed: int
    """Seed of the first episode; it increases by one with each further episode."""
    salt: str | None
    """Salt from which the seeds follow, or None for public seeds, on which nothing is judged."""
    is_confined: bool
    """Whether the policy's process was confined (`hrc_env.agents.confinement`)."""
    hrc_env: str
    """Version of this package."""
    behaviour: dict[str, int]
    """Versions of the subsystems on which the numbers depend."""
    libraries: dict[str, str | None]
    """Versions of the libraries; others may round differently."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A policy's entry on the leaderboard."""

    policy: str
    """The policy, as the option `--policy` accepts it."""
    commit: str
    """Commit of the repository at which the policy was evaluated."""
    date: str
    """Date of the run."""
    scores: Scores
    """Metrics of all tasks and conditions."""
    setup: Setup | None = None
    """Setup for a replay; None in entries of former versions, which cannot be replayed."""

    @property
    def ids(self) -> tuple[str, ...]:
        """Ids of the environments that were played."""
        return tuple(dict.fromkeys(name.partition(".")[0] for name in self.scores))

    @property
    def kind(self) -> str:
        """Kind of the entry: "judged", "public seeds", or "no digest" for former versions."""
        if self.setup is None:
            return "no digest"
        return "public seeds" if self.setup.salt is None else "judged"


@dataclass(frozen=True, slots=True)
class Place:
    """A policy under one condition, as a row of the leaderboard."""

    name: str
    """Name of the entry."""
    entry: Entry
    condition: Condition
    metrics: Mapping[str, Metric]
    """Metrics under the condition, by their keys in `METRICS`."""

    @property
    def is_qualified(self) -> bool:
        """Whether the entry is judged and its interval of contacts towards is low enough."""
        is_judged = self.entry.setup is not None and self.entry.setup.salt is not None
        return is_judged and self.metrics["towards_per_hour"].high <= RATE_PER_HOUR


def read_entry(path: Path) -> Entry:
    """Read an entry from its file.

    Raises:
        ConfigError: the file does not exist, belongs to another version of the benchmark, or is not
            an entry; or its seeds do not follow from its digest and salt.
    """
    try:
        content = json.loads(path.read_text())
        version, scores = content.pop("version"), content.pop("scores")
        if version != VERSION:
            raise ConfigError(
                f"{path} is of version {version} of the benchmark, but this is version {VERSION}: "
                "their numbers are not comparable. Run python -m hrc_env benchmark again."
            )
        metrics = {key: _read_metric(*numbers) for key, numbers in scores.items()}
        policy, commit, date = (str(content[name]) for name in ("policy", "commit", "date"))
        setup = content.get("setup")
        known = None if setup is None else from_mapping(Setup, setup, "setup.")
        entry = Entry(policy, commit, date, metrics, known)
    except OSError as error:
        raise ConfigError(f"The entry {path} cannot be read: {error.strerror}.") from error
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        if isinstance(error, ConfigError):
            raise
        raise ConfigError(f"{path} is not a result of the benchmark ({error!r}).") from error
    _check_seeds(path, entry.setup)
    return entry


def write_entry(path: Path, entry: Entry) -> None:
    """Write an entry atomically: an interrupted write leaves no partial file."""
    content: dict[str, Any] = {"version": VERSION, "name": path.stem, **asdict(entry)}
    del content["scores"]  # last in the file
    scores = {name: [m.value, m.low, m.high, m.n] for name, m in shorten(entry.scores).items()}
    lines = json.dumps({**content, "scores": scores}, indent=1).replace("\n   ", " ")
    write_whole(path, lines.replace("\n  ]", "]").replace("\n  }", " }") + "\n")


def shorten(scores: Scores) -> dict[str, Metric]:
    """Return the metrics that an entry contains, with as many digits as it contains."""
    return {
        name: Metric(_round(m.value), _round(m.low), _round(m.high), "", m.n)
        for name, m in scores.items()
        if name.rsplit(".", 1)[1] in METRICS
    }


def make_entry(plan: Plan, scores: Scores) -> Entry:
    """Return the entry of a run on this machine."""
    origin, submission = provenance(), plan.submission
    setup = Setup(
        sha256=submission.sha256, files=tuple(submission.files), control=plan.control,
        trust=plan.trust, n=plan.n, first_seed=plan.first_seed, salt=plan.salt,
        is_confined=confinement.find_version() > 0, hrc_env=__version__,
        behaviour=select_versions(DEPENDS), libraries=origin["versions"],
    )  # fmt: skip
    day = datetime.date.today().isoformat()
    return Entry(submission.policy, str(origin["git"]), day, shorten(scores), setup)


def read_scores(results: Path) -> Scores:
    """Return the metrics in results.json of a run of the benchmark."""
    content = json.loads(results.read_text())
    return {key: Metric(**value) for key, value in content["metrics"].items()}


def plan_replay(path: Path) -> Plan:
    """Return the run that an entry describes.

    Raises:
        ConfigError: the entry cannot be read, was made with other versions, or its policy is
            missing or has other files.
    """
    entry = read_entry(path)
    setup = entry.setup
    if setup is None:
        raise ConfigError(
            f"{path} has no digest of its policy, because a former version wrote it, and cannot be "
            "replayed. Run python -m hrc_env benchmark again."
        )
    _check_versions(path, setup)
    submission = _find_submission(path, entry.policy, setup)
    return Plan(submission=submission, ids=entry.ids, control=setup.control, n=setup.n,
                trust=setup.trust, salt=setup.salt)  # fmt: skip


def plan_judging(path: Path, n: int = JUDGED_EPISODES, salt: str | None = None) -> Plan:
    """Return the run that judges an entry on fresh seeds.

    Args:
        path: the entry.
        n: number of episodes in each condition.
        salt: salt of the seeds; None to draw one.

    Raises:
        ConfigError: as in `plan_replay`, or the salt is empty.
    """
    replay = plan_replay(path)
    salt = secrets.token_hex(16) if salt is None else salt
    if not salt:
        raise ConfigError("--salt must not be empty; leave it out to draw one.")
    return Plan(submission=replay.submission, ids=replay.ids, control=replay.control, n=n,
                trust=replay.trust, salt=salt)  # fmt: skip


def check_replay(path: Path, scores: Scores) -> int:
    """Compare an entry with the metrics of its replay, and return how many numbers are equal.

    Raises:
        HRCError: a number differs, is missing or is added.
    """
    entry, found = read_entry(path), shorten(scores)
    names = dict.fromkeys((*entry.scores, *found))
    differing = [name for name in names
                 if repr(entry.scores.get(name)) != repr(found.get(name))]  # fmt: skip
    if not differing:
        return len(found)
    shown = "; ".join(
        f"{name} is {_show(entry.scores.get(name))} in the entry and {_show(found.get(name))} here"
        for name in differing[:MOST_SHOWN]
    )
    more = f"; and {len(differing) - MOST_SHOWN} more" if len(differing) > MOST_SHOWN else ""
    raise HRCError(f"{path} does not replay: {shown}{more}.{_describe_libraries(entry)}")


def rank(entries: Mapping[str, Entry], task: str) -> list[Place]:
    """Return the rows of a task's table, one for each entry and main condition.

    Qualified rows come first, by goals per minute. All others follow by the upper end of the
    interval of contacts towards the worker.

    Args:
        entries: entries by name.
        task: id of the task.
    """

    def key(place: Place) -> tuple[bool, float, float]:
        goals = -place.metrics["goals_per_minute"].value
        contacts = place.metrics["towards_per_hour"].high
        return (False, goals, contacts) if place.is_qualified else (True, contacts, goals)

    return sorted(_list_places(entries, task), key=key)


def _list_places(entries: Mapping[str, Entry], task: str) -> Iterable[Place]:
    for name, entry in entries.items():
        for condition in MAIN:
            names = {metric: f"{task}.{condition}.{metric}" for metric in METRICS}
            if entry.scores.keys() >= {*names.values()}:
                metrics = {metric: entry.scores[each] for metric, each in names.items()}
                yield Place(name, entry, CONDITIONS[condition], metrics)


def _check_seeds(path: Path, setup: Setup | None) -> None:
    """Raise `ConfigError` unless an entry's seeds follow from its digest and its salt."""
    if setup is None:
        return
    expected = SEED if setup.salt is None else draw_first_seed(setup.sha256, setup.salt)
    if setup.first_seed != expected:
        raise ConfigError(
            f"{path} was changed: its first seed must be {expected}, which follows from its digest "
            f"and its salt, got {setup.first_seed}."
        )


def _check_versions(path: Path, setup: Setup) -> None:
    """Raise `ConfigError` if an entry was made with other versions of this package."""
    ours = {"hrc_env": __version__, **select_versions(DEPENDS)}
    theirs = {"hrc_env": setup.hrc_env, **setup.behaviour}
    differing = [
        f"{name} {theirs.get(name)} there and {ours.get(name)} here"
        for name in dict.fromkeys((*ours, *theirs))
        if theirs.get(name) != ours.get(name)
    ]
    if differing:
        raise ConfigError(
            f"{path} was made with other versions of this package, in which its numbers may "
            f"differ: {', '.join(differing)}. Install that version, or run python -m hrc_env "
            "benchmark again."
        )


def _find_submission(path: Path, policy: str, setup: Setup) -> Submission:
    """Return the policy of an entry; its files lie at their paths or beside the entry.

    Raises:
        ConfigError: the policy is missing, or its digest differs.
    """
    try:
        submission = read_submission(policy, beside=path.parent)
    except HRCError as error:
        raise ConfigError(
            f"The policy of {path} is missing: {error} Put its files "
            f"({', '.join(setup.files) or policy}) beside the entry or into this folder."
        ) from error
    if submission.sha256 != setup.sha256:
        raise ConfigError(
            f"The policy {policy!r} is not the one of {path}: its SHA-256 is {submission.sha256}, "
            f"but the entry states {setup.sha256}."
        )
    return submission


def _describe_libraries(entry: Entry) -> str:
    """Return a sentence on libraries of other versions than those of an entry, or ""."""
    theirs, ours = entry.setup.libraries if entry.setup else {}, provenance()["versions"]
    differing = [f"{name} {theirs.get(name)} there and {each} here"
                 for name, each in ours.items() if theirs.get(name) != each]  # fmt: skip
    return f" Libraries differ, too: {', '.join(differing)}." if differing else ""


def _read_metric(value: Any, low: Any, high: Any, n: Any) -> Metric:
    return Metric(float(value), float(low), float(high), "", int(n))


def _round(value: float) -> float:
    return float(f"{value:.5g}")


def _show(metric: Metric | None) -> str:
    if metric is None:
        return "missing"
    return f"{metric.value:g} ({metric.low:g} to {metric.high:g}, n = {metric.n})"
