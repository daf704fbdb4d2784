"""Film strips of the motions in the repertoire, with a camera that follows the worker."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.gallery.still import make_camera
from hrc_env.core.batching import one
from hrc_env.core.typing import Image
from hrc_env.motion.repertoire import SCENES, make_worker, perform
from hrc_env.render import overlay
from hrc_env.scene.build import build
from hrc_env.scene.render import PictureRenderer
from hrc_env.worker.body import SEGMENT, load_body

FRAMES, FRAME_PX = 6, (300, 420)
"""Number of frames in a strip, and width and height of each frame [px]."""
DT_S = 0.05
HFOV_DEG, TARGET_M = 38.0, 0.92
"""Horizontal field of view of the camera [deg], and height of the point at which it aims [m]."""


@dataclass(frozen=True, slots=True)
class Stage:
    """The pose at which a worker starts a motion on the site, and the position of the camera."""

    xy_m: tuple[float, float]
    """Position of the worker at the start [m]."""
    yaw_rad: float
    """Heading of the worker at the start [rad]."""
    aside_rad: float
    """Direction of the camera, relative to the worker's heading [rad]."""
    away_m: float
    """Distance of the camera from the worker [m]."""


OPEN = Stage((1.6, -1.5), 0.0, -1.05, 3.1)
LONG = Stage((-4.4, -2.2), 0.0, -0.85, 2.9)
"""Stage for motions that cover a long path."""
LADEN = Stage((-4.4, -2.2), 0.0, -0.85, 4.0)
"""Stage for motions with a large load."""
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
"""Motions at a workplace of the site: name of the workplace, and direction [rad] and distance [m]
of the camera.
"""


def draw_strip(name: str, body_name: str, seed: int = 0) -> Image:
    """Render a motion of the repertoire as a film strip, an image (420, about 1800, 3)."""
    scene = build(name="site", n_workers=1, bodies=body_name)
    stage = make_stage(name)
    me = make_worker(load_body(body_name), stage.xy_m, stage.yaw_rad)
    films = perform(SCENES[name], me, np.random.default_rng(seed), DT_S)
    renderer = PictureRenderer(scene, *FRAME_PX)
    frames, turn = [], stage.yaw_rad + stage.aside_rad
    lengths = [len(film.time_s) for film in films]
    for k, row in spread_frames(lengths):
        motion = one(films[k].motion, row)
        root = motion.position_world[0, SEGMENT["pelvis"]]
        target = np.array([*root[:2], TARGET_M])
        camera = make_camera(target, turn, stage.away_m, HFOV_DEG, FRAME_PX)
        frame = np.array(renderer.picture(scene.home_q, motion, camera), np.uint8)
        overlay.label(frame, f"{DT_S * (sum(lengths[:k]) + row):.1f} s", (8, 8), 14)
        frames.append(frame)
    renderer.close()
    return overlay.tile(frames, FRAMES)


def make_stage(name: str) -> Stage:
    """Return the stage for a motion."""
    if name in STAGED:
        where, aside_rad, away_m = STAGED[name]
        place = next(p for p in build(name="site").grounds.places if p.name == where)
        return Stage(place.xy_m, place.yaw_rad, aside_rad, away_m)
    if name.startswith(("cart", "wheelbarrow", "board", "box")):
        return LADEN
    return LONG if name.startswith(("walk", "stumble", "run", "fall")) else OPEN


def spread_frames(lengths: Sequence[int]) -> list[tuple[int, int]]:
    """Return equally spaced frames of films with given lengths, as index pairs (film, frame)."""
    rows = [(film, row) for film, length in enumerate(lengths) for row in range(length)]
    shares = (np.arange(FRAMES) + 0.5) / FRAMES
    return [rows[int(share * len(rows))] for share in shares]
