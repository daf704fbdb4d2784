"""Capsules that enclose a person with 15 known joints.

The estimated body has the same capsules as the workers' true bodies (`worker.body.Body`). Both ends
of a capsule are weighted sums of joints. The head, of which only the nose is a joint, is located
by the nose's position in the frame of the trunk. The radii of trunk and limbs are proportional to
the person's width, which is the distance between the shoulders plus the distance between the hips.

All numbers are in `enclosure.json`. `python -m assets.enclosure.fit` computes them from the body
models of the workers and measures, with each body left out in turn, by how much a true surface
protrudes (`Enclosure.protrusion_m`).
"""

import json
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hrc_env.core.batching import flatten_axes
from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Capsules, Floats, Ints, Points3, Velocities3

N_TERMS = 5
"""Maximum number of joints on which an end of a capsule depends."""
_NOSE = JOINT["nose"]
_SHOULDERS = JOINT["left_shoulder"], JOINT["right_shoulder"]
_HIPS = JOINT["left_hip"], JOINT["right_hip"]
_STEP_S = 1e-4
"""Time step of the numerical derivative that gives the velocities of capsules [s]."""


class Enclosure(NamedTuple):
    """Map from 15 joints to the capsules that enclose a body; capsule 0 is the head."""

    joints: Ints
    """Indices of the joints on which each end of a capsule depends (S, 2, `N_TERMS`)."""
    weights: Floats
    """Weight of each of these joints (S, 2, `N_TERMS`); the sum is 1 for each end."""
    head: Floats
    """Linear map (2, 3, 4) from the nose's position in the trunk's frame, extended by 1, to each
    end of the head in that frame [m]."""
    radius_m: Floats
    """Constant part of the radius of each capsule (S,) [m]."""
    radius_per_width: Floats
    """Radius of each capsule divided by the person's width, without the constant part (S,)."""
    width_range_m: Floats
    """Range (2,) to which the width of an estimate is limited [m]: from that of the narrowest body
    of the fit to 1.25 times that of the widest."""
    protrusion_m: Floats
    """Distance by which 95 % of the true surfaces protrude at most (S,) [m], for the worst of the
    bodies when each is left out of the fit in turn; not less than 0."""


class BodyCapsules(NamedTuple):
    """The capsules of bodies with any leading axes (...)."""

    ends_world: Capsules
    """(..., S, 2, 3) end points of the axes [m]."""
    radius_m: Floats
    """(..., S) radii [m]."""


@cache
def _read() -> dict[str, Any]:
    return json.loads(Path(__file__).with_suffix(".json").read_text())


@cache
def load_enclosure() -> Enclosure:
    """Read the fitted enclosure."""
    fields = {name: np.array(_read()[name]) for name in Enclosure._fields}
    for values in fields.values():
        values.setflags(write=False)
    return Enclosure(**fields)


CAPSULES: tuple[str, ...] = tuple(_read()["capsules"])
"""Names of the capsules of an estimated body, in the order of every array (..., S, ...)."""
CAPSULE: dict[str, int] = {name: index for index, name in enumerate(CAPSULES)}
"""Index of each capsule of an estimated body, by name."""
N_CAPSULES = len(CAPSULES)


@cache
def find_shares() -> Floats:
    """Return the influence of joints on the ends of capsules (S, 2, `N_TERMS`), with the sum 1."""
    influence = np.abs(load_enclosure().weights)
    shares = influence / influence.sum(-1, keepdims=True)
    shares.setflags(write=False)
    return shares


def name_part(capsule: str) -> str:
    """Return the name of a capsule without its side."""
    return capsule.removeprefix("left_").removeprefix("right_")


def enclose(joints_world: Points3, enclosure: Enclosure | None = None) -> BodyCapsules:
    """Return the capsules that enclose bodies with joints (..., 15, 3) [m].

    Args:
        joints_world: positions of the joints in the order of `core.skeleton.JOINTS` [m].
        enclosure: map from joints to capsules; None for the fitted one.
    """
    joints = flatten_axes(joints_world, 2)
    ends, radius_m = np.empty((len(joints), N_CAPSULES, 2, 3)), np.empty((len(joints), N_CAPSULES))
    _write_capsules(joints, enclosure or load_enclosure(), ends, radius_m)
    lead = joints_world.shape[:-2]
    return BodyCapsules(ends.reshape(*lead, *ends.shape[1:]), radius_m.reshape(*lead, N_CAPSULES))


def find_velocities(
    capsules: BodyCapsules, joints_world: Points3, velocity_world: Velocities3
) -> Velocities3:
    """Return the velocities (..., S, 2, 3) of the ends of the capsules of moving bodies [m/s].

    Args:
        capsules: capsules of the bodies, as `enclose` returns them.
        joints_world: positions of the joints (..., 15, 3) [m].
        velocity_world: velocities of the joints (..., 15, 3) [m/s].
    """
    later = enclose(joints_world + _STEP_S * velocity_world).ends_world
    return (later - capsules.ends_world) / _STEP_S


@kernel(makes_arrays=True)
def _write_capsules(
    joints: Points3, enclosure: Enclosure, ends: Capsules, radius_m: Floats
) -> None:
    """Compute the capsules of bodies.

    Args:
        joints: (B, 15, 3) positions of the joints [m].
        enclosure: map from joints to capsules.
        ends: (B, S, 2, 3) receives the end points [m].
        radius_m: (B, S) receives the radii [m].
    """
    local, frame = np.empty(3), np.empty((3, 3))
    for b in range(len(joints)):
        body = joints[b]
        for s in range(1, ends.shape[1]):
            for e in range(2):
                for i in range(3):
                    ends[b, s, e, i] = 0.0
                    for k in range(enclosure.weights.shape[2]):
                        at = enclosure.joints[s, e, k]
                        ends[b, s, e, i] += enclosure.weights[s, e, k] * body[at, i]
        write_trunk_frame(body, frame)
        for i in range(3):
            local[i] = 0.0
            for k in range(3):
                neck = 0.5 * (body[_SHOULDERS[0], k] + body[_SHOULDERS[1], k])
                local[i] += frame[i, k] * (body[_NOSE, k] - neck)
        for e in range(2):
            for k in range(3):
                ends[b, 0, e, k] = 0.5 * (body[_SHOULDERS[0], k] + body[_SHOULDERS[1], k])
            for i in range(3):
                along = enclosure.head[e, i, 3]
                for k in range(3):
                    along += enclosure.head[e, i, k] * local[k]
                for k in range(3):
                    ends[b, 0, e, k] += along * frame[i, k]
        width = measure_distance(body[_SHOULDERS[0]], body[_SHOULDERS[1]])
        width += measure_distance(body[_HIPS[0]], body[_HIPS[1]])
        width = min(max(width, enclosure.width_range_m[0]), enclosure.width_range_m[1])
        for s in range(ends.shape[1]):
            radius_m[b, s] = enclosure.radius_m[s] + enclosure.radius_per_width[s] * width


@kernel
def write_trunk_frame(joints: Points3, frame: Floats) -> None:
    """Write the axes of a trunk to the rows of `frame` (3, 3): forward, left and up.

    Up is the direction from the middle of the hips to the middle of the shoulders, and left is that
    from the right to the left shoulder, orthogonal to it. An axis of a degenerate trunk is zero.

    Args:
        joints: (15, 3) positions of the joints [m].
        frame: (3, 3) receives the axes in the world frame.
    """
    for i in range(3):
        left, right = joints[_SHOULDERS[0], i], joints[_SHOULDERS[1], i]
        frame[1, i] = left - right
        frame[2, i] = 0.5 * (left + right - joints[_HIPS[0], i] - joints[_HIPS[1], i])
    normalise(frame[2])
    along = 0.0
    for i in range(3):
        along += frame[1, i] * frame[2, i]
    for i in range(3):
        frame[1, i] -= along * frame[2, i]
    normalise(frame[1])
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        frame[0, i] = frame[1, j] * frame[2, k] - frame[1, k] * frame[2, j]


@kernel
def normalise(vector: Floats) -> None:
    """Scale a vector (3,) in place to length 1; one that is shorter than 1 mm becomes zero."""
    length = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    for i in range(3):
        vector[i] = vector[i] / length if length > 1e-3 else 0.0


@kernel
def measure_distance(one: Points3, other: Points3) -> float:
    """Return the distance between two points (3,) [m]."""
    x, y, z = one[0] - other[0], one[1] - other[1], one[2] - other[2]
    return np.sqrt(x * x + y * y + z * z)
