"""Checks of custom estimators and of the estimates that they return."""

from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from typing import Any, Generic, cast

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.batching import copy_arrays
from hrc_env.core.brought import check_arguments, describe, flags_of, numbers_of
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import JOINTS, N_JOINTS
from hrc_env.core.typing import Floats, Ints, Rngs
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.interface import Estimator, State

METHODS = {
    "init": ("batch", "n_workers"),
    "reset": ("state", "ids", "rngs"),
    "predict": ("state", "dt_s", "rngs"),
    "update": ("state", "keypoints", "rngs"),
    "estimate": ("state",),
    "forecast": ("state", "horizon_s"),
}
"""Argument names of each method of an `Estimator`, by the name of the method."""
OFF_M2 = 1e-9
"""Maximum accepted asymmetry of a covariance [m^2]."""


class CheckedEstimator(Generic[State]):
    """Wrapper of an estimator that checks all its estimates.

    Args:
        name: name of the estimator, for error messages.
        inner: the estimator.

    Raises:
        ConfigError: methods or settings of the estimator are missing or have another form. The
            wrapper's methods raise it for invalid estimates.
    """

    def __init__(self, name: str, inner: Estimator[State]) -> None:
        missing = [each for each in METHODS if not callable(getattr(inner, each, None))]
        if missing:
            raise ConfigError(
                f"{name}: the estimator lacks {', '.join(missing)}; "
                "hrc_env.tracking.estimators.Estimator describes each of them."
            )
        for method, arguments in METHODS.items():
            check_arguments(f"{name}: {method}", getattr(inner, method), *arguments)
        if not isinstance(getattr(inner, "config", None), TrackerConfig):
            raise ConfigError(
                f"{name}: the estimator must have its settings, a TrackerConfig, as `config`; got "
                f"{describe(getattr(inner, 'config', None))}."
            )
        self.name, self.inner, self.n_workers = name, inner, 1

    @property
    def config(self) -> TrackerConfig:
        """Settings of the estimator."""
        return self.inner.config

    def init(self, batch: int, n_workers: int) -> State:
        """Return the state of workers that have never been detected."""
        self.n_workers = n_workers
        state = self.inner.init(batch, n_workers)
        if _find_batch(state) not in (None, batch):
            raise ConfigError(
                f"{self.name}: arrays of a state must have leading axes (B, W) = ({batch}, "
                f"{n_workers}), got {describe(state)}."
            )
        return state

    def reset(self, state: State, ids: Ints, rngs: Rngs) -> None:
        """Reset environments `ids`."""
        self.inner.reset(state, ids.copy(), rngs)

    def predict(self, state: State, dt_s: float, rngs: Rngs) -> None:
        """Predict the state after `dt_s` [s]."""
        self.inner.predict(state, dt_s, rngs)

    def update(self, state: State, keypoints: Keypoints, rngs: Rngs) -> None:
        """Update the state with a copy of one set of frames."""
        self.inner.update(state, copy_arrays(keypoints), rngs)

    def estimate(self, state: State) -> PoseEstimate:
        """Return the current estimate after checking it."""
        return self._check_estimate("estimate", self.inner.estimate(state), _find_batch(state))

    def forecast(self, state: State, horizon_s: float) -> PoseEstimate:
        """Return the estimate expected after `horizon_s` [s] after checking it."""
        return self._check_estimate(
            "forecast", self.inner.forecast(state, horizon_s), _find_batch(state)
        )

    def _check_estimate(self, method: str, given: object, batch: int | None) -> PoseEstimate:
        """Check an estimate and return it with contiguous arrays.

        Args:
            method: name of the method that returned it, for error messages.
            given: the estimate.
            batch: the expected number of environments; None if it is unknown.

        Raises:
            ConfigError: `given` is not a `PoseEstimate`, or one of its arrays is invalid.
        """
        if not isinstance(given, PoseEstimate):
            raise ConfigError(
                f"{self.name}: {method} must return a PoseEstimate, got {describe(given)}."
            )
        n = len(given.mean_world) if batch is None else batch
        slots = (n, self.n_workers)
        joints = (*slots, N_JOINTS)
        axes = f"B, W, {N_JOINTS} joints from {JOINTS[0]} to {JOINTS[-1]}"

        def read(field: str, unit: str, *more: int, finite: bool = True) -> Floats:
            name = f"{self.name}: {method}.{field}"
            meaning = ", ".join((axes, *map(str, more))) + f" [{unit}]"
            return numbers_of(name, getattr(given, field), (*joints, *more), meaning, finite)

        lead = f"{self.name}: {method}."
        checked = PoseEstimate(
            mean_world=read("mean_world", "m", 3),
            cov_world=read("cov_world", "m^2", 3, 3),
            velocity_world=read("velocity_world", "m/s", 3),
            age_s=read("age_s", "s"),
            tracked=flags_of(f"{lead}tracked", given.tracked, slots, "B, W"),
            unknown=flags_of(f"{lead}unknown", given.unknown, slots, "B, W"),
            unobserved_s=numbers_of(f"{lead}unobserved_s", given.unobserved_s, slots, "B, W"),
            seen_world=read("seen_world", "m", 3, finite=False),
        )
        self._check_covariance(f"{lead}cov_world", checked.cov_world)
        if (checked.age_s < 0).any():
            raise ConfigError(f"{lead}age_s must not be negative [s], got {checked.age_s.min()}.")
        return checked

    def _check_covariance(self, name: str, cov: Floats) -> None:
        """Raise `ConfigError` unless covariances (..., 3, 3) are symmetric positive definite."""
        if np.abs(cov - cov.swapaxes(-1, -2)).max(initial=0.0) > OFF_M2:
            raise ConfigError(f"{name} must be symmetric.")
        try:
            np.linalg.cholesky(cov)
        except np.linalg.LinAlgError as error:
            least = np.linalg.eigvalsh(cov).min()
            raise ConfigError(
                f"{name} must be positive definite, got an eigenvalue of {least:.3g} m^2."
            ) from error


def _find_batch(state: object) -> int | None:
    """Return the length of the first axis of a state's arrays, or None if it has no arrays."""
    if isinstance(state, np.ndarray):
        shape = cast(NDArray[Any], state).shape
        return shape[0] if shape else None
    if is_dataclass(state) and not isinstance(state, type):
        parts: Sequence[object] = [getattr(state, each.name) for each in fields(state)]
    elif isinstance(state, tuple | list):
        parts = cast(Sequence[object], state)
    else:
        return None
    sizes = (_find_batch(part) for part in parts)
    return next((size for size in sizes if size is not None), None)
