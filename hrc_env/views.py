"""Views of a simulation for people: the room, the cameras with what was made of them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env import pictures
from hrc_env.batching import one
from hrc_env.geometry.cameras import image_from_pinhole
from hrc_env.motion import generator
from hrc_env.perception.lensed import Lensed
from hrc_env.records import CropWindow, Keypoints, WorkerMotion
from hrc_env.scene.render import CROP_PX, PICTURE_QUALITY, CropRenderer, PictureRenderer
from hrc_env.simulation import Simulation
from hrc_env.typing import Image, JointAngles

PICTURE_SIZE = (960, 720)
VIEWPOINT = "beside"
"""From where people look on: robot and worker side by side."""
FILM_QUALITY = {
    **PICTURE_QUALITY, "shadowsize": 1536, "numslices": 16, "numstacks": 8, "numquads": 1,
}  # fmt: skip
"""Shadows and round things a little coarser: a third of the time."""
SMOOTHING = 2
"""Cameras' pictures are drawn so many times as large, and shrunk, for smooth edges."""
MOSAIC_TILE = (640, 360)


class Views:
    """Pictures of one environment of a simulation; graphics contexts are made when asked for."""

    def __init__(self, simulation: Simulation, b: int = 0) -> None:
        self.simulation, self.b = simulation, b
        self._pictures: dict[tuple[int, int], PictureRenderer] = {}
        self._squares: dict[int, CropRenderer] = {}

    def picture(self, depth: bool = False, b: int | None = None) -> NDArray[Any]:
        """Robot and worker, (720, 960, 3) uint8, or distances (720, 960) float32 [m].

        Of another environment than usual with `b`.
        """
        renderer = self._picture_renderer(*PICTURE_SIZE)
        return renderer.picture(*self.pose(b), VIEWPOINT, depth=depth)

    def room(self, width: int, height: int) -> Image:
        """The room with the estimated skeleton over it."""
        renderer = self._picture_renderer(width, height)
        image = renderer.picture(*self.pose(), VIEWPOINT).astype(np.uint8, copy=False)
        camera = renderer.camera(VIEWPOINT)
        pictures.draw_estimate(image, camera, self.simulation.estimate, self.b)
        pictures.draw_goal(image, camera, self.simulation.task.goal_world[self.b])
        return image

    def cameras(self, width: int, height: int) -> list[Image]:
        """Every camera's picture with crops, detected keypoints and the estimate.

        Without shadows, as the detector sees the scene; what stands still is drawn once.
        """
        keypoints, windows = self._looks()
        images = self._square_images(SMOOTHING * width)
        views = []
        for c, camera in enumerate(self.simulation.scene.cameras):
            middle = (camera.width_px / 2, camera.height_px / 2)
            square = images.crop(c, CropWindow(middle, float(camera.width_px), 0.0))
            image = pictures.shrink(pictures.middle_rows(square, SMOOTHING * height), width, height)
            for window in (of_worker[c] for of_worker in windows):
                if window is not None:
                    pictures.draw_window(image, camera, window)
            pictures.draw_estimate(image, camera, self.simulation.estimate, self.b, thickness=1)
            if keypoints is not None:
                pictures.draw_keypoints(image, camera, keypoints, c)
            pictures.label(image, camera.name.replace("_", " "), (6, 6), 13)
            views.append(image)
        return views

    def crops(self, size: int) -> list[Image]:
        """What the pose network was given: each camera's crop, with its landmarks."""
        keypoints, windows = self._looks()
        if keypoints is None or not windows:
            return []
        images = self._square_images(CROP_PX)
        return [
            self._crop(images, c, window, keypoints, size) for c, window in enumerate(windows[0])
        ]

    def mosaic(self) -> Image:
        """The cameras in two columns."""
        return pictures.tile(self.cameras(*MOSAIC_TILE), 2)

    def close(self) -> None:
        """Free the graphics contexts."""
        for renderer in (*self._pictures.values(), *self._squares.values()):
            renderer.close()
        self._pictures, self._squares = {}, {}

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_pictures": {}, "_squares": {}}

    def _crop(
        self,
        images: Lensed,
        c: int,
        window: CropWindow | None,
        keypoints: Keypoints,
        size: int,
    ) -> Image:
        if window is None:
            image = np.empty((size, size, 3), np.uint8)
            image[:] = pictures.PANEL
            pictures.write(image, "no worker in view", (10, size // 2 - 10), 13)
            return image
        image = pictures.shrink(images.crop(c, window), size, size)
        joints_px = image_from_pinhole(images.cameras[c], keypoints.px[0, c, 0])
        pictures.draw_landmarks(image, window, joints_px, keypoints.confidence[0, c, 0])
        return image

    def pose(self, b: int | None = None) -> tuple[JointAngles, WorkerMotion]:
        """The arm (N,) and the workers (W, S, ...) now, of another environment with `b`."""
        b = self.b if b is None else b
        motion = one(generator.current(self.simulation.motion, np.array([b])), 0)
        return self.simulation.physics.q[b], motion

    def _looks(self) -> tuple[Keypoints | None, list[list[CropWindow | None]]]:
        return self.simulation.senses.looks(self.b)

    def _picture_renderer(self, width: int, height: int) -> PictureRenderer:
        size, scene = (width, height), self.simulation.scene
        if size not in self._pictures:
            quality = PICTURE_QUALITY if size == PICTURE_SIZE else FILM_QUALITY
            self._pictures[size] = PictureRenderer(scene, width, height, quality)
        self._pictures[size].dress(self.simulation.senses.look_of(self.b))
        return self._pictures[size]

    def _square_images(self, size: int) -> Lensed:
        """Square windows of what the cameras see now."""
        scene = self.simulation.scene
        if size not in self._squares:
            self._squares[size] = CropRenderer(scene, size)
        self._squares[size].dress(self.simulation.senses.look_of(self.b))
        self._squares[size].draw(*self.pose())
        return Lensed(self._squares[size], scene.cameras)
