"""Settings of the built-in shields."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import ClassVar, NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError, check_fields, check_names
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.skeleton import HAND_SEGMENTS, SEGMENT_ENDS
from hrc_env.core.typing import Bools, Floats

KINDS = ("qp", "ssm", "pfl")
MARGINS = ("margin_m", "hand_margin_m")
"""Settings that may be negative."""
IS_FOREARM_OR_HAND: Bools = np.array(
    [False] * 6 + [True] * 2 + [False] * (len(SEGMENT_ENDS) - 8) + [True] * len(HAND_SEGMENTS)
)
"""Mask of the segments to which `ShieldConfig.hand_margin_m` applies (S,)."""


class ShieldParams(NamedTuple):
    """Numbers of a `ShieldConfig` in the form that kernels read."""

    margins_m: Floats
    """`margin_m` or `hand_margin_m` of each segment of a body (S,) [m]."""
    n_sigmas: float
    """Uncertainty margin Z_d in standard deviations."""
    min_uncertainty_m: float
    """Lower bound on the uncertainty margin Z_d [m]."""
    prediction_growth_m_s: float
    """Share of the standard deviation that comes from prediction, per second without a detection
    [m/s]."""
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
    """Greatest deceleration of a point of the robot [m/s^2]."""
    gain_hz: float
    """Speed of a retreat divided by the depth of the violation [1/s]."""
    retreat_m_s: float
    """Upper bound on the speed of a retreat [m/s]."""
    creep_m_s: float
    """Speed of small corrections near segments that may be touched [m/s]."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class ShieldConfig:
    """Settings of a built-in shield: its kind, margins and limits.

    The clearance D is the gap between the surfaces of a robot's capsule and a segment of an
    estimated body, less a margin, less the uncertainty margin Z_d, less the worker's travel until
    the robot has stopped.
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
    """Method: "qp" takes the nearest joint velocities that keep all constraints; "ssm" scales all
    joint velocities by one factor; "pfl" is "qp" that also allows touches, up to the speed that the
    touched region of the body tolerates."""
    margin_m: float = 0.05
    """Distance subtracted from every gap, since bodies are not capsules [m]. With a negative value
    the shield permits less distance than the estimate requires, which `experiment price` uses to
    find an equal rate of contacts."""
    hand_margin_m: float = 0.13
    """Distance subtracted instead of `margin_m` for forearms and hands, which are involved in
    nearly all contacts [m]."""
    n_sigmas: float = 2.0
    """Uncertainty margin Z_d, in standard deviations of the estimate along the line between robot
    and worker."""
    min_uncertainty_m: float = 0.05
    """Lower bound on the uncertainty margin Z_d [m]."""
    prediction_growth_m_s: float = 0.7
    """Share of the standard deviation that comes from prediction, per second since a part of the
    body was last detected [m/s]. It counts once instead of `n_sigmas` times, because the predicted
    uncertainty of late images that carry their time is too large."""
    single_view_std_m: float = 0.08
    """Standard deviation above which a part of the body is assumed to be located by a single
    camera, whose errors exceed the reported ones [m]."""
    single_view_sigmas: float = 5.0
    """Additional factor on the standard deviation above `single_view_std_m`."""
    worker_speed_m_s: float | None = None
    """Speed of a worker towards the robot, 1.6 in ISO 13855 [m/s]; None for the estimated speed
    plus `worker_speed_margin_m_s`."""
    worker_speed_margin_m_s: float = 0.2
    """Amount by which a worker may be faster than estimated [m/s]."""
    worker_time_s: float = 0.2
    """Time for which a worker is assumed to keep approaching at that speed [s]."""
    latency_s: float = 0.0
    """Additional age of the estimate, for late images that do not carry their time [s]."""
    reaction_s: float = 0.08
    """Time until a command of the robot takes effect [s]."""
    deceleration_m_s2: float = 3.0
    """Greatest deceleration of a point of the robot, if its joints can achieve it [m/s^2]."""
    retreat_gain_hz: float = 4.0
    """Speed of a retreat divided by the amount by which the clearance is negative [1/s]."""
    max_retreat_m_s: float = 1.0
    """Upper bound on the speed of a retreat [m/s]; with 0 the robot only stops approaching, as
    "ssm" always does."""
    stale_after_s: float = 0.25
    """Time since the last detection after which a worker counts as lost [s]. A lost worker may have
    walked at `worker_speed_m_s` (None: 1.6 m/s) from the last detected position, which the robot
    does not approach within that distance. Lost workers are unknown, like those without a track;
    images that are later than this time slow the robot down."""
    unknown_speed_limit_m_s: float = 0.25
    """Speed limit of every point of the robot while a worker is lost, and near floor that only one
    camera has seen empty [m/s]; 0 stops the robot. Between 1 m and 0.25 m from the lost worker's
    last position the limit decreases to zero. Before the first image the robot stands still."""
    contact_speed_m_s: float = 0.25
    """Greatest speed of the robot's hand and its load towards segments that a task allows to touch
    them, as in a handover (`Task.allowed_contact`), but no faster than the region of the body
    tolerates [m/s]; 0 forbids touches."""
    creep_m_s: float = 0.02
    """Speed at which other links may approach these segments if the clearance permits less [m/s];
    small corrections keep an object in place while it is handed over."""

    def __post_init__(self) -> None:
        check_names("kind of shield", [self.kind], KINDS)
        numbers = [each.name for each in fields(self) if each.name != "kind"]
        given = [name for name in numbers if getattr(self, name) is not None]
        for name in given:
            if not math.isfinite(getattr(self, name)):
                raise ConfigError(f"{name} must be a finite number, got {getattr(self, name)}.")
        check_fields(self, "be positive", "deceleration_m_s2", "retreat_gain_hz")
        check_fields(self, "not be negative", *(name for name in given if name not in MARGINS))

    def make_params(self) -> ShieldParams:
        """Return the settings as kernels read them."""
        speed_m_s = self.worker_speed_m_s
        return ShieldParams(
            margins_m=np.where(IS_FOREARM_OR_HAND, self.hand_margin_m, self.margin_m),
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
}
"""The built-in shields, by the names that `shield=` accepts."""
