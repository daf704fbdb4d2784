"""What the pose network sees in recorded footage: made once, kept, given to every estimator."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.recorded.calibration import FilmedCamera, tracker_config
from benchmarks.recorded.films import Films, undistort
from hrc_env.core.records import Keypoints, PoseEstimate, Roi
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Points2
from hrc_env.experiments.study.fingerprint import fingerprint_of
from hrc_env.geometry.cameras import PinholeCamera, project, projections
from hrc_env.perception.detector import DetectorConfig, PoseDetector
from hrc_env.perception.windows import window_from_joints
from hrc_env.tracking.estimators import make_estimator

FOLLOWER = "kalman"
"""The estimator whose prediction says where to look: a rival of the default one, so that nobody
can say that the default was given windows of its own."""
Tick = Callable[[float], None]


@dataclass(frozen=True, slots=True, eq=False)
class Detections:
    """One person in T frames of C cameras."""

    px: Points2
    """(T, C, J, 2) [px] of the pinhole cameras, NaN where not found."""
    confidence: Floats
    """(T, C, J) in [0, 1]."""
    sigma_px: Floats
    """(T, C, J) as the detector says [px]."""
    dt_s: float
    """Time from one frame to the next [s]."""

    def keypoints(self, t: int, cameras: list[int]) -> Keypoints:
        """The record of frame `t` for some of the cameras."""
        px, confidence, sigma = (
            array[t, cameras][None, :, None] for array in (self.px, self.confidence, self.sigma_px)
        )
        return Keypoints(px, confidence, sigma)

    def shifted(self, lag_frames: list[int]) -> "Detections":
        """Frames t + lag of each camera side by side, as long as all have one."""
        first = -min(lag_frames)
        n_frames = len(self.px) - max(lag_frames) - first
        px, confidence, sigma = (
            np.stack(
                [array[first + lag :][:n_frames, c] for c, lag in enumerate(lag_frames)], axis=1
            )
            for array in (self.px, self.confidence, self.sigma_px)
        )
        return Detections(px, confidence, sigma, self.dt_s)


def detections_of(films: Films, cameras: list[FilmedCamera], path: Path, tick: Tick) -> Detections:
    """The detections that are in `path`, or new ones, which are put there.

    Args:
        films: from their beginning.
        cameras: (C,).
        path: an .npz file; one that other code or other films made is made anew.
        tick: told the share that is done.
    """
    shape = {"films": repr((films.sizes_px, films.n_frames, films.frames_per_s))}
    fingerprint = fingerprint_of(shape, __name__)
    if path.exists():
        with np.load(path) as stored:
            if str(stored["fingerprint"]) == fingerprint:
                tick(1.0)
                arrays = (stored["px"], stored["confidence"], stored["sigma_px"])
                return Detections(*arrays, float(stored["dt_s"]))
    found = _detect(films, cameras, tick)
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".draft.npz")
    np.savez_compressed(
        draft,
        px=found.px,
        confidence=found.confidence,
        sigma_px=found.sigma_px,
        dt_s=found.dt_s,
        fingerprint=fingerprint,
    )
    os.replace(draft, path)
    return found


def _detect(films: Films, cameras: list[FilmedCamera], tick: Tick) -> Detections:
    """Look at every frame where the person is predicted to be; search while nobody is followed.

    A follower with all cameras chooses the windows, so that somebody who stands by is not
    looked at: hips where the lines of sight of most cameras meet win the search.
    """
    pinholes = [camera.pinhole for camera in cameras]
    dt_s = 1 / films.frames_per_s
    tracker = make_estimator(FOLLOWER, projections(tuple(pinholes)), dt_s, tracker_config(pinholes))
    rngs = [np.random.default_rng([0, 6])]
    state = tracker.init(1, 1)
    tracker.reset(state, np.arange(1), rngs)
    detector = PoseDetector(pinholes, DetectorConfig(gate_every=round(films.frames_per_s)))
    rows: list[tuple[Points2, Floats, Floats]] = []
    n_frames = films.n_frames
    try:
        while films.advance():
            tracker.predict(state, dt_s, rngs)
            sight = detector.detect(films, _windows(tracker.estimate(state), pinholes))
            px = np.stack(
                [
                    undistort(seen, camera.pinhole.K, camera.distortion)
                    for seen, camera in zip(sight.px, cameras, strict=True)
                ]
            )
            rows.append((px, sight.confidence, sight.sigma_px))
            last = Detections(px[None], sight.confidence[None], sight.sigma_px[None], dt_s)
            tracker.update(state, last.keypoints(0, list(range(len(cameras)))), rngs)
            tick(1 / n_frames)
    finally:
        detector.close()
    px, confidence, sigma = (np.stack(column) for column in zip(*rows, strict=True))
    return Detections(px, confidence, sigma, dt_s)


def _windows(predicted: PoseEstimate, cameras: list[PinholeCamera]) -> list[Roi | None]:
    """A window a camera round the predicted joints; none at all, a search, without a track."""
    if not predicted.tracked[0, 0]:
        return [None] * len(cameras)
    px, depth_m = project(projections(tuple(cameras)), predicted.mean_world[:, 0])
    px, depth_m = px.reshape(-1, N_JOINTS, 2), depth_m.reshape(-1, N_JOINTS)
    return [window_from_joints(px[c], depth_m[c], camera) for c, camera in enumerate(cameras)]
