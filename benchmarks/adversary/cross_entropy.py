"""The cross-entropy method, which searches for parameters with high scores.

Samples of a normal distribution with independent parameters are scored; the distribution then moves
towards the mean and standard deviation of the samples with the highest scores, the elite, and so on
(de Boer, Kroese, Mannor and Rubinstein 2005, doi:10.1007/s10479-005-5724-z). The deviation has a
lower bound, so that the search goes on; scores may be random, since each sample is a new one.
"""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Floats

WIDE = 0.35
"""Standard deviation at the beginning, as a fraction of the range of a parameter."""


@dataclass(frozen=True, slots=True)
class Normal:
    """Independent normal distributions of parameters, which are fractions of their ranges."""

    mean: Floats
    """Means (...), in [0, 1]."""
    deviation: Floats
    """Standard deviations (...)."""

    def draw(self, n: int, rng: np.random.Generator) -> Floats:
        """Return `n` samples (n, ...), limited to [0, 1]."""
        return np.clip(rng.normal(self.mean, self.deviation, (n, *self.mean.shape)), 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class CrossEntropy:
    """Settings of a search."""

    n_samples: int = 256
    """Number of samples per iteration."""
    elite_share: float = 0.125
    """Fraction of the samples that are the elite."""
    smoothing: float = 0.7
    """Weight of the elite in the new distribution; the rest is that of the old one."""
    min_deviation: float = 0.05
    """Minimum standard deviation."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if a number is invalid, or the elite has fewer than 2 samples."""
        if self.n_elite < 2:
            raise ConfigError(
                f"The elite must have at least 2 samples, got {self.elite_share} of "
                f"{self.n_samples}."
            )
        if not 0.0 < self.smoothing <= 1.0:
            raise ConfigError(f"smoothing must be in (0, 1], got {self.smoothing}.")

    @property
    def n_elite(self) -> int:
        """Number of samples of the elite."""
        return round(self.elite_share * self.n_samples)

    def begin(self, shape: tuple[int, ...]) -> Normal:
        """Return the distribution of the first iteration for parameters of a shape."""
        return Normal(np.full(shape, 0.5), np.full(shape, WIDE))

    def update(self, old: Normal, samples: Floats, scores: Floats) -> Normal:
        """Return the distribution of the next iteration.

        Args:
            old: distribution from which the samples were drawn.
            samples: samples (n, ...).
            scores: finite scores (n,).

        Raises:
            ConfigError: a score is not finite.
        """
        if not np.isfinite(scores).all():
            raise ConfigError(f"Scores must be finite, got {scores}.")
        elite = samples[np.argsort(-scores, kind="stable")[: self.n_elite]]
        new, was = self.smoothing, 1.0 - self.smoothing
        return Normal(
            new * elite.mean(0) + was * old.mean,
            np.maximum(new * elite.std(0) + was * old.deviation, self.min_deviation),
        )
