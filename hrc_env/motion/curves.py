"""Smooth curves and planar geometry for the activities.

These kernels are never compiled with `fastmath`.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion.points import Point, SagittalShift


@kernel
def min_jerk(u: float) -> float:
    """Return a minimum-jerk rise from 0 to 1 over u in [0, 1], at rest at both ends.

    The peak rate is 1.875 (Flash & Hogan 1985).
    """
    u = min(max(u, 0.0), 1.0)
    return u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)


@kernel
def ramp(u: float) -> float:
    """Return the distance travelled by u at a speed that rises smoothly from 0 to 1 over [0, 1]."""
    if u <= 0.0:
        return 0.0
    if u >= 1.0:
        return u - 0.5
    return u * u * u * (1.0 - 0.5 * u)


@kernel
def cruise(u: float, share: float) -> float:
    """Return a rise from 0 to 1 over u in [0, 1], with constant speed between smooth ramps.

    Args:
        u: time as a fraction of the duration.
        share: duration of the smooth ramp at each end, as a fraction of the total duration.
    """
    u, top = min(max(u, 0.0), 1.0), share / (1.0 - share)
    if u < 0.5:
        return top * ramp(u / share)
    return 1.0 - top * ramp((1.0 - u) / share)


@kernel
def hump(u: float) -> float:
    """Return a bump: 0 outside of [0, 1], 1 in the middle, flat to second order at the ends."""
    u = min(max(u, 0.0), 1.0)
    v = 4.0 * u * (1.0 - u)
    return v * v * v


@kernel
def soft_min(a: float, b: float, width: float) -> float:
    """Return a smooth minimum of two numbers, slightly below both if they are close.

    Args:
        a: first number.
        b: second number.
        width: difference below which the result is smoothed.
    """
    closeness = max(1.0 - abs(a - b) / width, 0.0)
    return min(a, b) - width * closeness * closeness * closeness / 6.0


@kernel
def saturate(d: float, knee: float, limit: float) -> float:
    """Return `d` if it is at most `knee`, otherwise a value that approaches `limit` smoothly."""
    if d <= knee:
        return d
    span = limit - knee
    return knee + span * math.tanh((d - knee) / span)


@kernel
def decay(u: float, duration: float, value: float, rate: float) -> float:
    """Return a quintic from (value, rate, 0) at u = 0 to rest at zero at u = 1 (inertialization).

    Args:
        u: time as a fraction of the duration.
        duration: duration [s].
        value: value at the beginning.
        rate: rate at the beginning [1/s].
    """
    if u >= 1.0:
        return 0.0
    v = rate * duration
    a3 = -10.0 * value - 6.0 * v
    a4 = 15.0 * value + 8.0 * v
    a5 = -6.0 * value - 3.0 * v
    return value + u * (v + u * u * (a3 + u * (a4 + u * a5)))


@kernel
def wrap(angle: float) -> float:
    """Return the angle wrapped to (-pi, pi]."""
    return math.atan2(math.sin(angle), math.cos(angle))


@kernel
def move_point(x: float, y: float, yaw: float, ahead: float, left: float) -> Point:
    """Return a point displaced along and across a heading.

    Args:
        x: world x of the point [m].
        y: world y of the point [m].
        yaw: heading [rad].
        ahead: displacement along the heading [m].
        left: displacement to the left of the heading [m].
    """
    cos, sin = math.cos(yaw), math.sin(yaw)
    return Point(x + cos * ahead - sin * left, y + sin * ahead + cos * left)


@kernel
def shift(q: Floats, at: int, yaw: float, ahead: float, left: float) -> None:
    """Displace the point (q[at], q[at + 1]) along and across a heading, in place.

    Args:
        q: array that contains the point [m].
        at: index of the point's x.
        yaw: heading [rad].
        ahead: displacement along the heading [m].
        left: displacement to the left of the heading [m].
    """
    q[at], q[at + 1] = move_point(q[at], q[at + 1], yaw, ahead, left)


@kernel
def pivot_foot(pitch: float, pivot_x: float, pivot_z: float) -> SagittalShift:
    """Return the displacement of the ankle when the foot pitches about a pivot.

    Args:
        pitch: pitch of the foot, positive with the heel up [rad].
        pivot_x: distance of the pivot ahead of the ankle [m].
        pivot_z: height of the pivot relative to the ankle [m].
    """
    cos, sin = math.cos(pitch), math.sin(pitch)
    ahead = pivot_x * (1.0 - cos) - pivot_z * sin
    return SagittalShift(ahead, pivot_z * (1.0 - cos) + pivot_x * sin)
