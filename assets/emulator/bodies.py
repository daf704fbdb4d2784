"""Where a body's joints are: anatomically, and of a body that was not looked at."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hrc_env.core.typing import Points3
from hrc_env.worker.body import Body, baked_path, load_body


def anatomical(body: Body) -> Body:
    """The body with its joints at the anatomical landmarks (COCO's) that it was baked with."""
    return replace(body, joint_offset=_landmarks(body.names[0]))


def not_looked_at(name: str, others: Sequence[str]) -> Body:
    """A body whose joints lie as far from its landmarks as those of others do on average, so that
    nothing of it is fitted to what was detected of it (assets/workers/calibrate_joints.py)."""
    moved = [load_body(other).joint_offset - _landmarks(other) for other in others]
    return replace(load_body(name), joint_offset=_landmarks(name) + np.mean(moved, 0))


def _landmarks(name: str) -> Points3:
    """(J, 3) in the frames of the segments that carry the joints [m]."""
    with np.load(baked_path(name)) as baked:
        return baked["joint_anatomical_offset"].astype(float)
