"""The mixture that several hypotheses are: its settings, its mean and its covariance."""

import math
from typing import NamedTuple

from hrc_env.core.kernels import kernel
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.hypotheses.slots import Hypotheses
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tree.reports import report_moments, report_rest

_LEAST_EVIDENCE = 0.01
"""A limb's other mode with less evidence than this share of the known one's is none."""
_MOST_PENALTY = 10.0
"""A turned body that is less likely than this is not tried [nat]."""
_DISTINCT, _CLOSE = 3.0, 2.0
"""Posterior deviations: a mode beyond the first is new, hypotheses within the second are one."""
_SEARCH_STEPS = 4
_TICK_S = 1e-6
"""Sums of time steps that are short by no more are whole."""


class MixtureSettings(NamedTuple):
    """What the kernels need to keep hypotheses apart."""

    mirror_body: bool
    mirror_limbs: bool
    look_every_s: float
    """Time between two searches for other hypotheses [s]."""
    open_m: float
    """Standard deviation of a part's depth above which it is open [m]."""
    log_least: float
    """Log of the least evidence of a new hypothesis beside its parent's."""
    log_drop: float
    """Log-probability below which a hypothesis is dropped."""
    trust: float
    """Share of the log-evidence of a set of frames that counts."""
    walking_odds: float
    """Log-odds per second of walking forwards against backwards."""
    anatomy: float
    """Share of the anatomical potential that counts."""
    turn: float
    """Turn of the other body that costs half a nat [rad]."""
    most_penalty: float
    """No other body is tried that costs more [nat]."""
    distinct: float
    """Squared posterior deviations from which on a mode is a hypothesis of its own."""
    close: float
    """Squared posterior deviations below which two hypotheses are one."""
    search_steps: int
    """Gauss-Newton steps from a mirror image."""


def mixture_settings(config: ParticleConfig) -> MixtureSettings:
    """The kernels' part of the configuration."""
    return MixtureSettings(
        mirror_body="body" in config.mirrored_parts,
        mirror_limbs="limbs" in config.mirrored_parts,
        look_every_s=config.look_every_s - _TICK_S,
        open_m=config.open_depth_m,
        log_least=math.log(_LEAST_EVIDENCE),
        log_drop=math.log(config.least_weight),
        trust=config.evidence_trust,
        walking_odds=config.walking_odds,
        anatomy=config.anatomy_trust,
        turn=config.turn_std_rad,
        most_penalty=_MOST_PENALTY,
        distinct=_DISTINCT**2,
        close=_CLOSE**2,
        search_steps=_SEARCH_STEPS,
    )


@kernel(makes_arrays=True)
def estimate_all(state, s, out):
    """Fill the arrays of a `PoseEstimate` in; `state` and `s` as in `hypotheses.filter`."""
    state, s = Hypotheses(*state), Settings(*s)
    trees, limit = state.trees, state.trees.shape[1] // state.n_alive.shape[1]
    for b in range(state.n_alive.shape[0]):
        for w in range(state.n_alive.shape[1]):
            first = w * limit
            if state.n_alive[b, w] == 1:
                report_moments(trees[b, first], b, out, w)
            else:
                mean, cov, velocity = out[0][b, w], out[1][b, w], out[2][b, w]
                mix(state, b, w, mean, cov, velocity)
            report_rest(trees[b, first], state.views[b, first], b, s, out, w)


@kernel
def mix(state, b, w, mean, cov, velocity):
    """Moments of a mixture: mean, velocity (J, 3) and cov (J, 3, 3) of the positions."""
    trees, limit = state.trees, state.trees.shape[1] // state.n_alive.shape[1]
    first, n = w * limit, state.n_alive[b, w]
    mean[:], cov[:], velocity[:] = 0.0, 0.0, 0.0
    for k in range(first, first + n):
        tree = trees[b, k]
        share = math.exp(tree.log_weight)
        for j in range(len(mean)):
            for i in range(3):
                mean[j, i] += share * tree.body[j, i]
                velocity[j, i] += share * tree.body[j, 3 + i]
    for k in range(first, first + n):
        tree = trees[b, k]
        _add_moments(math.exp(tree.log_weight), tree.body, tree.cov, mean, cov)


@kernel
def _add_moments(share, body, cov, mean, out):
    for j in range(len(body)):
        for i in range(3):
            for k in range(3):
                apart = (body[j, i] - mean[j, i]) * (body[j, k] - mean[j, k])
                out[j, i, k] += share * (cov[j, i, k] + apart)
