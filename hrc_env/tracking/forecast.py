"""Where a worker will be, up to a second from now, if nobody looks.

A small network, made by `assets/ahead/train.py` from the environment's own motions, looks at one
body in the frame of its heading. For a few horizons it says each joint's displacement and the
standard deviation of what it cannot know, which is added to what is not known now. A body whose
heading is unknown moves on with constant velocity and random acceleration; one that is not tracked
relaxes to the prior (docs/tracking.md, "Forecast").
"""

import functools
import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.batching import mapped
from hrc_env.core.errors import ConfigError
from hrc_env.core.kernels import kernel
from hrc_env.core.records import PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Ints
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.tracks import bounded, relax
from hrc_env.tracking.tree.evidence import find_heading
from hrc_env.worker.body import assets_dir

LONGEST_S = 1.0
"""No estimator looks further ahead [s]."""
N_INPUTS = 7 * N_JOINTS + 4
_N_OUTPUTS = 4 * N_JOINTS
_TORSO = (1, 2, 7, 8)
_REORDER = {"reassoc", "contract", "nsz"}
Weights = NDArray[np.float32]


class ForecastNetwork(NamedTuple):
    """The network: two hidden layers of rectified units, (in, out) matrices in float32."""

    horizons_s: Floats
    """(H,) times ahead that it was trained for, ascending [s]."""
    weight_1: Weights
    """(N_INPUTS, n), inputs in metres, seconds and logarithms: their scales are in here."""
    bias_1: Weights
    weight_2: Weights
    """(n, m)."""
    bias_2: Weights
    weight_3: Weights
    """(H, m, 60): displacements (J, 3) [m] in the body's frame, then ln of (J,) deviations [m]."""
    bias_3: Weights
    """(H, 60)."""
    log_std: Floats
    """(2,) least and largest ln of a joint's standard deviation [m] that it has seen."""


@functools.cache
def load_network() -> ForecastNetwork:
    """The network that is shipped."""
    with np.load(assets_dir() / "ahead" / "ahead.npz") as stored:
        return ForecastNetwork(
            *(np.ascontiguousarray(stored[name]) for name in ForecastNetwork._fields)
        )


@kernel(makes_arrays=True)
def describe(points, velocity, cov, log_std, out):
    """What the network looks at: out (N_INPUTS,) float32; cosine, sine of the heading, known.

    Joints about the torso (J, 3), velocities about the torso's (J, 3), both forward, left, up; the
    torso's velocity (3,) and height; ln of the joints' deviations (J,) within the bounds `log_std`.
    """
    cos, sin, known = find_heading(points)
    root, speed = np.zeros(3), np.zeros(3)
    for j in _TORSO:
        for i in range(3):
            root[i] += 0.25 * points[j, i]
            speed[i] += 0.25 * velocity[j, i]
    at = 0
    for values, middle in ((points, root), (velocity, speed)):
        for j in range(len(points)):
            x, y = values[j, 0] - middle[0], values[j, 1] - middle[1]
            out[at] = cos * x + sin * y
            out[at + 1] = cos * y - sin * x
            out[at + 2] = values[j, 2] - middle[2]
            at += 3
    out[at] = cos * speed[0] + sin * speed[1]
    out[at + 1] = cos * speed[1] - sin * speed[0]
    out[at + 2] = speed[2]
    out[at + 3] = root[2]
    for j in range(len(points)):
        variance = (cov[j, 0, 0] + cov[j, 1, 1] + cov[j, 2, 2]) / 3.0
        out[at + 4 + j] = min(max(0.5 * math.log(variance), log_std[0]), log_std[1])
    return cos, sin, known


@kernel(makes_arrays=True, fastmath=_REORDER)
def _layer(inputs, weight, bias, out):
    """out = bias + inputs weight."""
    for k in range(len(out)):
        out[k] = bias[k]
    for i in range(len(inputs)):
        value = inputs[i]
        for k in range(len(out)):
            out[k] += value * weight[i, k]


@kernel(makes_arrays=True)
def _hidden(inputs, weight, bias, out):
    _layer(inputs, weight, bias, out)
    for k in range(len(out)):
        out[k] = max(out[k], np.float32(0.0))


@kernel(makes_arrays=True)
def run_network(network, inputs, horizon, scratch, moved, rate, std):
    """The network's answer at `horizon` [s], interpolated between those that it knows.

    `inputs` are from `describe`, `scratch` from `make_scratch`. Fills displacements in the body's
    frame moved (J, 3) [m], how fast they grow rate (J, 3) [m/s], and deviations std (J,) [m].
    """
    first, second, before, after = scratch
    _hidden(inputs, network.weight_1, network.bias_1, first)
    _hidden(first, network.weight_2, network.bias_2, second)
    k = 0
    while k < len(network.horizons_s) - 1 and network.horizons_s[k] < horizon:
        k += 1
    begin = network.horizons_s[k - 1] if k > 0 else 0.0
    length = network.horizons_s[k] - begin
    share = (horizon - begin) / length
    _layer(second, network.weight_3[k], network.bias_3[k], after)
    if k > 0:
        _layer(second, network.weight_3[k - 1], network.bias_3[k - 1], before)
    for j in range(N_JOINTS):
        for i in range(3):
            last = before[3 * j + i] if k > 0 else 0.0
            rate[j, i] = (after[3 * j + i] - last) / length
            moved[j, i] = last + share * (after[3 * j + i] - last)
        last = math.exp(before[3 * N_JOINTS + j]) if k > 0 else 0.0
        std[j] = last + share * (math.exp(after[3 * N_JOINTS + j]) - last)


@kernel(makes_arrays=True)
def make_scratch(network):
    """Room for one body's layers."""
    first = np.empty(network.weight_1.shape[1], np.float32)
    second = np.empty(network.weight_2.shape[1], np.float32)
    return first, second, np.empty(_N_OUTPUTS, np.float32), np.empty(_N_OUTPUTS, np.float32)


def forecast(now: PoseEstimate, horizon_s: float, config: TrackerConfig) -> PoseEstimate:
    """Return what is expected of the workers in a while, if no camera sees them until then.

    Args:
        now: what is believed of them, in the world; it stays as it is.
        horizon_s: how long from now, in (0, 1] [s].
        config: settings of the estimator that said so: the prior, to which a worker without a track
            relaxes, and the bounds of what is reported.

    Returns:
        Arrays of its own of the shapes of `now`: means [m], velocities [m/s] and covariances [m^2]
        at that time, and ages that have grown by the horizon. Who is tracked stays tracked.

    Raises:
        ConfigError: `horizon_s` is not in (0, 1].
    """
    if not 0 < horizon_s <= LONGEST_S:
        raise ConfigError(f"A horizon must be in (0, {LONGEST_S:g}] s, got {horizon_s}.")
    age_s = np.minimum(now.age_s + horizon_s, config.max_age_s)
    later = replace(mapped(now, lambda array: array.copy()), age_s=age_s)
    workers = (later.mean_world, later.cov_world, later.velocity_world, later.tracked)
    unknown_heading = config.root_acceleration * horizon_s**3 / 3
    keep = float(np.exp(-horizon_s / config.forget_s))
    prior = (keep, config.prior_mean_world, config.prior_std_m)
    _forecast(load_network(), workers, horizon_s, unknown_heading, prior)
    return bounded(later, config)


def mixed(later: PoseEstimate, log_weight: Floats, n_alive: Ints) -> PoseEstimate:
    """What several hypotheses about each worker expect together: moments of their mixture.

    Args:
        later: what each of them expects, (B, W H, J, ...); a worker's H columns side by side.
        log_weight: (B, W, H) their log-probabilities.
        n_alive: (B, W) how many of a worker's columns count, the heaviest first.

    Returns:
        (B, W, J, ...); ages and tracks are the heaviest hypothesis's.
    """
    alive = np.arange(log_weight.shape[2]) < n_alive[..., None]
    share = np.where(alive, np.exp(log_weight), 0.0)
    share = (share / share.sum(-1, keepdims=True))[..., None, None]

    def split(array: Floats) -> Floats:
        whole = array.reshape(*alive.shape, *array.shape[2:])
        return np.where(alive.reshape(*alive.shape, *[1] * (array.ndim - 2)), whole, 0.0)

    each, best = split(later.mean_world), slice(None, None, log_weight.shape[2])
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


@kernel(makes_arrays=True)
def _forecast(network, workers, horizon, unknown_heading, prior):
    """Move every worker (mean, cov, velocity, tracked) by `horizon` [s], in place.

    `unknown_heading` [m^2] is as in `_go_on`, `prior` the last arguments of `relax`.
    """
    mean, cov, velocity, tracked = workers
    scratch, inputs = make_scratch(network), np.empty(N_INPUTS, np.float32)
    moved, rate, std = np.empty((N_JOINTS, 3)), np.empty((N_JOINTS, 3)), np.empty(N_JOINTS)
    for b in range(mean.shape[0]):
        for w in range(mean.shape[1]):
            body = (mean[b, w], cov[b, w], velocity[b, w])
            if not tracked[b, w]:
                relax(*body, *prior)
                continue
            cos, sin, known = describe(body[0], body[2], body[1], network.log_std, inputs)
            if not known:
                _go_on(*body, horizon, unknown_heading)
                continue
            run_network(network, inputs, horizon, scratch, moved, rate, std)
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
