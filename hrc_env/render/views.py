"""Pictures of a simulation: the scene, the cameras' images with detections, and the belief."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.batching import one, rows
from hrc_env.core.errors import check_integer, make_unknown_name_error
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
    find_solids,
    mark_points,
    mark_solids,
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

SMALLEST_PX = 16
"""Minimum width and height of a picture [px]."""
LARGEST_PX = 4096
"""Maximum width and height of a picture [px]."""
DEPTH_QUALITY = {**PICTURE_QUALITY, "offsamples": 0, "shadowsize": 0}
"""Settings of MuJoCo's visual quality for depth images."""
MOSAIC_TILE = (640, 360)
"""Width and height of a camera's picture in a mosaic [px]."""
SIDES = (
    ("from above", np.array([0.0, 0.0, 5.0]), np.zeros(3)),
    ("from the side", np.array([0.0, -4.2, 1.4]), np.array([0.0, 0.0, 0.9])),
)
"""Viewpoints for pictures of the belief: name, eye and target relative to the robot's base [m]."""
SIDES_HFOV_DEG = 55.0
"""Horizontal field of view of the viewpoints `SIDES` [deg]."""
CameraChoice: TypeAlias = int | str | CameraConfig | PinholeCamera | None
"""Choice of a camera: index or name of a camera of the rig, name of a viewpoint, or a camera; None
for the task's viewpoint."""


class Size(NamedTuple):
    """Size of a picture in pixels."""

    width: int
    """Width of the picture [px]."""
    height: int
    """Height of the picture [px]."""


class Pose(NamedTuple):
    """Pose of the robot, the objects and the workers in an environment."""

    q: Floats
    """(nq,) generalized positions of the robot, fingers and loose objects, in the order of
    `Physics.qpos`."""
    motion: WorkerMotion
    """Poses of the workers, arrays (W, S, ...)."""


def check_size(width: object, height: object) -> Size:
    """Return the size of a picture; raise `ConfigError` unless both are from 16 to 4096 px."""
    limits = SMALLEST_PX, LARGEST_PX
    return Size(
        check_integer("width [px]", width, *limits), check_integer("height [px]", height, *limits)
    )


@dataclass(frozen=True, slots=True)
class Glance:
    """A copy of an environment's present state, from which pictures can be rendered later."""

    q: Floats
    """(nq,) generalized positions of the robot, fingers and loose objects, in the order of
    `Physics.qpos`."""
    motion: WorkerMotion
    """Poses of the workers, arrays (W, S, ...)."""
    look: Look | None
    """Appearance of the episode; None for the default appearance."""
    markers_world: Points3
    """(M, 3) positions of the task's markers [m]."""
    cameras: tuple[PinholeCamera, ...]
    """Cameras of the episode."""
    estimate: PoseEstimate
    """Belief about the workers, a batch of one."""
    keypoints: Keypoints | None
    """Last detected keypoints, a batch of one; None without cameras."""
    windows: list[list[Roi | None]]
    """Window of each worker's crop in each camera's image, indexed by worker and camera."""
    crops: list[Image | None]
    """Crop of the first worker from each camera, which is the input of the pose network."""
    shield_rad_s: float = 0.0
    """Norm of the shield's change of the last command [rad/s]."""
    solids: tuple[Solids, ...] = ()
    """Capsules that are drawn by the overlay "capsules"."""


class Views:
    """Pictures of a simulation's environments.

    Graphics contexts are made when the first picture is rendered. Any thread may render and call
    `close`, but only one at a time. If a `glance` is taken first, the simulation may advance in
    another thread.

    Args:
        simulation: simulation of the environments that are shown.
    """

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self._renderers: dict[str, tuple[tuple[int, int], Any]] = {}
        """Size of the pictures and renderer for each purpose (a key of `_MAKERS`)."""

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
            depth: whether to return distances along the optical axis instead, (height, width) of
                float32 [m], of the scene without overlays.
            b: index of the environment.
            size: width and height [px].
            camera: index or name of a camera of the rig, a viewpoint such as "room" or "top", or a
                `CameraConfig`; None for the task's viewpoint.
            markers: whether the markers of the task, such as goals, are shown.
            capsules: whether the capsules of robot and people, from which distances are computed,
                are drawn over the scene; not supported for cameras with a lens.

        Raises:
            ConfigError: there is no such camera.
        """
        seen, viewpoint = self.glance(b, capsules), self.simulation.task.viewpoint
        chosen = viewpoint if camera is None else _choose(camera, seen.cameras)
        if depth:
            renderer = self._renderer("depth", size, seen)
            return renderer.picture(seen.q, seen.motion, chosen, depth=True)
        if isinstance(chosen, PinholeCamera) and chosen.lens is not None:
            (image,) = self._through_cameras(*size, seen, [chosen])
            if markers:
                overlay.draw_markers(image, chosen, seen.markers_world)
        else:
            image = self._draw_marked(self._make_view(chosen, *size), seen, markers)
            draw_legend(image, seen.solids)
        overlay.draw_shield(image, seen.shield_rad_s)
        return image

    def glance(self, b: int = 0, capsules: bool = False) -> Glance:
        """Return a copy of environment `b`'s present state, with capsules if `capsules` is True."""
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
            find_solids(simulation, b) if capsules else (),
        )

    def pose(self, b: int = 0) -> Pose:
        """Return the present poses of robot, objects and workers in environment `b`."""
        motion = one(generator.current(self.simulation.motion, np.array([b])), 0)
        return Pose(self.simulation.physics.qpos[b], motion)

    def room(self, width: int, height: int, seen: Glance) -> Image:
        """Return a picture of the scene with the estimated skeletons.

        Args:
            width: width of the picture [px].
            height: height of the picture [px].
            seen: the state to show, as `glance` returns it.

        Returns:
            (height, width, 3) of uint8, top row first.
        """
        camera = viewpoint_camera(self.simulation.task.viewpoint, width, height)
        (image,) = self._draw([camera], seen, shadows=True)
        overlay.draw_estimate(image, camera, seen.estimate)
        overlay.draw_markers(image, camera, seen.markers_world)
        overlay.draw_shield(image, seen.shield_rad_s)
        return image

    def cameras(self, width: int, height: int, seen: Glance) -> list[Image]:
        """Return every camera's picture with crops, detected keypoints and the estimate.

        Args:
            width: width of a picture [px].
            height: height of a picture [px].
            seen: the state to show, as `glance` returns it.

        Returns:
            Pictures (height, width, 3) of uint8, without shadows, like the detector's input.
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
        """Return the crop from each camera (the pose network's input), with detected landmarks."""
        keypoints, images = seen.keypoints, list[Image]()
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
        """Return pictures of the belief from above and from the side.

        They show the robot, its task and the estimated workers, but not the true workers.

        Args:
            width: width of a picture [px].
            height: height of a picture [px].
            seen: the state to show, as `glance` returns it.

        Returns:
            Pictures (height, width, 3) of uint8.
        """
        chain = self.simulation.chain
        arm = capsules(chain, seen.q[: chain.n_joints])
        foot = np.array([*arm[0, 0, :2], 0.0])
        images = list[Image]()
        for name, eye, target in SIDES:
            camera = pinhole(name, foot + eye, foot + target, SIDES_HFOV_DEG, width, height)
            image = overlay.panel(width, height)
            overlay.draw_floor(image, camera, foot)
            for ends in ([foot, arm[0, 0]], *arm):
                overlay.draw_path(image, camera, np.array(ends), overlay.ARM, 5)
            overlay.draw_estimate(image, camera, seen.estimate)
            overlay.draw_markers(image, camera, seen.markers_world)
            suffix = "" if seen.estimate.tracked[0].any() else ": no tracks"
            overlay.label(image, name + suffix, (6, 6), 13)
            images.append(image)
        return images

    def mosaic(self, b: int = 0) -> Image:
        """Return a mosaic of the images of all cameras of environment `b`, in two columns."""
        return overlay.tile(self.cameras(*MOSAIC_TILE, self.glance(b)), 2)

    def close(self) -> None:
        """Free the graphics contexts."""
        for _, renderer in self._renderers.values():
            renderer.close()
        self._renderers = {}

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_renderers": {}}

    def _make_view(self, chosen: str | PinholeCamera, width: int, height: int) -> PinholeCamera:
        """Return the chosen camera or viewpoint as a camera for pictures of the given size."""
        if isinstance(chosen, str):
            return viewpoint_camera(chosen, width, height)
        return resize(chosen, width, height)

    def _draw_marked(self, camera: PinholeCamera, seen: Glance, markers: bool) -> Image:
        """Render a camera's picture with shadows, markers and capsules."""
        (image,) = self._draw([camera], seen, shadows=True)
        stage: Stage = self._renderers["stage"][1]
        if seen.solids:
            stage.mark(image, camera, mark_solids(seen.solids), CAPSULES_SHOWN, CAPSULES_HIDDEN)
        if markers and len(seen.markers_world):
            marks = mark_points(seen.markers_world, camera)
            stage.mark(image, camera, marks, MARKER_SHOWN, MARKER_HIDDEN)
        return image

    def _through_cameras(
        self, width: int, height: int, seen: Glance, cameras: Sequence[PinholeCamera]
    ) -> list[Image]:
        """Render the pictures of cameras, with or without lenses, without shadows."""
        if all(camera.lens is None for camera in cameras):
            return self._draw([resize(camera, width, height) for camera in cameras], seen)
        size = (SMOOTHING * width, SMOOTHING * width)
        images = LensRenderer(self._renderer("square", size, seen), cameras)
        views = list[Image]()
        for camera in cameras:
            middle_px = camera.width_px / 2, camera.height_px / 2
            square = images.view(camera, Roi(middle_px, float(camera.width_px), 0.0))
            middle = overlay.middle_rows(square, SMOOTHING * height)
            views.append(overlay.shrink(middle, width, height))
        return views

    def _draw(
        self, cameras: list[PinholeCamera], seen: Glance, shadows: bool = False
    ) -> list[Image]:
        """Render the pictures of pinhole cameras at fixed viewpoints."""
        largest = self._renderers["stage"][0] if "stage" in self._renderers else (0, 0)
        sizes = [largest, *((camera.width_px, camera.height_px) for camera in cameras)]
        width, height = np.max(sizes, axis=0).tolist()
        stage = self._renderer("stage", (width, height), seen)
        return [stage.picture(camera, shadows) for camera in cameras]

    def _renderer(self, purpose: str, size: tuple[int, int], seen: Glance) -> Any:
        """Return the posed renderer for a purpose; make a new one if the picture size has changed.

        Args:
            purpose: a key of `_MAKERS`.
            size: width and height of the pictures [px].
            seen: the state that is rendered.
        """
        had, renderer = self._renderers.get(purpose, (size, None))
        if renderer is None or had != size:
            if renderer is not None:
                renderer.close()
            renderer = _MAKERS[purpose](self.simulation.scene, *size)
            self._renderers[purpose] = size, renderer
        renderer.randomize(seen.look)
        renderer.pose(seen.q, seen.motion)
        return renderer


def _choose(choice: CameraChoice, cameras: Sequence[PinholeCamera]) -> str | PinholeCamera:
    """Return the camera, or the name of the viewpoint, that a choice refers to.

    Raises:
        ConfigError: there is no such camera.
    """
    rig = {camera.name: camera for camera in cameras}
    if isinstance(choice, PinholeCamera):
        return choice
    if isinstance(choice, CameraConfig):
        return make_cameras([choice])[0]
    if isinstance(choice, str):
        if choice not in rig and choice not in VIEWPOINTS:
            raise make_unknown_name_error("camera or viewpoint", choice, [*rig, *VIEWPOINTS])
        return rig.get(choice, choice)
    return cameras[check_integer(f"camera (of {', '.join(rig)})", choice, 0, len(rig) - 1)]


_MAKERS: dict[str, Callable[..., Canvas]] = {
    "stage": Stage,
    "depth": lambda scene, width, height: PictureRenderer(scene, width, height, DEPTH_QUALITY),
    "square": lambda scene, width, _: CropRenderer(scene, width),
}
