"""Mean of a camera's own errors, by view, and their size."""

import math

import numpy as np

from assets.emulator.fit.cells import FEW, N_K, N_P, N_S, SHARP, Cells, mix
from assets.emulator.samples import Samples
from hrc_env.core.typing import Floats
from hrc_env.perception.calibration import HAND, KIND, N_VIEWS
from hrc_env.perception.sightlines import HIDDEN, OUTSIDE, SEEN

_SPREADS = np.linspace(0.0, 2.0, 41)


def bias_of(s: Cells, left_over: Floats) -> Floats:
    """Return mean errors by view, (A, K, 2), shrunk where there are few samples."""
    bias = np.zeros((N_VIEWS, N_K, 2))
    small = np.linalg.norm(left_over, axis=-1) < SHARP
    for kind in range(N_K):
        mine = s.pick(0, SEEN, kind) & small
        for view in range(N_VIEWS):
            values = left_over[mine & (s.view_bin == view)]
            if len(values):
                bias[view, kind] = np.median(values, 0) * len(values) / (len(values) + FEW)
    bias[:, 0, 0] -= bias[(-np.arange(N_VIEWS)) % N_VIEWS, 0, 0]  # the nose is its own mirror image
    bias[:, 0, 1] += bias[(-np.arange(N_VIEWS)) % N_VIEWS, 0, 1]
    bias[:, 0] *= 0.5
    return bias


def bias_at(bias: Floats, samples: Samples, s: Cells) -> Floats:
    """Return the interpolated bias of every sample, (L, T, C, J, 2)."""
    place = (samples.view[..., None] * HAND) * N_VIEWS / (2 * np.pi)
    low = np.floor(place).astype(int)
    part = (place - low)[..., None]
    near, far = bias[low % N_VIEWS, KIND], bias[(low + 1) % N_VIEWS, KIND]
    return near + part * (far - near)


def _ratios() -> tuple[Floats, Floats]:
    """Return the 95th percentile over the median, and the median, of log-normal times Rayleigh, by
    spread."""
    rng = np.random.default_rng(0)
    z, rayleigh = rng.standard_normal(40_000), np.sqrt(-2 * np.log(rng.random(40_000)))
    values = np.exp(_SPREADS[:, None] * z) * rayleigh
    middle, high = np.percentile(values, [50, 95], axis=1)
    return high / middle, middle


def sizes_of(s: Cells, left_over: Floats, body: Floats, in_space: Floats) -> tuple[Floats, Floats]:
    """Return the geometric mean and the spread of a camera's own errors, each (P, S, K).

    They follow from the median and the 95th percentile after subtraction of the logarithm of the
    body's factor (L, T, C).
    """
    ratio, middle = _ratios()
    size, spread = np.zeros((N_P, N_S, N_K)), np.zeros((N_P, N_S, N_K))
    length = np.linalg.norm(left_over, axis=-1) / np.exp(body)[..., None]
    told = np.isfinite(length)
    for posture in range(N_P):
        for sight in (SEEN, HIDDEN, OUTSIDE):
            for kind in range(N_K):
                mine = s.pick(posture, sight, kind) & told
                n = int(mine.sum())
                stands_for = (0, max(sight - (posture == 0), 0))
                values = [size[*stands_for, kind] or 0.01, spread[*stands_for, kind]]
                if n >= 30:
                    half, most = np.percentile(length[mine], [50, 95])
                    wide = float(np.interp(most / half, ratio, _SPREADS))
                    own = half / np.interp(wide, _SPREADS, middle)
                    own = math.sqrt(max(own**2 - np.median(in_space[mine]), (0.4 * own) ** 2))
                    trust = n / (n + FEW)
                    values[0] = math.exp(mix(math.log(values[0]), math.log(own), trust))
                    values[1] = mix(values[1], wide, trust)
                size[posture, sight, kind], spread[posture, sight, kind] = values
    return size, spread


def relative(s: Cells, left_over: Floats, body: Floats, size: Floats) -> Floats:
    """Return errors over the size of their cell and body, outliers cut; NaN without an error."""
    posture, sight = np.maximum(s.posture, 0), np.minimum(s.sight, N_S - 1)
    scale = size[posture, sight, np.broadcast_to(KIND, sight.shape)]
    scale = scale * np.exp(np.nan_to_num(body))[..., None]
    return np.where(s.found[..., None], np.clip(left_over / scale[..., None], -4, 4), np.nan)
