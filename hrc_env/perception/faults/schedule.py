"""Schedules of cameras: the image that a camera delivers at a step, and its actual pose.

Both depend on the seed of the episode's faults, the step (0 is the reset) and the camera.
"""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import cv2
import numpy as np

from hrc_env.core.batching import Stateful
from hrc_env.core.typing import Floats, Ints
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.perception.faults.fault import ALL, KINDS, PLACE, TIMING, FaultConfig, check_cameras

_AMOUNT = 0xA303
"""Number that replaces the camera's index in the seed of a fault's amount. It is larger than any
index."""
_EARLY = 1e-6
"""Tolerance for rounding errors of times, as a fraction of a step."""


class Frame(NamedTuple):
    """An image that has arrived."""

    scene_step: int
    """Step at which the scene had the state that the image shows."""
    taken_step: int
    """Step that corresponds to the image's timestamp."""


class NumberedFault(NamedTuple):
    """A fault and its index in the schedule, which is part of the seed of its random numbers."""

    number: int
    """Index of the fault in the schedule."""
    fault: FaultConfig
    """The fault."""


class Arrivals(NamedTuple):
    """The images that arrive at a step."""

    records: list[Any]
    """(C,) record of the step that is shown by each camera's image; None without an image."""
    times_s: Floats
    """(C,) timestamps of the images, in a clock that reads `dt_s` at the reset [s]; NaN without an
    image."""


@dataclass(frozen=True, slots=True)
class Schedule:
    """Schedule of the cameras' images and faults over an episode."""

    cameras: tuple[CameraConfig, ...]
    """Cameras of the rig, with their calibrated poses."""
    faults: tuple[FaultConfig, ...]
    """Faults of the cameras."""
    dt_s: float
    """Time between steps [s]."""

    def __post_init__(self) -> None:
        check_cameras(self.faults, [camera.name for camera in self.cameras])

    @property
    def is_plain(self) -> bool:
        """Whether all cameras deliver an image without faults and delay at every step."""
        return not self.faults and not any(
            camera.rate_hz or camera.latency_s or camera.exposure_s for camera in self.cameras
        )

    @property
    def max_delay_s(self) -> float:
        """Maximum age of an image with a correct timestamp [s]."""
        return self.dt_s * max(self._delay(c, None) for c in range(len(self.cameras)))

    @property
    def longest_memory(self) -> int:
        """Maximum age of the scene in an image, apart from frozen images [steps]."""
        behind = [f.max_amount for f in self.faults if f.kind == "out_of_step"]
        return round(self.max_delay_s / self.dt_s) + math.ceil(max(behind, default=0.0))

    @property
    def frozen_steps(self) -> frozenset[int]:
        """Steps of the scene that are shown by frozen images."""
        return frozenset(self._frozen_at(f) for f in self.faults if f.kind == "frozen")

    def draw_episode(self, seed: int) -> "Schedule":
        """Return the schedule of an episode, with a sampled amount of every fault."""
        if not any(fault.is_range for fault in self.faults):
            return self
        numbered = enumerate(self.faults)
        return replace(self, faults=tuple(f.draw(draws(seed, k, _AMOUNT)) for k, f in numbered))

    def faults_of(self, group: str, c: int, step: int | None) -> list[NumberedFault]:
        """Return the faults of a group in camera c at a step, or at any step if `step` is None."""
        name = self.cameras[c].name
        return [
            NumberedFault(k, fault)
            for k, fault in enumerate(self.faults)
            if fault.group == group
            and not {c, name, ALL}.isdisjoint(fault.cameras)
            and (step is None or fault.is_active(step * self.dt_s))
        ]

    def frame(self, seed: int, step: int, c: int) -> Frame | None:
        """Return the newest image of camera c that arrives at a step, or None if there is none."""
        for taken in range(step, step - self._delay(c, None) - 1, -1):
            if taken < 0:
                break
            if taken + self._delay(c, taken) == step and self._is_taken(seed, taken, c):
                return Frame(self._scene_step(taken, c), taken)
        return None

    def exposure_s(self, c: int, step: int) -> float:
        """Return the exposure time of camera c's image at a step [s]."""
        return max([self.cameras[c].exposure_s, *self._amounts("motion_blur", c, step)])

    def actual_cameras(
        self, rig: tuple[PinholeCamera, ...], seed: int, step: int
    ) -> tuple[PinholeCamera, ...]:
        """Return the cameras with their actual poses at a step, or `rig` if there are no faults.

        Args:
            rig: cameras with their calibrated poses.
            seed: seed of the episode's faults.
            step: number of the step.
        """
        wrong = tuple(tuple(self.faults_of(PLACE, c, step)) for c in range(len(rig)))
        return _displace(rig, wrong, seed) if any(wrong) else rig

    def _is_taken(self, seed: int, step: int, c: int) -> bool:
        """Return whether an image is due at a step and is neither lost nor dropped."""
        rate = self.cameras[c].rate_hz * self.dt_s
        due = not 0 < rate < 1 or math.floor(step * rate + _EARLY) > math.floor(
            (step - 1) * rate + _EARLY
        )
        for k, fault in self.faults_of(TIMING, c, step):
            if fault.kind == "lost":
                return False
            if fault.kind == "dropped" and draws(seed, k, c, step).random() < fault.max_amount:
                return False
        return due

    def _delay(self, c: int, taken: int | None) -> int:
        """Return the delay of an image taken at a step [steps]; the maximum if `taken` is None."""
        late_s = sum(self._amounts("late", c, taken))
        return math.ceil((self.cameras[c].latency_s + late_s) / self.dt_s - _EARLY)

    def _scene_step(self, taken: int, c: int) -> int:
        """Return the step of the scene that is shown by an image taken at a step."""
        for _, fault in self.faults_of(TIMING, c, taken):
            if fault.kind == "frozen":
                return self._frozen_at(fault)
        return max(0, taken - round(sum(self._amounts("out_of_step", c, taken))))

    def _amounts(self, kind: str, c: int, step: int | None) -> list[float]:
        """Return the amounts of camera c's faults of a kind at a step, or at any step if None."""
        return [
            f.max_amount for _, f in self.faults_of(KINDS[kind].group, c, step) if f.kind == kind
        ]

    def _frozen_at(self, fault: FaultConfig) -> int:
        """Return the last step before a fault freezes the camera's image."""
        return max(0, math.ceil(fault.start_s / self.dt_s - _EARLY) - 1)


class History(Stateful):
    """The history of B environments: records of the past steps that may be shown by an image.

    Args:
        batch: number B of environments.
        schedule: schedule of the cameras' images and faults.
    """

    CHANGES = ("steps", "seeds", "_kept")

    def __init__(self, batch: int, schedule: Schedule) -> None:
        self.schedule = schedule
        self.steps = np.full(batch, -1)
        """(B,) number of the present step; -1 before the first step."""
        self.seeds: list[int] = [0] * batch
        """(B,) seed of the faults of each environment's episode."""
        self._kept: list[dict[int, Any]] = [{} for _ in range(batch)]
        self._episodes: dict[int, tuple[int, Schedule]] = {}
        """Seed of the faults and schedule of each environment's episode, by index."""
        self._reach = max(1, schedule.longest_memory)
        self._pinned = schedule.frozen_steps

    def reset(self, ids: Ints, rngs: Sequence[np.random.Generator]) -> None:
        """Reset environments `ids`, with seeds sampled from children of their generators."""
        for b in ids.tolist():
            child = rngs[b].spawn(1)[0]
            self.steps[b], self.seeds[b], self._kept[b] = -1, int(child.integers(2**31)), {}

    def schedule_of(self, b: int) -> Schedule:
        """Return the schedule of the present episode of environment b."""
        seed = self.seeds[b]
        known = self._episodes.get(b)
        if known is None or known[0] != seed:
            known = self._episodes[b] = seed, self.schedule.draw_episode(seed)
        return known[1]

    def begin_step(self, b: int) -> int:
        """Begin a step of environment b, delete outdated records, and return the step's number."""
        self.steps[b] += 1
        step = int(self.steps[b])
        for old in [each for each in self._kept[b] if each < step - self._reach]:
            if old not in self._pinned:
                del self._kept[b][old]
        return step

    def record_at(self, b: int, step: int) -> Any:
        """Return the record of a step of environment b, or None if there is none."""
        return self._kept[b].get(step)

    def exchange(self, b: int, record: Any) -> Arrivals:
        """Store the record of environment b's present step, and return the images that arrive."""
        schedule, seed, step = self.schedule_of(b), self.seeds[b], int(self.steps[b])
        self._kept[b][step] = record
        frames = [schedule.frame(seed, step, c) for c in range(len(schedule.cameras))]
        records = [None if f is None else self.record_at(b, f.scene_step) for f in frames]
        times_s = [np.nan if f is None else (f.taken_step + 1) * schedule.dt_s for f in frames]
        return Arrivals(records, np.array(times_s))


def draws(*numbers: int) -> np.random.Generator:
    """Return a random generator seeded by numbers: seed, fault, and optionally camera and step."""
    return np.random.default_rng(numbers)


@functools.lru_cache(maxsize=256)
def _displace(
    rig: tuple[PinholeCamera, ...], wrong: tuple[tuple[NumberedFault, ...], ...], seed: int
) -> tuple[PinholeCamera, ...]:
    """Apply faults (C,) of poses and intrinsics to the cameras (C,) of a rig."""
    cameras: list[PinholeCamera] = []
    for c, (camera, faults) in enumerate(zip(rig, wrong, strict=True)):
        for k, fault in faults:
            camera = _apply_fault(camera, fault, draws(seed, k, c))
        cameras.append(camera)
    return tuple(cameras)


def _apply_fault(
    camera: PinholeCamera, fault: FaultConfig, rng: np.random.Generator
) -> PinholeCamera:
    """Apply a fault of pose or intrinsics to a camera, in a random direction."""
    K, T_world_from_cam = camera.K.copy(), camera.T_world_from_cam.copy()
    if fault.kind == "wrong_focal":
        K[[0, 1], [0, 1]] *= 1.0 + fault.max_amount
    elif fault.kind == "wrong_translation":
        T_world_from_cam[:3, 3] += fault.max_amount * _draw_direction(rng)
    else:
        T_world_from_cam[:3, :3] @= cv2.Rodrigues(fault.max_amount * _draw_direction(rng))[0]
    return replace(camera, K=K, T_world_from_cam=T_world_from_cam)


def _draw_direction(rng: np.random.Generator) -> Floats:
    """Return a random unit vector (3,)."""
    along = rng.standard_normal(3)
    return along / np.linalg.norm(along)
