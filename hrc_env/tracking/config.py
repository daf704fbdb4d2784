"""Settings of the estimators: what all of them share, and a record for each."""

from dataclasses import dataclass, fields
from typing import TypeVar

import numpy as np

from hrc_env.core.errors import ConfigError, check_fields, check_names
from hrc_env.core.mapping import answer_unknown_fields


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class TrackerConfig:
    """How workers are acquired, lost and reported, whatever the estimator.

    Positions are in the world, +Z up. `dataclasses.replace` makes a copy with other values.

    Raises:
        ConfigError: a value is out of its range; the error names the field and the range.
    """

    prior_mean_world: tuple[float, float, float] = (1.3, 0.0, 1.0)
    """Where a worker is thought to be when nothing was seen [m]: the working area's centre."""
    prior_std_m: float = 1.5
    """Standard deviation of that prior on each axis [m]; no estimate is reported as wider."""
    max_age_s: float = 5.0
    """Ages are counted up to this bound [s]."""
    lost_after_s: float = 1.0
    """A track is lost when no joint was supported by a measurement for this long [s]."""
    forget_s: float = 2.0
    """Time constant with which a lost worker's estimate relaxes to the prior [s]."""
    longest_delay_s: float = 0.0
    """Frames that arrive up to this late are used at their own time (`Keypoints.time_s`), at most
    1 s [s]; 0: every frame is taken as of the update that brings it."""
    acquire_min_joints: int = 6
    """A worker is acquired when two cameras agree on at least this many joints."""
    body_radius_m: float = 1.3
    """Joints further than this from the middle of the body are not believed [m]."""
    conflict_frames: int = 3
    """A joint is acquired anew when two views agreed elsewhere for so many updates."""
    gate_sigma: float = 5.0
    """Views agree within so many standard deviations of the detector."""
    sigma_scale: float = 1.0
    """Factor on the detector's sigma; where it is not learnt, 1.2 suits errors that persist for
    half a second."""
    min_std_m: float = 0.005
    """No standard deviation, in any direction, is reported as less than this [m]."""
    root_acceleration: float = 3.0
    """Spectral density of the whole body's acceleration [m^2/s^3]."""

    def __post_init__(self) -> None:
        check_fields(
            self, "be positive", "prior_std_m", "max_age_s", "lost_after_s", "forget_s",
            "acquire_min_joints", "body_radius_m", "conflict_frames", "gate_sigma", "sigma_scale",
            "min_std_m", "root_acceleration",
        )  # fmt: skip
        check_fields(self, "be in [0, 1]", "longest_delay_s")
        if self.lost_after_s > self.max_age_s:
            raise ConfigError(
                f"lost_after_s ({self.lost_after_s}) must not exceed max_age_s ({self.max_age_s})."
            )


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class ParticleConfig(TrackerConfig):
    """The default estimator: hypotheses about what is discrete, each with a Gaussian.

    A Rao-Blackwellised particle filter (Doucet, de Freitas, Murphy and Russell, UAI 2000); the
    mathematics, with the symbols that these settings stand for, is in docs/tracking.md.

    Raises:
        ConfigError: a value is out of its range; the error names the field and the range.
    """

    noise_bounds: tuple[float, float] = (1.0, 6.0)
    """Least and most of the factor on the detector's variance that is learnt for every camera
    and joint. Errors that all views share do not show where views disagree:
    never less than told is careful. Equal bounds are that factor, and nothing is learnt."""
    noise_tau_s: float = 4.0
    """Time constant with which it is learnt and forgotten [s]."""
    noise_persists_s: float = 0.5
    """How long errors of the detector persist where they do [s]; BlazePose's: half a second."""
    noise_share: float = 0.9
    """Share of the variance that is thought to persist before anything was learnt, as BlazePose's
    does; 0 for a detector that is known to be wrong anew in every image. [0, 1)"""
    floor_std_m: float = 0.05
    """Nobody stands below the floor, z = 0: a joint that the views put there is measured to be on
    it, with this standard deviation [m]; infinity: no floor is known."""
    bone_give: float = 1.5
    """Factor on how much bones give: what a detector takes for a joint wanders
    on the body, so that even a rigid bone seems to change its length; 1 for points that do not."""
    gauss_newton_steps: int = 2
    """Steps of the search for the posterior mode; more make no measurable difference."""
    outlier_weight: float = 0.15
    """Probability that a measurement is anywhere in the image instead of near its joint."""
    image_area_px: float = 1920.0 * 1080.0
    """Area of an image [px^2]: an outlier's density is its inverse."""
    damping: float = 0.5
    """Damping ratio of a joint about its place on the body; in (0, 1)."""
    mean_correction: float = 0.8
    """Share of Laplace's step from the mode to the mean; without it the depth that one
    camera leaves open runs to the lens, the whole of it overshoots a little."""
    one_view_inflation: float = 1.21
    """Factor on the reported covariance of a worker whom one camera alone has seen for a while."""
    lying_inflation: float = 4.5
    """Further factor if the body lies: its depth is told by how people stand."""
    n_hypotheses: int = 8
    """Most hypotheses about one worker; one is a Gaussian (estimator="kalman")."""
    wait_updates: int = 5
    """Where one view alone shows somebody new, so many updates are waited for a second one before
    the track is begun from it; a rig of one camera does not wait."""
    size_std: float = 0.06
    """Standard deviation of people's size as a share of it, as of adults' statures: how little the
    depth is known of a body that one view has begun."""
    stands_std_m: float = 0.0
    """Such a body's lowest joint is thought to be on the floor, z = 0, within this, which measures
    its size [m], as .1; 0: people may be anywhere above it."""
    mirrored_parts: tuple[str, ...] = ("body", "limbs")
    """What may be turned or reflected in depth when one view carries it."""
    look_every_s: float = 0.12
    """Time between two searches for other hypotheses [s]."""
    open_depth_m: float = 0.04
    """They are looked for where one view carries a part whose depth has at least this standard
    deviation [m]: what other views said a moment ago is still known."""
    turn_std_rad: float = 0.7
    """A body that is turned by this much against a known hypothesis begins e^-0.5 as likely."""
    evidence_trust: float = 0.1
    """Share of the log-evidence of a set of frames that counts between hypotheses: what
    the model gets wrong in one frame it gets wrong in the next."""
    anatomy_trust: float = 1.0
    """Share of what the places of nose, toes, knees and elbows say between hypotheses."""
    walking_odds: float = 2.0
    """Log-odds per second by which a hypothesis that walks forwards gains on one that does not."""
    least_weight: float = 1e-3
    """Probability below which a hypothesis is dropped."""
    swap_begins: float = 0.01
    """Probability per update that a camera begins to exchange left and right."""
    swap_ends: float = 0.15
    """Probability per update that it stops."""

    def __post_init__(self) -> None:
        TrackerConfig.__post_init__(self)
        check_fields(
            self, "be positive", "floor_std_m", "bone_give", "noise_tau_s", "noise_persists_s",
            "gauss_newton_steps", "image_area_px", "one_view_inflation", "lying_inflation",
            "n_hypotheses", "look_every_s", "open_depth_m", "turn_std_rad", "evidence_trust",
            "size_std",
        )  # fmt: skip
        check_fields(
            self, "not be negative", "mean_correction", "anatomy_trust", "walking_odds",
            "wait_updates", "stands_std_m",
        )  # fmt: skip
        check_fields(
            self, "be in (0, 1)", "least_weight", "outlier_weight", "damping", "swap_begins",
            "swap_ends",
        )  # fmt: skip
        check_fields(self, "be in [0, 1)", "noise_share")
        least, most = self.noise_bounds
        if not 0 < least <= most < float("inf"):
            raise ConfigError(
                "noise_bounds must be positive, finite and ordered, as (1.0, 6.0), "
                f"got {self.noise_bounds}."
            )
        check_names("part in mirrored_parts", self.mirrored_parts, ("body", "limbs"))


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class PaperConfig(TrackerConfig):
    """The paper's Algorithm 1.

    Raises:
        ConfigError: a value is out of its range; the error names the field and the range.
    """

    velocity_tau_s: float = 0.2
    """Time constant of the difference filter for velocities [s]."""
    n_particles: int = 1000
    """The paper's M: particles per joint."""
    sigma_m: float = 0.05
    """The paper's Sigma: random walk per frame and axis [m]; the paper gives no number."""
    n_iterations: int = 1
    """The paper's N: passes of Algorithm 1 over one set of frames."""
    place_m: tuple[tuple[float, float], ...] = ()
    """Over which line 1 draws particles: least and most x, y and z [m]. Empty: what the cameras
    stand round, from the floor to 2.2 m."""

    def __post_init__(self) -> None:
        TrackerConfig.__post_init__(self)
        check_fields(self, "be positive", "velocity_tau_s", "n_iterations")
        check_fields(self, "not be negative", "sigma_m")
        if self.n_particles < 10:
            raise ConfigError(
                f"n_particles must be at least 10, got {self.n_particles}: after a resampling "
                "fewer have no covariance."
            )
        if self.place_m and not (
            np.shape(self.place_m) == (3, 2) and np.isfinite(self.place_m).all()
            and (np.diff(self.place_m) > 0).all()
        ):  # fmt: skip
            raise ConfigError(
                "place_m must be empty or hold the least and the most x, y and z, as "
                f"((-3, 3), (-3, 3), (0, 2.2)), got {self.place_m}."
            )


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class TriangulationConfig(TrackerConfig):
    """Triangulation, frame by frame.

    Raises:
        ConfigError: a value is out of its range; the error names the field and the range.
    """

    velocity_tau_s: float = 0.2
    """Time constant of the difference filter for velocities [s]."""
    hold_speed_m_s: float = 1.0
    """How fast a held point loses its worth in gaps [m/s]."""

    def __post_init__(self) -> None:
        TrackerConfig.__post_init__(self)
        check_fields(self, "be positive", "velocity_tau_s", "hold_speed_m_s")


ConfigT = TypeVar("ConfigT", bound=TrackerConfig)


def of_kind(config: TrackerConfig | None, kind: type[ConfigT]) -> ConfigT:
    """The settings of one estimator: these, or what they share with it and its defaults."""
    if isinstance(config, kind):
        return config
    shared = {each.name for each in fields(TrackerConfig)}
    return kind(**({} if config is None else {name: getattr(config, name) for name in shared}))
