"""Which joints a camera missed, and which of them are on the side turned away from it."""

import numpy as np

from hrc_env.core.skeleton import JOINTS
from hrc_env.core.typing import Bools, Floats, Points3
from hrc_env.experiments.recording import Recording
from hrc_env.geometry.cameras import project, projections
from hrc_env.worker.body import load_body

MISSED_CONFIDENCE = 0.5
"""The network always returns its points: below this visibility a joint counts as missed (ours)."""
MISSED_SHARE = 0.05
"""So does one that is off by more than this share of the stature, in the image or in the room."""
TURNED_M = 0.08
"""A side is turned away when its shoulder and hip are on average so much further from the camera
than the other's; judgement: a body is 0.36 m wide at the shoulders."""

LEFT: Bools = np.array([name.startswith("left_") for name in JOINTS])
RIGHT: Bools = np.array([name.startswith("right_") for name in JOINTS])
_TRUNK = [name.endswith(("shoulder", "hip")) for name in JOINTS]


def missed_by_camera(recording: Recording) -> Bools:
    """(T, C, J) which joints each camera missed in each frame."""
    cameras, found = recording.scene.cameras, recording.keypoints
    px, depth_m = project(projections(cameras), recording.joints_world)
    focal_px = np.array([[camera.K[0, 0]] for camera in cameras])
    stature_px = focal_px * load_body(recording.scene.bodies[0]).stature_m / depth_m
    off = np.linalg.norm(found.px[:, :, 0] - px, axis=-1) / stature_px
    return ~(off <= MISSED_SHARE) | (found.confidence[:, :, 0] < MISSED_CONFIDENCE)


def turned_away(joints_world: Points3, eye_world: Floats) -> Bools:
    """(..., J) the joints (..., J, 3) of the side that is turned away from an eye (..., 3)."""
    away_m = np.linalg.norm(joints_world - eye_world[..., None, :], axis=-1)
    left_m, right_m = (away_m[..., side & _TRUNK].mean(-1)[..., None] for side in (LEFT, RIGHT))
    return (left_m - right_m > TURNED_M) & LEFT | (right_m - left_m > TURNED_M) & RIGHT


def away_from_cameras(recording: Recording) -> Bools:
    """(T, C, J) which joints are on the side turned away from each camera in each frame."""
    eyes_world = np.stack([camera.eye_world for camera in recording.scene.cameras])
    return turned_away(recording.joints_world[:, None], eyes_world)
