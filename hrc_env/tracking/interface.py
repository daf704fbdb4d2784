"""The interface of an estimator: from keypoints of several cameras to estimates of workers."""

from typing import Protocol, TypeVar

from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Ints, Rngs
from hrc_env.tracking.config import TrackerConfig

State = TypeVar("State")


class Estimator(Protocol[State]):
    """Estimates of W workers in each of B environments from the keypoints of several cameras.

    A control step is `predict` and then `update`. In between, the perception level "pixels" centres
    the cameras' windows where `estimate` expects the workers. The state is an array, or a record of
    arrays, with leading axes (B, W), changed in place; a copy of the arrays is a copy of the state.
    Random numbers for environment b come from `rngs[b]` only, and the results of one environment
    depend neither on the others nor on their number. Positions are in the world frame, +Z up, in
    metres and seconds. Pixels are those of the projections, u to the right and v down.

    The package handles late frames. It stores copies of the state at the end of every control step,
    returns to the last one before the frame was taken, and calls `predict` and `update` again from
    there. Therefore `predict` may be called for parts of a control step, and `update` is called
    once for each moment at which frames were taken. An estimator may handle late frames itself
    instead (`EstimatorSpec.handles_late_frames`).
    """

    @property
    def config(self) -> TrackerConfig:
        """Settings of the estimator."""
        ...

    def init(self, batch: int, n_workers: int) -> State:
        """Return the state of workers that have never been detected.

        Args:
            batch: number of environments B.
            n_workers: number of workers W in each.
        """
        ...

    def reset(self, state: State, ids: Ints, rngs: Rngs) -> None:
        """Reset some environments to the state before any detection.

        Args:
            state: as made by `init`; changed in place.
            ids: indices of the environments.
            rngs: one generator for each environment of the batch.
        """
        ...

    def predict(self, state: State, dt_s: float, rngs: Rngs) -> None:
        """Let time pass: move means, widen covariances and count ages up (Algorithm 1, line 7).

        Args:
            state: changed in place.
            dt_s: time since the last call, above 0 [s]: a control step or, where cameras are late
                or out of step, the part of one up to the next frame.
            rngs: one generator for each environment of the batch.
        """
        ...

    def update(self, state: State, keypoints: Keypoints, rngs: Rngs) -> None:
        """Condition the state on one set of frames (lines 8 to 17); no keypoints raise an error.

        Args:
            state: changed in place.
            keypoints: (B, C, W, J) in pinhole pixels, assigned to workers. A joint that was not
                detected, and every joint of a camera without a frame, has NaN pixels, confidence 0
                and infinite sigma. All frames were taken at the time up to which `predict` was
                called; only estimators that handle late frames read `Keypoints.time_s`.
            rngs: one generator for each environment of the batch.
        """
        ...

    def estimate(self, state: State) -> PoseEstimate:
        """Return the present estimate, in new arrays."""
        ...

    def forecast(self, state: State, horizon_s: float) -> PoseEstimate:
        """Return the estimate expected in `horizon_s`, in (0, 1] [s]; the state is not changed."""
        ...
