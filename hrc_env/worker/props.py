"""Shapes and grips of the props held by workers: tools, boards, boxes and carts.

While a prop is held upright in front of the body, the axes of its frame coincide with the worker's
(x forward, y left, z up). The origin of the frame is in the fist, midway between two hands, or on
the floor below.
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

Xyz = Sequence[float]
"""Three coordinates in a prop's frame [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Prop:
    """An object that can be held, described in a frame fixed to it."""

    name: str
    """Name of the prop."""
    shapes: Floats
    """Capsules and boxes (G, `shapes.WIDTH`) of the solid parts [m]."""
    grips: Points3
    """Grip points (2, 3) of the left and the right hand [m]; NaN for a hand that is not used."""


def _make_box(centre: Xyz, size: Xyz) -> Floats:
    """Return a box as a row of `shapes`."""
    return shape(BOX, np.array(centre, float), np.eye(3), np.array(size) / 2)


def _make_rod(start: Xyz, end: Xyz, radius: float) -> Floats:
    """Return a capsule as a row of `shapes`."""
    ends = np.array([start, end], float)
    along = ends[1] - ends[0]
    length = float(np.linalg.norm(along))
    z = along / length
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    axes = np.stack([x, np.cross(z, x), z], -1)
    return shape(CAPSULE, ends.mean(0), axes, np.array([radius, length / 2, 0.0]))


def _make_prop(name: str, parts: Sequence[Floats], left: Xyz | None, right: Xyz | None) -> Prop:
    """Return a prop with read-only arrays.

    Args:
        name: name of the prop.
        parts: solid parts of the prop, as rows of `shapes`.
        left: grip of the left hand; None if it does not hold the prop.
        right: grip of the right hand; None if it does not hold the prop.
    """
    nowhere = (np.nan,) * 3
    grips = np.array([nowhere if grip is None else grip for grip in (left, right)], float)
    shapes = np.array(parts, float).reshape(-1, WIDTH)
    for values in (shapes, grips):
        values.setflags(write=False)
    return Prop(name, shapes, grips)


ORIGIN = (0, 0, 0)
PROPS: tuple[Prop, ...] = (
    _make_prop("nothing", [], None, None),
    _make_prop(  # the handle points up from the fist, and the striking face forward
        "hammer",
        [
            _make_rod((0, 0, -0.06), (0, 0, 0.24), 0.015),
            _make_rod((-0.05, 0, 0.25), (0.05, 0, 0.25), 0.016),
        ],
        None,
        ORIGIN,
    ),
    _make_prop(  # cordless: the bit points forward, above the fist
        "drill",
        [
            _make_rod((-0.06, 0, 0.09), (0.10, 0, 0.09), 0.034),
            _make_rod((0, 0, -0.05), (0, 0, 0.06), 0.020),
            _make_box((0.01, 0, -0.09), (0.12, 0.075, 0.06)),
            _make_rod((0.13, 0, 0.09), (0.22, 0, 0.09), 0.005),
        ],
        None,
        ORIGIN,
    ),
    _make_prop(  # a hand saw: the blade points forward from the fist, its teeth down
        "saw",
        [
            _make_box((0.0, 0, 0.0), (0.09, 0.024, 0.12)),
            _make_box((0.30, 0, -0.02), (0.52, 0.004, 0.09)),
        ],
        None,
        ORIGIN,
    ),
    _make_prop(  # drawn out by half a metre from the right hand, its end in the left
        "tape_measure",
        [
            _make_box((0, -0.25, 0), (0.07, 0.045, 0.07)),
            _make_box((0, 0.0, -0.02), (0.022, 0.50, 0.003)),
        ],
        (0, 0.25, -0.02),
        (0, -0.25, 0),
    ),
    # A sawn stud of 2.4 m, crosswise in both hands; a box between the palms.
    _make_prop("board", [_make_box(ORIGIN, (0.089, 2.4, 0.038))], (0, 0.30, 0), (0, -0.30, 0)),
    _make_prop("box", [_make_box(ORIGIN, (0.34, 0.40, 0.30))], (0, 0.20, 0), (0, -0.20, 0)),
    _make_prop(  # a platform that is pushed by its bar
        "cart",
        [
            _make_box((0.56, 0, 0.20), (0.90, 0.58, 0.06)),
            _make_box((0.60, 0, 0.41), (0.70, 0.48, 0.36)),
            _make_rod((0.0, -0.27, 0.98), (0.0, 0.27, 0.98), 0.016),
            *(_make_rod((0.13, y, 0.20), (0.0, y, 0.98), 0.016) for y in (-0.27, 0.27)),
            *(
                _make_box((x, y, 0.08), (0.16, 0.04, 0.16))
                for x in (0.25, 0.88)
                for y in (-0.22, 0.22)
            ),
        ],
        (0, 0.20, 0.98),
        (0, -0.20, 0.98),
    ),
    _make_prop(  # level on its wheel while its handles are held
        "wheelbarrow",
        [
            *(_make_rod((-0.10, y, 0.72), (1.15, 0.3 * y, 0.26), 0.018) for y in (-0.29, 0.29)),
            _make_box((0.68, 0, 0.63), (0.80, 0.58, 0.36)),
            _make_box((1.20, 0, 0.19), (0.34, 0.08, 0.34)),
            *(_make_rod((0.42, y, 0.16), (0.40, y, 0.48), 0.016) for y in (-0.20, 0.20)),
        ],
        (0, 0.28, 0.685),
        (0, -0.28, 0.685),
    ),
    # A spirit level in both hands, flat against a wall ahead.
    _make_prop("level", [_make_box(ORIGIN, (0.025, 0.80, 0.06))], (0, 0.22, 0), (0, -0.22, 0)),
    # A piece of a stud, flat, held at its ends.
    _make_prop("stud", [_make_box(ORIGIN, (0.089, 0.30, 0.038))], (0, 0.11, 0), (0, -0.11, 0)),
)
"""All props; the first one represents empty hands."""
PROP_NAMES: tuple[str, ...] = tuple(prop.name for prop in PROPS)
"""Names of the props."""
BOUNDS_M = np.zeros((len(PROPS), 2, 3))
"""Minimum and maximum corners (P, 2, 3) of each prop's bounding box, in the prop's frame [m]."""
for _row, _each in zip(BOUNDS_M[1:], PROPS[1:], strict=True):
    _row[:] = bounds(_each.shapes)
_N_PARTS = max(len(prop.shapes) for prop in PROPS)
_PARTS = np.tile(absent_shape(), (len(PROPS), _N_PARTS, 1))
"""Solid parts (P, n, `shapes.WIDTH`) of each prop; unused rows are absent shapes."""
for _parts, _each in zip(_PARTS, PROPS, strict=True):
    _parts[: len(_each.shapes)] = _each.shapes


def held_shapes(held: Held) -> Floats:
    """Return the solid parts (B, W n, `shapes.WIDTH`) of props that are held or at rest [m].

    Each prop has n rows, where n is the maximum number of parts; unused rows are absent shapes.
    """
    return place_shapes(held.kind, held.position_world, held.quaternion_wxyz, _PARTS)


def place_shapes(
    kind: Ints, position_world: Points3, quaternion_wxyz: QuaternionsWxyz, parts: Floats
) -> Floats:
    """Return the parts (B, W n, `shapes.WIDTH`) of objects, in the world frame [m].

    Args:
        kind: kind (B, W) of each object, a row of `parts`.
        position_world: position (B, W, 3) of each object [m].
        quaternion_wxyz: orientation (B, W, 4) of each object.
        parts: parts (P, n, `shapes.WIDTH`) of objects of every kind, in the object's frame [m].
    """
    batch, many = kind.shape
    rows = np.empty((batch, many * parts.shape[1], WIDTH))
    _place_parts(kind, position_world, quaternion_wxyz, parts, rows)
    return rows


@kernel
def _place_parts(
    kind: Ints, position: Floats, quaternion: Floats, parts: Floats, rows: Floats
) -> None:
    """Transform the parts of props to the world frame.

    Args:
        kind: kind (B, W) of each prop.
        position: position (B, W, 3) of each prop in the world [m].
        quaternion: orientation (B, W, 4) of each prop.
        parts: parts (P, n, `shapes.WIDTH`) of each kind, in the frame of the prop.
        rows: parts (B, W n, `shapes.WIDTH`), which are written.
    """
    n_parts = parts.shape[1]
    for b in range(len(kind)):
        for k in range(rows.shape[1]):
            w, row = k // n_parts, rows[b, k]
            part = parts[kind[b, w], k % n_parts]
            for i in range(WIDTH):
                row[i] = part[i]
            for at in range(CENTRE, HALF_SIZE, 3):
                x, y, z = rotate(quaternion[b, w], part[at : at + 3])
                row[at], row[at + 1], row[at + 2] = x, y, z
            for i in range(3):
                row[CENTRE + i] += position[b, w, i]
