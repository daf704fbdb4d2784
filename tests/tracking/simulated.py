"""A small simulator for tests: a walking body of 15 joints seen by four cameras.

Independent of the package's motion and perception rooms on purpose, so that a test of the
estimators fails for the estimators' reasons only.
"""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.records import Keypoints
from hrc_env.core.skeleton import MIRROR, N_JOINTS
from hrc_env.geometry.cameras import pinhole, project, projections
from hrc_env.geometry.rotations import about_axis

DT = 0.04
LAB = projections(
    tuple(
        pinhole(f"camera_{k + 1}", np.array([x, y, 2.45]), np.array([0.2, 0, 1]), 90, 1920, 1080)
        for k, (x, y) in enumerate([(2.9, 2.6), (-2.9, 2.6), (-2.9, -2.6), (2.9, -2.6)])
    )
)


@dataclass(frozen=True)
class Damage:
    """What goes wrong in the detections."""

    sigma_px: float = 3.0
    occlusions: bool = False
    """Bursts of 0.5-2 s per camera and joint, and joints that few or no cameras see."""
    outliers: float = 0.0
    """Share of gross errors."""
    swaps: float = 0.0
    """Share of the time in which a camera exchanges left and right."""


HARD = Damage(occlusions=True, outliers=0.1, swaps=0.05)


def _smooth(rng, n, width):
    kernel = np.exp(-0.5 * (np.arange(-4 * width, 4 * width + 1) / width) ** 2)
    noise = np.convolve(rng.standard_normal(n + 8 * width), kernel, "valid")[:n]
    return noise / max(noise.std(), 1e-9)


def _limb(angle, length):
    """Vector from a joint, hanging down at angle 0, swinging forward."""
    return length * np.stack([np.sin(angle), 0 * angle, -np.cos(angle)], -1)


def walk(seed, n_frames, centre=(0.6, 0.0), radius=0.7):
    """(T, 15, 3) joints of somebody who walks in curves about `centre` and gestures."""
    rng = np.random.default_rng(seed)
    wanted, n_frames = n_frames, max(n_frames, 300)  # short noise would be wild
    t = np.arange(n_frames) * DT
    turn = np.cumsum(0.9 + 0.5 * _smooth(rng, n_frames, 20)) * DT
    reach = radius * (0.75 + 0.25 * np.sin(0.5 * t + rng.uniform(0, 6)))
    ground = np.array(centre) + reach[:, None] * np.stack([np.cos(turn), np.sin(1.3 * turn)], -1)
    velocity = np.gradient(ground, DT, axis=0)
    heading = np.unwrap(np.arctan2(velocity[:, 1], velocity[:, 0]))
    kernel = np.ones(9) / 9
    heading = np.convolve(np.pad(heading, 4, "edge"), kernel, "valid")
    phase = 2 * np.pi * np.cumsum(0.4 + 0.5 * np.linalg.norm(velocity, axis=1)) * DT
    body = _body_in_its_frame(rng, t, phase)
    joints = np.einsum("tij,tkj->tki", about_axis("z", heading), body)
    joints[..., :2] += ground[:, None]
    joints[..., 2] = np.maximum(joints[..., 2] + 0.92 + 0.02 * np.cos(2 * phase)[:, None], 0.02)
    return joints[:wanted]


def _body_in_its_frame(rng, t, phase):
    """(T, 15, 3) joints about the middle of the hips: x forward, y left, z up."""
    n = len(t)
    lean = 0.08 + 0.2 * np.clip(_smooth(rng, n, 30) - 0.8, 0, 1.5)
    body = np.zeros((n, N_JOINTS, 3))
    body[:, 0] = np.stack([0.65 * np.sin(lean) + 0.12, 0 * lean, 0.68 * np.cos(lean)], -1)
    chest = 0.5 * np.stack([np.sin(lean), 0 * lean, np.cos(lean)], -1)
    for side, (sign, shift) in enumerate([(1, 0.0), (-1, np.pi)]):
        swing = phase + shift
        body[:, 7 + side] = [0, 0.11 * sign, 0]
        thigh = 0.4 * np.sin(swing)
        shank = thigh - 0.15 - 0.5 * np.clip(np.cos(swing), 0, 1) ** 2
        body[:, 9 + side] = body[:, 7 + side] + _limb(thigh, 0.44)
        body[:, 11 + side] = body[:, 9 + side] + _limb(shank, 0.42)
        body[:, 13 + side] = body[:, 11 + side] + _limb(shank + 1.35, 0.16)
        gesture = np.clip(_smooth(rng, n, 15) - 0.3, 0, 1.2) / 1.2
        upper = -0.35 * np.sin(swing) + gesture * (0.9 + 0.6 * np.sin(4.5 * t))
        fore = upper + 0.3 + gesture * (0.6 + 0.4 * np.sin(6 * t))
        body[:, 1 + side] = chest + np.array([0, 0.18 * sign, 0])
        outward = about_axis("x", sign * (0.1 + 0.4 * gesture))
        elbow = np.einsum("tij,tj->ti", outward, _limb(upper, 0.30))
        body[:, 3 + side] = body[:, 1 + side] + elbow
        wrist = np.einsum("tij,tj->ti", outward, _limb(fore, 0.26))
        body[:, 5 + side] = body[:, 3 + side] + wrist
    return body


def detections(joints, damage, seed, P=LAB):
    """(T, C, J, 2) pixels of joints (T, J, 3), NaN where missing."""
    rng = np.random.default_rng([seed, 7])
    exact, depth = project(P, joints)
    px = exact + damage.sigma_px * rng.standard_normal(exact.shape)
    inside = (exact >= 0).all(-1) & (exact[..., 0] < 1920) & (exact[..., 1] < 1080)
    seen = inside & (depth > 0.1)
    if damage.occlusions:
        seen &= ~_occluded(rng, *seen.shape)
    if damage.swaps:
        swapped = _bursts(rng, len(px), px.shape[1], 6 / damage.swaps, (2, 12)).T
        px = np.where(swapped.T[..., None, None], px[:, :, MIRROR], px)
        seen = np.where(swapped.T[..., None], seen[:, :, MIRROR], seen)
    if damage.outliers:
        size = np.linalg.norm(exact.max(2) - exact.min(2), axis=-1)[..., None, None]
        gross = rng.random(seen.shape) < damage.outliers
        wrong = px + 3 * (20 + 0.12 * size) * rng.standard_normal(px.shape)
        px = np.where(gross[..., None], wrong, px)
    return np.where(seen[..., None], px, np.nan)


def _bursts(rng, n_frames, n_rows, mean_wait, length):
    """(T, n_rows) bool: bursts of `length` (least, most) frames at random times."""
    on = np.zeros((n_frames, n_rows), bool)
    for row in range(n_rows):
        t = rng.exponential(mean_wait)
        while t < n_frames:
            end = t + rng.uniform(*length)
            on[int(t) : int(end), row] = True
            t = end + rng.exponential(mean_wait)
    return on


def _occluded(rng, n_frames, n_cameras, n_joints):
    hidden = _bursts(rng, n_frames, n_cameras * n_joints, 5 / DT, (0.5 / DT, 2 / DT))
    hidden = hidden.reshape(n_frames, n_cameras, n_joints)
    for j in range(n_joints):  # now and then one camera or none is left
        t = 2 / DT + rng.exponential(6 / DT)
        while t < n_frames:
            left = rng.integers(0, n_cameras + 1)
            end = t + (rng.uniform(0.5, 1.5) if left < n_cameras else rng.uniform(0.4, 0.8)) / DT
            hidden[int(t) : int(end), :, j] = True
            if left < n_cameras:
                hidden[int(t) : int(end), left, j] = False
            t = end + rng.exponential(6 / DT)
    return hidden


def keypoints(px, sigma_px=3.0):
    """The record for one frame of B bodies, one worker each: px (B, C, J, 2)."""
    px = px[:, :, None]
    seen = np.isfinite(px[..., 0])
    return Keypoints(px, np.where(seen, 0.9, 0.0), np.where(seen, sigma_px, np.inf))


def generators(n, seed=0):
    """One generator per environment; the b-th is the same for every n."""
    return [np.random.default_rng([seed, b]) for b in range(n)]


def track(estimator, px, sigma_px=3.0, seed=0):
    """Run an estimator over px (T, B, C, J, 2); lists of PoseEstimate stacked over T."""
    n_batch = px.shape[1]
    rngs = generators(n_batch, seed)
    state = estimator.init(n_batch, 1)
    estimator.reset(state, np.arange(n_batch), rngs)
    estimates = []
    for frame in px:
        estimator.predict(state, DT, rngs)
        estimator.update(state, keypoints(frame, sigma_px), rngs)
        estimates.append(estimator.estimate(state))
    return estimates
