"""Images of cameras with faults, in which requested windows are rendered."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from hrc_env.core.batching import map_arrays, rows, write_rows
from hrc_env.core.records import Held, Roi, WorkerMotion
from hrc_env.core.typing import Floats, Image, JointAngles
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.perception.faults.corruptions import CropView, corrupt
from hrc_env.perception.faults.fault import IMAGE
from hrc_env.perception.faults.schedule import Schedule
from hrc_env.perception.lenses import LensRenderer

MovingT = TypeVar("MovingT", WorkerMotion, Held)
BLUR_IMAGES = 5
"""Number of renderings that are averaged for an image with motion blur."""


@dataclass(frozen=True, slots=True)
class ScenePose:
    """The pose of a scene."""

    q: JointAngles
    """(N,) generalized positions of the robot, fingers and loose objects, in the order of
    `Physics.qpos`."""
    motion: WorkerMotion
    """(W, S, ...) poses of the workers."""


@dataclass(frozen=True, slots=True)
class Shot:
    """The scene at a step, which may be shown by an image that arrives at a later step."""

    step: int
    """Number of the step."""
    pose: ScenePose
    """Pose of the scene at the step."""
    before: ScenePose
    """Pose of the scene one step earlier."""
    cameras: tuple[PinholeCamera, ...]
    """Cameras with their actual (not calibrated) poses at the step."""


class CameraFilm:
    """An `ImageSource` of the cameras' present images; cameras without an image are black.

    Args:
        viewer: renderer of images with lens distortion.
        schedule: schedule of the cameras' images and faults.
    """

    def __init__(self, viewer: LensRenderer, schedule: Schedule) -> None:
        self.renderer, self.viewer, self.schedule = viewer.renderer, viewer, schedule
        self._now = schedule
        """Schedule of the cameras' images and faults in the present episode."""
        self._shots: Sequence[Shot | None] = ()
        self._seed = 0
        self._drawn: Any = None

    def show(self, shots: Sequence[Shot | None], seed: int) -> None:
        """Set the scenes that the cameras (C,) show, and the seed of the episode's faults."""
        if seed != self._seed or not self._shots:
            self._now = self.schedule.draw_episode(seed)
        self._shots, self._seed, self._drawn = tuple(shots), seed, None

    def crop(self, camera_index: int, window: Roi) -> Image:
        """Render an upright window (size, size, 3) of a camera's RGB image."""
        shot = self._shots[camera_index]
        if shot is None:
            return np.zeros((self.renderer.size_px, self.renderer.size_px, 3), np.uint8)
        image = self._expose(shot, camera_index, window)
        for k, fault in self._now.faults_of(IMAGE, camera_index, shot.step):
            if fault.kind != "motion_blur":
                seeds = (self._seed, k, camera_index, shot.step)
                image = corrupt(CropView(image, shot.cameras[camera_index], window, seeds), fault)
        return image

    def _expose(self, shot: Shot, c: int, window: Roi) -> Image:
        """Render the mean image (size, size, 3) over the exposure time."""
        camera, open_s = shot.cameras[c], self._now.exposure_s(c, shot.step)
        if open_s == 0.0:
            self._pose(shot, 0.0)
            return self.viewer.view(camera, window)
        total = np.zeros((self.renderer.size_px, self.renderer.size_px, 3))
        for ago_s in np.linspace(0.0, open_s, BLUR_IMAGES):
            self._pose(shot, float(ago_s))
            total += self.viewer.view(camera, window)
        return np.round(total / BLUR_IMAGES).astype(np.uint8)

    def _pose(self, shot: Shot, ago_s: float) -> None:
        """Pose the scene as it was `ago_s` before the end of the exposure [s]."""
        if self._drawn != (shot.step, ago_s):
            pose = _pose_before(shot, ago_s / self.schedule.dt_s)
            self.renderer.pose(pose.q, pose.motion)
            self._drawn = (shot.step, ago_s)


def _pose_before(shot: Shot, share: float) -> ScenePose:
    """Interpolate the pose of the scene at the fraction `share` of a step before a shot."""
    if share == 0.0:
        return shot.pose
    motion, last = shot.pose.motion, shot.before.motion
    moved, held = _interpolate(motion, last, share), motion.held
    if held is not None and last.held is not None:
        same = (held.kind == last.held.kind) & (held.kind > 0)  # an absent prop has no position
        there = map_arrays(held, np.copy)
        write_rows(there, same, _interpolate(rows(held, same), rows(last.held, same), share))
        moved = replace(moved, held=there)
    return ScenePose(_mix(shot.pose.q, shot.before.q, share), moved)


def _interpolate(now: MovingT, before: MovingT, share: float) -> MovingT:
    """Interpolate poses of bodies or objects between `now` (`share` 0) and `before` (`share` 1)."""
    places = _mix(now.position_world, before.position_world, share)
    turns = _mix_quaternions(now.quaternion_wxyz, before.quaternion_wxyz, share)
    return replace(now, position_world=places, quaternion_wxyz=turns)


def _mix(now: Floats, before: Floats, share: float) -> Floats:
    """Interpolate numbers linearly between `now` (`share` 0) and `before` (`share` 1)."""
    return now + share * (before - now)


def _mix_quaternions(now: Floats, before: Floats, share: float) -> Floats:
    """Interpolate quaternions (..., 4) along the shorter path from `now` to `before`."""
    sign = np.where((now * before).sum(-1, keepdims=True) < 0, -1.0, 1.0)
    mixed = _mix(now, sign * before, share)
    return mixed / np.linalg.norm(mixed, axis=-1, keepdims=True)
