"""Views of a simulation for people: the room, the cameras with what was made of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.batching import one, rows
from hrc_env.core.errors import unknown, whole
from hrc_env.core.records import Keypoints, PoseEstimate, Roi, WorkerMotion
from hrc_env.core.typing import Floats, Image, Points3
from hrc_env.env_config import PICTURE_SIZE
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.geometry.cameras import PinholeCamera, image_from_pinhole, pinhole, resize
from hrc_env.geometry.chains import capsules
from hrc_env.motion import generator
from hrc_env.perception.lenses import LensRenderer
from hrc_env.render import overlay
from hrc_env.render.marks import (
    CAPSULES_HIDDEN,
    CAPSULES_SHOWN,
    MARKER_HIDDEN,
    MARKER_SHOWN,
    Solids,
    draw_legend,
    markers_of,
    marks_of,
    solids_of,
)
from hrc_env.render.stage import SMOOTHING, Stage
from hrc_env.scene.canvas import Canvas
from hrc_env.scene.domain_randomization import Look
from hrc_env.scene.render import (
    PICTURE_QUALITY,
    VIEWPOINTS,
    CropRenderer,
    PictureRenderer,
    viewpoint_camera,
)
from hrc_env.scene.rig import make_cameras
from hrc_env.simulation import Simulation

SMALLEST_PX, LARGEST_PX = 16, 4096
DEPTH_QUALITY = {**PICTURE_QUALITY, "offsamples": 0, "shadowsize": 0}
MOSAIC_TILE = (640, 360)
SIDES = (
    ("from above", np.array([0.0, 0.0, 5.0]), np.zeros(3)),
    ("from the side", np.array([0.0, -4.2, 1.4]), np.array([0.0, 0.0, 0.9])),
)
"""Where what is believed is seen from: eye and target from the robot's foot [m]."""
SIDES_HFOV_DEG = 55.0
CameraChoice: TypeAlias = int | str | CameraConfig | PinholeCamera | None
"""A camera of the rig by its index or name, a viewpoint's name, or a camera of one's own; None: the
task's viewpoint."""


def picture_size(width: Any, height: Any) -> tuple[int, int]:
    """A picture's width and height [px]; `ConfigError` unless whole numbers from 16 to 4096."""
    limits = SMALLEST_PX, LARGEST_PX
    return whole("width [px]", width, *limits), whole("height [px]", height, *limits)


@dataclass(frozen=True, slots=True)
class Glance:
    """One environment at one moment, apart from the simulation, which may go on."""

    q: Floats
    """(nq,) as `Physics.qpos`."""
    motion: WorkerMotion
    """The workers, arrays (W, S, ...)."""
    look: Look | None
    markers_world: Points3
    """(M, 3) what the task has to show [m]."""
    cameras: tuple[PinholeCamera, ...]
    """Those of its episode."""
    estimate: PoseEstimate
    """Of a batch of one, as are the keypoints."""
    keypoints: Keypoints | None
    windows: list[list[Roi | None]]
    """Of every worker, through every camera."""
    crops: list[Image | None]
    """What the pose network was given of the first worker."""
    shield_rad_s: float = 0.0
    """By how much the shield changed the last command."""
    solids: tuple[Solids, ...] = ()
    """Shapes of which distances are taken, for the overlay."""


class Views:
    """Pictures of a simulation's environments; graphics contexts are made when asked for.

    Any thread may ask for one, and call `close`, but no two at once; with a `glance` taken before,
    the simulation may go on in another one.
    """

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self._renderers: dict[str, tuple[tuple[int, int], Any]] = {}
        """By purpose: the size of their pictures, and themselves."""

    def picture(
        self,
        depth: bool = False,
        b: int = 0,
        size: tuple[int, int] = PICTURE_SIZE,
        *,
        camera: CameraChoice = None,
        markers: bool = True,
        capsules: bool = False,
    ) -> NDArray[Any]:
        """Return a picture of environment `b`, (height, width, 3) of uint8, top row first.

        Args:
            depth: distances along the optical axis instead, (height, width) float32 [m]; of the
                scene alone.
            b: the environment.
            size: width and height [px].
            camera: which one: an index or a name of the rig; a viewpoint such as "room" or "top";
                or a `CameraConfig`. None: from where the task is seen best.
            markers: whether goals and other places that the task marks are shown.
            capsules: whether what distances are taken of is laid over the scene: capsules of robot
                and people. Not through a camera with a lens.

        Raises:
            ConfigError: there is no such camera.
        """
        seen, viewpoint = self.glance(b, capsules), self.simulation.task.viewpoint
        chosen = viewpoint if camera is None else _chosen(camera, seen.cameras)
        if depth:
            renderer = self._renderer("depth", size, seen)
            return renderer.picture(seen.q, seen.motion, chosen, depth=True)
        if isinstance(chosen, PinholeCamera) and chosen.lens is not None:
            (image,) = self._through_cameras(*size, seen, [chosen])
            if markers:
                overlay.draw_markers(image, chosen, seen.markers_world)
        else:
            image = self._marked(self._view(chosen, *size), seen, markers)
            draw_legend(image, seen.solids)
        overlay.draw_shield(image, seen.shield_rad_s)
        return image

    def glance(self, b: int = 0, capsules: bool = False) -> Glance:
        """All that there is to draw of environment `b` now; `capsules`: `Glance.solids`, too."""
        simulation = self.simulation
        keypoints, windows = simulation.pipeline.last_detections(b)
        return Glance(
            *self.pose(b),
            simulation.look_of(b),
            simulation.markers(b),
            simulation.cameras_of(b),
            rows(simulation.estimate, np.array([b])),
            keypoints,
            [list(of_worker) for of_worker in windows],
            list(simulation.pipeline.crops(b)),
            float(np.linalg.norm(simulation.shield_change[b])),
            solids_of(simulation, b) if capsules else (),
        )

    def pose(self, b: int = 0) -> tuple[Floats, WorkerMotion]:
        """All that moves (nq,) and the workers (W, S, ...) of environment `b` now."""
        motion = one(generator.current(self.simulation.motion, np.array([b])), 0)
        return self.simulation.physics.qpos[b], motion

    def room(self, width: int, height: int, seen: Glance) -> Image:
        """Return the room with the estimated skeleton over it.

        Args:
            width: of the picture [px].
            height: likewise.
            seen: a moment, as of `glance`.

        Returns:
            (height, width, 3) of uint8, top row first.
        """
        camera = viewpoint_camera(self.simulation.task.viewpoint, width, height)
        (image,) = self._drawn([camera], seen, shadows=True)
        overlay.draw_estimate(image, camera, seen.estimate)
        overlay.draw_markers(image, camera, seen.markers_world)
        overlay.draw_shield(image, seen.shield_rad_s)
        return image

    def cameras(self, width: int, height: int, seen: Glance) -> list[Image]:
        """Return every camera's picture with crops, detected keypoints and the estimate.

        Args:
            width: of a picture [px].
            height: likewise.
            seen: a moment, as of `glance`.

        Returns:
            (height, width, 3) of uint8 each, without shadows, as the detector sees the scene.
        """
        views = self._through_cameras(width, height, seen, seen.cameras)
        for c, (camera, image) in enumerate(zip(seen.cameras, views, strict=True)):
            for window in (of_worker[c] for of_worker in seen.windows):
                if window is not None:
                    overlay.draw_window(image, camera, window)
            overlay.draw_estimate(image, camera, seen.estimate, thickness=1)
            if seen.keypoints is not None:
                overlay.draw_keypoints(image, camera, seen.keypoints, c)
            overlay.label(image, camera.name.replace("_", " "), (6, 6), 13)
        return views

    def crops(self, size: int, seen: Glance) -> list[Image]:
        """Return each camera's crop, as the pose network was given it, with its landmarks."""
        keypoints, images = seen.keypoints, []
        if keypoints is None or not seen.windows:
            return []
        parts = zip(seen.cameras, seen.crops, seen.windows[0], strict=True)
        for c, (camera, crop, window) in enumerate(parts):
            if crop is None or window is None:
                image = overlay.panel(size, size)
                overlay.write(image, "no worker in view", (10, size // 2 - 10), 13)
            else:
                image = overlay.shrink(crop, size, size)
                joints_px = image_from_pinhole(camera, keypoints.px[0, c, 0])
                overlay.draw_landmarks(image, window, joints_px, keypoints.confidence[0, c, 0])
            images.append(image)
        return images

    def beliefs(self, width: int, height: int, seen: Glance) -> list[Image]:
        """Return the belief, seen from above and from the side.

        It is the robot, its task and the estimate of the workers; there is no truth in it.

        Args:
            width: of a picture [px].
            height: likewise.
            seen: a moment, as of `glance`.

        Returns:
            (height, width, 3) of uint8 each.
        """
        chain = self.simulation.chain
        arm = capsules(chain, seen.q[: chain.n_joints])
        foot = np.array([*arm[0, 0, :2], 0.0])
        images = []
        for name, eye, target in SIDES:
            camera = pinhole(name, foot + eye, foot + target, SIDES_HFOV_DEG, width, height)
            image = overlay.panel(width, height)
            overlay.draw_floor(image, camera, foot)
            for ends in ([foot, arm[0, 0]], *arm):
                overlay.draw_path(image, camera, np.array(ends), overlay.ARM, 5)
            overlay.draw_estimate(image, camera, seen.estimate)
            overlay.draw_markers(image, camera, seen.markers_world)
            nobody = "" if seen.estimate.tracked[0].any() else ": nobody is known"
            overlay.label(image, name + nobody, (6, 6), 13)
            images.append(image)
        return images

    def mosaic(self, b: int = 0) -> Image:
        """Return the cameras' pictures of environment `b` in two columns."""
        return overlay.tile(self.cameras(*MOSAIC_TILE, self.glance(b)), 2)

    def close(self) -> None:
        """Free the graphics contexts."""
        for _, renderer in self._renderers.values():
            renderer.close()
        self._renderers = {}

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_renderers": {}}

    def _view(self, chosen: str | PinholeCamera, width: int, height: int) -> PinholeCamera:
        """Return the camera of a picture of this size."""
        if isinstance(chosen, str):
            return viewpoint_camera(chosen, width, height)
        return resize(chosen, width, height)

    def _marked(self, camera: PinholeCamera, seen: Glance, markers: bool) -> Image:
        """Return a camera's picture, in the light of the sun, with marks and capsules."""
        (image,) = self._drawn([camera], seen, shadows=True)
        stage: Stage = self._renderers["stage"][1]
        if seen.solids:
            stage.mark(image, camera, marks_of(seen.solids), CAPSULES_SHOWN, CAPSULES_HIDDEN)
        if markers and len(seen.markers_world):
            marks = markers_of(seen.markers_world, camera)
            stage.mark(image, camera, marks, MARKER_SHOWN, MARKER_HIDDEN)
        return image

    def _through_cameras(
        self, width: int, height: int, seen: Glance, cameras: Sequence[PinholeCamera]
    ) -> list[Image]:
        """Return the cameras' pictures, without shadows."""
        if all(camera.lens is None for camera in cameras):
            return self._drawn([resize(camera, width, height) for camera in cameras], seen)
        size = (SMOOTHING * width, SMOOTHING * width)
        images = LensRenderer(self._renderer("square", size, seen), cameras)
        views = []
        for camera in cameras:
            middle_px = camera.width_px / 2, camera.height_px / 2
            square = images.view(camera, Roi(middle_px, float(camera.width_px), 0.0))
            middle = overlay.middle_rows(square, SMOOTHING * height)
            views.append(overlay.shrink(middle, width, height))
        return views

    def _drawn(
        self, cameras: list[PinholeCamera], seen: Glance, shadows: bool = False
    ) -> list[Image]:
        """What cameras see that stay where they are."""
        largest = self._renderers["stage"][0] if "stage" in self._renderers else (0, 0)
        sizes = [largest, *((camera.width_px, camera.height_px) for camera in cameras)]
        width, height = np.max(sizes, axis=0).tolist()
        stage = self._renderer("stage", (width, height), seen)
        return [stage.picture(camera, shadows) for camera in cameras]

    def _renderer(self, purpose: str, size: tuple[int, int], seen: Glance) -> Any:
        """What draws for a purpose, posed; made anew where pictures have another size."""
        had, renderer = self._renderers.get(purpose, (size, None))
        if renderer is None or had != size:
            if renderer is not None:
                renderer.close()
            renderer = _MAKERS[purpose](self.simulation.scene, *size)
            self._renderers[purpose] = size, renderer
        renderer.randomize(seen.look)
        renderer.pose(seen.q, seen.motion)
        return renderer


def _chosen(asked: Any, cameras: Sequence[PinholeCamera]) -> str | PinholeCamera:
    """A camera of a rig, a viewpoint's name, or a camera of the user's own."""
    rig = {camera.name: camera for camera in cameras}
    if isinstance(asked, PinholeCamera):
        return asked
    if isinstance(asked, CameraConfig):
        return make_cameras([asked])[0]
    if isinstance(asked, str):
        if asked not in rig and asked not in VIEWPOINTS:
            raise unknown("camera or viewpoint", asked, [*rig, *VIEWPOINTS])
        return rig.get(asked, asked)
    return cameras[whole(f"camera (of {', '.join(rig)})", asked, 0, len(rig) - 1)]


_MAKERS: dict[str, Callable[..., Canvas]] = {
    "stage": Stage,
    "depth": lambda scene, width, height: PictureRenderer(scene, width, height, DEPTH_QUALITY),
    "square": lambda scene, width, _: CropRenderer(scene, width),
}
