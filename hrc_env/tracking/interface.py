"""Interface of estimators, which compute workers' poses from the keypoints of several cameras."""

from typing import Protocol, TypeVar

from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Ints, Rngs
from hrc_env.tracking.config import TrackerConfig

State = TypeVar("State")


class Estimator(Protocol[State]):
    """Estimator of W workers in each of B environments from the keypoints of several cameras.

    In each control step, `predict` is called first and `update` second. Between these calls, the
    perception level "pixels" centres the cameras' windows on the workers that `estimate` returns.
    The state is an array, or a record of arrays, with leading axes (B, W), changed in place; a copy
    of the arrays is a copy of the state. Random numbers for environment b come from `rngs[b]` only,
    and the results of one environment depend neither on the others nor on their number. Positions
    are in the world frame, +Z up; units are metres and seconds. Pixels are those of the
    projections, u to the right and v down.

    The package handles late frames. It stores copies of the state at the end of every control step,
    returns to the last copy before the frame was taken, and calls `predict` and `update` again from
    there. Therefore `predict` may be called for parts of a control step, and `update` is called
    once for each time at which frames were taken. An estimator may handle late frames itself
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
            n_workers: number of workers W in each environment.
        """
        ...

    def reset(self, state: State, ids: Ints, rngs: Rngs) -> None:
        """Reset some environments to the state before any detection.

        Args:
            state: state returned by `init`; changed in place.
            ids: indices of the environments.
            rngs: one generator for each environment of the batch.
        """
        ...

    def predict(self, state: State, dt_s: float, rngs: Rngs) -> None:
        """Predict the state at a later time (Algorithm 1, line 7).

        Means move, covariances grow and ages increase.

        Args:
            state: state to predict; changed in place.
            dt_s: time since the last call, above 0 [s]. It is a control step or, if cameras are
                late or not synchronised, the part of a step up to the next frame.
            rngs: one generator for each environment of the batch.
        """
        ...

    def update(self, state: State, keypoints: Keypoints, rngs: Rngs) -> None:
        """Condition the state on one set of frames (Algorithm 1, lines 8 to 17).

        Implementations must accept all keypoints, however implausible, without an error.

        Args:
            state: state to update; changed in place.
            keypoints: (B, C, W, J) keypoints in pinhole pixels, assigned to workers. A joint that
                was not detected, and every joint of a camera without a frame, has NaN pixels,
                confidence 0 and infinite sigma. All frames were taken at the time up to which
                `predict` was called; only estimators that handle late frames read
                `Keypoints.time_s`.
            rngs: one generator for each environment of the batch.
        """
        ...

    def estimate(self, state: State) -> PoseEstimate:
        """Return the current estimate in new arrays."""
        ...

    def forecast(self, state: State, horizon_s: float) -> PoseEstimate:
        """Return the estimate expected after `horizon_s` in (0, 1] [s]; the state is unchanged."""
        ...
