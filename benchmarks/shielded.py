"""What the shield keeps and what it costs: python -m benchmarks.shielded

Goals, contacts and cost of the scripted reacher, which drives to its goals whoever is near, beside
people who take no notice of it: without a shield, and under `qp` with the eyes of each row. A row's
episodes are the first so many of the same seeds, and so are those that its throughput is a share
of. Finished parts stay in the folder: a run that was stopped goes on where it was.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from rich.console import Console

from benchmarks.common import publish
from hrc_env.agents.registry import make_agent
from hrc_env.cli.checks import writable_folder
from hrc_env.cli.progress import progress_bar
from hrc_env.core.results import Metric
from hrc_env.evaluation.episodes import play_episodes
from hrc_env.evaluation.intervals import goals_over, mean_over, rate_of, ratio_over
from hrc_env.experiments.cache import PartCache, PartProgress
from hrc_env.experiments.report import Column, Report, table_of
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.experiments.versions import key_of
from hrc_env.perception.faults.fault import ALL, FaultConfig
from hrc_env.safety.incidents import KINDS
from hrc_env.scene.rigs import RIGS

DEPENDS = ("env", "tracker", "emulator", "motion", "shield", "agents")
"""Subsystems that finished parts depend on."""
FOUR = PerceptionSetup()
TASK, SCENE, SEED = "HRCReach-v0", "lab", 8_000_000
"""The last: of the first episode."""
TOGETHER = 250
"""So many episodes are a part, played side by side."""
BLIND = (FaultConfig("lost", (ALL,), None, 3.0, 6.0),)
STOP = {"kind": "qp", "unknown_m_s": 0.0}
Episodes = list[dict[str, float]]


@dataclass(frozen=True, slots=True)
class Row:
    """Beside whom, with which eyes, under which shield."""

    says: str
    n_episodes: int
    eyes: PerceptionSetup = FOUR
    shield: str | Mapping[str, Any] | None = "qp"
    of: str = "bare"
    """Its throughput is a share of this row's."""
    faults: tuple[FaultConfig, ...] = ()
    more: Mapping[str, Any] = field(default_factory=lambda: {"people": "unaware"})
    """Arguments of the environment."""


ROWS: Mapping[str, Row] = {
    "bare": Row("four cameras, no shield", 2000, shield=None),
    "four": Row("four cameras", 2000),
    "truth": Row("the truth", 500, PerceptionSetup("truth")),
    "one": Row("one camera after 1 s", 1000, PerceptionSetup(n_cameras=1)),
    "late": Row("200 ms late, which is told", 1000, PerceptionSetup(latency_s=0.2)),
    "untold": Row("200 ms late, untold", 1000, PerceptionSetup(latency_s=0.2, is_told=False)),
    "blind": Row("all cameras lost from 3 to 6 s", 500, faults=BLIND),
    "blind_stop": Row("the same, and unknown is to stop", 500, shield=STOP, faults=BLIND),
    "nobody_bare": Row("nobody there, no shield", 250, shield=None, more={"n_workers": 0}),
    "nobody": Row("nobody there", 250, of="nobody_bare", more={"n_workers": 0}),
}
"""By name, in the order in which they are played; a row comes after that which it is a share of."""
COLUMNS = (
    Column("{}.share", "throughput [%]", 1, 100.0),
    Column("{}.goals_per_minute", "goals a minute"),
    *(Column(f"{{}}.{kind}", f"{kind} in 1,000", 1) for kind in KINDS),
    Column("{}.all", "all contacts", 1),
    Column("{}.cost", "cost"),
)


@dataclass(frozen=True)
class Arguments:
    """Count what happens under the shield."""

    out: Path = Path("out/shielded")
    """Folder for results.json, a report and finished parts."""
    quick: bool = False
    """Four episodes of each row."""
    threads: int | None = None
    """Threads that the environments share; all cores by default."""


def main(arguments: Arguments) -> None:
    """Play, print, write."""
    writable_folder(arguments.out)
    n_all = sum(row.n_episodes for row in ROWS.values())
    done: dict[str, Episodes] = {}
    metrics: dict[str, Metric] = {}
    with progress_bar(Console(), "shielded") as progress:
        parts = PartCache(arguments.out / "parts", key(arguments), n_all / TOGETHER, progress)
        for name, row in ROWS.items():
            done[name] = episodes_of(name, row, parts, arguments)
            metrics |= {
                f"{name}.{which}": m for which, m in counts(done[name], done[row.of]).items()
            }
    table = table_of("", {name: row.says for name, row in ROWS.items()}, COLUMNS, metrics)
    settings = {name: value for name, value in asdict(arguments).items() if name != "out"}
    seeds = list(range(SEED, SEED + max(map(len, done.values()))))
    report = Report("Under the shield", (__doc__ or "").strip(), [table])
    publish(arguments.out, report, settings, seeds, metrics)


def key(arguments: Arguments) -> str:
    """Return the key of finished parts."""
    return key_of({"seed": SEED, "quick": arguments.quick}, DEPENDS)


def episodes_of(name: str, row: Row, parts: PartCache, arguments: Arguments) -> Episodes:
    """Statistics of a row's episodes; cameras take turns in being those that are left."""
    n = 4 if arguments.quick else row.n_episodes
    size = min(n, TOGETHER)
    turns = row.eyes.turns_of(RIGS[SCENE])

    def play(first: int, tick: PartProgress) -> dict[str, Any]:
        found: Episodes = []
        every = np.arange(first, first + size)
        for ids, turn in zip(np.array_split(every, len(turns)), turns, strict=True):
            kwargs = {
                "task": TASK, "perception": row.eyes.level, "shield": row.shield,
                "cameras": list(turn.cameras), "faults": [*turn.faults, *row.faults],
                "num_threads": arguments.threads, **row.more,
            }  # fmt: skip
            make = partial(make_agent, "scripted")
            count = partial(lambda share, part: tick(share * part), part=len(ids) / size)
            found += play_episodes(make, len(ids), SEED + int(ids[0]), tick=count, **kwargs)
        return {"episodes": found}

    return [
        episode
        for first in range(0, n, size)
        for episode in parts.part(f"{name}.{first}", partial(play, first))["episodes"]
    ]


def counts(episodes: Episodes, bare: Episodes) -> dict[str, Metric]:
    """Rates of episodes, and their throughput as a share of that of the same seeds in `bare`."""

    def column(name: str, of: Episodes = episodes) -> list[float]:
        return [each[name] for each in of]

    n, minutes = len(episodes), [each["seconds"] / 60 for each in episodes]
    contacts = {kind: column(f"contacts_{kind}") for kind in KINDS}
    return {
        "share": ratio_over(column("goals_reached"), column("goals_reached", bare[:n]), "share"),
        "goals_per_minute": goals_over(column("goals_reached"), minutes),
        **{kind: rate_of(each, n / 1000, "per 1000") for kind, each in contacts.items()},
        "all": rate_of(np.sum(list(contacts.values()), axis=0), n / 1000, "per 1000"),
        "cost": mean_over(column("cost"), "1"),
    }


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
