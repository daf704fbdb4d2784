"""Error that all cameras share: the offset in space at which the detector places a joint."""

import itertools

import numpy as np

from assets.emulator.fit.cells import FEW, N_K, N_P, class_of
from assets.emulator.samples import Samples
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.perception.calibration import HAND, KIND, NEXT, POSTURES

GROSS = 6.0
"""Outliers are errors beyond this multiple of their median; the tails describe them."""
LEAST_M, TOLD_M = 0.002, 0.005
"""Least standard deviation of an offset in space, and the least one from which its correlation with
the next joint is estimated [m]."""
FOLDED_UP = [POSTURES.index(name) for name in ("folded", "kneeling")]
MOST = 0.95
"""Greatest absolute value of a correlation."""


def offsets_of(samples: Samples) -> Floats:
    """Return offsets in space, (P, K, 3): medians of those on which cameras agree."""
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
    """Estimate the variation of offsets and its correlation along limbs.

    Cameras err independently, so that the mean product of two cameras' errors is the variance of
    the error that they share.

    Returns:
        (P, K, 3) standard deviations [m];
        (K, 3) correlations with the `NEXT` joint, of folded bodies: others hardly vary in space.
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
    """Return a mask of the errors (L, T, C, J) of some samples (L, T) that are not outliers."""
    part = np.where(mine[..., None, None], length, np.nan)
    return part < GROSS * np.nanmedian(part, axis=(0, 1, 2))


def _in_common(error: Floats, shown: Floats, told: Bools, first: Ints, second: Ints) -> Floats:
    """Estimate the covariance of joints' offsets, (J, 3) [m^2], for each axis.

    This is a least-squares fit to all products of their errors (L, T, C, J, 2) in two cameras.
    """
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
    """Return means over the joints of a kind, (K, 3)."""
    return np.stack([values[kind == KIND].mean(0) for kind in range(N_K)])


def _along_limbs(variance: Floats, together: Floats) -> Floats:
    """Return correlations, (K, 3), from variances (J, 3) and covariances with the next joint."""
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
    """Project offsets in space (P, K, 3) into the images, (L, T, C, J, 2)."""
    shown = np.einsum("ltcjka,ltja->ltcjk", samples.shown, _at(samples, offset))
    return shown * np.stack([HAND, np.ones_like(HAND)], -1)


def space_variance(samples: Samples, wander: Floats) -> Floats:
    """Return the mean variance of an image coordinate by the variation in space, (L, T, C, J)."""
    at = _at(samples, wander) ** 2
    return 0.5 * np.einsum("ltcjka,ltja->ltcj", samples.shown**2, at)


def _at(samples: Samples, table: Floats) -> Floats:
    """Return a table (P, K, 3) at every sample's posture, (L, T, J, 3)."""
    return np.einsum("ltp,pja->ltja", samples.posture, table[:, KIND])
