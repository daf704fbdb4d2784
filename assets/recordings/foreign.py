"""Recordings in formats of their own, as joints (T, 15, 3) for the importer's npz file.

Joints are the centres of rotation of the bones. No format has a nose; it turns with the head if the
head's rotation is given, otherwise it points straight ahead of the chest.
"""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from assets.rotations import matrix_from_quaternion
from hrc_env.core.skeleton import JOINTS
from hrc_env.core.typing import Floats, Points3
from hrc_env.geometry.rotations import about_axis
from hrc_env.mocap.record import compose_tree

_NOSE_M, _TOE_M = (0.11, 0.0, 0.175), (0.13, 0.0, -0.03)
"""Offsets from a physics humanoid's neck and ankles, forward and up, to its nose and foot tips [m]:
the front of its head's sphere and of its feet's boxes."""
_CLIMB_HZ, _CLIMB_NOSE_M = 120.0, (0.11, 0.05)
"""Rate of the climbing recordings, and the offset from the head's joint to the nose, ahead and up
[m]."""
_CLIMB = (6, 25, 7, 26, 8, 27, 43, 47, 44, 48, 45, 49, 46, 50)
"""Rows of all joints but the nose among the 53 of a climbing recording; foot tips are toe bases."""
_BODIES = {
    "shoulder": "upper_arm", "elbow": "lower_arm", "wrist": "hand",
    "hip": "thigh", "knee": "shin", "ankle": "foot", "foot": "foot",
}  # fmt: skip
"""Bodies that begin at a joint in recordings of body positions."""
_TREE: tuple[tuple[str, int, tuple[float, float, float]], ...] = (
    ("root", -1, (0.0, 0.0, 0.0)),
    ("chest", 0, (0.0, 0.236151, 0.0)),
    ("neck", 1, (0.0, 0.223894, 0.0)),
    ("right_hip", 0, (0.0, 0.0, 0.084887)),
    ("right_knee", 3, (0.0, -0.421546, 0.0)),
    ("right_ankle", 4, (0.0, -0.409870, 0.0)),
    ("right_shoulder", 1, (-0.024050, 0.243500, 0.183110)),
    ("right_elbow", 6, (0.0, -0.274788, 0.0)),
    ("left_hip", 0, (0.0, 0.0, -0.084887)),
    ("left_knee", 8, (0.0, -0.421546, 0.0)),
    ("left_ankle", 9, (0.0, -0.409870, 0.0)),
    ("left_shoulder", 1, (-0.024050, 0.243500, -0.183110)),
    ("left_elbow", 11, (0.0, -0.274788, 0.0)),
    ("nose", 2, (0.11, 0.175, 0.0)),
    ("right_foot", 5, (0.13, -0.03, 0.0)),
    ("right_wrist", 7, (0.0, -0.258947, 0.0)),
    ("left_foot", 10, (0.13, -0.03, 0.0)),
    ("left_wrist", 12, (0.0, -0.258947, 0.0)),
)
"""The humanoid of the .txt recordings (y up, x ahead): name, parent, offset [m], in the order of
their columns; knees and elbows are hinges about z, the rest are quaternions, tips have none."""


def read_joints(path: Path) -> tuple[Points3, float]:
    """Read joints (T, 15, 3) and frame rate of a recording in a format that the importer does not
    read."""
    return READERS[path.suffix](path)


def _climb(path: Path) -> tuple[Points3, float]:
    """Read an array of positions (T, 53, 3)."""
    points = np.load(path, allow_pickle=False).astype(float)
    joints = points[:, (4, *_CLIMB)].copy()
    up = points[:, 4] - points[:, 3]
    up /= np.linalg.norm(up, axis=-1, keepdims=True)
    ahead = np.cross(joints[:, 1] - joints[:, 2], up)
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    joints[:, 0] += _CLIMB_NOSE_M[0] * ahead + _CLIMB_NOSE_M[1] * up
    return joints, _CLIMB_HZ


def _bodies(path: Path) -> tuple[Points3, float]:
    """Read positions and rotations of a humanoid's bodies, by name."""
    with np.load(path, allow_pickle=False) as file:
        names = [str(name) for name in file["body_names"]]
        place, turn = file["body_positions"].astype(float), file["body_rotations"].astype(float)
        fps = float(file["fps"])
    rotation, joints = matrix_from_quaternion(turn), np.empty((len(place), len(JOINTS), 3))
    for j, joint in enumerate(JOINTS):
        side, _, part = joint.partition("_")
        body = names.index(f"{side}_{_BODIES[part]}" if part else "head")
        tip = {"nose": _NOSE_M, "foot": _TOE_M}.get(part or side, (0.0, 0.0, 0.0))
        joints[:, j] = place[:, body] + rotation[:, body] @ np.array(tip)
    return joints, fps


def _quaternions(path: Path) -> tuple[Points3, float]:
    """Read rows of a time step, the root's position, and rotations in the parent's frame."""
    rows = np.array(json.loads(path.read_text())["Frames"])
    offset = np.repeat(np.array([way for _, _, way in _TREE])[None], len(rows), axis=0)
    offset[:, 0] = rows[:, 1:4]
    parent = np.array([above for _, above, _ in _TREE])
    position, _ = compose_tree(parent, offset, _rotations(rows[:, 4:]))
    order = [[name for name, _, _ in _TREE].index(joint) for joint in JOINTS]
    return position[:, order], float(1.0 / np.median(rows[:-1, 0]))


def _rotations(columns: Floats) -> Floats:
    """Return rotations of the tree's nodes, (T, nodes, 3, 3), tips not rotated."""
    out, at = np.tile(np.eye(3), (len(columns), len(_TREE), 1, 1)), 0
    for node, (name, _, _) in enumerate(_TREE):
        if at == columns.shape[1]:
            break
        if name.endswith(("knee", "elbow")):
            out[:, node] = about_axis("z", columns[:, at])
            at += 1
        else:
            out[:, node] = matrix_from_quaternion(columns[:, at : at + 4])
            at += 4
    return out


READERS: dict[str, Callable[[Path], tuple[Points3, float]]] = {
    ".npy": _climb, ".npz": _bodies, ".txt": _quaternions,
}  # fmt: skip
