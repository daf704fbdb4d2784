"""Pictures from places that stay, quickly: what moves laid over what was drawn once."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from hrc_env.core.records import WorkerMotion
from hrc_env.core.typing import Image, JointAngles
from hrc_env.scene.build import Scene
from hrc_env.scene.domain_randomization import Look
from hrc_env.scene.layers import BIAS_M, SMOOTHING, Box, Layers, Place

SOFT_PX = 3
"""Edges of shadows are so soft."""
COARSE = 2
"""Shadows are looked up for one pixel in so many, each way."""


class Stage:
    """Pictures of a scene from a few places; what stands still is kept for each."""

    def __init__(self, scene: Scene, width: int, height: int) -> None:
        """A stage for pictures of at most `width` x `height`."""
        self._largest = width, height
        self._layers = Layers(scene, width, height)
        self._kept: dict[Any, _Backdrop] = {}
        self._shade: Any = None

    def fits(self, width: int, height: int) -> bool:
        """Whether a picture is not too large."""
        return width <= self._largest[0] and height <= self._largest[1]

    def dress(self, look: Look | None) -> None:
        """Draw with an episode's look from the next pose on."""
        if self._layers.dress(look):
            self._kept.clear()

    def pose(self, q: JointAngles, motion: WorkerMotion | None) -> None:
        """Pose what moves: arm q (N,), the workers of one environment (W, S, ...)."""
        self._layers.pose(q, motion)
        self._shade = None

    def picture(self, place: Place) -> Image:
        """(height, width, 3) RGB."""
        backdrop = self._backdrop(place)
        image = backdrop.rgb.copy()
        self._cast_shadows(image, backdrop)
        box = self._layers.box(place)
        if box[2] > box[0] and box[3] > box[1]:
            _lay_over(image, backdrop, box, *self._layers.moving(place, box))
        return image

    def close(self) -> None:
        """Free the OpenGL context."""
        self._layers.close()
        self._kept.clear()

    def _backdrop(self, place: Place) -> "_Backdrop":
        key = place.key
        if key not in self._kept:
            self._kept[key] = _Backdrop(self._layers, place)
        return self._kept[key]

    def _cast_shadows(self, image: Image, backdrop: "_Backdrop") -> None:
        """Show the backdrop without the sun where something that moves keeps it off, in place."""
        if backdrop.dark is None:
            return
        if self._shade is None:
            self._shade = self._layers.shade()
        shade = self._shade
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
        image[where] = cv2.add(lit, cv2.multiply(backdrop.dark[where], weight, scale=1 / 255))


class _Backdrop:
    """What stands still, seen from a place, in the picture's size."""

    def __init__(self, layers: Layers, place: Place) -> None:
        still = layers.still(place)
        size = place.width, place.height
        self.rgb = _shrunk(still.rgb, size)
        self.z: NDArray[np.float32] = still.z
        self.dark = None if still.dark is None else _shrunk(still.dark, size)
        self.spots: tuple[NDArray[np.floating], ...] = ()
        """What the picture shows in the sun's axes: right, down and along, (h, w) [m] each."""
        axes = layers.sun_axes()
        if still.points_world is not None and axes is not None:
            places = still.points_world[::COARSE, ::COARSE] @ axes.astype(np.float32)
            self.spots = tuple(np.ascontiguousarray(places[..., k]) for k in range(3))


def _shrunk(image: Any, size: tuple[int, int]) -> Image:
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)


def _lay_over(
    image: Image, backdrop: _Backdrop, box: Box, rgb: Image, z: NDArray[np.float32]
) -> None:
    """Lay what is nearer over the picture, with smooth edges, in place."""
    left, top, right, bottom = box
    fine = SMOOTHING * np.array(box)
    behind = np.ascontiguousarray(backdrop.z[fine[1] : fine[3], fine[0] : fine[2]])
    nearer = cv2.compare(z, behind, cv2.CMP_GT)
    shown = cv2.bitwise_and(rgb, rgb, mask=nearer)
    free = 255 - _shrunk(nearer, (right - left, bottom - top))
    part = image[top:bottom, left:right]
    through = cv2.multiply(part, cv2.cvtColor(free, cv2.COLOR_GRAY2RGB), scale=1 / 255)
    part[:] = cv2.add(through, _shrunk(shown, (right - left, bottom - top)))
