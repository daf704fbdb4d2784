"""The studies behind the numbers and pictures of the documentation: which command makes what.

A study is what is measured at once; its commands are called one after the other, and each keeps
its results under its own name. Properties that need no table are tests: `tests/properties/`.
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


@dataclass(frozen=True, slots=True)
class Made:
    """Where the experiment of a command is found, with the settings of the command."""

    module: str
    name: str = "make_study"
    """Of a function that makes the experiment; or "STUDY", the experiment itself."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Arguments of the function."""
    wants_out: bool = False
    """Whether the function takes the command's folder, where policies are that have learnt."""

    def make(self, out: Path) -> Experiment[Any]:
        """Return the experiment.

        Args:
            out: the command's folder.
        """
        found: Any = getattr(import_module(self.module), self.name)
        if self.name == "STUDY":
            return found
        return found(out) if self.wants_out else found(**self.options)


@dataclass(frozen=True, slots=True)
class Command:
    """A command, and what of the documentation it makes."""

    command: str
    minutes: float
    """Its budget of time on two cores."""
    depends: tuple[str, ...]
    """Subsystems that its numbers depend on (`behaviour.toml`)."""
    tables: tuple[str, ...] = ()
    """Tables of the documentation: those of its experiment that it fills."""
    pictures: Mapping[str, str] = field(default_factory=dict)
    """Of `docs/pictures/`, and from which file of the command's folder `figures`."""
    quick: str = "--quick"
    """What makes it short; "": nothing does."""
    goes_on: bool = True
    """Whether it keeps what is finished when it is stopped."""
    made: Made | None = None
    """Its experiment; None: it is none."""
    tables_in: str = ""
    """Module whose `TABLES` it fills, if it is no experiment."""
    is_release: bool = False
    """Whether it is called for a release only, as it trains policies for hours."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` unless subsystems are named, and exist."""
        check_subsystems(self.depends)

    @property
    def declared_tables(self) -> Mapping[str, Table]:
        """The tables that are declared for it, by name."""
        found = import_module(self.tables_in).TABLES if self.tables_in else ()
        if self.made is not None:
            found = getattr(self.made.make(Path()), "shown_tables", tuple)()
        return {each.name: each for each in found}


KEYPOINTS = ("env", "tracker", "emulator", "motion")
"""Subsystems behind episodes at level `keypoints`."""
PIXELS = ("env", "tracker", "emulator", "detector", "motion")
"""Subsystems behind episodes at level `pixels` and at all others."""
ALL = (*PIXELS, "shield", "agents")


@dataclass(frozen=True, slots=True)
class Study:
    """Commands that are called one after the other."""

    commands: Mapping[str, Command]
    """By name, as files and folders of results are called."""

    @property
    def minutes(self) -> float:
        """The budget on two cores, without what is for a release only."""
        return sum(each.minutes for each in self.commands.values() if not each.is_release)


def _experiment(name: str, **options: Any) -> Made:
    """Return an experiment of the library, with options of its command."""
    return Made(f"hrc_env.experiments.{name}.experiment", "make_experiment", options)


STUDIES: dict[str, Study] = {
    "footage": Study({
        "footage": Command(
            BENCH + "tracking --real", 1, ("tracker", "detector"), ("footage",), quick="",
            goes_on=False,
            made=Made("benchmarks.recorded.bench", "RecordedBench"),
        ),
        "pictures": Command(
            "python -m docs.make_pictures", 4, ("env", "motion", "agents"), quick="",
            goes_on=False,
        ),
    }),
    "site": Study({
        "site": Command(
            EXPERIMENT + "site", 10, PIXELS, ("site",),
            {"site_figure_3.jpg": "figure_3.png", "site_figure_4.png": "figure_4_particle.png"},
            made=_experiment("site"),
        ),
    }),
    "speed": Study({
        "speed": Command(
            BENCH + "speed", 8, KEYPOINTS, ("speed", "speed_organs"),
            {"speed_organs.png": "organs.png"}, goes_on=False,
            made=Made("benchmarks.speed.bench", "SpeedBench"),
        ),
        "speed_tasks": Command(
            BENCH + "speed --task every", 2, KEYPOINTS, ("speed_tasks",), goes_on=False,
            made=Made("benchmarks.speed.bench", "SpeedBench", {"task": "every"}),
        ),
        "cluster": Command(
            "python -m benchmarks.cluster", 8, (*KEYPOINTS, "agents"), ("cluster",),
            {"ray_metrics.png": "metrics.png"}, goes_on=False,
            made=Made("benchmarks.cluster"),
        ),
    }),
    "ablations": Study({
        "ablations": Command(
            EXPERIMENT + "ablations", 7, KEYPOINTS, ("ablations",),
            {f"ablations_{each}.png": f"{each}.png" for each in ("cameras", "occlusion", "filter")},
            made=_experiment("ablations"),
        ),
        "facing": Command("python -m benchmarks.facing", 3, PIXELS, ("facing",),
            made=Made("benchmarks.facing"),
        ),
    }),
    "tracking": Study({
        "tracking": Command(
            BENCH + "tracking", 38, KEYPOINTS, ("tracking", "tracking_cost"),
            made=Made("benchmarks.tracking.bench", "TrackingBench"),
        ),
    }),
    "impact": Study({
        "impact": Command(
            EXPERIMENT + "impact", 20, ALL,
            ("impact", "lateness"), {"impact_tradeoff.png": "tradeoff.png"},
            made=_experiment("impact"),
        ),
    }),
    "lab": Study({
        "lab": Command(
            EXPERIMENT + "lab --folded heavy", 12, PIXELS, ("lab",),
            {"lab_figure_6.jpg": "figure_6.png"},
            made=_experiment("lab", folded="heavy"),
        ),
    }),
    "perception": Study({
        "perception": Command(
            BENCH + "perception", 22, PIXELS,
            ("pixels_accuracy", "faults", "miscalibration", "appearance", "emulator",
             "emulator_lasting", "speed_pixels"),
            {"emulator.png": "emulator.png"},
            made=Made("benchmarks.perception.bench", "PerceptionBench"),
        ),
        "trueness": Command(
            "python -m assets.emulator.holdout", 8, PIXELS, ("trueness",), quick="--rounds 1",
            tables_in="assets.emulator.holdout",
        ),
    }),
    "tasks": Study({
        "baselines": Command(
            "python -m benchmarks.baselines", 11, (*PIXELS, "agents"), ("baselines",),
            made=Made("benchmarks.baselines", "make_usual", wants_out=True),
        ),
        "experts": Command(
            "python -m benchmarks.experts", 16, (*PIXELS, "agents"), ("experts",),
            made=Made("benchmarks.experts", "STUDY"),
        ),
        "kept": Command(
            "python -m benchmarks.kept", 3, (*KEYPOINTS, "shield", "agents"), ("kept",),
            made=Made("benchmarks.kept"),
        ),
        "learners": Command(
            "python -m benchmarks.learners", 240, (*KEYPOINTS, "agents"), ("learners",),
            is_release=True,
            made=Made("benchmarks.learners", "make_usual", wants_out=True),
        ),
        "limited": Command(
            "python -m benchmarks.limited", 50, (*KEYPOINTS, "shield", "agents"), ("limited",),
            quick="--quick --seeds 0",
            is_release=True,
            made=Made("benchmarks.limited", "make_usual", wants_out=True),
        ),
    }),
    "shield_and_price": Study({
        "shielded": Command(
            "python -m benchmarks.shielded", 6, (*KEYPOINTS, "shield", "agents"), ("shielded",),
            made=Made("benchmarks.shielded", "STUDY"),
        ),
        "price": Command(
            EXPERIMENT + "price --quick", 20, ALL, ("price", "worth"), {"price.png": "price.png"},
            quick="--seeds 3",
            made=_experiment("price", quick=True),
        ),
        "frontier": Command(
            EXPERIMENT + "price", 120, ALL, ("price_elsewhere",),
            quick="", is_release=True,
            made=_experiment("price"),
        ),
    }),
}  # fmt: skip
"""By name, the shortest first."""
COMMANDS: dict[str, Command] = {
    name: command for study in STUDIES.values() for name, command in study.commands.items()
}
"""Of all studies, by name."""


def commands_of(names: Collection[str]) -> tuple[str, ...]:
    """Return the names of commands in order, for names of studies and of commands.

    Raises:
        ConfigError: a name is neither.
    """
    check_names("study", names, {**STUDIES, **COMMANDS})
    found = [
        (name,) if name in COMMANDS and name not in STUDIES else tuple(STUDIES[name].commands)
        for name in names
    ]
    return tuple(dict.fromkeys(each for some in found for each in some))
