"""Which image a camera gives at which step, and where the camera then really is: it follows from an
episode's number for faults (its seed), the step (0 is the reset's) and the camera."""

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
"""Tells the draws of a fault's amount from those of its cameras, which count from 0."""
_EARLY = 1e-6
"""Share of a step by which times may be too small for having been added up."""


class Frame(NamedTuple):
    """An image that arrives."""

    shows: int  # the step whose scene it shows
    taken: int  # the step at which it was taken, as it says


@dataclass(frozen=True, slots=True)
class Schedule:
    """What cameras do over an episode."""

    cameras: tuple[CameraConfig, ...]  # the rig in use, as it is told
    faults: tuple[FaultConfig, ...]
    dt_s: float  # time between steps [s]

    def __post_init__(self) -> None:
        check_cameras(self.faults, [camera.name for camera in self.cameras])

    @property
    def is_plain(self) -> bool:
        """Whether every camera gives a faultless image at once at every step."""
        return not self.faults and not any(
            camera.rate_hz or camera.latency_s or camera.exposure_s for camera in self.cameras
        )

    @property
    def longest_delay_s(self) -> float:
        """The greatest age of an image that says its time truly [s]."""
        return self.dt_s * max(self._delay(c, None) for c in range(len(self.cameras)))

    @property
    def longest_memory(self) -> int:
        """How many steps back a scene can be that an image shows, frozen ones left out."""
        behind = [f.how_much for f in self.faults if f.kind == "out_of_step"]
        return round(self.longest_delay_s / self.dt_s) + math.ceil(max(behind, default=0.0))

    @property
    def frozen_steps(self) -> frozenset[int]:
        """Steps whose scenes frozen images show."""
        return frozenset(self._frozen_at(f) for f in self.faults if f.kind == "frozen")

    def of_episode(self, seed: int) -> "Schedule":
        """Return the schedule of one episode, in which every fault has one amount."""
        if not any(fault.is_range for fault in self.faults):
            return self
        numbered = enumerate(self.faults)
        return replace(self, faults=tuple(f.drawn(draws(seed, k, _AMOUNT)) for k, f in numbered))

    def of(self, group: str, c: int, step: int | None) -> list[tuple[int, FaultConfig]]:
        """Faults of a group that camera c has at a step (None: ever), each with its number."""
        name = self.cameras[c].name
        return [
            (k, fault)
            for k, fault in enumerate(self.faults)
            if fault.group == group
            and not {c, name, ALL}.isdisjoint(fault.cameras)
            and (step is None or fault.active(step * self.dt_s))
        ]

    def frame(self, seed: int, step: int, c: int) -> Frame | None:
        """The newest image of camera c that arrives at a step; None if none does."""
        for taken in range(step, step - self._delay(c, None) - 1, -1):
            if taken < 0:
                break
            if taken + self._delay(c, taken) == step and self._is_taken(seed, taken, c):
                return Frame(self._shows(taken, c), taken)
        return None

    def exposure_s(self, c: int, step: int) -> float:
        """How long the shutter was open for an image of a step [s]."""
        return max([self.cameras[c].exposure_s, *self._amounts("motion_blur", c, step)])

    def actual(
        self, rig: tuple[PinholeCamera, ...], seed: int, step: int
    ) -> tuple[PinholeCamera, ...]:
        """The cameras as they really are at a step; the very `rig` where all is as told."""
        wrong = tuple(tuple(self.of(PLACE, c, step)) for c in range(len(rig)))
        return _displaced(rig, wrong, seed) if any(wrong) else rig

    def _is_taken(self, seed: int, step: int, c: int) -> bool:
        """Whether an image is due at a step, and comes through."""
        rate = self.cameras[c].rate_hz * self.dt_s
        due = not 0 < rate < 1 or math.floor(step * rate + _EARLY) > math.floor(
            (step - 1) * rate + _EARLY
        )
        for k, fault in self.of(TIMING, c, step):
            if fault.kind == "lost":
                return False
            if fault.kind == "dropped" and draws(seed, k, c, step).random() < fault.how_much:
                return False
        return due

    def _delay(self, c: int, taken: int | None) -> int:
        """Steps until an image arrives (None: the most there can be)."""
        late_s = sum(self._amounts("late", c, taken))
        return math.ceil((self.cameras[c].latency_s + late_s) / self.dt_s - _EARLY)

    def _shows(self, taken: int, c: int) -> int:
        """The step whose scene an image taken at a step shows."""
        for _, fault in self.of(TIMING, c, taken):
            if fault.kind == "frozen":
                return self._frozen_at(fault)
        return max(0, taken - round(sum(self._amounts("out_of_step", c, taken))))

    def _amounts(self, kind: str, c: int, step: int | None) -> list[float]:
        """Of the faults of a kind that camera c has at a step (None: ever)."""
        return [f.how_much for _, f in self.of(KINDS[kind].group, c, step) if f.kind == kind]

    def _frozen_at(self, fault: FaultConfig) -> int:
        """The last step before a camera froze."""
        return max(0, math.ceil(fault.from_s / self.dt_s - _EARLY) - 1)


class Recent(Stateful):
    """Steps of B environments with a record of each that may be wanted again."""

    CHANGES = ("steps", "seeds", "_kept")

    def __init__(self, batch: int, schedule: Schedule) -> None:
        self.schedule = schedule
        self.steps = np.full(batch, -1)
        """(B,) the present step; -1 before the first."""
        self.seeds: list[int] = [0] * batch
        """Each episode's number for faults."""
        self._kept: list[dict[int, Any]] = [{} for _ in range(batch)]
        self._episodes: dict[int, tuple[int, Schedule]] = {}
        """By environment: its episode's number, and the schedule that follows from it."""
        self._reach = max(1, schedule.longest_memory)
        self._pinned = schedule.frozen_steps

    def reset(self, ids: Ints, rngs: Sequence[np.random.Generator]) -> None:
        """Begin environments `ids` anew, with a child of each one's generator."""
        for b in ids.tolist():
            child = rngs[b].spawn(1)[0]
            self.steps[b], self.seeds[b], self._kept[b] = -1, int(child.integers(2**31)), {}

    def schedule_of(self, b: int) -> Schedule:
        """Return the faults in the present episode of environment b."""
        seed = self.seeds[b]
        known = self._episodes.get(b)
        if known is None or known[0] != seed:
            known = self._episodes[b] = seed, self.schedule.of_episode(seed)
        return known[1]

    def begin(self, b: int) -> int:
        """Count a step of environment b, and let go of what is too old."""
        self.steps[b] += 1
        step = int(self.steps[b])
        for old in [each for each in self._kept[b] if each < step - self._reach]:
            if old not in self._pinned:
                del self._kept[b][old]
        return step

    def at(self, b: int, step: int) -> Any:
        """The record of a step; None if it was never kept."""
        return self._kept[b].get(step)

    def arrived(self, b: int, record: Any) -> tuple[list[Any], Floats]:
        """Keep a record of the present step; those that the cameras (C,) show now, None without an
        image, and (C,) when these were taken, as they say [s; the reset's at `dt_s`]; NaN: none."""
        schedule, seed, step = self.schedule_of(b), self.seeds[b], int(self.steps[b])
        self._kept[b][step] = record
        frames = [schedule.frame(seed, step, c) for c in range(len(schedule.cameras))]
        records = [None if frame is None else self.at(b, frame.shows) for frame in frames]
        times_s = [np.nan if f is None else (f.taken + 1) * schedule.dt_s for f in frames]
        return records, np.array(times_s)


def draws(*numbers: int) -> np.random.Generator:
    """The random numbers of an episode's fault, of its camera and of its step."""
    return np.random.default_rng(numbers)


@functools.lru_cache(maxsize=256)
def _displaced(
    rig: tuple[PinholeCamera, ...], wrong: tuple, seed: int
) -> tuple[PinholeCamera, ...]:
    """A rig with what is wrong about the places of its cameras."""
    cameras = []
    for c, (camera, faults) in enumerate(zip(rig, wrong, strict=True)):
        for k, fault in faults:
            camera = _with_fault(camera, fault, draws(seed, k, c))
        cameras.append(camera)
    return tuple(cameras)


def _with_fault(
    camera: PinholeCamera, fault: FaultConfig, rng: np.random.Generator
) -> PinholeCamera:
    """A camera somewhere else than told; which way is drawn."""
    K, T_world_from_cam = camera.K.copy(), camera.T_world_from_cam.copy()
    if fault.kind == "wrong_focal":
        K[[0, 1], [0, 1]] *= 1.0 + fault.how_much
    elif fault.kind == "wrong_translation":
        T_world_from_cam[:3, 3] += fault.how_much * _direction(rng)
    else:
        T_world_from_cam[:3, :3] @= cv2.Rodrigues(fault.how_much * _direction(rng))[0]
    return replace(camera, K=K, T_world_from_cam=T_world_from_cam)


def _direction(rng: np.random.Generator) -> Floats:
    """(3,) any direction."""
    along = rng.standard_normal(3)
    return along / np.linalg.norm(along)
