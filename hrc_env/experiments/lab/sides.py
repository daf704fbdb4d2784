"""Detection of joints that a camera missed, and of joints on the side turned away from it."""

import numpy as np

from hrc_env.core.skeleton import JOINTS
from hrc_env.core.typing import Bools, Floats, Points3
from hrc_env.experiments.recording import Recording
from hrc_env.geometry.cameras import project, projections
from hrc_env.worker.body import load_body

MISSED_CONFIDENCE = 0.5
"""Visibility below which a joint counts as missed. The network returns all joints, and the value is
an assumption."""
MISSED_SHARE = 0.05
"""Error above which a joint counts as missed, as a fraction of the body height in the image or in
3D."""
TURNED_M = 0.08
"""Difference in distance above which a side of the body counts as turned away from the camera [m].

The distance of a side is the mean over its shoulder and hip. The value is an assumption: bodies are
0.36 m wide at the shoulders.
"""

LEFT: Bools = np.array([name.startswith("left_") for name in JOINTS])
"""Mask (J,) of the joints on the left side."""
RIGHT: Bools = np.array([name.startswith("right_") for name in JOINTS])
"""Mask (J,) of the joints on the right side."""
_TRUNK = [name.endswith(("shoulder", "hip")) for name in JOINTS]


def find_missed_joints(recording: Recording) -> Bools:
    """Return a mask (T, C, J) of the joints that each camera missed in each frame."""
    cameras, keypoints = recording.scene.cameras, recording.keypoints
    px, depth_m = project(projections(cameras), recording.joints_world)
    focal_px = np.array([[camera.K[0, 0]] for camera in cameras])
    stature_px = focal_px * load_body(recording.scene.bodies[0]).stature_m / depth_m
    off = np.linalg.norm(keypoints.px[:, :, 0] - px, axis=-1) / stature_px
    return ~(off <= MISSED_SHARE) | (keypoints.confidence[:, :, 0] < MISSED_CONFIDENCE)


def find_averted_side(joints_world: Points3, eye_world: Floats) -> Bools:
    """Return a mask (..., J) of the joints on the side turned away from a camera.

    Args:
        joints_world: joint positions (..., J, 3) [m].
        eye_world: positions (..., 3) of the camera [m].
    """
    away_m = np.linalg.norm(joints_world - eye_world[..., None, :], axis=-1)
    left_m, right_m = (away_m[..., side & _TRUNK].mean(-1)[..., None] for side in (LEFT, RIGHT))
    return (left_m - right_m > TURNED_M) & LEFT | (right_m - left_m > TURNED_M) & RIGHT


def find_averted_joints(recording: Recording) -> Bools:
    """Return a mask (T, C, J) of the joints on the side turned away from each camera."""
    eyes_world = np.stack([camera.eye_world for camera in recording.scene.cameras])
    return find_averted_side(recording.joints_world[:, None], eyes_world)
