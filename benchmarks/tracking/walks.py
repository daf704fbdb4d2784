"""Seeded motion of people who walk and gesture, with rigid bones.

This motion is independent of the package's motion generator, on which the estimators were tuned. A
walker moves through the area at 0.9 to 1.5 m/s and turns back before its edge. The legs swing with
the stride, and the arms gesture intermittently with wrist speeds of up to 3 m/s.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.tracking.rigs import DT_S
from hrc_env.core.skeleton import JOINT, N_JOINTS
from hrc_env.core.typing import Floats, Points3
from hrc_env.geometry.rotations import about_axis

_SUBSTEPS = 8
_SHORTEST = 500
"""Minimum number of frames over which noise is scaled to unit variance; shorter walks are the
beginnings of longer ones.
"""
_NOISE_TAU_S = (1.5, 0.8, 1.2, 0.6, 0.6)
"""Time scales of the noise in speed, steering, lean and the gestures of both arms [s]."""
_TURN_RATE, _TURN_TAU_S = 2.5, 0.25
_UPPER_ARM_M, _FOREARM_M, _THIGH_M, _SHANK_M, _FOOT_M = 0.29, 0.26, 0.43, 0.42, 0.15
_HIP_HEIGHT_M, _GROUND_M = 0.92, 0.02


@dataclass(frozen=True, slots=True)
class Gait:
    """Parameters of a gait."""

    speed_m_s: tuple[float, float, float]
    """Minimum, mean and maximum speed [m/s]."""
    cycles_per_m: float = 0.72
    """Number of gait cycles per metre [1/m]."""
    thigh_rad: float = 0.45
    """Amplitude of the thighs' swing [rad]."""
    knee_rad: float = 0.55
    """Additional flexion of the knee while its leg swings forward [rad]."""
    arm_rad: float = 0.4
    """Amplitude of the upper arms' swing [rad]."""
    elbow_rad: float = 0.3
    """Flexion of the elbows [rad]."""
    bounce_m: float = 0.02
    """Amplitude of the hips' vertical motion [m]."""


WALKING = Gait((0.9, 1.25, 1.5))


@dataclass(frozen=True, slots=True)
class Path:
    """Paths of S walkers and phases of their limbs in T frames of 0.04 s, as arrays (T, S)."""

    ground: Floats
    """Position on the ground (T, S, 2) [m]."""
    heading: Floats
    stride: Floats
    """Phase of the gait cycle [rad]."""
    lean: Floats
    gesture: Floats
    """Intensity of the gestures of the left and right arm (T, S, 2), in [0, 1]."""
    gait: Gait = WALKING


def walk(
    walk_m: tuple[float, float], seeds: list[int], n_frames: int, gait: Gait = WALKING
) -> Points3:
    """Return joint positions (T, S, J, 3) of one walker per seed at 25 Hz [m].

    Each walker depends only on its seed. The area is centred at the origin; `walk_m` is half of its
    length and width.
    """
    return walk_along(steer(walk_m, seeds, max(n_frames, _SHORTEST), gait))[:n_frames]


def walk_along(path: Path) -> Points3:
    """Return joint positions (T, S, J, 3) of walkers that follow paths [m]."""
    body = _body(path)
    joints = np.einsum("tsij,tskj->tski", about_axis("z", path.heading), body)
    joints[..., :2] += path.ground[:, :, None]
    joints[..., 2] += (_HIP_HEIGHT_M + path.gait.bounce_m * np.cos(2 * path.stride))[..., None]
    below = _GROUND_M - joints[..., 2].min(-1)
    joints[..., 2] += np.maximum(below, 0.0)[..., None]  # keeps bones rigid
    return joints


def steer(
    walk_m: tuple[float, float], seeds: list[int], n_frames: int, gait: Gait = WALKING
) -> Path:
    """Simulate the steering of one walker per seed in substeps, and return the paths per frame."""
    dt, n_steps = DT_S / _SUBSTEPS, n_frames * _SUBSTEPS
    rngs = [np.random.default_rng([seed, 1]) for seed in seeds]
    starts = np.stack([rng.uniform(-0.5, 0.5, 3) for rng in rngs])
    noise = np.stack([_smooth(rng, n_steps, dt) for rng in rngs], -1)  # (5, n, S)
    least, usual, most = gait.speed_m_s
    speed = np.clip(usual + 0.2 * noise[0], least, most)
    wander = 0.8 * noise[1]
    place, heading = starts[:, :2].copy(), 2 * np.pi * (starts[:, 2] + 0.5)
    turning = np.zeros(len(seeds))
    places, headings = np.empty((n_steps, len(seeds), 2)), np.empty((n_steps, len(seeds)))
    for k in range(n_steps):
        far = np.maximum(np.abs(place[:, 0]) / walk_m[0], np.abs(place[:, 1]) / walk_m[1])
        back = np.arctan2(-place[:, 1], -place[:, 0]) - heading
        back = (back + np.pi) % (2 * np.pi) - np.pi
        home = 2.5 * back * np.minimum(1.0, 4 * (far - 0.75)) + 0.3 * wander[k]
        wanted = np.clip(np.where(far > 0.75, home, wander[k]), -_TURN_RATE, _TURN_RATE)
        turning += (wanted - turning) * dt / _TURN_TAU_S
        heading = heading + turning * dt
        direction = np.stack([np.cos(heading), np.sin(heading)], -1)
        place = place + (speed[k] * dt)[:, None] * direction
        places[k], headings[k] = place, heading
    stride = 2 * np.pi * np.cumsum(gait.cycles_per_m * speed, 0) * dt
    shown = slice(None, None, _SUBSTEPS)
    return Path(
        ground=places[shown],
        heading=headings[shown],
        stride=stride[shown],
        lean=(0.08 + 0.25 * np.clip(noise[2] - 0.8, 0, 1.5))[shown],
        gesture=np.moveaxis(np.clip(noise[3:] - 0.3, 0, 1.2) / 1.2, 0, -1)[shown],
        gait=gait,
    )


def _smooth(rng: np.random.Generator, n_steps: int, dt: float) -> Floats:
    """Sample white noise (5, n), smoothed by Gaussian windows and scaled to unit variance.

    The widths of the windows are `_NOISE_TAU_S`.
    """
    width = np.array(_NOISE_TAU_S) / dt
    padded = n_steps + int(8 * width.max())
    spectrum = np.fft.rfft(rng.standard_normal((len(width), padded)))
    frequency = np.fft.rfftfreq(padded)
    spectrum *= np.exp(-0.5 * (2 * np.pi * frequency * width[:, None]) ** 2)
    smooth = np.fft.irfft(spectrum, padded)[:, :n_steps]
    return smooth / smooth.std(1, keepdims=True)


def _limb(angle: Floats, length_m: float) -> Points3:
    """Return vectors along a limb that hangs down at angle 0 and swings forward [m]."""
    return length_m * np.stack([np.sin(angle), np.zeros_like(angle), -np.cos(angle)], -1)


def _body(path: Path) -> Points3:
    """Return joints (T, S, J, 3) relative to the midpoint of the hips (forward, left, up) [m]."""
    body = np.zeros((*path.heading.shape, N_JOINTS, 3))
    lean, upright = np.sin(path.lean), np.cos(path.lean)
    level = np.zeros_like(lean)
    chest = 0.5 * np.stack([lean, level, upright], -1)
    body[..., JOINT["nose"], :] = np.stack([0.65 * lean + 0.12, level, 0.68 * upright], -1)
    twist = -0.1 * np.sin(path.stride)
    across = 0.18 * np.stack([-np.sin(twist), np.cos(twist), level], -1)
    time_s = DT_S * np.arange(len(lean), dtype=float)[:, None]
    for side, sign in (("left", 1.0), ("right", -1.0)):
        swing = path.stride + (0.0 if sign > 0 else np.pi)
        leg = _leg(swing, sign, path.gait)
        for name, points in zip(("hip", "knee", "ankle", "foot"), leg, strict=True):
            body[..., JOINT[f"{side}_{name}"], :] = points
        gesture = path.gesture[..., 0 if sign > 0 else 1]
        arm = _arm(chest + sign * across, swing, gesture, sign, time_s, path.gait)
        for name, points in zip(("shoulder", "elbow", "wrist"), arm, strict=True):
            body[..., JOINT[f"{side}_{name}"], :] = points
    return body


def _leg(swing: Floats, sign: float, gait: Gait) -> tuple[Points3, ...]:
    """Return the positions of hip, knee, ankle and foot of one side [m]."""
    thigh = gait.thigh_rad * np.sin(swing)
    shank = thigh - 0.15 - gait.knee_rad * np.clip(np.cos(swing), 0, 1) ** 2
    hip = np.broadcast_to(np.array([0.0, 0.11 * sign, 0.0]), (*swing.shape, 3))
    knee = hip + _limb(thigh, _THIGH_M)
    ankle = knee + _limb(shank, _SHANK_M)
    return hip, knee, ankle, ankle + _limb(shank + 1.35, _FOOT_M)


def _arm(
    shoulder: Points3, swing: Floats, gesture: Floats, sign: float, time_s: Floats, gait: Gait
) -> tuple[Points3, ...]:
    """Return the positions of shoulder, elbow and wrist of one side [m].

    A gesture raises, spreads and shakes the arm.
    """
    pace = 2 * np.pi * (0.7 if sign > 0 else 0.95)
    start = 0.0 if sign > 0 else 1.0
    shake = gesture * (0.9 + 0.75 * np.sin(pace * time_s + start))
    upper = -gait.arm_rad * np.sin(swing) + shake
    fore = upper + gait.elbow_rad + gesture * (0.6 + 0.5 * np.sin(1.3 * pace * time_s))
    outward = about_axis("x", sign * (0.1 + 0.5 * gesture))
    elbow = shoulder + np.einsum("tsij,tsj->tsi", outward, _limb(upper, _UPPER_ARM_M))
    return shoulder, elbow, elbow + np.einsum("tsij,tsj->tsi", outward, _limb(fore, _FOREARM_M))
