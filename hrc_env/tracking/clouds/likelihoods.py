"""How well particles explain a measurement, in logarithms.

Likelihoods of cameras are multiplied (their logarithms added): a product of 60 Gaussians of
a few pixels underflows long before the particles are bad.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of

BEHIND = -1e12
"""Log-likelihood of a particle behind the camera that saw the joint: the last to be chosen."""


@kernel(makes_arrays=True)
def log_gaussian(distance_squared, sigma):
    """Log-density of a planar Gaussian at a distance, up to its constant."""
    return -0.5 * distance_squared / (sigma * sigma)


@kernel(makes_arrays=True)
def add_log_likelihood(camera, u, v, sigma, particles, log_weights):
    """Add one camera's log-likelihood of pixel (u, v) to the log-weights of particles (3, M)."""
    for m in range(particles.shape[1]):
        expected_u, expected_v, depth = pixel_of(
            camera, particles[0, m], particles[1, m], particles[2, m]
        )
        if depth > NEAREST_DEPTH_M:
            distance_squared = (u - expected_u) ** 2 + (v - expected_v) ** 2
            log_weights[m] += log_gaussian(distance_squared, sigma)
        else:
            log_weights[m] += BEHIND


@kernel(makes_arrays=True)
def normalise(log_weights, weights):
    """Weights that sum to one; returns the effective sample size 1 / sum w^2 (Kong, 1994)."""
    largest = log_weights.max()
    total = 0.0
    for m in range(len(log_weights)):
        weights[m] = math.exp(log_weights[m] - largest)
        total += weights[m]
    squares = 0.0
    for m in range(len(weights)):
        weights[m] /= total
        squares += weights[m] * weights[m]
    return 1.0 / squares
