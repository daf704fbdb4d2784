"""The settings that the kernels take."""

import math
from typing import NamedTuple

from hrc_env.tracking.config import ParticleConfig, TrackerConfig, of_kind

_TICK_S = 1e-6
"""Sums of time steps that are short by no more are whole."""


class Settings(NamedTuple):
    """What the kernels need of `ParticleConfig`, under the same names if not described."""

    sigma_scale: float
    gate_sigma: float
    body_radius_m: float
    acquire_min_joints: int
    conflict_frames: int
    wait_updates: int
    size_std: float
    stands_std_m: float
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
    lying_inflation: float
    min_std_m: float
    floor_std_m: float
    bone_give: float
    mirrors_body: bool
    """Whether a whole body may be turned the other way."""
    mirrors_limbs: bool
    """Whether a limb may be reflected in depth."""
    look_every_s: float
    open_depth_m: float
    turn_std_rad: float
    evidence_trust: float
    anatomy_trust: float
    walking_odds: float
    log_least_weight: float


def settings_of(config: TrackerConfig) -> Settings:
    """The kernels' part of the configuration; of another estimator's, what all share."""
    config = of_kind(config, ParticleConfig)
    weight, area_px = config.outlier_weight, config.image_area_px
    derived = {
        "inlier_odds": (1.0 - weight) * area_px / (2.0 * math.pi * weight),
        "mirrors_body": "body" in config.mirrored_parts,
        "mirrors_limbs": "limbs" in config.mirrored_parts,
        "look_every_s": config.look_every_s - _TICK_S,
        "log_least_weight": math.log(config.least_weight),
    }
    names = set(Settings._fields) - set(derived)
    return Settings(**derived, **{name: getattr(config, name) for name in names})
