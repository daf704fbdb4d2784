"""Cameras whose image does not change: they are stuck, whatever they show.

No live camera gives the very same keypoints twice: people sway, and sensors have noise. One that
repeats itself bit for bit is left out until several images in a row are new; a crop that moves over
a frozen image makes single new ones.
"""

import math
from typing import Any

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints
from hrc_env.core.typing import Bools, Ints

LEAST_NEW = 3
"""So many images in a row must be new before a camera that was stuck is believed again."""
LAST_IMAGE = np.dtype(
    [
        # a sum over its keypoints, by which it is known again (0: nobody seen); images in a row
        # that were new, up to `LEAST_NEW`
        ("total", "f8"), ("n_new", "i8"),
    ],
    align=True,
)  # fmt: skip
"""What is remembered of one camera of one environment."""


def make_frozen(batch: int, n_cameras: int) -> Any:
    """(B, C) records of `LAST_IMAGE`; every camera is believed."""
    state = np.empty((batch, n_cameras), LAST_IMAGE)
    forget_frozen(state, np.arange(batch))
    return state


def forget_frozen(state: Any, ids: Ints) -> None:
    """Begin environments `ids` anew."""
    state[ids] = (0.0, LEAST_NEW)


def leave_out_frozen(state: Any, ids: Ints, keypoints: Keypoints) -> None:
    """Make what stuck cameras report missing, in place, in keypoints of environments `ids`.

    `state` is of the whole batch; cameras without an image report nothing.
    """
    _leave_out(state, ids, keypoints.px, keypoints.confidence, keypoints.sigma_px)


def believed(state: Any, ids: Ints) -> Bools:
    """(B, C) which cameras of environments `ids` are not stuck, as far as is known."""
    return state["n_new"][ids] >= LEAST_NEW


@kernel
def _leave_out(state, ids, px, confidence, sigma_px):
    for row in range(len(ids)):
        for c in range(px.shape[1]):
            last, total = state[ids[row], c], _sum(px[row, c])
            if total == 0.0:
                continue
            last.n_new = 0 if total == last.total else min(last.n_new + 1, LEAST_NEW)
            last.total = total
            if last.n_new < LEAST_NEW:
                for w in range(px.shape[2]):
                    for j in range(px.shape[3]):
                        px[row, c, w, j, 0] = px[row, c, w, j, 1] = math.nan
                        confidence[row, c, w, j], sigma_px[row, c, w, j] = 0.0, math.inf


@kernel
def _sum(px):
    """Of all pixels of one camera; 0 where there are none."""
    total = 0.0
    for w in range(px.shape[0]):
        for j in range(px.shape[1]):
            u, v = px[w, j, 0], px[w, j, 1]
            if math.isfinite(u) and math.isfinite(v):
                total += u + math.pi * v
    return total
