"""By how many frames the cameras of a recording are out of step.

No clock is needed: of all shifts, the right ones let the views agree best. The measure is
the median distance between a camera's detections and what plain triangulation from the other
cameras projects there; no estimator takes part.
"""

import numpy as np

from benchmarks.recorded.detections import Detections
from benchmarks.tracking.dlt import triangulate_frame
from hrc_env.core.typing import Floats
from hrc_env.geometry.cameras import project

MAX_LAG_FRAMES = 10
SURE = 0.5
"""Detections of less confidence do not count."""
_SWEEPS = 5


def lag_of(P: Floats, detections: Detections) -> list[int]:
    """Frames by which each camera shows the same moment later than the first one does.

    Coordinate descent from no lag; the frames that any shift would lose are left out of all.

    Args:
        P: (C, 3, 4) projections.
        detections: as recorded, more than 2 x 10 frames.
    """
    lags = [0] * len(P)
    for _ in range(_SWEEPS):
        before = list(lags)
        for c in range(1, len(P)):
            tried = [[*lags[:c], lag, *lags[c + 1 :]] for lag in _LAGS]
            lags = min(tried, key=lambda lags: _disagreement(P, detections, lags))
        if lags == before:
            break
    return lags


def _disagreement(P: Floats, detections: Detections, lags: list[int]) -> float:
    """Median distance [px] of detections from what the other cameras say."""
    n_frames = len(detections.px) - 2 * MAX_LAG_FRAMES
    cut = [slice(MAX_LAG_FRAMES + lag, MAX_LAG_FRAMES + lag + n_frames) for lag in lags]
    px = np.stack([detections.px[frames, c] for c, frames in enumerate(cut)], 1)
    sure = np.stack([detections.confidence[frames, c] >= SURE for c, frames in enumerate(cut)], 1)
    px = np.where(sure[..., None], px, np.nan)
    nowhere = np.full((*px.shape[:1], *px.shape[2:3], 3), np.nan)
    off = []
    for held in range(len(P)):
        others = [c for c in range(len(P)) if c != held]
        joints = triangulate_frame(P[others], px[:, others], nowhere)
        shown, _ = project(P[held : held + 1], joints)
        off.append(np.linalg.norm(shown[:, 0] - px[:, held], axis=-1))
    return float(np.nanmedian(np.stack(off)))


_LAGS = sorted(range(-MAX_LAG_FRAMES, MAX_LAG_FRAMES + 1), key=abs)
