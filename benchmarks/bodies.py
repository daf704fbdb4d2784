"""Whether BlazePose sees our people as people: python benchmarks/bodies.py

Every baked body moves as the motion generator has it, in every scene, and is drawn with the
arm somewhere near home. Each camera gives a crop round the true joints, cut as the pipeline
cuts it. What counts are crops with every joint in the image and no room or robot before one
("in view"): how many are detected, and in how many the joints are on average nearer to the
truth than a tenth of the stature.
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
from rich.progress import track
from rich.table import Table

from hrc_env.body import load_body, worker_names, worker_truth
from hrc_env.config import HRCConfig
from hrc_env.geometry.cameras import inside_image, project, projections
from hrc_env.geometry.sight import hidden
from hrc_env.motion import generator
from hrc_env.perception.eyes import Eyes
from hrc_env.perception.windows import window_from_joints
from hrc_env.pictures import draw_landmarks, label, tile
from hrc_env.records import Held, WorkerMotion
from hrc_env.results import Metric, write_results
from hrc_env.scene.build import SCENES, Scene, SceneConfig, build
from hrc_env.scene.render import CropRenderer
from hrc_env.typing import Floats, Image

GOOD_SHARE = 0.10
"""Joints that are on average this share of the stature from the truth are still good."""
STEP_S = 0.04
PAUSE_STEPS = (20, 80)
"""Between two looks pass 0.8 to 3.2 s: another moment of the work, or other work."""
PATIENCE = 200
"""Moments that may pass without a wanted activity before that is given up."""
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


def moments(
    scene: Scene, arguments: Arguments, n: int, rng: np.random.Generator
) -> Iterator[tuple[str, WorkerMotion]]:
    """n moments of a worker's day: the activity and the body (1, 1, S, ...)."""
    body = load_body(scene.bodies[0])
    state = generator.make_state(1, 1, body, HRCConfig().motion, scene.grounds)
    streams = [np.random.default_rng(rng.integers(2**63))]
    generator.reset(state, np.arange(1), streams)
    wanted = arguments.activities
    for k in range(n):
        for _ in range(PATIENCE):
            steps = int(rng.integers(*PAUSE_STEPS))
            generator.advance(state, streams, STEP_S, steps)
            name = generator.activity_names[generator.activity(state)[0, 0]]
            if not wanted or name == wanted[k % len(wanted)]:
                break
        yield name, generator.current(state)


def judge(scene: Scene, motion: WorkerMotion, q: Floats, eyes: Eyes, source: CropRenderer):
    """Look at one moment with every camera.

    Returns:
        In view, looked at, pixels (C, J, 2), error as a share of the stature, all (C, ...), and
        what the eyes saw.
    """
    body, cameras = load_body(scene.bodies[0]), scene.cameras
    joints = worker_truth(body, motion).joints_world[0]
    px, depth_m = (values[0] for values in project(projections(cameras), joints))
    windows = [window_from_joints(*view) for view in zip(px, depth_m, cameras, strict=True)]
    eye_world = np.stack([camera.eye_world for camera in cameras])
    blocked = hidden(scene.surroundings(q[None]), eye_world, joints)[0]
    source.draw(q, alone(motion))
    eyes.forget(0)  # as at a first look: the detector stage must agree
    sight = eyes.look(source, windows) if any(windows) else None
    inside = np.array([inside_image(c, p).all() for c, p in zip(cameras, px, strict=True)])
    focal = np.array([camera.K[0, 0] for camera in cameras])
    stature_px = focal * body.stature_m / depth_m.mean(1)
    found = np.full(px.shape, np.nan) if sight is None else sight.px
    error = np.linalg.norm(found - px, axis=-1).mean(1) / stature_px
    return inside & ~blocked.any(1), windows, found, error


def alone(motion: WorkerMotion) -> WorkerMotion:
    """The first environment's part of a motion, as the renderer takes it: (W, S, ...)."""
    held = motion.held
    return WorkerMotion(
        motion.position_world[0], motion.quaternion_wxyz[0], motion.velocity_world[0],
        motion.angular_velocity_world[0],
        held and Held(held.kind[0], held.position_world[0], held.quaternion_wxyz[0]),
    )  # fmt: skip


def looks_at(
    scene: Scene, arguments: Arguments, n: int, rng: np.random.Generator, bad: list[Image]
) -> Iterator[list[Look]]:
    """The looks of n moments in one scene with one body."""
    eyes, source = Eyes(scene.cameras), CropRenderer(scene)
    spread = np.array(HRCConfig().start_spread_rad)
    for activity, motion in moments(scene, arguments, n, rng):
        q = scene.home_q + rng.uniform(-1, 1, len(spread)) * spread
        in_view, windows, found, error = judge(scene, motion, q, eyes, source)
        looks = []
        for c, camera in enumerate(scene.cameras):
            if windows[c] is None:
                continue
            detected = bool(np.isfinite(error[c]))
            look = Look(
                scene.bodies[0], scene.name, activity, camera.name, bool(in_view[c]), detected,
                float(error[c]),
            )  # fmt: skip
            looks.append(look)
            if look.in_view and not look.good and len(bad) < N_PICTURED:
                picture = np.array(source.crop(c, windows[c]))
                draw_landmarks(picture, windows[c], found[c], np.ones(len(found[c])))
                label(picture, f"{look.body} {activity} {look.error:.2f}", (2, 2), 11)
                bad.append(picture)
        yield looks
    eyes.close()
    source.close()


def share(looks: list[Look], of: Callable[[Look], bool]) -> Metric:
    """The share of crops in view with a property, with Wilson's 95 % interval."""
    seen = [of(look) for look in looks if look.in_view]
    n, z = len(seen), 1.96
    p = float(np.mean(seen)) if n else math.nan
    middle = (p + z * z / (2 * n)) / (1 + z * z / n) if n else math.nan
    half = z * math.sqrt(p * (1 - p) / n + (z / (2 * n)) ** 2) / (1 + z * z / n) if n else math.nan
    return Metric(p, middle - half, middle + half, "share", n)


def report(looks: list[Look]) -> dict[str, Metric]:
    """Print a table a body, an activity and a scene, and give its numbers."""
    table = Table("", "crops", "in view", "detected", "mean error < 10 %", "median error")
    metrics: dict[str, Metric] = {}
    for key in ("body", "activity", "scene", "all"):
        for name in sorted({getattr(look, key, "all") for look in looks}):
            mine = [look for look in looks if getattr(look, key, "all") == name]
            detected, good = share(mine, lambda x: x.detected), share(mine, lambda x: x.good)
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
