"""The built-in shields: joint velocities at which every row of `rows` holds.

"ssm" takes one factor on all joints, which keeps the path. "qp" and "pfl" take the nearest
velocities that the arm can reach in a step. A row that asks to get away is two of them: to come no
nearer, which hardly anything outweighs, and only then to get away: with one, an arm that flees from
a hand pushes its wrist into the other.

A task may let parts of estimated bodies come to the robot's hand (`Task.allowed_contact`):
forearms and hands of the one who takes a tool, or works at what is held. As long as these come no
faster than their region bears in a touch of this arm with its load
(`contact.permitted_contact_speed`), no link has to get away from them, which would take away what
is held for them; and the last link and its load may touch them, at `welcome_m_s` at most, both
speeds together no faster than the region bears. Nothing else changes: not for other people and
other parts of theirs, nor how near other links come of themselves but for `still_m_s`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from hrc_env.belief import Belief
from hrc_env.core.errors import needed
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Bools, Floats, Ints, JointVelocities, Transforms
from hrc_env.core.vacancy import WALKING_M_S
from hrc_env.geometry import chains
from hrc_env.geometry.chains import lever
from hrc_env.geometry.distances import segments
from hrc_env.geometry.robot_model import RobotModel
from hrc_env.safety.config import ShieldConfig
from hrc_env.safety.contact import SEGMENT_REGIONS, permitted_contact_speed
from hrc_env.safety.rows import ABSENT_M, MOST_ROWS, floor_rows, tightest_rows
from hrc_env.safety.solver import exceeded, solve
from hrc_env.safety.unseen import HAND_M, find_undetected

NO_NEARER, AWAY = 1e4, 30.0
"""Weights of a row's excess [m/s], against changes of joint velocities [rad/s]."""
HOLDS_M_S = 1e-6
"""A row that is exceeded by less holds."""


@dataclass(frozen=True, slots=True, eq=False)
class Arm:
    """How the robots stand that a shield commands."""

    model: RobotModel
    frames: Transforms
    """(B, N, 4, 4) world_from_link of every joint's link."""
    links: Ints
    """(K,) the link of every capsule."""


class Constraints(NamedTuple):
    """What commands of a step must keep, J qd <= b, and from what they can be chosen."""

    J: Floats
    """(B, M, N) of these rows the first `n_rows`,"""
    b: Floats
    """(B, M) [m/s]."""
    n_rows: Ints
    """(B,)."""
    low: JointVelocities
    """(B, N) the least"""
    high: JointVelocities
    """and the greatest command within reach [rad/s]."""
    least_m: Floats
    """(B,) least D of pairs that matter [m]; infinite without."""


def guarded(
    now: Belief, wanted: JointVelocities, dt_s: float, config: ShieldConfig
) -> tuple[JointVelocities, Mapping[str, Floats]]:
    """What a shield of these settings makes of a command, as `shield.Shield`; it says:

    - "least_m" (B,): the least D of pairs that matter [m], NaN where there is none;
    - "slack" (B,): by how much the worst row is exceeded, retreats included [m/s];
    - "unknown" (B,): 1 while it is not known where a worker is, or not detected lately.

    Raises:
        ConfigError: the belief has no `RobotModel` or no command in force.
    """
    arm, undetected = describe_arm(now), find_undetected(now, config)
    found = constraints(now, arm, undetected.lost, wanted, dt_s, config)
    allowed, slack = np.empty_like(wanted), np.empty(len(wanted))
    choose = _scaled if config.kind == "ssm" else _nearest
    choose(tuple(found), wanted, allowed)
    moving = arm.frames, arm.model.chain.slides, arm.links, now.robot.capsules_world
    _capped(moving, undetected.limit_m_s, allowed)
    _slack(found.J, found.b, found.n_rows, allowed, slack)
    least_m = np.where(np.isinf(found.least_m), np.nan, found.least_m)
    unknown = now.estimate.unknown | undetected.lost
    said = {"least_m": least_m, "slack": slack, "unknown": unknown.any(1).astype(float)}
    return allowed, said


def constraints(
    now: Belief, arm: Arm, lost: Bools, wanted: JointVelocities, dt_s: float, config: ShieldConfig
) -> Constraints:
    """Return the tightest rows of every robot.

    Of "ssm" only velocities between rest and `wanted` are within reach; of others those that the
    slew reaches until the next command.

    Args:
        now: what the robots believe.
        arm: their frames.
        lost: (B, W) the workers that were detected once, but not lately.
        wanted: (B, N) the velocities that are asked for [rad/s].
        dt_s: time until the next command [s].
        config: margins and gains.
    """
    model, batch = arm.model, len(wanted)
    low, high = np.minimum(wanted, 0.0), np.maximum(wanted, 0.0)
    if config.kind != "ssm":
        in_force = needed(now.command, "The command in force, which a built-in shield needs,")
        low, high = _within_reach(model, in_force, dt_s)
    J, b = np.empty((batch, MOST_ROWS, model.chain.n_joints)), np.empty((batch, MOST_ROWS))
    found = Constraints(J, b, np.empty(batch, np.int64), low, high, np.empty(batch))
    robot, rows = now.robot, (J, b, found.n_rows, found.least_m)
    moving = (
        arm.frames, model.chain.slides, arm.links, robot.capsules_world, robot.capsule_radius_m,
        low, high, model.slew_rad_s2,
    )  # fmt: skip
    people, settings, floor = _bodies(now, arm, lost, config), config.record(), now.unseen
    tightest_rows(moving, people, settings, rows)
    if floor is not None and np.isfinite(floor.possible_m).any():
        come_m = WALKING_M_S * (floor.age_s + config.reaction_s + config.latency_s)
        where = floor.floor_world, floor.level, floor.piece_m + HAND_M + come_m
        floor_rows(moving, where, settings, rows)
    return found


def describe_arm(now: Belief) -> Arm:
    """Return how the robots stand; of loads the links are the last ones, as they move so."""
    model = needed(now.model, "A robot's model (RobotModel), which a built-in shield needs,")
    n_loads = len(now.robot.capsule_radius_m) - len(model.chain.capsule_link)
    carried = np.full(n_loads, model.chain.n_joints - 1)
    links = np.append(model.chain.capsule_link, carried)
    return Arm(model, chains.link_frames(model.chain, now.robot.q), links)


def _within_reach(
    model: RobotModel, in_force: JointVelocities, dt_s: float
) -> tuple[JointVelocities, JointVelocities]:
    """Least and greatest command (B, N) that actions ask for and the slew reaches in a step."""
    most, change = model.fastest_rad_s, model.slew_rad_s2 * dt_s
    low = np.minimum(np.maximum(-most, in_force - change), most)
    high = np.maximum(np.minimum(most, in_force + change), -most)
    return low, high


def _bodies(now: Belief, arm: Arm, lost: Bools, config: ShieldConfig) -> tuple[Any, ...]:
    """What `rows` wants to know of the workers, of whom some are `lost` (B, W)."""
    estimate = now.estimate
    mean, velocity, cov = estimate.mean_world, estimate.velocity_world, estimate.cov_world
    touch_m_s, most_m_s = _touches(now, arm, config)
    if lost.any():
        gone = lost[..., None, None]
        mean, velocity = np.where(gone, estimate.seen_world, mean), np.where(gone, 0.0, velocity)
        cov, touch_m_s = np.where(gone[..., None], 0.0, cov), np.where(gone[..., 0], 0.0, touch_m_s)
    walking_m_s = WALKING_M_S if config.human_m_s is None else config.human_m_s
    gone_m = np.where(lost, walking_m_s * estimate.blind_s, 0.0)
    return (
        segments(mean), mean, velocity, cov, estimate.age_s, estimate.tracked | lost, gone_m,
        touch_m_s, most_m_s,
    )  # fmt: skip


def _touches(now: Belief, arm: Arm, config: ShieldConfig) -> tuple[Floats, Floats]:
    """Relative speeds of touches that are allowed (B, W, S), and each capsule's share (K,) [m/s]:
    of "pfl" all there is; else the last link's touches of who is welcome."""
    model, link, shape = arm.model, arm.links, (*now.estimate.tracked.shape, len(SEGMENT_REGIONS))
    if config.kind == "pfl":
        welcome, most_m_s = np.ones(shape, bool), np.full(len(link), np.inf)
    elif now.allowed_contact is None:
        return np.zeros(shape), np.zeros(len(link))
    else:
        is_last = link == model.chain.n_joints - 1
        welcome, most_m_s = now.allowed_contact, np.where(is_last, config.welcome_m_s, 0.0)
    carried = 0.0 if now.objects is None else now.objects.held @ model.load_kg
    mass_kg = np.broadcast_to(model.mass_kg + carried, len(now.action))
    speeds = {name: permitted_contact_speed(name, mass_kg) for name in set(SEGMENT_REGIONS)}
    bears_m_s = np.stack([speeds[name] for name in SEGMENT_REGIONS], axis=1)[:, None]
    return np.where(welcome, bears_m_s, 0.0), most_m_s


@kernel
def _scaled(found, wanted, allowed):
    """One factor on all joints."""
    J, b, count, _, _, _ = found
    for e in range(len(wanted)):
        share = 1.0
        for r in range(count[e]):
            speed = exceeded(J[e, r], 0.0, wanted[e])
            if speed > 0.0:
                share = min(share, max(b[e, r], 0.0) / speed)
        for i in range(wanted.shape[1]):
            allowed[e, i] = share * wanted[e, i]


@kernel(makes_arrays=True)
def _nearest(found, wanted, allowed):
    """The nearest within reach; what is wanted itself, beyond reach or not, where all rows hold."""
    J, b, count, low, high, _ = found
    n = wanted.shape[1]
    rows, bound = np.empty((2 * MOST_ROWS, n)), np.empty(2 * MOST_ROWS)
    weight, work = np.empty(2 * MOST_ROWS), np.empty((n + 3, n))
    for e in range(len(wanted)):
        holds, x = True, allowed[e]
        for i in range(n):
            x[i] = min(high[e, i], max(low[e, i], wanted[e, i]))
        for r in range(count[e]):
            holds &= exceeded(J[e, r], b[e, r], x) <= HOLDS_M_S
        if holds:
            for i in range(n):
                x[i] = wanted[e, i]
        else:
            m = softened(J[e], b[e], count[e], rows, bound, weight)
            solve(rows[:m], bound[:m], weight[:m], low[e], high[e], wanted[e], x, work)


@kernel
def softened(J, b, count, rows, bound, weight):
    """Write rows with their weights, those that ask for a retreat twice (2 M); how many."""
    m = 0
    for r in range(count):
        for away in range(2 if b[r] < 0.0 else 1):
            for i in range(J.shape[1]):
                rows[m, i] = J[r, i]
            bound[m] = b[r] if away else max(b[r], 0.0)
            weight[m] = AWAY if away else NO_NEARER
            m += 1
    return m


@kernel
def _capped(robot, limit_m_s, allowed):
    """Take joint velocities down together until no end of a capsule is faster than the limit."""
    frames, slides, link, capsules = robot
    for e in range(len(allowed)):
        if limit_m_s[e] == np.inf:
            continue
        fastest = 0.0
        for c in range(len(link)):
            for end in range(2):
                point, vx, vy, vz = capsules[e, c, end], 0.0, 0.0, 0.0
                for i in range(link[c] + 1 if abs(point[0]) <= ABSENT_M else 0):
                    x, y, z = lever(frames[e, i], slides[i], point)
                    qd = allowed[e, i]
                    vx, vy, vz = vx + qd * x, vy + qd * y, vz + qd * z
                fastest = max(fastest, math.sqrt(vx * vx + vy * vy + vz * vz))
        if fastest > limit_m_s[e]:
            for i in range(allowed.shape[1]):
                allowed[e, i] *= limit_m_s[e] / fastest


@kernel
def _slack(J, b, count, allowed, slack):
    for e in range(len(allowed)):
        slack[e] = 0.0
        for r in range(count[e]):
            slack[e] = max(slack[e], exceeded(J[e, r], b[e, r], allowed[e]))
