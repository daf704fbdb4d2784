"""The perception benchmark: speed of detection, accuracy, and effects of camera faults.

Each part is written to DIR/parts as soon as it is complete, and an interrupted run continues from
there. Parts with other versions or settings are computed again. Times are measured last.
"""

import zlib
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from assets.emulator.validate import error_ratios
from benchmarks.perception import episodes, speed
from benchmarks.perception.crops import Looker, instants
from benchmarks.perception.declaration import TABLES
from benchmarks.perception.metrics import EMULATED, NO_FAULT, PIXELS, compute_metrics
from benchmarks.perception.report import report
from benchmarks.perception.views import PLAIN, View, list_activities
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric
from hrc_env.engines.local import Serial
from hrc_env.experiments.cache import Part, PartCache, PartProgress
from hrc_env.experiments.report import Metrics, Report, Table, describe_quick_run
from hrc_env.experiments.rigs import DT_S
from hrc_env.experiments.runner import check_at_least_one, is_as_short
from hrc_env.perception import vino
from hrc_env.perception.faults.fault import IMAGE, KINDS, FaultConfig
from hrc_env.scene.build import SCENES, Scene, SceneConfig, build
from hrc_env.scene.domain_randomization import APPEARANCES, AS_BUILT, draw_look
from hrc_env.scene.rigs import RIGS
from hrc_env.worker.body import worker_names

LENSES = {"pinhole": "lab", "fisheye": "lab_gopro"}
"""Names of rigs with equally placed cameras but different lenses, by name of the table row."""
FIRST_SEED = 500
"""Seed of the first episode and of the crops."""
BLOCK = 5
"""Number of episodes in a part; small parts limit the loss when a run is interrupted."""

Parts = dict[str, dict[str, Any]]
"""Results of completed parts, by label."""


@dataclass(frozen=True, slots=True)
class PerceptionBench:
    """Benchmark of perception from pixels and its emulator."""

    name = "bench perception"
    depends = ("env", "tracker", "emulator", "detector", "motion")
    episodes: tuple[tuple[str, int], ...] = (("lab", 15), ("site", 8))
    """Number of episodes at `pixels`, by scene. The first episodes in the lab are the baseline for
    faults.
    """
    n_steps: int = 250
    """Number of steps of each of these episodes."""
    n_faults: int = 4
    """Number of episodes of each fault at `pixels`, over which the faulty camera alternates."""
    fault_steps: int = 150
    """Number of steps of each of these episodes."""
    n_emulated: int = 20
    """Number of episodes of each fault at `keypoints`; each episode has `n_steps` steps."""
    kinds: tuple[str, ...] = tuple(KINDS)
    """Names of the camera faults."""
    bodies: tuple[str, ...] = worker_names()
    """Names of the bodies in the crops."""
    n_instants: int = 15
    """Number of moments for each body in each scene and for each lens, with four crops each."""
    emulator_rounds: int | None = 2
    """Number of times that each motion is rendered in each scene to compare the emulator with
    detections in images.

    With 0, each motion is rendered once in a single scene; with None, the emulator is not
    evaluated.
    """
    cameras: tuple[int, ...] = (1, 2, 4)
    """Numbers of cameras for which the speed is measured."""
    workers: tuple[int, ...] = (1, 2)
    """Numbers of workers for which the speed is measured."""
    speed_steps: int = 200
    """Number of steps in each measurement of speed."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a number is invalid."""
        counts = ("n_steps", "n_faults", "fault_steps", "n_emulated", "n_instants", "speed_steps")
        check_at_least_one(self, *counts)
        if self.n_faults > dict(self.episodes).get("lab", 0) or self.fault_steps > self.n_steps:
            raise ConfigError(
                "Faults are compared with the lab's first episodes: n_faults must not exceed their "
                f"number nor fault_steps n_steps, got {self.n_faults} and {self.fault_steps}."
            )
        if not self.bodies:
            raise ConfigError(f"bodies must be some of {worker_names()}.")

    @property
    def seeds(self) -> list[int]:
        """Seeds of the episodes."""
        return [FIRST_SEED + k for k in range(max(n for _, n in self.episodes))]

    @property
    def n_parts(self) -> int:
        """Number of parts of the benchmark, which are cached separately."""
        return len(list(make_tasks(self)))

    @property
    def quick_note(self) -> str:
        """Warning for the tables and figures of a short run, or "" if the run is long enough."""
        is_short = is_as_short(self, QUICK)
        return describe_quick_run(self.n_emulated, self.n_steps * DT_S) if is_short else ""

    def settings(self) -> dict[str, Any]:
        """Return the settings on which all results depend."""
        return {"bench": asdict(self)}

    def play(self, cache: PartCache) -> Parts:
        """Return the results of all parts by label, computed or from the cache."""
        tasks = list(make_tasks(self, cache.folder.parent / "figures"))
        cache = replace(cache, n_parts=sum(task.cost for task in tasks))
        away = [task for task in tasks if not task.is_here]
        parts = cache.make_parts([task.part for task in away], one_core=True)
        played = {task.label: part for task, part in zip(away, parts, strict=True)}
        here = replace(cache, engine=Serial())
        for task in tasks:
            if task.is_here:
                (played[task.label],) = here.make_parts([task.part])
        return played

    def metrics(self, played: Parts) -> dict[str, Metric]:
        """Return all metrics of the results, by name."""
        return compute_metrics(played, self.n_faults, self.fault_steps)

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the tables that this benchmark fills in the documentation."""
        return TABLES

    def report(self, played: Parts, metrics: Metrics, figures: Path) -> Report:
        """Return the report, with its tables and figures."""
        return report(self, played, metrics, figures)


QUICK = PerceptionBench(
    episodes=(("lab", 4), ("site", 2)), n_steps=80, n_faults=4, fault_steps=40,
    n_emulated=8, bodies=("worker_1", "worker_2"), n_instants=10, emulator_rounds=0,
    speed_steps=30,
)  # fmt: skip
"""Benchmark settings for a quick run, which computes all numbers from less data."""


class Task(NamedTuple):
    """A part of the benchmark, with the function that computes it."""

    label: str
    cost: float
    """Approximate computing time, relative to that of other parts [s]."""
    make: Callable[[PartProgress], dict[str, Any]]
    is_here: bool = False
    """Whether the part runs alone in this process, since it measures time or saves a figure."""

    @property
    def part(self) -> Part:
        """The part in the form that the cache requires."""
        return Part(self.label, self.make, weight=self.cost)


def make_tasks(config: PerceptionBench, figures: Path | None = None) -> Iterator[Task]:
    """Yield all parts, with time measurements last; the part of the emulator saves a figure."""
    yield from _crops(config)
    yield from _episodes(config)
    yield from _faults(config)
    if config.emulator_rounds is not None:
        make = partial(_emulator, config.emulator_rounds, figures and figures / "emulator.png")
        yield Task("emulator", 40.0 * max(2 * config.emulator_rounds, 1), make, is_here=True)
    yield from _speeds(config)


def _speeds(config: PerceptionBench) -> Iterator[Task]:
    """Yield the parts that measure speed in the lab with all numbers of cameras and workers.

    The largest rig is also measured on the site and with the other runtime.
    """
    most, fewest = max(config.cameras), min(config.workers)
    runtimes = (speed.LITERT, speed.OPENVINO) if vino.is_installed() else (speed.LITERT,)
    settings = [
        *(speed.Setting(c, w) for c in config.cameras for w in config.workers),
        speed.Setting(most, fewest, scene="site"),
        *(speed.Setting(most, fewest, runtime=runtime) for runtime in runtimes[1:]),
    ]
    for setting in settings:
        make = partial(speed.measure, setting, config.speed_steps, FIRST_SEED)
        cost = 2 + 0.02 * config.speed_steps * setting.cameras * setting.workers
        yield Task(f"speed.{setting.name}", cost, make, is_here=True)
    for runtime in runtimes:
        make = partial(speed.network_ms, runtime)
        yield Task(f"network.{runtime}", 3, make, is_here=True)


def _episodes(config: PerceptionBench) -> Iterator[Task]:
    for scene, n in config.episodes:
        for first in range(0, n, BLOCK):
            seeds = [FIRST_SEED + k for k in range(first, min(first + BLOCK, n))]
            make = partial(_play, seeds, config.n_steps, scene=scene, perception=PIXELS)
            cost = 2 + 0.05 * config.n_steps * len(seeds)
            yield Task(f"loop.{scene}.{first}", cost, make)


def _faults(config: PerceptionBench) -> Iterator[Task]:
    """Yield the parts for all faults, and for the baseline at the level `keypoints`."""
    for kind in config.kinds:
        make = partial(_play_fault, kind, config.n_faults, config.fault_steps, PIXELS)
        slow = 3.0 if kind == "motion_blur" else 1.2
        cost = 8 + slow * 0.05 * config.fault_steps * config.n_faults
        yield Task(f"fault.{PIXELS}.{kind}", cost, make)
    emulated = [kind for kind in config.kinds if KINDS[kind].group != IMAGE]
    for kind in (*emulated, NO_FAULT):
        make = partial(_play_fault, kind, config.n_emulated, config.n_steps, EMULATED)
        cost = 1 + 0.0015 * config.n_steps * config.n_emulated
        yield Task(f"fault.{EMULATED}.{kind}", cost, make)


def _play(seeds: list[int], n_steps: int, tick: PartProgress, **arguments: Any) -> dict[str, Any]:
    played = episodes.play(seeds, n_steps, tick, **arguments)
    return {"episodes": [episode.to_json() for episode in played]}


def _play_fault(kind: str, n: int, n_steps: int, level: str, tick: PartProgress) -> dict[str, Any]:
    """Simulate `n` episodes with a fault; the faulty camera alternates between episodes."""
    played: list[dict[str, Any]] = [{}] * n
    n_cameras = len(SCENES["lab"].cameras)
    for c in range(min(n_cameras, n)):
        mine = list(range(c, n, n_cameras))
        faults = [] if kind == NO_FAULT else [FaultConfig(kind, (f"camera_{c + 1}",))]
        seeds, part = [FIRST_SEED + k for k in mine], len(mine) / n
        told = lambda share, part=part: tick(part * share)  # noqa: E731
        some = _play(seeds, n_steps, told, perception=level, faults=faults)["episodes"]
        for k, episode in zip(mine, some, strict=True):
            played[k] = episode
    return {"episodes": played}


def _crops(config: PerceptionBench) -> Iterator[Task]:
    """Yield the parts with crops of all bodies and scenes, and of all lenses and appearances."""
    n, first = config.n_instants, config.bodies[0]
    cost = 3 + 0.12 * n
    for name, _ in config.episodes:
        for body in config.bodies:
            scene = partial(build, SceneConfig(), name, 1, body)
            yield Task(f"crops.{PLAIN}.{name}.{body}", cost, partial(_look, PLAIN, scene, n))
    for row, rig in LENSES.items():
        scene = partial(build, SceneConfig(cameras=RIGS[rig]), "lab", 1, first)
        yield Task(f"crops.lens.{row}", 2 * cost, partial(_look, f"lens {row}", scene, 2 * n))
    for row in APPEARANCES:
        scene = partial(build, SceneConfig(), "lab", 1, first)
        yield Task(f"crops.appearance.{row}", cost, partial(_look, f"appearance {row}", scene, n))


def _look(variant: str, make: Callable[[], Scene], n: int, tick: PartProgress) -> dict[str, Any]:
    """Return the results in the crops of `n` moments; the activities alternate between moments."""
    scene, views = make(), list[View]()
    rng = np.random.default_rng(zlib.crc32(f"{scene.name} {scene.bodies[0]}".encode()))
    appearance = APPEARANCES.get(variant.removeprefix("appearance "), AS_BUILT)
    looker = Looker(scene)
    for k, now in enumerate(instants(scene, n, rng, list_activities())):
        if appearance != AS_BUILT:
            looker.randomize(draw_look(appearance, 1, np.random.default_rng([FIRST_SEED, k])))
        looked = looker.detect(now)
        for c in np.flatnonzero(looked.in_view).tolist():
            error = float(looked.error[c])
            views.append(
                View(
                    variant=variant,
                    scene=scene.name,
                    body=scene.bodies[0],
                    activity=now.activity,
                    distance_m=float(looked.distance_m[c]),
                    angle_deg=float(looked.angle_deg[c]),
                    error=error if np.isfinite(error) else None,
                )
            )
        tick(1 / n)
    looker.close()
    return {"views": [asdict(view) for view in views]}


def _emulator(rounds: int, picture: Path | None, tick: PartProgress) -> dict[str, Any]:
    ratios = error_ratios(rounds, say=lambda share, label: tick(share), picture=picture)
    return {name: asdict(metric) for name, metric in ratios.items()}
