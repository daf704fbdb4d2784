"""Forecasts of the workers up to one second ahead, without further measurements.

A small network, trained by `assets/ahead/train.py` on the environment's motions, receives one body
in the frame of its heading. For a few horizons, it predicts the displacement of each joint and the
standard deviation of the prediction error, which is added to the current uncertainty. A body of
unknown heading moves with constant velocity and random acceleration; a body that is not tracked
relaxes to the prior (docs/tracking.md, "Forecast").
"""

import functools
import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hrc_env.core.batching import map_arrays
from hrc_env.core.errors import ConfigError
from hrc_env.core.kernels import kernel
from hrc_env.core.records import PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Covariances3, Floats, Ints, Points3, Tensor, Velocities3
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.tracks import EstimateArrays, bound_estimate, relax
from hrc_env.tracking.tree.evidence import Heading, find_heading
from hrc_env.worker.body import assets_dir

LONGEST_S = 1.0
"""Maximum horizon of a forecast [s]."""
N_INPUTS = 7 * N_JOINTS + 4
"""Number of the network's inputs; see `describe`."""
_N_OUTPUTS = 4 * N_JOINTS
"""Number of the network's outputs for one horizon: displacements and log standard deviations."""
_TORSO = (1, 2, 7, 8)
"""Indices of the joints of the torso: shoulders and hips."""
_REORDER = {"reassoc", "contract", "nsz"}


class ForecastNetwork(NamedTuple):
    """Weights of a network with two hidden layers of n and m ReLU units, in float32."""

    horizons_s: Floats
    """(H,) horizons for which the network was trained, in ascending order [s]."""
    weight_1: Tensor
    """(N_INPUTS, n) weights of the first hidden layer, which include the scaling of the inputs."""
    bias_1: Tensor
    """(n,) biases of the first hidden layer."""
    weight_2: Tensor
    """(n, m) weights of the second hidden layer."""
    bias_2: Tensor
    """(m,) biases of the second hidden layer."""
    weight_3: Tensor
    """(H, m, 60) weights of the output layer for each horizon. The outputs are the displacements
    (J, 3) in the body's frame [m], followed by the logarithms of their standard deviations (J,)
    [m]."""
    bias_3: Tensor
    """(H, 60) biases of the output layer for each horizon."""
    log_std: Floats
    """(2,) smallest and largest logarithm of a joint's standard deviation in the training data
    [m]."""


class Scratch(NamedTuple):
    """Activations of the network for one body."""

    inputs: Tensor
    """(N_INPUTS,) inputs of the network."""
    first: Tensor
    """(n,) activations of the first hidden layer."""
    second: Tensor
    """(m,) activations of the second hidden layer."""
    before: Tensor
    """(60,) outputs for the last trained horizon that is shorter than the requested one."""
    after: Tensor
    """(60,) outputs for the first trained horizon that is not shorter than the requested one."""


class Motion(NamedTuple):
    """The predicted motion of one body in the frame of its heading."""

    moved: Points3
    """(J, 3) displacements of the joints [m]."""
    rate: Velocities3
    """(J, 3) velocities of the joints at the end of the motion [m/s]."""
    std: Floats
    """(J,) standard deviations of the displacements [m]."""


class Drift(NamedTuple):
    """Parameters of the motion of bodies without a heading or without a track."""

    heading_m2: float
    """Variance added on each axis to a tracked body of unknown heading [m^2]."""
    keep: float
    """Fraction of the deviation from the prior that remains for a body without a track."""
    prior_mean: tuple[float, float, float]
    """Mean of the prior position [m]."""
    prior_std: float
    """Standard deviation of the prior on each axis [m]."""


@functools.cache
def load_network() -> ForecastNetwork:
    """Return the network that is shipped with the package."""
    with np.load(assets_dir() / "ahead" / "ahead.npz") as stored:
        return ForecastNetwork(
            *(np.ascontiguousarray(stored[name]) for name in ForecastNetwork._fields)
        )


@kernel(makes_arrays=True)
def describe(
    points: Points3, velocity: Velocities3, cov: Covariances3, log_std: Floats, out: Tensor
) -> Heading:
    """Compute the network's inputs for one body and return its heading.

    The inputs are, in the frame of the heading (forward, left, up): the joints (J, 3) relative to
    the centre of the torso, their velocities (J, 3) relative to that of the torso, the torso's
    velocity (3,) and height, and the logarithms of the joints' standard deviations (J,).

    Args:
        points: (J, 3) joints in the world frame [m].
        velocity: (J, 3) velocities of the joints [m/s].
        cov: (J, 3, 3) covariances of the joints' positions [m^2].
        log_std: (2,) bounds of the logarithms of standard deviations.
        out: (N_INPUTS,) inputs, filled in.
    """
    heading = find_heading(points)
    cos, sin = heading.cos, heading.sin
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
    return heading


@kernel(makes_arrays=True, fastmath=_REORDER)
def _apply_layer(inputs: Tensor, weight: Tensor, bias: Tensor, out: Tensor) -> None:
    """Compute a linear layer, out = bias + inputs @ weight."""
    for k in range(len(out)):
        out[k] = bias[k]
    for i in range(len(inputs)):
        value = inputs[i]
        for k in range(len(out)):
            out[k] += value * weight[i, k]


@kernel(makes_arrays=True)
def _apply_hidden_layer(inputs: Tensor, weight: Tensor, bias: Tensor, out: Tensor) -> None:
    """Compute a hidden layer, out = max(bias + inputs @ weight, 0)."""
    _apply_layer(inputs, weight, bias, out)
    for k in range(len(out)):
        out[k] = max(out[k], np.float32(0.0))


@kernel(makes_arrays=True)
def run_network(network: ForecastNetwork, horizon: float, scratch: Scratch, motion: Motion) -> None:
    """Predict the motion of a body, interpolated between the trained horizons.

    Args:
        network: the network.
        horizon: time ahead [s].
        scratch: activations, of which `describe` has filled in the inputs.
        motion: the motion, filled in.
    """
    second, before, after = scratch.second, scratch.before, scratch.after
    moved, rate, std = motion.moved, motion.rate, motion.std
    _apply_hidden_layer(scratch.inputs, network.weight_1, network.bias_1, scratch.first)
    _apply_hidden_layer(scratch.first, network.weight_2, network.bias_2, second)
    k = 0
    while k < len(network.horizons_s) - 1 and network.horizons_s[k] < horizon:
        k += 1
    begin = network.horizons_s[k - 1] if k > 0 else 0.0
    length = network.horizons_s[k] - begin
    share = (horizon - begin) / length
    _apply_layer(second, network.weight_3[k], network.bias_3[k], after)
    if k > 0:
        _apply_layer(second, network.weight_3[k - 1], network.bias_3[k - 1], before)
    for j in range(N_JOINTS):
        for i in range(3):
            last = before[3 * j + i] if k > 0 else 0.0
            rate[j, i] = (after[3 * j + i] - last) / length
            moved[j, i] = last + share * (after[3 * j + i] - last)
        last = math.exp(before[3 * N_JOINTS + j]) if k > 0 else 0.0
        std[j] = last + share * (math.exp(after[3 * N_JOINTS + j]) - last)


@kernel(makes_arrays=True)
def make_scratch(network: ForecastNetwork) -> Scratch:
    """Return empty arrays for the activations of one body."""
    return Scratch(
        inputs=np.empty(N_INPUTS, np.float32),
        first=np.empty(network.weight_1.shape[1], np.float32),
        second=np.empty(network.weight_2.shape[1], np.float32),
        before=np.empty(_N_OUTPUTS, np.float32),
        after=np.empty(_N_OUTPUTS, np.float32),
    )


def forecast(now: PoseEstimate, horizon_s: float, config: TrackerConfig) -> PoseEstimate:
    """Return the estimate expected after an interval without measurements.

    Args:
        now: current estimate in the world frame; it is not changed.
        horizon_s: time ahead, in (0, 1] [s].
        config: settings of the estimator. They contain the prior, to which workers without a track
            relax, and the bounds of the reported covariances.

    Returns:
        New arrays with the shapes of `now`: means [m], velocities [m/s] and covariances [m^2] at
        that time, and ages increased by the horizon, up to `max_age_s`. Tracked workers stay
        tracked.

    Raises:
        ConfigError: `horizon_s` is not in (0, 1].
    """
    if not 0 < horizon_s <= LONGEST_S:
        raise ConfigError(f"A horizon must be in (0, {LONGEST_S:g}] s, got {horizon_s}.")
    age_s = np.minimum(now.age_s + horizon_s, config.max_age_s)
    later = replace(map_arrays(now, lambda array: array.copy()), age_s=age_s)
    workers = EstimateArrays(*(getattr(later, name) for name in EstimateArrays._fields))
    drift = Drift(
        heading_m2=config.root_acceleration * horizon_s**3 / 3,
        keep=float(np.exp(-horizon_s / config.lost_relaxation_s)),
        prior_mean=config.prior_mean_world,
        prior_std=config.prior_std_m,
    )
    _move_workers(load_network(), workers, horizon_s, drift)
    return bound_estimate(later, config)


def mix_hypotheses(later: PoseEstimate, log_weight: Floats, n_alive: Ints) -> PoseEstimate:
    """Return the moments of the mixture of several forecasts for each worker.

    Args:
        later: (B, W * H, J, ...) forecasts for the H hypotheses about each worker.
        log_weight: (B, W, H) log-probabilities of the hypotheses.
        n_alive: (B, W) number of hypotheses in use about each worker; the heaviest is the first.

    Returns:
        The estimate (B, W, J, ...), with `age_s` and `tracked` of the heaviest hypothesis.
    """
    alive = np.arange(log_weight.shape[2], dtype=np.int64) < n_alive[..., None]
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
def _move_workers(
    network: ForecastNetwork, workers: EstimateArrays, horizon: float, drift: Drift
) -> None:
    """Move every worker by `horizon` [s], in place.

    Args:
        network: the network.
        workers: (B, W, ...) current estimate, changed in place except for its ages.
        horizon: time ahead [s].
        drift: the motion of bodies to which the network does not apply.
    """
    tracked, scratch = workers.tracked, make_scratch(network)
    motion = Motion(np.empty((N_JOINTS, 3)), np.empty((N_JOINTS, 3)), np.empty(N_JOINTS))
    for b in range(tracked.shape[0]):
        for w in range(tracked.shape[1]):
            mean, cov = workers.mean_world[b, w], workers.cov_world[b, w]
            velocity = workers.velocity_world[b, w]
            if not tracked[b, w]:
                relax(mean, cov, velocity, drift.keep, drift.prior_mean, drift.prior_std)
                continue
            heading = describe(mean, velocity, cov, network.log_std, scratch.inputs)
            if not heading.is_known:
                for j in range(len(mean)):  # constant velocity
                    for i in range(3):
                        mean[j, i] += horizon * velocity[j, i]
                        cov[j, i, i] += drift.heading_m2
                continue
            run_network(network, horizon, scratch, motion)
            _apply_motion(mean, cov, velocity, heading, motion)


@kernel(makes_arrays=True)
def _apply_motion(
    mean: Points3, cov: Covariances3, velocity: Velocities3, heading: Heading, motion: Motion
) -> None:
    """Apply a motion, given in the frame of the heading, to a body in the world frame, in place.

    Args:
        mean: (J, 3) joints [m].
        cov: (J, 3, 3) covariances of the joints' positions [m^2].
        velocity: (J, 3) velocities of the joints [m/s].
        heading: direction in which the body faces.
        motion: the predicted motion.
    """
    cos, sin, moved, rate, std = heading.cos, heading.sin, motion.moved, motion.rate, motion.std
    for j in range(len(mean)):
        mean[j, 0] += cos * moved[j, 0] - sin * moved[j, 1]
        mean[j, 1] += sin * moved[j, 0] + cos * moved[j, 1]
        mean[j, 2] += moved[j, 2]
        velocity[j, 0] = cos * rate[j, 0] - sin * rate[j, 1]
        velocity[j, 1] = sin * rate[j, 0] + cos * rate[j, 1]
        velocity[j, 2] = rate[j, 2]
        for i in range(3):
            cov[j, i, i] += std[j] * std[j]
