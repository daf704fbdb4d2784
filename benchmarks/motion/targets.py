"""Target bands for statistics of motions, based on measurements of people, with their sources."""

from dataclasses import dataclass

CMU = "CMU motion capture, 68 walking trials"
CMU_WORK = "CMU motion capture, trials of manual work"
CMU_ALL = "CMU motion capture, 99.9th percentile of real clips"
JUDGEMENT = "judgement"
WALKS_M_S = (0.8, 1.1, 1.3, 1.4, 1.8)
"""Speeds of the walks in the repertoire [m/s]."""
ANY = "*"
"""Wildcard for all motions."""


@dataclass(frozen=True, slots=True)
class Target:
    """A band within which a statistic of a motion should lie, and its source."""

    scene: str
    statistic: str
    low: float
    high: float
    source: str


def _walk(speed: float) -> list[Target]:
    """Return the bands of a walk at a speed [m/s], mostly within 10 % of fits to trials."""
    name = format_walk(speed)
    cadence, length = 96.2 * speed**0.468, 0.345 + 0.286 * speed
    return [
        Target(name, "cadence_per_min", 0.9 * cadence, 1.1 * cadence, CMU),
        Target(name, "step_length_m", 0.9 * length, 1.1 * length, CMU),
        Target(name, "step_width_m", 0.05, 0.09, CMU),
        Target(name, "bob_m", 0.02, 0.04, CMU),
        Target(name, "knee_flexion_deg", 68.0, 76.0, CMU),
    ]


def _limbs(speed: float, wrist: float, ankle: float) -> list[Target]:
    """Return the speed bands of wrists and ankles in a walk, within 10 % of 95th percentiles."""
    name = format_walk(speed)
    return [
        Target(name, "wrist_p95_m_s", 0.9 * wrist, 1.1 * wrist, CMU),
        Target(name, "ankle_p95_m_s", 0.9 * ankle, 1.1 * ankle, CMU),
    ]


def format_walk(speed_m_s: float) -> str:
    """Return the name of the motion that is a walk at a speed [m/s]."""
    return f"walk {speed_m_s:.1f} m/s"


TARGETS: tuple[Target, ...] = (
    *(target for speed in WALKS_M_S for target in _walk(speed)),
    *_limbs(1.1, 1.7, 3.4),
    *_limbs(1.3, 1.9, 3.7),
    *_limbs(1.4, 2.7, 4.2),
    Target("box from the floor to a table", "pelvis_low_m", 0.57, 1.01, CMU_WORK),
    Target("box from the floor to a table", "wrist_max_m_s", 1.3, 2.3, CMU_WORK),
    Target("box from the floor to a table", "head_p95_m_s", 0.0, 1.6, CMU_WORK),
    Target("saw", "wrist_p95_m_s", 1.25, 2.0, CMU_WORK),
    Target("hammer on a table", "wrist_p95_m_s", 1.25, 2.0, CMU_WORK),
    Target("hammer at a wall", "wrist_p95_m_s", 1.25, 2.0, CMU_WORK),
    Target("drill", "wrist_p95_m_s", 1.25, 2.0, CMU_WORK),
    Target("hammer lightly", "wrist_p95_m_s", 1.26, 1.54, CMU_WORK),
    Target("measure", "wrist_p95_m_s", 0.4, 1.0, "calm table work, CMU"),
    Target("lunge", "wrist_max_m_s", 2.5, 3.5, "assumed, motion.md"),
    Target(ANY, "slip_p95_m_s", 0.0, 0.05, "stance feet must not creep"),
    Target(ANY, "wrist_p999_m_s2", 0.0, 62.0, CMU_ALL),
    Target(ANY, "ankle_p999_m_s2", 0.0, 51.0, CMU_ALL),
    Target(ANY, "grip_missed_share", 0.0, 0.01, JUDGEMENT),
    Target(ANY, "inside_itself_share", 0.0, 0.02, JUDGEMENT),
)


def list_targets(scene: str) -> list[Target]:
    """Return the target bands of a motion."""
    return [target for target in TARGETS if target.scene in (scene, ANY)]
