"""Inliers against outliers: a pixel is near its joint's image or, rarely, anywhere in the image."""

import math

from hrc_env.core.kernels import kernel


@kernel
def inlier_odds_of(outlier_weight, image_area_px):
    """Odds of a perfect inlier against an outlier, times the variance of its pixel [px^2]."""
    return (1.0 - outlier_weight) * image_area_px / (2.0 * math.pi * outlier_weight)
