"""A small network that knows how workers move: 15 joints now to 15 joints a moment later.

`assets/ahead/train.py` made it from the environment's own motions. It looks at one body in the
frame of that body's heading: joints about the middle of the torso, their velocities, the torso's
velocity and height, and how well each joint is known. It answers, for a few times ahead, with
each joint's displacement and the standard deviation of what it cannot know. Between these times
both are interpolated; at 0 they are 0.
"""

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats
from hrc_env.tracking.models.acquisition import heading
from hrc_env.worker.body import assets_dir

N_INPUTS = 7 * N_JOINTS + 4
_N_OUTPUTS = 4 * N_JOINTS
_TORSO = (1, 2, 7, 8)
_REORDER = {"reassoc", "contract", "nsz"}
Weights = NDArray[np.float32]


class Forecast(NamedTuple):
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
def load_forecast() -> Forecast:
    """The network that is shipped."""
    with np.load(assets_dir() / "ahead" / "ahead.npz") as stored:
        return Forecast(*(np.ascontiguousarray(stored[name]) for name in Forecast._fields))


@kernel(makes_arrays=True)
def describe(points, velocity, cov, log_std, out):
    """What the network looks at: out (N_INPUTS,) float32; cosine, sine of the heading, known.

    Args:
        points, velocity: (J, 3) [m], [m/s] in the world.
        cov: (J, 3, 3) [m^2].
        log_std: (2,) bounds, as in `Forecast`.
        out: filled with joints about the torso (J, 3), velocities about the torso's (J, 3), both
            forward, left, up; the torso's velocity (3,) and height; ln of deviations (J,).
    """
    cos, sin, known = heading(points)
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
def foresee(network, inputs, horizon, scratch, moved, rate, std):
    """The network's answer at `horizon` [s], interpolated between those that it knows.

    Args:
        network: a `Forecast`.
        inputs: (N_INPUTS,) from `describe`.
        horizon: in (0, the last of its horizons] [s].
        scratch: (n,), (m,), (60,), (60,) float32, as `make_scratch`.
        moved: (J, 3) filled with displacements in the body's frame [m].
        rate: (J, 3) filled with how fast they grow at that time [m/s].
        std: (J,) filled with deviations [m].
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
