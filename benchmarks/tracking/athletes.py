"""Motions that estimators do not expect: running, spinning, somersaults and falls.

The bodies are those of `walks`. In somersaults and falls, a body is rotated about the midpoint of
its hips.
"""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.tracking.rigs import DT_S
from benchmarks.tracking.walks import Gait, Path, steer, walk, walk_along
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Floats, Points3
from hrc_env.geometry.rotations import about_axis

FALLS_S, LIES_S = 2.0, 3.0
"""Times at which people begin to fall and at which they lie on the ground [s]."""
_GROUND_M, _HOP_M = 0.02, 0.4
_PAUSE_S, _TRICK_S = (0.5, 1.5), (1.0, 1.4)
"""Ranges (min, max) of the time between two somersaults and of the duration of a somersault [s]."""
_LIES_PACE, _ROLL_RAD, _ROLL_S = 0.4, 1.5, (2.5, 5.0)
"""Factor on the speed of the limbs of a person on the ground, and amplitude [rad] and range of the
period [s] of their rolling.
"""
_LIES_LOWER_M = 0.75
SPINS_S, _EASED_S, _SPIN_RAD_S, _STEPS_HZ = 1.2, 0.4, (4.0, 8.0), 1.5
"""Start of the spinning and time to reach the full rate [s], range of the rate [rad/s], and step
rate [Hz].
"""
_ON_THE_SPOT = Gait((0.1, 0.3, 0.5), thigh_rad=0.15, knee_rad=0.2)


@dataclass(frozen=True, slots=True)
class Turns:
    """Rotations of bodies about their hips (T, S) [rad], and vertical displacements (T, S) [m]."""

    forward: Floats
    aside: Floats
    roll: Floats
    """Rotation about the longitudinal axis [rad]."""
    up_m: Floats


def run(walk_m: tuple[float, float], seeds: list[int], n_frames: int, speed_m_s: float) -> Points3:
    """Return joint positions (T, S, J, 3) of runners [m].

    Their wrists and feet reach accelerations of more than 30 m/s^2.
    """
    return walk(walk_m, seeds, n_frames, _runs(speed_m_s))


def _runs(speed_m_s: float) -> Gait:
    return Gait(
        (speed_m_s - 0.3, speed_m_s, speed_m_s + 0.3), cycles_per_m=1.45 / speed_m_s,
        thigh_rad=0.55, knee_rad=0.4, arm_rad=0.7, elbow_rad=1.4, bounce_m=0.04,
    )  # fmt: skip


def tumble(walk_m: tuple[float, float], seeds: list[int], n_frames: int) -> Points3:
    """Return joint positions (T, S, J, 3) of walkers that do somersaults [m].

    Each walker does one about every two seconds.
    """
    joints = walk(walk_m, seeds, n_frames)
    tricks = [_tricks(np.random.default_rng([seed, 7]), n_frames) for seed in seeds]
    return rotate(joints, Turns(*np.stack(tricks, -1)))


def fall(walk_m: tuple[float, float], seeds: list[int], n_frames: int) -> Points3:
    """Return joint positions (T, S, J, 3) of walkers that fall and roll from side to side [m]."""
    path = steer(walk_m, seeds, n_frames)
    time_s = DT_S * np.arange(n_frames, dtype=float)[:, None]
    lying = _ease((time_s - FALLS_S) / (LIES_S - FALLS_S))
    walked = np.cumsum(1 - lying[:, 0]) - 1  # frames of the walk until the person is on the ground
    path = replace(
        path,
        ground=_at(path.ground, walked),
        heading=_at(path.heading, walked),
        stride=_at(path.stride, np.cumsum(1 - (1 - _LIES_PACE) * lying[:, 0]) - 1),
    )
    rngs = [np.random.default_rng([seed, 8]) for seed in seeds]
    way = np.array([rng.uniform(-np.pi, np.pi) for rng in rngs])
    period_s = np.array([rng.uniform(*_ROLL_S) for rng in rngs])
    down = 0.5 * np.pi * lying
    roll = _ROLL_RAD * lying * np.sin(2 * np.pi * np.maximum(time_s - LIES_S, 0.0) / period_s)
    low = np.broadcast_to(-_LIES_LOWER_M * lying, roll.shape)
    return rotate(walk_along(path), Turns(down * np.cos(way), down * np.sin(way), roll, low))


def spin(walk_m: tuple[float, float], seeds: list[int], n_frames: int) -> Points3:
    """Return joint positions (T, S, J, 3) of people that gesture, then spin on the spot [m].

    They stand until `SPINS_S`, and then spin at 4 to 8 rad/s.
    """
    rngs = [np.random.default_rng([seed, 21]) for seed in seeds]
    rate, begin, x, y = np.array([
        (rng.uniform(*_SPIN_RAD_S) * rng.choice([-1, 1]), rng.uniform(-np.pi, np.pi),
         *rng.uniform(-0.5, 0.5, 2) * walk_m)
        for rng in rngs
    ]).T  # fmt: skip
    time_s = DT_S * np.arange(n_frames, dtype=float)[:, None]
    heading = begin + DT_S * np.cumsum(_ease((time_s - SPINS_S) / _EASED_S) * rate, 0)
    ground = np.broadcast_to(np.stack([x, y], -1), (*heading.shape, 2))
    gesture = np.clip(0.6 + 0.4 * np.sin(np.pi * time_s + begin), 0.0, 1.0)
    stride = np.broadcast_to(2 * np.pi * _STEPS_HZ * time_s, heading.shape)
    lean = np.full(heading.shape, 0.08)
    gestures = np.stack([gesture, gesture], -1)
    return walk_along(Path(ground, heading, stride, lean, gestures, _ON_THE_SPOT))


def circle(
    walk_m: tuple[float, float], seeds: list[int], n_frames: int, radius_m: float, speed_m_s: float
) -> Points3:
    """Return joint positions (T, S, J, 3) of people that run in a circle around the centre [m].

    The direction is sampled for each seed.
    """
    rngs = [np.random.default_rng([seed, 22]) for seed in seeds]
    way = np.array([rng.choice([-1.0, 1.0]) for rng in rngs])
    begin = np.array([rng.uniform(-np.pi, np.pi) for rng in rngs])
    middle = np.stack([rng.uniform(-0.3, 0.3, 2) for rng in rngs])
    gait = _runs(speed_m_s)
    way_m = speed_m_s * DT_S * np.arange(n_frames, dtype=float)[:, None]
    angle = begin + way * way_m / radius_m
    ground = middle + radius_m * np.stack([np.cos(angle), np.sin(angle)], -1)
    stride = np.broadcast_to(2 * np.pi * gait.cycles_per_m * way_m, angle.shape)
    lean, still = np.full(angle.shape, 0.2), np.zeros((*angle.shape, 2))
    return walk_along(Path(ground, angle + way * np.pi / 2, stride, lean, still, gait))


def rotate(joints: Points3, turns: Turns) -> Points3:
    """Rotate and shift joints (T, S, J, 3) [m]; raise bodies that would be below the ground."""
    left, right = joints[..., JOINT["left_hip"], :], joints[..., JOINT["right_hip"], :]
    hips, across = 0.5 * (left + right)[..., None, :], left - right
    level = about_axis("z", np.arctan2(across[..., 1], across[..., 0]) - np.pi / 2)
    angle = np.hypot(turns.forward, turns.aside)
    heading = about_axis("z", np.arctan2(turns.aside, turns.forward))
    over = heading @ about_axis("y", angle) @ heading.swapaxes(-1, -2)
    turn = level @ over @ about_axis("z", turns.roll) @ level.swapaxes(-1, -2)
    body = np.einsum("tsij,tskj->tski", turn, joints - hips) + hips
    body[..., 2] += turns.up_m[..., None]
    body[..., 2] += np.maximum(_GROUND_M - body[..., 2].min(-1), 0.0)[..., None]
    return body


def _ease(share: Floats) -> Floats:
    """Evaluate a smooth step function, which rises from 0 to 1 with zero slope at both ends."""
    share = np.clip(share, 0.0, 1.0)
    return share**2 * (3 - 2 * share)


def _at(values: Floats, frame: Floats) -> Floats:
    """Interpolate values (T, ...) at fractional frames (T,)."""
    whole = frame.astype(int)
    part = (frame - whole).reshape(-1, *(1,) * (values.ndim - 1))
    return (1 - part) * values[whole] + part * values[np.minimum(whole + 1, len(values) - 1)]


def _tricks(rng: np.random.Generator, n_frames: int) -> Floats:
    """Sample the `Turns` (4, T) of the somersaults of one body."""
    turns = np.zeros((4, n_frames))
    begin_s = rng.uniform(*_PAUSE_S)
    while begin_s < n_frames * DT_S:
        lasts_s, way = rng.uniform(*_TRICK_S), rng.choice([-np.pi, -np.pi / 2, 0.0, np.pi / 2])
        share = (DT_S * np.arange(n_frames, dtype=float) - begin_s) / lasts_s
        over = 2 * np.pi * _ease(share) * (share < 1)
        turns[0] += over * np.cos(way)
        turns[1] += over * np.sin(way)
        turns[3] += _HOP_M * np.sin(np.pi * np.clip(share, 0.0, 1.0)) ** 2
        begin_s += lasts_s + rng.uniform(*_PAUSE_S)
    return turns
