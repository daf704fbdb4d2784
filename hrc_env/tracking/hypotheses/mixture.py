"""The mixture that several hypotheses are: its mean and its covariance."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.tracking.hypotheses.pace import MOST, widening
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tracks import bound
from hrc_env.tracking.tree.predict import leaning
from hrc_env.tracking.tree.state import Hypotheses

_FORGOTTEN_UPDATES = 8
"""A camera that has not seen the worker for longer no longer counts as a view of them."""


@kernel(makes_arrays=True)
def estimate_all(state, s, out):
    """Fill the arrays of a `PoseEstimate` in; `state` and `s` as in `hypotheses.filter`."""
    state, s = Hypotheses(*state), Settings(*s)
    mean, cov, velocity, age, tracked = out
    for b in range(state.n_alive.shape[0]):
        for w in range(state.n_alive.shape[1]):
            trees, best = state.trees[b, w], state.trees[b, w, 0]
            _mix(trees, state.n_alive[b, w], mean[b, w], cov[b, w], velocity[b, w])
            n_views = 0
            for c in range(state.views.shape[3]):
                n_views += state.views[b, w, 0, c].blind <= _FORGOTTEN_UPDATES
            if best.tracked and n_views == 1:  # the errors have heavier tails than a Gaussian's
                lies, _ = leaning(mean[b, w])
                moves = min(s.lying_inflation**lies * widening(state.pace[b, w]), MOST)
                _widen(cov[b, w], s.one_view_inflation * moves)
            bound(cov[b, w], s.min_std_m, s.prior_std_m)
            for j in range(age.shape[2]):
                age[b, w, j] = best.age_s[j]
            tracked[b, w] = best.tracked


@kernel
def _mix(trees, n, mean, cov, velocity):
    """Moments of the first n trees: mean, velocity (J, 3) and cov (J, 3, 3) of the positions."""
    mean[:], cov[:], velocity[:] = 0.0, 0.0, 0.0
    for k in range(n):
        body, share = trees[k].body, math.exp(trees[k].log_weight)
        for j in range(len(mean)):
            for i in range(3):
                mean[j, i] += share * body[j, i]
                velocity[j, i] += share * body[j, 3 + i]
    for k in range(n):
        _add_moments(math.exp(trees[k].log_weight), trees[k].body, trees[k].cov, mean, cov)


@kernel
def _add_moments(share, body, cov, mean, out):
    for j in range(len(body)):
        for i in range(3):
            for k in range(3):
                apart = (body[j, i] - mean[j, i]) * (body[j, k] - mean[j, k])
                out[j, i, k] += share * (cov[j, i, k] + apart)


@kernel
def _widen(cov, factor):
    for j in range(len(cov)):
        for i in range(3):
            for k in range(3):
                cov[j, i, k] *= factor
