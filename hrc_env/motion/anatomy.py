"""Bones of a worker for the kinematics, with offsets and frames at rest, and body dimensions."""

from dataclasses import dataclass, fields, replace

import numpy as np

from hrc_env.core.typing import Floats
from hrc_env.geometry.rotations import about_axis
from hrc_env.worker.body import N_SEGMENTS, PARENT, Body

CHEST, HEAD = 3, 5
"""Indices of the chest, which carries the arms, and of the head."""
LEFT, SIDE_STRIDE = 6, 8
"""First segment of the left side, and number of segments per side, as ordered in `worker.body`."""
CLAVICLE, UPPER_ARM, FOREARM, HAND, THIGH, SHANK, FOOT, TOES = range(8)
"""Segments of one side of the body, counted from its first segment."""

ARM, FOREARM_GRIP, LEG, THIGH_LENGTH, SHANK_LENGTH, ANKLE_Z, STAND_Z = range(7)
ANKLE_X, BALL_X, BALL_Z, HEEL_X, UPPER_LENGTH = range(7, 12)
N_SIZES = 12
"""Number of columns of `Anatomy.lengths`.

They are the lengths from shoulder to grip, elbow to grip, and hip to ankle; the lengths of thigh
and shank; the heights of the ankle and of the standing pelvis; the positions of the ankle ahead of
the pelvis, of the ball ahead of and above the ankle, and of the heel ahead of the ankle; and the
length of the upper arm [m].
"""
ROUND = ("pelvis", "abdomen", "torso", "chest", "left_shoulder", "right_shoulder")
"""Names of the capsules on which a lying trunk rests."""
N_ROUND = 2 * len(ROUND)
"""Number of ends of the capsules `ROUND`; the shoulder capsules are attached to the chest."""

GRIP_M = 0.08
"""Distance of the grip from the wrist [m], about half the length of a hand."""
HEEL_M = -0.045
"""Position of the heel's floor contact ahead of the ankle [m]; negative because it is behind."""
FOREARM_TWIST_RAD = 0.15
"""Outward twist of the forearm from the rest pose [rad], with which the palm faces the thigh."""
HAND_TWIST_RAD = 0.35
"""Outward twist of the hand about the forearm from the rest pose [rad]."""
STAND_SHARE = 0.994
"""Height of the hip in standing with slightly bent knees, as a fraction of leg length."""


@dataclass(frozen=True, slots=True, eq=False)
class Anatomy:
    """Constants of one body, or of N bodies along a leading axis."""

    offset: Floats
    """Origin (22, 3) of each segment in its parent's frame at rest [m]."""
    frame: Floats
    """Axes (22, 3, 3) of each limb bone at rest, as rows (bone, hinge x bone, hinge).

    They are zero for other segments.
    """
    lengths: Floats
    """Body dimensions (12,) [m], with the columns described at `N_SIZES`."""
    trunk_ends: Floats
    """Ends (12, 5) of the capsules `ROUND`: segment, position (3) in its frame [m], radius [m]."""


def measure_bodies(bodies: Body) -> Anatomy:
    """Return the constants (N, ...) of N bodies, computed by `measure_body` for each."""
    rests = bodies.rest_position.reshape(-1, N_SEGMENTS, 3)
    ends = bodies.capsule_ends.reshape(len(rests), -1, 2, 3)
    radii = bodies.capsule_radius_m.reshape(len(rests), -1)
    measured = [
        measure_body(replace(bodies, rest_position=rest, capsule_ends=end, capsule_radius_m=radius))
        for rest, end, radius in zip(rests, ends, radii, strict=True)
    ]
    return Anatomy(*(np.stack([getattr(a, f.name) for a in measured]) for f in fields(Anatomy)))


def measure_body(body: Body) -> Anatomy:
    """Return the constants of one body; both sides are assumed to have the lengths of the left."""
    rest = np.asarray(body.rest_position, float)
    offset = rest - rest[np.maximum(PARENT, 0)]
    offset[0] = rest[0]
    frame = np.zeros((len(rest), 3, 3))
    for first in (LEFT, LEFT + SIDE_STRIDE):
        # Poles of the hinges: elbows point backwards, knees forwards.
        for bone, pole in ((UPPER_ARM, -1.0), (FOREARM, -1.0), (THIGH, 1.0), (SHANK, 1.0)):
            along = rest[first + bone + 1] - rest[first + bone]
            frame[first + bone] = _make_rest_frame(along, np.array([pole, 0.0, 0.0]))
        outward = -1.0 if first == LEFT else 1.0
        straight = frame[first + FOREARM].copy()
        frame[first + FOREARM] = about_axis("x", outward * FOREARM_TWIST_RAD) @ straight
        frame[first + HAND] = about_axis("x", outward * HAND_TWIST_RAD) @ straight
    return Anatomy(
        np.ascontiguousarray(offset), frame, _measure_lengths(rest), _list_trunk_ends(body, rest)
    )


def _list_trunk_ends(body: Body, rest: Floats) -> Floats:
    """Compute `Anatomy.trunk_ends` of a body from the rest positions (22, 3) of its segments."""
    rows = []
    for name in ROUND:
        k = body.capsule_names.index(name)
        segment = int(body.capsule_segment[k])
        on = min(segment, CHEST)
        for end in body.capsule_ends[k]:
            rows.append((on, *(rest[segment] - rest[on] + end), body.capsule_radius_m[k]))
    return np.array(rows)


def _make_rest_frame(along: Floats, pole: Floats) -> Floats:
    """Return the axes (bone, hinge x bone, hinge) of a bone with a joint that bends to `pole`."""
    along = along / np.linalg.norm(along)
    hinge = np.cross(pole, along)
    hinge /= np.linalg.norm(hinge)
    return np.stack([along, np.cross(hinge, along), hinge])


def _measure_lengths(rest: Floats) -> Floats:
    """Compute `Anatomy.lengths` from the rest positions (22, 3) of the segments."""
    names = ("clavicle", "arm", "elbow", "wrist", "hip", "knee", "ankle", "ball")
    at = {name: rest[LEFT + index] for index, name in enumerate(names)}
    upper, fore, thigh, shank = (
        float(np.linalg.norm(at[b] - at[a]))
        for a, b in (("arm", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
    )
    size = np.zeros(N_SIZES)
    size[ARM], size[FOREARM_GRIP], size[UPPER_LENGTH] = upper + fore + GRIP_M, fore + GRIP_M, upper
    size[LEG], size[THIGH_LENGTH], size[SHANK_LENGTH] = thigh + shank, thigh, shank
    size[ANKLE_Z] = at["ankle"][2]
    size[STAND_Z] = at["ankle"][2] + STAND_SHARE * (thigh + shank) + rest[0, 2] - at["hip"][2]
    size[ANKLE_X] = at["ankle"][0] - rest[0, 0]
    size[BALL_X], size[BALL_Z] = (at["ball"] - at["ankle"])[[0, 2]]
    size[HEEL_X] = HEEL_M
    return size
