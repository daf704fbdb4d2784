"""An estimator of your own: triangulation, smoothed by constant gains.

python -m benchmarks --import examples/bring_your_own/estimator.py tracking --quick
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

import hrc_env
from hrc_env import EstimatorSpec, TrackerConfig, forecast, make_estimator


@dataclass(frozen=True)
class AlphaBetaConfig(TrackerConfig):
    alpha: float = 0.5


class AlphaBetaState(NamedTuple):
    points: object
    mean: np.ndarray
    velocity: np.ndarray


class AlphaBeta:
    def __init__(self, P, ctrl_dt, config):
        self.config, self.dt_s = config, ctrl_dt
        self.points = make_estimator("triangulation", P, ctrl_dt, config)

    def init(self, batch, n_workers):
        mean = np.tile(self.config.prior_mean_world, (batch, n_workers, 15, 1))
        return AlphaBetaState(self.points.init(batch, n_workers), mean, 0.0 * mean)

    def reset(self, state, ids, rngs):
        self.points.reset(state.points, ids, rngs)
        state.mean[ids], state.velocity[ids] = self.config.prior_mean_world, 0.0

    def predict(self, state, dt_s, rngs):
        self.points.predict(state.points, dt_s, rngs)
        state.mean[:] += dt_s * state.velocity

    def update(self, state, keypoints, rngs):
        self.points.update(state.points, keypoints, rngs)
        error = self.points.estimate(state.points).mean_world - state.mean
        lost = np.abs(error).max((2, 3), keepdims=True) > 0.5
        state.mean[:] += np.where(lost, error, self.config.alpha * error)
        state.velocity[:] += np.where(lost, -state.velocity, 0.1 / self.dt_s * error)

    def estimate(self, state):
        found = self.points.estimate(state.points)
        return replace(found, mean_world=1.0 * state.mean, velocity_world=1.0 * state.velocity)

    def forecast(self, state, horizon_s):
        return forecast(self.estimate(state), horizon_s, self.config)


hrc_env.register_estimator(EstimatorSpec("alpha_beta", AlphaBeta, AlphaBetaConfig, True))
