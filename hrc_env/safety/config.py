"""Settings of the built-in shields."""

import math
from dataclasses import dataclass, fields

import numpy as np

from hrc_env.core.errors import ConfigError, check_fields, check_names
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.typing import Records

KINDS = ("qp", "ssm", "pfl")
NUMBERS = (
    "margin_m", "hand_margin_m", "sigmas", "least_sigmas_m", "predicted_m_s", "doubtful_m",
    "doubtful_sigmas", "human_m_s", "human_margin_m_s", "human_s", "latency_s", "reaction_s",
    "deceleration_m_s2", "gain_hz", "retreat_m_s", "unseen_s", "unknown_m_s", "welcome_m_s",
    "still_m_s",
)  # fmt: skip
SETTINGS = np.dtype([(name, "f8") for name in NUMBERS], align=True)
"""The same as kernels read them."""


MARGINS = ("margin_m", "hand_margin_m")
"""Numbers that may be negative."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class ShieldConfig:
    """Settings of a built-in shield: its kind, margins and limits.

    D is the clearance between a robot's capsule and a segment of an estimated body: the gap of
    their surfaces, less a margin, less Z_d, less the worker's travel.
    """

    kind: str = "qp"
    """"qp": the nearest joint velocities that keep every row; "ssm": one factor on all joints;
    "pfl": as "qp", but touches as slow as the region of the body bears are allowed."""
    margin_m: float = 0.05
    """Taken off every gap: bodies are no capsules [m]. Below 0 the shield comes nearer than it
    believes to be safe, as `experiment price` does to find an equal rate of contacts."""
    hand_margin_m: float = 0.13
    """The same of forearms and hands, which are nearly all that is touched [m]."""
    sigmas: float = 2.0
    """Z_d in standard deviations of the estimate along the line between the two,"""
    least_sigmas_m: float = 0.05
    """and at least this [m]."""
    predicted_m_s: float = 0.7
    """So much of the deviation for every second since the part of the body was seen is of the
    prediction and counts once: late images that say so are reported with regions that are too wide
    [m/s]."""
    doubtful_m: float = 0.08
    """A larger deviation is of a part that one camera carries, which is wrong by more than it says
    [m]: what is above counts"""
    doubtful_sigmas: float = 5.0
    """so many times more."""
    human_m_s: float | None = None
    """The worker's speed towards the robot, as 1.6 of ISO 13855; None: as it is estimated, and
    `human_margin_m_s` more [m/s]."""
    human_margin_m_s: float = 0.2
    """How much faster than estimated the worker may be [m/s]."""
    human_s: float = 0.2
    """How long the worker is thought to come on [s],"""
    latency_s: float = 0.0
    """and for how long what is estimated is older than it says, as of late images that do not say
    when they were taken [s]."""
    reaction_s: float = 0.08
    """Until the robot's command takes effect [s]."""
    deceleration_m_s2: float = 3.0
    """How fast a point of the robot comes to rest, if its joints can [m/s^2]."""
    gain_hz: float = 4.0
    """How fast a robot that is too near gets away: D times this [1/s],"""
    retreat_m_s: float = 1.0
    """at most so fast; 0: it only comes no nearer ("ssm" never does more) [m/s]."""
    unseen_s: float = 0.25
    """Who was seen longer ago than this [s] may be as far from there as somebody walks since at
    `human_m_s` (None: 1.6); within that the robot comes no nearer to where they were. They are
    unknown, as who has no track: images that are later than this make robots slow."""
    unknown_m_s: float = 0.25
    """Speed limit of every point of the robot while a worker is lost, lower within 1 m of their
    last place and 0 within 0.25 m, and near floor that one camera alone has seen empty [m/s].
    Before any look the robot stands. 0: stop."""
    welcome_m_s: float = 0.25
    """To parts of people that a task lets come to the robot's hand, as to take what it brings
    (`Task.allowed_contact`), the hand and what it carries may come so fast, and no faster than the
    region bears; 0: not at all [m/s]."""
    still_m_s: float = 0.02
    """Other links may come to them so fast where nothing else allows it: corrections that keep in
    its place what is held; with none they add up to a way [m/s]."""

    def __post_init__(self) -> None:
        check_names("kind of shield", [self.kind], KINDS)
        for each in fields(self):
            value = getattr(self, each.name)
            if each.name in NUMBERS and value is not None and not math.isfinite(value):
                raise ConfigError(f"{each.name} must be a finite number, got {value}.")
        check_fields(self, "be positive", "deceleration_m_s2", "gain_hz")
        given = [
            name for name in NUMBERS if getattr(self, name) is not None and name not in MARGINS
        ]
        check_fields(self, "not be negative", *given)

    def record(self) -> Records:
        """Return the settings as one row of `SETTINGS`; a speed that is None is NaN."""
        numbers = (getattr(self, name) for name in NUMBERS)
        return np.array([tuple(math.nan if x is None else x for x in numbers)], SETTINGS)


PRESETS = {
    "ssm": ShieldConfig("ssm"),
    "qp": ShieldConfig("qp"),
    "pfl": ShieldConfig("pfl", retreat_m_s=0.0),
}
"""By the names that `shield=` takes."""
