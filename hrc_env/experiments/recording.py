"""What cameras saw of a worker beside a resting arm, once; then every estimator on just that.

Crops follow the estimator that the film is taken with, and nobody who is given it afterwards.
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
    """T frames of one worker before a rig."""

    scene: Scene
    config: HRCConfig
    motions: WorkerMotion
    """(T, 1, S, ...) truth."""
    joints_world: Points3
    """(T, J, 3) truth [m]."""
    keypoints: Keypoints
    """(T, C, 1, J, ...), in pinhole pixels of the rig's cameras."""
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
    """Film the worker of a scene with all its cameras, whose crops follow what an estimator
    predicts; the motions (T, 1, S, ...) are `config.ctrl_dt` apart."""
    truth = worker_truth(load_bodies(scene.bodies), motions)
    pipeline = make_pipeline("pixels", estimator, scene, 1, config)
    rngs = [[np.random.default_rng([seed, k])] for k in range(2)]
    q, ids = scene.home_q[None], np.zeros(1, int)
    keypoints, windows, said = [], [], []
    with closing(pipeline):
        pipeline.reset(ids, *rngs)
        for frame in range(len(truth.joints_world)):
            pipeline.sensor.expose(SensorInput(ids, q, rows(motions, np.array([frame]))))
            said.append(rows(pipeline.perceive(ids, *rngs), ids))
            seen, looked = pipeline.last_detections(0)
            if seen is not None:
                keypoints.append(rows(replace(seen, time_s=None), ids))
            windows.append([list(of_worker) for of_worker in looked])
            tick(1.0 / len(truth.joints_world))
    return Recording(
        scene, config, motions, truth.joints_world[:, 0],
        concatenated(keypoints), tuple(windows), concatenated(said),
    )  # fmt: skip


def replay(
    recording: Recording, estimator: str, cameras: Sequence[int], n_start: int, seed: int
) -> PoseEstimate:
    """(T, 1, ...) what an estimator makes of the detections of some of the cameras.

    The first `n_start` frames are given of all cameras, by which every estimator begins a track.
    """
    P, found = projections(recording.scene.cameras), recording.keypoints
    dt_s = recording.config.ctrl_dt
    px, confidence, sigma_px = map(np.array, (found.px, found.confidence, found.sigma_px))
    unused = np.setdiff1d(np.arange(len(P)), cameras)
    px[n_start:, unused] = np.nan
    confidence[n_start:, unused], sigma_px[n_start:, unused] = 0.0, np.inf
    given = Keypoints(px, confidence, sigma_px)
    tracker = make_estimator(estimator, P, dt_s, recording.config.tracker)
    state, rngs = tracker.init(1, 1), [np.random.default_rng([seed, 1])]
    tracker.reset(state, np.zeros(1, int), rngs)
    said = []
    for frame in range(len(px)):
        tracker.predict(state, dt_s, rngs)
        tracker.update(state, rows(given, np.array([frame])), rngs)
        said.append(our_joints(tracker.estimate(state)))
    return concatenated(said)


def concatenated(records: Sequence[RecordT]) -> RecordT:
    """Records of arrays (n, ...), and of records of such, one after the other."""
    first: Any = records[0]
    if isinstance(first, np.ndarray):
        return np.concatenate(records)  # type: ignore[return-value, call-overload]
    if first is None:
        return records[0]
    parts = [concatenated([getattr(r, each.name) for r in records]) for each in fields(first)]
    return type(first)(*parts)
