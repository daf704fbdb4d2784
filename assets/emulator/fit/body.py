"""Error factor of a whole body: a camera that sees a body badly errs more in all its joints."""

import numpy as np

from assets.emulator.fit.cells import FEW, N_P, N_S, Cells
from hrc_env.core.typing import Floats
from hrc_env.perception.calibration import BODY_KNOTS, KINDS

LOG_RAYLEIGH_VAR = np.pi**2 / 24
"""Variance of the logarithm of the length of two normal variables of standard deviation 1."""
ENOUGH = 6
"""Least number of joints in an image from which the factor is estimated."""
_NORMAL = np.array([0.135, 2.275, 15.866, 50.0, 84.134, 97.725, 99.865])
"""Percentages of a normal distribution below `BODY_KNOTS`."""


def bodies_of(s: Cells, left_over: Floats) -> tuple[Floats, Floats, float]:
    """Estimate the factor that all errors of a body in one image share.

    Args:
        s: the samples.
        left_over: (L, T, C, J, 2) errors less their mean.

    Returns:
        (P, Q) quantiles of the factor's logarithm at `BODY_KNOTS`;
        (L, T, C) the logarithm, NaN where there are too few joints;
        the share of the sizes' variance that the factor explains.
    """
    logs = _log_length(s, left_over)
    body = _bodies(s, logs)
    own = max(float(np.nanvar(logs - body[..., None])) - LOG_RAYLEIGH_VAR, 0.01)
    whole = float(np.nanvar(body[s.posture[..., 0] == 0]))
    return _quantiles(s, body), body, float(np.clip(whole / (whole + own), 0.0, 0.9))


def body_spread(s: Cells) -> Floats:
    """Return the standard deviation of the factor's logarithm, (P,), for samples of any other
    errors."""
    body = _bodies(s, _log_length(s, s.mirrored))
    spread = [float(np.nanstd(body[s.posture[..., 0] == posture])) for posture in range(N_P)]
    return np.array(spread, float)


def _bodies(s: Cells, logs: Floats) -> Floats:
    """Return medians over the joints, (L, T, C), centred at 0; NaN where there are too few
    joints."""
    enough = np.isfinite(logs).sum(-1) >= ENOUGH
    body = np.full(enough.shape, np.nan)
    body[enough] = np.nanmedian(logs[enough], -1)
    for posture in range(N_P):
        mine = enough & (s.posture[..., 0] == posture)
        if mine.any():
            body[mine] -= np.median(body[mine])
    return body


def _quantiles(s: Cells, body: Floats) -> Floats:
    """Return quantiles at `BODY_KNOTS`, (P, Q); those of upright bodies where there are few folded
    ones."""
    table = np.zeros((N_P, len(BODY_KNOTS)))
    for posture in range(N_P):
        mine = np.isfinite(body) & (s.posture[..., 0] == posture)
        table[posture] = np.percentile(body[mine], _NORMAL) if mine.sum() >= FEW else table[0]
    return table


def _log_length(s: Cells, left_over: Floats) -> Floats:
    """Return the logarithm of every error's length less its cell's median; NaN without an error."""
    length = np.where(s.found, np.linalg.norm(left_over, axis=-1), np.nan)
    logs = np.log(np.maximum(length, 1e-4))
    for posture in range(N_P):
        for sight in range(N_S):
            for kind in range(len(KINDS)):
                mine = s.pick(posture, sight, kind)
                if mine.any():
                    logs[mine] -= np.median(logs[mine])
    return np.where((s.posture >= 0) & (s.sight < N_S), logs, np.nan)
