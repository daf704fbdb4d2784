"""Whole images of a rig's cameras for policies, small and quickly.

Still and lying things are drawn once for each camera and kept; in every step only moving things
are drawn, and laid over it by depth. Images have smooth edges and no shadows.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import ConfigError, whole
from hrc_env.core.kernels import kernel
from hrc_env.core.mapping import answer_unknown_fields, from_mapping
from hrc_env.core.records import Roi, WorkerMotion
from hrc_env.core.typing import Image, Ints, JointAngles
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.scene import gl
from hrc_env.scene.build import Scene
from hrc_env.scene.canvas import EVERYTHING, MOVING, STILL, Canvas, Part
from hrc_env.scene.domain_randomization import Look
from hrc_env.scene.primitives import ROBOT_LOOKS
from hrc_env.scene.render import CROP_QUALITY
from hrc_env.scene.worker_visuals import HIDDEN, SHOWN, rows_shown

SMALLEST_PX, LARGEST_PX = 8, 1024
"""Sides of images that an observation may hold [px]."""
SMOOTHING = 2
"""Whole images are drawn so many times as large, for smooth edges."""
SMALL_PX = 128
"""Images with sides up to this are drawn with rounder things as coarse as `COARSE` [px]."""
COARSE = {"numslices": 8, "numstacks": 2}
TOO_THIN = 0.2
"""Rings and discs on what moves that are thinner than this share of a drawn pixel are left out."""
KEPT_BYTES = 2**28
"""Memory in which views of still things are kept."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class ImageConfig:
    """Which images an observation holds beside the belief: `observe_images`.

    Each is the view of a camera of the rig at that moment, lens and looks included, without faults,
    delays and shadows, black if it does not hang in the episode; its whole image is squeezed into
    `height` x `width`. A mapping of these fields, or (height, width), stands for it.
    """

    height: int = 84
    """Of an image [px], from 8 to 1024."""
    width: int = 84
    """Of an image [px], from 8 to 1024."""
    cameras: tuple[int | str, ...] | None = None
    """Names, or indices from 0, of the cameras of the environment's rig; None: all of them."""

    def __post_init__(self) -> None:
        for name in ("height", "width"):
            whole(f"{name} of images [px]", getattr(self, name), SMALLEST_PX, LARGEST_PX)
        if self.cameras is not None and not self.cameras:
            raise ConfigError(
                "cameras of images must name one or more cameras, or be None for all of the rig, "
                "got none of them. An observation without images: observe_images=None."
            )


def images_called(given: Any) -> ImageConfig | None:
    """Return what `observe_images=` says: None, (height, width), a mapping or an `ImageConfig`.

    Raises:
        ConfigError: it is none of these, or a size that cannot be.
    """
    if given is None or isinstance(given, ImageConfig):
        return given
    if isinstance(given, np.ndarray):
        given = given.tolist()
    try:
        if isinstance(given, Mapping):
            one = isinstance(given.get("cameras"), int | str)
            given = {**given, "cameras": [given["cameras"]]} if one else given
            return from_mapping(ImageConfig, given)
        if isinstance(given, Sequence) and not isinstance(given, str) and len(given) == 2:
            return ImageConfig(*given)
    except ConfigError as error:
        raise ConfigError(f"observe_images: {error}") from error
    raise ConfigError(
        "observe_images must be (height, width) [px], a mapping such as "
        '{"height": 84, "width": 84, "cameras": ["camera_1"]}, an ImageConfig or None, '
        f"got {given!r}."
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Backdrop:
    """The still things of a view."""

    look: Look | None
    """With which it was drawn."""
    rgb: Image
    """As it was drawn, bottom row first as OpenGL has it."""
    z: NDArray[np.float32]
    """Likewise: 1 is near, 0 is far."""
    mean: Image
    """As the image shows it, top row first."""


class CameraImages(Canvas):
    """Draws whole images of pinhole cameras, (height, width, 3), and square windows of them.

    Environments that look alike share still things; with looks of their own each has its own.
    """

    def __init__(self, scene: Scene, height_px: int, width_px: int, size_px: int = 1) -> None:
        """Images are `height_px` x `width_px`, windows (`view`) `size_px` x `size_px`."""
        gl.draw_on_one_thread()
        width, height = (max(SMOOTHING * side, size_px) for side in (width_px, height_px))
        coarse = COARSE if max(height_px, width_px) <= SMALL_PX else {}
        super().__init__(scene, width, height, {**CROP_QUALITY, **coarse})
        self.shape, self.size_px = (height_px, width_px), size_px
        self._wearer: int | None = None
        self._backdrops: dict[Any, _Backdrop] = {}
        self._model.geom_group[self._thin()] = HIDDEN
        self._of_geom = self._model.body_mocapid[self._model.geom_bodyid]
        self._lying, self._placement = np.zeros(0, np.int64), b""
        self._of_lying = mujoco.MjvOption()
        self._of_lying.flags[int(mujoco.mjtVisFlag.mjVIS_SKIN)] = 0

    def _thin(self) -> Ints:
        """Round things on what moves that are too thin for any camera's images to show."""
        foot = np.array([*self.scene.grounds.robot_xy_m, 1.0])
        pixels_m = [
            np.linalg.norm(camera.eye_world - foot) / camera.K[0, 0] * camera.width_px / side
            for camera in self.scene.cameras
            for side in (max(SMOOTHING * self.shape[1], self.size_px),)
        ]
        model = self._model
        moving = model.body_weldid[model.geom_bodyid] != 0
        discs = model.geom_type == mujoco.mjtGeom.mjGEOM_CYLINDER
        thin = model.geom_size[:, :2].min(1) < TOO_THIN * min(pixels_m)
        looks = model.geom_group == ROBOT_LOOKS
        return np.flatnonzero(moving & discs & thin & looks)

    def pose(self, q: JointAngles, motion: WorkerMotion | None) -> None:
        """Pose moving things, as `Canvas` does; things that lie about count as still."""
        super().pose(q, motion)
        if motion is None or not self._visuals.props.size:
            return
        shown = rows_shown(self._visuals.props, motion.held)[len(self._visuals.segments) :]
        rows = shown[shown >= 0]
        places = self._data.mocap_pos[rows], self._data.mocap_quat[rows]
        placement = b"".join(each.tobytes() for each in (rows, *places))
        if placement != self._placement:
            self._placement = placement
            self._lying = np.flatnonzero(np.isin(self._of_geom, rows))
        self._model.geom_group[self._lying] = HIDDEN

    def show(self, what: Part = EVERYTHING, shadows: bool = False) -> None:
        """Choose the parts of the next pictures, as `Canvas` does."""
        known = what in self._fresh
        super().show(what, shadows)
        if what is not MOVING and not known and len(self._lying):
            groups = self._model.geom_group.copy()
            self._model.geom_group[:] = HIDDEN
            self._model.geom_group[self._lying] = SHOWN
            moving = int(mujoco.mjtCatBit.mjCAT_DYNAMIC)
            mujoco.mjv_addGeoms(
                self._model, self._data, self._of_lying, mujoco.MjvPerturb(), moving, self._shown
            )
            self._model.geom_group[:] = groups

    def dress(self, b: int, look: Look | None) -> None:
        """Draw environment `b` from the next pose on, with its look; None: as it was built."""
        self._wearer = None if look is None else b
        self.randomize(look)

    def image(self, camera: PinholeCamera) -> Image:
        """Return the whole image of a camera, squeezed into (height, width, 3), top row first."""
        middle = Roi((camera.width_px / 2, camera.height_px / 2), float(camera.width_px), 0.0)
        fine = SMOOTHING * self.shape[0], SMOOTHING * self.shape[1]
        return self._layered(camera, middle, float(camera.height_px), fine, SMOOTHING)

    def view(self, camera: PinholeCamera, window: Roi) -> Image:
        """Return a square window of what a pinhole sees, (size, size, 3), top row first."""
        return self._layered(camera, window, window.side_px, (self.size_px, self.size_px), 1)

    def _layered(
        self,
        camera: PinholeCamera,
        window: Roi,
        height_px: float,
        fine: tuple[int, int],
        smoothing: int,
    ) -> Image:
        """Return moving things before still ones; pixels are means of `smoothing` x `smoothing`."""
        numbers = camera.K.tobytes(), camera.T_world_from_cam.tobytes()
        key = (self._wearer, self._placement, numbers, window, height_px)
        behind = self._backdrops.get(key)
        if behind is None or behind.look is not self._look:
            rgb, z = self._seen(STILL, camera, window, height_px, fine)
            mean = np.empty((fine[0] // smoothing, fine[1] // smoothing, 3), np.uint8)
            _mean_behind(rgb, smoothing, mean)
            behind = _Backdrop(self._look, rgb, z, mean)
        self._remember(key, behind)
        rgb, z = self._seen(MOVING, camera, window, height_px, fine)
        image = behind.mean.copy()
        _lay_smoothly(rgb, z, behind.rgb, behind.z, smoothing, image)
        return image

    def _remember(self, key: Any, behind: _Backdrop) -> None:
        """Keep a view of still things, the latest last; the oldest make room."""
        self._backdrops.pop(key, None)
        self._backdrops[key] = behind
        most = max(KEPT_BYTES // (behind.rgb.nbytes + behind.z.nbytes), len(self.scene.cameras))
        while len(self._backdrops) > most:
            del self._backdrops[next(iter(self._backdrops))]

    def _seen(
        self, what: Part, camera: PinholeCamera, window: Roi, height_px: float,
        shape: tuple[int, int],
    ) -> tuple[Image, NDArray[np.float32]]:  # fmt: skip
        """Colours and depths of a part of the scene, bottom row first."""
        rgb, z = np.empty((*shape, 3), np.uint8), np.empty(shape, np.float32)
        self.show(what)
        self.aim(camera, window, height_px)
        self.read(rgb, z)
        return rgb, z

    def __reduce__(self) -> tuple[Any, ...]:
        return CameraImages, (self.scene, *self.shape, self.size_px)


@kernel
def _mean_behind(rgb, smoothing, out):
    """Means over squares of `smoothing` pixels of a picture whose bottom row comes first; `out` is
    top row first."""
    height, width = out.shape[0], out.shape[1]
    count = smoothing * smoothing
    for row in range(height):
        for column in range(width):
            for k in range(3):
                total = count // 2
                for i in range(smoothing):
                    for j in range(smoothing):
                        total += rgb[smoothing * row + i, smoothing * column + j, k]
                out[height - 1 - row, column, k] = total // count


@kernel
def _lay_smoothly(rgb, z, rgb_behind, z_behind, smoothing, out):
    """Write over `out`, as of `_mean_behind`, the means of what is nearer (1 is near) of a picture
    and what is behind it, where any of the picture is."""
    height, width = out.shape[0], out.shape[1]
    count = smoothing * smoothing
    for row in range(height):
        n_nearer = 0
        for i in range(smoothing):
            y = smoothing * row + i
            for x in range(smoothing * width):
                n_nearer += z[y, x] > z_behind[y, x]
        if n_nearer == 0:
            continue
        for column in range(width):
            n_nearer = 0
            red, green, blue = count // 2, count // 2, count // 2
            for i in range(smoothing):
                for j in range(smoothing):
                    y, x = smoothing * row + i, smoothing * column + j
                    nearer = z[y, x] > z_behind[y, x]
                    n_nearer += nearer
                    shown = rgb if nearer else rgb_behind
                    red += shown[y, x, 0]
                    green += shown[y, x, 1]
                    blue += shown[y, x, 2]
            if n_nearer > 0:
                out[height - 1 - row, column, 0] = red // count
                out[height - 1 - row, column, 1] = green // count
                out[height - 1 - row, column, 2] = blue // count
