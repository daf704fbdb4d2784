"""Sequences of two people that walk past each other, with detections that carry no identity."""

import itertools
from typing import NamedTuple

import numpy as np

from benchmarks.tracking.detections import Damage, detect
from benchmarks.tracking.rigs import DT_S
from benchmarks.tracking.walks import Path, walk_along
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Bools, Floats, Ints, Points2, Points3

MEETING_S = 3.0
"""Time at which the two people are side by side [s]."""
APART_M = 0.6
"""Distance between the centres of the two people at the time `MEETING_S` [m]."""
_TRUNK_M, _LEAST_JOINTS = 0.18, 6
_LOST_EVERY_S, _LOST_S = 4.0, (0.2, 0.8)
_SURE_M = 0.3


def walk_couples(seeds: list[int], n_frames: int) -> Points3:
    """Return joint positions (T, S, 2, J, 3) of two people that walk in opposite directions [m]."""
    rngs = [np.random.default_rng([seed, 6]) for seed in seeds]
    along = np.stack([rng.uniform(0, 2 * np.pi) for rng in rngs])
    middle = np.stack([rng.uniform(-0.2, 0.2, 2) for rng in rngs])
    speed = np.stack([rng.uniform(0.5, 0.8, 2) for rng in rngs])
    phase = np.stack([rng.uniform(0, 2 * np.pi, 2) for rng in rngs])
    gesture = np.stack([rng.uniform(0, 0.6, (2, 2)) for rng in rngs])
    time_s = DT_S * np.arange(n_frames)[:, None] - MEETING_S
    ahead = np.stack([np.cos(along), np.sin(along)], -1)
    aside = APART_M / 2 * np.stack([-ahead[:, 1], ahead[:, 0]], -1)
    people = []
    for k, sign in enumerate((1.0, -1.0)):
        gone = (speed[:, k] * time_s)[..., None]
        stride = phase[:, k] + 2 * np.pi * 0.72 * speed[:, k] * time_s
        waving = np.sin(0.8 * time_s + phase[:, k])[..., None] ** 2
        path = Path(
            ground=middle + sign * (gone * ahead + aside),
            heading=np.tile(along + (np.pi if k else 0.0), (n_frames, 1)),
            stride=stride,
            lean=np.full(stride.shape, 0.08),
            gesture=waving * gesture[:, k],
        )
        people.append(walk_along(path))
    return np.stack(people, 2)


def detect_couples(P: Floats, joints: Points3, seeds: list[int]) -> Points2:
    """Return detections (T, S, C, 2, J, 2) of joints (T, S, 2, J, 3) [px]; NaN if missing.

    Joints are lost as in the condition `occluded`, and the trunk of a person hides the joints of
    the other person behind it. In addition, each camera loses each person on average every 4 s for
    0.2 to 0.8 s. A person with fewer than six detected joints is not reported.
    """
    damage = Damage(occluded=True)
    px = np.stack(
        [detect(P, joints[:, :, k], damage, [2 * seed + k for seed in seeds]) for k in (0, 1)], 3
    )
    seen = np.isfinite(px[..., 0]) & ~_find_hidden(P, joints)
    for s, seed in enumerate(seeds):
        rng = np.random.default_rng([seed, 7])
        seen[:, s] &= ~_draw_losses(rng, seen.shape[0], seen.shape[2])[..., None]
    seen &= seen.sum(-1, keepdims=True) >= _LEAST_JOINTS
    return np.where(seen[..., None], px, np.nan)


def draw_shuffles(seeds: list[int], n_frames: int, n_cameras: int, n_people: int) -> Ints:
    """Sample the order (T, S, C, D) in which each camera reports people in each frame."""
    one = np.tile(np.arange(n_people), (n_frames, n_cameras, 1))
    return np.stack([np.random.default_rng([seed, 8]).permuted(one, axis=-1) for seed in seeds], 1)


class Identities(NamedTuple):
    """Assignment of tracks to people in S sequences."""

    track: Ints
    """Index (S, W) of the track that is assigned to each person in the first frame."""
    n_changes: Floats
    """Number (S,) of changes of the assignment in later frames."""


def match_identities(truth: Points3, mean: Points3) -> Identities:
    """Assign tracks to people, and count later changes of the assignment.

    The assignment has the minimum total distance in the first frame. It changes if the total
    distance of another assignment is smaller by more than 0.3 m. True and estimated joints have
    shape (T, S, W, J, 3) [m].
    """
    n_sequences, n_people = truth.shape[1:3]
    orders = np.array(list(itertools.permutations(range(n_people))))
    apart = np.linalg.norm((mean[:, :, :, None] - truth[:, :, None]).mean(-2), axis=-1)
    total = apart[:, :, orders, np.arange(n_people)].sum(-1)  # (T, S, orders)
    every = np.arange(n_sequences)
    current = total[0].argmin(-1)
    first, swaps = orders[current], np.zeros(n_sequences)
    for now in total:
        best = now.argmin(-1)
        surely = now[every, best] + _SURE_M < now[every, current]
        swaps += surely
        current = np.where(surely, best, current)
    return Identities(first, swaps)


def _find_hidden(P: Floats, joints: Points3) -> Bools:
    """Return a mask (T, S, C, 2, J) of joints that the other person's trunk hides."""
    hidden = np.zeros((*joints.shape[:2], len(P), *joints.shape[2:4]), bool)
    for c, camera in enumerate(P):
        eye = -np.linalg.solve(camera[:, :3], camera[:, 3])
        for k in (0, 1):
            hidden[:, :, c, k] = _passes(joints[:, :, k] - eye, joints[:, :, 1 - k] - eye)
    return hidden


def _passes(to_joints: Points3, to_other: Points3) -> Bools:
    """Return a mask (T, S, J) of joints that a nearer trunk hides from the camera."""
    shoulders = to_other[..., [JOINT["left_shoulder"], JOINT["right_shoulder"]], :].mean(-2)
    ankles = to_other[..., [JOINT["left_ankle"], JOINT["right_ankle"]], :].mean(-2)
    length = np.linalg.norm(to_joints, axis=-1)
    direction = to_joints / length[..., None]
    out = np.zeros(length.shape, bool)
    for share in np.linspace(0, 1, 7):
        ball = (shoulders + share * (ankles - shoulders))[..., None, :]
        far = (ball * direction).sum(-1)
        gap = np.linalg.norm(ball - far[..., None] * direction, axis=-1)
        out |= (gap < _TRUNK_M) & (far < length - 0.25)
    return out


def _draw_losses(rng: np.random.Generator, n_frames: int, n_cameras: int) -> Bools:
    """Sample a mask (T, C, 2) of frames in which a camera does not detect a person."""
    lost = np.zeros((n_frames, n_cameras, 2), bool)
    for c, k in itertools.product(range(n_cameras), (0, 1)):
        t = rng.exponential(_LOST_EVERY_S / DT_S)
        while t < n_frames:
            length = 1 + int(rng.uniform(*_LOST_S) / DT_S)
            lost[int(t) : int(t) + length, c, k] = True
            t += length + rng.exponential(_LOST_EVERY_S / DT_S)
    return lost
