"""The settings that the kernels take."""

import math
from collections import namedtuple

from hrc_env.tracking.config import ParticleConfig, TrackerConfig, of_kind

_TICK_S = 1e-6
"""Sums of time steps that are short by no more are whole."""


Settings = namedtuple(
    "Settings",
    "sigma_scale gate_sigma body_radius_m acquire_min_joints conflict_frames wait_updates size_std "
    "stands_std_m inlier_odds swap_begins swap_ends gauss_newton_steps prior_mean_world "
    "prior_std_m max_age_s lost_after_s forget_s mean_correction one_view_inflation min_std_m "
    "floor_std_m bone_give mirrors_body mirrors_limbs look_every_s open_depth_m turn_std_rad "
    "evidence_trust anatomy_trust walking_odds log_least_weight",
)
"""What the kernels need of `ParticleConfig`, under the same names but for: `inlier_odds`, of a
perfect inlier against an outlier, times the variance of its pixel [px^2]; `mirrors_body`, whether a
whole body may be turned the other way; `mirrors_limbs`, whether a limb may be reflected in depth;
and `log_least_weight`."""


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
