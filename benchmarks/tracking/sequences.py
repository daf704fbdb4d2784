"""The sequences of the tracking bench: what all estimators are given and held against."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np

from benchmarks.tracking.arrivals import LONGEST_DELAY_S, delivered
from benchmarks.tracking.athletes import circle, fall, run, spin, tumble
from benchmarks.tracking.bound import posterior_bound
from benchmarks.tracking.couples import couples, detect_couples, shuffles
from benchmarks.tracking.detections import CONDITIONS, SURPRISES, Damage, detect
from benchmarks.tracking.env_sequences import ENV, ENV_CONDITIONS, ENV_FRAMES, record
from benchmarks.tracking.matched import draw, matched_model
from benchmarks.tracking.rigs import DT_S, SIGMA_PX, Rig
from benchmarks.tracking.walks import walk
from benchmarks.tracking.workers import fall_and_get_up, run_to_and_fro
from hrc_env.core.records import Keypoints
from hrc_env.core.typing import Floats, Ints, Points2, Points3
from hrc_env.tracking.config import TrackerConfig

MATCHED, TWO_WORKERS, LATE = "matched", "two_workers", "late"
SIMULATED = (*CONDITIONS, LATE, TWO_WORKERS, MATCHED)
"""Conditions of the rigs lab and site; of `matched` the least mean squared error is known."""
MATCHED_ROOT_ACCELERATION = 0.05
"""Of the matched sequences and of the estimators on them, so that they stay in view [m^2/s^3]."""
MOTIONS: dict[str, Callable[[tuple[float, float], list[int], int], Points3]] = {
    "running": partial(run, speed_m_s=3.0),
    "running_fast": partial(run, speed_m_s=3.5),
    "acrobat": tumble,
    "fallen": fall,
    "fallen_one_camera": fall,
    "acrobat_one_camera": tumble,
    "spins_one_camera": spin,
    "circles_one_camera": partial(circle, radius_m=1.4, speed_m_s=2.8),
    "small_circles_one_camera": partial(circle, radius_m=0.7, speed_m_s=2.2),
    "worker_runs": run_to_and_fro,
    "worker_falls": fall_and_get_up,
    "worker_falls_one_camera": fall_and_get_up,
}
"""What people do where they do not walk."""
N_FRAMES = {
    **dict.fromkeys(("clean", "occluded", "hard", "drifting"), 500),
    "one_camera": 175, LATE: 175, TWO_WORKERS: 125, MATCHED: 40, "mirrored_start": 50,
    **dict.fromkeys(MOTIONS, 200),
}  # fmt: skip


def lasting() -> tuple[float, float]:
    """Return how long the shortest and the longest sequences last [s]."""
    return DT_S * min(N_FRAMES.values()), DT_S * max(N_FRAMES.values())


_ALONE = {
    "one_camera_half_second": (25, 38),
    "one_camera_one_second": (25, 50),
    "one_camera_two_seconds": (25, 75),
    "one_camera": (25, 125),
}
WINDOWS: dict[str, dict[str, tuple[int, int]]] = {
    **{name: {name: (25, 500)} for name in ("clean", "occluded", "hard", "drifting")},
    "one_camera": {**_ALONE, "after_return": (150, 175)},
    LATE: {LATE: (25, 175)},
    TWO_WORKERS: {TWO_WORKERS: (25, 125)},
    MATCHED: {MATCHED: (15, 40)},
    "mirrored_start": {"mirrored_start": (12, 25)},
    **{name: {name: (25, 200)} for name in ("running", "running_fast", "acrobat")},
    "fallen": {"fallen": (50, 200)},
    **{name: {name: (25, 200)} for name in ("worker_runs", "worker_falls")},
    **{
        name: {name: (40, 150)}
        for name in (
            "acrobat_one_camera",
            "spins_one_camera",
            "circles_one_camera",
            "small_circles_one_camera",
        )
    },
    "worker_falls_one_camera": {"worker_falls_one_camera": (50, 150)},
    "fallen_one_camera": {"fallen_one_camera": (50, 150), "fallen_after_return": (160, 200)},
}
"""Frames that count: after the first second; while one camera sees, and from one second after
the others' return; from half a second on after a mirrored start; from the fall on; matched
sequences are short, lest the drifting body leave the images."""
ENV_WINDOWS = {
    **{name: {name: (25, ENV_FRAMES)} for name in ENV_CONDITIONS},
    "one_camera": {"one_camera": (25, 125), "after_return": (135, ENV_FRAMES)},
}
"""The same of the environment's own motion; its return is looked at after 0.4 s."""


@dataclass(frozen=True, slots=True, eq=False)
class Sequences:
    """S sequences of T frames with W people."""

    joints: Points3
    """(T, S, W, J, 3) [m]."""
    px: Points2
    """(T, S, C, W, J, 2), by person."""
    windows: dict[str, tuple[int, int]]
    """Name of each window and its frames."""
    config: TrackerConfig
    confidence: Floats | None = None
    """(T, S, C, W, J); None: 0.9 where there is a pixel."""
    sigma_px: Floats | None = None
    """(T, S, C, W, J); None: `SIGMA_PX` where there is a pixel."""
    order: Ints | None = None
    """(T, S, C, W) in which order cameras report people, whose names they do not know; None:
    there is one."""
    time_s: Floats | None = None
    """(T, S, C) when the frame was taken that each camera delivers [s], as in `Keypoints`; None:
    all are of now."""
    bound_m2: Floats | None = None
    """(T, S, J) the least mean squared error, where it is known."""

    @property
    def has_bones(self) -> bool:
        """Whether distances between neighbouring joints stay as they are."""
        return self.bound_m2 is None

    def first(self, n: int) -> "Sequences":
        """The first n sequences."""
        arrays = {
            each.name: getattr(self, each.name)[:, :n]
            for each in fields(self)
            if isinstance(getattr(self, each.name), np.ndarray)
        }
        return replace(self, **arrays)

    def keypoints(self, t: int) -> Keypoints:
        """What cameras report of frame t."""
        px = self.px[t]
        seen = np.isfinite(px[..., 0])
        if self.confidence is None or self.sigma_px is None:
            confidence, sigma_px = np.where(seen, 0.9, 0.0), np.where(seen, SIGMA_PX, np.inf)
        else:
            confidence, sigma_px = self.confidence[t], self.sigma_px[t]
        if self.order is not None:
            order = self.order[t][..., None]
            confidence = np.take_along_axis(confidence, order, 2)
            sigma_px = np.take_along_axis(sigma_px, order, 2)
            px = np.take_along_axis(px, order[..., None], 2)
        time_s = None if self.time_s is None else self.time_s[t]
        return Keypoints(px, confidence, sigma_px, time_s)


def make_sequences(rig: Rig, condition: str, seeds: list[int]) -> Sequences:
    """Sequences of a rig and a condition, one per seed, each depending on its own seed only."""
    if rig.name == ENV:
        joints, seen = record(condition, seeds)
        given = (seen.confidence, seen.sigma_px)
        return Sequences(joints, seen.px, ENV_WINDOWS[condition], rig.tracker, *given)
    if condition == MATCHED:
        return _matched(rig, seeds)
    n_frames, windows = N_FRAMES[condition], WINDOWS[condition]
    if condition == TWO_WORKERS:
        joints = couples(seeds, n_frames)
        px = detect_couples(rig.P, joints, seeds)
        order = shuffles(seeds, n_frames, len(rig.P), joints.shape[2])
        return Sequences(joints, px, windows, rig.tracker, order=order)
    joints = MOTIONS.get(condition, walk)(rig.walk_m, seeds, n_frames)
    if condition == LATE:
        px, time_s = delivered(detect(rig.P, joints, Damage(), seeds), seeds)
        config = replace(rig.tracker, longest_delay_s=LONGEST_DELAY_S)
        return Sequences(joints[:, :, None], px[:, :, :, None], windows, config, time_s=time_s)
    px = detect(rig.P, joints, (CONDITIONS | SURPRISES)[condition], seeds)
    return Sequences(joints[:, :, None], px[:, :, :, None], windows, rig.tracker)


def _matched(rig: Rig, seeds: list[int]) -> Sequences:
    """Sequences from the estimators' own model, of which they are told what can be told.

    That is: the shared acceleration, no outliers, no exchanged sides, detections as good as they
    say, no bones, no floor, and that a body may be of any size.
    """
    config = replace(
        rig.tracker,
        root_acceleration=MATCHED_ROOT_ACCELERATION,
        outlier_weight=1e-9,
        swap_begins=1e-9,
        noise_bounds=(1.0, 1.0),
        bone_give=1.0,
        floor_std_m=np.inf,
        body_radius_m=10.0,
    )
    model = matched_model(config.damping, config.root_acceleration)
    joints = draw(model, seeds, N_FRAMES[MATCHED])
    px = detect(rig.P, joints, Damage(), seeds)
    bound = posterior_bound(rig.P, model, joints, np.isfinite(px[..., 0]), SIGMA_PX)
    bound_m2 = np.trace(bound, axis1=-2, axis2=-1)
    people, seen = joints[:, :, None], px[:, :, :, None]
    return Sequences(people, seen, WINDOWS[MATCHED], config, bound_m2=bound_m2)
