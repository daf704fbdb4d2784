"""The studies behind the numbers and pictures of the documentation: which command makes what."""

from collections.abc import Mapping
from dataclasses import dataclass, field

EXPERIMENT, BENCH = "python -m hrc_env experiment ", "python -m hrc_env bench "


@dataclass(frozen=True, slots=True)
class Study:
    """A command, and what of the documentation it makes."""

    command: str
    minutes: float
    """How long it takes on two cores, about."""
    modules: tuple[str, ...]
    """Numbers depend on these, on what they import of this repository, and on all data."""
    tables: tuple[str, ...] = ()
    """Files in `docs/results/`."""
    pictures: Mapping[str, str] = field(default_factory=dict)
    """Of `docs/pictures/`, and from which file of the command's folder `figures`."""
    quick: str = "--quick"
    """What makes it short; "": nothing does."""
    goes_on: bool = True
    """Whether it keeps what is finished when it is stopped."""
    is_keyed: bool = True
    """Whether what it keeps says by what code it was made; otherwise other code begins anew."""


STUDIES: dict[str, Study] = {
    "occlusion": Study(
        "python -m benchmarks.occlusion", 0.2, ("benchmarks.occlusion",), ("occlusion",),
        goes_on=False,
    ),
    "starts": Study(
        "python -m benchmarks.tracking.starts", 4, ("benchmarks.tracking.starts",),
        ("starts", "locks"), quick="--seeds 4", goes_on=False,
    ),
    "surprises": Study(
        "python -m benchmarks.tracking.surprises", 3, ("benchmarks.tracking.surprises",),
        ("surprises",), quick="--seeds 2", goes_on=False,
    ),
    "forecast": Study(
        "python -m benchmarks.prediction", 1, ("benchmarks.prediction",), ("forecast",),
        goes_on=False,
    ),
    "work": Study(
        "python -m benchmarks.work_mix", 10, ("benchmarks.work_mix", "agents.scripted"),
        ("people", "activities"), quick="--episodes 4", goes_on=False,
    ),
    "speed": Study(
        BENCH + "speed", 7, ("benchmarks.speed.bench",), ("speed", "speed_organs"),
        {"speed_organs.png": "organs.png"}, goes_on=False,
    ),
    "speed_tasks": Study(
        BENCH + "speed --task every", 4, ("benchmarks.speed.bench",), ("speed_tasks",),
        goes_on=False,
    ),
    "footage": Study(
        BENCH + "tracking --real", 3, ("benchmarks.recorded.bench",), ("footage",), quick="",
        goes_on=False,
    ),
    "learning": Study(
        "python -m benchmarks.learning --timesteps 450000", 6,
        ("benchmarks.learning", "agents.training", "agents.ppo"), ("learning",),
        {"learning.png": "curves.png"}, quick="--timesteps 8192", is_keyed=False,
    ),
    "facing": Study(
        "python -m benchmarks.facing", 12, ("benchmarks.facing",), ("facing",), goes_on=False,
    ),
    "site": Study(
        EXPERIMENT + "site", 15, ("hrc_env.experiments.site.experiment",), ("site",),
        {"site_figure_3.jpg": "figure_3.png", "site_figure_4.png": "figure_4_particle.png"},
    ),
    "lab": Study(
        EXPERIMENT + "lab --folded heavy", 30, ("hrc_env.experiments.lab.experiment",), ("lab",),
        {"lab_figure_6.jpg": "figure_6.png"},
    ),
    "tracking": Study(
        BENCH + "tracking", 35, ("benchmarks.tracking.bench",), ("tracking", "tracking_cost"),
    ),
    "perception": Study(
        BENCH + "perception", 50, ("benchmarks.perception.bench",),
        ("pixels_accuracy", "faults", "miscalibration", "appearance", "emulator",
         "emulator_lasting", "speed_pixels"),
        {"emulator.png": "emulator.png"},
    ),
    "acquisition": Study(
        "python -m benchmarks.perception.acquisition", 60, ("benchmarks.perception.acquisition",),
        ("acquisition",), quick="--seeds 2 --still 1 --moving 1",
    ),
    "trueness": Study(
        "python -m assets.emulator.holdout", 40, ("assets.emulator.holdout",), ("trueness",),
        quick="--rounds 1", is_keyed=False,
    ),
    "imported": Study(
        "python -m assets.emulator.imported", 8, ("assets.emulator.imported",),
        ("imported", "imported_joints"), quick="--rounds 1",
    ),
    "fuzz": Study(
        "python -m benchmarks.tracking.fuzz", 30, ("benchmarks.tracking.fuzz",), ("fuzz",),
        quick="--cases 2", goes_on=False,
    ),
    "baselines": Study(
        "python -m benchmarks.baselines", 30,
        ("benchmarks.baselines", "agents.training", "agents.ppo"), ("baselines",), is_keyed=False,
    ),
    "experts": Study(
        "python -m benchmarks.experts", 60, ("benchmarks.experts", "agents.experts"), ("experts",),
    ),
    "learners": Study(
        "python -m benchmarks.learners", 240,
        ("benchmarks.learners", "agents.training", "agents.ppo", "agents.sac", "agents.experts"),
        ("learners",), is_keyed=False,
    ),
    "shielded": Study(
        "python -m benchmarks.shielded", 20, ("benchmarks.shielded", "agents.scripted"),
        ("shielded",),
    ),
    "limited": Study(
        "python -m benchmarks.limited", 30,
        ("benchmarks.limited", "agents.training", "agents.ppo", "agents.ppo_lagrangian"),
        ("limited",),
        quick="--seeds 0 --timesteps 8192 --fast-timesteps 8192 --episodes 2", is_keyed=False,
    ),
    "ablations": Study(
        EXPERIMENT + "ablations", 45, ("hrc_env.experiments.ablations.experiment",), ("ablations",),
        {f"ablations_{name}.png": f"{name}.png" for name in ("cameras", "occlusion", "filter")},
    ),
    "impact": Study(
        EXPERIMENT + "impact", 60, ("hrc_env.experiments.impact.experiment",),
        ("impact", "lateness"), {"impact_tradeoff.png": "tradeoff.png"},
    ),
    "price": Study(
        EXPERIMENT + "price --trainings", 240,
        ("hrc_env.experiments.price.experiment", "agents.experts", "agents.ppo"),
        ("price", "worth", "price_elsewhere", "blindness"), {"price.png": "price.png"},
        quick="--quick --seeds 3",
    ),
    "pictures": Study(
        "python -m docs.make_pictures", 2, ("hrc_env.env", "benchmarks.gallery.still"), quick="",
        goes_on=False,
    ),
}  # fmt: skip
"""By name, the shortest first."""
