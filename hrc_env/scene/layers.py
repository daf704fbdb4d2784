"""What stands still and what moves, drawn apart: for pictures from places that stay.

What stands still is drawn once, larger than the picture and with its shadows; then only the arm
and the workers are drawn, where they are. What keeps the sun off the rest is asked of a picture
of them from the sun.
"""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.records import Roi, WorkerMotion
from hrc_env.core.typing import Floats, Image, JointAngles
from hrc_env.geometry.cameras import PinholeCamera, pinhole
from hrc_env.scene import gl
from hrc_env.scene.build import Scene
from hrc_env.scene.canvas import (
    BEFORE_THE_SUN,
    IN_THE_SHADE,
    MOVING,
    STILL,
    Canvas,
    across,
)
from hrc_env.scene.domain_randomization import Look
from hrc_env.scene.render import ALL_GROUPS, VIEWPOINTS

SMOOTHING = 2
"""All is drawn so many times as large, for smooth edges."""
QUALITY = {
    "offsamples": 0, "shadowsize": 4096, "numslices": 14, "numstacks": 5, "numquads": 1,
}  # fmt: skip
SUN_PX = 256
"""Side of the picture from the sun."""
BIAS_M = 0.03
"""Nothing shades what is nearer to it than this, along the light [m]."""
Box: TypeAlias = tuple[int, int, int, int]
"""Left, top, right, bottom in a picture's pixels."""


@dataclass(frozen=True, slots=True)
class Place:
    """From where a picture is taken: an upright rectangle of a camera's image."""

    camera: PinholeCamera
    middle_px: tuple[float, float]
    """In the camera's image, as is the next."""
    wide_px: float
    width: int
    """Of the picture [px], as is the next."""
    height: int
    shadows: bool = False

    @property
    def key(self) -> tuple[Any, ...]:
        """What tells places apart."""
        camera = self.camera
        view = (camera.K.tobytes(), camera.T_world_from_cam.tobytes())
        return (*view, self.middle_px, self.wide_px, self.width, self.height, self.shadows)


@dataclass(frozen=True, slots=True)
class Still:
    """What stands still, seen from a place; pictures are `SMOOTHING` times as large."""

    rgb: Image
    """Top row first."""
    dark: Image | None
    """The same without the sun; None where shadows are not asked for."""
    z: NDArray[np.float32]
    """Top row first; 1 is near."""
    points_world: NDArray[np.float32] | None
    """(H, W, 3) the points that the picture shows [m], one for each of its own pixels."""


@dataclass(frozen=True, slots=True)
class Shade:
    """What moves, seen from the sun."""

    z: NDArray[np.float32]
    """(SUN_PX, SUN_PX) how near to the sun: 1 `begin_m` along the light, 0 `deep_m` further and
    where nothing is; top row first."""
    begin_m: float
    deep_m: float
    corner: tuple[float, float]
    """Where the first pixel begins: right and down [m], as `sun_axes`."""
    step_m: float
    """Side of a pixel [m]."""


class Layers:
    """Draws the layers; pictures are no larger than `width` x `height`."""

    def __init__(self, scene: Scene, width: int, height: int) -> None:
        gl.draw_on_one_thread()
        self.scene = scene
        size = max(SMOOTHING * width, SUN_PX), max(SMOOTHING * height, SUN_PX)
        self._canvas = Canvas(scene, *size, QUALITY, ALL_GROUPS)

    def dress(self, look: Look | None) -> bool:
        """Draw with an episode's look from the next pose on; whether that is another one."""
        return self._canvas.dress(look)

    def pose(self, q: JointAngles, motion: WorkerMotion | None) -> None:
        """Pose what moves: arm q (N,), the workers of one environment (W, S, ...)."""
        self._canvas.pose(q, motion)

    def still(self, place: Place) -> Still:
        """What stands still."""
        canvas, shape = self._canvas, (SMOOTHING * place.height, SMOOTHING * place.width)
        rgb, z = np.empty((*shape, 3), np.uint8), np.empty(shape, np.float32)
        canvas.show(STILL, shadows=place.shadows)
        self._aim(place, (0, 0, place.width, place.height))
        canvas.read(rgb, z)
        dark = points_world = None
        if place.shadows and canvas.sun() is not None:
            points_world = _points(place, canvas.distance_m(z[::-1][::SMOOTHING, ::SMOOTHING]))
            dark = np.empty_like(rgb)
            canvas.show(IN_THE_SHADE)
            self._aim(place, (0, 0, place.width, place.height))
            canvas.read(dark, None)
            dark = np.ascontiguousarray(dark[::-1])
        z = np.ascontiguousarray(z[::-1])
        return Still(np.ascontiguousarray(rgb[::-1]), dark, z, points_world)

    def moving(self, place: Place, box: Box) -> tuple[Image, NDArray[np.float32]]:
        """What moves within a box of the picture: rgb and z, `SMOOTHING` times as large,
        top row first; black and 0 where nothing is."""
        left, top, right, bottom = box
        shape = SMOOTHING * (bottom - top), SMOOTHING * (right - left)
        rgb, z = np.empty((*shape, 3), np.uint8), np.empty(shape, np.float32)
        self._canvas.show(MOVING)
        self._aim(place, box)
        self._canvas.read(rgb, z)
        return np.ascontiguousarray(rgb[::-1]), np.ascontiguousarray(z[::-1])

    def box(self, place: Place) -> Box:
        """Where in the picture things that move are, and maybe a little more."""
        middles, radii_m = self._canvas.movers()
        camera = place.camera
        x, y, depth = ((middles - camera.eye_world) @ camera.T_world_from_cam[:3, :3]).T
        ahead = depth > -radii_m
        x, y, depth, radii_m = x[ahead], y[ahead], depth[ahead], radii_m[ahead]
        if not len(depth):
            return 0, 0, 0, 0
        if (depth < radii_m + 0.1).any():
            return 0, 0, place.width, place.height
        u = _reach(x, depth, radii_m) * camera.K[0, 0] + camera.K[0, 2] - place.middle_px[0]
        v = _reach(y, depth, radii_m) * camera.K[1, 1] + camera.K[1, 2] - place.middle_px[1]
        scale, size = place.width / place.wide_px, np.array([place.width, place.height])
        low = np.floor(np.array([u[0], v[0]]) * scale + size / 2 - 2)
        high = np.ceil(np.array([u[1], v[1]]) * scale + size / 2 + 2)
        (left, top), (right, bottom) = (np.clip(each, 0, size).astype(int) for each in (low, high))
        return int(left), int(top), int(right), int(bottom)

    def shade(self) -> Shade | None:
        """What moves, as the sun sees it; None without a sun or without anything that moves."""
        canvas = self._canvas
        canvas.show(BEFORE_THE_SUN)
        direction, (middles, radii_m) = canvas.sun(), canvas.movers()
        if direction is None or not len(middles):
            return None
        right, down = across(direction)
        spots = middles @ np.stack([right, down, direction], -1)
        low = (spots - radii_m[:, None]).min(0) - 0.1
        high = (spots + radii_m[:, None]).max(0) + 0.1
        half_m, deep_m = float((high - low)[:2].max()) / 2, float((high - low)[2])
        middle = (low + high) / 2
        near = middle[0] * right + middle[1] * down + low[2] * direction
        canvas.aim_along(direction, near, half_m, deep_m)
        z = np.empty((SUN_PX, SUN_PX), np.float32)
        canvas.read(None, z)
        corner = float(middle[0]) - half_m, float(middle[1]) - half_m
        upright = np.ascontiguousarray(z[::-1])
        return Shade(upright, float(low[2]), deep_m, corner, 2 * half_m / SUN_PX)

    def sun_axes(self) -> Floats | None:
        """(3, 3) columns right, down and along the light that casts shadows."""
        direction = self._canvas.sun()
        return None if direction is None else np.stack([*across(direction), direction], -1)

    def close(self) -> None:
        """Free the OpenGL context."""
        self._canvas.close()

    def _aim(self, place: Place, box: Box) -> None:
        left, top, right, bottom = box
        scale = place.wide_px / place.width
        x = place.middle_px[0] + ((left + right) / 2 - place.width / 2) * scale
        y = place.middle_px[1] + ((top + bottom) / 2 - place.height / 2) * scale
        window = Roi((x, y), (right - left) * scale, 0.0)
        self._canvas.aim(place.camera, window, (bottom - top) * scale)


def viewpoint(name: str, width: int, height: int) -> PinholeCamera:
    """The camera of one of `VIEWPOINTS`, for pictures of this size [px]."""
    eye, target, hfov_deg = VIEWPOINTS[name]
    return pinhole(name, np.array(eye), np.array(target), hfov_deg, width, height)


def _reach(x: Floats, depth: Floats, radii_m: Floats) -> Floats:
    """(2,) the least and the greatest of what spheres cover, in focal lengths from the axis."""
    nearest, furthest = depth - radii_m, depth + radii_m
    low = np.minimum((x - radii_m) / nearest, (x - radii_m) / furthest)
    high = np.maximum((x + radii_m) / nearest, (x + radii_m) / furthest)
    return np.array([low.min(), high.max()])


def _points(place: Place, depth_m: NDArray[np.float32]) -> NDArray[np.float32]:
    """(H, W, 3) float32 points in the world [m]."""
    scale, camera = place.wide_px / place.width, place.camera
    u = place.middle_px[0] + (np.arange(place.width) + 0.5 - place.width / 2) * scale
    v = place.middle_px[1] + (np.arange(place.height) + 0.5 - place.height / 2) * scale
    x = (u - camera.K[0, 2]) / camera.K[0, 0] * depth_m
    y = (v - camera.K[1, 2])[:, None] / camera.K[1, 1] * depth_m
    points = np.stack([x, y, depth_m], -1) @ camera.T_world_from_cam[:3, :3].T + camera.eye_world
    return points.astype(np.float32)
