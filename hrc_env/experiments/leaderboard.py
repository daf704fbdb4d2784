"""The benchmark of policies with fixed conditions and seeds, and the entries of the leaderboard."""

import datetime
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from hrc_env.agents.registry import find_control
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric, provenance, write_whole
from hrc_env.evaluation.sums import ACHIEVED
from hrc_env.experiments.columns import per_minute, rate, share_of_tries
from hrc_env.experiments.report import Table
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.experiments.study import Row, Study
from hrc_env.safety.incidents import KINDS
from hrc_env.tasks import BUILT_IN
from hrc_env.tasks.task import find_task

VERSION = 1
"""Version of the conditions, seeds and counts. Numbers of different versions cannot be compared."""
SEED = 5_000_000
"""Seed of the first episode, far from those of training and of other evaluations."""
SETUPS = {
    "truth": ("the truth", PerceptionSetup("truth")),
    "keypoints": ("four cameras", PerceptionSetup()),
    "late": ("four cameras, 200 ms late", PerceptionSetup(latency_s=0.2)),
    "one": ("one camera after 1 s", PerceptionSetup(n_cameras=1)),
}
"""Perception setups with their descriptions, by name. Delayed images carry time stamps."""
COLUMNS = (
    per_minute(ACHIEVED, "goals per minute", name="goals_per_minute"),
    share_of_tries("success", digits=2),
    *(
        rate(f"contacts_{kind}", words, name=f"{kind}_per_hour", per="hour", digits=0)
        for kind, words in zip(
            ("towards", "fleeing", "standing"),
            ("contacts per hour: towards", "fleeing", "standing"),
            strict=True,
        )
    ),
    per_minute("cost", "cost per minute"),
    rate([f"contacts_{kind}" for kind in KINDS], name="contacts_per_hour", per="hour"),
)
ABOUT = """\
Performance and safety of a policy, on fixed seeds. A contact is *towards* if the robot moved
towards the worker when it began, *fleeing* if it moved away, else *standing*; contacts and cost
are computed from the truth."""


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition of the benchmark: the people, the perception and the shield."""

    people: str = "unaware"
    """Kind of people, which determines how they react to the robot."""
    setup: str = "keypoints"
    """Name of the perception setup in `SETUPS`."""
    shield: str | None = None
    """Name of the shield, or None for no shield."""

    @property
    def name(self) -> str:
        """Name of the condition in results.json."""
        return f"{self.people}.{self.setup}.{self.shield or 'none'}"

    @property
    def words(self) -> str:
        """Description of the condition in tables."""
        shield = "no shield" if self.shield is None else f"shield `{self.shield}`"
        return f"{self.people} people, {SETUPS[self.setup][0]}, {shield}"


def _make_conditions() -> tuple[Condition, ...]:
    """Return conditions of all people with four cameras, and of unaware people with other setups.

    Each of them is listed without and with a shield.
    """
    bare = [Condition(people) for people in ("unaware", "hurried", "attentive")]
    bare += [Condition(setup=setup) for setup in SETUPS if setup != "keypoints"]
    return tuple(replace(each, shield=shield) for each in bare for shield in (None, "qp"))


CONDITIONS = {condition.name: condition for condition in _make_conditions()}
"""Conditions by name, in the order of tables."""
MAIN = (Condition().name, Condition(shield="qp").name)
"""Names of the conditions that the leaderboard shows."""


def make_study(
    policy: str,
    ids: Sequence[str] = tuple(BUILT_IN),
    control: str | None = None,
    n_seeds: int = 64,
    trust: bool = False,
) -> Study:
    """Return the study that evaluates a policy under all conditions.

    Args:
        policy: the policy as `hrc_env.agents.registry.make_agent` accepts it.
        ids: ids of the environments; a learnt policy fits only one environment.
        control: control mode of the policy's actions; None: that of the policy's file, or joint
            velocities if the file contains none.
        n_seeds: number of episodes per row.
        trust: whether pickles in the policy's checkpoint may be loaded, as in `make_agent`.

    Raises:
        ConfigError: the policy or an environment does not exist, or `n_seeds` is below 1.
    """
    for task in ids:
        find_task(task)
    control = control or find_control(policy)
    env = {} if control is None else {"control": control}
    rows = {
        f"{task}.{name}": Row(
            each.words, n_seeds, policy, setup=SETUPS[each.setup][1],
            env={"task": task, "people": each.people, "shield": each.shield, **env}, trust=trust,
        )
        for task in ids
        for name, each in CONDITIONS.items()
    }  # fmt: skip
    shown = [column for column in COLUMNS if column.heading]
    tables = tuple(
        Table(task, task, {f"{task}.{name}": (each.words,) for name, each in CONDITIONS.items()},
              shown, ("condition",))
        for task in ids
    )  # fmt: skip
    return Study(
        name=f"benchmark, version {VERSION}", title=f"Benchmark: {policy}", about=ABOUT,
        depends=("env", "tracker", "emulator", "motion", "shield", "agents"), first_seed=SEED,
        rows=rows, columns=COLUMNS, tables=tables,
    )  # fmt: skip


ENTRY_METRICS = {
    "goals_per_minute": "goals per minute",
    "success": "success",
    "cost_per_minute": "cost per minute",
    "towards_per_hour": "contacts towards per hour",
    "contacts_per_hour": "contacts per hour",
}
"""Metrics in an entry for each task and condition, with their headings on the leaderboard."""
Scores = Mapping[str, Metric]
"""Metrics by name, as "ID.CONDITION.METRIC"."""


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


def read_entry(path: Path) -> Entry:
    """Read an entry from its file.

    Raises:
        ConfigError: the file belongs to another version of the benchmark, or is not an entry.
    """
    try:
        content = json.loads(path.read_text())
        version, scores = content.pop("version"), content.pop("scores")
        if version != VERSION:
            raise ConfigError(
                f"{path} is of version {version} of the benchmark, but this is version {VERSION}: "
                "their numbers are not comparable. Run python -m hrc_env benchmark again."
            )
        metrics = {key: Metric(v, low, high, "", n) for key, (v, low, high, n) in scores.items()}
        return Entry(content["policy"], content["commit"], content["date"], metrics)
    except (json.JSONDecodeError, KeyError, TypeError, ValueError) as error:
        if isinstance(error, ConfigError):
            raise
        raise ConfigError(f"{path} is not a result of the benchmark ({error!r}).") from error


def write_entry(path: Path, entry: Entry) -> None:
    """Write an entry atomically: an interrupted write leaves no partial file."""
    selected = {
        name: m for name, m in entry.scores.items() if name.rsplit(".", 1)[1] in ENTRY_METRICS
    }
    scores = {name: [*map(_shorten, (m.value, m.low, m.high)), m.n] for name, m in selected.items()}
    content: dict[str, Any] = {"version": VERSION, "name": path.stem, **asdict(entry)}
    lines = json.dumps({**content, "scores": scores}, indent=1)
    write_whole(path, lines.replace("\n   ", " ").replace("\n  ]", "]") + "\n")


def add_entry(path: Path, policy: str, results: Path) -> None:
    """Write a policy's entry to `path`, based on the file results.json of its benchmark run."""
    content = json.loads(results.read_text())
    scores = {key: Metric(**value) for key, value in content["metrics"].items()}
    git, day = str(provenance()["git"]), datetime.date.today().isoformat()
    write_entry(path, Entry(policy, git, day, scores))


def _shorten(value: float) -> float:
    return float(f"{value:.5g}")
