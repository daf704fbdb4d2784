"""Settings of the workers' behaviour, and how people are with the robot: presets by name."""

from collections import namedtuple
from dataclasses import asdict, dataclass, field, fields
from typing import Any

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.motion.clip import Clip
from hrc_env.motion.schedule import JOBS, Job, check_jobs

Range = tuple[float, float]


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class PeopleConfig:
    """What workers notice of the robot, and how brisk they are; judgement without a source."""

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
    fall_probability: float = 0.0
    """Chance that a walker with empty hands stumbles and falls, where there is room ahead."""
    lie_s: Range = (1.5, 5.0)
    """How long they lie before they get up [s]; judgement."""
    stay_down_probability: float = 0.15
    """Chance that who has fallen lies for 15 to 40 s."""
    run_probability: float = 0.0
    """Chance that someone with empty hands runs to a place, where the way is long enough."""
    run_m_s: Range = (2.5, 3.5)
    """Speed of those who run [m/s]; a way of 2.4 m allows 2.5, one of 4.4 m allows 3.5."""
    careless_probability: float = 0.01
    """Chance that a worker takes a few steps back between two things to do, without looking."""

    def __post_init__(self) -> None:
        _check_ranges(self)
        for name, value in asdict(self).items():
            if np.min(value) < 0.0:
                raise ConfigError(f"{name} must be 0 or more, got {value}.")
        if self.pause_probability + self.step_back_probability > 1.0:
            raise ConfigError("pause_probability + step_back_probability must be at most 1.")
        if not 0.3 <= self.speed_m_s[0] <= self.speed_m_s[1] <= 2.0:
            raise ConfigError(f"speed_m_s must lie in [0.3, 2], got {self.speed_m_s}.")
        if not 2.0 <= self.run_m_s[0] <= self.run_m_s[1] <= 4.0:
            raise ConfigError(f"run_m_s must lie in [2, 4], got {self.run_m_s}.")
        if not self.tempo > 0.0:
            raise ConfigError(f"tempo must be positive, got {self.tempo}.")


def _check_ranges(config: Any) -> None:
    """Refuse ranges that are not (low, high), and probabilities outside [0, 1]."""
    for name in (each.name for each in fields(config)):
        value = getattr(config, name)
        if name.endswith(("_m", "_s")) and isinstance(value, tuple) and value[0] > value[1]:
            raise ConfigError(f"{name} must be (low, high), got {value}.")
        if name.endswith("_probability") and not 0 <= getattr(config, name) <= 1:
            raise ConfigError(f"{name} must lie in [0, 1], got {value}.")


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
    "headlong": PeopleConfig(
        speed_m_s=(1.1, 1.6), tempo=0.4, stumble_probability=0.1, fall_probability=0.3,
        run_probability=0.6,
    ),
}  # fmt: skip
"""By name: who looks out for the robot, who has no time to, who does not know that it moves; who
does look out, but runs and falls."""


@dataclass(frozen=True)
class MotionConfig:
    """What a worker does and how fast; ranges are drawn from uniformly. "Judgement": no source."""

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
    jobs: tuple[Job, ...] = JOBS
    """What they do, and what follows what; the name "framing" (this) or "low_work" stands for a
    choice of jobs: with the second some are at the robot's foot, kneeling, on the haunches, bent
    (docs/people_and_scenes.md)."""
    motions: tuple[str | Clip, ...] = ()
    """Clips of recorded motion that workers play, too (docs/people_and_scenes.md)."""
    motions_probability: float = 0.5
    """Chance that a worker with empty hands plays one next, where there is room for it."""

    def __post_init__(self) -> None:
        _check_ranges(self)
        if self.spacing_m < 0.8:
            raise ConfigError(
                f"spacing_m must be 0.8 or more, or workers would touch: {self.spacing_m}."
            )
        check_jobs(self.jobs)
        for motion in self.motions:
            if not isinstance(motion, str | Clip):
                raise ConfigError(f"motions must hold paths or clips, got {motion!r}.")


Numbers = namedtuple("Numbers", (
    "target_radius_m", "target_z_m", "target_spread_rad", "hand_speed_m_s", "sudden_speed_m_s",
    "two_hands_probability", "hold_s", "lift_s", "load_z_m", "robot_xy_m", "sudden_probability",
))  # fmt: skip
"""The settings that compiled code reads, which takes named tuples."""


def numbers(config: MotionConfig, robot_xy_m: Range) -> Numbers:
    """The settings as compiled code takes them, of floats."""
    known = {**vars(config), **asdict(config.people), "robot_xy_m": robot_xy_m}
    values = [known[name] for name in Numbers._fields]
    return Numbers(*(tuple(map(float, v)) if isinstance(v, tuple) else float(v) for v in values))
