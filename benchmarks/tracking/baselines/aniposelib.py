"""The optimizer of aniposelib for a whole clip (P. Karashchuk et al., Cell Reports 2021, BSD-2).

The optimizer is an offline method: the joints in each frame are computed from all frames of the
clip.
"""

import contextlib
import io
import warnings
from importlib import import_module
from typing import Any

import cv2
import numpy as np

from hrc_env.core.skeleton import BONES
from hrc_env.core.typing import Floats, Points2, Points3


def follow(P: Floats, px: Points2, seed: int) -> Points3:
    """Estimate joints (T, J, 3) from pixels (T, C, J, 2); the seed is unused."""
    del seed
    points = np.ascontiguousarray(np.moveaxis(px, 1, 0))
    with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # warnings of compilers, and of joints without detections
        group = _group(P)
        return np.asarray(group.triangulate_optim(points, constraints=BONES.tolist()), float)


def _group(P: Floats) -> Any:
    """Convert a rig, given by projections (C, 3, 4), to the library's camera group."""
    library = import_module("aniposelib.cameras")
    cameras = []
    for c, projection in enumerate(P):
        K, R, centre, *_ = cv2.decomposeProjectionMatrix(projection)
        eye = centre[:3, 0] / centre[3, 0]
        cameras.append(
            library.Camera(
                matrix=K / K[2, 2],
                dist=np.zeros(5),
                rvec=cv2.Rodrigues(R)[0].ravel(),
                tvec=-R @ eye,
                name=f"camera_{c + 1}",
            )
        )
    return library.CameraGroup(cameras)
