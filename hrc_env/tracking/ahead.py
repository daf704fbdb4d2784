"""Where a worker will be, up to a second from now, if nobody looks.

`forecast` knows how workers move; what is known of a joint now and what cannot be known of its
future add up to the covariance. A body whose heading nobody knows goes on as it goes, with the
whole body's random acceleration; nobody's body relaxes to the prior. docs/tracking.md ("Ahead")
says how good this is and what it was compared with.
"""

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.kernels import kernel
from hrc_env.core.records import PoseEstimate
from hrc_env.core.typing import Floats, Ints
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.forecast import N_INPUTS, describe, foresee, load_forecast, make_scratch
from hrc_env.tracking.tracks import Tracks, relax, report

LONGEST_S = 1.0
"""No estimator looks further ahead [s]."""


def check_horizon(horizon_s: float) -> None:
    """See that a horizon is one.

    Raises:
        ConfigError: it is not in (0, 1] s.
    """
    if not 0 < horizon_s <= LONGEST_S:
        raise ConfigError(f"A horizon must be in (0, {LONGEST_S:g}] s, got {horizon_s}.")


def ahead(now: PoseEstimate, horizon_s: float, config: TrackerConfig) -> PoseEstimate:
    """What is expected of the workers in `horizon_s`, if no camera sees them until then.

    Args:
        now: what is believed now; not changed.
        horizon_s: in (0, 1] [s].
        config: settings of the estimator that said so.

    Returns:
        Means and covariances of the joints then; velocities then; ages grow with the horizon;
        who is tracked now is tracked.

    Raises:
        ConfigError: a horizon that is none.
    """
    check_horizon(horizon_s)
    later = Tracks(
        mean_world=now.mean_world.copy(),
        cov_world=now.cov_world.copy(),
        velocity_world=now.velocity_world.copy(),
        age_s=np.minimum(now.age_s + horizon_s, config.max_age_s),
        tracked=now.tracked,
        conflict=np.zeros(now.age_s.shape, np.int64),
    )
    _look_ahead(
        load_forecast(),
        later.mean_world,
        later.cov_world,
        later.velocity_world,
        later.tracked,
        horizon_s,
        config.root_acceleration * horizon_s**3 / 3,
        float(np.exp(-horizon_s / config.forget_s)),
        config.prior_mean_world,
        config.prior_std_m,
    )
    return report(later, config)


@kernel(makes_arrays=True)
def _look_ahead(
    network, mean, cov, velocity, tracked, horizon, unknown_heading, keep, home, home_std
):  # fmt: skip
    """Move every worker by `horizon` [s], in place; `unknown_heading` [m^2] as in `_go_on`."""
    n_joints = mean.shape[2]
    scratch, inputs = make_scratch(network), np.empty(N_INPUTS, np.float32)
    moved, rate, std = np.empty((n_joints, 3)), np.empty((n_joints, 3)), np.empty(n_joints)
    for b in range(mean.shape[0]):
        for w in range(mean.shape[1]):
            body = (mean[b, w], cov[b, w], velocity[b, w])
            if not tracked[b, w]:
                relax(*body, keep, home, home_std)
                continue
            cos, sin, known = describe(body[0], body[2], body[1], network.log_std, inputs)
            if not known:
                _go_on(*body, horizon, unknown_heading)
                continue
            foresee(network, inputs, horizon, scratch, moved, rate, std)
            _add(*body, cos, sin, moved, rate, std)


@kernel(makes_arrays=True)
def _go_on(mean, cov, velocity, horizon, variance):
    """Constant velocity, and `variance` [m^2] more."""
    for j in range(len(mean)):
        for i in range(3):
            mean[j, i] += horizon * velocity[j, i]
            cov[j, i, i] += variance


@kernel(makes_arrays=True)
def _add(mean, cov, velocity, cos, sin, moved, rate, std):
    """Displacements of the body's frame onto the body in the world."""
    for j in range(len(mean)):
        mean[j, 0] += cos * moved[j, 0] - sin * moved[j, 1]
        mean[j, 1] += sin * moved[j, 0] + cos * moved[j, 1]
        mean[j, 2] += moved[j, 2]
        velocity[j, 0] = cos * rate[j, 0] - sin * rate[j, 1]
        velocity[j, 1] = sin * rate[j, 0] + cos * rate[j, 1]
        velocity[j, 2] = rate[j, 2]
        for i in range(3):
            cov[j, i, i] += std[j] * std[j]


def mixed(later: PoseEstimate, log_weight: Floats, n_alive: Ints) -> PoseEstimate:
    """What several hypotheses about each worker expect together: moments of their mixture.

    Args:
        later: what each of them expects, (B, W H, J, ...); a worker's H columns side by side.
        log_weight: (B, W H) their log-probabilities.
        n_alive: (B, W) how many of a worker's columns count, the heaviest first.

    Returns:
        (B, W, J, ...); ages and tracks are the heaviest hypothesis's.
    """
    batch, n_workers = n_alive.shape
    n_slots = max(log_weight.shape[1] // max(n_workers, 1), 1)
    alive = np.arange(n_slots) < n_alive[..., None]
    share = np.where(alive, np.exp(log_weight.reshape(batch, n_workers, n_slots)), 0.0)
    share = (share / share.sum(-1, keepdims=True))[..., None, None]

    def split(array: Floats) -> Floats:
        whole = array.reshape(batch, n_workers, n_slots, *array.shape[2:])
        return np.where(alive.reshape(*alive.shape, *[1] * (array.ndim - 2)), whole, 0.0)

    each, best = split(later.mean_world), slice(None, None, n_slots)
    mean = (share * each).sum(2)
    apart = np.where(share > 0, each - mean[:, :, None], 0.0)
    spread = split(later.cov_world) + apart[..., :, None] * apart[..., None, :]
    return PoseEstimate(
        mean_world=mean,
        cov_world=(share[..., None] * spread).sum(2),
        velocity_world=(share * split(later.velocity_world)).sum(2),
        age_s=later.age_s[:, best].copy(),
        tracked=later.tracked[:, best].copy(),
    )
