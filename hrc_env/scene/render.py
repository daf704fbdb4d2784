"""Pictures of the scene: plain crops for the detector, pretty ones for people.

A crop is drawn through an off-centre frustum: the same pixels as if cut from the camera's whole
image. Shadows and antialiasing, two thirds of the time, would change no landmark.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import unknown, whole
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Roi, WorkerMotion
from hrc_env.core.typing import Image, JointAngles
from hrc_env.geometry.cameras import PinholeCamera, pinhole
from hrc_env.scene import gl
from hrc_env.scene.build import Scene
from hrc_env.scene.canvas import ALL_GROUPS, EVERYTHING, MOVING, STILL, Canvas, Part
from hrc_env.scene.primitives import OVERHEAD

CROP_PX = 256
CROP_QUALITY = {
    "offsamples": 0, "shadowsize": 0, "numslices": 12, "numstacks": 3, "numquads": 1,
}  # fmt: skip
PICTURE_QUALITY = {
    "offsamples": 4, "shadowsize": 8192, "numslices": 40, "numstacks": 20, "numquads": 4,
}  # fmt: skip
WINDOWS_KEPT = 40
"""Windows per camera whose background is kept: those of a search too."""

VIEWPOINTS: dict[str, tuple[tuple[float, float, float], tuple[float, float, float], float]] = {
    "beside": ((0.45, -2.62, 1.95), (0.12, 0.0, 0.95), 68.0),
    "room": ((2.35, -2.15, 1.95), (-0.25, 0.15, 1.02), 78.0),
    "side": ((0.45, -2.55, 1.65), (0.1, 0.3, 1.0), 84.0),
    "arm": ((0.75, -1.55, 1.60), (-0.45, 0.05, 1.10), 56.0),
    "outside": ((3.6, -3.3, 6.6), (-0.25, 0.25, 0.35), 52.0),
    "top": ((0.0, 0.0, 9.0), (0.0, 0.0, 0.0), 60.0),
    "yard": ((10.5, -3.0, 11.5), (-0.6, -0.6, 0.0), 56.0),
    "overview": ((8.9, -6.4, 4.3), (-0.7, 0.6, 1.3), 68.0),
}
"""Eye [m], target [m], horizontal field of view [degrees] of pictures for people."""
OPEN_ROOF = ("outside", "top", "overview", "yard")
"""Viewpoints from which ceiling and lamps are left out."""


def viewpoint_camera(name: str, width: int, height: int) -> PinholeCamera:
    """The camera of one of `VIEWPOINTS`, for pictures of this size [px]."""
    eye, target, hfov_deg = VIEWPOINTS[name]
    return pinhole(name, np.array(eye), np.array(target), hfov_deg, width, height)


class CropRenderer(Canvas):
    """Square crops of the cameras' images: what the detector sees. Where a window comes again, what
    moves is laid by depth over what does not, drawn once: the same pixels in half the time."""

    def __init__(self, scene: Scene, size_px: int = CROP_PX) -> None:
        gl.draw_on_one_thread()
        super().__init__(scene, size_px, size_px, CROP_QUALITY)
        self.size_px = size_px
        self._rgb = np.empty((size_px, size_px, 3), np.uint8)
        self._z = np.empty((size_px, size_px), np.float32)

    def crop(self, camera_index: int, window: Roi) -> Image:
        """(size, size, 3) of a turned square of a camera's image, top row first, as without its
        lens. Raises `ConfigError` for no such camera, `RenderingError` without OpenGL."""
        index = whole("Camera index", camera_index, 0, len(self.scene.cameras) - 1)
        return self.view(self.scene.cameras[index], window)

    def view(self, camera: PinholeCamera, window: Roi) -> Image:
        """The same of any camera, as a pinhole sees."""
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
            still = np.ascontiguousarray(self._rgb[::-1]), z
        self._remember(key, still)
        self._show(MOVING, camera, window)
        self.read(self._rgb, self._z)
        crop = still[0].copy()
        _lay_over(self._rgb, self._z, still[1], crop)
        return crop

    def __reduce__(self) -> tuple[Any, ...]:
        return CropRenderer, (self.scene, self.size_px)

    def _show(self, what: Part, camera: PinholeCamera, window: Roi) -> None:
        self.show(what)
        self.aim(camera, window, window.side_px)

    def _remember(
        self, key: tuple[float, ...], still: tuple[Image, NDArray[np.float32]] | None
    ) -> None:
        """Keep a window, the latest last: colours (top row first) and depths (bottom row first) of
        what stands still; None until it comes again."""
        self._kept.pop(key, None)
        self._kept[key] = still
        while len(self._kept) > WINDOWS_KEPT * len(self.scene.cameras):
            del self._kept[next(iter(self._kept))]


def _key(camera: PinholeCamera, window: Roi) -> tuple[float, ...]:
    """The numbers of a camera and of a window."""
    numbers = (*camera.K.ravel(), *camera.T_world_from_cam.ravel())
    side = (*window.centre_px, window.side_px, window.rotation_rad)
    return tuple(map(float, (*numbers, *side)))


@kernel
def _lay_over(rgb, z, z_behind, out):
    """What is nearer than what is behind (1 is near), laid over `out`, which is top row first."""
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
    """Pictures for people: shadows, smooth edges, named viewpoints."""

    def __init__(
        self,
        scene: Scene,
        width_px: int = 1280,
        height_px: int = 720,
        quality: dict[str, int] = PICTURE_QUALITY,
    ) -> None:
        """A renderer of pictures of one size."""
        super().__init__(scene, width_px, height_px, quality)

    def picture(
        self,
        q: JointAngles,
        motion: WorkerMotion | None,
        viewpoint: str | PinholeCamera = "room",
        depth: bool = False,
        shadows: bool = True,
    ) -> Image | NDArray[np.float32]:
        """The scene from a viewpoint: (H, W, 3) uint8, or (H, W) float32 `depth` along the optical
        axis [m].

        Args:
            q: (N,) angles of the arm [rad].
            motion: the workers of one environment, arrays (W, S, ...).
            viewpoint: a name of `VIEWPOINTS` or of the rig, or any camera, which keeps its
                horizontal field of view; the picture's shape says how much of its height is seen.
            depth: distances instead of colours.
            shadows: whether lamps cast them; without is several times faster in software.
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
        """The camera of a viewpoint; its image is as wide as the picture, or the rig's own."""
        if isinstance(viewpoint, PinholeCamera):
            return viewpoint
        rig = {camera.name: camera for camera in self.scene.cameras}
        if viewpoint in rig:
            return rig[viewpoint]
        if viewpoint not in VIEWPOINTS:
            raise unknown("viewpoint", viewpoint, [*VIEWPOINTS, *rig])
        return viewpoint_camera(viewpoint, self.width_px, self.height_px)
