"""Whether BlazePose sees our people as people: python benchmarks/bodies.py

Every baked body in every scene; crops as in `benchmarks.perception.crops`. What counts are
those in view: how many are detected, and in how many the joints are on average nearer to the truth
than a tenth of the stature.
"""

import math
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from benchmarks.perception.crops import GOOD_SHARE, Looker, instants
from benchmarks.perception.measured import share
from hrc_env.cli.progress import track
from hrc_env.core.results import Metric, write_results
from hrc_env.core.typing import Image
from hrc_env.render.overlay import draw_landmarks, label, tile
from hrc_env.scene.build import SCENES, Scene, SceneConfig, build
from hrc_env.worker.body import worker_names

N_PICTURED = 40


@dataclass(frozen=True)
class Arguments:
    """Count how well BlazePose sees the workers."""

    out: Path = Path("out/bodies.json")
    """Where to write the results."""
    crops: int = 2000
    """Crops in all, shared out evenly over bodies, scenes and cameras."""
    bodies: tuple[str, ...] = worker_names()
    """Baked bodies."""
    scenes: tuple[str, ...] = tuple(SCENES)
    """Scenes."""
    activities: tuple[str, ...] = ()
    """Moments of these activities, in turns, where one comes within some minutes, else as they
    come; none takes every moment as it comes."""
    seed: int = 0
    pictures: Path | None = None
    """A PNG of the crops that were missed or are bad."""


@dataclass(frozen=True)
class Look:
    """One crop and what came of it."""

    body: str
    scene: str
    activity: str
    camera: str
    in_view: bool
    """All joints in the image, nothing of room or robot before them."""
    detected: bool
    error: float
    """Mean distance of the joints from the truth as a share of the stature; NaN: missed."""

    @property
    def good(self) -> bool:
        """Detected, with a small mean error."""
        return self.detected and self.error < GOOD_SHARE


def looks_at(
    scene: Scene, arguments: Arguments, n: int, rng: np.random.Generator, bad: list[Image]
) -> Iterator[list[Look]]:
    """The looks of n moments in one scene with one body."""
    looker = Looker(scene)
    for now in instants(scene, n, rng, arguments.activities):
        looked, looks = looker.look(now), []
        for c, camera in enumerate(scene.cameras):
            window, error = looked.windows[c], float(looked.error[c])
            if window is None:
                continue
            look = Look(
                scene.bodies[0], scene.name, now.activity, camera.name, bool(looked.in_view[c]),
                bool(np.isfinite(error)), error,
            )  # fmt: skip
            looks.append(look)
            if look.in_view and not look.good and len(bad) < N_PICTURED:
                picture = looker.crop(c, window)
                found = looker.image_px(c, looked.found_px[c])
                draw_landmarks(picture, window, found, np.ones(len(found)))
                label(picture, f"{look.body} {now.activity} {look.error:.2f}", (2, 2), 11)
                bad.append(picture)
        yield looks
    looker.close()


def in_view(looks: list[Look], of: Callable[[Look], bool]) -> Metric:
    """The share of crops in view with a property."""
    return share([of(look) for look in looks if look.in_view])


def report(looks: list[Look]) -> dict[str, Metric]:
    """Print a table a body, an activity and a scene, and give its numbers."""
    table = Table("", "crops", "in view", "detected", "mean error < 10 %", "median error")
    metrics: dict[str, Metric] = {}
    for key in ("body", "activity", "scene", "all"):
        for name in sorted({getattr(look, key, "all") for look in looks}):
            mine = [look for look in looks if getattr(look, key, "all") == name]
            detected, good = in_view(mine, lambda x: x.detected), in_view(mine, lambda x: x.good)
            errors = [look.error for look in mine if look.in_view and look.detected]
            middle = float(np.median(errors)) if errors else math.nan
            metrics |= {f"{name}/detected": detected, f"{name}/good": good}
            row = (f"{detected.value:.1%}", f"{good.value:.1%}", f"{middle:.1%}")
            table.add_row(name, str(len(mine)), str(detected.n), *row, end_section=False)
        table.add_section()
    table.add_row("asked for", "", "", ">= 95 %", ">= 92 %", "")
    Console().print(table)
    return metrics


def main(arguments: Arguments) -> None:
    """Look, count, write."""
    pairs = [(scene, body) for scene in arguments.scenes for body in arguments.bodies]
    n_cameras = len(build(SceneConfig(), pairs[0][0], 1).cameras)
    n = math.ceil(arguments.crops / (len(pairs) * n_cameras))
    looks: list[Look] = []
    bad: list[Image] = []
    for name, body in pairs:
        scene = build(SceneConfig(), name, 1, body)
        rng = np.random.default_rng([arguments.seed, zlib.crc32(f"{name} {body}".encode())])
        found = looks_at(scene, arguments, n, rng, bad)
        for some in track(found, total=n, description=f"{name}, {body}"):
            looks += some
    metrics = report(looks)
    if arguments.pictures and bad:
        arguments.pictures.parent.mkdir(parents=True, exist_ok=True)
        sheet = cv2.cvtColor(
            tile(bad + [np.zeros_like(bad[0])] * (-len(bad) % 8), 8), cv2.COLOR_RGB2BGR
        )
        cv2.imwrite(str(arguments.pictures), sheet)
    config = {
        "crops": arguments.crops, "bodies": arguments.bodies, "scenes": arguments.scenes,
        "activities": arguments.activities,
    }  # fmt: skip
    write_results(arguments.out, config, [arguments.seed], metrics)


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
