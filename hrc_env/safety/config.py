"""Settings of the built-in shields."""

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import ClassVar, NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError, check_fields, check_names
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.typing import Bools, Floats
from hrc_env.core.vacancy import WALKING_M_S
from hrc_env.geometry.enclosure import CAPSULES, load_enclosure
from hrc_env.safety.error_bounds import ErrorBounds, load_error_bounds, make_no_bounds

KINDS = ("qp", "ssm", "pfl", "sara")
MARGINS = ("constant", "conformal")
"""Values of `ShieldConfig.margin`."""
MAY_BE_NEGATIVE = ("margin_m", "hand_margin_m")
"""Names of the settings of `ShieldConfig` that may be negative."""
IS_FOREARM_OR_HAND: Bools = np.array([name.endswith(("forearm", "hand")) for name in CAPSULES])
"""Mask of the capsules of a body to which `ShieldConfig.hand_margin_m` applies (S,)."""


class ShieldParams(NamedTuple):
    """Settings of a `ShieldConfig` as arguments of compiled kernels."""

    margins_m: Floats
    """Distance that is subtracted from the gap of each capsule of a body (S,) [m]."""
    protrusion_m: Floats
    """Distance by which each capsule of a true body may protrude (S,) [m], which is subtracted
    where no bound on the error is calibrated."""
    bounds: ErrorBounds
    """Calibrated bounds on the errors of capsules."""
    n_sigmas: float
    """Uncertainty margin Z_d, in standard deviations."""
    min_uncertainty_m: float
    """Lower bound on the uncertainty margin Z_d [m]."""
    prediction_growth_m_s: float
    """Part of the standard deviation due to prediction, per second without a detection [m/s]."""
    single_view_std_m: float
    """Standard deviation above which a part of the body is assumed to be located by a single camera
    [m]."""
    single_view_sigmas: float
    """Additional factor on the standard deviation above `single_view_std_m`."""
    follows_estimate: bool
    """Whether `worker_m_s` is added to the estimated speed of the worker instead of replacing
    it."""
    worker_m_s: float
    """Speed of the worker towards the robot, or the amount added to the estimated speed [m/s]."""
    travel_s: float
    """Time for which the worker is assumed to keep approaching [s]."""
    reaction_s: float
    """Time until a command of the robot takes effect [s]."""
    deceleration_m_s2: float
    """Maximum deceleration of a point of the robot [m/s^2]."""
    gain_hz: float
    """Gain of a retreat: its speed divided by the amount by which the clearance is negative
    [1/s]."""
    retreat_m_s: float
    """Upper bound on the speed of a retreat [m/s]."""
    creep_m_s: float
    """Speed of small corrections near segments that may be touched [m/s]."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class ShieldConfig:
    """Settings of a built-in shield: its kind, margins and limits.

    The clearance D is the gap between the surfaces of a robot's capsule and a segment of an
    estimated body, minus a margin for the error of the estimate (`margin`), minus the distance that
    the worker covers until the robot has stopped.
    """

    RENAMED: ClassVar[Mapping[str, str]] = {
        "sigmas": "n_sigmas", "least_sigmas_m": "min_uncertainty_m",
        "predicted_m_s": "prediction_growth_m_s", "doubtful_m": "single_view_std_m",
        "doubtful_sigmas": "single_view_sigmas", "human_m_s": "worker_speed_m_s",
        "human_margin_m_s": "worker_speed_margin_m_s", "human_s": "worker_time_s",
        "gain_hz": "retreat_gain_hz", "retreat_m_s": "max_retreat_m_s",
        "unseen_s": "stale_after_s", "unknown_m_s": "unknown_speed_limit_m_s",
        "welcome_m_s": "contact_speed_m_s", "still_m_s": "creep_m_s",
    }  # fmt: skip
    """Current names of renamed fields, by their old names."""

    kind: str = "qp"
    """Method of the shield. "qp" selects the nearest joint velocities that satisfy all constraints.
    "ssm" scales all joint velocities by one factor. "pfl" is like "qp", but allows touches up to
    the speed that the touched region of the body tolerates, also where it would be clamped. "sara"
    executes a command only if the robot can stop before its reachable set meets that of a person
    (`safety.reachability`), and brakes otherwise."""
    margin: str = "conformal"
    """Margin for the error of the estimate. "conformal" is a calibrated quantile of the error
    (`safety.error_bounds`), or the constant margin for parts of the body to which the calibration
    does not apply. "constant" is the distance by which a true body may protrude from its estimated
    capsules (`Enclosure.protrusion_m`), plus the uncertainty margin Z_d."""
    margin_m: float = 0.0
    """Distance subtracted from every gap [m], in addition to `margin`. A negative value takes away
    from the distance that protects people, and gives a warning."""
    hand_margin_m: float = 0.0
    """Distance subtracted instead of `margin_m` for forearms and hands, which are involved in
    nearly all contacts [m]."""
    n_sigmas: float = 2.0
    """Uncertainty margin Z_d, in standard deviations of the estimate along the line between robot
    and worker."""
    min_uncertainty_m: float = 0.03
    """Lower bound on the uncertainty margin Z_d [m]."""
    prediction_growth_m_s: float = 0.7
    """Part of the standard deviation due to prediction, per second since a part of the body was
    last detected [m/s]. It is weighted with 1 instead of `n_sigmas`, because the predicted
    uncertainty is too large for delayed images with time stamps."""
    single_view_std_m: float = 0.08
    """Standard deviation above which a part of the body is assumed to be located by a single
    camera, for which actual errors exceed the estimated ones [m]."""
    single_view_sigmas: float = 5.0
    """Additional factor on the standard deviation above `single_view_std_m`."""
    worker_speed_m_s: float | None = None
    """Speed of a worker towards the robot, 1.6 in ISO 13855 [m/s]; None for the estimated speed
    plus `worker_speed_margin_m_s`."""
    worker_speed_margin_m_s: float = 0.1
    """Amount by which a worker may be faster than estimated [m/s]."""
    worker_time_s: float = 0.3
    """Time for which a worker is assumed to approach the robot at the worker's speed [s]."""
    latency_s: float = 0.0
    """Additional age of the estimate, for delayed images without time stamps [s]."""
    reaction_s: float = 0.08
    """Time until a command of the robot takes effect [s]."""
    deceleration_m_s2: float = 3.0
    """Maximum deceleration of a point of the robot, if its joints can achieve it [m/s^2]."""
    retreat_gain_hz: float = 4.0
    """Gain of a retreat: its speed divided by the amount by which the clearance is negative
    [1/s]."""
    max_retreat_m_s: float = 1.0
    """Upper bound on the speed of a retreat [m/s]. With 0 the robot stops approaching but does not
    retreat, as is always the case with "ssm"."""
    stale_after_s: float = 0.25
    """Time since the last detection after which a worker counts as lost [s]. A lost worker is
    assumed to have walked at `worker_speed_m_s` (1.6 m/s if it is None) from the last detected
    position, and the robot does not come closer to that position than the distance walked. Lost
    workers count as unknown, like those without a track. Images that arrive later than this time
    slow the robot down."""
    unknown_speed_limit_m_s: float = 0.25
    """Speed limit of every point of the robot while a worker is lost, and near patches of floor
    that only one camera has observed to be empty [m/s]; 0 stops the robot. Between 1 m and 0.25 m
    from the lost worker's last position, the limit decreases to zero. The robot does not move
    before the first image."""
    contact_speed_m_s: float = 0.25
    """Maximum speed of the robot's hand and its load towards segments of the body that may touch
    them in a task such as a handover (`Task.allowed_contact`) [m/s]. It is further limited to the
    speed that the region of the body tolerates; 0 forbids touches. With "sara", the maximum speed
    of every link where a person can be; 0 requires standstill."""
    creep_m_s: float = 0.02
    """Speed at which other links may approach these segments even if the clearance permits less
    [m/s]. It permits the small corrections that hold an object in position during a handover."""

    def __post_init__(self) -> None:
        check_names("kind of shield", [self.kind], KINDS)
        check_names("margin of a shield", [self.margin], MARGINS)
        numbers = [each.name for each in fields(self) if each.name not in ("kind", "margin")]
        given = [name for name in numbers if getattr(self, name) is not None]
        for name in given:
            if not math.isfinite(getattr(self, name)):
                raise ConfigError(f"{name} must be a finite number, got {getattr(self, name)}.")
        check_fields(self, "be positive", "deceleration_m_s2", "retreat_gain_hz")
        check_fields(
            self, "not be negative", *(name for name in given if name not in MAY_BE_NEGATIVE)
        )
        for name in MAY_BE_NEGATIVE:
            if getattr(self, name) < 0.0:
                warnings.warn(
                    f"{name} is {getattr(self, name)} m: a negative margin takes away from the "
                    "distance that protects people.",
                    stacklevel=4,
                )

    def load_bounds(self) -> ErrorBounds:
        """Return the calibrated bounds on errors; with constant margins, there are none.

        Raises:
            ConfigError: the bounds are missing or were made with another version of a subsystem.
        """
        return load_error_bounds() if self.margin == "conformal" else make_no_bounds()

    def make_params(self) -> ShieldParams:
        """Return the settings as arguments of compiled kernels."""
        speed_m_s = self.worker_speed_m_s
        margins_m = np.where(IS_FOREARM_OR_HAND, self.hand_margin_m, self.margin_m)
        return ShieldParams(
            margins_m=margins_m,
            protrusion_m=load_enclosure().protrusion_m,
            bounds=self.load_bounds(),
            n_sigmas=float(self.n_sigmas),
            min_uncertainty_m=float(self.min_uncertainty_m),
            prediction_growth_m_s=float(self.prediction_growth_m_s),
            single_view_std_m=float(self.single_view_std_m),
            single_view_sigmas=float(self.single_view_sigmas),
            follows_estimate=speed_m_s is None,
            worker_m_s=float(self.worker_speed_margin_m_s if speed_m_s is None else speed_m_s),
            travel_s=float(self.worker_time_s + self.latency_s),
            reaction_s=float(self.reaction_s),
            deceleration_m_s2=float(self.deceleration_m_s2),
            gain_hz=float(self.retreat_gain_hz),
            retreat_m_s=float(self.max_retreat_m_s),
            creep_m_s=float(self.creep_m_s),
        )


PRESETS = {
    "ssm": ShieldConfig("ssm"),
    "qp": ShieldConfig("qp"),
    "pfl": ShieldConfig("pfl", max_retreat_m_s=0.0),
    "sara": ShieldConfig("sara", worker_speed_m_s=WALKING_M_S),
}
"""Settings of the built-in shields, by the names that the argument `shield` accepts."""
