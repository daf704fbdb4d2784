"""Moments of the mixture of a worker's hypotheses, with covariances increased for single views.

The motion model describes people who walk and work. With one view, the errors for a person that
spins, falls or runs exceed the Gaussian's standard deviations, because the depths of joints follow
from the orientation of the body, and fast changes of orientation are recognised late.
`find_pace_factor` returns the factor on the covariance that accounts for this.
"""

import math
from typing import NamedTuple

from hrc_env.core.declared import Records1
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tracks import EstimateArrays, bound
from hrc_env.tracking.tree.predict import measure_lean, measure_torso, measure_trunk
from hrc_env.tracking.tree.state import Hypotheses, Pace, Tree, WorkerHypotheses

_FORGOTTEN_UPDATES = 8
"""Number of updates without a detection of the worker after which a camera no longer counts as a
view."""
_TAU_S = 0.7
"""Time constant of the averages in `Pace` [s]."""
_MOST_RATE = 15.0
"""Upper bound of every rate [rad/s] or [m/s]. No person exceeds it."""


class Excess(NamedTuple):
    """Dependence of the covariance on a rate that exceeds the range of the motion model."""

    limit: float
    """Rate up to which the motion model is valid [rad/s] or [m/s]."""
    log_factor: float
    """Logarithm of the factor on the covariance per unit above the limit [s/rad] or [s/m]."""


_TURN = Excess(2.3, 1.1)
"""Parameters for rotation about the vertical. Like `_TIP` and `_SPEED`, they were fitted to people
walking, spinning, falling, tumbling and running."""
_TIP = Excess(0.52, 5.0)
"""Parameters for the rate at which the trunk tilts."""
_SPEED = Excess(1.63, 1.1)
"""Parameters for the speed of the trunk."""
MOST_MOVING = 10.5
"""Upper bound of the factor on the covariance for movement."""
_MOST = 25.0
"""Upper bound of the combined factor on the covariance for movement and a lying body."""


@kernel(makes_arrays=True)
def estimate_all(state: Hypotheses, settings: Settings, out: EstimateArrays) -> bool:
    """Compute the estimates of all workers, and return whether a body may be displaced as a whole.

    Args:
        state: the hypotheses.
        settings: settings of the estimator.
        out: arrays of the estimates, filled in.
    """
    is_displaced = False
    for b in range(state.n_alive.shape[0]):
        for w in range(state.n_alive.shape[1]):
            trees, best = state.trees[b, w], state.trees[b, w, 0]
            mean, cov = out.mean_world[b, w], out.cov_world[b, w]
            _mix(trees, state.n_alive[b, w], mean, cov, out.velocity_world[b, w])
            n_views = 0
            for c in range(state.views.shape[3]):
                n_views += state.views[b, w, 0, c].unseen_updates <= _FORGOTTEN_UPDATES
            if best.tracked and n_views == 1:  # the errors have heavier tails than a Gaussian's
                lying_factor = settings.lying_inflation ** measure_lean(mean).share
                factor = min(lying_factor * find_pace_factor(state.pace[b, w]), _MOST)
                factor *= settings.one_view_inflation
                for j in range(len(cov)):
                    for i in range(3):
                        for k in range(3):
                            cov[j, i, k] *= factor
            bound(cov, settings.min_std_m, settings.prior_std_m)
            for j in range(out.age_s.shape[2]):
                out.age_s[b, w, j] = best.age_s[j]
            out.tracked[b, w] = best.tracked
            has_error = best.size_std != 0.0 or best.pair.is_misaligned
            is_displaced = is_displaced or (best.tracked and has_error)
    return is_displaced


@kernel
def _mix(trees: Records1[Tree], n: int, mean: Floats, cov: Floats, velocity: Floats) -> None:
    """Compute the moments of the mixture of a worker's hypotheses.

    Args:
        trees: (H,) hypotheses about one worker.
        n: number of hypotheses in use.
        mean: (J, 3) mean positions [m], filled in.
        cov: (J, 3, 3) covariances of the positions [m^2], filled in.
        velocity: (J, 3) mean velocities [m/s], filled in.
    """
    mean[:], cov[:], velocity[:] = 0.0, 0.0, 0.0
    for h in range(n):
        body, share = trees[h].body, math.exp(trees[h].log_weight)
        for j in range(len(mean)):
            for i in range(3):
                mean[j, i] += share * body[j, i]
                velocity[j, i] += share * body[j, 3 + i]
    for h in range(n):
        body, share = trees[h].body, math.exp(trees[h].log_weight)
        for j in range(len(mean)):
            for i in range(3):
                for k in range(3):
                    between = (body[j, i] - mean[j, i]) * (body[j, k] - mean[j, k])
                    cov[j, i, k] += share * (trees[h].cov[j, i, k] + between)


@kernel
def measure_pace(worker: WorkerHypotheses) -> None:
    """Update a worker's pace from the motion of the heaviest hypothesis since the last update."""
    pace = worker.pace[0]
    update_pace(pace, worker.trees[0].body, pace.since_s)
    pace.since_s = 0.0


@kernel
def update_pace(pace: Pace, body: Floats, dt: float) -> None:
    """Update the averages of a pace with a body (J, 6), `dt` [s] after the last update."""
    ax, ay = _measure_width(body, 0), _measure_width(body, 1)
    ux, uy, uz = measure_trunk(body, 0), measure_trunk(body, 1), measure_trunk(body, 2)
    flat, length = math.hypot(ax, ay) + 1e-9, math.sqrt(ux * ux + uy * uy + uz * uz) + 1e-9
    ax, ay, ux, uy, uz = ax / flat, ay / flat, ux / length, uy / length, uz / length
    if pace.is_known and dt > 0.0:
        sine = pace.across[0] * ay - pace.across[1] * ax
        turn = abs(math.atan2(sine, pace.across[0] * ax + pace.across[1] * ay))
        cosine = pace.up[0] * ux + pace.up[1] * uy + pace.up[2] * uz
        tip = math.acos(min(max(cosine, -1.0), 1.0))
        vx, vy, vz = measure_torso(body, 3), measure_torso(body, 4), measure_torso(body, 5)
        keep = math.exp(-dt / _TAU_S)
        pace.turn_rad_s = _fade(pace.turn_rad_s, turn / dt, keep)
        pace.tip_rad_s = _fade(pace.tip_rad_s, tip / dt, keep)
        speed = math.sqrt(vx**2 + vy**2 + vz**2)
        pace.speed_m_s = _fade(pace.speed_m_s, speed, keep)
    pace.across[0], pace.across[1] = ax, ay
    pace.up[0], pace.up[1], pace.up[2] = ux, uy, uz
    pace.is_known = True


@kernel
def forget_pace(pace: Pace) -> None:
    """Reset a pace to its state at the start of a track."""
    pace.is_known, pace.since_s = False, 0.0
    pace.turn_rad_s = pace.tip_rad_s = pace.speed_m_s = 0.0


@kernel
def find_pace_factor(pace: Pace) -> float:
    """Return the factor on the covariance in a single view for the movement of a worker."""
    log_factor = _TURN.log_factor * max(pace.turn_rad_s - _TURN.limit, 0.0)
    log_factor += _TIP.log_factor * max(pace.tip_rad_s - _TIP.limit, 0.0)
    log_factor += _SPEED.log_factor * max(pace.speed_m_s - _SPEED.limit, 0.0)
    return min(math.exp(log_factor), MOST_MOVING)


@kernel
def _fade(mean: float, rate: float, keep: float) -> float:
    """Return an exponential moving average updated with a rate, which has the weight 1 - `keep`."""
    return keep * mean + (1.0 - keep) * min(rate, _MOST_RATE)


@kernel
def _measure_width(body: Floats, i: int) -> float:
    """Return component `i` of the sum of the right-to-left vectors of shoulders and hips."""
    return body[1, i] + body[7, i] - body[2, i] - body[8, i]
