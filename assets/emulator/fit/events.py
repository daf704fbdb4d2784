"""Events that occur now and then and last: exchange of left and right, missed workers."""

import numpy as np
from scipy.optimize import isotonic_regression
from scipy.special import ndtr, ndtri

from assets.emulator.clips import DT_S
from assets.emulator.fit.cells import FEW, N_P, class_of
from assets.emulator.samples import Samples
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.perception.calibration import N_SEEN, N_VIEWS
from hrc_env.perception.sightlines import SEEN

LAGS = (5, 12, 25, 40)
"""Lags at which the recurrence of an event is measured [frames]."""
FEW_MISSES = 20
"""Weight of the prior guess, in samples."""
FEWEST = 30
"""Least number of moments with the event for an estimate."""
SHARED: Floats = np.linspace(0.0, 0.999, 60)
"""Grid of correlations for the fit."""
QUANTILES: Floats = (np.arange(64) + 0.5) / 64
"""Quantiles at which a normal variable in its tail is evaluated."""


def swaps_of(samples: Samples) -> tuple[Floats, Floats]:
    """Return shares of time by view, (P, A, 2), mirror images pooled, and durations [s], (2,)."""
    view = np.round(np.abs(samples.view) * N_VIEWS / (2 * np.pi)).astype(int)
    looked = ~samples.missed & samples.counts[..., None]
    share, found = np.zeros((2, N_P, N_VIEWS, 2))
    length = np.zeros(2)
    for what in range(2):
        now, overall = samples.exchanged[..., what] & looked, 0.0
        for posture in range(N_P):
            chosen = _are(samples, posture)
            known = chosen & looked
            if known.any() or posture == 0:
                overall = now[known].sum() / max(known.sum(), 1)
            for bin_ in range(N_VIEWS // 2 + 1):
                mine = chosen & looked & (view == bin_)
                value = (now[mine].sum() + FEW * overall) / (mine.sum() + FEW)
                share[posture, [bin_, -bin_], what] = value
                found[posture, [bin_, -bin_], what] = now[mine].mean() if mine.any() else value
        length[what] = _lasts_s(now, looked, found[_class(samples), view, what])
    return share, length


def misses_of(samples: Samples) -> tuple[Floats, Floats]:
    """Return shares of time by the number of joints in sight, (P, 16), non-increasing, and the
    duration [s]."""
    n_seen = (samples.sight == SEEN).sum(-1)
    looked = np.broadcast_to(samples.counts[..., None], n_seen.shape)
    share = np.zeros((N_P, N_SEEN))
    for posture in range(N_P):
        chosen = _are(samples, posture)
        mine = [looked & chosen & (n_seen == n) for n in range(N_SEEN)]
        count = np.array([each.sum() for each in mine]) + FEW_MISSES
        guess = share[0] if posture else np.maximum(0.0, 1 - np.arange(N_SEEN) / 6)
        missed = np.array([samples.missed[each].sum() for each in mine])
        raw = (missed + FEW_MISSES * guess) / count
        share[posture] = isotonic_regression(raw, weights=count, increasing=False).x
    share = np.clip(share, 0, 1)
    lasts_s = _lasts_s(samples.missed, looked & (n_seen >= 7), share[_class(samples), n_seen])
    return share, np.array(lasts_s)


def _class(samples: Samples) -> Ints:
    """Return the posture of each sample, (L, T, C), the first one if it is of none."""
    class_ = np.maximum(class_of(samples.posture), 0)
    return np.broadcast_to(class_[..., None], samples.missed.shape)


def _are(samples: Samples, posture: int) -> Bools:
    """Return a mask of samples of bodies of a posture, (L, T, C)."""
    return np.broadcast_to(class_of(samples.posture)[..., None] == posture, samples.missed.shape)


def _lasts_s(now: Bools, looked: Bools, share: Floats) -> float:
    """Return the time constant of a slow normal variable that is in its lower tail while `now` (L,
    T, C) [s].

    It follows from the frequency with which the event recurs some frames later, among observed
    samples, beyond the frequency that their shares of time (L, T, C) explain.
    """
    constants = []
    for lag in LAGS:
        both = looked[:, lag:] & looked[:, :-lag]
        again = (now[:, lag:] & now[:, :-lag])[both].sum()
        if (now[:, :-lag] & both).sum() < FEWEST:
            continue
        pairs = np.stack([share[:, :-lag][both], share[:, lag:][both]], -1)
        expected = [_both(*np.unique(pairs, axis=0, return_counts=True), rho) for rho in SHARED]
        rho = float(np.interp(again, expected, SHARED))
        constants.append(-lag * DT_S / np.log(np.clip(rho, 1e-3, 0.9995)))
    return float(np.clip(np.median(constants), DT_S, 30.0)) if constants else 0.2


def _both(shares: Floats, counts: Ints, rho: float) -> float:
    """Return the expected number of pairs of normal variables of a correlation that are both in
    their lower tails, of shares (N, 2)."""
    tail = ndtri(np.clip(shares[:, :1] * QUANTILES, 1e-12, 1.0 - 1e-12))  # the first, given it is
    edge = ndtri(np.clip(shares[:, 1:], 1e-12, 1.0 - 1e-12))
    second = ndtr((edge - rho * tail) / np.sqrt(1.0 - rho**2)).mean(1)
    return float((counts * shares[:, 0] * second).sum())
