"""Detections in clips: of the pose network in rendered images, or of its emulator."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from assets.emulator.bodies import make_anatomical
from assets.emulator.clips import DT_S, Clip, Staged, load_scene, make_number, stage
from hrc_env.config import HRCConfig
from hrc_env.core.batching import rows
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Keypoints, Roi
from hrc_env.core.typing import Bools, Covariances3, Floats, Ints, Points2, Points3
from hrc_env.geometry.cameras import project, projections
from hrc_env.perception.emulator import lines_of_sight
from hrc_env.pipeline.levels import make_pipeline
from hrc_env.pipeline.sensor_input import Generators, TrueSensorInput
from hrc_env.pipeline.tracking import PoseTracking
from hrc_env.scene.build import Scene
from hrc_env.worker.body import Body, load_body, worker_truth

INTRODUCED, INTRODUCED_PX = 3, 10.0
"""Number of frames of true joints that initialize the tracker, and their standard deviation
[px]."""


@dataclass(frozen=True, slots=True)
class Watched:
    """Detections and track of a clip of T frames and C cameras."""

    px: Points2
    """Detections, (T, C, J, 2) [px]; NaN: none."""
    confidence: Floats
    """Confidences, (T, C, J)."""
    sigma_px: Floats
    """Standard deviations, (T, C, J)."""
    window: Floats
    """Windows, (T, C, 4): centre x and y, side [px], rotation [rad]; NaN: no window, or
    emulated."""
    true_px: Points2
    """True joint positions in the image, (T, C, J, 2)."""
    depth_m: Floats
    """Depths, (T, C, J)."""
    sight: Ints
    """Lines of sight as `perception.emulator.lines_of_sight`, (T, C, J)."""
    look_of: Floats
    """Directions of view as `perception.emulator.lines_of_sight`, (T, C, `sightlines.N_LOOK`)."""
    joints_world: Points3
    """True joint positions, (T, J, 3) [m]."""
    mean_world: Points3
    """Estimated joint positions, (T, J, 3) [m]."""
    cov_world: Covariances3
    """Covariances of the estimate, (T, J, 3, 3) [m^2]."""
    tracked: Bools
    """True while the worker is tracked, (T,)."""
    landmarks_world: Points3
    """Anatomical landmarks of the joints, (T, J, 3) [m]."""
    P: Floats
    """Projection matrices of the cameras, (C, 3, 4)."""
    tracker_mean_world: Points3
    """Tracker's estimate of the network's joints, (T, J, 3) [m]."""
    tracker_cov_world: Covariances3
    """Covariances of the tracker's estimate, (T, J, 3, 3) [m^2]."""
    tracker_velocity_world: Floats
    """Velocities of the tracker's estimate, (T, J, 3) [m/s]."""


BodyOf = Callable[[str], Body]
"""Function that returns a body by its name."""


def watch(
    level: str, clips: Iterable[Clip], config: HRCConfig, body_of: BodyOf = load_body
) -> Iterator[Watched]:
    """Yield clips as observed by the pipeline of a perception level; those of one scene together.

    Args:
        level: "pixels" or "keypoints".
        clips: in an order in which those of one scene are adjacent.
        config: settings.
        body_of: function that returns a body, and so its joint positions, by its name.
    """
    pipeline, known = None, None
    try:
        for clip in clips:
            scene = load_scene(clip)
            if pipeline is None or scene is not known:
                if pipeline is not None:
                    pipeline.close()
                pipeline, known = make_pipeline(level, "particle", scene, 1, config), scene
            if not isinstance(pipeline, PoseTracking):
                raise ConfigError(f"Clips are for levels with cameras, not for {level!r}.")
            staged = replace(stage(clip, scene), body=body_of(clip.body))
            yield _watched(pipeline, scene, staged, (make_number(clip), clip.draw))
    finally:
        if pipeline is not None:
            pipeline.close()


def _watched(
    pipeline: PoseTracking, scene: Scene, staged: Staged, seed: tuple[int, int]
) -> Watched:
    rngs = [[np.random.default_rng([*seed, 71, k])] for k in range(2)]
    pipeline.reset(np.arange(1), *rngs)
    P, frames, said = projections(scene.cameras), [], []
    _introduce(pipeline, worker_truth(staged.body, staged.motion).joints_world[:1], P, rngs[1])
    landmarks_world = worker_truth(make_anatomical(staged.body), staged.motion).joints_world[:, 0]
    q = staged.q[None]
    for t in range(len(staged.motion.position_world)):
        motion = rows(staged.motion, np.array([t]))
        truth = worker_truth(staged.body, motion)
        now = TrueSensorInput(np.arange(1), q, motion, truth, np.ones((1, 1), bool))
        pipeline.sensor.expose(now)
        estimate = pipeline.perceive(now.ids, *rngs)
        meant = pipeline.tracker.estimate(pipeline.state)
        said.append(
            [each[0, 0] for each in (meant.mean_world, meant.cov_world, meant.velocity_world)]
        )
        keypoints, windows = pipeline.keypoints, pipeline.last_detections(0)[1]
        true_px, depth_m = project(P, truth.joints_world[:, 0])
        sight, look_of = lines_of_sight(truth, scene.surroundings(q, motion.held), scene.cameras)
        frames.append(
            (
                keypoints.px[0, :, 0], keypoints.confidence[0, :, 0], keypoints.sigma_px[0, :, 0],
                _windows(windows, len(P)), true_px[0], depth_m[0], sight[0, :, 0],
                look_of[0, :, 0],
                truth.joints_world[0, 0], estimate.mean_world[0, 0], estimate.cov_world[0, 0],
                estimate.tracked[0, 0],
            )
        )  # fmt: skip
    columns: list[Any] = [np.array(column) for column in zip(*frames, strict=True)]
    told: list[Any] = [np.array(column) for column in zip(*said, strict=True)]
    return Watched(*[*columns, landmarks_world, P, *told])


def _introduce(pipeline: PoseTracking, joints_world: Points3, P: Floats, rngs: Generators) -> None:
    """Initialize the tracker with the worker, because a search for people is not part of a clip."""
    px, _ = project(P, joints_world)
    sigma_px = np.full(px.shape[:-1], INTRODUCED_PX)
    for _ in range(INTRODUCED):
        pipeline.tracker.predict(pipeline.state, DT_S, rngs)
        pipeline.tracker.update(
            pipeline.state, Keypoints(px, np.ones_like(sigma_px), sigma_px), rngs
        )


def _windows(windows: list[list[Roi | None]], n_cameras: int) -> Floats:
    found = windows[0] if windows else [None] * n_cameras
    rows = [
        (np.nan,) * 4 if w is None else (*w.centre_px, w.side_px, w.rotation_rad) for w in found
    ]
    return np.array(rows, float)


def save(path: Path, watched: Watched) -> None:
    """Write the detections of a clip, completely or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".draft.npz")
    np.savez(draft, **{f.name: getattr(watched, f.name) for f in fields(watched)})
    draft.replace(path)


def load(path: Path) -> Watched:
    """Read a file of `save`."""
    with np.load(path) as stored:
        return Watched(*(stored[f.name] for f in fields(Watched)))
