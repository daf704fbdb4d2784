"""Named rigs, and the coverage of the workspace by a rig."""

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
from hrc_env.scene.places import SCENES, is_within
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
"""Rigs by their names in `cameras=`.

"lab" and "site" are the rigs of the scenes, and "lab_gopro" is that of the laboratory with the lens
of the paper's camera.
"""
POOR_SHARE = 0.1
"""Fraction of the workspace in a camera's view below which its pose counts as poor."""
HEIGHTS_M = (0.2, 0.6, 1.0, 1.4, 1.8)
"""Heights above the floor at which the visibility of a body is tested [m]."""
SPACING_M = 0.5
"""Spacing of points in the workspace [m]."""
PIECE_M = 0.25
"""Side length of a patch of floor [m]."""
ASIDE_M = ((0.0, 0.0), (0.2, 0.0), (-0.2, 0.0), (0.0, 0.2), (0.0, -0.2))
"""Horizontal offsets from a body's axis at which its visibility is tested, x and y [m]."""
LEAST_SEEN = 3
"""Minimum number of visible heights for which a camera detects a person."""
FAR_M = 8.0
"""Distance from a camera up to which the views of cameras are compared [m]."""
VIEW_POINTS = 12
"""Number of sample points along each axis of a view for the comparison of views."""


def sample_floor(grounds: Grounds, spacing_m: float = SPACING_M) -> Points3:
    """Return points (N, 3) on the walkable floor [m], outside of the robot and obstacles."""
    points = sample_workspace(grounds, spacing_m)
    points = points[points[:, 2] == HEIGHTS_M[0]] * (1.0, 1.0, 0.0)
    from_robot_m = np.linalg.norm(points[:, :2] - grounds.robot_xy_m, axis=-1)
    return points[~is_within(points, grounds.blocked) & (from_robot_m > grounds.robot_clearance_m)]


def coverage(scene: Scene) -> Coverage:
    """Determine the cameras that would detect a person on each patch of a scene's floor."""
    return coverage_of(scene.cameras, scene.obstacles, sample_floor(scene.grounds, PIECE_M))


def coverage_of(
    cameras: tuple[PinholeCamera, ...], still: Floats, floor_world: Points3
) -> Coverage:
    """Determine the cameras that would detect a person on each patch of floor.

    Args:
        cameras: the cameras.
        still: (G, `shapes.WIDTH`) obstacles.
        floor_world: (N, 3) centres of the patches of floor, about `PIECE_M` apart [m].
    """
    body = [(*aside, z) for z in HEIGHTS_M for aside in ASIDE_M]
    points = (floor_world[:, None] + body).reshape(-1, 3)
    seen = find_visible(cameras, still, points)
    seen = seen.reshape(len(cameras), len(floor_world), len(HEIGHTS_M), len(ASIDE_M)).any(-1)
    finds, group = np.unique(seen.sum(-1).T >= LEAST_SEEN, axis=0, return_inverse=True)
    return Coverage(floor_world, PIECE_M / math.sqrt(2.0), group.reshape(-1), finds)


def common_views(cameras: tuple[PinholeCamera, ...]) -> Coverage:
    """Determine the sets of two or more cameras with overlapping views within `FAR_M`.

    The result contains no patches of floor, and contains one empty set if no views overlap.
    """
    share = (np.arange(VIEW_POINTS) + 0.5) / VIEW_POINTS
    points = []
    for camera in cameras:
        px = np.stack(np.meshgrid(share * camera.width_px, share * camera.height_px), -1)
        along = rays(camera, px.reshape(-1, 2))
        depths_m = np.linspace(0.0, FAR_M, VIEW_POINTS + 1)[1:, None, None]
        points.append((camera.eye_world + depths_m * along).reshape(-1, 3))
    nothing_there = np.zeros((0, WIDTH))
    sets = np.unique(find_visible(cameras, nothing_there, np.concatenate(points)).T, axis=0)
    several = sets[sets.sum(1) > 1]
    finds = several if len(several) else np.zeros((1, len(cameras)), np.bool_)
    return Coverage(np.zeros((0, 3)), 0.0, np.zeros(0, np.int64), finds)


def sample_workspace(grounds: Grounds, spacing_m: float = SPACING_M) -> Points3:
    """Return points (P, 3) above the walkable area, between the heights of ankles and heads [m]."""
    (x0, x1), (y0, y1) = grounds.walkable_x_m, grounds.walkable_y_m
    n_x, n_y = (max(2, round((b - a) / spacing_m)) for a, b in ((x0, x1), (y0, y1)))
    grid = np.meshgrid(np.linspace(x0, x1, n_x), np.linspace(y0, y1, n_y), HEIGHTS_M)
    return np.stack([axis.ravel() for axis in grid], -1)


def find_visible(cameras: tuple[PinholeCamera, ...], still: Floats, points_world: Points3) -> Bools:
    """Return a mask (C, P) of the points that are in each camera's image and not occluded.

    Args:
        cameras: the cameras.
        still: (G, `shapes.WIDTH`) obstacles.
        points_world: (P, 3) points [m].
    """
    eyes_world = np.stack([camera.eye_world for camera in cameras])
    seen = ~find_hidden(replace(no_surroundings(1), still=still), eyes_world, points_world[None])[0]
    for c, camera in enumerate(cameras):
        px, depth_m = project(camera.P[None], points_world[None])
        seen[c] &= inside_image(camera, image_from_pinhole(camera, px[0, 0])) & (depth_m[0, 0] > 0)
    return seen


def describe_defects(scene: Scene, wants_pairs: str = "", fewest: int | None = None) -> list[str]:
    """Return descriptions of the defects of a scene's rig, one sentence each.

    The default rig of a scene has no defects.

    Args:
        scene: the scene with the rig.
        wants_pairs: name of the estimator if it needs two cameras; otherwise "".
        fewest: smallest number of cameras in an episode if the number is sampled; None for the
            number in the rig.
    """
    if fewest == 1 and len(scene.cameras) > 1 and wants_pairs:
        return [
            *describe_defects(scene),
            f"Some drawn rigs have only one camera. {_describe_one_camera(wants_pairs)}",
        ]
    if scene.config.cameras == RIGS.get(scene.name) and len(scene.cameras) > 1:
        return []
    defects = describe_poor_cameras(scene)
    if len(scene.cameras) == 1:
        share = _visible_shares(scene)[0]
        defects.append(
            f"The rig has a single camera, {scene.cameras[0].name!r}, which sees {100 * share:.0f} "
            "% of the workspace; what it does not see is unknown. "
            f"{_describe_one_camera(wants_pairs)}"
        )
    return defects


def _describe_one_camera(wants_pairs: str) -> str:
    """Return a description of an estimator's behaviour with only one camera, in one sentence."""
    if not wants_pairs:
        return "Distances of people are inferred from the usual size of bodies."
    return (
        f"The estimator {wants_pairs!r} needs two cameras that see a person at the same time "
        "(needs_pairs), and will detect no people: add a camera, or use estimator='particle', "
        "which infers distances from the usual size of bodies."
    )


def describe_poor_cameras(scene: Scene) -> list[str]:
    """Return descriptions of poorly placed cameras, one sentence each.

    Such a camera is in an obstacle or sees too small a fraction of the workspace.
    """
    sentences: list[str] = []
    for camera, share in zip(scene.cameras, _visible_shares(scene), strict=True):
        inside = _is_inside_obstacle(camera, scene.obstacles)
        ceiling_m = SCENES[scene.name].ceiling_m
        above = ceiling_m is not None and camera.eye_world[2] > ceiling_m
        if inside or above or share < POOR_SHARE:
            place = (
                "is inside or behind a wall or an obstacle"
                if inside
                else "looks in another direction"
            )
            sentences.append(
                f"Camera {camera.name!r} sees {100 * share:.0f} % of the workspace: it "
                f"{'is above the ceiling' if above else place}."
            )
    return sentences


def _visible_shares(scene: Scene) -> Floats:
    """Return the fraction (C,) of the workspace that each camera sees."""
    seen = find_visible(scene.cameras, scene.obstacles, sample_workspace(scene.grounds))
    return np.asarray(seen.mean(1))


def _is_inside_obstacle(camera: PinholeCamera, still: Floats) -> bool:
    """Return whether a camera is inside a box, below the floor, or behind a wall.

    Planes are floors and walls; a camera is behind a wall only up to the height of the wall.

    Args:
        camera: the camera.
        still: (G, `shapes.WIDTH`) obstacles.
    """
    axes = still[:, AXES:HALF_SIZE].reshape(-1, 3, 3)
    away = np.einsum("gij,gj->gi", axes, camera.eye_world - still[:, CENTRE:AXES])
    inside = np.abs(away) < still[:, HALF_SIZE:REACH]
    in_box = (still[:, KIND] == BOX) & inside.all(1)
    high_m = (np.abs(axes[:, :, 2]) * still[:, HALF_SIZE:REACH]).sum(1)
    beside = np.abs(camera.eye_world[2] - still[:, CENTRE + 2]) <= high_m
    is_floor = axes[:, 2, 2] > 0.5
    behind = (still[:, KIND] == PLANE) & (away[:, 2] < 0) & (beside | is_floor)
    return bool((in_box | behind).any())
