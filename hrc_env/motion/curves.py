"""Smooth curves and places on the floor that every activity is made of; never `fastmath`."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats


@kernel
def min_jerk(u: float) -> float:
    """0 to 1 over u, at rest at both ends, else held; peak rate 1.875 (Flash & Hogan 1985)."""
    u = min(max(u, 0.0), 1.0)
    return u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)


@kernel
def ramp(u: float) -> float:
    """Integral of a smoothstep: distance while speed grows smoothly from 0 to 1, then stays."""
    if u <= 0.0:
        return 0.0
    if u >= 1.0:
        return u - 0.5
    return u * u * u * (1.0 - 0.5 * u)


@kernel
def cruise(u: float, share: float) -> float:
    """0 to 1 over u in [0, 1] at constant speed but for smooth ramps of `share` at each end."""
    u, top = min(max(u, 0.0), 1.0), share / (1.0 - share)
    if u < 0.5:
        return top * ramp(u / share)
    return 1.0 - top * ramp((1.0 - u) / share)


@kernel
def hump(u: float) -> float:
    """0 at the ends of [0, 1], 1 in the middle, flat to second order at the ends; 0 outside."""
    u = min(max(u, 0.0), 1.0)
    v = 4.0 * u * (1.0 - u)
    return v * v * v


@kernel
def soft_min(a: float, b: float, width: float) -> float:
    """The smaller one, rounded off (downwards) where the two differ by less than `width`."""
    closeness = max(1.0 - abs(a - b) / width, 0.0)
    return min(a, b) - width * closeness * closeness * closeness / 6.0


@kernel
def saturate(d: float, knee: float, limit: float) -> float:
    """d up to `knee`, then bending smoothly so that it never passes `limit`."""
    if d <= knee:
        return d
    span = limit - knee
    return knee + span * math.tanh((d - knee) / span)


@kernel
def decay(u: float, duration: float, value: float, rate: float) -> float:
    """Quintic from (value, rate, 0) at u = 0 to rest at zero at u = 1 (inertialisation)."""
    if u >= 1.0:
        return 0.0
    v = rate * duration
    a3 = -10.0 * value - 6.0 * v
    a4 = 15.0 * value + 8.0 * v
    a5 = -6.0 * value - 3.0 * v
    return value + u * (v + u * u * (a3 + u * (a4 + u * a5)))


@kernel
def wrap(angle: float) -> float:
    """The same direction in (-pi, pi]."""
    return math.atan2(math.sin(angle), math.cos(angle))


@kernel
def placed(x: float, y: float, yaw: float, ahead: float, left: float) -> tuple[float, float]:
    """The point so far ahead and to the left of who is at (x, y) and faces yaw."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    return x + cos * ahead - sin * left, y + sin * ahead + cos * left


@kernel
def shift(q: Floats, at: int, yaw: float, ahead: float, left: float) -> None:
    """Move the point (q[at], q[at + 1]) ahead and to the left of who faces yaw."""
    q[at], q[at + 1] = placed(q[at], q[at + 1], yaw, ahead, left)


@kernel
def about(pitch: float, pivot_x: float, pivot_z: float) -> tuple[float, float]:
    """How far forward and up the ankle goes when the foot pitches about a point of its own."""
    cos, sin = math.cos(pitch), math.sin(pitch)
    return pivot_x * (1.0 - cos) - pivot_z * sin, pivot_z * (1.0 - cos) + pivot_x * sin
