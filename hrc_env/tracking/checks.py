"""What an estimator that somebody registers must do."""

from typing import Any

import numpy as np

from hrc_env.core.errors import ConfigError, check_shape
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.estimators import EstimatorSpec, make_estimator

METHODS = ("init", "reset", "predict", "update", "estimate", "forecast")
_DT_S = 0.04
_P = np.array([[[900.0, 640, 0, 0], [0, 360, -900, 0], [0, 1, 0, 3]],
               [[640.0, -900, 0, 0], [360, 0, -900, 0], [1, 0, 0, 3]]])  # fmt: skip
"""Two cameras that look at the origin."""


def check_estimator(spec: EstimatorSpec) -> None:
    """Raise `ConfigError` for what an estimator lacks, or for estimates that are none.

    It is made for two cameras and asked about three environments with two workers of whom nobody
    sees anything: those must have an estimate, too.
    """
    if not isinstance(spec, EstimatorSpec):
        raise ConfigError(f"An estimator must be an EstimatorSpec, got {type(spec).__name__}.")
    if not (isinstance(spec.config, type) and issubclass(spec.config, TrackerConfig)):
        raise ConfigError(f"{spec.name}: config must be a kind of TrackerConfig.")
    made = make_estimator(spec, _P, _DT_S)
    missing = [name for name in METHODS if not callable(getattr(made, name, None))]
    if missing:
        raise ConfigError(
            f"{spec.name}: the estimator lacks {', '.join(missing)}; "
            "hrc_env.tracking.estimators.Estimator says what each does."
        )
    shape = (3, 2, N_JOINTS)
    state, rngs = made.init(*shape[:2]), [np.random.default_rng(b) for b in range(3)]
    made.reset(state, np.arange(3), rngs)
    seen = (3, len(_P), 2, N_JOINTS)
    nothing = Keypoints(np.full((*seen, 2), np.nan), np.zeros(seen), np.full(seen, np.inf))
    made.predict(state, _DT_S, rngs)
    made.update(state, nothing, rngs)
    _check_estimate(spec.name, "estimate", made.estimate(state), shape)
    _check_estimate(spec.name, "forecast", made.forecast(state, 0.2), shape)


def _check_estimate(name: str, what: str, estimate: Any, shape: tuple[int, int, int]) -> None:
    if not isinstance(estimate, PoseEstimate):
        raise ConfigError(
            f"{name}: {what} must give a PoseEstimate, got {type(estimate).__name__}."
        )
    shapes = {
        "mean_world": (*shape, 3),
        "cov_world": (*shape, 3, 3),
        "velocity_world": (*shape, 3),
        "age_s": shape,
        "tracked": shape[:2],
    }
    for field, expected in shapes.items():
        value = np.asarray(getattr(estimate, field))
        check_shape(f"{name}: {what}.{field}", value.shape, expected, "B, W, J, ...")
        if not np.isfinite(value).all():
            raise ConfigError(
                f"{name}: {what}.{field} must be finite, also of whom nobody has seen: give the "
                "prior (TrackerConfig.prior_mean_world, prior_std_m)."
            )
    if np.linalg.eigvalsh(estimate.cov_world).min() <= 0:
        raise ConfigError(f"{name}: {what}.cov_world must be positive definite.")
