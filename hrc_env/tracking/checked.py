"""Estimators that users bring, behind a check of everything that they give."""

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from hrc_env.core.batching import copied
from hrc_env.core.brought import check_arguments, described, flags_of, numbers_of
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import JOINTS, N_JOINTS
from hrc_env.core.typing import Floats, Ints, Rngs
from hrc_env.tracking.config import TrackerConfig

METHODS = {
    "init": ("batch", "n_workers"),
    "reset": ("state", "ids", "rngs"),
    "predict": ("state", "dt_s", "rngs"),
    "update": ("state", "keypoints", "rngs"),
    "estimate": ("state",),
    "forecast": ("state", "horizon_s"),
}
"""Methods of `estimators.Estimator`, with their arguments."""
OFF_M2 = 1e-9
"""A covariance is symmetric up to this [m^2]."""


class CheckedEstimator:
    """An estimator whose estimates are checked; `ConfigError` says what is wrong with them."""

    def __init__(self, name: str, inner: Any) -> None:
        """Raise `ConfigError` for an estimator that lacks methods or settings."""
        missing = [each for each in METHODS if not callable(getattr(inner, each, None))]
        if missing:
            raise ConfigError(
                f"{name}: the estimator lacks {', '.join(missing)}; "
                "hrc_env.tracking.estimators.Estimator says what each does."
            )
        for method, arguments in METHODS.items():
            check_arguments(f"{name}: {method}", getattr(inner, method), *arguments)
        if not isinstance(getattr(inner, "config", None), TrackerConfig):
            raise ConfigError(
                f"{name}: the estimator must have its settings, a TrackerConfig, as `config`; got "
                f"{described(getattr(inner, 'config', None))}."
            )
        self.name, self.inner, self.n_workers = name, inner, 1

    @property
    def config(self) -> TrackerConfig:
        """The settings."""
        return self.inner.config

    def init(self, batch: int, n_workers: int) -> Any:
        """Return a state in which no worker has been seen."""
        self.n_workers = n_workers
        state = self.inner.init(batch, n_workers)
        if _batch_of(state) not in (None, batch):
            raise ConfigError(
                f"{self.name}: arrays of a state must begin with (B, W) = ({batch}, {n_workers}), "
                f"got {described(state)}."
            )
        return state

    def reset(self, state: Any, ids: Ints, rngs: Rngs) -> None:
        """Start environments `ids` anew."""
        self.inner.reset(state, ids.copy(), rngs)

    def predict(self, state: Any, dt_s: float, rngs: Rngs) -> None:
        """Let `dt_s` seconds pass."""
        self.inner.predict(state, dt_s, rngs)

    def update(self, state: Any, keypoints: Keypoints, rngs: Rngs) -> None:
        """Take one set of frames in, of which the estimator gets arrays of its own."""
        self.inner.update(state, copied(keypoints), rngs)

    def estimate(self, state: Any) -> PoseEstimate:
        """Return what is believed now, checked."""
        return self._checked("estimate", self.inner.estimate(state), _batch_of(state))

    def forecast(self, state: Any, horizon_s: float) -> PoseEstimate:
        """Return what is expected in `horizon_s` [s], checked."""
        return self._checked("forecast", self.inner.forecast(state, horizon_s), _batch_of(state))

    def _checked(self, what: str, given: object, batch: int | None) -> PoseEstimate:
        if not isinstance(given, PoseEstimate):
            raise ConfigError(
                f"{self.name}: {what} must give a PoseEstimate, got {described(given)}."
            )
        n = len(given.mean_world) if batch is None else batch
        slots = (n, self.n_workers)
        joints = (*slots, N_JOINTS)
        axes = f"B, W, {N_JOINTS} joints from {JOINTS[0]} to {JOINTS[-1]}"

        def read(field: str, unit: str, *more: int, finite: bool = True) -> Floats:
            name = f"{self.name}: {what}.{field}"
            meaning = ", ".join((axes, *map(str, more))) + f" [{unit}]"
            return numbers_of(name, getattr(given, field), (*joints, *more), meaning, finite)

        lead = f"{self.name}: {what}."
        checked = PoseEstimate(
            mean_world=read("mean_world", "m", 3),
            cov_world=read("cov_world", "m^2", 3, 3),
            velocity_world=read("velocity_world", "m/s", 3),
            age_s=read("age_s", "s"),
            tracked=flags_of(f"{lead}tracked", given.tracked, slots, "B, W"),
            unknown=flags_of(f"{lead}unknown", given.unknown, slots, "B, W"),
            blind_s=numbers_of(f"{lead}blind_s", given.blind_s, slots, "B, W"),
            seen_world=read("seen_world", "m", 3, finite=False),
        )
        self._check_covariance(f"{lead}cov_world", checked.cov_world)
        if (checked.age_s < 0).any():
            raise ConfigError(f"{lead}age_s must not be negative [s], got {checked.age_s.min()}.")
        return checked

    def _check_covariance(self, what: str, cov: Any) -> None:
        if np.abs(cov - cov.swapaxes(-1, -2)).max(initial=0.0) > OFF_M2:
            raise ConfigError(f"{what} must be symmetric.")
        try:
            np.linalg.cholesky(cov)
        except np.linalg.LinAlgError as error:
            least = np.linalg.eigvalsh(cov).min()
            raise ConfigError(
                f"{what} must be positive definite, got an eigenvalue of {least:.3g} m^2."
            ) from error


def _batch_of(state: Any) -> int | None:
    """Return the first axis of a state's arrays; None if it holds none."""
    if isinstance(state, np.ndarray):
        return len(state) if state.ndim else None
    if is_dataclass(state) and not isinstance(state, type):
        parts: Any = [getattr(state, each.name) for each in fields(state)]
    elif isinstance(state, tuple | list):
        parts = state
    else:
        return None
    sizes = (_batch_of(part) for part in parts)
    return next((size for size in sizes if size is not None), None)
