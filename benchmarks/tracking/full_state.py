"""The filter that knows everything about matched sequences: can the bound be reached?

An iterated extended Kalman filter (Bell and Cathey, IEEE Trans. Automatic Control 38, 1993) of
all 90 states with the model that the sequences were drawn from. It is slow and of no use on
real people; it tells how much of an estimator's distance to the bound is the estimator's.
"""

from collections.abc import Iterator

import numpy as np

from benchmarks.tracking.bound import (
    block_diagonal,
    camera_information,
    joint_blocks,
    shrink,
)
from benchmarks.tracking.matched import (
    N_PLACES,
    MatchedModel,
    advance,
    bone_gain,
    bone_rows,
    tilted,
)
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Covariances3, Floats, Points2, Points3
from hrc_env.geometry.cameras import project

_STEPS = 3
"""Steps of Gauss-Newton; more change nothing that could be seen."""


def filter_matched(
    P: Floats, model: MatchedModel, px: Points2, sigma_px: float
) -> Iterator[tuple[Points3, Covariances3]]:
    """Mean (S, J, 3) and covariance (S, J, 3, 3) after each frame.

    Args:
        P: (C, 3, 4) projections.
        model: what the sequences were drawn from.
        px: (T, S, C, J, 2) detections, NaN where missing.
        sigma_px: their standard deviation [px].
    """
    place = model.offset + np.array([0.0, 0.0, 1.0])
    state = np.tile(np.concatenate([place, np.zeros_like(place)]).ravel(), (px.shape[1], 1))
    start = np.diag(np.repeat([1.5**2, 1.0], N_PLACES))
    cov = np.tile(start, (px.shape[1], 1, 1))
    for t, frame in enumerate(px):
        if t:
            before, state = state, expected(model, state)
            move, Q = tilted(model, joints_of(before), joints_of(state))
            cov = move @ cov @ move.swapaxes(1, 2) + Q
        state, cov = _measure(P, frame, sigma_px, state, cov)
        yield joints_of(state), joint_blocks(cov)


def joints_of(state: Floats) -> Points3:
    """(S, J, 3) of (S, 90)."""
    return state[:, :N_PLACES].reshape(-1, N_JOINTS, 3)


def expected(model: MatchedModel, state: Floats) -> Floats:
    """Mean (S, 90) of the tilted transition."""
    free = advance(model, state)
    state = free
    for _ in range(_STEPS):
        length, rows = bone_rows(joints_of(state), model.bones)
        moved = np.einsum("sbp,sp->sb", rows, (state - free)[:, :N_PLACES])
        miss = model.length - length + moved
        state = free + np.einsum("snb,sb->sn", bone_gain(model, rows), miss)
    return state


def _measure(
    P: Floats, px: Points2, sigma_px: float, prior: Floats, cov: Floats
) -> tuple[Floats, Floats]:
    """Gauss-Newton update of (S, 90) and (S, 90, 90) by one frame (S, C, J, 2)."""
    seen, state, after = np.isfinite(px[..., 0]), prior, cov
    for _ in range(_STEPS):
        joints = joints_of(state)
        pixel, depth = project(P, joints)
        rows = P[:, None, :2, :3] - pixel[..., None] * P[:, None, 2:, :3]
        rows = rows / depth[..., None, None]
        miss = np.where(seen[..., None], px - pixel, 0.0)
        push = np.einsum("scjki,scjk->sji", rows, miss).reshape(len(px), -1) / sigma_px**2
        information = block_diagonal(camera_information(P, joints, seen, sigma_px))
        after = shrink(cov, information)
        back = np.einsum("spq,sq->sp", information, (state - prior)[:, :N_PLACES])
        state = prior + np.einsum("snp,sp->sn", after[:, :, :N_PLACES], push + back)
    return state, after
