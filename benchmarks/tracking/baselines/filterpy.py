"""The unscented Kalman filter of filterpy, one for each joint (R. Labbe, MIT)."""

from importlib import import_module
from typing import Any

import numpy as np

from benchmarks.tracking.baselines.model import START_COV, F, Q, first_joints, pixels
from benchmarks.tracking.dlt import triangulate_frame
from benchmarks.tracking.rigs import DT_S, SIGMA_PX
from hrc_env.core.typing import Bools, Floats, Points2, Points3

GATE_SIGMA = 5.0
"""Number of standard deviations from the prediction beyond which pixels are ignored."""
PATIENCE = 3
"""Number of consecutive frames rejected by the gate after which a joint is restarted."""


def follow(P: Floats, px: Points2, seed: int) -> Points3:
    """Estimate joints (T, J, 3) from pixels (T, C, J, 2); the seed is unused."""
    del seed
    start = first_joints(P, px)
    joints = [_one_joint(P, px[:, :, j], start[j]) for j in range(px.shape[2])]
    return np.stack(joints, axis=1)


def _one_joint(P: Floats, px: Points2, start: Points3) -> Points3:
    """Estimate the positions (T, 3) of a joint from pixels (T, C, 2)."""
    ukf, held, lost = _filter(start), start, 0
    track = []
    for frame in px:
        seen = np.isfinite(frame[:, 0])
        try:
            ukf.predict()
            near = seen & _gate(ukf, P, frame)
            if near.any():
                R = SIGMA_PX**2 * np.eye(2 * int(near.sum()))
                ukf.update(frame[near].ravel(), R=R, P=P[near])
        except np.linalg.LinAlgError:  # the covariance is not positive definite: restart
            ukf, near = _filter(held), seen
        lost = lost + 1 if seen.sum() >= 2 and near.sum() < 2 else 0
        if lost == PATIENCE:
            ukf, lost = (
                _filter(triangulate_frame(P, frame[None, :, None], held[None, None])[0, 0]),
                0,
            )
        held = ukf.x[:3].copy()
        track.append(held)
    return np.stack(track)


def _gate(ukf: Any, P: Floats, frame: Points2) -> Bools:
    """Return a mask (C,) of cameras in which the pixel is close to the predicted one."""
    kalman = import_module("filterpy.kalman")
    near = np.zeros(len(P), bool)
    for c in range(len(P)):
        expected = pixels(P[c : c + 1], ukf.sigmas_f[:, :3])
        mean, S = kalman.unscented_transform(expected, ukf.Wm, ukf.Wc, SIGMA_PX**2 * np.eye(2))
        off = frame[c] - mean
        near[c] = off @ np.linalg.solve(S, off) < GATE_SIGMA**2
    return near


def _filter(position: Points3) -> Any:
    kalman = import_module("filterpy.kalman")
    ukf = kalman.UnscentedKalmanFilter(
        dim_x=6,
        dim_z=2,
        dt=DT_S,
        hx=lambda x, P: pixels(P, x[:3]),
        fx=lambda x, dt: F @ x,
        points=kalman.MerweScaledSigmaPoints(6, alpha=0.1, beta=2.0, kappa=-3.0),
    )
    ukf.x, ukf.P, ukf.Q = np.concatenate([position, np.zeros(3)]), START_COV.copy(), Q
    return ukf
