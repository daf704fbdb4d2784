"""Detection of cameras with a frozen image.

No live camera reports exactly the same keypoints twice, because people sway and sensors have noise.
If the keypoints of a camera repeat bit for bit, the camera is ignored until several successive
images are new. One new image is not enough, because a crop window that moves over a frozen image
also changes the keypoints.
"""

import math

import numpy as np

from hrc_env.core.declared import Records2, dtype_of, make_records
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints
from hrc_env.core.typing import Bools, Floats, Ints, Points2

LEAST_NEW = 3
"""Number of successive new images after which a frozen camera is used again."""


class LastImage:
    """Checksum of the last image of one camera in one environment, and number of new images."""

    total: float
    """Checksum of the keypoints in the last image that had keypoints; 0 before the first one."""
    n_new: int
    """Number of successive images that were new, up to `LEAST_NEW`."""


LAST_IMAGE = dtype_of(LastImage)


def make_frozen(batch: int, n_cameras: int) -> Records2[LastImage]:
    """Return initial records (B, C), in which no camera is frozen."""
    state = make_records(LastImage, (batch, n_cameras))
    forget_frozen(state, np.arange(batch))
    return state


def forget_frozen(state: Records2[LastImage], ids: Ints) -> None:
    """Reset the records of environments `ids`, so that none of their cameras is frozen."""
    state[ids] = (0.0, LEAST_NEW)


def leave_out_frozen(state: Records2[LastImage], ids: Ints, keypoints: Keypoints) -> None:
    """Mark the keypoints of frozen cameras as missing, and update the records, in place.

    Args:
        state: (B, C) records of the whole batch.
        ids: (b,) indices of the environments to which the keypoints belong.
        keypoints: (b, C, W, J) keypoints. They must be missing for cameras without a new image.
    """
    _leave_out(state, ids, keypoints.px, keypoints.confidence, keypoints.sigma_px)


def find_live_cameras(state: Records2[LastImage], ids: Ints) -> Bools:
    """Return a mask (b, C) of the cameras of environments `ids` that are not frozen."""
    return state["n_new"][ids] >= LEAST_NEW


@kernel
def _leave_out(
    state: Records2[LastImage], ids: Ints, px: Points2, confidence: Floats, sigma_px: Floats
) -> None:
    """Mark the keypoints of frozen cameras as missing; see `leave_out_frozen`."""
    for row in range(len(ids)):
        for c in range(px.shape[1]):
            last, total = state[ids[row], c], 0.0
            for w in range(px.shape[2]):
                for j in range(px.shape[3]):
                    u, v = px[row, c, w, j, 0], px[row, c, w, j, 1]
                    if math.isfinite(u) and math.isfinite(v):
                        total += u + math.pi * v
            if total == 0.0:
                continue
            last.n_new = 0 if total == last.total else min(last.n_new + 1, LEAST_NEW)
            last.total = total
            if last.n_new < LEAST_NEW:
                for w in range(px.shape[2]):
                    for j in range(px.shape[3]):
                        px[row, c, w, j, 0] = px[row, c, w, j, 1] = math.nan
                        confidence[row, c, w, j], sigma_px[row, c, w, j] = 0.0, math.inf
