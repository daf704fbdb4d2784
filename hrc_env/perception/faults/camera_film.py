"""The images that cameras give, faults and all, drawn when they are looked at."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from hrc_env.core.batching import mapped, rows, write_rows
from hrc_env.core.records import Held, Roi, WorkerMotion
from hrc_env.core.typing import Floats, Image, JointAngles
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.perception.faults.corruptions import Shown, spoil
from hrc_env.perception.faults.fault import IMAGE
from hrc_env.perception.faults.schedule import Schedule
from hrc_env.perception.lensed import Lensed

MovingT = TypeVar("MovingT", WorkerMotion, Held)
BLUR_IMAGES = 5
"""An image with an open shutter is the mean of so many."""


@dataclass(frozen=True, slots=True)
class Shot:
    """A scene of which images may be wanted later."""

    step: int  # when it was
    q: JointAngles  # (N,) the arm [rad]
    motion: WorkerMotion  # (W, S, ...)
    before: tuple[JointAngles, WorkerMotion]  # one step earlier
    cameras: tuple[PinholeCamera, ...]  # where they really were


class CameraFilm:
    """An `ImageSource` of what each camera gives now; black where it gives nothing."""

    def __init__(self, viewer: Lensed, schedule: Schedule) -> None:
        self.stage, self.viewer, self.schedule = viewer.drawer, viewer, schedule
        self._now = schedule
        """That of the episode whose images are shown."""
        self._shots: Sequence[Shot | None] = ()
        self._seed = 0
        self._drawn: Any = None

    def show(self, shots: Sequence[Shot | None], seed: int) -> None:
        """The scene that each camera's image shows; the episode's number for faults."""
        if seed != self._seed or not self._shots:
            self._now = self.schedule.of_episode(seed)
        self._shots, self._seed, self._drawn = tuple(shots), seed, None

    def crop(self, camera_index: int, window: Roi) -> Image:
        """The window of a camera's image, upright, (size, size, 3) RGB."""
        shot = self._shots[camera_index]
        if shot is None:
            return np.zeros((self.stage.size_px, self.stage.size_px, 3), np.uint8)
        image = self._taken(shot, camera_index, window)
        for k, fault in self._now.of(IMAGE, camera_index, shot.step):
            if fault.kind != "motion_blur":
                seeds = (self._seed, k, camera_index, shot.step)
                image = spoil(Shown(image, shot.cameras[camera_index], window, seeds), fault)
        return image

    def _taken(self, shot: Shot, c: int, window: Roi) -> Image:
        """The light that came while the shutter was open."""
        camera, open_s = shot.cameras[c], self._now.exposure_s(c, shot.step)
        if open_s == 0.0:
            self._pose(shot, 0.0)
            return self.viewer.view(camera, window)
        total = np.zeros((self.stage.size_px, self.stage.size_px, 3))
        for ago_s in np.linspace(0.0, open_s, BLUR_IMAGES):
            self._pose(shot, float(ago_s))
            total += self.viewer.view(camera, window)
        return np.round(total / BLUR_IMAGES).astype(np.uint8)

    def _pose(self, shot: Shot, ago_s: float) -> None:
        """Draw a scene as it was, a moment before the shutter closed."""
        if self._drawn != (shot.step, ago_s):
            self.stage.pose(*_earlier(shot, ago_s / self.schedule.dt_s))
            self._drawn = (shot.step, ago_s)


def _earlier(shot: Shot, share: float) -> tuple[JointAngles, WorkerMotion]:
    """Arm and workers a share of a step before a shot, on the straight way from the step before."""
    if share == 0.0:
        return shot.q, shot.motion
    q, before = shot.before
    moved, held = _moved(shot.motion, before, share), shot.motion.held
    if held is not None and before.held is not None:
        same = (held.kind == before.held.kind) & (held.kind > 0)  # nothing is nowhere
        there = mapped(held, np.copy)
        write_rows(there, same, _moved(rows(held, same), rows(before.held, same), share))
        moved = replace(moved, held=there)
    return _between(shot.q, q, share), moved


def _moved(now: MovingT, before: MovingT, share: float) -> MovingT:
    """Bodies or things on the way back to `before`."""
    places = _between(now.position_world, before.position_world, share)
    turns = _turned(now.quaternion_wxyz, before.quaternion_wxyz, share)
    return replace(now, position_world=places, quaternion_wxyz=turns)


def _between(now: Floats, before: Floats, share: float) -> Floats:
    return now + share * (before - now)


def _turned(now: Floats, before: Floats, share: float) -> Floats:
    """Quaternions (..., 4) on the way back to `before`, the shorter way round."""
    sign = np.where((now * before).sum(-1, keepdims=True) < 0, -1.0, 1.0)
    mixed = _between(now, sign * before, share)
    return mixed / np.linalg.norm(mixed, axis=-1, keepdims=True)
