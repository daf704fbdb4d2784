"""Pictures of the scene: plain crops for the detector, pretty ones for people.

A crop is drawn as such, through an off-centre frustum; it is the same light on the same
pixels as if it were cut from the camera's whole image. Crops have neither shadows nor
antialiasing, which cost two thirds of the time and change no landmark.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hrc_env.errors import ConfigError, unknown
from hrc_env.geometry.cameras import PinholeCamera, pinhole
from hrc_env.records import CropWindow, WorkerMotion
from hrc_env.scene.build import Scene
from hrc_env.scene.canvas import Canvas
from hrc_env.scene.primitives import DECORATION, OVERHEAD, ROBOT_LOOKS, SOLID
from hrc_env.typing import Image, JointAngles

CROP_PX = 256
CROP_QUALITY = {
    "offsamples": 0, "shadowsize": 0, "numslices": 12, "numstacks": 6, "numquads": 1,
}  # fmt: skip
PICTURE_QUALITY = {
    "offsamples": 4, "shadowsize": 8192, "numslices": 40, "numstacks": 20, "numquads": 4,
}  # fmt: skip
EVERYTHING = (SOLID, DECORATION, ROBOT_LOOKS, OVERHEAD)

VIEWPOINTS: dict[str, tuple[tuple[float, float, float], tuple[float, float, float], float]] = {
    "room": ((2.35, -2.15, 1.95), (-0.25, 0.15, 1.02), 78.0),
    "side": ((0.45, -2.55, 1.65), (0.1, 0.3, 1.0), 84.0),
    "arm": ((0.75, -1.55, 1.60), (-0.45, 0.05, 1.10), 56.0),
    "outside": ((3.6, -3.3, 6.6), (-0.25, 0.25, 0.35), 52.0),
    "top": ((0.0, 0.0, 9.0), (0.0, 0.0, 0.0), 60.0),
}
"""Eye [m], target [m], horizontal field of view [degrees] of pictures for people."""
OPEN_ROOF = ("outside", "top")
"""Viewpoints from which ceiling and lamps are left out."""


class CropRenderer:
    """Square crops of the cameras' images: what the detector sees."""

    def __init__(self, scene: Scene, size_px: int = CROP_PX) -> None:
        self.scene = scene
        self.size_px = size_px
        self._canvas = Canvas(scene, size_px, size_px, CROP_QUALITY, EVERYTHING)
        self._stale = True

    def draw(self, q: JointAngles, motion: WorkerMotion | None) -> None:
        """Pose the scene for the crops that follow.

        Args:
            q: (N,) angles of the arm [rad].
            motion: the workers of one environment, arrays (W, S, ...).
        """
        self._canvas.pose(q, motion)
        self._stale = True

    def crop(self, camera_index: int, window: CropWindow) -> Image:
        """(256, 256, 3) of a turned square of a camera's image, top row first.

        Raises:
            ConfigError: no such camera. RenderingError: no OpenGL here, or closed.
        """
        if not 0 <= camera_index < len(self.scene.cameras):
            raise ConfigError(
                f"Camera index must be 0 to {len(self.scene.cameras) - 1}, got {camera_index}."
            )
        if self._stale:
            self._canvas.refresh(shadows=False)
            self._stale = False
        self._canvas.aim(self.scene.cameras[camera_index], window, window.side_px)
        return self._canvas.paint()

    def close(self) -> None:
        """Free the OpenGL context."""
        self._canvas.close()


class PictureRenderer:
    """Pictures for people: shadows, smooth edges, named viewpoints."""

    def __init__(self, scene: Scene, width_px: int = 1280, height_px: int = 720) -> None:
        self.scene = scene
        self._canvas = Canvas(scene, width_px, height_px, PICTURE_QUALITY, EVERYTHING)

    def viewpoints(self) -> tuple[str, ...]:
        """What `picture` takes: named views and the cameras of the rig."""
        return (*VIEWPOINTS, *(camera.name for camera in self.scene.cameras))

    def picture(
        self,
        q: JointAngles,
        motion: WorkerMotion | None,
        viewpoint: str | PinholeCamera = "room",
        depth: bool = False,
    ) -> Image | NDArray[np.float32]:
        """The scene from a viewpoint.

        Args:
            q: (N,) angles of the arm [rad].
            motion: the workers of one environment, arrays (W, S, ...).
            viewpoint: a name from `viewpoints()`, or any camera. A rig's camera keeps its
                horizontal field of view; the picture's shape decides how much of its
                height is seen.
            depth: distances instead of colours.

        Returns:
            (H, W, 3) uint8, or (H, W) float32 distance along the optical axis [m].
        """
        camera = self.camera(viewpoint)
        canvas = self._canvas
        canvas.pose(q, motion)
        groups: Sequence[int] = EVERYTHING
        if viewpoint in OPEN_ROOF:
            groups = (SOLID, DECORATION, ROBOT_LOOKS)
        canvas.refresh(shadows=not depth, groups=groups)
        middle = CropWindow((camera.width_px / 2, camera.height_px / 2), camera.width_px, 0.0)
        canvas.aim(camera, middle, camera.width_px * canvas.height_px / canvas.width_px)
        return canvas.depth_m() if depth else canvas.paint()

    def camera(self, viewpoint: str | PinholeCamera) -> PinholeCamera:
        """The camera of a viewpoint; its image is as wide as the picture, or the rig's own."""
        if isinstance(viewpoint, PinholeCamera):
            return viewpoint
        for camera in self.scene.cameras:
            if camera.name == viewpoint:
                return camera
        if viewpoint not in VIEWPOINTS:
            raise unknown("viewpoint", viewpoint, self.viewpoints())
        eye, target, hfov_deg = VIEWPOINTS[viewpoint]
        size = self._canvas.width_px, self._canvas.height_px
        return pinhole(viewpoint, np.array(eye), np.array(target), hfov_deg, *size)

    def close(self) -> None:
        """Free the OpenGL context."""
        self._canvas.close()
