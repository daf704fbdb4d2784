"""An estimator of your own: triangulation of the pixels (DLT), and a Kalman filter for each joint.

python -m benchmarks --import examples/bring_your_own/estimator.py tracking --quick
"""

import numpy as np

import hrc_env
from hrc_env import EstimatorSpec, PoseEstimate, forecast

STATE = np.dtype([("mean", "f8", (15, 6)), ("cov", "f8", (15, 6, 6)),  # of [m], [m/s] a joint
                  ("age_s", "f8", 15), ("tracked", "?")])  # fmt: skip


def triangulate(P, px, sigma_px):
    """Points (B, W, J, 3) by reweighted DLT, their covariances, and which two views show."""
    px, sigma_px = np.moveaxis(px, 1, 3), np.moveaxis(sigma_px, 1, 3)  # (B, W, J, C, ...)
    seen = np.isfinite(px).all(-1) & np.isfinite(sigma_px)  # NaN pixels: not found
    z, sigma = np.where(seen[..., None], px, 0.0), np.where(seen, sigma_px, 1.0)
    rows, weight = z[..., None] * P[:, 2:] - P[:, :2], 1.0 * seen
    for _ in range(4):  # views that do not fit the last point count less
        K = (np.sqrt(weight)[..., None, None] * rows).reshape(*seen.shape[:-1], -1, 4)
        M = K.swapaxes(-1, -2) @ K
        cov = np.linalg.inv(M[..., :3, :3] + 1e-6 * np.eye(3))
        point = -cov @ M[..., :3, 3:]
        depth = (P[:, 2, :3] @ point)[..., 0] + P[:, 2, 3]  # of the point in each camera [m]
        scale = sigma * np.maximum(np.abs(depth), 0.1)
        error = (rows[..., :3] @ point[..., None, :, :])[..., 0] + rows[..., 3]
        weight = seen / scale**2 / (1 + ((error / scale[..., None]) ** 2).sum(-1) / 9)
    return point[..., 0], cov, (seen.sum(-1) >= 2) & ((depth > 0) | ~seen).all(-1)


class DltKalman:
    def __init__(self, P, ctrl_dt, config):
        self.P, self.config, self.sigma_scale = P, config, 2 * config.sigma_scale  # errors last

    def init(self, batch, n_workers):
        state = np.zeros((batch, n_workers), STATE)
        self.reset(state, np.arange(batch), ())
        return state

    def reset(self, state, ids, rngs):
        state["mean"][ids] = *self.config.prior_mean_world, 0.0, 0.0, 0.0
        state["cov"][ids] = np.diag([self.config.prior_std_m**2] * 3 + [1.0] * 3)
        state["age_s"][ids], state["tracked"][ids] = self.config.max_age_s, False

    def predict(self, state, dt_s, rngs):  # late frames split a control step into shorter ones
        F = np.kron([[1, dt_s], [0, 1]], np.eye(3))
        Q = np.kron([[dt_s**3 / 3, dt_s**2 / 2], [dt_s**2 / 2, dt_s]], np.eye(3))
        state["mean"] = state["mean"] @ F.T
        cov = F @ state["cov"] @ F.T + 10 * self.config.root_acceleration * Q
        state["cov"] = (cov + cov.swapaxes(-1, -2)) / 2  # rounding would grow
        state["age_s"] = np.minimum(state["age_s"] + dt_s, self.config.max_age_s)
        self.reset(state, state["age_s"].min(-1) >= self.config.lost_after_s, rngs)

    def update(self, state, keypoints, rngs):
        sigma_px, tracked = self.sigma_scale * keypoints.sigma_px, state["tracked"]
        points, noise, found = triangulate(self.P, keypoints.px, sigma_px)
        for b, w in np.argwhere(~tracked & (found.sum(-1) >= self.config.acquire_min_joints)):
            state["mean"][b, w, :, :3], tracked[b, w] = points[b, w, found[b, w]].mean(0), True
        error, seen = points - state["mean"][..., :3], state["cov"][..., :3, :]
        precision = np.linalg.inv(seen[..., :3] + noise)
        gain = seen.swapaxes(-1, -2) @ precision
        distance = (error[..., None, :] @ precision @ error[..., None])[..., 0, 0]
        use = found & tracked[..., None] & (distance < self.config.gate_sigma**2)
        state["mean"][use] += (gain @ error[..., None])[use, :, 0]
        state["cov"][use], state["age_s"][use] = (state["cov"] - gain @ seen)[use], 0.0

    def estimate(self, state):
        cov = state["cov"][..., :3, :3] + self.config.min_std_m**2 * np.eye(3)
        widest = cov.diagonal(axis1=-2, axis2=-1).max(-1)[..., None, None]
        cov *= np.minimum(1.0, self.config.prior_std_m**2 / widest)
        mean, age_s, tracked = (state[name].copy() for name in ("mean", "age_s", "tracked"))
        return PoseEstimate(mean[..., :3], cov, mean[..., 3:], age_s, tracked)

    def forecast(self, state, horizon_s):
        return forecast(self.estimate(state), horizon_s, self.config)


hrc_env.register_estimator(EstimatorSpec("dlt_kalman", DltKalman, needs_pairs=True))
