"""What the pose network sees in a recording: made once, kept, given to every estimator."""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from benchmarks.recorded.calibration import tracker_config
from benchmarks.recorded.films import Films
from hrc_env.core.records import Keypoints, PoseEstimate, Roi
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Points2
from hrc_env.experiments.cache import PartCache, PartProgress
from hrc_env.geometry.cameras import PinholeCamera, pinhole_from_image, project, projections
from hrc_env.perception.detector import DetectorConfig, PoseDetector
from hrc_env.perception.windows import window_from_joints
from hrc_env.tracking.estimators import make_estimator

FOLLOWER = "kalman"
"""The estimator whose prediction says where to look: a rival of the default one, so that nobody
can say that the default was given windows of its own."""
SURE = 0.5
"""Detections of less confidence do not count."""


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


def detections_of(films: Films, cameras: list[PinholeCamera], parts: PartCache) -> Detections:
    """The detections of all films: the part that is there, or new ones."""

    def make(tick: PartProgress) -> dict[str, Any]:
        found = asdict(_detect(films, cameras, tick))
        return {name: np.asarray(value).tolist() for name, value in found.items()}

    made = parts.part("detections", make)
    px, confidence, sigma_px = (np.array(made[name]) for name in ("px", "confidence", "sigma_px"))
    return Detections(px, confidence, sigma_px, made["dt_s"])


def _detect(films: Films, cameras: list[PinholeCamera], tick: PartProgress) -> Detections:
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
