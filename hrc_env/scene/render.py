"""Rendering of crops without shadows for the detector, and of pictures with shadows for viewers.

A crop is rendered through an off-centre frustum and has the same pixels as a crop of the camera's
whole image. It is rendered without shadows and antialiasing, which would take two thirds of the
time and change no landmark.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import check_integer, make_unknown_name_error
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Roi, WorkerMotion
from hrc_env.core.typing import Image, JointAngles
from hrc_env.geometry.cameras import PinholeCamera, pinhole
from hrc_env.scene import gl
from hrc_env.scene.build import Scene
from hrc_env.scene.canvas import ALL_GROUPS, EVERYTHING, MOVING, STILL, Canvas, Part
from hrc_env.scene.primitives import OVERHEAD

CROP_PX = 256
"""Side of a crop [px]."""
CROP_QUALITY = {
    "offsamples": 0,
    "shadowsize": 0,
    "numslices": 12,
    "numstacks": 3,
    "numquads": 1,
}
"""MuJoCo's visual quality settings for crops."""
PICTURE_QUALITY = {
    "offsamples": 4,
    "shadowsize": 8192,
    "numslices": 40,
    "numstacks": 20,
    "numquads": 4,
}
"""MuJoCo's visual quality settings for pictures for viewers."""
WINDOWS_KEPT = 40
"""Maximum number of windows per camera with a stored background, including search windows."""


class StillPicture(NamedTuple):
    """A picture of the static geoms."""

    rgb: Image
    """(H, W, 3) colours, top row first."""
    z: NDArray[np.float32]
    """(H, W) depths from 1 (near) to 0 (far), bottom row first."""


VIEWPOINTS: dict[str, tuple[tuple[float, float, float], tuple[float, float, float], float]] = {
    "beside": ((0.45, -2.62, 1.95), (0.12, 0.0, 0.95), 68.0),
    "room": ((2.35, -2.15, 1.95), (-0.25, 0.15, 1.02), 78.0),
    "side": ((0.45, -2.55, 1.65), (0.1, 0.3, 1.0), 84.0),
    "arm": ((0.75, -1.55, 1.60), (-0.45, 0.05, 1.10), 56.0),
    "outside": ((3.6, -3.3, 6.6), (-0.25, 0.25, 0.35), 52.0),
    "top": ((0.0, 0.0, 9.0), (0.0, 0.0, 0.0), 60.0),
    "yard": ((4.6, -8.6, 14.6), (0.3, -0.3, 0.0), 56.0),
    "overview": ((8.9, -6.4, 4.3), (-0.7, 0.6, 1.3), 68.0),
}
"""Viewpoints of pictures for viewers: eye [m], target [m] and horizontal field of view [deg]."""
OPEN_ROOF = ("outside", "top", "overview", "yard")
"""Viewpoints for which ceiling and lamps are hidden."""


def viewpoint_camera(name: str, width: int, height: int) -> PinholeCamera:
    """Return the camera of one of `VIEWPOINTS`, for pictures of a given size [px]."""
    eye, target, hfov_deg = VIEWPOINTS[name]
    return pinhole(name, np.array(eye), np.array(target), hfov_deg, width, height)


class CropRenderer(Canvas):
    """Renderer of square crops of the cameras' images, for the detector.

    From the second picture of a window on, only the moving geoms are rendered and merged by depth
    with a stored picture of the static ones. This gives the same pixels in half the time.

    Args:
        scene: the scene.
        size_px: side of the crops [px].
    """

    def __init__(self, scene: Scene, size_px: int = CROP_PX) -> None:
        gl.draw_on_one_thread()
        super().__init__(scene, size_px, size_px, CROP_QUALITY)
        self.size_px = size_px
        self._rgb = np.empty((size_px, size_px, 3), np.uint8)
        self._z = np.empty((size_px, size_px), np.float32)

    def crop(self, camera_index: int, window: Roi) -> Image:
        """Render a rotated square (size, size, 3) of a camera's pinhole image, top row first.

        Args:
            camera_index: index of the camera among those of the scene.
            window: the square.

        Raises:
            ConfigError: there is no such camera.
            RenderingError: OpenGL is unavailable.
        """
        index = check_integer("Camera index", camera_index, 0, len(self.scene.cameras) - 1)
        return self.view(self.scene.cameras[index], window)

    def view(self, camera: PinholeCamera, window: Roi) -> Image:
        """Render a rotated square (size, size, 3) of any camera's pinhole image, top row first."""
        key = _key(camera, window)
        if key not in self._kept:
            self._remember(key, None)
            self._show(EVERYTHING, camera, window)
            return self.paint()
        still = self._kept[key]
        if still is None:
            z = np.empty_like(self._z)
            self._show(STILL, camera, window)
            self.read(self._rgb, z)
            still = StillPicture(np.ascontiguousarray(self._rgb[::-1]), z)
        self._remember(key, still)
        self._show(MOVING, camera, window)
        self.read(self._rgb, self._z)
        crop = still.rgb.copy()
        _lay_over(self._rgb, self._z, still.z, crop)
        return crop

    def __reduce__(self) -> tuple[Any, ...]:
        return CropRenderer, (self.scene, self.size_px)

    def _show(self, part: Part, camera: PinholeCamera, window: Roi) -> None:
        """Choose the part of the scene and the window of a camera for the next picture."""
        self.show(part)
        self.aim(camera, window, window.side_px)

    def _remember(self, key: tuple[float, ...], still: StillPicture | None) -> None:
        """Store the background of a window as the most recent one.

        It is None if the window has been used only once.
        """
        self._kept.pop(key, None)
        self._kept[key] = still
        while len(self._kept) > WINDOWS_KEPT * len(self.scene.cameras):
            del self._kept[next(iter(self._kept))]


def _key(camera: PinholeCamera, window: Roi) -> tuple[float, ...]:
    """Return the key of a stored picture: the parameters of the camera and the window."""
    numbers = (*camera.K.ravel(), *camera.T_world_from_cam.ravel())
    side = (*window.centre_px, window.side_px, window.rotation_rad)
    return tuple(map(float, (*numbers, *side)))


@kernel
def _lay_over(
    rgb: Image, z: NDArray[np.float32], z_behind: NDArray[np.float32], out: Image
) -> None:
    """Merge a picture with a background by depth.

    Args:
        rgb: (H, W, 3) picture, bottom row first.
        z: (H, W) depths of the picture from 1 (near) to 0 (far), bottom row first.
        z_behind: (H, W) depths of the background, bottom row first.
        out: (H, W, 3) background, top row first, in which nearer pixels of the picture are written.
    """
    height, width = z.shape
    for row in range(height):
        n_nearer = 0
        for column in range(width):
            n_nearer += z[row, column] > z_behind[row, column]
        if n_nearer == 0:
            continue
        for column in range(width):
            if z[row, column] > z_behind[row, column]:
                for k in range(3):
                    out[height - 1 - row, column, k] = rgb[row, column, k]


class PictureRenderer(Canvas):
    """Renderer of pictures for viewers, with shadows, antialiasing and named viewpoints."""

    def __init__(
        self,
        scene: Scene,
        width_px: int = 1280,
        height_px: int = 720,
        quality: dict[str, int] = PICTURE_QUALITY,
    ) -> None:
        """Make a renderer of pictures of one size.

        Args:
            scene: the scene.
            width_px: width of the pictures [px].
            height_px: height of the pictures [px].
            quality: values of fields of MuJoCo's visual.quality by name.
        """
        super().__init__(scene, width_px, height_px, quality)

    def picture(
        self,
        q: JointAngles,
        motion: WorkerMotion | None,
        viewpoint: str | PinholeCamera = "room",
        depth: bool = False,
        shadows: bool = True,
    ) -> Image | NDArray[np.float32]:
        """Render a picture of the scene.

        Args:
            q: (N,) joint angles of the robot [rad].
            motion: poses of the workers of one environment, arrays (W, S, ...).
            viewpoint: name in `VIEWPOINTS`, name of a camera of the rig, or any camera; the picture
                has the horizontal field of view of that camera.
            depth: whether to return distances instead of colours.
            shadows: whether lamps cast shadows; rendering in software is several times faster
                without shadows.

        Returns:
            (H, W, 3) colours, or (H, W) distances along the optical axis [m], top row first.
        """
        camera = self.camera(viewpoint)
        self.pose(q, motion)
        roofless = viewpoint in OPEN_ROOF
        self.groups([group for group in ALL_GROUPS if not (roofless and group == OVERHEAD)])
        self.show(shadows=shadows and not depth)
        middle = Roi((camera.width_px / 2, camera.height_px / 2), camera.width_px, 0.0)
        self.aim(camera, middle, camera.width_px * self.height_px / self.width_px)
        return self.depth_m() if depth else self.paint()

    def camera(self, viewpoint: str | PinholeCamera) -> PinholeCamera:
        """Return the camera of a viewpoint: a name in `VIEWPOINTS` or the rig, or a camera."""
        if isinstance(viewpoint, PinholeCamera):
            return viewpoint
        rig = {camera.name: camera for camera in self.scene.cameras}
        if viewpoint in rig:
            return rig[viewpoint]
        if viewpoint not in VIEWPOINTS:
            raise make_unknown_name_error("viewpoint", viewpoint, [*VIEWPOINTS, *rig])
        return viewpoint_camera(viewpoint, self.width_px, self.height_px)
