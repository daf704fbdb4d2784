"""Settings of the worker's behaviour."""

from collections import namedtuple
from dataclasses import dataclass, fields

from hrc_env.errors import ConfigError

Range = tuple[float, float]


@dataclass(frozen=True)
class MotionConfig:
    """What a worker does and how fast; ranges are drawn from uniformly.

    "Judgement" marks choices that no source fixes; change them to study another workplace.
    """

    robot_xy_m: Range = (-0.75, 0.0)
    """Robot's base axis on the floor [m]; from the arena."""
    robot_front_rad: float = 0.0
    """Direction that the robot's front looks to, from world +x [rad]; from the arena."""
    walkable_x_m: Range = (-0.1, 2.4)
    """Where workers stand and walk [m]; from the arena, with room to its walls."""
    walkable_y_m: Range = (-2.0, 2.0)
    """The same along y [m]."""
    clearance_m: float = 0.8
    """Paths keep this far from the base axis [m]: a pedestal's radius and half a person."""

    near_probability: float = 0.75
    """Chance that the next place is at the robot; judgement, so that the two often meet."""
    near_radius_m: Range = (1.0, 1.35)
    """Distance from the base axis when working with the robot [m]: its targets within reach."""
    near_azimuth_rad: float = 0.785
    """Greatest angle from the robot's front there [rad]; judgement."""
    away_radius_m: Range = (1.7, 2.6)
    """Distance from the base axis when working elsewhere [m]; judgement."""
    away_azimuth_rad: float = 0.9
    """Greatest angle from the robot's front there [rad]; the walkable area's share."""
    dwell_s: Range = (6.0, 16.0)
    """Time at one place before walking on [s]; judgement."""
    spacing_m: float = 1.0
    """Workers avoid places this near to another worker's [m]; judgement."""

    near_reach_probability: float = 0.8
    """Chance that a worker at the robot reaches next (else pauses); judgement."""
    away_lift_probability: float = 0.35
    """Chance that a worker elsewhere lifts something next; judgement."""
    away_reach_probability: float = 0.3
    """Chance that a worker elsewhere reaches for something next; judgement."""
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
    sudden_probability: float = 0.05
    """Chance that a reach is sudden; ISO 13855's approach speeds are for such."""
    sudden_speed_m_s: float = 2.5
    """Peak speed of a sudden reach [m/s]; judgement, near the fastest arm movements at work."""
    two_hands_probability: float = 0.3
    """Chance that both hands reach; judgement."""
    hold_s: Range = (0.2, 1.4)
    """Time that the hands work at the target [s]; judgement."""

    speed_m_s: Range = (0.8, 1.4)
    """Walking speed of a worker, one for an episode [m/s]; adults indoors."""
    lift_s: Range = (1.0, 1.4)
    """Time to bend down to a load, and again to raise it [s]; about 1.3 m/s at the wrists."""
    load_z_m: Range = (0.15, 0.45)
    """Height of the grips on a load on the floor or a low box [m]; judgement."""

    def __post_init__(self) -> None:
        """Check ranges and probabilities."""
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, tuple):
                if item.name != "robot_xy_m" and value[0] > value[1]:
                    raise ConfigError(f"{item.name} must be (low, high), got {value}.")
            elif item.name.endswith("_probability") and not 0.0 <= value <= 1.0:
                raise ConfigError(f"{item.name} must lie in [0, 1], got {value}.")
        if self.near_radius_m[0] < self.clearance_m:
            raise ConfigError(
                f"near_radius_m must be at least clearance_m = {self.clearance_m}, "
                f"got {self.near_radius_m}."
            )
        if self.away_lift_probability + self.away_reach_probability > 1.0:
            raise ConfigError("away_lift_probability + away_reach_probability must be at most 1.")


_Numbers = namedtuple("_Numbers", [item.name for item in fields(MotionConfig)])


def numbers(config: MotionConfig) -> tuple:
    """The settings as a named tuple with the same attributes, which compiled code can take."""
    return _Numbers(
        *(
            tuple(map(float, value)) if isinstance(value, tuple) else float(value)
            for value in (getattr(config, item.name) for item in fields(config))
        )
    )
