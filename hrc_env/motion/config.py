"""Settings of the workers' motion, and presets of their behaviour near the robot."""

from dataclasses import dataclass, field, fields, replace
from typing import NamedTuple

import numpy as np

from hrc_env.core.errors import ConfigError, check_names
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.motion.clip import Clip
from hrc_env.motion.points import Point
from hrc_env.motion.reaches import (
    HOLD_S,
    Range,
    Reach,
    ReachDistribution,
    ReachLimits,
    check_script,
)
from hrc_env.motion.schedule import JOBS, Job, check_jobs

FOUND = ("qp", "none")
"""Names of the shields of the robots against which reaches were searched; "none" for no shield."""


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class PeopleConfig:
    """Attention, pace and caution of workers; defaults without a source are estimates."""

    notice_m: float = 0.40
    """Distance from chest, head or a hand within which workers notice the robot's arm [m]."""
    fast_m_s: float = 0.6
    """Approach speed of the arm above which workers notice it within twice `notice_m` [m/s]."""
    delay_s: Range = (0.4, 0.8)
    """Reaction time after noticing the arm [s], longer than that to an expected signal."""
    pause_probability: float = 0.4
    """Probability that a worker reacts with a pause, in which the hands or the walker stop."""
    step_back_probability: float = 0.15
    """Probability that a worker reacts by withdrawing the hands and stepping back."""
    pause_s: Range = (0.6, 1.6)
    """Duration of a pause [s]."""
    calm_s: float = 4.0
    """Time after a reaction during which the worker does not react again [s]."""
    detour_m: float = 0.55
    """Distance that walkers keep from the robot's tool and elbow [m]; 0 to ignore the robot."""
    speed_m_s: Range = (0.8, 1.4)
    """Walking speed of a worker, sampled once per episode [m/s], typical of adults indoors."""
    tempo: float = 1.0
    """Factor applied to the durations of pauses and of stays at a workplace."""
    sudden_probability: float = 0.05
    """Probability that a reach is sudden, as the approach speeds of ISO 13855 assume."""
    lunge_probability: float = 0.01
    """Probability that a reach to the robot is a lunge (a step and a reach in half a second)."""
    stumble_probability: float = 0.01
    """Probability that a worker stumbles during a walk."""
    fall_probability: float = 0.0
    """Probability that a walker with empty hands stumbles and falls, if there is room ahead."""
    lie_s: Range = (1.5, 5.0)
    """Time for which a fallen worker lies on the floor before getting up [s]."""
    stay_down_probability: float = 0.15
    """Probability that a fallen worker lies on the floor for 15 to 40 s instead of `lie_s`."""
    run_probability: float = 0.0
    """Probability that a worker with empty hands runs if the path is sufficiently long."""
    run_m_s: Range = (2.5, 3.5)
    """Speed of a run [m/s]; 2.5 m/s requires a path of 2.4 m, and 3.5 m/s a path of 4.4 m."""
    careless_probability: float = 0.01
    """Probability that a worker steps back without looking between two tasks."""
    reaches: str | tuple[Reach, ...] | ReachDistribution = ()
    """Script of the worker's reaches at the robot, a tuple of `Reach`; or a `ReachDistribution`,
    from which every episode samples a script; or "qp" or "none", the distribution that
    `python -m benchmarks adversary` found for the scripted robot with this shield or without one.
    After its last reach, and if the worker is not at the robot, it behaves like other people. A
    script requires a robot arm, at most one worker and no `motions`."""

    def __post_init__(self) -> None:
        """Check that ranges and probabilities are within their bounds."""
        _check_ranges(self)
        for name in (each.name for each in fields(self) if each.name != "reaches"):
            value = getattr(self, name)
            if np.min(value) < 0.0:
                raise ConfigError(f"{name} must be 0 or more, got {value}.")
        if isinstance(self.reaches, str):
            check_names("reaches", [self.reaches], FOUND)
        if self.pause_probability + self.step_back_probability > 1.0:
            raise ConfigError("pause_probability + step_back_probability must be at most 1.")
        if not 0.3 <= self.speed_m_s[0] <= self.speed_m_s[1] <= 2.0:
            raise ConfigError(f"speed_m_s must lie in [0.3, 2], got {self.speed_m_s}.")
        if not 2.0 <= self.run_m_s[0] <= self.run_m_s[1] <= 4.0:
            raise ConfigError(f"run_m_s must lie in [2, 4], got {self.run_m_s}.")
        if not self.tempo > 0.0:
            raise ConfigError(f"tempo must be positive, got {self.tempo}.")


def _check_ranges(config: "PeopleConfig | MotionConfig") -> None:
    """Raise `ConfigError` if a range is not ascending or a probability is not in [0, 1]."""
    for name in (item.name for item in fields(config)):
        value = getattr(config, name)
        if name.endswith(("_m", "_s")) and isinstance(value, tuple) and value[0] > value[1]:
            raise ConfigError(f"{name} must be (low, high), got {value}.")
        if name.endswith("_probability") and not 0 <= getattr(config, name) <= 1:
            raise ConfigError(f"{name} must lie in [0, 1], got {value}.")


_UNAWARE = PeopleConfig(
    notice_m=0.0,
    fast_m_s=99.0,
    pause_probability=0.0,
    step_back_probability=0.0,
    detour_m=0.0,
    sudden_probability=0.08,
    lunge_probability=0.02,
    stumble_probability=0.01,
    careless_probability=0.04,
)
PEOPLE: dict[str, PeopleConfig] = {
    "attentive": PeopleConfig(),
    "hurried": PeopleConfig(
        notice_m=0.25,
        fast_m_s=1.0,
        pause_probability=0.2,
        step_back_probability=0.05,
        pause_s=(0.3, 0.8),
        detour_m=0.3,
        speed_m_s=(1.2, 1.7),
        tempo=0.55,
        sudden_probability=0.12,
        lunge_probability=0.03,
        stumble_probability=0.03,
        careless_probability=0.02,
    ),
    "unaware": _UNAWARE,
    "headlong": PeopleConfig(
        speed_m_s=(1.1, 1.6),
        tempo=0.4,
        stumble_probability=0.1,
        fall_probability=0.3,
        run_probability=0.6,
    ),
    "adversary": replace(_UNAWARE, reaches="qp"),
}
"""Presets of people by name.

"attentive" workers watch the robot, "hurried" workers react to it less often, and "unaware" workers
ignore it; "headlong" workers watch the robot, but sometimes run and fall. An "adversary" ignores
the robot and reaches where and when a search found contacts with the robot to be most likely.
"""


@dataclass(frozen=True)
class MotionConfig:
    """Activities of workers and their speeds. Values are sampled uniformly from the ranges."""

    near_probability: float = 0.85
    """Probability that the next errand is at the robot.

    The value is an estimate, chosen for frequent encounters.
    """
    near_radius_m: Range = (1.0, 1.35)
    """Distance of workers at the robot from its base axis [m].

    At this distance, the targets in the robot's workspace are within reach of the workers.
    """
    near_azimuth_rad: float = 0.785
    """Maximum angle about the base axis between the robot's front and a worker at the robot [rad].

    The value is an estimate.
    """
    dwell_s: Range = (6.0, 16.0)
    """Duration of a stay at one workplace before the next errand [s]. The values are estimates."""
    spacing_m: float = 1.1
    """Minimum distance between the workplaces of two workers [m]. The value is an estimate."""
    near_pause_s: Range = (0.5, 2.0)
    """Duration of a pause at the robot [s]. The values are estimates."""
    away_pause_s: Range = (1.0, 4.0)
    """Duration of a pause elsewhere [s]. The values are estimates."""

    target_radius_m: Range = (0.45, 0.9)
    """Distance of a hand's target in the robot's workspace from the base axis [m]."""
    target_z_m: Range = (0.85, 1.4)
    """Height of a hand's target [m], from bench to shoulder."""
    target_spread_rad: float = 0.45
    """Maximum angle between target and worker about the base axis [rad].

    The value is an estimate.
    """
    hand_speed_m_s: Range = (0.5, 1.5)
    """Peak speed of a reaching hand [m/s], typical of calm manual work."""
    sudden_speed_m_s: float = 2.5
    """Peak speed of a sudden reach [m/s].

    The value is an estimate close to the fastest arm movements at work.
    """
    two_hands_probability: float = 0.3
    """Probability that a reach uses both hands. The value is an estimate."""
    hold_s: Range = (0.2, 1.4)
    """Time for which the hands work at the target [s]. The values are estimates."""
    lift_s: Range = (1.0, 1.4)
    """Time to bend down to a load, and to raise it [s]; the wrists move at up to about 1.3 m/s."""
    load_z_m: Range = (0.15, 0.45)
    """Height of the grips of a load that stands on the floor or a low box [m].

    The values are estimates.
    """

    people: PeopleConfig = field(default_factory=PeopleConfig)
    """Attention, pace and caution of the workers; settings also accept the name of a preset."""
    jobs: tuple[Job, ...] = JOBS
    """Jobs of the workers and their order; settings also accept the name of a preset.

    "framing" is the default; "low_work" adds jobs near the robot's foot that are done kneeling,
    squatting or bent over (docs/workers_and_scenes.md).
    """
    motions: tuple[str | Clip, ...] = ()
    """Clips that workers play, or paths of clip files (docs/motion_capture.md)."""
    motions_probability: float = 0.5
    """Probability that a worker with empty hands plays a clip next, if there is room for it."""

    def __post_init__(self) -> None:
        """Check the ranges, probabilities, jobs and clips."""
        _check_ranges(self)
        if self.spacing_m < 0.8:
            raise ConfigError(
                "spacing_m must be 0.8 or more, as workers would touch otherwise, got "
                f"{self.spacing_m}."
            )
        check_jobs(self.jobs)
        if isinstance(self.people.reaches, tuple):
            check_script(self.people.reaches, self.reach_limits)
        for motion in self.motions:
            if not isinstance(motion, str | Clip):
                raise ConfigError(f"motions must be paths or clips, got {motion!r}.")

    @property
    def reach_limits(self) -> ReachLimits:
        """Ranges of the parameters of scripted reaches, from which other reaches are sampled."""
        return ReachLimits(
            radius_m=self.target_radius_m,
            azimuth_rad=(-self.target_spread_rad, self.target_spread_rad),
            z_m=self.target_z_m,
            peak_m_s=(self.hand_speed_m_s[0], self.sudden_speed_m_s),
            hold_s=(HOLD_S, self.hold_s[1]),
        )


class HandParams(NamedTuple):
    """Settings of reaches and lifts for compiled kernels; ranges are (minimum, maximum)."""

    target_radius_m: Range
    """Distance of a hand's target from the base axis [m]."""
    target_z_m: Range
    """Height of a hand's target [m]."""
    target_spread_rad: float
    """Maximum angle between target and worker about the base axis [rad]."""
    hand_speed_m_s: Range
    """Peak speed of a reaching hand [m/s]."""
    sudden_speed_m_s: float
    """Peak speed of a sudden reach [m/s]."""
    two_hands_probability: float
    """Probability that a reach uses both hands."""
    hold_s: Range
    """Time for which the hands work at the target [s]."""
    lift_s: Range
    """Time to bend down to a load, and time to raise it [s]."""
    load_z_m: Range
    """Height of the grips of a load that stands on the floor or a low box [m]."""
    robot_xy_m: Point
    """Position of the robot's base axis on the floor [m]."""
    sudden_probability: float
    """Probability that a reach is sudden."""


def make_hand_params(config: MotionConfig, robot_xy_m: Point) -> HandParams:
    """Return the settings of reaches and lifts for compiled kernels."""
    return HandParams(
        target_radius_m=_to_floats(config.target_radius_m),
        target_z_m=_to_floats(config.target_z_m),
        target_spread_rad=float(config.target_spread_rad),
        hand_speed_m_s=_to_floats(config.hand_speed_m_s),
        sudden_speed_m_s=float(config.sudden_speed_m_s),
        two_hands_probability=float(config.two_hands_probability),
        hold_s=_to_floats(config.hold_s),
        lift_s=_to_floats(config.lift_s),
        load_z_m=_to_floats(config.load_z_m),
        robot_xy_m=Point(float(robot_xy_m[0]), float(robot_xy_m[1])),
        sudden_probability=float(config.people.sudden_probability),
    )


def _to_floats(limits: Range) -> Range:
    """Convert a range to floats, the type for which kernels are compiled."""
    return float(limits[0]), float(limits[1])
