"""The studies that produce the numbers and pictures of the documentation, and their commands.

The commands of a study are run one after the other, and each command stores its results under its
name. Properties that need no table are tested in `tests/properties/`.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

from hrc_env.core.errors import check_names
from hrc_env.experiments.report import Table
from hrc_env.experiments.runner import Experiment
from hrc_env.experiments.versions import check_subsystems

EXPERIMENT, BENCH = "python -m hrc_env experiment ", "python -m benchmarks "
"""Prefixes of command lines."""


@dataclass(frozen=True, slots=True)
class ExperimentSource:
    """Reference to the function that creates the experiment of a command, and its arguments."""

    module: str
    """Name of the module that contains the function."""
    name: str = "make_study"
    """Name of the function that creates the experiment, or "STUDY" for a constant that is the
    experiment.
    """
    options: Mapping[str, Any] = field(default_factory=dict)
    """Keyword arguments of the function."""
    needs_out: bool = False
    """Whether the function's argument is the command's folder, which contains trained policies."""

    def make(self, out: Path) -> Experiment[Any]:
        """Create and return the experiment.

        Args:
            out: folder of the command.
        """
        experiment: Any = getattr(import_module(self.module), self.name)
        if self.name == "STUDY":
            return experiment
        return experiment(out) if self.needs_out else experiment(**self.options)


@dataclass(frozen=True, slots=True)
class Command:
    """A command, and the tables and pictures of the documentation that it produces."""

    command: str
    """Command line without the options for its folder and its quick run."""
    minutes: float
    """Time budget on two cores [min]."""
    depends: tuple[str, ...]
    """Names of the subsystems on which the command's numbers depend (`behaviour.toml`)."""
    tables: tuple[str, ...] = ()
    """Names of the tables of the documentation that the command fills."""
    pictures: Mapping[str, str] = field(default_factory=dict)
    """Files in the command's folder `figures`, by the name of the picture in `docs/pictures/`."""
    quick: str = "--quick"
    """Option for a quick run, or "" if there is none."""
    is_resumable: bool = True
    """Whether an interrupted run keeps the results of completed parts."""
    made: ExperimentSource | None = None
    """Source of the command's experiment, or None if it has none."""
    tables_in: str = ""
    """Name of the module that declares the command's `TABLES`, if it has no experiment."""
    is_release: bool = False
    """Whether the command runs only for a release, since it takes hours."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if `depends` is empty or contains an unknown subsystem."""
        check_subsystems(self.depends)

    @property
    def declared_tables(self) -> Mapping[str, Table]:
        """Declarations of the command's tables, by name."""
        declared = import_module(self.tables_in).TABLES if self.tables_in else ()
        if self.made is not None:
            declared = getattr(self.made.make(Path()), "shown_tables", tuple)()
        return {table.name: table for table in declared}


KEYPOINTS = ("env", "tracker", "emulator", "motion")
"""Names of the subsystems that affect episodes at the perception level `keypoints`."""
PIXELS = ("env", "tracker", "emulator", "detector", "motion")
"""Names of the subsystems that affect episodes at any perception level, including `pixels`."""
ALL = (*PIXELS, "shield", "agents")
"""Names of all subsystems."""
PRICE = (*KEYPOINTS, "shield", "agents")
"""Names of the subsystems that affect the price study, which renders no images."""


@dataclass(frozen=True, slots=True)
class Study:
    """A group of commands that are run one after the other."""

    commands: Mapping[str, Command]
    """Commands by name; the names of their result files and folders are the same."""

    @property
    def minutes(self) -> float:
        """Time budget on two cores [min], without commands that run only for a release."""
        return sum(each.minutes for each in self.commands.values() if not each.is_release)


def _find_experiment(name: str, **options: Any) -> ExperimentSource:
    """Return the source of an experiment in `hrc_env.experiments` with the given options."""
    module = f"hrc_env.experiments.{name}.experiment"
    return ExperimentSource(module, "make_experiment", options)


STUDIES: dict[str, Study] = {
    "footage": Study({
        "footage": Command(
            BENCH + "tracking --real", 1, ("tracker", "detector"), ("footage",), quick="",
            is_resumable=False,
            made=ExperimentSource("benchmarks.recorded.bench", "RecordedBench"),
        ),
        "pictures": Command(
            "python -m docs.make_pictures", 4, ("env", "motion", "agents"), quick="",
            is_resumable=False,
        ),
    }),
    "site": Study({
        "site": Command(
            EXPERIMENT + "site", 10, PIXELS, ("site",),
            {"site_figure_3.jpg": "figure_3.png", "site_figure_4.png": "figure_4_particle.png"},
            made=_find_experiment("site"),
        ),
    }),
    "speed": Study({
        "speed": Command(
            BENCH + "speed", 8, KEYPOINTS, ("speed", "speed_organs"),
            {"speed_organs.png": "organs.png"}, is_resumable=False,
            made=ExperimentSource("benchmarks.speed.bench", "SpeedBench"),
        ),
        "speed_tasks": Command(
            BENCH + "speed --task every", 2, KEYPOINTS, ("speed_tasks",), is_resumable=False,
            made=ExperimentSource("benchmarks.speed.bench", "SpeedBench", {"task": "every"}),
        ),
        "peers": Command(
            BENCH + "peers", 6, PIXELS, ("speed_peers", "first_start"), is_resumable=False,
            made=ExperimentSource("benchmarks.speed.peers", "PeersBench"),
        ),
        "pixels": Command(
            "python -m benchmarks.speed.pixels", 8, PIXELS, ("pixels_detector",),
            quick="--episodes 1 --steps 20", is_resumable=False,
            tables_in="benchmarks.speed.pixels",
        ),
        "cluster": Command(
            "python -m benchmarks.cluster", 8, (*KEYPOINTS, "agents"), ("cluster",),
            {"ray_metrics.png": "metrics.png"}, is_resumable=False,
            made=ExperimentSource("benchmarks.cluster"),
        ),
    }),
    "ablations": Study({
        "ablations": Command(
            EXPERIMENT + "ablations", 7, KEYPOINTS, ("ablations",),
            {f"ablations_{each}.png": f"{each}.png" for each in ("cameras", "occlusion", "filter")},
            made=_find_experiment("ablations"),
        ),
        "facing": Command("python -m benchmarks.facing", 3, PIXELS, ("facing",),
            made=ExperimentSource("benchmarks.facing"),
        ),
    }),
    "tracking": Study({
        "tracking": Command(
            BENCH + "tracking", 38, KEYPOINTS, ("tracking", "tracking_cost"),
            made=ExperimentSource("benchmarks.tracking.bench", "TrackingBench"),
        ),
    }),
    "impact": Study({
        "impact": Command(
            EXPERIMENT + "impact", 20, ALL,
            ("impact", "lateness"), {"impact_tradeoff.png": "tradeoff.png"},
            made=_find_experiment("impact"),
        ),
    }),
    "lab": Study({
        "lab": Command(
            EXPERIMENT + "lab --folded-network heavy", 12, PIXELS, ("lab",),
            {"lab_figure_6.jpg": "figure_6.png"},
            made=_find_experiment("lab", folded_network="heavy"),
        ),
    }),
    "perception": Study({
        "perception": Command(
            BENCH + "perception", 22, PIXELS,
            ("pixels_accuracy", "faults", "miscalibration", "appearance", "emulator",
             "emulator_lasting", "speed_pixels"),
            {"emulator.png": "emulator.png"},
            made=ExperimentSource("benchmarks.perception.bench", "PerceptionBench"),
        ),
        "trueness": Command(
            "python -m assets.emulator.holdout", 8, PIXELS, ("trueness",), quick="--rounds 1",
            tables_in="assets.emulator.holdout",
        ),
    }),
    "tasks": Study({
        "baselines": Command(
            "python -m benchmarks.baselines", 11, (*PIXELS, "agents"), ("baselines",),
            made=ExperimentSource("benchmarks.baselines", "make_default", needs_out=True),
        ),
        "experts": Command(
            "python -m benchmarks.experts", 16, (*PIXELS, "agents"), ("experts",),
            made=ExperimentSource("benchmarks.experts", "STUDY"),
        ),
        "kept": Command(
            "python -m benchmarks.kept", 3, (*KEYPOINTS, "shield", "agents"), ("kept",),
            made=ExperimentSource("benchmarks.kept"),
        ),
        "budgets": Command(
            BENCH + "budgets", 5, (*KEYPOINTS, "shield", "agents"), ("budgets",),
            made=ExperimentSource("benchmarks.budgets"),
        ),
        "learners": Command(
            "python -m benchmarks.learners", 240, (*KEYPOINTS, "agents"), ("learners",),
            is_release=True,
            made=ExperimentSource("benchmarks.learners", "make_default", needs_out=True),
        ),
        "limited": Command(
            "python -m benchmarks.limited", 50, (*KEYPOINTS, "shield", "agents"), ("limited",),
            quick="--quick --seeds 0",
            is_release=True,
            made=ExperimentSource("benchmarks.limited", "make_default", needs_out=True),
        ),
    }),
    "shield_and_price": Study({
        "under_shield": Command(
            "python -m benchmarks.under_shield", 560, (*KEYPOINTS, "shield", "agents"),
            (),  # as above
            quick="--quick --seeds 0 --learners qp bare", is_release=True,
            made=ExperimentSource("benchmarks.under_shield", "make_default", needs_out=True),
        ),
        "shielded": Command(
            "python -m benchmarks.shielded", 6, (*KEYPOINTS, "shield", "agents"), ("shielded",),
            made=ExperimentSource("benchmarks.shielded", "STUDY"),
        ),
        "ranks": Command(
            BENCH + "ranks", 12, (*KEYPOINTS, "shield", "agents"), ("ranks", "ranks_policies"),
            made=ExperimentSource("benchmarks.ranks", "RanksBench"),
        ),
        "rare": Command(
            BENCH + "rare", 30, (*KEYPOINTS, "shield", "agents"), ("rare",), is_release=True,
            made=ExperimentSource("benchmarks.rare.bench", "RareBench"),
        ),
        "adversary": Command(
            BENCH + "adversary", 30, (*KEYPOINTS, "shield", "agents"),
            (),  # here and below, tables are listed with the results of the first run
            is_release=True,
            made=ExperimentSource("benchmarks.adversary.bench", "AdversaryBench"),
        ),
        "price": Command(
            EXPERIMENT + "price", 135, PRICE, ("price", "worth"), {"price.png": "frontier.png"},
            is_release=True,
            made=_find_experiment("price"),
        ),
    }),
}  # fmt: skip
"""Studies by name, in the order of increasing duration."""
COMMANDS: dict[str, Command] = {
    name: command for study in STUDIES.values() for name, command in study.commands.items()
}
"""Commands of all studies, by name."""


def list_commands(names: Collection[str]) -> tuple[str, ...]:
    """Expand names of studies and commands to names of commands, in order.

    Raises:
        ConfigError: a name is neither a study nor a command.
    """
    check_names("study", names, {**STUDIES, **COMMANDS})
    groups = [
        (name,) if name in COMMANDS and name not in STUDIES else tuple(STUDIES[name].commands)
        for name in names
    ]
    return tuple(dict.fromkeys(name for group in groups for name in group))
