"""Content of motion-capture files: skeletons as read, and joints in the project's conventions."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.core.typing import Floats, Ints, Points3, Rotations

FEWEST_FRAMES = 2


@dataclass(frozen=True, slots=True)
class Capture:
    """Joints of a recorded person over time, upright on the floor."""

    joints_world: Points3
    """Joints (T, 15, 3) in the order of `core.skeleton.JOINTS` [m]; +z is up, the floor at 0."""
    fps: float
    """Frame rate [Hz]."""
    are_landmarks: bool
    """Whether joints are BlazePose landmarks instead of centres of rotation of the bones."""
    node_names: tuple[str, ...]
    """Names (15,) of the joints in the file."""
    source: str
    """Name of the file."""
    notes: tuple[str, ...] = ()
    """A sentence for each guess and each repair."""


@dataclass(frozen=True, slots=True)
class Moving:
    """Motion of a skeleton of N nodes over T frames, in the frame and unit of its file."""

    names: tuple[str, ...]
    """Names (N,) in the file; the tip of a chain has the name of its joint with " end" added."""
    parent: Ints
    """Parent (N,) of each node, -1 for none; parents come before their children."""
    position: Points3
    """Origins (T, N, 3) of the nodes [unit of the file]."""
    rotation: Rotations
    """Rotations (T, N, 3, 3) file_from_node."""
    rest: Points3
    """Origins (N, 3) of the nodes if all rotations are zero [unit of the file]."""
    fps: float
    """Frame rate [Hz]; NaN if the format does not state it."""
    shift: Points3
    """Displacement (T, 3) of all nodes if the body's position is relative to its OFFSET.

    It is in the unit of the file, and not included in `position`.
    """
    notes: tuple[str, ...] = ()
    """A sentence for each guess and each repair."""


class Repaired(NamedTuple):
    """Joints after a repair."""

    joints: Points3
    """Joints (T, 15, 3)."""
    notes: tuple[str, ...]
    """A sentence for each change."""


class TreePose(NamedTuple):
    """Poses of a tree's nodes in a common frame."""

    position: Points3
    """Origins (T, N, 3) of the nodes."""
    rotation: Rotations
    """Rotations (T, N, 3, 3) of the nodes."""


def compose_tree(parent: Ints, offset: Floats, rotation: Rotations) -> TreePose:
    """Compose the poses of a tree's nodes from their poses in the parents' frames.

    Args:
        parent: parent (N,) of each node, -1 for none; parents come before their children.
        offset: origins (T, N, 3) or (1, N, 3) in the parents' frames.
        rotation: rotations (T, N, 3, 3) in the parents' frames.
    """
    position = np.broadcast_to(offset, (*rotation.shape[:2], 3)).copy()
    turned = rotation.copy()
    for node, above in enumerate(parent):
        if above >= 0:
            turned[:, node] = turned[:, above] @ rotation[:, node]
            arm = turned[:, above] @ position[:, node, :, None]
            position[:, node] = position[:, above] + arm[..., 0]
    return TreePose(position, turned)


def place_at_rest(parent: Ints, offset: Floats) -> Points3:
    """Return the origins (N, 3) of a tree's nodes if all rotations are zero."""
    rotation = np.tile(np.eye(3), (1, len(offset), 1, 1))
    return compose_tree(parent, offset[None], rotation).position[0]
