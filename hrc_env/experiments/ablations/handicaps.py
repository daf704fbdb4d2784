"""Changes to a tracker's state, before each update, that add or remove information."""

from typing import Any

import numpy as np

from hrc_env.core.typing import Floats, Points3
from hrc_env.tracking.tree.gaussian import PARENT, ROOT

BONES = ("learnt", "known", "none")
"""Treatments of bone lengths: "learnt" by the filter, "known" (set to the true lengths), or "none"
(no prior)."""
MOTION = ("model", "forgotten")
"""Treatments of velocities: "model" (estimated by the filter's motion model) or "forgotten" (reset
after every image).

Forgotten velocities have the standard deviation of a prior, as in line 7 of the paper's Algorithm
1.
"""
TREES = ("particle", "kalman")
"""Estimators that support these treatments."""
KNOWN_M2 = 1e-5
"""Variance of a known bone length [m^2], which is the lower limit of the variances in a filter."""
UNKNOWN_M2 = 1e6
"""Variance of a bone length without a prior [m^2]."""
SPEED_MPS = 1.0
"""Standard deviation of a forgotten velocity along each axis [m/s]. The value is an assumption."""
_PARENT = np.where(np.arange(len(PARENT)) == ROOT, ROOT, PARENT)


def compute_lengths_m(joints_world: Points3) -> Floats:
    """Return the distance (B, W, J) from each joint to its parent in the kinematic tree [m].

    It is 1 at the root.
    """
    lengths = np.linalg.norm(joints_world - joints_world[:, :, _PARENT], axis=-1)
    lengths[..., ROOT] = 1.0
    return lengths


def handicap(state: Any, bones: str, motion: str, lengths: Floats) -> None:
    """Modify the state of one of the `TREES` in place, before its next prediction.

    Args:
        state: state of the tracker.
        bones: one of `BONES`.
        motion: one of `MOTION`.
        lengths: true bone lengths (B, W, J) [m].
    """
    if (bones, motion) == (BONES[0], MOTION[0]):
        return
    trees = state.trees
    if bones == "none":
        trees["bone_variance"] = UNKNOWN_M2
    elif bones == "known":
        trees["bone_length"] = lengths[:, :, None]
        trees["bone_variance"] = KNOWN_M2
    if motion == "forgotten":
        _forget_velocities(trees)


def _forget_velocities(trees: Any) -> None:
    """Reset the velocities without changing the marginal distribution of the positions.

    The marginal distribution is again a Gaussian on the kinematic tree.
    """
    cov, slope = trees["cov"], trees["slope"]
    of_parent = cov[..., _PARENT, :, :]
    together = (slope @ of_parent)[..., :3, :3]  # of a joint's position and its parent's
    positions = together @ np.linalg.inv(of_parent[..., :3, :3])
    slope[...], slope[..., :3, :3] = 0.0, positions
    slope[..., ROOT, :, :] = 0.0
    trees["body"][..., 3:] = 0.0
    cov[..., 3:, :], cov[..., :, 3:] = 0.0, 0.0
    cov[..., [3, 4, 5], [3, 4, 5]] = SPEED_MPS**2
