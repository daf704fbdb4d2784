"""Where a body's joints are: anatomically, and of a body that was not looked at."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hrc_env.core.typing import Floats, Points3
from hrc_env.perception.calibration import KIND, KINDS
from hrc_env.worker.body import Body, find_baked, load_body


def anatomical(body: Body) -> Body:
    """The body with its joints at the anatomical landmarks (COCO's) that it was baked with."""
    return replace(body, joint_offset=_landmarks(body.names[0]))


def not_looked_at(name: str, others: Sequence[str]) -> Body:
    """A body whose joints lie as far from its landmarks as those of others do on average, so that
    nothing of it is fitted to what was detected of it (assets/workers/calibrate_joints.py)."""
    return replace(load_body(name), joint_offset=_landmarks(name) + np.mean(_moved(others), 0))


def apart(names: Sequence[str]) -> Floats:
    """(K, 3) how far it differs between bodies where joints lie from their landmarks, a standard
    deviation [m]: ahead, to the side, up, in the frames of the segments that carry the joints."""
    variance_m2 = np.var(_moved(names), 0, ddof=1)
    return np.sqrt([variance_m2[kind == KIND].mean(0) for kind in range(len(KINDS))])


def _moved(names: Sequence[str]) -> Floats:
    """(N, J, 3) from landmarks to where joints of bodies lie [m]."""
    return np.array([load_body(name).joint_offset - _landmarks(name) for name in names])


def _landmarks(name: str) -> Points3:
    """(J, 3) in the frames of the segments that carry the joints [m]."""
    with np.load(find_baked(name)) as baked:
        return baked["joint_anatomical_offset"].astype(float)
