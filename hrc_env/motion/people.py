"""How people are with the robot and with their work: presets by name, and settings of one's own."""

from dataclasses import dataclass, fields

from hrc_env.core.errors import ConfigError

Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class PeopleConfig:
    """What workers notice of the robot and do then, and how briskly they go about their work.

    Judgement where no source is named; change them to study other people.
    """

    notice_m: float = 0.40
    """Workers notice a part of the arm that comes so near to trunk, head or a hand [m]."""
    fast_m_s: float = 0.6
    """From up to twice as far they notice one that comes at them faster than this [m/s]."""
    delay_s: Range = (0.4, 0.8)
    """Time from then until they react [s]: longer than to a signal one waits for; judgement."""
    pause_probability: float = 0.4
    """Chance that they pause: hands stay where they are, walkers come to a stand."""
    step_back_probability: float = 0.15
    """Chance that they take their hands away and step back."""
    pause_s: Range = (0.6, 1.6)
    """How long a pause lasts [s]."""
    calm_s: float = 4.0
    """After a reaction nothing startles them for so long [s]."""
    detour_m: float = 0.55
    """Paths keep so far from where tool and elbow are when a walk begins [m]; 0: they do not."""
    speed_m_s: Range = (0.8, 1.4)
    """Walking speed of a worker, one for an episode [m/s]; adults indoors."""
    tempo: float = 1.0
    """Pauses between two things to do, and stays at one place, take this much of their time."""
    sudden_probability: float = 0.05
    """Chance that a reach is sudden; ISO 13855's approach speeds are for such."""
    lunge_probability: float = 0.01
    """Chance that a reach to the robot is a lunge: a step, and the hand there in half a second."""
    stumble_probability: float = 0.01
    """Chance that a walker's foot catches on something."""
    careless_probability: float = 0.01
    """Chance that a worker takes a few steps back between two things to do, without looking."""

    def __post_init__(self) -> None:
        """Check ranges and probabilities."""
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, tuple):
                if not 0.0 <= value[0] <= value[1]:
                    raise ConfigError(f"{item.name} must be (low, high) >= 0, got {value}.")
            elif item.name.endswith("_probability") and not 0.0 <= value <= 1.0:
                raise ConfigError(f"{item.name} must lie in [0, 1], got {value}.")
            elif value < 0.0:
                raise ConfigError(f"{item.name} must be 0 or more, got {value}.")
        if self.pause_probability + self.step_back_probability > 1.0:
            raise ConfigError("pause_probability + step_back_probability must be at most 1.")
        if not 0.3 <= self.speed_m_s[0] <= self.speed_m_s[1] <= 2.0:
            raise ConfigError(f"speed_m_s must lie in [0.3, 2], got {self.speed_m_s}.")
        if not self.tempo > 0.0:
            raise ConfigError(f"tempo must be positive, got {self.tempo}.")


PEOPLE: dict[str, PeopleConfig] = {
    "attentive": PeopleConfig(),
    "hurried": PeopleConfig(
        notice_m=0.25, fast_m_s=1.0, pause_probability=0.2, step_back_probability=0.05,
        pause_s=(0.3, 0.8), detour_m=0.3, speed_m_s=(1.2, 1.7), tempo=0.55,
        sudden_probability=0.12, lunge_probability=0.03, stumble_probability=0.03,
        careless_probability=0.02,
    ),
    "unaware": PeopleConfig(
        notice_m=0.0, fast_m_s=99.0, pause_probability=0.0, step_back_probability=0.0,
        detour_m=0.0, sudden_probability=0.08, lunge_probability=0.02,
        stumble_probability=0.01, careless_probability=0.04,
    ),
}  # fmt: skip
"""By name: who looks out for the robot, who has no time to, who does not know that it moves."""
