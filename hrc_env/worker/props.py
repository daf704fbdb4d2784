"""What workers hold: shapes and grips of tools, boards, boxes, things on wheels.

A prop's frame is the worker's (x ahead, y left, z up) when it is held in front and upright: origin
in the fist, between two hands, or on the floor below.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import Held
from hrc_env.core.typing import Floats, Ints, Points3, QuaternionsWxyz
from hrc_env.geometry.rotations import rotate
from hrc_env.geometry.shapes import (
    BOX,
    CAPSULE,
    CENTRE,
    HALF_SIZE,
    WIDTH,
    absent_shape,
    bounds,
    shape,
)

Triple = Sequence[float]


@dataclass(frozen=True, slots=True, eq=False)
class Prop:
    """A thing that can be held; all in its own frame [m]."""

    name: str
    shapes: Floats
    """(G, `shapes.WIDTH`) its solid parts, capsules and boxes."""
    grips: Points3
    """(2, 3) where the left and the right hand hold it; NaN: that hand does not."""


def _box(centre: Triple, size: Triple) -> Floats:
    return shape(BOX, np.array(centre, float), np.eye(3), np.array(size) / 2)


def _rod(start: Triple, end: Triple, radius: float) -> Floats:
    ends = np.array([start, end], float)
    along = ends[1] - ends[0]
    length = float(np.linalg.norm(along))
    z = along / length
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    axes = np.stack([x, np.cross(z, x), z], -1)
    return shape(CAPSULE, ends.mean(0), axes, np.array([radius, length / 2, 0.0]))


def _prop(name: str, parts: Sequence[Floats], left: Triple | None, right: Triple | None) -> Prop:
    nowhere = (np.nan,) * 3
    grips = np.array([nowhere if grip is None else grip for grip in (left, right)], float)
    shapes = np.array(parts, float).reshape(-1, WIDTH)
    for values in (shapes, grips):
        values.setflags(write=False)
    return Prop(name, shapes, grips)


ORIGIN = (0, 0, 0)
PROPS: tuple[Prop, ...] = (
    _prop("nothing", [], None, None),
    _prop(  # its handle stands up from the fist, the face that strikes looks ahead
        "hammer",
        [_rod((0, 0, -0.06), (0, 0, 0.24), 0.015), _rod((-0.05, 0, 0.25), (0.05, 0, 0.25), 0.016)],
        None, ORIGIN,
    ),
    _prop(  # cordless: the bit points ahead, above the fist
        "drill",
        [
            _rod((-0.06, 0, 0.09), (0.10, 0, 0.09), 0.034),
            _rod((0, 0, -0.05), (0, 0, 0.06), 0.020),
            _box((0.01, 0, -0.09), (0.12, 0.075, 0.06)),
            _rod((0.13, 0, 0.09), (0.22, 0, 0.09), 0.005),
        ],
        None, ORIGIN,
    ),
    _prop(  # a hand saw: the blade runs ahead from the fist, its teeth down
        "saw",
        [_box((0.0, 0, 0.0), (0.09, 0.024, 0.12)), _box((0.30, 0, -0.02), (0.52, 0.004, 0.09))],
        None, ORIGIN,
    ),
    _prop(  # drawn out half a metre from the right hand, its end in the left
        "tape_measure",
        [_box((0, -0.25, 0), (0.07, 0.045, 0.07)), _box((0, 0.0, -0.02), (0.022, 0.50, 0.003))],
        (0, 0.25, -0.02), (0, -0.25, 0),
    ),
    # A sawn stud of 2.4 m, crosswise in both hands; a box between the palms.
    _prop("board", [_box(ORIGIN, (0.089, 2.4, 0.038))], (0, 0.30, 0), (0, -0.30, 0)),
    _prop("box", [_box(ORIGIN, (0.34, 0.40, 0.30))], (0, 0.20, 0), (0, -0.20, 0)),
    _prop(  # a platform that is pushed by its bar
        "cart",
        [
            _box((0.56, 0, 0.20), (0.90, 0.58, 0.06)),
            _box((0.60, 0, 0.41), (0.70, 0.48, 0.36)),
            _rod((0.0, -0.27, 0.98), (0.0, 0.27, 0.98), 0.016),
            *(_rod((0.13, y, 0.20), (0.0, y, 0.98), 0.016) for y in (-0.27, 0.27)),
            *(_box((x, y, 0.08), (0.16, 0.04, 0.16)) for x in (0.25, 0.88) for y in (-0.22, 0.22)),
        ],
        (0, 0.20, 0.98), (0, -0.20, 0.98),
    ),
    _prop(  # level on its wheel while its handles are held
        "wheelbarrow",
        [
            *(_rod((-0.10, y, 0.72), (1.15, 0.3 * y, 0.26), 0.018) for y in (-0.29, 0.29)),
            _box((0.68, 0, 0.63), (0.80, 0.58, 0.36)),
            _box((1.20, 0, 0.19), (0.34, 0.08, 0.34)),
            *(_rod((0.42, y, 0.16), (0.40, y, 0.48), 0.016) for y in (-0.20, 0.20)),
        ],
        (0, 0.28, 0.685), (0, -0.28, 0.685),
    ),
    # A spirit level, flat to a wall ahead, in both hands.
    _prop("level", [_box(ORIGIN, (0.025, 0.80, 0.06))], (0, 0.22, 0), (0, -0.22, 0)),
    # A piece of a stud, flat, by its ends.
    _prop("stud", [_box(ORIGIN, (0.089, 0.30, 0.038))], (0, 0.11, 0), (0, -0.11, 0)),
)  # fmt: skip
"""Everything that can be held; the first is nothing."""
PROP_NAMES: tuple[str, ...] = tuple(prop.name for prop in PROPS)
BOUNDS_M = np.zeros((len(PROPS), 2, 3))
"""(P, 2, 3) least and greatest corner of the box round each, in its own frame [m]."""
for _row, _each in zip(BOUNDS_M[1:], PROPS[1:], strict=True):
    _row[:] = bounds(_each.shapes)
_N_PARTS = max(len(prop.shapes) for prop in PROPS)
_PARTS = np.tile(absent_shape(), (len(PROPS), _N_PARTS, 1))
"""(P, n, `shapes.WIDTH`) the parts of every prop; rows that it leaves over are absent."""
for _parts, _each in zip(_PARTS, PROPS, strict=True):
    _parts[: len(_each.shapes)] = _each.shapes


def held_shapes(held: Held) -> Floats:
    """(B, W * n, `shapes.WIDTH`) the solid parts of what workers hold, and of what lies there for
    them, in the world [m].

    There are rows for the prop of most parts; those that are left over are absent.
    """
    return placed(held.kind, held.position_world, held.quaternion_wxyz, _PARTS)


def placed(
    kind: Ints, position_world: Points3, quaternion_wxyz: QuaternionsWxyz, parts: Floats
) -> Floats:
    """(B, W * n, `shapes.WIDTH`) the parts (P, n, `shapes.WIDTH`) of things of kinds (B, W), each
    where it is, in the world [m]."""
    batch, many = kind.shape
    rows = np.empty((batch, many * parts.shape[1], WIDTH))
    _place(kind, position_world, quaternion_wxyz, parts, rows)
    return rows


@kernel
def _place(kind, position, quaternion, parts, rows):
    """Parts of the props of B environments, of W workers each, from their frames to the world."""
    most = parts.shape[1]
    for b in range(len(kind)):
        for k in range(rows.shape[1]):
            w, row = k // most, rows[b, k]
            own = parts[kind[b, w], k % most]
            for i in range(WIDTH):
                row[i] = own[i]
            for at in range(CENTRE, HALF_SIZE, 3):
                x, y, z = rotate(quaternion[b, w], own[at : at + 3])
                row[at], row[at + 1], row[at + 2] = x, y, z
            for i in range(3):
                row[CENTRE + i] += position[b, w, i]
