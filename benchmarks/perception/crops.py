"""Detection of workers at work in image crops, without a previous track.

The motion generator moves a worker, which is rendered together with the arm near its home pose.
Each camera provides a crop around the true joints, with the same window as in the pipeline. Crops
are evaluated only if all joints are in the image and hidden neither by the room nor by the robot
("in view").
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.config import HRCConfig
from hrc_env.core.batching import one
from hrc_env.core.records import WorkerMotion
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Bools, Floats, JointAngles, Points2, Points3
from hrc_env.geometry.cameras import (
    image_from_pinhole,
    inside_image,
    pinhole_from_image,
    project,
    projections,
)
from hrc_env.geometry.sight import find_hidden
from hrc_env.motion import generator
from hrc_env.perception.detector import PoseDetector
from hrc_env.perception.lenses import LensRenderer
from hrc_env.perception.windows import window_from_joints
from hrc_env.scene.build import Scene
from hrc_env.scene.domain_randomization import Look
from hrc_env.scene.render import CropRenderer
from hrc_env.worker.body import load_body, worker_truth

STEP_S = 0.04
PAUSE_STEPS = (20, 80)
"""Range (min, max) of the number of steps between two moments (0.8 to 3.2 s), which varies the
activity.
"""
PATIENCE = 200
"""Number of moments without the desired activity after which any activity is accepted."""


class Instant(NamedTuple):
    """State of robot and worker at one moment."""

    activity: str
    q: JointAngles
    """Joint angles of the arm (N,) [rad]."""
    motion: WorkerMotion
    """Motion of the worker (1, 1, S, ...)."""


@dataclass(frozen=True, slots=True)
class Looked:
    """Results of detection in C cameras at one moment; all fields have shape (C,)."""

    in_view: Bools
    """Mask of cameras in which all joints are in the image and hidden neither by the room nor by
    the robot.
    """
    error: Floats
    """Mean image error of the joints, as a fraction of the stature; NaN without a detection."""
    distance_m: Floats
    """Distance from the camera to the centre of the body [m]."""
    angle_deg: Floats
    """Horizontal angle between the body's heading and the direction to the camera [deg].

    The angle is 0 for a camera in front of the body and 180 for one behind it.
    """


class Looker:
    """Renderer and detector for the crops of one scene."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.body = scene, load_body(scene.bodies[0])
        self.renderer = CropRenderer(scene)
        self.source = LensRenderer(self.renderer, scene.cameras)
        self.detector = PoseDetector(scene.cameras)

    def randomize(self, look: Look) -> None:
        """Set the appearance of the scene for the following moments."""
        self.renderer.randomize(look)

    def detect(self, now: Instant) -> Looked:
        """Detect the worker in all cameras at a moment."""
        scene = self.scene
        joints = worker_truth(self.body, now.motion).joints_world[0]
        px, depth_m = (values[0] for values in project(projections(scene.cameras), joints))
        found = self._found(now, px, depth_m)
        stature_px = np.array([camera.K[0, 0] for camera in scene.cameras]) * self.body.stature_m
        off_px = np.linalg.norm(found - px, axis=-1).mean(1)
        eyes = np.stack([camera.eye_world for camera in scene.cameras])
        blocked = find_hidden(scene.surroundings(now.q[None]), eyes, joints)[0].any(1)
        inside = [
            inside_image(camera, image_from_pinhole(camera, px[c])).all()
            for c, camera in enumerate(scene.cameras)
        ]
        return Looked(
            in_view=np.array(inside) & ~blocked,
            error=off_px * depth_m.mean(1) / stature_px,
            distance_m=np.linalg.norm(eyes - joints[0].mean(0), axis=-1),
            angle_deg=view_angle_deg(joints[0], eyes),
        )

    def close(self) -> None:
        """Release the threads and the graphics context."""
        self.detector.close()
        self.renderer.close()

    def _found(self, now: Instant, true_px: Points2, depth_m: Floats) -> Points2:
        """Return the detections (C, J, 2) in pinhole pixels; NaN if the worker is not detected."""
        cameras = self.scene.cameras
        views = zip(true_px, depth_m, cameras, strict=True)
        windows = [window_from_joints(*view) for view in views]
        if not any(windows):
            return np.full_like(true_px, np.nan)
        self.renderer.pose(now.q, one(now.motion, 0))
        self.detector.forget(0)  # without a track, the detector stage must confirm
        px = self.detector.detect(self.source, windows).px
        return np.stack([pinhole_from_image(camera, px[c]) for c, camera in enumerate(cameras)])


def instants(
    scene: Scene, n: int, rng: np.random.Generator, wanted: Sequence[str]
) -> Iterator[Instant]:
    """Yield n moments of a worker at work in a scene.

    The activities in `wanted` alternate. If one does not occur within some minutes, the moment
    shows the current activity instead. The worker has the first body of the scene.
    """
    body = load_body(scene.bodies[0])
    state = generator.make_state(1, 1, body, HRCConfig().motion, scene.grounds)
    streams = [np.random.default_rng(rng.integers(2**63))]
    generator.reset(state, np.arange(1), streams)
    spread, name = np.array(scene.robot.spread_rad), ""
    for k in range(n):
        for _ in range(PATIENCE):
            steps = int(rng.integers(*PAUSE_STEPS))
            generator.advance(state, streams, STEP_S, steps)
            name = generator.activity_names[generator.activity(state)[0, 0]]
            if name == wanted[k % len(wanted)]:
                break
        q = scene.home_q + rng.uniform(-1, 1, len(spread)) * spread
        yield Instant(name, q, generator.current(state))


def view_angle_deg(joints_world: Points3, eyes_world: Points3) -> Floats:
    """Return the view angles (C,) of `Looked.angle_deg`, for joints (J, 3) and cameras (C, 3)."""
    left = joints_world[[JOINT["left_shoulder"], JOINT["left_hip"]]].mean(0)
    right = joints_world[[JOINT["right_shoulder"], JOINT["right_hip"]]].mean(0)
    across = (left - right)[:2]
    ahead = np.array([across[1], -across[0]])
    to_eye = eyes_world[:, :2] - (left + right)[:2] / 2
    cosine = to_eye @ ahead / (np.linalg.norm(to_eye, axis=-1) * np.linalg.norm(ahead))
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
