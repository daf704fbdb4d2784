"""Choosing ancestors by weight: every scheme expects M w_m copies of particle m.

The random numbers are arguments, so that each environment draws its own.
"""

from hrc_env.core.kernels import kernel


@kernel(makes_arrays=True)
def multinomial(weights, waits, ancestors):
    """M independent choices, sorted.

    Args:
        weights: (M,) summing to one.
        waits: (M + 1,) standard exponential variates: their normalised cumulative sums are
            M sorted uniform variates (Devroye, Non-Uniform Random Variate Generation, V.3).
        ancestors: (M,) int, filled.
    """
    total = waits.sum()
    particle, cumulative, position = 0, weights[0], 0.0
    for m in range(len(ancestors)):
        position += waits[m] / total
        while cumulative < position and particle < len(weights) - 1:
            particle += 1
            cumulative += weights[particle]
        ancestors[m] = particle


@kernel(makes_arrays=True)
def systematic(weights, start, ancestors):
    """Choices at even distances (Kitagawa, 1996): the counts differ from M w_m by less than one.

    Args:
        weights: (M,) summing to one.
        start: one uniform variate in [0, 1).
        ancestors: (M,) int, filled.
    """
    n = len(ancestors)
    particle, cumulative = 0, weights[0]
    for m in range(n):
        while cumulative < (m + start) / n and particle < len(weights) - 1:
            particle += 1
            cumulative += weights[particle]
        ancestors[m] = particle
