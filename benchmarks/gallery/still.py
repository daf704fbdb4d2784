"""Still images: portraits of the workers, and scenes with people at work."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from hrc_env.core.batching import one
from hrc_env.core.records import Held, WorkerMotion
from hrc_env.core.typing import Image, Points3
from hrc_env.geometry.cameras import PinholeCamera, pinhole
from hrc_env.motion.repertoire import REPERTOIRE, make_worker, perform
from hrc_env.scene.build import Scene, build
from hrc_env.scene.render import PictureRenderer
from hrc_env.worker.body import load_body
from hrc_env.world import Workplace

EYE_M = 1.45
"""Height above the floor of the camera for portraits [m]."""
PORTRAIT_PX = (600, 900)
SITTING = (0.75, -0.6, -0.2)
"""Position x, y [m] and heading [rad] of the worker in a portrait."""
PLACE_PX = (1600, 900)
CASTS: dict[str, tuple[tuple[str, str, float], ...]] = {
    "lab": (("robot_4", "lunge", 0.3), ("open_studs", "drill", 0.5)),
    "site": (
        ("robot_4", "lunge", 0.3), ("north_studs_1", "hammer at a wall", 0.5),
        ("slab_floor_1", "kneel", 0.5), ("carts", "wheelbarrow", 0.35),
    ),
}  # fmt: skip
"""Workers in the images of a scene: workplace, motion of the repertoire, and the moment as a
fraction of the motion's duration.
"""
OVERVIEW = {"lab": "room", "site": "overview"}
"""Name of the view that shows most of the scene, by name of the scene."""


def make_camera(
    target_world: Points3, turn_rad: float, away_m: float, hfov_deg: float, size_px: tuple[int, int]
) -> PinholeCamera:
    """Return a camera that aims at a point (3,) [m] from a given direction and distance.

    The direction `turn_rad` is measured from world +x; the distance `away_m` is horizontal.
    """
    x, y, _ = target_world
    eye = np.array([x + away_m * np.cos(turn_rad), y + away_m * np.sin(turn_rad), EYE_M])
    return pinhole("follower", eye, np.asarray(target_world, float), hfov_deg, *size_px)


def portrait(body_name: str, seed: int = 1) -> Image:
    """Render a worker in the laboratory, from the front and slightly from the side."""
    scene = build(n_workers=1, bodies=body_name)
    x, y, yaw = SITTING
    me = make_worker(load_body(body_name), (x, y), yaw)
    film = perform(REPERTOIRE["stand"], me, np.random.default_rng(seed), 0.1)[0]
    camera = make_camera(np.array([x, y, 1.0]), yaw + 0.4, 2.1, 40.5, PORTRAIT_PX)
    renderer = PictureRenderer(scene, *PORTRAIT_PX)
    picture = np.array(renderer.picture(scene.home_q, one(film.motion, 10), camera), np.uint8)
    renderer.close()
    return picture


def views(scene_name: str, body_name: str) -> dict[str, Image]:
    """Render a scene with people at work: an overview, and the view of each camera, by name."""
    cast = CASTS[scene_name]
    scene = build(name=scene_name, n_workers=len(cast), bodies=body_name)
    motion = _stack_workers([_move_at_work(scene, body_name, *role) for role in cast])
    renderer = PictureRenderer(scene, *PLACE_PX)
    names = (OVERVIEW[scene_name], *(camera.name for camera in scene.cameras))
    found = {
        name: np.array(renderer.picture(scene.home_q, motion, name), np.uint8) for name in names
    }
    renderer.close()
    return found


def _move_at_work(
    scene: Scene, body_name: str, place_name: str, doing: str, share: float
) -> WorkerMotion:
    """Return the motion of one worker (1, ...) at a fraction `share` of an activity's duration."""
    place: Workplace = next(p for p in scene.grounds.places if p.name == place_name)
    me = make_worker(load_body(body_name), place.xy_m, place.yaw_rad)
    films = perform(REPERTOIRE[doing], me, np.random.default_rng(2), 0.05)
    rows = films[0].motion
    return one(rows, int(share * len(rows.position_world)))


def _stack_workers(workers: list[WorkerMotion]) -> WorkerMotion:
    """Concatenate the motions (1, ...) of several workers to one record (W, ...)."""

    def joined(records: Sequence[Any], *names: str) -> list[Any]:
        return [np.concatenate([getattr(each, name) for each in records]) for name in names]

    place, turn = "position_world", "quaternion_wxyz"
    held = Held(*joined([worker.held for worker in workers], "kind", place, turn))
    rates = ("velocity_world", "angular_velocity_world")
    position, quaternion, velocity, turning = joined(workers, place, turn, *rates)
    return WorkerMotion(position, quaternion, velocity, turning, held)
