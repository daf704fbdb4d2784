"""What a file of motion capture says, in the project's joints, frames and units."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.typing import Floats, Ints, Points3, Rotations

FEWEST_FRAMES = 2


@dataclass(frozen=True, slots=True)
class Capture:
    """A person's joints over time, upright on the floor."""

    joints_world: Points3
    """(T, 15, 3) joints in the order of `hrc_env.core.skeleton.JOINTS`, +Z up, floor at 0 [m]."""
    fps: float
    """Frames a second."""
    landmarks: bool
    """True: joints as BlazePose means them; False: the centres that the bones turn about."""
    found: tuple[str, ...]
    """(15,) by which name the file calls each joint."""
    source: str
    """Name of the file."""
    repaired: tuple[str, ...] = ()
    """What was guessed or mended, a sentence each."""


@dataclass(frozen=True, slots=True)
class Moving:
    """A skeleton in a file's own frame and unit, N nodes over T frames."""

    names: tuple[str, ...]
    """(N,) as in the file; the tip of a chain is called after its joint, with " end" added."""
    parent: Ints
    """(N,) the node that each hangs on, -1 for none; it comes before those that hang on it."""
    position: Points3
    """(T, N, 3) origins of the nodes [unit of the file]."""
    rotation: Rotations
    """(T, N, 3, 3) file_from_node."""
    rest: Points3
    """(N, 3) origins with every rotation zero [unit of the file]."""
    fps: float
    """Frames a second; NaN where the format has none."""
    shift: Points3
    """(T, 3) how much further all nodes would be if the places of whole bodies were added to their
    OFFSET and did not stand for it [unit of the file]."""
    repaired: tuple[str, ...] = ()
    """What was guessed or mended, a sentence each."""


def forward(parent: Ints, offset: Floats, rotation: Rotations) -> tuple[Points3, Rotations]:
    """Origins (T, N, 3) and rotations (T, N, 3, 3) of a tree whose parents come first (-1: none),
    from those in the parent's frame."""
    position = np.broadcast_to(offset, (*rotation.shape[:2], 3)).copy()
    turned = rotation.copy()
    for node, above in enumerate(parent):
        if above >= 0:
            turned[:, node] = turned[:, above] @ rotation[:, node]
            arm = turned[:, above] @ position[:, node, :, None]
            position[:, node] = position[:, above] + arm[..., 0]
    return position, turned


def at_rest(parent: Ints, offset: Floats) -> Points3:
    """Origins (N, 3) of a tree without rotations."""
    return forward(parent, offset[None], np.tile(np.eye(3), (1, len(offset), 1, 1)))[0][0]
