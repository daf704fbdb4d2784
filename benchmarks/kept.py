"""What kept policies are worth in today's environments: python -m benchmarks.kept

Policies that `python -m benchmarks.learners` and `python -m benchmarks.limited` made come with the
package, one or more of every task. Each is judged as it learnt and under the shield `qp`, on the
same fixed seeds. Finished parts stay in the folder: a run that was stopped goes on where it was.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import tyro
from rich.console import Console

from benchmarks.common import publish
from hrc_env.agents import policies
from hrc_env.agents.registry import make_agent
from hrc_env.cli.checks import writable_folder
from hrc_env.cli.progress import progress_bar
from hrc_env.core.results import Metric
from hrc_env.evaluation.episodes import EVALUATION_SEED, play_episodes
from hrc_env.evaluation.intervals import goals_over, mean_over, rate_of, share_of
from hrc_env.evaluation.sums import ACHIEVED, FAILED
from hrc_env.experiments.cache import PartCache, PartProgress
from hrc_env.experiments.report import Column, Report, table_of
from hrc_env.experiments.versions import key_of

DEPENDS = ("env", "tracker", "emulator", "motion", "shield", "agents")
"""Subsystems that finished parts depend on."""
SHIELDS: tuple[str | None, ...] = (None, "qp")
Episodes = list[dict[str, float]]
COLUMNS = (
    Column("{}.success", "success", 2),
    Column("{}.goals_per_minute", "goals a minute"),
    Column("{}.cost", "cost"),
    Column("{}.contacts", "contacts", 2),
    Column("{}.towards", "contacts towards in 1,000 episodes", 1),
)


@dataclass(frozen=True)
class Arguments:
    """Judge the policies that come with the package."""

    out: Path = Path("out/kept")
    """Folder for results.json, the report and finished parts."""
    episodes: int = 48
    """Episodes of each row; 4 if quick."""
    threads: int | None = None
    """Threads that the environments share; all cores by default."""
    quick: bool = False
    """Four episodes of each row."""


@dataclass(frozen=True, slots=True)
class Row:
    """A policy, and the shield under which it acts."""

    address: str
    """As hrc://ID/NAME."""
    shield: str | None

    @property
    def name(self) -> str:
        """As metrics and finished parts are called."""
        return f"{self.address.removeprefix(policies.PREFIX)}.{self.shield or 'none'}"


def main(arguments: Arguments) -> None:
    """Judge, print, write."""
    writable_folder(arguments.out)
    found = list(rows())
    metrics: dict[str, Metric] = {}
    with progress_bar(Console(), "judging") as progress:
        parts = PartCache(arguments.out / "parts", key(arguments), len(found), progress)
        for row in found:
            worth = score(played(parts, arguments, row))
            metrics |= {f"{row.name}.{name}": each for name, each in worth.items()}
    says = {row.name: f"`{row.address}`, shield {row.shield or 'none'}" for row in found}
    report = Report(
        "Kept policies", (__doc__ or "").strip(), [table_of("", says, COLUMNS, metrics)]
    )
    settings = {name: value for name, value in asdict(arguments).items() if name != "out"}
    seeds = list(range(EVALUATION_SEED, EVALUATION_SEED + n_episodes(arguments)))
    publish(arguments.out, report, settings, seeds, metrics)


def rows() -> Iterator[Row]:
    """Yield every policy that comes with the package, under each shield."""
    for address in policies.names():
        for shield in SHIELDS:
            yield Row(address, shield)


def n_episodes(arguments: Arguments) -> int:
    """Return how many episodes a row has."""
    return 4 if arguments.quick else arguments.episodes


def key(arguments: Arguments) -> str:
    """Return the key of finished parts."""
    return key_of({"episodes": n_episodes(arguments), "seed": EVALUATION_SEED}, DEPENDS)


def played(parts: PartCache, arguments: Arguments, row: Row) -> Episodes:
    """Return a row's episodes, from the cache or anew; another policy of the name is another."""
    card = policies.read(policies.path_of(row.address))[0]

    def play(tick: PartProgress) -> dict[str, Any]:
        kwargs = {
            "task": card.task, "perception": "keypoints", "control": card.control,
            "shield": row.shield, "num_threads": arguments.threads,
        }  # fmt: skip
        make = partial(make_agent, row.address)
        return {"episodes": play_episodes(make, n_episodes(arguments), tick=tick, **kwargs)}

    label = row.name.replace("/", ".")
    return parts.part(f"{label}.{card.sha256[:12]}", play)["episodes"]


def score(episodes: Episodes) -> dict[str, Metric]:
    """Return success, goals, cost and contacts of episodes."""
    column = {name: [each[name] for each in episodes] for name in episodes[0]}
    n_achieved, n_failed = (int(sum(column[name])) for name in (ACHIEVED, FAILED))
    minutes = [each / 60 for each in column["seconds"]]
    return {
        "success": share_of([True] * n_achieved + [False] * n_failed),
        "goals_per_minute": goals_over(column[ACHIEVED], minutes),
        "cost": mean_over(column["cost"], "1"),
        "contacts": rate_of(column["contacts"], len(episodes), "1"),
        "towards": rate_of(column["contacts_towards"], len(episodes) / 1000, "per 1000"),
    }


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
