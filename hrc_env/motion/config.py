"""Settings of the workers' behaviour."""

from collections import namedtuple
from dataclasses import dataclass, field, fields

from hrc_env.core.errors import ConfigError
from hrc_env.motion.clip import Clip
from hrc_env.motion.errands import TASKS, Task, check_tasks
from hrc_env.motion.people import PeopleConfig

Range = tuple[float, float]


@dataclass(frozen=True)
class MotionConfig:
    """What a worker does and how fast; ranges are drawn from uniformly.

    "Judgement" marks choices that no source fixes; change them to study another workplace.
    """

    near_probability: float = 0.85
    """Chance that the next errand is at the robot; judgement, so that the two often meet."""
    near_radius_m: Range = (1.0, 1.35)
    """Distance from the base axis when working with the robot [m]: its targets within reach."""
    near_azimuth_rad: float = 0.785
    """Greatest angle from the robot's front there [rad]; judgement."""
    dwell_s: Range = (6.0, 16.0)
    """Time at one place before another errand [s]; judgement."""
    spacing_m: float = 1.1
    """Workers choose no place this near to another worker's [m]; judgement."""
    near_pause_s: Range = (0.5, 2.0)
    """Length of a pause at the robot [s]; judgement."""
    away_pause_s: Range = (1.0, 4.0)
    """Length of a pause elsewhere [s]; judgement."""

    target_radius_m: Range = (0.45, 0.9)
    """Distance of a hand's target from the base axis [m]: inside the robot's workspace."""
    target_z_m: Range = (0.85, 1.4)
    """Height of a hand's target [m]: bench to shoulder."""
    target_spread_rad: float = 0.45
    """Greatest angle between target and worker seen from the base axis [rad]; judgement."""
    hand_speed_m_s: Range = (0.5, 1.5)
    """Peak speed of a reaching hand [m/s]; calm manual work."""
    sudden_speed_m_s: float = 2.5
    """Peak speed of a sudden reach [m/s]; judgement, near the fastest arm movements at work."""
    two_hands_probability: float = 0.3
    """Chance that both hands reach; judgement."""
    hold_s: Range = (0.2, 1.4)
    """Time that the hands work at the target [s]; judgement."""
    lift_s: Range = (1.0, 1.4)
    """Time to bend down to a load, and again to raise it [s]; about 1.3 m/s at the wrists."""
    load_z_m: Range = (0.15, 0.45)
    """Height of the grips on a load on the floor or a low box [m]; judgement."""

    people: PeopleConfig = field(default_factory=PeopleConfig)
    """How the workers are with the robot and their work; the environment's `people` by name."""
    tasks: tuple[Task, ...] = TASKS
    """What they do, and what follows what."""
    motions: tuple[str | Clip, ...] = ()
    """Clips of recorded motion that workers play, too (docs/people_and_scenes.md)."""
    motions_probability: float = 0.5
    """Chance that a worker with empty hands plays one next, where there is room for it."""

    def __post_init__(self) -> None:
        """Check ranges and probabilities."""
        for item in fields(self):
            value = getattr(self, item.name)
            if item.name.endswith(("_m", "_s")) and isinstance(value, tuple):
                if value[0] > value[1]:
                    raise ConfigError(f"{item.name} must be (low, high), got {value}.")
            elif item.name.endswith("_probability") and not 0.0 <= value <= 1.0:
                raise ConfigError(f"{item.name} must lie in [0, 1], got {value}.")
        if self.spacing_m < 0.8:
            raise ConfigError(
                f"spacing_m must be 0.8 or more, or workers would touch: {self.spacing_m}."
            )
        check_tasks(self.tasks)
        for motion in self.motions:
            if not isinstance(motion, str | Clip):
                raise ConfigError(f"motions must hold paths or clips, got {motion!r}.")


COMPILED = (
    "target_radius_m", "target_z_m", "target_spread_rad", "hand_speed_m_s", "sudden_speed_m_s",
    "two_hands_probability", "hold_s", "lift_s", "load_z_m",
)  # fmt: skip
"""The settings that compiled code reads."""
Numbers = namedtuple("Numbers", (*COMPILED, "robot_xy_m", "sudden_probability"))


def numbers(config: MotionConfig, robot_xy_m: Range) -> Numbers:
    """What compiled code reads, as a named tuple, which it can take."""
    values = [getattr(config, name) for name in COMPILED]
    values += [robot_xy_m, config.people.sudden_probability]
    return Numbers(*(tuple(map(float, v)) if isinstance(v, tuple) else float(v) for v in values))
