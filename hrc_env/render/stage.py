"""Fast rendering from fixed viewpoints, with a cached picture of the static geoms.

Static geoms are rendered once for each viewpoint, with their shadows and at a multiple of the
picture's size. For each picture, only the part with the robot and the workers is rendered and laid
over the static one. Shadows of moving geoms are computed from a depth image of these geoms as seen
from the sun.
"""

from collections.abc import Hashable
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

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
"""Ratio of the size of the rendering to that of the picture, for smooth edges (supersampling)."""
QUALITY = {
    "offsamples": 0,
    "shadowsize": 4096,
    "numslices": 14,
    "numstacks": 5,
    "numquads": 1,
}
"""Settings of MuJoCo's visual quality for these pictures."""
SUN_PX = 256
"""Side of the depth image as seen from the sun [px]."""
BIAS_M = 0.03
"""Minimum distance along the light from an object to its shadow [m]."""
SOFT_PX = 3
"""Width of the blurred edges of shadows [px]."""
COARSE = 2
"""Spacing of the pixels for which shadows are computed, in both directions [px]."""
Depths: TypeAlias = NDArray[np.float32]
"""Array of depth values, or of distances or coordinates of pixels."""


class Box(NamedTuple):
    """A rectangle in a picture [px]."""

    left: int
    """First column of the rectangle."""
    top: int
    """First row of the rectangle."""
    right: int
    """Last column plus one."""
    bottom: int
    """Last row plus one."""

    @property
    def is_empty(self) -> bool:
        """Whether the rectangle has no pixels."""
        return self.right <= self.left or self.bottom <= self.top


class Layer(NamedTuple):
    """A rendered part of the scene, enlarged by `SMOOTHING`, with the top row first."""

    rgb: Image
    """Colours of the pixels; black where nothing is rendered."""
    z: Depths
    """Depth values of the pixels, from 1 (near) to 0 (far, or nothing rendered)."""


@dataclass(frozen=True, slots=True)
class Shade:
    """A depth image of the moving geoms as seen from the sun."""

    z: Depths
    """(SUN_PX, SUN_PX) depths: 1 at the near plane, 0 at the far plane and where there is no
    geom."""
    begin_m: float
    """Coordinate of the near plane along the direction of the light [m]."""
    deep_m: float
    """Distance of the far plane from the near plane [m]."""
    corner: tuple[float, float]
    """Coordinates of the corner of the first pixel along the axes right and down of `sun_axes`
    [m]."""
    step_m: float
    """Side length of a pixel [m]."""


@dataclass(frozen=True, slots=True)
class _Backdrop:
    """A cached picture of the static geoms from one viewpoint."""

    rgb: Image
    """Colours of the picture, at its final size."""
    z: Depths
    """Depth values from 1 (near) to 0 (far), at `SMOOTHING` times the size of the picture."""
    dark: Image | None
    """The same picture without the light of the sun; None for pictures without shadows."""
    spots: tuple[NDArray[np.floating], ...]
    """Coordinates of the points shown by the pixels, along the sun's axes right, down and along the
    light; arrays (h, w) [m]."""


class Stage(Canvas):
    """A renderer of pictures from a few viewpoints, which renders static geoms once per viewpoint.

    Args:
        scene: scene that is rendered.
        width: maximum width of a picture [px].
        height: maximum height of a picture [px].
    """

    def __init__(self, scene: Scene, width: int, height: int) -> None:
        gl.draw_on_one_thread()
        size = max(SMOOTHING * width, SUN_PX), max(SMOOTHING * height, SUN_PX)
        super().__init__(scene, *size, QUALITY)
        self._shade: Shade | None = None
        """Depth image from the sun for the present pose; None until it is rendered."""

    def pose(self, q: JointAngles, motion: WorkerMotion | None) -> None:
        """Pose the moving geoms.

        Args:
            q: (N,) joint angles of the robot [rad].
            motion: poses of the workers of one environment, arrays (W, S, ...).
        """
        super().pose(q, motion)
        self._shade = None

    def picture(self, camera: PinholeCamera, shadows: bool = False) -> Image:
        """Render the picture of a pinhole camera, at the size of the camera's image."""
        key = _key(camera, shadows)
        if key not in self._kept:
            self._kept[key] = self._draw_still(camera, shadows)
        backdrop = self._kept[key]
        image = backdrop.rgb.copy()
        if backdrop.dark is not None:
            self._cast_shadows(image, backdrop, backdrop.dark)
        box = self.find_box(camera)
        if not box.is_empty:
            _lay_over(image, backdrop, box, self.draw_moving(camera, box))
        return image

    def mark(
        self, image: Image, camera: PinholeCamera, marks: Marks, shown: float, hidden: float
    ) -> None:
        """Draw marks over a picture of a camera.

        Args:
            image: result of `picture` for this camera, which is changed.
            camera: the camera.
            marks: capsules and spheres.
            shown: opacity of visible marks, in [0, 1].
            hidden: opacity of occluded marks, in [0, 1].
        """
        middles = marks.ends_world.mean(1)
        half_m = np.linalg.norm(np.diff(marks.ends_world, axis=1)[:, 0], axis=-1) / 2
        box = _bound_spheres(camera, middles, marks.radius_m + half_m)
        if box.is_empty:
            return
        moving = self.draw_moving(camera, box)
        fine = SMOOTHING * np.array(box)
        z_still = self._backdrop_z(camera)[fine[1] : fine[3], fine[0] : fine[2]]
        self.show_marks(marks)
        layer = self._read_box(camera, box)
        before = layer.z > np.maximum(z_still, moving.z)
        share = np.where(layer.z > 0, np.where(before, shown, hidden), 0.0).astype(np.float32)
        size = box.right - box.left, box.bottom - box.top
        laid = cv2.resize(layer.rgb * share[..., None], size, interpolation=cv2.INTER_AREA)
        free = 1 - cv2.resize(share, size, interpolation=cv2.INTER_AREA)
        part = image[box.top : box.bottom, box.left : box.right]
        part[:] = np.round(part * free[..., None] + laid)

    def _backdrop_z(self, camera: PinholeCamera) -> Depths:
        """Return the depths of the static geoms, at `SMOOTHING` times the size of the picture."""
        for shadows in (True, False):
            if (key := _key(camera, shadows)) in self._kept:
                return self._kept[key].z
        raise KeyError(camera.name)

    def draw_moving(self, camera: PinholeCamera, box: Box) -> Layer:
        """Render the moving geoms within a box of the picture."""
        self.show(MOVING)
        return self._read_box(camera, box)

    def find_box(self, camera: PinholeCamera) -> Box:
        """Return a bounding box of all moving geoms in the picture."""
        return _bound_spheres(camera, *self.find_moving_spheres())

    def draw_shade(self) -> Shade | None:
        """Render the moving geoms as seen from the sun; None without a sun or moving geoms."""
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

    def _draw_still(self, camera: PinholeCamera, shadows: bool) -> _Backdrop:
        """Render the backdrop of a camera, that is, a picture of the static geoms."""
        size, axes = (camera.width_px, camera.height_px), self.sun_axes()
        whole = Box(0, 0, *size)
        self.show(STILL, shadows=shadows)
        rgb, z = self._read_box(camera, whole)
        dark, spots = None, ()
        if shadows and axes is not None:
            points = _points(camera, self.distance_m(z[::SMOOTHING, ::SMOOTHING]))
            in_sun_axes = points[::COARSE, ::COARSE] @ axes.astype(np.float32)
            spots = tuple(np.ascontiguousarray(in_sun_axes[..., k]) for k in range(3))
            self.show(IN_THE_SHADE)
            dark = shrink(self._read_box(camera, whole).rgb, *size)
        return _Backdrop(shrink(rgb, *size), z, dark, spots)

    def _read_box(self, camera: PinholeCamera, box: Box) -> Layer:
        """Render the currently selected geoms within a box of the picture."""
        width, height = box.right - box.left, box.bottom - box.top
        middle = (box.left + box.right) / 2, (box.top + box.bottom) / 2
        self.aim(camera, Roi(middle, float(width), 0.0), height)
        shape = SMOOTHING * height, SMOOTHING * width
        rgb, z = np.empty((*shape, 3), np.uint8), np.empty(shape, np.float32)
        self.read(rgb, z)
        return Layer(np.ascontiguousarray(rgb[::-1]), np.ascontiguousarray(z[::-1]))

    def _cast_shadows(self, image: Image, backdrop: _Backdrop, dark: Image) -> None:
        """Darken a picture in the shadows of moving geoms, by the backdrop without the sun."""
        shade = self._shade = self._shade or self.draw_shade()
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
        part = slice(y0, y0 + high), slice(x0, x0 + wide)
        weight = cv2.cvtColor(share[part], cv2.COLOR_GRAY2RGB)
        lit = cv2.multiply(image[part], 255 - weight, scale=1 / 255)
        image[part] = cv2.add(lit, cv2.multiply(dark[part], weight, scale=1 / 255))


def _key(camera: PinholeCamera, shadows: bool) -> tuple[Hashable, ...]:
    """Return the key under which the backdrop of a camera is cached."""
    view = camera.K.tobytes(), camera.T_world_from_cam.tobytes()
    return (*view, camera.width_px, camera.height_px, shadows)


def _bound_spheres(camera: PinholeCamera, middles: Points3, radii_m: Floats) -> Box:
    """Return a bounding box of spheres in a camera's picture.

    Args:
        camera: the camera.
        middles: (N, 3) centres of the spheres [m].
        radii_m: (N,) radii of the spheres [m].
    """
    size = camera.width_px, camera.height_px
    x, y, depth = ((middles - camera.eye_world) @ camera.T_world_from_cam[:3, :3]).T
    ahead = depth > -radii_m
    x, y, depth, radii_m = x[ahead], y[ahead], depth[ahead], radii_m[ahead]
    if not len(depth):
        return Box(0, 0, 0, 0)
    if (depth < radii_m + 0.1).any():
        return Box(0, 0, *size)
    corners = np.stack([_reach(x, depth, radii_m), _reach(y, depth, radii_m)], -1)
    low, high = corners * camera.K[[0, 1], [0, 1]] + camera.K[:2, 2]
    left, top = np.clip(np.floor(low - 2), 0, size).astype(int).tolist()
    right, bottom = np.clip(np.ceil(high + 2), 0, size).astype(int).tolist()
    return Box(left, top, right, bottom)


def _reach(x: Floats, depth: Floats, radii_m: Floats) -> Floats:
    """Return the minimum and maximum image coordinates (2,) of spheres, in focal lengths."""
    nearest, furthest = depth - radii_m, depth + radii_m
    low = np.minimum((x - radii_m) / nearest, (x - radii_m) / furthest)
    high = np.maximum((x + radii_m) / nearest, (x + radii_m) / furthest)
    return np.array([low.min(), high.max()])


def _points(camera: PinholeCamera, depth_m: Depths) -> Depths:
    """Return the world coordinates (H, W, 3) of the points that the pixels show [m]."""
    x = (np.arange(camera.width_px) + 0.5 - camera.K[0, 2]) / camera.K[0, 0] * depth_m
    y = (np.arange(camera.height_px) + 0.5 - camera.K[1, 2])[:, None] / camera.K[1, 1] * depth_m
    points = np.stack([x, y, depth_m], -1) @ camera.T_world_from_cam[:3, :3].T + camera.eye_world
    return points.astype(np.float32)


def _lay_over(image: Image, backdrop: _Backdrop, box: Box, layer: Layer) -> None:
    """Draw those parts of a layer that are nearer to the camera over a picture, with smooth edges.

    Args:
        image: the picture, which is changed.
        backdrop: backdrop of the picture, with the depths of the static geoms.
        box: box of the layer in the picture.
        layer: the moving geoms.
    """
    fine, size = SMOOTHING * np.array(box), (box.right - box.left, box.bottom - box.top)
    behind = np.ascontiguousarray(backdrop.z[fine[1] : fine[3], fine[0] : fine[2]])
    nearer = cv2.compare(layer.z, behind, cv2.CMP_GT)
    shown = cv2.bitwise_and(layer.rgb, layer.rgb, mask=nearer)
    free = 255 - shrink(nearer, *size)
    part = image[box.top : box.bottom, box.left : box.right]
    through = cv2.multiply(part, cv2.cvtColor(free, cv2.COLOR_GRAY2RGB), scale=1 / 255)
    part[:] = cv2.add(through, shrink(shown, *size))
