"""The mixture that several hypotheses are: its settings, its mean and its covariance."""

import math
from typing import NamedTuple

from hrc_env.core.kernels import kernel
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.hypotheses.slots import Hypotheses
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tracks import bound

_LEAST_EVIDENCE = 0.01
"""A limb's other mode with less evidence than this share of the known one's is none."""
_MOST_PENALTY = 10.0
"""A turned body that is less likely than this is not tried [nat]."""
_DISTINCT, _CLOSE = 3.0, 2.0
"""Posterior deviations: a mode beyond the first is new, hypotheses within the second are one."""
_SEARCH_STEPS = 4
_FORGOTTEN_UPDATES = 8
"""A camera that has not seen the worker for longer no longer counts as a view of them."""
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
                _report_moments(trees[b, first], b, out, w)
            else:
                mean, cov, velocity = out[0][b, w], out[1][b, w], out[2][b, w]
                mix(state, b, w, mean, cov, velocity)
            _report_rest(trees[b, first], state.views[b, first], b, s, out, w)


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


@kernel
def _report_moments(tree, b, out, w):
    """Mean, velocity and covariance of a hypothesis, to be those of worker w."""
    mean, cov, velocity = out[0][b, w], out[1][b, w], out[2][b, w]
    for j in range(len(mean)):
        for i in range(3):
            mean[j, i], velocity[j, i] = tree.body[j, i], tree.body[j, 3 + i]
            for h in range(3):
                cov[j, i, h] = tree.cov[j, i, h]


@kernel
def _report_rest(tree, views, b, s, out, w):
    """Ages and the track of a hypothesis, and how certain worker w's joints are allowed to be.

    Of a worker whom one camera alone sees lately they are less certain: their errors have
    heavier tails than a Gaussian's.
    """
    cov, age, n_views = out[1][b, w], out[3][b, w], 0
    tracked = tree.tracked
    for c in range(len(views)):
        n_views += views[c].blind <= _FORGOTTEN_UPDATES
    factor = s.one_view_inflation if tracked and n_views == 1 else 1.0
    for j in range(len(cov)):
        age[j] = tree.age_s[j]
        for i in range(3):
            for h in range(3):
                cov[j, i, h] *= factor
    bound(cov, s.min_std_m, s.prior_std_m)
    out[4][b, w] = tracked
