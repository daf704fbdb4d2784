"""Pictures from places that stay, quickly: what moves laid over what was drawn once.

What stands still is drawn once, larger than the picture and with its shadows; then only the arm
and the workers are drawn, where they are. What keeps the sun off the rest is asked of a picture
of them from the sun.
"""

from dataclasses import dataclass
from typing import Any, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from hrc_env.core.records import Roi, WorkerMotion
from hrc_env.core.typing import Floats, Image, JointAngles, Points3
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.render.overlay import shrink
from hrc_env.scene import gl
from hrc_env.scene.build import Scene
from hrc_env.scene.canvas import BEFORE_THE_SUN, IN_THE_SHADE, MOVING, STILL, Canvas, Marks

SMOOTHING = 2
"""All is drawn so many times as large, for smooth edges."""
QUALITY = {
    "offsamples": 0, "shadowsize": 4096, "numslices": 14, "numstacks": 5, "numquads": 1,
}  # fmt: skip
SUN_PX = 256
"""Side of the picture from the sun."""
BIAS_M = 0.03
"""Nothing shades what is nearer to it than this, along the light [m]."""
SOFT_PX = 3
"""Edges of shadows are so soft."""
COARSE = 2
"""Shadows are looked up for one pixel in so many, each way."""
Box: TypeAlias = tuple[int, int, int, int]
"""Left, top, right, bottom in a picture's pixels."""
Depths = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Shade:
    """What moves, seen from the sun."""

    z: Depths
    """(SUN_PX, SUN_PX) how near to the sun: 1 `begin_m` along the light, 0 `deep_m` further and
    where nothing is."""
    begin_m: float
    deep_m: float
    corner: tuple[float, float]
    """Where the first pixel begins: right and down [m], as `sun_axes`."""
    step_m: float
    """Side of a pixel [m]."""


@dataclass(frozen=True, slots=True)
class _Backdrop:
    """What stands still, seen from a place."""

    rgb: Image
    """In the picture's size."""
    z: Depths
    """`SMOOTHING` times as large; 1 is near."""
    dark: Image | None
    """The picture without the sun; None where shadows are not asked for."""
    spots: tuple[NDArray[np.floating], ...]
    """What the picture shows in the sun's axes: right, down and along, (h, w) [m] each."""


class Stage(Canvas):
    """Pictures of a scene from a few places; what stands still is kept for each."""

    def __init__(self, scene: Scene, width: int, height: int) -> None:
        """A stage for pictures of at most `width` x `height`."""
        gl.draw_on_one_thread()
        size = max(SMOOTHING * width, SUN_PX), max(SMOOTHING * height, SUN_PX)
        super().__init__(scene, *size, QUALITY)
        self._shade: Shade | None = None
        """Of this pose, once it was asked for."""

    def pose(self, q: JointAngles, motion: WorkerMotion | None) -> None:
        """Pose what moves: arm q (N,), the workers of one environment (W, S, ...)."""
        super().pose(q, motion)
        self._shade = None

    def picture(self, camera: PinholeCamera, shadows: bool = False) -> Image:
        """What a pinhole camera sees, in the size of its image."""
        key = _key(camera, shadows)
        if key not in self._kept:
            self._kept[key] = self._still(camera, shadows)
        backdrop = self._kept[key]
        image = backdrop.rgb.copy()
        if backdrop.dark is not None:
            self._cast_shadows(image, backdrop, backdrop.dark)
        box = self.box(camera)
        if box[2] > box[0] and box[3] > box[1]:
            _lay_over(image, backdrop, box, *self.moving(camera, box))
        return image

    def mark(
        self, image: Image, camera: PinholeCamera, marks: Marks, shown: float, hidden: float
    ) -> None:
        """Lay marks over a picture of the camera, in place.

        Args:
            image: as of `picture`, which was called for this camera before.
            camera: through which it was taken.
            marks: capsules and spheres.
            shown: their opacity in [0, 1] where nothing is nearer,
            hidden: and where something is.
        """
        middles = marks.ends_world.mean(1)
        half_m = np.linalg.norm(np.diff(marks.ends_world, axis=1)[:, 0], axis=-1) / 2
        box = _box(camera, middles, marks.radius_m + half_m)
        left, top, right, bottom = box
        if right <= left or bottom <= top:
            return
        _, z_moving = self.moving(camera, box)
        fine = SMOOTHING * np.array(box)
        z_still = self._backdrop_z(camera)[fine[1] : fine[3], fine[0] : fine[2]]
        self.show_marks(marks)
        rgb, z = self._read(camera, box)
        before = z > np.maximum(z_still, z_moving)
        share = np.where(z > 0, np.where(before, shown, hidden), 0.0).astype(np.float32)
        size = right - left, bottom - top
        laid = cv2.resize(rgb * share[..., None], size, interpolation=cv2.INTER_AREA)
        free = 1 - cv2.resize(share, size, interpolation=cv2.INTER_AREA)
        part = image[top:bottom, left:right]
        part[:] = np.round(part * free[..., None] + laid)

    def _backdrop_z(self, camera: PinholeCamera) -> Depths:
        """Depths of what stands still, `SMOOTHING` times as large."""
        for shadows in (True, False):
            if (key := _key(camera, shadows)) in self._kept:
                return self._kept[key].z
        raise KeyError(camera.name)

    def moving(self, camera: PinholeCamera, box: Box) -> tuple[Image, Depths]:
        """What moves within a box of the picture: rgb and z, `SMOOTHING` times as large,
        top row first; black and 0 where nothing is."""
        self.show(MOVING)
        return self._read(camera, box)

    def box(self, camera: PinholeCamera) -> Box:
        """Where in the picture things that move are, and maybe a little more."""
        return _box(camera, *self.find_moving_spheres())

    def shade(self) -> Shade | None:
        """What moves, as the sun sees it; None without a sun or without anything that moves."""
        self.show(BEFORE_THE_SUN)
        axes, (middles, radii_m) = self.sun_axes(), self.find_moving_spheres()
        if axes is None or not len(middles):
            return None
        spots = middles @ axes
        low = (spots - radii_m[:, None]).min(0) - 0.1
        high = (spots + radii_m[:, None]).max(0) + 0.1
        half_m, deep_m = float((high - low)[:2].max()) / 2, float((high - low)[2])
        middle = (low + high) / 2
        near = axes @ [middle[0], middle[1], low[2]]
        self.aim_along(axes, near, half_m, deep_m)
        z = np.empty((SUN_PX, SUN_PX), np.float32)
        self.read(None, z)
        corner = float(middle[0]) - half_m, float(middle[1]) - half_m
        upright = np.ascontiguousarray(z[::-1])
        return Shade(upright, float(low[2]), deep_m, corner, 2 * half_m / SUN_PX)

    def _still(self, camera: PinholeCamera, shadows: bool) -> _Backdrop:
        size, axes = (camera.width_px, camera.height_px), self.sun_axes()
        self.show(STILL, shadows=shadows)
        rgb, z = self._read(camera, (0, 0, *size))
        dark, spots = None, ()
        if shadows and axes is not None:
            points = _points(camera, self.distance_m(z[::SMOOTHING, ::SMOOTHING]))
            at = points[::COARSE, ::COARSE] @ axes.astype(np.float32)
            spots = tuple(np.ascontiguousarray(at[..., k]) for k in range(3))
            self.show(IN_THE_SHADE)
            dark = shrink(self._read(camera, (0, 0, *size))[0], *size)
        return _Backdrop(shrink(rgb, *size), z, dark, spots)

    def _read(self, camera: PinholeCamera, box: Box) -> tuple[Image, Depths]:
        """What is shown within a box of the picture, `SMOOTHING` times as large, top row first."""
        left, top, right, bottom = box
        window = Roi(((left + right) / 2, (top + bottom) / 2), float(right - left), 0.0)
        self.aim(camera, window, bottom - top)
        shape = SMOOTHING * (bottom - top), SMOOTHING * (right - left)
        rgb, z = np.empty((*shape, 3), np.uint8), np.empty(shape, np.float32)
        self.read(rgb, z)
        return np.ascontiguousarray(rgb[::-1]), np.ascontiguousarray(z[::-1])

    def _cast_shadows(self, image: Image, backdrop: _Backdrop, dark: Image) -> None:
        """Show the backdrop without the sun where something that moves keeps it off, in place."""
        shade = self._shade = self._shade or self.shade()
        if shade is None:
            return
        right, down, along = backdrop.spots
        x = (right - shade.corner[0]) / shade.step_m - 0.5
        y = (down - shade.corner[1]) / shade.step_m - 0.5
        blocker = cv2.remap(shade.z, x, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT)
        z = np.maximum(1 - (along - (BIAS_M + shade.begin_m)) / shade.deep_m, 0)
        shaded = cv2.compare(blocker, z, cv2.CMP_GT)
        share = cv2.resize(shaded, image.shape[1::-1], interpolation=cv2.INTER_LINEAR)
        share = cv2.blur(share, (SOFT_PX, SOFT_PX))
        x0, y0, wide, high = cv2.boundingRect(share)
        if wide == 0:
            return
        where = slice(y0, y0 + high), slice(x0, x0 + wide)
        weight = cv2.cvtColor(share[where], cv2.COLOR_GRAY2RGB)
        lit = cv2.multiply(image[where], 255 - weight, scale=1 / 255)
        image[where] = cv2.add(lit, cv2.multiply(dark[where], weight, scale=1 / 255))


def _key(camera: PinholeCamera, shadows: bool) -> tuple[Any, ...]:
    """Key of a backdrop."""
    view = camera.K.tobytes(), camera.T_world_from_cam.tobytes()
    return (*view, camera.width_px, camera.height_px, shadows)


def _box(camera: PinholeCamera, middles: Points3, radii_m: Floats) -> Box:
    """Where in a camera's picture spheres are, and maybe a little more."""
    size = camera.width_px, camera.height_px
    x, y, depth = ((middles - camera.eye_world) @ camera.T_world_from_cam[:3, :3]).T
    ahead = depth > -radii_m
    x, y, depth, radii_m = x[ahead], y[ahead], depth[ahead], radii_m[ahead]
    if not len(depth):
        return 0, 0, 0, 0
    if (depth < radii_m + 0.1).any():
        return 0, 0, *size
    corners = np.stack([_reach(x, depth, radii_m), _reach(y, depth, radii_m)], -1)
    low, high = corners * camera.K[[0, 1], [0, 1]] + camera.K[:2, 2]
    left, top = np.clip(np.floor(low - 2), 0, size).astype(int).tolist()
    right, bottom = np.clip(np.ceil(high + 2), 0, size).astype(int).tolist()
    return left, top, right, bottom


def _reach(x: Floats, depth: Floats, radii_m: Floats) -> Floats:
    """(2,) the least and the greatest of what spheres cover, in focal lengths from the axis."""
    nearest, furthest = depth - radii_m, depth + radii_m
    low = np.minimum((x - radii_m) / nearest, (x - radii_m) / furthest)
    high = np.maximum((x + radii_m) / nearest, (x + radii_m) / furthest)
    return np.array([low.min(), high.max()])


def _points(camera: PinholeCamera, depth_m: Depths) -> Depths:
    """(H, W, 3) points in the world that the picture shows [m]."""
    x = (np.arange(camera.width_px) + 0.5 - camera.K[0, 2]) / camera.K[0, 0] * depth_m
    y = (np.arange(camera.height_px) + 0.5 - camera.K[1, 2])[:, None] / camera.K[1, 1] * depth_m
    points = np.stack([x, y, depth_m], -1) @ camera.T_world_from_cam[:3, :3].T + camera.eye_world
    return points.astype(np.float32)


def _lay_over(image: Image, backdrop: _Backdrop, box: Box, rgb: Image, z: Depths) -> None:
    """Lay what is nearer over the picture, with smooth edges, in place."""
    left, top, right, bottom = box
    fine = SMOOTHING * np.array(box)
    behind = np.ascontiguousarray(backdrop.z[fine[1] : fine[3], fine[0] : fine[2]])
    nearer = cv2.compare(z, behind, cv2.CMP_GT)
    shown = cv2.bitwise_and(rgb, rgb, mask=nearer)
    free = 255 - shrink(nearer, right - left, bottom - top)
    part = image[top:bottom, left:right]
    through = cv2.multiply(part, cv2.cvtColor(free, cv2.COLOR_GRAY2RGB), scale=1 / 255)
    part[:] = cv2.add(through, shrink(shown, right - left, bottom - top))
