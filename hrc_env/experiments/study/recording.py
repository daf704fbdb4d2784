"""What cameras saw of a worker, once; then every estimator on the very same detections.

The arm rests. Crops follow the estimator that the film is taken with (closed loop); whoever is
given the recording afterwards has nothing to do with where the cameras looked.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.batching import rows
from hrc_env.core.records import Keypoints, PoseEstimate, WorkerMotion
from hrc_env.core.typing import Points3
from hrc_env.experiments.study.cache import PartProgress
from hrc_env.geometry.cameras import projections
from hrc_env.pipeline.levels import make_pipeline
from hrc_env.pipeline.sensor_input import SensorInput, Windows
from hrc_env.scene.build import Scene
from hrc_env.tracking.estimators import make_estimator
from hrc_env.worker.body import stack, worker_truth

RecordT = TypeVar("RecordT")


@dataclass(frozen=True, slots=True)
class Recording:
    """One worker before a rig."""

    scene: Scene
    dt_s: float
    motions: WorkerMotion
    """(T, 1, S, ...) truth."""
    joints_world: Points3
    """(T, J, 3) truth [m]."""
    keypoints: tuple[Keypoints, ...]
    """(T) records of arrays (1, C, 1, J, ...), in pinhole pixels of the rig's cameras."""
    windows: tuple[Windows, ...]
    """(T) where each camera looked."""
    beliefs: PoseEstimate
    """(T, 1, ...) of the estimator that the crops followed."""


def record(
    scene: Scene,
    motions: WorkerMotion,
    config: HRCConfig,
    estimator: str,
    seed: int,
    tick: PartProgress,
) -> Recording:
    """Film a worker with every camera of a scene.

    Args:
        scene: with one worker.
        motions: (T, 1, S, ...) of that worker, `config.ctrl_dt` apart.
        config: settings of detector and tracker.
        estimator: whose predictions the crops follow.
        seed: of its random numbers.
        tick: told of the progress: shares that sum to 1.
    """
    body = stack(scene.bodies)
    pipeline = make_pipeline("pixels", estimator, scene, 1, config)
    rngs = [[np.random.default_rng([seed, k])] for k in range(2)]
    n_frames = len(motions.position_world)
    q, ids = scene.home_q[None], np.zeros(1, int)
    joints, keypoints, windows, said = [], [], [], []
    try:
        pipeline.reset(ids, *rngs)
        for frame in range(n_frames):
            motion = rows(motions, np.array([frame]))
            truth = worker_truth(body, motion)
            estimate = pipeline.perceive(SensorInput(ids, q, motion), *rngs)
            seen, looked = pipeline.last_detections(0)
            if seen is not None:
                keypoints.append(rows(replace(seen, time_s=None), ids))
            joints.append(truth.joints_world[0, 0].copy())
            windows.append([list(of_worker) for of_worker in looked])
            said.append(rows(estimate, ids))
            tick(1.0 / n_frames)
    finally:
        pipeline.close()
    seen = tuple(keypoints), tuple(windows), concatenated(said)
    return Recording(scene, config.ctrl_dt, motions, np.stack(joints), *seen)


def replay(
    recording: Recording,
    estimator: str,
    cameras: Sequence[int],
    n_start: int,
    config: HRCConfig,
    seed: int,
) -> PoseEstimate:
    """(T, 1, ...) what an estimator makes of the detections of some of the cameras.

    Args:
        recording: what they saw.
        estimator: name.
        cameras: indices into the scene's rig.
        n_start: so many frames are given of all cameras: no estimator begins a track with one.
        config: settings of the tracker.
        seed: of the estimator's random numbers.
    """
    P = projections(recording.scene.cameras)
    unused = np.setdiff1d(np.arange(len(P)), cameras)
    tracker = make_estimator(estimator, P, recording.dt_s, config.tracker)
    state, rngs = tracker.init(1, 1), [np.random.default_rng([seed, 1])]
    tracker.reset(state, np.zeros(1, int), rngs)
    said = []
    for frame, seen in enumerate(recording.keypoints):
        given = seen
        if frame >= n_start:
            px, confidence, sigma_px = (
                np.array(each) for each in (seen.px, seen.confidence, seen.sigma_px)
            )
            px[:, unused], confidence[:, unused], sigma_px[:, unused] = np.nan, 0.0, np.inf
            given = Keypoints(px, confidence, sigma_px)
        tracker.predict(state, recording.dt_s, rngs)
        tracker.update(state, given, rngs)
        said.append(tracker.estimate(state))
    return concatenated(said)


def concatenated(records: Sequence[RecordT]) -> RecordT:
    """Records of arrays (n, ...), and of records of such, one after the other."""
    first: Any = records[0]
    if first is None:
        return records[0]
    if isinstance(first, np.ndarray):
        return np.concatenate(records)  # type: ignore[return-value, call-overload]
    names = [each.name for each in fields(first)]
    return type(first)(*(concatenated([getattr(r, name) for r in records]) for name in names))
