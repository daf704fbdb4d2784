"""Several simulated people for tests: they walk past each other and hide each other."""

import numpy as np
from simulated import DT, LAB, _bursts, walk

from hrc_env.core.records import Keypoints
from hrc_env.core.skeleton import MIRROR
from hrc_env.geometry.cameras import project

EYES = np.stack([-np.linalg.inv(camera[:, :3]) @ camera[:, 3] for camera in LAB])


def passing(seed, n_frames=100, apart_m=0.6):
    """(T, 2, 15, 3) two people who walk past each other, `apart_m` where they meet halfway."""
    rng = np.random.default_rng(seed)
    along = rng.uniform(0, 2 * np.pi)
    ahead = np.array([np.cos(along), np.sin(along)])
    left = np.array([-ahead[1], ahead[0]])
    middle = np.array([0.9, 0.0]) + rng.uniform(-0.3, 0.3, 2)
    t = (np.arange(n_frames) - n_frames / 2) * DT
    people = []
    for sign in (1, -1):
        speed = rng.uniform(0.5, 0.9)
        side = apart_m / 2 + 0.05 * np.sin(2 * t + rng.uniform(0, 6)) * np.abs(np.tanh(t))
        ground = middle + sign * (np.outer(speed * t, ahead) + np.outer(side, left))
        people.append(_marching(10 * seed + sign, ground, along + (0 if sign > 0 else np.pi)))
    return np.stack(people, 1)


def standing(places, n_frames=1, seed=0):
    """(T, n, 15, 3) people who walk in place."""
    return np.stack(
        [
            _marching(seed + k, np.tile(place, (n_frames, 1)), 0.7 * k)
            for k, place in enumerate(places)
        ],
        1,
    )


def _marching(seed, ground, heading):
    """A walker's limbs moved along `ground` (T, 2), facing `heading` [rad]."""
    joints = walk(abs(seed) + 1, len(ground))
    hips = joints[:, [7, 8]].mean(1)[:, :2]
    across = joints[:, 7, :2] - joints[:, 8, :2]
    turn = heading - np.arctan2(-across[:, 0], across[:, 1])
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    x, y = (joints[..., i] - hips[:, None, i] for i in (0, 1))
    turned = np.stack([c * x - s * y, s * x + c * y, joints[..., 2]], -1)
    turned[..., :2] += ground[:, None]
    return turned


def poses(people, seed, sigma_px=6.0, damage=True, P=LAB):
    """Keypoints (T, C, n, J, ...) of people (T, n, 15, 3); in each camera they hide each other.

    With `damage`, cameras also lose whole people for 0.2 to 0.8 s, exchange left and right,
    and one joint in twenty is grossly wrong.
    """
    rng = np.random.default_rng([seed, 3])
    n_frames, n = people.shape[:2]
    exact, depth = project(P, people)
    px = exact + sigma_px * rng.standard_normal(exact.shape)
    seen = (exact >= 0).all(-1) & (exact[..., 0] < 1920) & (exact[..., 1] < 1080) & (depth > 0.5)
    seen &= ~_hidden_by_others(people)
    if damage:
        rows = len(P) * n
        lost = _bursts(rng, n_frames, rows, 4 / DT, (0.2 / DT, 0.8 / DT))
        swapped = _bursts(rng, n_frames, rows, 4 / DT, (2, 8)).reshape(n_frames, len(P), n)
        seen &= ~lost.reshape(n_frames, len(P), n, 1)
        gross = rng.random(seen.shape) < 0.05
        px = np.where(gross[..., None], px + 80 * rng.standard_normal(px.shape), px)
        px = np.where(swapped[..., None, None], px[..., MIRROR, :], px)
        seen = np.where(swapped[..., None], seen[..., MIRROR], seen)
    seen &= seen.sum(-1, keepdims=True) >= 6
    px = np.where(seen[..., None], px, np.nan)
    return Keypoints(px, np.where(seen, 0.9, 0.0), np.where(seen, sigma_px, np.inf))


def _hidden_by_others(people, radius_m=0.18):
    """(T, C, n, J) joints whose line of sight passes a nearer person's trunk."""
    n_frames, n = people.shape[:2]
    hidden = np.zeros((n_frames, len(EYES), n, people.shape[2]), bool)
    steps = np.linspace(0, 1, 7)[:, None]
    for c, eye in enumerate(EYES):
        for other in range(n):
            top = people[:, other, [1, 2]].mean(1)[:, None]
            foot = people[:, other, [11, 12]].mean(1)[:, None]
            trunk = top + steps * (foot - top)  # (T, 7, 3)
            for who in set(range(n)) - {other}:
                line = people[:, who] - eye  # (T, J, 3)
                length = np.linalg.norm(line, axis=-1, keepdims=True)
                to = trunk[:, None] - eye
                far = np.einsum("tjki,tji->tjk", np.broadcast_to(to, (*line.shape[:2], 7, 3)),
                                line / length)  # fmt: skip
                gap = np.linalg.norm(to - far[..., None] * (line / length)[:, :, None], axis=-1)
                hidden[:, c, who] |= ((gap < radius_m) & (far < length - 0.25)).any(-1)
    return hidden


def shuffled(keypoints, seed):
    """The same poses, in each camera and frame in another order: (T, C, n, ...) records."""
    rng = np.random.default_rng([seed, 5])
    n_frames, n_cameras, n = keypoints.px.shape[:3]
    order = rng.permuted(np.tile(np.arange(n), (n_frames, n_cameras, 1)), axis=-1)
    pick = (np.arange(n_frames)[:, None, None], np.arange(n_cameras)[:, None], order)
    return Keypoints(keypoints.px[pick], keypoints.confidence[pick], keypoints.sigma_px[pick])


def stack(records):
    """Records (T, ...) of B sequences as one (T, B, ...)."""
    return Keypoints(
        *(
            np.stack([getattr(each, name) for each in records], 1)
            for name in ("px", "confidence", "sigma_px")
        )
    )
