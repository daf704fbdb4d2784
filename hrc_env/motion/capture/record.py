"""What a file of motion capture says, in the project's joints, frames and units."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.errors import ConfigError, check_shape
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Ints, Points3, Rotations

SLOWEST_HZ, FASTEST_HZ = 5.0, 1000.0
"""Frame rates between which a recording is believed; judgement: below, a step is lost."""


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

    def __post_init__(self) -> None:
        check_shape("joints", self.joints_world.shape[1:], (N_JOINTS, 3), "joints, xyz")
        check_rate(self.fps, self.source)


@dataclass(frozen=True, slots=True)
class Moving:
    """A skeleton in a file's own frame and unit, N nodes over T frames."""

    names: tuple[str, ...]
    """(N,) as in the file; the tip of a chain is called after its joint, with " end" added."""
    position: Points3
    """(T, N, 3) origins of the nodes [unit of the file]."""
    rotation: Rotations
    """(T, N, 3, 3) file_from_node."""
    rest: Points3
    """(N, 3) origins with every rotation zero [unit of the file]."""
    fps: float
    """Frames a second; NaN where the format has none."""
    repaired: tuple[str, ...] = ()
    """What was guessed or mended, a sentence each."""


def forward(parent: Ints, offset: Floats, rotation: Rotations) -> tuple[Points3, Rotations]:
    """Forward kinematics of a tree whose parents come before their children.

    Args:
        parent: (N,) -1 for the root.
        offset: (T or 1, N, 3) origin of each node in its parent's frame.
        rotation: (T, N, 3, 3) parent_from_node.

    Returns:
        Origins (T, N, 3) and rotations (T, N, 3, 3) in the frame of the root's parent.
    """
    position = np.broadcast_to(offset, (*rotation.shape[:2], 3)).copy()
    turned = rotation.copy()
    for node, above in enumerate(parent):
        if above >= 0:
            turned[:, node] = turned[:, above] @ rotation[:, node]
            arm = turned[:, above] @ position[:, node, :, None]
            position[:, node] = position[:, above] + arm[..., 0]
    return position, turned


def check_rate(fps: float, source: str) -> None:
    """Refuse a frame rate that cannot be.

    Raises:
        ConfigError: no number, or outside SLOWEST_HZ to FASTEST_HZ.
    """
    if not SLOWEST_HZ <= fps <= FASTEST_HZ:
        raise ConfigError(
            f"{source}: a frame rate between {SLOWEST_HZ:g} and {FASTEST_HZ:g} frames a second is "
            f"expected, the file has {fps:g}. If you know the true one, give it (--source-fps)."
        )
