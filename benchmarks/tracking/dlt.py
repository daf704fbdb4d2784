"""Triangulation of each frame by direct linear transformation (DLT), as a reference.

Hartley and Zisserman, Multiple View Geometry, 2nd ed., section 12.2. The method has no weights,
gates or refinement, and a joint that fewer than two cameras detect keeps its last position. Its
error measures the difficulty of the sequences.
"""

import numpy as np

from hrc_env.core.typing import Floats, Points2, Points3


def triangulate_frame(P: Floats, px: Points2, last: Points3) -> Points3:
    """Triangulate points (S, J, 3) from pixels (S, C, J, 2); missing pixels are NaN.

    Joints that fewer than two cameras detect keep their `last` position.
    """
    seen = np.isfinite(px[..., 0])
    px = np.where(seen[..., None], px, 0.0)
    rows = px[..., None] * P[:, None, None, 2] - P[:, None, :2]
    rows = np.where(seen[..., None, None], rows / 1e3, 0.0)
    _, vectors = np.linalg.eigh(np.einsum("scjki,scjkl->sjil", rows, rows))
    nearest = vectors[..., 0]
    enough = (seen.sum(1) >= 2)[..., None]
    return np.where(enough, nearest[..., :3] / np.where(enough, nearest[..., 3:], 1.0), last)
