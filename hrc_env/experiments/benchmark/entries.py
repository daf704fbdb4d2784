"""Entries of the leaderboard: what policies were worth, each a JSON file beside this one."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric, write_whole
from hrc_env.experiments.benchmark.conditions import VERSION

FOLDER = Path(__file__).parent / "entries"
PER = {
    "goals_per_minute": "goals a minute",
    "success": "success",
    "cost_per_minute": "cost a minute",
    "towards_per_hour": "contacts towards an hour",
    "contacts_per_hour": "contacts an hour",
}
"""What entries hold of every task and condition, and how tables call it."""
Scores = Mapping[str, Metric]
"""By "ID.CONDITION.WHAT"."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One policy."""

    name: str
    policy: str
    """As `--policy` names it."""
    commit: str
    date: str
    scores: Scores


def entries(folder: Path = FOLDER) -> list[Entry]:
    """All of them by name.

    Raises:
        ConfigError: one is of another version of the benchmark, or is none.
    """
    return [_read(path) for path in sorted(folder.glob("*.json"))]


def enter(entry: Entry, folder: Path = FOLDER) -> Path:
    """Write an entry, in place of one of the same name."""
    path = folder / f"{entry.name}.json"
    kept = {name: m for name, m in entry.scores.items() if name.rsplit(".", 1)[1] in PER}
    scores = {name: [*map(_short, (m.value, m.low, m.high)), m.n] for name, m in kept.items()}
    content: dict[str, Any] = {"version": VERSION, **asdict(entry), "scores": scores}
    lines = json.dumps(content, indent=1).replace("\n   ", " ").replace("\n  ]", "]")
    write_whole(path, lines + "\n")
    return path


def _short(value: float) -> float:
    return float(f"{value:.5g}")


def _read(path: Path) -> Entry:
    try:
        content = json.loads(path.read_text())
        version, scores = content.pop("version"), content.pop("scores")
        if version != VERSION:
            raise ConfigError(
                f"{path} is of version {version} of the benchmark, this is version {VERSION}: "
                "their numbers do not compare. Run it again: python -m hrc_env benchmark."
            )
        metrics = {key: Metric(v, low, high, "", n) for key, (v, low, high, n) in scores.items()}
        return Entry(**content, scores=metrics)
    except (json.JSONDecodeError, KeyError, TypeError, IndexError) as error:
        raise ConfigError(f"{path} is no entry of the benchmark ({error!r}).") from error


def regret(key: str, own: Scores, others: list[Entry]) -> float:
    """Goals a minute that the best entry reaches more under a condition, "ID.CONDITION", among
    those that drive into people no more often; 0 for the best."""
    goals, towards = f"{key}.goals_per_minute", f"{key}.towards_per_hour"
    rivals = [
        each.scores[goals].value
        for each in others
        if goals in each.scores and each.scores[towards].value <= own[towards].value
    ]
    return max(0.0, max(rivals, default=0.0) - own[goals].value)
