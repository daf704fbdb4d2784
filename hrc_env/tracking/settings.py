"""The settings that the kernels of the Gaussian estimators take."""

import math
from typing import NamedTuple

from hrc_env.tracking.config import ParticleConfig, TrackerConfig, of_kind


class Settings(NamedTuple):
    """What the kernels need of `ParticleConfig`, under the same names if not described."""

    sigma_scale: float
    gate_sigma: float
    body_radius_m: float
    acquire_min_joints: int
    conflict_frames: int
    inlier_odds: float
    """Of a perfect inlier against an outlier, times the variance of its pixel [px^2]."""
    swap_begins: float
    swap_ends: float
    gauss_newton_steps: int
    prior_mean_world: tuple[float, float, float]
    prior_std_m: float
    max_age_s: float
    lost_after_s: float
    forget_s: float
    mean_correction: float
    one_view_inflation: float
    min_std_m: float
    floor_std_m: float
    bone_give: float


def settings_of(config: TrackerConfig) -> Settings:
    """The kernels' part of the configuration; of another estimator's, what all share."""
    config = of_kind(config, ParticleConfig)
    weight, area_px = config.outlier_weight, config.image_area_px
    inlier_odds = (1.0 - weight) * area_px / (2.0 * math.pi * weight)
    names = set(Settings._fields) - {"inlier_odds"}
    return Settings(inlier_odds=inlier_odds, **{name: getattr(config, name) for name in names})
