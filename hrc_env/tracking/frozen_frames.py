"""Cameras whose image does not change: they are stuck, whatever they show.

No live camera gives the very same keypoints twice: people sway, and sensors have noise. One that
repeats itself bit for bit is left out until several images in a row are new; a crop that moves over
a frozen image makes single new ones.
"""

import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints
from hrc_env.core.typing import Floats, Ints

LEAST_NEW = 3
"""So many images in a row must be new before a camera that was stuck is believed again."""


class FrozenState(NamedTuple):
    """What is remembered of B environments and C cameras; arrays changed in place."""

    last: Floats
    """(B, C) a sum over the last image's keypoints, by which it is known again; 0: nobody seen."""
    new: Ints
    """(B, C) images in a row that were new, up to `LEAST_NEW`."""


def make_frozen(batch: int, n_cameras: int) -> FrozenState:
    """A state in which every camera is believed."""
    return FrozenState(
        np.zeros((batch, n_cameras)), np.full((batch, n_cameras), LEAST_NEW, np.int64)
    )


def forget_frozen(state: FrozenState, ids: Ints) -> None:
    """Begin environments `ids` anew."""
    state.last[ids], state.new[ids] = 0.0, LEAST_NEW


def leave_out_frozen(state: FrozenState, ids: Ints, keypoints: Keypoints) -> None:
    """Make what stuck cameras report of environments `ids` missing, in place.

    Args:
        state: of the whole batch.
        ids: (B,) environments, whose rows the keypoints are.
        keypoints: whose they are is open; cameras without an image report nothing.
    """
    _leave_out(state.last, state.new, ids, keypoints.px, keypoints.confidence, keypoints.sigma_px)


@kernel
def _leave_out(last, new, ids, px, confidence, sigma_px):
    for row in range(len(ids)):
        b = ids[row]
        for c in range(px.shape[1]):
            total = _sum(px[row, c])
            if total == 0.0:
                continue
            new[b, c] = 0 if total == last[b, c] else min(new[b, c] + 1, LEAST_NEW)
            last[b, c] = total
            if new[b, c] < LEAST_NEW:
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
