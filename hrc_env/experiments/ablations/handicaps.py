"""What a tracker is told or made to forget before every image, which no setting of its own does."""

from typing import Any

import numpy as np

from hrc_env.core.typing import Floats, Points3
from hrc_env.tracking.tree.gaussian import PARENT, ROOT

BONES = ("learnt", "known", "none")
"""Lengths as the filter learns them; the true ones, given; nothing is expected of any."""
MOTION = ("model", "forgotten")
"""As the filter has it; velocities are forgotten after every image, so that a joint may set off at
any speed that joints have, as in line 7 of the paper's Algorithm 1."""
TREES = ("particle", "kalman")
"""Estimators that can be handicapped so."""
KNOWN_M2 = 1e-5
"""Variance of a length that is given [m^2]: what a filter may learn at best."""
UNKNOWN_M2 = 1e6
"""Variance of a length of which nothing is expected [m^2]."""
SPEED_MPS = 1.0
"""Standard deviation of a forgotten velocity on each axis [m/s]; judgement."""
_PARENT = np.where(np.arange(len(PARENT)) == ROOT, ROOT, PARENT)


def lengths_m(joints_world: Points3) -> Floats:
    """(B, W, J) from each joint to its parent on the filter's tree [m]; 1 at the root."""
    lengths = np.linalg.norm(joints_world - joints_world[:, :, _PARENT], axis=-1)
    lengths[..., ROOT] = 1.0
    return lengths


def handicap(state: Any, bones: str, motion: str, lengths: Floats) -> None:
    """Change what a tracker of one of `TREES` knows, in place, before its next prediction; the true
    lengths are (B, W, J) [m]."""
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
    """Keep the marginal of all positions, which is again a Gaussian on the tree."""
    cov, slope = trees["cov"], trees["slope"]
    of_parent = cov[..., _PARENT, :, :]
    together = (slope @ of_parent)[..., :3, :3]  # of a joint's position and its parent's
    positions = together @ np.linalg.inv(of_parent[..., :3, :3])
    slope[...], slope[..., :3, :3] = 0.0, positions
    slope[..., ROOT, :, :] = 0.0
    trees["body"][..., 3:] = 0.0
    cov[..., 3:, :], cov[..., :, 3:] = 0.0, 0.0
    cov[..., [3, 4, 5], [3, 4, 5]] = SPEED_MPS**2
