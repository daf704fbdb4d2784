"""Where the nose is, in skeletons that have only a head."""

import numpy as np

from hrc_env.core.skeleton import JOINTS, N_JOINTS
from hrc_env.core.typing import Floats, Points3
from hrc_env.motion.capture.person import across, middle, stature
from hrc_env.motion.capture.record import Moving

NOSE_SHARE = 0.065
"""From the head's joint forward to the nose, as a share of stature (the baked bodies)."""
STANDS = -0.7
"""A rest pose stands if the cosine between trunk and thighs is below this."""


def joints_of(moving: Moving, found: dict[str, int], head: int) -> Points3:
    """(T, 15, 3) the joints in the file's frame and unit; a nose is made where it has none."""
    order = [found.get(joint, head) for joint in JOINTS]
    joints = moving.position[:, order].copy()
    if JOINTS[0] not in found:
        rest = moving.rest[order]
        ahead = _facing(joints, moving, rest, head)
        joints[:, 0] += NOSE_SHARE * stature(joints) * (moving.rotation[:, head] @ ahead)
    return joints


def _facing(joints: Points3, moving: Moving, rest: Points3, head: int) -> Floats:
    """(3,) the face's direction in the head's frame: from the rest pose if that one stands,
    else as people look on the average, straight ahead of their chest."""
    if _stands(rest):
        return _ahead(rest)
    local = np.swapaxes(moving.rotation[:, head], -1, -2) @ _ahead(joints)[..., None]
    mean = np.nanmean(local[..., 0], axis=0)
    return mean / np.linalg.norm(mean)


def _stands(rest: Points3) -> bool:
    """Whether a rest pose (15, 3) has its legs below its trunk, its shoulders apart."""
    if rest.shape != (N_JOINTS, 3):
        return False
    trunk = middle(rest, "shoulder") - middle(rest, "hip")
    thighs = middle(rest, "knee") - middle(rest, "hip")
    wide = np.linalg.norm(across(rest, "shoulder")) > 0.3 * np.linalg.norm(trunk)
    norms = np.linalg.norm(trunk) * np.linalg.norm(thighs)
    return bool(wide and norms > 0.0 and trunk @ thighs < STANDS * norms)


def _ahead(joints: Points3) -> Points3:
    """(..., 3) unit vectors forward of a trunk, told from the backward ones by the feet."""
    trunk = middle(joints, "shoulder") - middle(joints, "hip")
    ahead = np.cross(across(joints, "shoulder") + across(joints, "hip"), trunk)
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    feet = middle(joints, "foot") - middle(joints, "ankle")
    sign = np.sign(np.nanmean((ahead * feet).sum(-1)))
    return ahead * (sign or 1.0)
