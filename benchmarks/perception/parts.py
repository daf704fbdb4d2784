"""The parts of the perception bench: what is done in each, and what becomes of it."""

import zlib
from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from assets.emulator.validate import error_ratios
from benchmarks.perception import loops, phantoms, sheet, speed
from benchmarks.perception.crops import Instant, Looked, Looker, instants
from benchmarks.perception.families import in_turns
from benchmarks.perception.loops import Episode, episode_of
from benchmarks.perception.measured import EMULATED, NO_FAULT, PIXELS, Measured
from benchmarks.perception.settings import PerceptionBenchConfig
from benchmarks.perception.views import PLAIN, View, view_of
from hrc_env.core.results import Metric
from hrc_env.perception import vino
from hrc_env.perception.faults.fault import IMAGE, KINDS
from hrc_env.scene.build import SCENES, Scene, SceneConfig, build
from hrc_env.scene.domain_randomization import APPEARANCES, AS_BUILT, draw_look
from hrc_env.scene.rigs import RIGS

LENSES = {"pinhole": "lab", "fisheye": "lab_gopro"}
"""Rigs that hang in the same places, by the rows that their crops make."""
FIRST_SEED = 500
"""Of episodes; the others count up."""
BLOCK = 5
"""Episodes of a part: so many are lost at most when the bench is stopped."""
KEPT_CROPS = sheet.N_CROPS
"""The worst so many crops of every part are kept until all are known."""


class Task(NamedTuple):
    """One part of the bench."""

    label: str
    cost: float
    """How long it takes beside the others, roughly [s]."""
    make: Callable[[Callable[[float], None]], dict[str, Any]]
    take: Callable[[dict[str, Any], Measured], None]
    """Puts what was made where it belongs."""


def tasks_of(config: PerceptionBenchConfig, out: Path) -> Iterator[Task]:
    """All parts, times last."""
    yield from _crops(config, out)
    yield from _episodes(config)
    yield from _faults(config)
    for scene, _ in config.episodes:
        make = partial(_phantoms, scene, config.n_empty)
        yield Task(f"empty.{scene}", 0.1 * config.n_empty, make, _take_phantoms)
    if config.emulator_rounds is not None:
        make = partial(_emulator, config.emulator_rounds)
        yield Task("emulator", 40.0 * max(2 * config.emulator_rounds, 1), make, _take_emulator)
    yield from _speeds(config)


def _speeds(config: PerceptionBenchConfig) -> Iterator[Task]:
    """The lab in all sizes; its largest rig once more on the site and on the other runtime."""
    most, fewest = max(config.cameras), min(config.workers)
    runtimes = (speed.LITERT, speed.OPENVINO) if vino.installed() else (speed.LITERT,)
    settings = [
        *(speed.Setting(c, w) for c in config.cameras for w in config.workers),
        speed.Setting(most, fewest, scene="site"),
        *(speed.Setting(most, fewest, runtime=runtime) for runtime in runtimes[1:]),
    ]
    for setting in settings:
        make = partial(_speed, setting, config.speed_steps)
        cost = 2 + 0.02 * config.speed_steps * setting.cameras * setting.workers
        yield Task(f"speed.{setting.name}", cost, make, partial(_take_speed, setting.name))
    for runtime in runtimes:
        make = partial(_network, runtime)
        yield Task(f"network.{runtime}", 3, make, partial(_take_network, runtime))


def _episodes(config: PerceptionBenchConfig) -> Iterator[Task]:
    for scene, n in config.episodes:
        for first in range(0, n, BLOCK):
            seeds = [FIRST_SEED + k for k in range(first, min(first + BLOCK, n))]
            make = partial(_play, seeds, config.n_steps, scene=scene, perception=PIXELS)
            cost = 2 + 0.05 * config.n_steps * len(seeds)
            yield Task(f"loop.{scene}.{first}", cost, make, partial(_take_loop, scene))


def _faults(config: PerceptionBenchConfig) -> Iterator[Task]:
    """Every fault at the levels that know it; at `keypoints` also the same without."""
    for kind in config.kinds:
        make = partial(_play_fault, kind, config.n_faults, config.fault_steps, PIXELS)
        slow = 3.0 if kind == "motion_blur" else 1.2
        cost = 8 + slow * 0.05 * config.fault_steps * config.n_faults
        yield Task(f"fault.{PIXELS}.{kind}", cost, make, partial(_take_fault, (PIXELS, kind)))
        if KINDS[kind].group != IMAGE:
            yield _emulated(kind, config)
    yield _emulated(NO_FAULT, config)


def _emulated(kind: str, config: PerceptionBenchConfig) -> Task:
    make = partial(_play_fault, kind, config.n_emulated, config.n_steps, EMULATED)
    cost = 1 + 0.0015 * config.n_steps * config.n_emulated
    return Task(f"fault.{EMULATED}.{kind}", cost, make, partial(_take_fault, (EMULATED, kind)))


def _play(
    seeds: list[int], n_steps: int, tick: Callable[[float], None], **arguments: Any
) -> dict[str, Any]:
    episodes = loops.play(seeds, n_steps, tick, **arguments)
    return {"episodes": [episode.to_json() for episode in episodes]}


def _play_fault(
    kind: str, n: int, n_steps: int, level: str, tick: Callable[[float], None]
) -> dict[str, Any]:
    """Episodes in which the cameras have a fault in turns."""
    episodes: list[Episode | None] = [None] * n
    n_cameras = len(SCENES["lab"].cameras)
    for c in range(min(n_cameras, n)):
        mine = list(range(c, n, n_cameras))
        faults = [] if kind == NO_FAULT else [loops.rotated(kind, c, n_cameras)]
        seeds = [FIRST_SEED + k for k in mine]
        part = len(mine) / n
        played = loops.play(
            seeds, n_steps, lambda s, part=part: tick(part * s), perception=level, faults=faults
        )
        for k, episode in zip(mine, played, strict=True):
            episodes[k] = episode
    return {"episodes": [episode.to_json() for episode in episodes if episode]}


def _crops(config: PerceptionBenchConfig, out: Path) -> Iterator[Task]:
    """Crops of every body in every scene; of one body through every lens, in every appearance."""
    n = config.n_instants
    cost = 3 + 0.12 * n
    for name, _ in config.episodes:
        for body in config.bodies:
            scene = partial(build, SceneConfig(), name, 1, body)
            label = f"crops.{PLAIN}.{name}.{body}"
            make = partial(_look, label, PLAIN, scene, n, out)
            yield Task(label, cost, make, _take_views)
    for row, rig in LENSES.items():
        scene = partial(build, SceneConfig(cameras=RIGS[rig]), "lab", 1, config.bodies[0])
        label = f"crops.lens.{row}"
        make = partial(_look, label, f"lens {row}", scene, 2 * n, out)
        yield Task(label, 2 * cost, make, _take_views)
    for row in APPEARANCES:
        scene = partial(build, SceneConfig(), "lab", 1, config.bodies[0])
        label = f"crops.appearance.{row}"
        make = partial(_look, label, f"appearance {row}", scene, n, out)
        yield Task(label, cost, make, _take_views)


def _look(
    label: str, variant: str, scene: Callable[[], Scene], n: int, out: Path,
    tick: Callable[[float], None],
) -> dict[str, Any]:  # fmt: skip
    """n moments; every activity has its turn. The worst crops are kept as pictures."""
    place = scene()
    rng = np.random.default_rng(zlib.crc32(f"{place.name} {place.bodies[0]}".encode()))
    looker, views, kept = Looker(place), list[View](), 0
    appearance = APPEARANCES.get(variant.removeprefix("appearance "), AS_BUILT)
    for k, now in enumerate(instants(place, n, rng, in_turns())):
        if appearance != AS_BUILT:
            looker.randomize(draw_look(appearance, 1, np.random.default_rng([FIRST_SEED, k])))
        looked = looker.detect(now)
        for c in np.flatnonzero(looked.in_view).tolist():
            view = _view(variant, place, now, looked, c)
            if _is_bad(view, views):
                name = f"parts/crops/{label}.{kept}.png"
                sheet.keep(out / name, _picture(looker, looked, c, view))
                view, kept = _view(variant, place, now, looked, c, name), kept + 1
            views.append(view)
        tick(1 / n)
    looker.close()
    return {"views": [asdict(view) for view in views]}


def _is_bad(view: View, before: list[View]) -> bool:
    """Whether a crop is among the worst so far of its part: of those missed, or of the others."""
    alike = [v for v in before if v.picture and (v.error is None) == (view.error is None)]
    return sum((v.error or 0.0) >= (view.error or 0.0) for v in alike) < KEPT_CROPS


def _view(
    variant: str, scene: Scene, now: Instant, looked: Looked, c: int, picture: str | None = None
) -> View:
    error = float(looked.error[c])
    return View(
        variant=variant,
        scene=scene.name,
        body=scene.bodies[0],
        activity=now.activity,
        camera=scene.cameras[c].name,
        distance_m=float(looked.distance_m[c]),
        angle_deg=float(looked.angle_deg[c]),
        error=error if np.isfinite(error) else None,
        picture=picture,
    )


def _picture(looker: Looker, looked: Looked, c: int, view: View) -> np.ndarray:
    window = looked.windows[c]
    if window is None:
        side = looker.renderer.size_px
        return np.zeros((round(sheet.SCALE * side),) * 2 + (3,), np.uint8)
    said = "missed" if view.error is None else f"{100 * view.error:.0f} %"
    text = f"{view.scene} {view.activity}: {said}"
    places = looker.image_px(c, looked.found_px[c]), looker.image_px(c, looked.true_px[c])
    return sheet.marked(looker.crop(c, window), window, *places, text)


def _phantoms(scene: str, n_steps: int, tick: Callable[[float], None]) -> dict[str, Any]:
    return phantoms.count(scene, n_steps, FIRST_SEED, tick)


def _emulator(rounds: int, tick: Callable[[float], None]) -> dict[str, Any]:
    ratios = error_ratios(rounds, say=lambda share, label: tick(share))
    return {name: asdict(metric) for name, metric in ratios.items()}


def _speed(setting: speed.Setting, n_steps: int, tick: Callable[[float], None]) -> dict[str, Any]:
    return {**speed.measure(setting, n_steps, FIRST_SEED, tick), "n": n_steps}


def _network(runtime: str, tick: Callable[[float], None]) -> dict[str, Any]:
    return {"ms": speed.network_ms(runtime, tick)}


def _take_views(part: dict[str, Any], found: Measured) -> None:
    found.views += [view_of(view) for view in part["views"]]


def _take_loop(scene: str, part: dict[str, Any], found: Measured) -> None:
    episodes = [episode_of(episode) for episode in part["episodes"]]
    found.loops.setdefault(scene, []).extend(episodes)


def _take_fault(key: tuple[str, str], part: dict[str, Any], found: Measured) -> None:
    found.faults[key] = [episode_of(episode) for episode in part["episodes"]]


def _take_phantoms(part: dict[str, Any], found: Measured) -> None:
    found.phantoms.append(part)


def _take_emulator(part: dict[str, Any], found: Measured) -> None:
    found.emulator |= {name: Metric(**metric) for name, metric in part.items()}


def _take_speed(name: str, part: dict[str, Any], found: Measured) -> None:
    found.speed[name] = part


def _take_network(runtime: str, part: dict[str, Any], found: Measured) -> None:
    found.network_ms[runtime] = part["ms"]
