"""What all cameras have in common: where in space the detector means a joint to be."""

import itertools

import numpy as np

from assets.emulator.fit.cells import FEW, N_K, N_P, class_of
from assets.emulator.samples import Samples
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.perception.calibration import HAND, KIND, NEXT, POSTURES

GROSS = 6.0
"""Errors beyond this multiple of their median are left out: they are the business of the tails."""
LEAST_M, TOLD_M = 0.002, 0.005
"""What varies in space has at least the first standard deviation; from the second on it can be
told whether it varies together with the next joint's [m]."""
FOLDED_UP = [POSTURES.index(name) for name in ("folded", "kneeling")]
MOST = 0.95
"""No correlation is closer to 1 or -1."""


def offsets_of(samples: Samples) -> Floats:
    """(P, K, 3) offsets in space: medians of those on which cameras agree."""
    offset = np.zeros((N_P, N_K, 3))
    ok = np.isfinite(samples.offset_m[..., 0]) & samples.counts[..., None]
    class_ = np.broadcast_to(class_of(samples.posture)[..., None], ok.shape)
    for kind in range(N_K):
        for posture in range(N_P):
            values = samples.offset_m[ok & (class_ == posture) & (kind == KIND)]
            offset[posture, kind] = offset[0, kind]
            if len(values) >= 30:
                trust = len(values) / (len(values) + FEW) if posture else 1.0
                offset[posture, kind] += trust * (np.median(values, 0) - offset[0, kind])
    return offset


def wander_of(samples: Samples, offset: Floats) -> tuple[Floats, Floats]:
    """How far offsets vary, and how they go together along limbs.

    Cameras err on their own, so that on average the product of two cameras' errors is what both
    have in common.

    Returns:
        (P, K, 3) standard deviations [m]; (K, 3) correlations with the `NEXT` joint, of bodies
        that are folded up: others hardly vary in space.
    """
    error = samples.error - np.einsum("ltcjka,ltja->ltcjk", samples.shown, _at(samples, offset))
    length, class_ = np.linalg.norm(error, axis=-1), class_of(samples.posture)
    wander, everyone = np.full((N_P, N_K, 3), LEAST_M), np.arange(len(KIND))
    for posture in range(N_P):
        mine = samples.counts & (class_ == posture)
        if mine.sum() < 30:
            wander[posture] = wander[0]
            continue
        variance = _in_common(error, samples.shown, _told(length, mine), everyone, everyone)
        wander[posture] = np.maximum(np.sqrt(np.maximum(_by_kind(variance), 0.0)), LEAST_M)
    mine = samples.counts & np.isin(class_, FOLDED_UP)
    if mine.sum() < 30:
        return wander, np.zeros((N_K, 3))
    told = _told(length, mine)
    own, together = (
        _in_common(error, samples.shown, told, everyone, other) for other in (everyone, NEXT)
    )
    return wander, _along_limbs(own, together)


def _told(length: Floats, mine: Bools) -> Bools:
    """(L, T, C, J) which errors of some samples (L, T) are no gross ones."""
    part = np.where(mine[..., None, None], length, np.nan)
    return part < GROSS * np.nanmedian(part, axis=(0, 1, 2))


def _in_common(error: Floats, shown: Floats, told: Bools, first: Ints, second: Ints) -> Floats:
    """(J, 3) covariance of joints' offsets [m^2], axis by axis: least squares over all products of
    their errors (L, T, C, J, 2) in two cameras."""
    covariance = np.zeros((len(first), 3))
    for row, (j, i) in enumerate(zip(first, second, strict=True)):
        normal, product = np.zeros((3, 3)), np.zeros(3)
        for a, b in itertools.permutations(range(error.shape[2]), 2):
            both = told[:, :, a, j] & told[:, :, b, i]
            if not both.any():
                continue
            here, there = error[:, :, a, j][both], error[:, :, b, i][both]
            found = np.einsum("nk,nl->nkl", here, there)
            seen = np.einsum("nkx,nlx->nklx", shown[:, :, a, j][both], shown[:, :, b, i][both])
            normal += np.einsum("nklx,nkly->xy", seen, seen)
            product += np.einsum("nklx,nkl->x", seen, found)
        if np.linalg.matrix_rank(normal) == 3:
            covariance[row] = np.linalg.solve(normal, product)
    return covariance


def _by_kind(values: Floats) -> Floats:
    """(K, 3) means over the joints of a kind."""
    return np.stack([values[kind == KIND].mean(0) for kind in range(N_K)])


def _along_limbs(variance: Floats, together: Floats) -> Floats:
    """(K, 3) correlations from variances (J, 3) and covariances with the next joint."""
    other = np.flatnonzero(np.arange(len(KIND)) != NEXT)
    limb = np.zeros((N_K, 3))
    for kind in np.unique(KIND[other]):
        j = other[KIND[other] == kind]
        own, next_one = variance[j].mean(0), variance[NEXT[j]].mean(0)
        told = np.minimum(own, next_one) > TOLD_M**2
        scale = np.sqrt(np.where(told, own * next_one, 1.0))
        limb[kind] = np.where(told, np.clip(together[j].mean(0) / scale, -MOST, MOST), 0.0)
    return limb


def projected(samples: Samples, offset: Floats) -> Floats:
    """(L, T, C, J, 2) what offsets in space (P, K, 3) look like."""
    shown = np.einsum("ltcjka,ltja->ltcjk", samples.shown, _at(samples, offset))
    return shown * np.stack([HAND, np.ones_like(HAND)], -1)


def space_variance(samples: Samples, wander: Floats) -> Floats:
    """(L, T, C, J) mean variance of a coordinate by what varies in space."""
    at = _at(samples, wander) ** 2
    return 0.5 * np.einsum("ltcjka,ltja->ltcj", samples.shown**2, at)


def _at(samples: Samples, table: Floats) -> Floats:
    """(L, T, J, 3) a table (P, K, 3) for every sample's posture."""
    return np.einsum("ltp,pja->ltja", samples.posture, table[:, KIND])
