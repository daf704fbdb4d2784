"""Recordings of a worker beside a stationary arm, on which every estimator can be replayed.

The detector's crops follow the estimator that runs during the recording, not those that are
replayed.
"""

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.batching import rows
from hrc_env.core.records import Keypoints, PoseEstimate, WorkerMotion
from hrc_env.core.typing import Points3
from hrc_env.experiments.cache import PartProgress
from hrc_env.geometry.cameras import projections
from hrc_env.perception.noise import our_joints
from hrc_env.pipeline.levels import make_pipeline
from hrc_env.pipeline.sensor_input import SensorInput, Windows
from hrc_env.scene.build import Scene
from hrc_env.tracking.estimators import make_estimator
from hrc_env.worker.body import load_bodies, worker_truth

RecordT = TypeVar("RecordT")


@dataclass(frozen=True, slots=True)
class Recording:
    """Recording of T frames of one worker by the cameras of a rig."""

    scene: Scene
    """The scene with its cameras."""
    config: HRCConfig
    """The configuration of the environment."""
    motions: WorkerMotion
    """True motion (T, 1, S, ...)."""
    joints_world: Points3
    """True joint positions (T, J, 3) [m]."""
    keypoints: Keypoints
    """Keypoints (T, C, 1, J, ...) in pinhole pixels of the rig's cameras."""
    windows: tuple[Windows, ...]
    """Crop windows of the cameras, one per frame."""
    beliefs: PoseEstimate
    """Estimates (T, 1, ...) of the estimator that ran during the recording."""


def record(
    scene: Scene,
    motions: WorkerMotion,
    config: HRCConfig,
    estimator: str,
    seed: int,
    tick: PartProgress,
) -> Recording:
    """Record the worker of a scene with all its cameras.

    Args:
        scene: the scene.
        motions: motion of the worker (T, 1, S, ...), in steps of `config.ctrl_dt`.
        config: the configuration of the environment.
        estimator: estimator whose predictions the crops follow.
        seed: seed of detector and estimator.
        tick: callback that receives the increase of the completed fraction.
    """
    truth = worker_truth(load_bodies(scene.bodies), motions)
    pipeline = make_pipeline("pixels", estimator, scene, 1, config)
    rngs = [[np.random.default_rng([seed, k])] for k in range(2)]
    q, ids = scene.home_q[None], np.zeros(1, int)
    keypoints, windows, estimates = [], [], []
    with closing(pipeline):
        pipeline.reset(ids, *rngs)
        for frame in range(len(truth.joints_world)):
            pipeline.sensor.expose(SensorInput(ids, q, rows(motions, np.array([frame]))))
            estimates.append(rows(pipeline.perceive(ids, *rngs), ids))
            detections, searched = pipeline.last_detections(0)
            if detections is not None:
                keypoints.append(rows(replace(detections, time_s=None), ids))
            windows.append([list(of_worker) for of_worker in searched])
            tick(1.0 / len(truth.joints_world))
    return Recording(
        scene, config, motions, truth.joints_world[:, 0],
        concatenate(keypoints), tuple(windows), concatenate(estimates),
    )  # fmt: skip


def replay(
    recording: Recording, estimator: str, cameras: Sequence[int], n_start: int, seed: int
) -> PoseEstimate:
    """Run an estimator on recorded detections of some cameras and return its estimates (T, 1, ...).

    Args:
        recording: the recorded detections.
        estimator: name of the estimator.
        cameras: indices of the cameras.
        n_start: number of frames at the start for which all cameras are used, in which every
            estimator can begin a track.
        seed: seed of the estimator.
    """
    P, keypoints = projections(recording.scene.cameras), recording.keypoints
    dt_s = recording.config.ctrl_dt
    px, confidence, sigma_px = map(
        np.array, (keypoints.px, keypoints.confidence, keypoints.sigma_px)
    )
    unused = np.setdiff1d(np.arange(len(P)), cameras)
    px[n_start:, unused] = np.nan
    confidence[n_start:, unused], sigma_px[n_start:, unused] = 0.0, np.inf
    given = Keypoints(px, confidence, sigma_px)
    tracker = make_estimator(estimator, P, dt_s, recording.config.tracker)
    state, rngs = tracker.init(1, 1), [np.random.default_rng([seed, 1])]
    tracker.reset(state, np.zeros(1, int), rngs)
    estimates = []
    for frame in range(len(px)):
        tracker.predict(state, dt_s, rngs)
        tracker.update(state, rows(given, np.array([frame])), rngs)
        estimates.append(our_joints(tracker.estimate(state)))
    return concatenate(estimates)


def concatenate(records: Sequence[RecordT]) -> RecordT:
    """Concatenate records of arrays (n, ...), which may be nested, along the first axis."""
    first: Any = records[0]
    if isinstance(first, np.ndarray):
        return np.concatenate(records)  # type: ignore[return-value, call-overload]
    if first is None:
        return records[0]
    parts = [concatenate([getattr(r, each.name) for r in records]) for each in fields(first)]
    return type(first)(*parts)
