"""Motions of a body as BVH and Acclaim files, with selectable peculiarities of these formats."""

import itertools
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from hrc_env.core.typing import Floats, Points3, Rotations
from hrc_env.geometry.rotations import about_axis
from hrc_env.mocap.poses import make_marks
from hrc_env.worker.body import PARENT, SEGMENT, SEGMENTS, Body, load_body

AXES = "xyz"
Y_UP = about_axis("x", -np.pi / 2)
"""Rotation from z up to y up."""
CMU = {
    "pelvis": "Hips", "abdomen": "LowerBack", "torso": "Spine", "chest": "Spine1",
    "neck": "Neck", "head": "Head", "clavicle": "Shoulder", "upper_arm": "Arm",
    "forearm": "ForeArm", "hand": "Hand", "thigh": "UpLeg", "shank": "Leg", "foot": "Foot",
    "toes": "ToeBase",
}  # fmt: skip
ORDERS = tuple("".join(order) for order in itertools.permutations("XYZ"))
BODY = load_body()


def compute_angles(rotation: Rotations, order: str) -> Floats:
    """Return angles about moving axes, (T, 3) [rad], in an order such as "zyx": R = Rz Ry Rx."""
    i, j, k = (AXES.index(axis) for axis in order)
    sign = 1.0 if (i, j, k) in ((0, 1, 2), (1, 2, 0), (2, 0, 1)) else -1.0
    r = rotation
    return np.stack(
        [
            np.arctan2(-sign * r[:, j, k], r[:, k, k]),
            np.arcsin(np.clip(sign * r[:, i, k], -1.0, 1.0)),
            np.arctan2(-sign * r[:, i, j], r[:, i, i]),
        ],
        -1,
    )


def cmu_name(segment: str, prefix: str = "") -> str:
    """Return a segment's name in the CMU database's BVH files, or with a prefix in Mixamo's."""
    side, _, part = segment.partition("_")
    if side in ("left", "right"):
        return prefix + side.title() + CMU[part]
    return prefix + CMU[segment]


def write_bvh(
    path: Path, position: Points3, rotation: Rotations, fps: float, unit_m: float = 1.0,
    axes: Rotations | None = None, orders: Sequence[str] = ("ZYX",), rest_first: bool = False,
    name: Callable[[str], str] = cmu_name, body: Body = BODY,
) -> Path:  # fmt: skip
    """Write a BVH file of segments over time; `orders` are taken in turn, one for each joint."""
    axes = np.eye(3) if axes is None else axes
    offset = (body.rest_position - body.rest_position[np.maximum(PARENT, 0)]) @ axes.T / unit_m
    offset[0] = 0.0
    turned = axes @ rotation @ axes.T
    root = position[:, 0] @ axes.T / unit_m
    lines, columns = ["HIERARCHY"], []

    def joint(s: int, depth: int) -> None:
        pad, order = "\t" * depth, orders[s % len(orders)]
        lines.append(f"{pad}{'ROOT' if s == 0 else 'JOINT'} {name(SEGMENTS[s])}")
        lines.extend((pad + "{", f"{pad}\tOFFSET {_row(offset[s])}"))
        named = [f"{axis}rotation" for axis in order]
        local = turned[:, s]
        if s == 0:
            named = ["Xposition", "Yposition", "Zposition", *named]
            columns.append(root)
        else:
            local = np.swapaxes(turned[:, PARENT[s]], -1, -2) @ local
        columns.append(np.degrees(compute_angles(local, order.lower())))
        lines.append(f"{pad}\tCHANNELS {len(named)} {' '.join(named)}")
        children = np.flatnonzero(s == PARENT).tolist()
        for child in children:
            joint(child, depth + 1)
        if not children:
            tip = _tip(s, body) @ axes.T / unit_m
            lines.extend((f"{pad}\tEnd Site", pad + "\t{", f"{pad}\t\tOFFSET {_row(tip)}"))
            lines.append(pad + "\t}")
        lines.append(pad + "}")

    joint(0, 0)
    values = np.concatenate(columns, 1)
    if rest_first:
        values = np.concatenate([np.zeros((1, values.shape[1])), values])
    lines.extend(("MOTION", f"Frames: {len(values)}", f"Frame Time: {1 / fps:.6f}"))
    path.write_text("\n".join([*lines, *map(_row, values)]) + "\n")
    return path


def write_acclaim(
    folder: Path, position: Points3, rotation: Rotations, body: Body = BODY, name: str = "walk"
) -> Path:
    """Write walk.asf and walk.amc as in the CMU database (y up, 0.45 lengths an inch); return the
    .amc."""
    bones = _bones(body)
    unit_m = 0.0254 / 0.45
    asf = [":version 1.10", ":name WALK", ":units", "  mass 1.0", "  length 0.45", "  angle deg"]
    asf += [":root", "   order TX TY TZ RX RY RZ", "   axis XYZ", "   position 0 0 0"]
    asf += ["   orientation 0 0 0", ":bonedata"]
    turned = Y_UP @ rotation @ Y_UP.T
    angles_deg = np.degrees(compute_angles(turned[:, 0], "zyx"))[:, ::-1]
    rows = {"root": np.concatenate([position[:, 0] @ Y_UP.T / unit_m, angles_deg], 1)}
    for k, (bone, above, segment, along) in enumerate(bones):
        length = max(np.linalg.norm(along), 1e-9)
        axis = np.array([10.0 * k, -7.0 * k, 3.0 * k])
        c = _fixed_axes(np.radians(axis))
        asf += ["  begin", f"     id {k + 1}", f"     name {bone}"]
        asf += [f"     direction {_row(Y_UP @ along / length)}", f"     length {length / unit_m}"]
        asf += [f"     axis {_row(axis)}  XYZ"]
        parent_segment = next((s for name, _, s, _ in bones if name == above), 0)
        if segment != parent_segment:
            asf += ["     dof rx ry rz", "     limits (-180.0 180.0)", "   (-180.0 180.0)"]
            local = np.swapaxes(turned[:, parent_segment], -1, -2) @ turned[:, segment]
            rows[bone] = np.degrees(compute_angles(c.T @ local @ c, "zyx"))[:, ::-1]
        asf += ["  end"]
    asf += [":hierarchy", "  begin"]
    for above in dict.fromkeys(above for _, above, _, _ in bones):
        asf += [f"    {above} {' '.join(name for name, over, _, _ in bones if over == above)}"]
    (folder / f"{name}.asf").write_text("\n".join([*asf, "  end"]) + "\n")
    amc = [f"#!OML:ASF {name}.asf", ":FULLY-SPECIFIED", ":DEGREES"]
    for t in range(len(position)):
        amc += [str(t + 1), *(f"{bone} {_row(row[t])}" for bone, row in rows.items())]
    (folder / f"{name}.amc").write_text("\n".join(amc) + "\n")
    return folder / f"{name}.amc"


def _bones(body: Body) -> list[tuple[str, str, int, Floats]]:
    """Return name, parent, segment, and vector from start to end of each bone."""
    rest = body.rest_position

    def way(first: str, second: str) -> Floats:
        return rest[SEGMENT[second]] - rest[SEGMENT[first]]

    bones = [
        ("lowerback", "root", "abdomen", way("abdomen", "torso")),
        ("upperback", "lowerback", "torso", way("torso", "chest")),
        ("thorax", "upperback", "chest", way("chest", "neck")),
        ("lowerneck", "thorax", "neck", way("neck", "head")),
        ("head", "lowerneck", "head", _tip(SEGMENT["head"], body)),
    ]
    for s, side in (("l", "left_"), ("r", "right_")):
        bones += [
            (f"{s}hipjoint", "root", "pelvis", way("pelvis", f"{side}thigh")),
            (f"{s}femur", f"{s}hipjoint", f"{side}thigh", way(f"{side}thigh", f"{side}shank")),
            (f"{s}tibia", f"{s}femur", f"{side}shank", way(f"{side}shank", f"{side}foot")),
            (f"{s}foot", f"{s}tibia", f"{side}foot", way(f"{side}foot", f"{side}toes")),
            (f"{s}toes", f"{s}foot", f"{side}toes", _tip(SEGMENT[f"{side}toes"], body)),
            (f"{s}girdle", "upperback", "chest", way("chest", f"{side}clavicle")),
            (f"{s}clavicle", f"{s}girdle", f"{side}clavicle",
             way(f"{side}clavicle", f"{side}upper_arm")),
            (f"{s}humerus", f"{s}clavicle", f"{side}upper_arm",
             way(f"{side}upper_arm", f"{side}forearm")),
            (f"{s}radius", f"{s}humerus", f"{side}forearm", way(f"{side}forearm", f"{side}hand")),
            (f"{s}wrist", f"{s}radius", f"{side}hand", _tip(SEGMENT[f"{side}hand"], body)),
        ]  # fmt: skip
    return [(name, above, SEGMENT[segment], along) for name, above, segment, along in bones]


def _tip(s: int, body: Body) -> Floats:
    """Return the end of a segment that carries no other, (3,) [m]."""
    if SEGMENTS[s].endswith("toes"):
        marks = make_marks(body, landmarks=True)
        return marks.offset[13 if SEGMENTS[s].startswith("left") else 14]
    return np.array([0.0, 0.0, 0.2]) if SEGMENTS[s] == "head" else np.array([0.08, 0.0, 0.0])


def _fixed_axes(angles: Floats) -> Rotations:
    """Return rotations about fixed x, then y, then z, (3, 3)."""
    x, y, z = (about_axis(axis, angle) for axis, angle in zip(AXES, angles, strict=True))
    return z @ y @ x


def _row(values: Floats) -> str:
    return " ".join(f"{value:.6f}" for value in values)
