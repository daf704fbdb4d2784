"""Content of motion-capture files, as skeletons of the files and as joints of this package."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.core.typing import Floats, Ints, Points3, Rotations

FEWEST_FRAMES = 2


@dataclass(frozen=True, slots=True)
class Capture:
    """Joints of a recorded person over time, upright on the floor."""

    joints_world: Points3
    """Joints (T, 15, 3) in the order of `core.skeleton.JOINTS` [m]; z is up and 0 on the floor."""
    fps: float
    """Frame rate [Hz]."""
    are_landmarks: bool
    """Whether the joints are BlazePose landmarks instead of centres of rotation of the bones."""
    node_names: tuple[str, ...]
    """Names (15,) of the joints in the file."""
    source: str
    """Name of the file."""
    notes: tuple[str, ...] = ()
    """Descriptions of the guesses and repairs, one sentence each."""


@dataclass(frozen=True, slots=True)
class Moving:
    """Motion of a skeleton of N nodes over T frames, in the frame and unit of its file."""

    names: tuple[str, ...]
    """Names (N,) in the file; the tip of a chain has the name of its joint, followed by " end"."""
    parent: Ints
    """Parent (N,) of each node, -1 for none; parents come before their children."""
    position: Points3
    """Origins (T, N, 3) of the nodes [unit of the file]."""
    rotation: Rotations
    """Rotations (T, N, 3, 3) file_from_node."""
    rest: Points3
    """Origins (N, 3) of the nodes in the pose without rotations [unit of the file]."""
    fps: float
    """Frame rate [Hz]; NaN if the format does not contain it."""
    shift: Points3
    """Displacement (T, 3) of all nodes if the position in the file is relative to the OFFSET.

    It is in the unit of the file, and is not included in `position`.
    """
    notes: tuple[str, ...] = ()
    """Descriptions of the guesses and repairs, one sentence each."""


class Repaired(NamedTuple):
    """Joints after a repair."""

    joints: Points3
    """Joints (T, 15, 3)."""
    notes: tuple[str, ...]
    """Descriptions of the changes, one sentence each."""


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
    """Return the origins (N, 3) of a tree's nodes in the pose without rotations."""
    rotation = np.tile(np.eye(3), (1, len(offset), 1, 1))
    return compose_tree(parent, offset[None], rotation).position[0]
