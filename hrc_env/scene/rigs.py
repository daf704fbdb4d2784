"""Rigs by name, and what a rig sees of the place where people are."""

import math
from dataclasses import replace

import numpy as np

from hrc_env.core.typing import Bools, Floats, Points3
from hrc_env.core.vacancy import Coverage
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.geometry.cameras import (
    PinholeCamera,
    image_from_pinhole,
    inside_image,
    project,
    rays,
)
from hrc_env.geometry.shapes import AXES, BOX, CENTRE, HALF_SIZE, KIND, PLANE, REACH, WIDTH
from hrc_env.geometry.sight import find_hidden, no_surroundings
from hrc_env.scene.build import Scene
from hrc_env.scene.places import SCENES, within
from hrc_env.scene.rig import LAB_CAMERAS, SITE_CAMERAS
from hrc_env.world import Grounds

RIGS: dict[str, tuple[CameraConfig, ...]] = {
    "lab": LAB_CAMERAS,
    "lab_gopro": tuple(
        CameraConfig.from_make("gopro_hero8_wide", camera.name, camera.eye_world)
        for camera in LAB_CAMERAS
    ),
    "site": SITE_CAMERAS,
}
"""Rigs that `cameras=` knows by name: the scenes', and the lab's with the paper's lens."""
POOR_SHARE = 0.1
"""A camera that sees less of the workspace is hardly worth its cable."""
HEIGHTS_M = (0.2, 0.6, 1.0, 1.4, 1.8)
"""Bodies are between these heights above the floor."""
SPACING_M = 0.5
PIECE_M = 0.25
"""Side of a piece of floor [m]."""
ASIDE_M = ((0.0, 0.0), (0.2, 0.0), (-0.2, 0.0), (0.0, 0.2), (0.0, -0.2))
"""Middle and sides of a body, from its axis [m]."""
LEAST_SEEN = 3
"""A camera detects a person if it sees this number of the heights."""
FAR_M, VIEW_POINTS = 8.0, 12
"""Range within which views are compared [m], and points along each axis."""


def floor(grounds: Grounds, spacing_m: float = SPACING_M) -> Points3:
    """(N, 3) points all over the walkable floor [m], without those in the robot or other things."""
    points = workspace(grounds, spacing_m)
    points = points[points[:, 2] == HEIGHTS_M[0]] * (1.0, 1.0, 0.0)
    from_robot_m = np.linalg.norm(points[:, :2] - grounds.robot_xy_m, axis=-1)
    return points[~within(points, grounds.blocked) & (from_robot_m > grounds.robot_clearance_m)]


def coverage(scene: Scene) -> Coverage:
    """Return the cameras of a scene's rig that would detect people on each piece of its floor."""
    return coverage_of(scene.cameras, scene.obstacles, floor(scene.grounds, PIECE_M))


def coverage_of(
    cameras: tuple[PinholeCamera, ...], still: Floats, floor_world: Points3
) -> Coverage:
    """Return the same for cameras among obstacles (G, WIDTH), and pieces of floor whose centres
    (N, 3) are about `PIECE_M` apart [m]."""
    body = [(*aside, z) for z in HEIGHTS_M for aside in ASIDE_M]
    points = (floor_world[:, None] + body).reshape(-1, 3)
    seen = sees(cameras, still, points)
    seen = seen.reshape(len(cameras), len(floor_world), len(HEIGHTS_M), len(ASIDE_M)).any(-1)
    finds, group = np.unique(seen.sum(-1).T >= LEAST_SEEN, axis=0, return_inverse=True)
    return Coverage(floor_world, PIECE_M / math.sqrt(2.0), group.reshape(-1), finds)


def common_views(cameras: tuple[PinholeCamera, ...]) -> Coverage:
    """Return the sets of two or more cameras whose views overlap within `FAR_M`, or one empty set,
    without pieces of floor."""
    share = (np.arange(VIEW_POINTS) + 0.5) / VIEW_POINTS
    points = []
    for camera in cameras:
        px = np.stack(np.meshgrid(share * camera.width_px, share * camera.height_px), -1)
        along = rays(camera, px.reshape(-1, 2))
        depths_m = np.linspace(0.0, FAR_M, VIEW_POINTS + 1)[1:, None, None]
        points.append((camera.eye_world + depths_m * along).reshape(-1, 3))
    nothing_there = np.zeros((0, WIDTH))
    sets = np.unique(sees(cameras, nothing_there, np.concatenate(points)).T, axis=0)
    several = sets[sets.sum(1) > 1]
    finds = several if len(several) else np.zeros((1, len(cameras)), np.bool_)
    return Coverage(np.zeros((0, 3)), 0.0, np.zeros(0, np.int64), finds)


def workspace(grounds: Grounds, spacing_m: float = SPACING_M) -> Points3:
    """(P, 3) points all over the walkable area, from ankles to heads [m]."""
    (x0, x1), (y0, y1) = grounds.walkable_x_m, grounds.walkable_y_m
    n_x, n_y = (max(2, round((b - a) / spacing_m)) for a, b in ((x0, x1), (y0, y1)))
    grid = np.meshgrid(np.linspace(x0, x1, n_x), np.linspace(y0, y1, n_y), HEIGHTS_M)
    return np.stack([axis.ravel() for axis in grid], -1)


def sees(cameras: tuple[PinholeCamera, ...], still: Floats, points_world: Points3) -> Bools:
    """(C, P) which points are in a camera's image and not behind what stands still (G, WIDTH)."""
    eyes_world = np.stack([camera.eye_world for camera in cameras])
    seen = ~find_hidden(replace(no_surroundings(1), still=still), eyes_world, points_world[None])[0]
    for c, camera in enumerate(cameras):
        px, depth_m = project(camera.P[None], points_world[None])
        seen[c] &= inside_image(camera, image_from_pinhole(camera, px[0, 0])) & (depth_m[0, 0] > 0)
    return seen


def findings(scene: Scene, wants_pairs: str = "", fewest: int | None = None) -> list[str]:
    """What is poor about a scene's rig, in sentences: nothing for a good one, as its own is.

    Args:
        scene: with the rig.
        wants_pairs: the name of an estimator that needs two cameras; "": it does not.
        fewest: cameras of an episode, where their number is drawn; None: the rig's.
    """
    if fewest == 1 and len(scene.cameras) > 1 and wants_pairs:
        return [*findings(scene), f"Rigs of one camera are drawn. {_depth_alone(wants_pairs)}"]
    if scene.config.cameras == RIGS.get(scene.name) and len(scene.cameras) > 1:
        return []
    seen = _shares_seen(scene)
    said = poor_cameras(scene)
    if len(scene.cameras) == 1:
        said.append(
            f"There is one camera, {scene.cameras[0].name!r}, which sees {100 * seen[0]:.0f} % of "
            f"the workspace; what it does not see is unknown. {_depth_alone(wants_pairs)}"
        )
    return said


def _depth_alone(wants_pairs: str) -> str:
    """Describe in a sentence how an estimator does with one camera."""
    if not wants_pairs:
        return "How far people are follows from their bodies' usual size."
    return (
        f"The estimator {wants_pairs!r} needs two that see a person at once (needs_pairs), and "
        "finds nobody: add a camera, or use estimator='particle', which takes the distance from "
        "the body's usual size."
    )


def poor_cameras(scene: Scene) -> list[str]:
    """Which of a scene's cameras hang in something or see hardly any of the workspace, a sentence
    each."""
    said = []
    for camera, share in zip(scene.cameras, _shares_seen(scene), strict=True):
        inside = _inside_something(camera, scene.obstacles)
        ceiling_m = SCENES[scene.name].ceiling_m
        above = ceiling_m is not None and camera.eye_world[2] > ceiling_m
        if inside or above or share < POOR_SHARE:
            where = "hangs in or behind a wall or a thing" if inside else "looks elsewhere"
            said.append(
                f"Camera {camera.name!r} sees {100 * share:.0f} % of the workspace: it "
                f"{'hangs above the ceiling' if above else where}."
            )
    return said


def _shares_seen(scene: Scene) -> Floats:
    """(C,) the share of the workspace that each camera sees."""
    seen = sees(scene.cameras, scene.obstacles, workspace(scene.grounds))
    return np.asarray(seen.mean(1))


def _inside_something(camera: PinholeCamera, still: Floats) -> bool:
    """Whether an eye is inside a box, below the floor, or behind a wall or beside it as high as it
    is; planes are floors and walls."""
    axes = still[:, AXES:HALF_SIZE].reshape(-1, 3, 3)
    away = np.einsum("gij,gj->gi", axes, camera.eye_world - still[:, CENTRE:AXES])
    within = np.abs(away) < still[:, HALF_SIZE:REACH]
    in_box = (still[:, KIND] == BOX) & within.all(1)
    high_m = (np.abs(axes[:, :, 2]) * still[:, HALF_SIZE:REACH]).sum(1)
    beside = np.abs(camera.eye_world[2] - still[:, CENTRE + 2]) <= high_m
    is_floor = axes[:, 2, 2] > 0.5
    behind = (still[:, KIND] == PLANE) & (away[:, 2] < 0) & (beside | is_floor)
    return bool((in_box | behind).any())
