"""A walk of the project's own worker, for every format to carry."""

from types import SimpleNamespace

import pytest
from recorded import walk_straight
from written import centres, filmed, true_joints

FPS = 50.0


@pytest.fixture(scope="session")
def work():
    """A worker who walks: segments, joints in both senses."""
    motion = walk_straight(1.2, length_m=5.0, dt_s=1 / FPS).motion
    position, rotation = filmed(motion)
    return SimpleNamespace(
        position=position, rotation=rotation, fps=FPS,
        centres=centres(position), joints=true_joints(motion),
    )  # fmt: skip
