"""Joint positions of bodies: at the anatomical landmarks, or as for a body without calibration."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hrc_env.core.typing import Floats, Points3
from hrc_env.perception.calibration import KIND, KINDS
from hrc_env.worker.body import Body, find_baked, load_body


def make_anatomical(body: Body) -> Body:
    """Return the body with its joints at the anatomical landmarks (COCO's) that it was baked
    with."""
    return replace(body, joint_offset=_landmarks(body.names[0]))


def make_unfitted(name: str, others: Sequence[str]) -> Body:
    """Return a body whose joint offsets from its landmarks are the mean of those of other bodies.

    Nothing of it is fitted to detections of the body itself (assets/workers/calibrate_joints.py).
    """
    return replace(
        load_body(name), joint_offset=_landmarks(name) + np.mean(_get_offsets(others), 0)
    )


def compute_spread(names: Sequence[str]) -> Floats:
    """Return the standard deviation over bodies of the joints' offsets from their landmarks, (K, 3)
    [m].

    Axes are ahead, to the side and up, in the frames of the segments that carry the joints.
    """
    variance_m2 = np.var(_get_offsets(names), 0, ddof=1)
    return np.sqrt([variance_m2[kind == KIND].mean(0) for kind in range(len(KINDS))])


def _get_offsets(names: Sequence[str]) -> Floats:
    """Return the offsets of bodies' joints from their landmarks, (N, J, 3) [m]."""
    return np.array([load_body(name).joint_offset - _landmarks(name) for name in names])


def _landmarks(name: str) -> Points3:
    """Return the landmarks in the frames of the segments that carry the joints, (J, 3) [m]."""
    with np.load(find_baked(name)) as baked:
        return baked["joint_anatomical_offset"].astype(float)
