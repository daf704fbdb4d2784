"""Joints that a camera missed, and joints on the side turned away from it."""

import numpy as np

from hrc_env.core.skeleton import JOINTS
from hrc_env.core.typing import Bools, Floats, Points3
from hrc_env.experiments.recording import Recording
from hrc_env.geometry.cameras import project, projections
from hrc_env.worker.body import load_body

MISSED_CONFIDENCE = 0.5
"""Visibility below which a joint counts as missed (ours): the network always returns its points."""
MISSED_SHARE = 0.05
"""Share of the stature, in the image or in the room, beyond which an error counts as missed."""
TURNED_M = 0.08
"""Difference of distances from which a side is turned away [m].

The shoulder and hip of that side are on average further from the camera than the other's by this;
judgement: a body is 0.36 m wide at the shoulders.
"""

LEFT: Bools = np.array([name.startswith("left_") for name in JOINTS])
"""Which joints (J,) are on the left side."""
RIGHT: Bools = np.array([name.startswith("right_") for name in JOINTS])
"""Which joints (J,) are on the right side."""
_TRUNK = [name.endswith(("shoulder", "hip")) for name in JOINTS]


def find_missed_joints(recording: Recording) -> Bools:
    """Return which joints each camera missed in each frame (T, C, J)."""
    cameras, keypoints = recording.scene.cameras, recording.keypoints
    px, depth_m = project(projections(cameras), recording.joints_world)
    focal_px = np.array([[camera.K[0, 0]] for camera in cameras])
    stature_px = focal_px * load_body(recording.scene.bodies[0]).stature_m / depth_m
    off = np.linalg.norm(keypoints.px[:, :, 0] - px, axis=-1) / stature_px
    return ~(off <= MISSED_SHARE) | (keypoints.confidence[:, :, 0] < MISSED_CONFIDENCE)


def find_averted_side(joints_world: Points3, eye_world: Floats) -> Bools:
    """Return which joints (..., J) are on the side turned away from a camera.

    Args:
        joints_world: joint positions (..., J, 3) [m].
        eye_world: position of the camera (..., 3) [m].
    """
    away_m = np.linalg.norm(joints_world - eye_world[..., None, :], axis=-1)
    left_m, right_m = (away_m[..., side & _TRUNK].mean(-1)[..., None] for side in (LEFT, RIGHT))
    return (left_m - right_m > TURNED_M) & LEFT | (right_m - left_m > TURNED_M) & RIGHT


def find_averted_joints(recording: Recording) -> Bools:
    """Return which joints are on the side turned away from each camera in each frame (T, C, J)."""
    eyes_world = np.stack([camera.eye_world for camera in recording.scene.cameras])
    return find_averted_side(recording.joints_world[:, None], eyes_world)
