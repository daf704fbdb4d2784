"""Which cameras are not where they are said to be: what cameras say of each other, over seconds.

A camera that is turned, moved or zoomed against its calibration sees every body displaced in the
same way, joint after joint and second after second; a detector's errors do not last. To first order
all of it is four numbers of its image: a shift (2), a growth and a turn about the principal point.
For each camera they are estimated from the residuals between what it reports and what the *other*
cameras say (the estimate serves as the point of linearisation, so that a camera does not vote for
itself), by least squares with exponential forgetting, together with a delay in the direction in
which joints move, so that a camera that is merely late is not taken for a displaced one. What they
explain, in units of their covariance, to which an allowance for the lasting bias of a detector is
added, is a generalised likelihood ratio (Willsky and Jones, IEEE Transactions on Automatic Control
21, 1976; Basseville and Nikiforov, Detection of Abrupt Changes, 1993, chapter 7). The fewer numbers
are needed, the less has to be there to be noticed: growth alone (another focal length), shift and
growth (a camera that was moved or turned aside), and the turn as well are three hypotheses; each
pays for its numbers, and the best counts.

Each ratio supposes that one camera alone is wrong. What is wrong with it shows, less, in what all
others say: it is named when its ratio is clearly the largest. Of several wrong ones the worst may
be named, or nobody. A joint must be seen by three cameras: of two that contradict each other nobody
knows which is wrong.
"""

from typing import NamedTuple

import numpy as np

from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.tracking.calibration_kernel import N_NUMBERS, gather

EVERY = 10
"""Updates between two samples: errors of the detector last for about twelve."""
PRIOR: Floats = np.array([0.3, 0.3, 0.3, 0.3, 0.3]) ** -2.0
"""Precision of these numbers before anything was seen."""
ALLOWED: Floats = np.array([0.00084, 0.00084, 0.0034, 0.005]) ** 2
"""Variance of the first four that no calibration is to blame for: the detector's lasting bias."""


class WatchState(NamedTuple):
    """What is remembered of B environments and C cameras; arrays changed in place."""

    updates: Ints
    """(B,) since the reset."""
    information: Floats
    """(B, C, 5, 5) of the five numbers; the upper triangle."""
    score: Floats
    """(B, C, 5) information times the numbers."""
    ratio: Floats
    """(B, C) likelihood ratios, less their costs, at the last sample."""
    suspected: Bools
    """(B, C) whether a camera is named."""


def make_watch(batch: int, n_cameras: int) -> WatchState:
    """A state in which nobody is suspected."""
    lead = (batch, n_cameras)
    return WatchState(
        updates=np.zeros(batch, np.int64),
        information=np.zeros((*lead, N_NUMBERS, N_NUMBERS)),
        score=np.zeros((*lead, N_NUMBERS)),
        ratio=np.zeros(lead),
        suspected=np.zeros(lead, np.bool_),
    )


def forget(state: WatchState, ids: Ints) -> None:
    """Begin environments `ids` anew."""
    for array in state:
        array[ids] = 0


def watch(
    state: WatchState, ids: Ints, keypoints: Keypoints, age_s: Floats, estimate: PoseEstimate,
    P: Floats, axes: Floats,
) -> None:  # fmt: skip
    """Count an update of environments `ids`, whose rows the other arguments are.

    Args:
        state: of the whole batch.
        ids: (B,) environments.
        keypoints: pinhole pixels, by worker.
        age_s: (B, C) how old each camera's frame is [s].
        estimate: what is believed now.
        P: (C, 3, 4) projections, as the cameras are said to be.
        axes: (C, 3) principal point and focal length [px].
    """
    state.updates[ids] += 1
    due = np.flatnonzero(state.updates[ids] % EVERY == 0)
    if len(due) == 0:
        return
    gather(
        state.information, state.score, state.ratio, state.suspected,
        due, ids, keypoints.px, keypoints.confidence, keypoints.sigma_px, age_s,
        estimate.mean_world, estimate.velocity_world, estimate.tracked, P, axes,
        PRIOR, ALLOWED,
    )  # fmt: skip
