"""Report: the mixture of a worker's hypotheses, as wide as one view needs it.

The motion model is that of people who walk and work. With one view, a person who spins, falls or
runs is farther from the estimate than the Gaussian has it: the depth of joints follows from how
the body is turned, and that is found late. `widening` is the factor on the covariance for it.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tracks import bound
from hrc_env.tracking.tree.predict import leaning
from hrc_env.tracking.tree.state import Hypotheses

_FORGOTTEN_UPDATES = 8
"""A camera that has not seen the worker for longer no longer counts as a view of them."""
LASTS_S = 0.7
"""Time constant of these means [s]."""
MOST_RAD_S = 15.0
"""No person turns faster."""
TURNS, TIPS, TRAVELS = (2.3, 1.1), (0.52, 5.0), (1.63, 1.1)
"""Rates up to which the model is right, and the logarithm of the factor on the covariance for every
unit above them [1/(rad/s)], [1/(m/s)]; fitted to people who walk, spin, fall, tumble and run."""
MOST_MOVING, MOST = 10.5, 25.0
"""Greatest factor for the movement, and together with that for a body that lies."""


@kernel(makes_arrays=True)
def estimate_all(state, s, out):
    """Fill the arrays of a `PoseEstimate` in; `state` and `s` as in `body_filter`."""
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


@kernel
def measure_pace(own):
    """Note how the heaviest hypothesis has moved since the last update."""
    pace = own.pace[0]
    update_pace(pace, own.trees[0].body, pace.since_s)
    pace.since_s = 0.0


@kernel
def update_pace(pace, body, dt):
    """Take the present body (J, 6), `dt` after the last one, into the means."""
    ax, ay = _across(body, 0), _across(body, 1)
    ux, uy, uz = _trunk(body, 0), _trunk(body, 1), _trunk(body, 2)
    flat, length = math.hypot(ax, ay) + 1e-9, math.sqrt(ux * ux + uy * uy + uz * uz) + 1e-9
    ax, ay, ux, uy, uz = ax / flat, ay / flat, ux / length, uy / length, uz / length
    if pace.known and dt > 0.0:
        turned = abs(
            math.atan2(
                pace.across[0] * ay - pace.across[1] * ax, pace.across[0] * ax + pace.across[1] * ay
            )
        )
        cosine = pace.up[0] * ux + pace.up[1] * uy + pace.up[2] * uz
        tipped = math.acos(min(max(cosine, -1.0), 1.0))
        keep = math.exp(-dt / LASTS_S)
        pace.turns = _mean(pace.turns, turned / dt, keep)
        pace.tips = _mean(pace.tips, tipped / dt, keep)
        speed = math.sqrt(_speed(body, 3) ** 2 + _speed(body, 4) ** 2 + _speed(body, 5) ** 2)
        pace.travels = _mean(pace.travels, speed, keep)
    pace.across[0], pace.across[1] = ax, ay
    pace.up[0], pace.up[1], pace.up[2] = ux, uy, uz
    pace.known = True


@kernel
def forget_pace(pace):
    """Begin with a worker anew."""
    pace.known, pace.since_s = False, 0.0
    pace.turns = pace.tips = pace.travels = 0.0


@kernel
def widening(pace):
    """The factor on the covariance of a worker whom one camera alone sees."""
    log = TURNS[1] * max(pace.turns - TURNS[0], 0.0)
    log += TIPS[1] * max(pace.tips - TIPS[0], 0.0)
    log += TRAVELS[1] * max(pace.travels - TRAVELS[0], 0.0)
    return min(math.exp(log), MOST_MOVING)


@kernel
def _mean(before, rate, keep):
    return keep * before + (1.0 - keep) * min(rate, MOST_RAD_S)


@kernel
def _across(body, i):
    return body[1, i] + body[7, i] - body[2, i] - body[8, i]


@kernel
def _trunk(body, i):
    return body[1, i] + body[2, i] - body[7, i] - body[8, i]


@kernel
def _speed(body, i):
    return 0.25 * (body[1, i] + body[2, i] + body[7, i] + body[8, i])
