"""The built-in shields: joint velocities at which every row of `rows` holds.

"ssm" takes one factor on all joints, which keeps the path. "qp" and "pfl" take the nearest
velocities that the arm can reach in a step. J row that asks to get away is two of them: to come no
nearer, which hardly anything outweighs, and only then to get away: with one, an arm that flees from
a hand pushes its wrist into the other.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from hrc_env.belief import Belief
from hrc_env.core.errors import needed
from hrc_env.core.kernels import kernel
from hrc_env.core.records import PoseEstimate
from hrc_env.core.typing import Bools, Floats, Ints, JointVelocities
from hrc_env.geometry import chains
from hrc_env.geometry.chains import lever
from hrc_env.geometry.distances import segments
from hrc_env.safety.config import ShieldConfig
from hrc_env.safety.contact import SEGMENT_REGIONS, permitted_contact_speed
from hrc_env.safety.robot import RobotModel
from hrc_env.safety.rows import ABSENT_M, MOST_ROWS, tightest_rows
from hrc_env.safety.solver import exceeded, solve

NO_NEARER, AWAY = 1e4, 30.0
"""Weights of a row's excess [m/s], against changes of joint velocities [rad/s]."""
HOLDS_M_S = 1e-6
"""J row that is exceeded by less holds."""


def guarded(
    now: Belief, wanted: JointVelocities, dt_s: float, config: ShieldConfig
) -> tuple[JointVelocities, Mapping[str, Floats]]:
    """What a shield of these settings makes of a command, as `shield.Shield`; it says:

    - "least_m" (B,): the least D of pairs that matter [m], NaN where there is none;
    - "slack" (B,): by how much the worst row is exceeded, retreats included [m/s];
    - "unknown" (B,): 1 while a worker may be anywhere, so that the speed is capped.

    Raises:
        ConfigError: the belief has no `RobotModel` or no command in force.
    """
    model = needed(now.model, "J robot's model (RobotModel), which a built-in shield needs,")
    in_force = needed(now.command, "The command in force, which a built-in shield needs,")
    settings, batch = config.record(), len(wanted)
    if config.kind == "ssm":
        low, high = np.minimum(wanted, 0.0), np.maximum(wanted, 0.0)
    else:
        low, high = _within_reach(model, in_force, dt_s)
    frames, link = chains.forward(model.chain, now.robot.q), _links(model, now)
    robot = frames, model.chain.slides, link, now.robot.capsules_world
    count, least_m = np.empty(batch, np.int64), np.empty(batch)
    J, b = np.empty((batch, MOST_ROWS, wanted.shape[1])), np.empty((batch, MOST_ROWS))
    tightest_rows(
        (*robot, now.robot.capsule_radius_m, low, high, model.slew_rad_s2),
        _bodies(now, model, config), settings, (J, b, count, least_m),
    )  # fmt: skip
    unknown = somebody_unknown(now.estimate)
    allowed, slack = np.empty_like(wanted), np.empty(batch)
    limit = np.where(unknown, config.unknown_m_s, np.inf)
    choose = _scaled if config.kind == "ssm" else _nearest
    choose(J, b, count, low, high, wanted, allowed)
    _capped(robot, limit, allowed)
    _slack(J, b, count, allowed, slack)
    least_m[np.isinf(least_m)] = np.nan
    return allowed, {"least_m": least_m, "slack": slack, "unknown": unknown.astype(float)}


def somebody_unknown(estimate: PoseEstimate) -> Bools:
    """(B,) whether a worker may be there whom no track follows."""
    return np.any(~estimate.tracked, axis=1)


def _within_reach(
    model: RobotModel, in_force: JointVelocities, dt_s: float
) -> tuple[JointVelocities, JointVelocities]:
    """Least and greatest command (B, N) that actions ask for and the slew reaches in a step."""
    most, change = model.fastest_rad_s, model.slew_rad_s2 * dt_s
    low = np.minimum(np.maximum(-most, in_force - change), most)
    high = np.maximum(np.minimum(most, in_force + change), -most)
    return low, high


def _links(model: RobotModel, now: Belief) -> Ints:
    """(K,) the link of every capsule; what is carried moves as the last one does."""
    n_loads = len(now.robot.capsule_radius_m) - len(model.chain.capsule_link)
    return np.append(model.chain.capsule_link, np.full(n_loads, model.chain.n_joints - 1))


def _bodies(now: Belief, model: RobotModel, config: ShieldConfig) -> tuple[Any, ...]:
    """What `rows` wants to know of the workers."""
    estimate, touch_m_s = now.estimate, np.zeros((len(now.action), len(SEGMENT_REGIONS)))
    if config.kind == "pfl":
        carried = 0.0 if now.objects is None else now.objects.held @ model.load_kg
        mass_kg = np.broadcast_to(model.mass_kg + carried, len(touch_m_s))
        speeds = {name: permitted_contact_speed(name, mass_kg) for name in set(SEGMENT_REGIONS)}
        touch_m_s = np.stack([speeds[name] for name in SEGMENT_REGIONS], axis=1)
    return (
        segments(estimate.mean_world), estimate.mean_world, estimate.velocity_world,
        estimate.cov_world, estimate.tracked, touch_m_s,
    )  # fmt: skip


@kernel
def _scaled(J, b, count, low, high, wanted, allowed):
    """One factor on all joints."""
    for e in range(len(wanted)):
        share = 1.0
        for r in range(count[e]):
            speed = exceeded(J[e, r], 0.0, wanted[e])
            if speed > 0.0:
                share = min(share, max(b[e, r], 0.0) / speed)
        for i in range(wanted.shape[1]):
            allowed[e, i] = share * wanted[e, i]


@kernel(makes_arrays=True)
def _nearest(J, b, count, low, high, wanted, allowed):
    """The nearest within reach; what is wanted itself, beyond reach or not, where all rows hold."""
    n = wanted.shape[1]
    rows, bound = np.empty((2 * MOST_ROWS, n)), np.empty(2 * MOST_ROWS)
    weight, work = np.empty(2 * MOST_ROWS), np.empty((n + 3, n))
    for e in range(len(wanted)):
        m, worst, x = 0, -np.inf, allowed[e]
        for i in range(n):
            x[i] = min(high[e, i], max(low[e, i], wanted[e, i]))
        for r in range(count[e]):
            worst = max(worst, exceeded(J[e, r], b[e, r], x))
            rows[m], bound[m], weight[m] = J[e, r], max(b[e, r], 0.0), NO_NEARER
            m += 1
            if b[e, r] < 0.0:
                rows[m], bound[m], weight[m] = J[e, r], b[e, r], AWAY
                m += 1
        if worst <= HOLDS_M_S:
            for i in range(n):
                x[i] = wanted[e, i]
        else:
            solve(rows, bound, weight, m, low[e], high[e], wanted[e], x, work)


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
