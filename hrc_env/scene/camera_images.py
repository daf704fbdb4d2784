"""Rendering of small, uncropped images of a rig's cameras, for policies.

Static geoms and props on the floor are rendered once for each camera and stored. In every step,
only the moving geoms are rendered and merged with the stored image by depth. Images are antialiased
and have no shadows.
"""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import ConfigError, check_integer
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
from hrc_env.scene.worker_visuals import HIDDEN, SHOWN, assign_props

SMALLEST_PX = 8
"""Minimum height and width of images in an observation [px]."""
LARGEST_PX = 1024
"""Maximum height and width of images in an observation [px]."""
SMOOTHING = 2
"""Supersampling factor of whole images, for antialiasing."""
SMALL_PX = 128
"""Height and width up to which round geoms are rendered with the quality `COARSE` [px]."""
COARSE = {"numslices": 8, "numstacks": 2}
"""MuJoCo's visual quality settings for round geoms in small images."""
TOO_THIN = 0.2
"""Apparent thickness of moving discs below which they are not rendered [rendered pixels]."""
KEPT_BYTES = 2**28
"""Memory for stored images of static geoms [bytes]."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class ImageConfig:
    """Settings of the camera images that an observation also contains (`observe_images`).

    Each image is the current view of a camera of the rig, with its lens and the episode's
    appearance, but without faults, delays and shadows. It is the camera's whole image, scaled to
    `height` x `width`; it is black if the camera is not in the episode's rig. A mapping of these
    fields or a tuple (height, width) is also accepted.
    """

    height: int = 84
    """Height of an image [px], from 8 to 1024."""
    width: int = 84
    """Width of an image [px], from 8 to 1024."""
    cameras: tuple[int | str, ...] | None = None
    """Names, or indices from 0, of cameras of the environment's rig; None for all cameras."""

    def __post_init__(self) -> None:
        for name in ("height", "width"):
            check_integer(f"{name} of images [px]", getattr(self, name), SMALLEST_PX, LARGEST_PX)
        if self.cameras is not None and not self.cameras:
            raise ConfigError(
                "cameras of images must name one or more cameras, or be None for the whole rig, "
                "got an empty list. For an observation without images, use observe_images=None."
            )


def parse_images(value: Any) -> ImageConfig | None:
    """Return the settings of images for a value of the argument `observe_images`.

    Args:
        value: None, (height, width), a mapping or an `ImageConfig`.

    Raises:
        ConfigError: the value is none of these, or its size is invalid.
    """
    if value is None or isinstance(value, ImageConfig):
        return value
    if isinstance(value, np.ndarray):
        value = value.tolist()
    try:
        if isinstance(value, Mapping):
            is_one = isinstance(value.get("cameras"), int | str)
            fields = {**value, "cameras": [value["cameras"]]} if is_one else value
            return from_mapping(ImageConfig, fields)
        if isinstance(value, Sequence) and not isinstance(value, str) and len(value) == 2:
            return ImageConfig(*value)
    except ConfigError as error:
        raise ConfigError(f"observe_images: {error}") from error
    raise ConfigError(
        "observe_images must be (height, width) [px], a mapping such as "
        '{"height": 84, "width": 84, "cameras": ["camera_1"]}, an ImageConfig or None, '
        f"got {value!r}."
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Backdrop:
    """A stored image of the static geoms."""

    look: Look | None
    """Appearance with which the image was rendered."""
    rgb: Image
    """Colours at the rendered size, bottom row first."""
    z: NDArray[np.float32]
    """Depths at the rendered size, from 1 (near) to 0 (far), bottom row first."""
    mean: Image
    """Averaged colours at the final size, top row first."""


class Layer(NamedTuple):
    """A rendered part of the scene."""

    rgb: Image
    """Colours, bottom row first."""
    z: NDArray[np.float32]
    """Depths from 1 (near) to 0 (far), bottom row first."""


class CameraImages(Canvas):
    """Renderer of whole images (height, width, 3) of pinhole cameras, and of square image windows.

    Environments with the same appearance share the stored images of static geoms.
    """

    def __init__(self, scene: Scene, height_px: int, width_px: int, size_px: int = 1) -> None:
        """Make a renderer.

        Args:
            scene: the scene.
            height_px: height of whole images [px].
            width_px: width of whole images [px].
            size_px: side of windows (`view`) [px].
        """
        gl.draw_on_one_thread()
        width, height = (max(SMOOTHING * side, size_px) for side in (width_px, height_px))
        coarse = COARSE if max(height_px, width_px) <= SMALL_PX else {}
        super().__init__(scene, width, height, {**CROP_QUALITY, **coarse})
        self.shape, self.size_px = (height_px, width_px), size_px
        self._owner: int | None = None  # environment with a randomized appearance
        self._backdrops: dict[Hashable, _Backdrop] = {}
        self._model.geom_group[self._find_thin()] = HIDDEN
        self._geom_rows = self._model.body_mocapid[self._model.geom_bodyid]
        self._lying, self._placement = np.zeros(0, np.int64), b""
        self._without_skins = mujoco.MjvOption()
        self._without_skins.flags[int(mujoco.mjtVisFlag.mjVIS_SKIN)] = 0

    def _find_thin(self) -> Ints:
        """Return indices of the moving discs that are too thin to be visible in any image."""
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
        """Pose the moving geoms like `Canvas.pose`, but treat props on the floor as static."""
        super().pose(q, motion)
        if motion is None or not self._visuals.props.size:
            return
        shown = assign_props(self._visuals.props, motion.held)[len(self._visuals.segments) :]
        rows = shown[shown >= 0]
        places = self._data.mocap_pos[rows], self._data.mocap_quat[rows]
        placement = b"".join(each.tobytes() for each in (rows, *places))
        if placement != self._placement:
            self._placement = placement
            self._lying = np.flatnonzero(np.isin(self._geom_rows, rows))
        self._model.geom_group[self._lying] = HIDDEN

    def show(self, part: Part = EVERYTHING, shadows: bool = False) -> None:
        """Choose the part of the scene for the next pictures; props on the floor are static."""
        is_fresh = part in self._fresh
        super().show(part, shadows)
        if part is not MOVING and not is_fresh and len(self._lying):
            groups = self._model.geom_group.copy()
            self._model.geom_group[:] = HIDDEN
            self._model.geom_group[self._lying] = SHOWN
            mujoco.mjv_addGeoms(
                self._model,
                self._data,
                self._without_skins,
                mujoco.MjvPerturb(),
                int(mujoco.mjtCatBit.mjCAT_DYNAMIC),
                self._shown,
            )
            self._model.geom_group[:] = groups

    def dress(self, b: int, look: Look | None) -> None:
        """Set the appearance of environment `b` for the next poses; None for the scene as built."""
        self._owner = None if look is None else b
        self.randomize(look)

    def image(self, camera: PinholeCamera) -> Image:
        """Render the whole image of a camera, scaled to (height, width, 3), top row first."""
        middle = Roi((camera.width_px / 2, camera.height_px / 2), float(camera.width_px), 0.0)
        fine = SMOOTHING * self.shape[0], SMOOTHING * self.shape[1]
        return self._layered(camera, middle, float(camera.height_px), fine, SMOOTHING)

    def view(self, camera: PinholeCamera, window: Roi) -> Image:
        """Render a square window (size, size, 3) of a camera's pinhole image, top row first."""
        return self._layered(camera, window, window.side_px, (self.size_px, self.size_px), 1)

    def _layered(
        self,
        camera: PinholeCamera,
        window: Roi,
        height_px: float,
        fine: tuple[int, int],
        smoothing: int,
    ) -> Image:
        """Render the moving geoms in front of the stored static ones, top row first.

        Args:
            camera: the camera.
            window: centre, rotation and width of a rectangle of the camera's image [px].
            height_px: height of the rectangle [px].
            fine: height and width at which the rectangle is rendered [px].
            smoothing: side of the squares of rendered pixels that are averaged to one pixel [px].
        """
        numbers = camera.K.tobytes(), camera.T_world_from_cam.tobytes()
        key = (self._owner, self._placement, numbers, window, height_px)
        behind = self._backdrops.get(key)
        if behind is None or behind.look is not self._look:
            still = self._draw(STILL, camera, window, height_px, fine)
            mean = np.empty((fine[0] // smoothing, fine[1] // smoothing, 3), np.uint8)
            _average(still.rgb, smoothing, mean)
            behind = _Backdrop(self._look, still.rgb, still.z, mean)
        self._remember(key, behind)
        moving = self._draw(MOVING, camera, window, height_px, fine)
        image = behind.mean.copy()
        _lay_smoothly(moving.rgb, moving.z, behind.rgb, behind.z, smoothing, image)
        return image

    def _remember(self, key: Hashable, behind: _Backdrop) -> None:
        """Store an image of the static geoms, and delete the oldest images beyond `KEPT_BYTES`."""
        self._backdrops.pop(key, None)
        self._backdrops[key] = behind
        most = max(KEPT_BYTES // (behind.rgb.nbytes + behind.z.nbytes), len(self.scene.cameras))
        while len(self._backdrops) > most:
            del self._backdrops[next(iter(self._backdrops))]

    def _draw(
        self,
        part: Part,
        camera: PinholeCamera,
        window: Roi,
        height_px: float,
        shape: tuple[int, int],
    ) -> Layer:
        """Render a part of the scene with a given height and width [px]."""
        layer = Layer(np.empty((*shape, 3), np.uint8), np.empty(shape, np.float32))
        self.show(part)
        self.aim(camera, window, height_px)
        self.read(layer.rgb, layer.z)
        return layer

    def __reduce__(self) -> tuple[Any, ...]:
        return CameraImages, (self.scene, *self.shape, self.size_px)


@kernel
def _average(rgb: Image, smoothing: int, out: Image) -> None:
    """Average a picture over squares of pixels.

    Args:
        rgb: (smoothing * H, smoothing * W, 3) picture, bottom row first.
        smoothing: side of the squares [px].
        out: (H, W, 3) output, which is filled, top row first.
    """
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
def _lay_smoothly(
    rgb: Image,
    z: NDArray[np.float32],
    rgb_behind: Image,
    z_behind: NDArray[np.float32],
    smoothing: int,
    out: Image,
) -> None:
    """Merge a picture with a background by depth, and average it over squares of pixels.

    Only squares in which a pixel of the picture is nearer than the background are written.

    Args:
        rgb: (smoothing * H, smoothing * W, 3) picture, bottom row first.
        z: depths of the picture from 1 (near) to 0 (far), bottom row first.
        rgb_behind: background, of the same shape, bottom row first.
        z_behind: depths of the background, bottom row first.
        smoothing: side of the squares [px].
        out: (H, W, 3) averaged background, top row first, which is updated.
    """
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
