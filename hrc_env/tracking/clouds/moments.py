"""Clouds of particles, (J, 3, M) for one worker: made, moved, measured."""

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Covariances3, Floats, Points3


def scatter(particles: Floats, mean: Points3, cov: Covariances3, rng: np.random.Generator) -> None:
    """Draw clouds (..., 3, M) from Gaussians with mean (..., 3) and cov (..., 3, 3), in place."""
    root = np.linalg.cholesky(cov)
    particles[:] = mean[..., None] + root @ rng.standard_normal(particles.shape)


def roll(particles: Floats, sigma_m: float, rng: np.random.Generator) -> None:
    """Move every particle a Gaussian step of `sigma_m` on each axis, in place."""
    _add_scaled(particles, rng.standard_normal(particles.shape, dtype=np.float32), sigma_m)


@kernel(makes_arrays=True)
def _add_scaled(particles, noise, scale):
    for j in range(particles.shape[0]):
        for i in range(3):
            for m in range(particles.shape[2]):
                particles[j, i, m] += scale * noise[j, i, m]


@kernel(makes_arrays=True)
def moments(particles, mean, cov):
    """Mean (J, 3) and covariance (J, 3, 3) of unweighted clouds (J, 3, M)."""
    n = particles.shape[2]
    for j in range(particles.shape[0]):
        for i in range(3):
            mean[j, i] = particles[j, i].mean()
        for i in range(3):
            for k in range(i + 1):
                total = 0.0
                for m in range(n):
                    total += (particles[j, i, m] - mean[j, i]) * (particles[j, k, m] - mean[j, k])
                cov[j, i, k] = cov[j, k, i] = total / n
