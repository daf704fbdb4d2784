"""The door of the room: estimators by name, and what each of them can do.

| name | what it is |
|---|---|
| `particle` | the default: hypotheses about what is discrete, each with one Gaussian on the body |
| `per_joint` | a Gaussian particle filter per joint on a body motion model |
| `kalman` | one Gaussian on the kinematic tree: honest with one camera (docs/tracking.md) |
| `paper` | the paper's Algorithm 1 as printed |
| `triangulation` | every frame by itself, all views by weighted least squares; gaps are held |
| `ransac` | the same from the views that agree |

`smoother` is offline: `smoother.smooth` takes a whole clip (`OFFLINE`).

A control step is `predict` and then `update`; `estimate` may be asked at any time.
"""

from collections.abc import Callable
from typing import Any, Protocol, TypeVar

import numpy as np

from hrc_env.core.errors import ConfigError, unknown
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.typing import Floats, Ints
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.kalman import KalmanEstimator
from hrc_env.tracking.late import LateEstimator
from hrc_env.tracking.paper import PaperEstimator
from hrc_env.tracking.particle import ParticleEstimator
from hrc_env.tracking.per_joint import PerJointEstimator
from hrc_env.tracking.triangulating import TriangulationEstimator, ransac, triangulation

State = TypeVar("State")
Rngs = list[np.random.Generator]


class Estimator(Protocol[State]):
    """From keypoints to a belief, for B environments with W workers each.

    The state is a record of arrays with leading axes (B, W), changed in place: copying the
    arrays copies it. Random numbers for environment b come from `rngs[b]` only, and nothing
    that happens in one environment depends on the others or on how many there are.
    """

    @property
    def config(self) -> TrackerConfig:
        """The settings."""
        ...

    def init(self, batch: int, n_workers: int) -> State:
        """A state in which no worker has been seen."""
        ...

    def reset(self, state: State, ids: Ints, rngs: Rngs) -> None:
        """Start environments `ids` anew."""
        ...

    def predict(self, state: State, dt_s: float, rngs: Rngs) -> None:
        """Let `dt_s` seconds pass (Algorithm 1, line 7)."""
        ...

    def update(self, state: State, keypoints: Keypoints, rngs: Rngs) -> None:
        """Take one set of frames in (lines 8 to 17); whatever they show, it does not raise."""
        ...

    def estimate(self, state: State) -> PoseEstimate:
        """What is believed now, in arrays of its own."""
        ...

    def ahead(self, state: State, horizon_s: float) -> PoseEstimate:
        """What is expected in `horizon_s`, in (0, 1] [s], if nobody looks; the state stays.

        Raises:
            ConfigError: a horizon that is none.
        """
        ...


ESTIMATORS: dict[str, Callable[[Floats, float, TrackerConfig], Estimator[Any]]] = {
    "particle": ParticleEstimator,
    "per_joint": PerJointEstimator,
    "kalman": KalmanEstimator,
    "paper": PaperEstimator,
    "triangulation": triangulation,
    "ransac": ransac,
}


OFFLINE = {"smoother": "hrc_env.tracking.smoother.smooth(P, clip, dt_s)"}
"""What needs the future, and the function that gives it a whole clip."""


def make_estimator(
    name: str, P: Floats, ctrl_dt: float, config: TrackerConfig | None = None
) -> Estimator[Any]:
    """The estimator called `name` for a rig.

    Args:
        name: one of `ESTIMATORS`.
        P: (C, 3, 4) projections of the cameras.
        ctrl_dt: the usual time between two updates [s].
        config: settings; the defaults if None. With `longest_delay_s` the estimator is wrapped
            in a `late.LateEstimator`, which uses late frames at their own time.

    Raises:
        ConfigError: a name that is unknown or `OFFLINE`, a rig of another shape, or no
            positive time.
    """
    if name in OFFLINE:
        raise ConfigError(f"{name!r} needs the future: call {OFFLINE[name]} for a whole clip.")
    if name not in ESTIMATORS:
        raise unknown("estimator", name, ESTIMATORS)
    P = np.ascontiguousarray(P, dtype=float)
    if P.ndim != 3 or P.shape[1:] != (3, 4) or not np.isfinite(P).all():
        raise ConfigError(f"P must be finite with shape (C, 3, 4), got {P.shape}.")
    if not ctrl_dt > 0:
        raise ConfigError(f"ctrl_dt must be positive, got {ctrl_dt}.")
    config = config or TrackerConfig()
    estimator = ESTIMATORS[name](P, ctrl_dt, config)
    if config.longest_delay_s > 0:
        needs_pairs = isinstance(estimator, TriangulationEstimator)
        return LateEstimator(estimator, len(P), ctrl_dt, config.longest_delay_s, needs_pairs)
    return estimator
