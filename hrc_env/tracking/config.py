"""Settings of the estimators: a base class of shared settings, and one class for each estimator."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import ClassVar, TypeVar

import numpy as np

from hrc_env.core.errors import ConfigError, check_fields, check_names
from hrc_env.core.mapping import answer_unknown_fields


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class TrackerConfig:
    """Settings shared by all estimators: how tracks of workers start, are lost and are reported.

    Positions are in the world frame, +Z up. Use `dataclasses.replace` for a copy with other values.

    Raises:
        ConfigError: a value is out of its range; the error names the field and the range.
    """

    RENAMED: ClassVar[Mapping[str, str]] = {
        "forget_s": "lost_relaxation_s",
        "longest_delay_s": "max_delay_s",
    }
    """Current names of renamed fields, by their former names."""

    prior_mean_world: tuple[float, float, float] = (1.3, 0.0, 1.0)
    """Assumed position (x, y, z) of a worker before any measurement, in the world frame [m]. The
    default is the centre of the working area."""
    prior_std_m: float = 1.5
    """Standard deviation of the prior position on each axis [m]. Reported standard deviations do
    not exceed it."""
    max_age_s: float = 5.0
    """Upper bound of the reported ages of joints [s]."""
    lost_after_s: float = 1.0
    """Time without a measurement of any joint after which a track is lost [s]."""
    lost_relaxation_s: float = 2.0
    """Time constant with which the estimate of a lost worker relaxes to the prior [s]."""
    max_delay_s: float = 0.0
    """Maximum delay of a frame that is processed at the time at which it was taken,
    `Keypoints.time_s`; in [0, 1] [s]. With 0, every frame is processed as if it had been taken when
    it arrives."""
    acquire_min_joints: int = 6
    """Number of joints on which two cameras must agree to start a track."""
    body_radius_m: float = 1.3
    """Maximum distance of a joint from the centre of the body [m]. More distant joints are
    rejected."""
    conflict_frames: int = 3
    """Number of successive updates in which two views must agree on another position of a joint
    before the joint is reacquired."""
    gate_sigma: float = 5.0
    """Maximum residual at which views agree, in standard deviations of the detector."""
    sigma_scale: float = 1.0
    """Factor applied to the standard deviations that the detector reports. A factor of 1.2 suits
    estimators that do not learn the noise if errors persist for half a second."""
    min_std_m: float = 0.005
    """Lower bound of the reported standard deviations in all directions [m]."""
    root_acceleration: float = 3.0
    """Spectral density of the acceleration of the whole body [m^2/s^3]."""

    def __post_init__(self) -> None:
        positive = (
            *(
                "prior_std_m",
                "max_age_s",
                "lost_after_s",
                "lost_relaxation_s",
                "acquire_min_joints",
            ),
            *("body_radius_m", "conflict_frames", "gate_sigma", "sigma_scale", "min_std_m"),
            "root_acceleration",
        )
        check_fields(self, "be positive", *positive)
        check_fields(self, "be in [0, 1]", "max_delay_s")
        if self.lost_after_s > self.max_age_s:
            raise ConfigError(
                f"lost_after_s ({self.lost_after_s}) must not exceed max_age_s ({self.max_age_s})."
            )


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class ParticleConfig(TrackerConfig):
    """Settings of the default estimator, a mixture of Gaussian bodies for each worker.

    The estimator is a Rao-Blackwellised particle filter (Doucet, de Freitas, Murphy and Russell,
    UAI 2000). Its mathematics is described in docs/tracking.md with reference to these settings.

    Raises:
        ConfigError: a value is out of its range; the error names the field and the range.
    """

    RENAMED: ClassVar[Mapping[str, str]] = {
        **TrackerConfig.RENAMED,
        "noise_persists_s": "noise_correlation_s",
        "bone_give": "bone_variation_scale",
        "wait_updates": "one_view_wait_updates",
        "stands_std_m": "initial_foot_height_std_m",
        "look_every_s": "hypothesis_search_period_s",
        "open_depth_m": "min_ambiguous_depth_std_m",
        "evidence_trust": "evidence_exponent",
        "anatomy_trust": "anatomy_exponent",
        "walking_odds": "walking_log_odds_per_s",
        "least_weight": "min_weight",
        "swap_begins": "swap_start_probability",
        "swap_ends": "swap_end_probability",
    }
    """Current names of renamed fields, by their former names."""

    noise_bounds: tuple[float, float] = (1.0, 6.0)
    """Lower and upper bounds of the factor on the detector's variance. The factor is learnt for
    each camera and joint. A lower bound of 1 is conservative: errors that all views share cause no
    disagreement between views and are not learnt. If both bounds are equal, the factor is fixed."""
    noise_tau_s: float = 4.0
    """Time constant with which the factors on the variance are learnt and forgotten [s]."""
    noise_correlation_s: float = 0.5
    """Correlation time of the persistent part of the detector's errors [s]. The default suits
    BlazePose."""
    noise_share: float = 0.9
    """Prior fraction of the variance that is due to persistent errors, in [0, 1). The default suits
    BlazePose; use 0 for a detector whose errors are independent from image to image."""
    floor_std_m: float = 0.05
    """Standard deviation of the pseudo-measurement z = 0 that is applied to joints below the floor
    [m]. If it is infinite, no floor is assumed."""
    bone_variation_scale: float = 1.5
    """Factor on the standard deviation of a bone's length within one person. The default suits a
    detector with keypoints that shift on the body, with which even rigid bones seem to change in
    length; use 1 if the keypoints are fixed points of the body."""
    gauss_newton_steps: int = 2
    """Number of Gauss-Newton steps in the search for the posterior mode. More than two make no
    measurable difference."""
    outlier_weight: float = 0.15
    """Prior probability that a measurement is an outlier. Outliers are uniform over the image."""
    image_area_px: float = 1920.0 * 1080.0
    """Area of an image [px^2]. Its inverse is the probability density of an outlier's pixel."""
    damping: float = 0.5
    """Damping ratio of the motion of a joint relative to the body, in (0, 1)."""
    mean_correction: float = 0.8
    """Fraction of Laplace's correction from the mode to the mean of the posterior that is applied.
    With 0, the depth of a body seen by one camera drifts towards the camera; with 1, the correction
    is slightly too large."""
    one_view_inflation: float = 1.21
    """Factor on the reported covariance of a worker seen by only one camera for several updates."""
    lying_inflation: float = 4.5
    """Additional factor on the reported covariance of a lying body seen by only one camera. It is
    needed because the depth inferred from one view relies on an upright posture."""
    n_hypotheses: int = 8
    """Maximum number of hypotheses about one worker. With 1, the state of a worker is a single
    Gaussian, as in `estimator="kalman"`."""
    one_view_wait_updates: int = 5
    """Number of updates to wait for a second view of a new person before a track is started from
    one view alone. A rig of one camera does not wait."""
    size_std: float = 0.06
    """Relative standard deviation of body size in the population; the default is that of adult
    stature. It determines the depth uncertainty of a body with a track started from one view."""
    initial_foot_height_std_m: float = 0.0
    """Standard deviation of the height of the lowest joint above the floor, z = 0, assumed when a
    track is started from one view [m]. This assumption determines the size of the body; 0.1 suits
    people who stand on the floor. With 0, no assumption is made and people may be at any height."""
    mirrored_parts: tuple[str, ...] = ("body", "limbs")
    """Body parts that hypotheses may mirror in depth while only one view shows them: "body",
    "limbs" or both."""
    hypothesis_search_period_s: float = 0.12
    """Time between two searches for alternative hypotheses [s]."""
    min_ambiguous_depth_std_m: float = 0.04
    """Smallest standard deviation of the depth of a part seen in one view at which alternative
    hypotheses are searched for [m]. Below it, recent measurements of other views still fix the
    depth."""
    turn_std_rad: float = 0.7
    """Standard deviation of the rotation between a new hypothesis and an existing one [rad]. If the
    rotation equals this angle, the initial weight of the new hypothesis is e^-0.5 times that of the
    existing one."""
    evidence_exponent: float = 0.1
    """Exponent applied to the evidence of a set of frames when hypotheses are weighted. It is below
    1 because model errors are correlated from frame to frame."""
    anatomy_exponent: float = 1.0
    """Exponent applied to the anatomical prior when hypotheses are weighted. The prior concerns the
    positions of nose, toes, knees and elbows relative to the body."""
    walking_log_odds_per_s: float = 2.0
    """Rate at which the log-odds of a hypothesis with a body walking forwards increase relative to
    a hypothesis with another motion [1/s]."""
    min_weight: float = 1e-3
    """Probability below which a hypothesis is dropped."""
    swap_start_probability: float = 0.01
    """Probability per update that a camera starts to swap left and right labels."""
    swap_end_probability: float = 0.15
    """Probability per update that a camera stops swapping left and right labels."""

    def __post_init__(self) -> None:
        TrackerConfig.__post_init__(self)
        positive = (
            *(
                "floor_std_m",
                "bone_variation_scale",
                "noise_tau_s",
                "noise_correlation_s",
                "gauss_newton_steps",
            ),
            *("image_area_px", "one_view_inflation", "lying_inflation", "n_hypotheses"),
            *(
                "hypothesis_search_period_s",
                "min_ambiguous_depth_std_m",
                "turn_std_rad",
                "evidence_exponent",
                "size_std",
            ),
        )
        check_fields(self, "be positive", *positive)
        not_negative = (
            "mean_correction",
            "anatomy_exponent",
            "walking_log_odds_per_s",
            "one_view_wait_updates",
        )
        check_fields(self, "not be negative", *not_negative, "initial_foot_height_std_m")
        probabilities = (
            "min_weight",
            "outlier_weight",
            "swap_start_probability",
            "swap_end_probability",
        )
        check_fields(self, "be in (0, 1)", *probabilities, "damping")
        check_fields(self, "be in [0, 1)", "noise_share")
        least, most = self.noise_bounds
        if not 0 < least <= most < float("inf"):
            raise ConfigError(
                "noise_bounds must be positive, finite and ordered, such as (1.0, 6.0), got "
                f"{self.noise_bounds}."
            )
        check_names("part in mirrored_parts", self.mirrored_parts, ("body", "limbs"))


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class PaperConfig(TrackerConfig):
    """Settings of the paper's Algorithm 1.

    Raises:
        ConfigError: a value is out of its range; the error names the field and the range.
    """

    RENAMED: ClassVar[Mapping[str, str]] = {
        **TrackerConfig.RENAMED,
        "place_m": "initial_bounds_m",
    }
    """Current names of renamed fields, by their former names."""

    velocity_tau_s: float = 0.2
    """Time constant of the low-pass filter for velocities, which are computed from differences of
    positions [s]."""
    n_particles: int = 1000
    """Number of particles per joint, the paper's M."""
    sigma_m: float = 0.05
    """Standard deviation of the random walk per frame and axis, the paper's Sigma [m]. The paper
    does not state its value."""
    n_iterations: int = 1
    """Number of passes of Algorithm 1 over one set of frames, the paper's N."""
    initial_bounds_m: tuple[tuple[float, float], ...] = ()
    """Lower and upper bounds of x, y and z within which the initial particles are sampled (line 1)
    [m]. If empty, they are sampled in the area between the cameras, from the floor to 2.2 m."""

    def __post_init__(self) -> None:
        TrackerConfig.__post_init__(self)
        check_fields(self, "be positive", "velocity_tau_s", "n_iterations")
        check_fields(self, "not be negative", "sigma_m")
        if self.n_particles < 10:
            raise ConfigError(
                f"n_particles must be at least 10, got {self.n_particles}: fewer have no "
                "covariance after resampling."
            )
        place = np.array(self.initial_bounds_m)
        if self.initial_bounds_m and not (
            place.shape == (3, 2) and np.isfinite(place).all() and (np.diff(place) > 0).all()
        ):
            raise ConfigError(
                "initial_bounds_m must be empty or contain the minimum and maximum of x, y and z, "
                f"such as ((-3, 3), (-3, 3), (0, 2.2)), got {self.initial_bounds_m}."
            )


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class TriangulationConfig(TrackerConfig):
    """Settings of the estimators that triangulate each frame independently.

    Raises:
        ConfigError: a value is out of its range; the error names the field and the range.
    """

    velocity_tau_s: float = 0.2
    """Time constant of the low-pass filter for velocities, which are computed from differences of
    positions [s]."""
    hold_speed_m_s: float = 1.0
    """Growth rate of a joint's standard deviation while no frame shows the joint [m/s]."""

    def __post_init__(self) -> None:
        TrackerConfig.__post_init__(self)
        check_fields(self, "be positive", "velocity_tau_s", "hold_speed_m_s")


ConfigT = TypeVar("ConfigT", bound=TrackerConfig)


def cast_config(config: TrackerConfig | None, kind: type[ConfigT]) -> ConfigT:
    """Return settings of the class that an estimator takes.

    Settings of that class are returned unchanged. From settings of another class, only the fields
    of `TrackerConfig` are copied; the other fields have their defaults.

    Args:
        config: settings of any estimator; None for the defaults.
        kind: the class of settings that the estimator takes.
    """
    if isinstance(config, kind):
        return config
    shared = {each.name for each in fields(TrackerConfig)}
    return kind(**({} if config is None else {name: getattr(config, name) for name in shared}))
