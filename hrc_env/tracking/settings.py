"""Settings of the estimators as a named tuple, which compiled functions accept."""

import math
from typing import Any, NamedTuple

from hrc_env.tracking.config import ParticleConfig, TrackerConfig, cast_config

_TICK_S = 1e-6
"""Tolerance for rounding errors in sums of time steps, by which a period may be shorter [s]."""


class Settings(NamedTuple):
    """The fields of `ParticleConfig` that compiled functions read, and values derived from them."""

    sigma_scale: float
    """Factor applied to the standard deviations that the detector reports."""
    gate_sigma: float
    """Maximum residual at which views agree, in standard deviations of the detector."""
    body_radius_m: float
    """Maximum distance of a joint from the centre of the body [m]."""
    acquire_min_joints: int
    """Number of joints on which two cameras must agree to start a track."""
    conflict_frames: int
    """Number of successive updates in which two views must contradict a joint before it is
    reacquired."""
    one_view_wait_updates: int
    """Number of updates to wait for a second view before a track is started from one view."""
    size_std: float
    """Relative standard deviation of body size in the population."""
    initial_foot_height_std_m: float
    """Standard deviation of the height of the lowest joint of a body started from one view [m]; 0
    if people may be at any height."""
    inlier_odds: float
    """Odds that a measurement without residual is an inlier, times its pixel variance [px^2]."""
    swap_start_probability: float
    """Probability per update that a camera starts to swap left and right labels."""
    swap_end_probability: float
    """Probability per update that a camera stops swapping left and right labels."""
    gauss_newton_steps: int
    """Number of Gauss-Newton steps in the search for the posterior mode."""
    prior_mean_world: tuple[float, float, float]
    """Mean (x, y, z) of the prior position in the world frame [m]."""
    prior_std_m: float
    """Standard deviation of the prior position on each axis [m]."""
    max_age_s: float
    """Upper bound of the reported ages of joints [s]."""
    lost_after_s: float
    """Time without a measurement of any joint after which a track is lost [s]."""
    lost_relaxation_s: float
    """Time constant with which the estimate of a lost worker relaxes to the prior [s]."""
    mean_correction: float
    """Fraction of Laplace's correction from the mode to the mean that is applied."""
    one_view_inflation: float
    """Factor on the reported covariance of a worker seen by only one camera."""
    lying_inflation: float
    """Additional factor on the reported covariance of a lying body seen by only one camera."""
    min_std_m: float
    """Lower bound of the reported standard deviations in all directions [m]."""
    floor_std_m: float
    """Standard deviation of the pseudo-measurement z = 0 applied to joints below the floor [m]."""
    bone_variation_scale: float
    """Factor on the standard deviation of a bone's length within one person."""
    mirrors_body: bool
    """Whether hypotheses may mirror the whole body in depth."""
    mirrors_limbs: bool
    """Whether hypotheses may mirror a limb in depth."""
    hypothesis_search_period_s: float
    """Time between two searches for alternative hypotheses, minus a tolerance [s]."""
    min_ambiguous_depth_std_m: float
    """Smallest standard deviation of a part's depth at which hypotheses are searched for [m]."""
    turn_std_rad: float
    """Standard deviation of the rotation between a new hypothesis and an existing one [rad]."""
    evidence_exponent: float
    """Exponent applied to the evidence of a set of frames when hypotheses are weighted."""
    anatomy_exponent: float
    """Exponent applied to the anatomical prior when hypotheses are weighted."""
    walking_log_odds_per_s: float
    """Rate at which the log-odds of a hypothesis increase while its body walks forwards [1/s]."""
    log_min_weight: float
    """Log-probability below which a hypothesis is dropped."""


def make_settings(config: TrackerConfig) -> Settings:
    """Return the settings for compiled functions.

    If `config` belongs to another estimator than the default one, only its fields of
    `TrackerConfig` are used; all other values are those of the default `ParticleConfig`.
    """
    config = cast_config(config, ParticleConfig)
    weight, area_px = config.outlier_weight, config.image_area_px
    derived: dict[str, Any] = {
        "inlier_odds": (1.0 - weight) * area_px / (2.0 * math.pi * weight),
        "mirrors_body": "body" in config.mirrored_parts,
        "mirrors_limbs": "limbs" in config.mirrored_parts,
        "hypothesis_search_period_s": config.hypothesis_search_period_s - _TICK_S,
        "log_min_weight": math.log(config.min_weight),
    }
    names = set(Settings._fields) - set(derived)
    return Settings(**derived, **{name: getattr(config, name) for name in names})
