"""Film strips: a scene of the repertoire in a few frames, followed by a camera."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.gallery.still import camera_at
from hrc_env.core.batching import one
from hrc_env.core.typing import Image
from hrc_env.motion.repertoire import SCENES, make_worker, perform
from hrc_env.render import overlay
from hrc_env.scene.build import build
from hrc_env.scene.render import PictureRenderer
from hrc_env.worker.body import SEGMENT, load_body

FRAMES, FRAME_PX = 6, (300, 420)
"""How many frames a strip has, width and height of each [px]."""
DT_S = 0.05
HFOV_DEG, TARGET_M = 38.0, 0.92
"""The camera's field of view, and how high it looks."""


@dataclass(frozen=True, slots=True)
class Stage:
    """Where a scene is played on the site and from where one looks on."""

    xy_m: tuple[float, float]
    """Where the worker stands at first [m]."""
    yaw_rad: float
    """Which way they look [rad]."""
    aside_rad: float
    """Where the camera is, from where the worker looks [rad]."""
    away_m: float
    """How far it is from the worker [m]."""


OPEN = Stage((1.6, -1.5), 0.0, -1.05, 3.1)
LONG = Stage((-4.4, -2.2), 0.0, -0.85, 2.9)
"""For those who go far."""
LADEN = Stage((-4.4, -2.2), 0.0, -0.85, 4.0)
"""For those who go with something large."""
AT_TABLE, AT_STUDS = ("table", -1.05, 2.7), ("north_studs_1", -2.0, 3.0)
STAGED: dict[str, tuple[str, float, float]] = {
    "hammer lightly": AT_TABLE,
    "hammer on a table": AT_TABLE,
    "saw": AT_TABLE,
    "measure": AT_TABLE,
    "hammer at a wall": AT_STUDS,
    "drill": ("north_studs_2", -2.0, 3.0),
    "drill overhead": ("lintel", -2.0, 3.0),
    "climb": ("hop_up", -1.3, 2.8),
}
"""Scenes that belong to a workplace of the site: its name, where the camera is, how far."""


def strip(name: str, body_name: str, seed: int = 0) -> Image:
    """A scene of the repertoire played by a worker, (420, about 1800, 3)."""
    scene = build(name="site", n_workers=1, bodies=body_name)
    stage = stage_of(name)
    me = make_worker(load_body(body_name), stage.xy_m, stage.yaw_rad)
    films = perform(SCENES[name], me, np.random.default_rng(seed), DT_S)
    renderer = PictureRenderer(scene, *FRAME_PX)
    frames, turn = [], stage.yaw_rad + stage.aside_rad
    lengths = [len(film.time_s) for film in films]
    for k, row in moments(lengths):
        motion = one(films[k].motion, row)
        root = motion.position_world[0, SEGMENT["pelvis"]]
        target = np.array([*root[:2], TARGET_M])
        camera = camera_at(target, turn, stage.away_m, HFOV_DEG, FRAME_PX)
        frame = np.array(renderer.picture(scene.home_q, motion, camera), np.uint8)
        overlay.label(frame, f"{DT_S * (sum(lengths[:k]) + row):.1f} s", (8, 8), 14)
        frames.append(frame)
    renderer.close()
    return overlay.tile(frames, FRAMES)


def stage_of(name: str) -> Stage:
    """Where a scene is played."""
    if name in STAGED:
        where, aside_rad, away_m = STAGED[name]
        place = next(p for p in build(name="site").grounds.places if p.name == where)
        return Stage(place.xy_m, place.yaw_rad, aside_rad, away_m)
    if name.startswith(("cart", "wheelbarrow", "board", "box")):
        return LADEN
    return LONG if name.startswith(("walk", "stumble", "run", "fall")) else OPEN


def moments(lengths: Sequence[int]) -> list[tuple[int, int]]:
    """Evenly spread over films of so many rows: which film, which of its rows."""
    rows = [(film, row) for film, length in enumerate(lengths) for row in range(length)]
    shares = (np.arange(FRAMES) + 0.5) / FRAMES
    return [rows[int(share * len(rows))] for share in shares]
