"""One joint's posterior by importance sampling from near its mode.

Particles are drawn about the mode and, as a defence, from the prior (Hesterberg, 1995), and
weighted exactly. They are float32 and relative to the mode, which keeps their arithmetic
exact enough and lets it run in vector registers.
"""

import math

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.kernels import kernel

_f = np.float32
_LOG2_E, _LN_2 = np.float32(math.log2(math.e)), np.float32(math.log(2.0))
_LEAST_LOG = np.float32(-60.0)
_LEAST_WEIGHT = np.float32(1e-12)
_REORDER = {"reassoc", "contract", "nsz"}  # lets sums vectorise; NaN and infinity keep meaning


def make_noise(n_tables: int, n_mode: int, n_prior: int) -> NDArray[np.float32]:
    """(n_tables, 3, n_mode + n_prior) float32 standard normal draws, a constant of the package.

    Both parts of a table are antithetic and have exactly unit covariance, so that the sampling
    noise in means and covariances is that of the weights alone.
    """
    rng = np.random.default_rng(20110717)
    parts = []
    for n in (n_mode, n_prior):
        half = rng.standard_normal((n_tables, 3, n // 2))
        draws = np.concatenate([half, -half], -1)
        root = np.linalg.cholesky(draws @ draws.swapaxes(-1, -2) / draws.shape[-1])
        parts.append(np.linalg.solve(root, draws))
    return np.concatenate(parts, -1).astype(np.float32)


@kernel(makes_arrays=True)
def cholesky3(a, out):
    """Lower Cholesky factor of a positive definite 3x3 matrix; False if it is not."""
    out[0, 0] = math.sqrt(a[0, 0])
    out[1, 0], out[2, 0] = a[1, 0] / out[0, 0], a[2, 0] / out[0, 0]
    out[1, 1] = math.sqrt(a[1, 1] - out[1, 0] ** 2)
    out[2, 1] = (a[2, 1] - out[2, 0] * out[1, 0]) / out[1, 1]
    out[2, 2] = math.sqrt(a[2, 2] - out[2, 0] ** 2 - out[2, 1] ** 2)
    out[0, 1] = out[0, 2] = out[1, 2] = 0.0
    return out[0, 0] > 0 and out[1, 1] > 0 and out[2, 2] > 0


@kernel(makes_arrays=True, fastmath=_REORDER)
def exp_of_negative(x, out, out_bits):
    """out = exp(x) for float32 x <= 0; `out_bits` is `out` seen as int32. Vectorises.

    Two loops, for the powers of two and for the polynomial; under 1e-5 relative error. Below
    -60 the result is that of -60: nothing to any weight, and products of it stay clear of
    denormal numbers, which are a hundred times slower.
    """
    for m in range(len(x)):
        y = max(x[m], _LEAST_LOG) * _LOG2_E
        n = np.floor(y + _f(0.5))
        r = (y - n) * _LN_2
        series = _f(1 / 720) * r + _f(1 / 120)
        series = series * r + _f(1 / 24)
        series = series * r + _f(1 / 6)
        series = series * r + _f(0.5)
        series = series * r + _f(1.0)
        x[m] = series * r + _f(1.0)
        out_bits[m] = (np.int32(n) + np.int32(127)) << np.int32(23)
    for m in range(len(x)):
        out[m] *= x[m]


@kernel(makes_arrays=True, fastmath=_REORDER)
def draw(noise, root_mode, root_prior, shift, n_mode, particles):
    """Particles (3, M) about the mode: the first n_mode from it, the rest from the prior.

    `shift` (3,) leads from the mode to the prior's mean.
    """
    for part in range(2):
        root = root_mode if part == 0 else root_prior
        l00, l10, l11 = _f(root[0, 0]), _f(root[1, 0]), _f(root[1, 1])
        l20, l21, l22 = _f(root[2, 0]), _f(root[2, 1]), _f(root[2, 2])
        x = _f(shift[0] * part)
        y = _f(shift[1] * part)
        z = _f(shift[2] * part)
        begin, end = (0, n_mode) if part == 0 else (n_mode, noise.shape[1])
        for m in range(begin, end):
            a, b, c = noise[0, m], noise[1, m], noise[2, m]
            particles[0, m] = x + l00 * a
            particles[1, m] = y + l10 * a + l11 * b
            particles[2, m] = z + l20 * a + l21 * b + l22 * c


@kernel(makes_arrays=True, fastmath=_REORDER)
def weigh_proposal(particles, root_mode, root_prior, shift, share_mode, weights, work, bits):
    """weights = prior / proposal, where the proposal mixes both Gaussians."""
    volume = root_mode[0, 0] * root_mode[1, 1] * root_mode[2, 2]
    volume /= root_prior[0, 0] * root_prior[1, 1] * root_prior[2, 2]
    log_volume = _f(math.log(volume))
    q00, q10, q11 = _f(1 / root_mode[0, 0]), _f(root_mode[1, 0]), _f(1 / root_mode[1, 1])
    q20, q21, q22 = _f(root_mode[2, 0]), _f(root_mode[2, 1]), _f(1 / root_mode[2, 2])
    p00, p10, p11 = _f(1 / root_prior[0, 0]), _f(root_prior[1, 0]), _f(1 / root_prior[1, 1])
    p20, p21, p22 = _f(root_prior[2, 0]), _f(root_prior[2, 1]), _f(1 / root_prior[2, 2])
    x0, y0, z0 = _f(shift[0]), _f(shift[1]), _f(shift[2])
    for m in range(particles.shape[1]):
        x, y, z = particles[0, m], particles[1, m], particles[2, m]
        a = x * q00
        b = (y - q10 * a) * q11
        c = (z - q20 * a - q21 * b) * q22
        d = (x - x0) * p00
        e = (y - y0 - p10 * d) * p11
        g = (z - z0 - p20 * d - p21 * e) * p22
        ratio = _f(0.5) * (d * d + e * e + g * g - a * a - b * b - c * c) - log_volume
        weights[m] = min(max(ratio, _LEAST_LOG), -_LEAST_LOG)  # log of mode's density over prior's
    for m in range(len(weights)):
        work[0, m] = -abs(weights[m])
    exp_of_negative(work[0], work[1], bits)
    from_mode, from_prior = _f(share_mode), _f(1.0 - share_mode)
    for m in range(len(weights)):
        ratio = work[1, m] if weights[m] < 0 else _f(1.0) / work[1, m]
        weights[m] = _f(1.0) / (from_mode * ratio + from_prior)


@kernel(makes_arrays=True, fastmath=_REORDER)
def weigh_camera(camera, u, v, sigma, mode, particles, contrast, weights, work, bits):
    """Multiply the weights by one camera's mixture likelihood, at most 1."""
    x0, y0, z0 = mode[0], mode[1], mode[2]
    p00, p01, p02 = _f(camera[0, 0]), _f(camera[0, 1]), _f(camera[0, 2])
    p10, p11, p12 = _f(camera[1, 0]), _f(camera[1, 1]), _f(camera[1, 2])
    p20, p21, p22 = _f(camera[2, 0]), _f(camera[2, 1]), _f(camera[2, 2])
    p03 = _f(camera[0, 0] * x0 + camera[0, 1] * y0 + camera[0, 2] * z0 + camera[0, 3])
    p13 = _f(camera[1, 0] * x0 + camera[1, 1] * y0 + camera[1, 2] * z0 + camera[1, 3])
    p23 = _f(camera[2, 0] * x0 + camera[2, 1] * y0 + camera[2, 2] * z0 + camera[2, 3])
    zu, zv, scale = _f(u), _f(v), _f(-0.5 / (sigma * sigma))
    for m in range(particles.shape[1]):
        x, y, z = particles[0, m], particles[1, m], particles[2, m]
        depth = max(p20 * x + p21 * y + p22 * z + p23, _f(1e-3))
        du = (p00 * x + p01 * y + p02 * z + p03) / depth - zu
        dv = (p10 * x + p11 * y + p12 * z + p13) / depth - zv
        work[0, m] = scale * (du * du + dv * dv)
    exp_of_negative(work[0], work[1], bits)
    odds = contrast / (sigma * sigma)
    near, far = _f(odds / (1.0 + odds)), _f(1.0 / (1.0 + odds))
    for m in range(len(weights)):
        weights[m] *= far + near * work[1, m]


@kernel(makes_arrays=True, fastmath=_REORDER)
def weighted_moments(particles, weights, mean, cov):
    """Mean (3,), covariance (3, 3) of weighted particles; returns the effective sample size."""
    largest = _f(0.0)
    for m in range(len(weights)):
        largest = max(largest, weights[m])
    if not largest > _f(0.0):
        return 0.0
    scale = _f(1.0) / largest
    n = ss = sx = sy = sz = xx = xy = xz = yy = yz = zz = _f(0.0)
    for m in range(len(weights)):
        w = weights[m] * scale
        w = w if w > _LEAST_WEIGHT else _f(0.0)  # its square would be denormal, and slow
        x, y, z = particles[0, m], particles[1, m], particles[2, m]
        n += w
        ss += w * w
        sx += w * x
        sy += w * y
        sz += w * z
        xx += w * x * x
        xy += w * x * y
        xz += w * x * z
        yy += w * y * y
        yz += w * y * z
        zz += w * z * z
    mean[0], mean[1], mean[2] = sx / n, sy / n, sz / n
    cov[0, 0], cov[1, 1], cov[2, 2] = xx / n, yy / n, zz / n
    cov[0, 1] = cov[1, 0] = xy / n
    cov[0, 2] = cov[2, 0] = xz / n
    cov[1, 2] = cov[2, 1] = yz / n
    for i in range(3):
        for k in range(3):
            cov[i, k] -= mean[i] * mean[k]
    return n * n / ss
