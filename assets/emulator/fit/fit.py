"""From the pose network's detections of rendered workers to a calibration of the emulator."""

import numpy as np

from assets.emulator.fit.body import bodies_of
from assets.emulator.fit.cells import N_K, N_P, Cells
from assets.emulator.fit.confidence import (
    confidences_of,
    follows_of,
    sigma_table,
)
from assets.emulator.fit.events import misses_of, swaps_of
from assets.emulator.fit.lasting import limbs_of, times_of
from assets.emulator.fit.sizes import bias_at, bias_of, relative, sizes_of
from assets.emulator.fit.space import (
    offsets_of,
    projected,
    space_variance,
    wander_of,
)
from assets.emulator.samples import Samples
from hrc_env.core.typing import Floats
from hrc_env.perception.calibration import Calibration


def fit(samples: Samples, known: tuple[Floats, float], between_m: Floats) -> Calibration:
    """Fit a draft of a calibration whose errors resemble the samples (`matching.matched` completes
    it).

    Args:
        samples: detections of the network.
        known: poses of the fit and the median distance of others from them (`novelty.poses_of`).
        between_m: deviations between the bodies (`bodies.compute_spread`).
    """
    s, (poses, near_m) = Cells(samples), known
    offset = offsets_of(samples)
    wander, space_limb = wander_of(samples, offset)
    in_space = space_variance(samples, wander)
    left_over = s.mirrored - projected(samples, offset)
    bias = bias_of(s, left_over)
    left_over = left_over - bias_at(bias, samples, s)
    body, factor, common = bodies_of(s, left_over)
    size, spread = sizes_of(s, left_over, factor, in_space)
    unit = relative(s, left_over, factor, size)
    shares, slow_s, slow_m = times_of(s, samples, unit, in_space, size)
    swap_share, swap_s = swaps_of(samples)
    miss_share, miss_s = misses_of(samples)
    return Calibration(
        offset, wander, space_limb, between_m, poses, np.array(near_m), np.zeros(N_K),
        np.zeros(N_P), bias, size, spread, body,
        np.array(common), shares, slow_s, slow_m, limbs_of(s, unit), confidences_of(s),
        follows_of(s, left_over, spread, common), swap_share, swap_s, miss_share, miss_s,
        sigma_table(s, samples),
    )  # fmt: skip
