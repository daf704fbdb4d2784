"""The sequences of the tracking benchmark, with the estimators' inputs and the ground truth."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np

from benchmarks.tracking.arrivals import LONGEST_DELAY_S, deliver
from benchmarks.tracking.athletes import circle, fall, run, spin, tumble
from benchmarks.tracking.bound import posterior_bound
from benchmarks.tracking.couples import detect_couples, draw_shuffles, walk_couples
from benchmarks.tracking.detections import CONDITIONS, SURPRISES, Damage, detect
from benchmarks.tracking.env_sequences import ENV, ENV_CONDITIONS, ENV_FRAMES, record
from benchmarks.tracking.matched import draw, make_matched_model
from benchmarks.tracking.rigs import DT_S, SIGMA_PX, Rig
from benchmarks.tracking.walks import walk
from benchmarks.tracking.workers import fall_and_get_up, run_to_and_fro
from hrc_env.core.records import Keypoints
from hrc_env.core.typing import Floats, Ints, Points2, Points3
from hrc_env.tracking.config import TrackerConfig

MATCHED, TWO_WORKERS, LATE = "matched", "two_workers", "late"
SIMULATED = (*CONDITIONS, LATE, TWO_WORKERS, MATCHED)
"""Conditions of the rigs lab and site. For `matched`, a lower bound on the mean squared error is
known.
"""
MATCHED_ROOT_ACCELERATION = 0.05
"""Spectral density of the root's acceleration in matched sequences, also for the estimators
[m^2/s^3].

The value is small, so that the bodies remain in view.
"""
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
"""Functions that simulate motions other than walking, by condition."""
N_FRAMES = {
    **dict.fromkeys(("clean", "occluded", "hard", "drifting"), 500),
    "one_camera": 175, LATE: 175, TWO_WORKERS: 125, MATCHED: 40, "mirrored_start": 50,
    **dict.fromkeys(MOTIONS, 200),
}  # fmt: skip


def find_durations() -> tuple[float, float]:
    """Return the durations of the shortest and the longest sequences [s]."""
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
"""Windows (first frame, end) that are evaluated, by condition and name of the window.

Most windows begin after the first second. Others cover the time with one camera, or begin one
second after the other cameras return, half a second after a mirrored start, or at a fall. Matched
sequences are short, so that the drifting body remains in the images.
"""
ENV_WINDOWS = {
    **{name: {name: (25, ENV_FRAMES)} for name in ENV_CONDITIONS},
    "one_camera": {"one_camera": (25, 125), "after_return": (135, ENV_FRAMES)},
}
"""Windows (first frame, end) that are evaluated on the environment's rig, by condition and name."""


@dataclass(frozen=True, slots=True, eq=False)
class Sequences:
    """A batch of S sequences, each with T frames of W people from C cameras."""

    joints: Points3
    """True joints (T, S, W, J, 3) [m]."""
    px: Points2
    """Detected pixels of each person (T, S, C, W, J, 2); NaN if missing."""
    windows: dict[str, tuple[int, int]]
    """Windows (first frame, end), by name."""
    config: TrackerConfig
    confidence: Floats | None = None
    """Confidence (T, S, C, W, J); None means 0.9 for all detections."""
    sigma_px: Floats | None = None
    """Standard deviation (T, S, C, W, J) [px]; None means `SIGMA_PX` for all detections."""
    order: Ints | None = None
    """Order (T, S, C, W) in which cameras report people without identities, or None if there is
    only one person.
    """
    time_s: Floats | None = None
    """Time (T, S, C) at which each delivered frame was taken [s], as in `Keypoints`; None if frames
    are not delayed.
    """
    bound_m2: Floats | None = None
    """Lower bound on the mean squared error (T, S, J) [m^2], or None if it is unknown."""

    @property
    def has_bones(self) -> bool:
        """Whether distances between neighbouring joints are constant."""
        return self.bound_m2 is None

    def first(self, n: int) -> "Sequences":
        """Return the first n sequences."""
        arrays = {
            each.name: getattr(self, each.name)[:, :n]
            for each in fields(self)
            if isinstance(getattr(self, each.name), np.ndarray)
        }
        return replace(self, **arrays)

    def keypoints(self, t: int) -> Keypoints:
        """Return the keypoints that cameras report in frame t."""
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
    """Create the sequences of a rig and a condition, one per seed.

    Each sequence depends only on its seed.
    """
    if rig.name == ENV:
        joints, seen = record(condition, seeds)
        given = (seen.confidence, seen.sigma_px)
        return Sequences(joints, seen.px, ENV_WINDOWS[condition], rig.tracker, *given)
    if condition == MATCHED:
        return _make_matched(rig, seeds)
    n_frames, windows = N_FRAMES[condition], WINDOWS[condition]
    if condition == TWO_WORKERS:
        joints = walk_couples(seeds, n_frames)
        px = detect_couples(rig.P, joints, seeds)
        order = draw_shuffles(seeds, n_frames, len(rig.P), joints.shape[2])
        return Sequences(joints, px, windows, rig.tracker, order=order)
    joints = MOTIONS.get(condition, walk)(rig.walk_m, seeds, n_frames)
    if condition == LATE:
        px, time_s = deliver(detect(rig.P, joints, Damage(), seeds), seeds)
        config = replace(rig.tracker, max_delay_s=LONGEST_DELAY_S)
        return Sequences(joints[:, :, None], px[:, :, :, None], windows, config, time_s=time_s)
    px = detect(rig.P, joints, (CONDITIONS | SURPRISES)[condition], seeds)
    return Sequences(joints[:, :, None], px[:, :, :, None], windows, rig.tracker)


def _make_matched(rig: Rig, seeds: list[int]) -> Sequences:
    """Create sequences from the estimators' motion model, with matching settings.

    The estimators are configured for the same root acceleration and for detections with the
    reported noise, without outliers, swapped sides, bones, floor, or limits on the size of the
    body.
    """
    config = replace(
        rig.tracker,
        root_acceleration=MATCHED_ROOT_ACCELERATION,
        outlier_weight=1e-9,
        swap_start_probability=1e-9,
        noise_bounds=(1.0, 1.0),
        bone_variation_scale=1.0,
        floor_std_m=np.inf,
        body_radius_m=10.0,
    )
    model = make_matched_model(config.damping, config.root_acceleration)
    joints = draw(model, seeds, N_FRAMES[MATCHED])
    px = detect(rig.P, joints, Damage(), seeds)
    bound = posterior_bound(rig.P, model, joints, np.isfinite(px[..., 0]), SIGMA_PX)
    bound_m2 = np.trace(bound, axis1=-2, axis2=-1)
    people, seen = joints[:, :, None], px[:, :, :, None]
    return Sequences(people, seen, WINDOWS[MATCHED], config, bound_m2=bound_m2)
