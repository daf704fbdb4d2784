"""Detections of the pose network in a recording, which are cached for all estimators."""

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
"""Name of the estimator that predicts the crop windows. It is not the default estimator, which
would gain an advantage.
"""
SURE = 0.5
"""Minimum confidence of detections that are evaluated."""


@dataclass(frozen=True, slots=True, eq=False)
class Detections:
    """Detections of one person in T frames of C cameras."""

    px: Points2
    """Pixels in the pinhole cameras (T, C, J, 2), NaN without a detection."""
    confidence: Floats
    """Confidence of the detector (T, C, J), in [0, 1]."""
    sigma_px: Floats
    """Standard deviation of the detections (T, C, J) [px]."""
    dt_s: float
    """Time between frames [s]."""

    def keypoints(self, t: int, cameras: list[int]) -> Keypoints:
        """Return the keypoints of frame `t` in the given cameras."""
        px, confidence, sigma = (
            array[t, cameras][None, :, None] for array in (self.px, self.confidence, self.sigma_px)
        )
        return Keypoints(px, confidence, sigma)


def make_detections(films: Films, cameras: list[PinholeCamera], parts: PartCache) -> Detections:
    """Return the detections in all videos, computed or from the cache."""

    def make(tick: PartProgress) -> dict[str, Any]:
        found = asdict(_detect(films, cameras, tick))
        return {name: np.asarray(value).tolist() for name, value in found.items()}

    made = parts.make_part("detections", make)
    px, confidence, sigma_px = (np.array(made[name]) for name in ("px", "confidence", "sigma_px"))
    return Detections(px, confidence, sigma_px, made["dt_s"])


def _detect(films: Films, cameras: list[PinholeCamera], tick: PartProgress) -> Detections:
    """Detect the person near the predicted pose in each frame; without a track, search the images.

    An estimator that uses all cameras predicts the crop windows. The bystander is not detected,
    since the search prefers hips at which the lines of sight of most cameras meet.
    """
    pinholes = [replace(camera, lens=None) for camera in cameras]
    dt_s = 1 / films.frames_per_s
    tracker = make_estimator(FOLLOWER, projections(tuple(pinholes)), dt_s, tracker_config(pinholes))
    rngs = [np.random.default_rng([0, 6])]
    state = tracker.init(1, 1)
    tracker.reset(state, np.arange(1), rngs)
    detector = PoseDetector(pinholes, DetectorConfig(check_every=round(films.frames_per_s)))
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
    """Return one crop window per camera around the predicted joints, or None without a track."""
    if not predicted.tracked[0, 0]:
        return [None] * len(cameras)
    px, depth_m = project(projections(tuple(cameras)), predicted.mean_world[:, 0])
    px, depth_m = px.reshape(-1, N_JOINTS, 2), depth_m.reshape(-1, N_JOINTS)
    return [window_from_joints(px[c], depth_m[c], camera) for c, camera in enumerate(cameras)]
