"""The studies behind the numbers and pictures of the documentation: which command makes what.

A study is what is measured at once; its commands are called one after the other, and each keeps
its results under its own name. Properties that need no table are tests: `tests/properties/`.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from hrc_env.core.errors import check_names
from hrc_env.experiments.versions import check_subsystems

EXPERIMENT, BENCH = "python -m hrc_env experiment ", "python -m benchmarks "


@dataclass(frozen=True, slots=True)
class Command:
    """A command, and what of the documentation it makes."""

    command: str
    minutes: float
    """Its budget of time on two cores."""
    depends: tuple[str, ...]
    """Subsystems that its numbers depend on (`behaviour.toml`)."""
    tables: tuple[str, ...] = ()
    """Files in `docs/results/`."""
    pictures: Mapping[str, str] = field(default_factory=dict)
    """Of `docs/pictures/`, and from which file of the command's folder `figures`."""
    quick: str = "--quick"
    """What makes it short; "": nothing does."""
    goes_on: bool = True
    """Whether it keeps what is finished when it is stopped."""
    is_release: bool = False
    """Whether it is called for a release only, as it trains policies for hours."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` unless subsystems are named, and exist."""
        check_subsystems(self.depends)


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


STUDIES: dict[str, Study] = {
    "footage": Study({
        "footage": Command(
            BENCH + "tracking --real", 1, ("tracker", "detector"), ("footage",), quick="",
            goes_on=False,
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
        ),
    }),
    "speed": Study({
        "speed": Command(
            BENCH + "speed", 8, KEYPOINTS, ("speed", "speed_organs"),
            {"speed_organs.png": "organs.png"}, goes_on=False,
        ),
        "speed_tasks": Command(
            BENCH + "speed --task every", 2, KEYPOINTS, ("speed_tasks",), goes_on=False,
        ),
    }),
    "ablations": Study({
        "ablations": Command(
            EXPERIMENT + "ablations", 7, KEYPOINTS, ("ablations",),
            {f"ablations_{each}.png": f"{each}.png" for each in ("cameras", "occlusion", "filter")},
        ),
        "facing": Command("python -m benchmarks.facing", 3, PIXELS, ("facing",)),
    }),
    "tracking": Study({
        "tracking": Command(
            BENCH + "tracking", 38, KEYPOINTS, ("tracking", "tracking_cost"),
        ),
    }),
    "impact": Study({
        "impact": Command(
            EXPERIMENT + "impact", 20, ALL,
            ("impact", "lateness"), {"impact_tradeoff.png": "tradeoff.png"},
        ),
    }),
    "lab": Study({
        "lab": Command(
            EXPERIMENT + "lab --folded heavy", 12, PIXELS, ("lab",),
            {"lab_figure_6.jpg": "figure_6.png"},
        ),
    }),
    "perception": Study({
        "perception": Command(
            BENCH + "perception", 22, PIXELS,
            ("pixels_accuracy", "faults", "miscalibration", "appearance", "emulator",
             "emulator_lasting", "speed_pixels"),
            {"emulator.png": "emulator.png"},
        ),
        "trueness": Command(
            "python -m assets.emulator.holdout", 8, PIXELS, ("trueness",), quick="--rounds 1",
        ),
    }),
    "tasks": Study({
        "baselines": Command(
            "python -m benchmarks.baselines", 11, (*PIXELS, "agents"), ("baselines",),
        ),
        "experts": Command(
            "python -m benchmarks.experts", 16, (*PIXELS, "agents"), ("experts",),
        ),
        "kept": Command(
            "python -m benchmarks.kept", 3, (*KEYPOINTS, "shield", "agents"), ("kept",),
        ),
        "learners": Command(
            "python -m benchmarks.learners", 240, (*KEYPOINTS, "agents"), ("learners",),
            is_release=True,
        ),
        "limited": Command(
            "python -m benchmarks.limited", 50, (*KEYPOINTS, "shield", "agents"), ("limited",),
            quick="--seeds 0 --timesteps 8192 --fast-timesteps 8192 --episodes 2",
            is_release=True,
        ),
    }),
    "shield_and_price": Study({
        "shielded": Command(
            "python -m benchmarks.shielded", 6, (*KEYPOINTS, "shield", "agents"), ("shielded",),
        ),
        "price": Command(
            EXPERIMENT + "price --quick", 20, ALL, ("price", "worth"), {"price.png": "price.png"},
            quick="--seeds 3",
        ),
        "frontier": Command(
            EXPERIMENT + "price --trainings", 240, ALL, ("price_elsewhere", "blindness"),
            quick="", is_release=True,
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
