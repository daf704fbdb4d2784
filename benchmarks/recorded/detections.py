"""What the pose network sees in a recording: made once, kept, given to every estimator."""

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.recorded.calibration import tracker_config
from benchmarks.recorded.films import Films
from benchmarks.tracking.dlt import triangulate_frame
from hrc_env.core.records import Keypoints, PoseEstimate, Roi
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Points2
from hrc_env.experiments.study.fingerprint import fingerprint_of
from hrc_env.geometry.cameras import PinholeCamera, pinhole_from_image, project, projections
from hrc_env.perception.detector import DetectorConfig, PoseDetector
from hrc_env.perception.windows import window_from_joints
from hrc_env.tracking.estimators import make_estimator

FOLLOWER = "kalman"
"""The estimator whose prediction says where to look: a rival of the default one, so that nobody
can say that the default was given windows of its own."""
MAX_LAG_FRAMES = 10
SURE = 0.5
"""Detections of less confidence do not count."""
_SWEEPS = 5
_LAGS = sorted(range(-MAX_LAG_FRAMES, MAX_LAG_FRAMES + 1), key=abs)
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


def detections_of(films: Films, cameras: list[PinholeCamera], path: Path, tick: Tick) -> Detections:
    """The detections that are in `path` (.npz), if the same code made them of the same films, or
    new ones, which are put there."""
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


def _detect(films: Films, cameras: list[PinholeCamera], tick: Tick) -> Detections:
    """Look at every frame where the person is predicted to be; search while nobody is followed.

    A follower with all cameras chooses the windows, so that somebody who stands by is not
    looked at: hips where the lines of sight of most cameras meet win the search.
    """
    pinholes = [replace(camera, lens=None) for camera in cameras]
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
            views = zip(cameras, sight.px, strict=True)
            px = np.stack([pinhole_from_image(camera, seen) for camera, seen in views])
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


def lag_of(P: Floats, detections: Detections) -> list[int]:
    """Frames by which each camera shows the same moment later than the first one does.

    No clock is needed: of all shifts, the right ones let the views agree best, by plain
    triangulation; no estimator takes part. Coordinate descent from no lag; the frames that any
    shift would lose are left out of all.
    """
    lags = [0] * len(P)
    for _ in range(_SWEEPS):
        before = list(lags)
        for c in range(1, len(P)):
            tried = [[*lags[:c], lag, *lags[c + 1 :]] for lag in _LAGS]
            lags = min(tried, key=lambda lags: _disagreement(P, detections, lags))
        if lags == before:
            break
    return lags


def _disagreement(P: Floats, detections: Detections, lags: list[int]) -> float:
    """Median distance [px] of detections from what the other cameras say."""
    n_frames = len(detections.px) - 2 * MAX_LAG_FRAMES
    cut = [slice(MAX_LAG_FRAMES + lag, MAX_LAG_FRAMES + lag + n_frames) for lag in lags]
    px = np.stack([detections.px[frames, c] for c, frames in enumerate(cut)], 1)
    sure = np.stack([detections.confidence[frames, c] >= SURE for c, frames in enumerate(cut)], 1)
    px = np.where(sure[..., None], px, np.nan)
    nowhere = np.full((*px.shape[:1], *px.shape[2:3], 3), np.nan)
    off = []
    for held in range(len(P)):
        others = [c for c in range(len(P)) if c != held]
        joints = triangulate_frame(P[others], px[:, others], nowhere)
        shown, _ = project(P[held : held + 1], joints)
        off.append(np.linalg.norm(shown[:, 0] - px[:, held], axis=-1))
    return float(np.nanmedian(np.stack(off)))
