"""Registry of the estimators by name, and checks of registered estimators.

| name | estimator |
|---|---|
| `particle` | the default: several hypotheses about a body, each a Gaussian on the kinematic tree |
| `kalman` | `particle` with one hypothesis |
| `paper` | the paper's Algorithm 1 as printed; its initial particles are spread over the area |
| `paper_restarts` | `paper` with track initialization, joint reacquisition and track loss |
| `triangulation` | weighted least squares from all views of a frame; gaps hold the last position |
| `ransac` | `triangulation` from the views that agree |

`smoother` is offline: `smoother.smooth` processes a whole clip (`OFFLINE`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, cast

import numpy as np

from hrc_env.core.batching import copy_arrays, rows
from hrc_env.core.brought import check_arguments, check_kind, describe
from hrc_env.core.errors import ConfigError, make_unknown_name_error
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.registry import Registry
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats
from hrc_env.tracking.checked import CheckedEstimator
from hrc_env.tracking.config import (
    PaperConfig,
    ParticleConfig,
    TrackerConfig,
    TriangulationConfig,
    cast_config,
)
from hrc_env.tracking.interface import Estimator as Estimator
from hrc_env.tracking.out_of_sequence import OutOfSequence
from hrc_env.tracking.paper import PaperEstimator
from hrc_env.tracking.paper_restarts import PaperRestarts
from hrc_env.tracking.particle import ParticleEstimator
from hrc_env.tracking.triangulating import TriangulationEstimator


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class EstimatorSpec:
    """Specification of an estimator: its name, its factory and its settings.

    `register_estimator` takes a spec. The argument `estimator` of an environment takes a spec, the
    name of a registered one, or a function like `make`.
    """

    name: str
    """Name under which the estimator is registered and by which error messages refer to it."""
    make: Callable[[Floats, float, Any], Estimator[Any]]
    """Factory of the estimator, called as `make(P, ctrl_dt, config)`. The arguments are the
    projections (C, 3, 4) from the world [m] to pixels, the time between updates [s], and settings
    of the class `config`."""
    config: type[TrackerConfig] = TrackerConfig
    """Class of the settings that `make` takes."""
    needs_pairs: bool = False
    """Whether the estimator needs at least two cameras. If so, a frame that arrives alone, because
    it is late or its camera has another frame rate, is processed together with the last frames of
    the other cameras."""
    handles_late_frames: bool = False
    """Whether the estimator itself processes late frames at the time at which they were taken. If
    so, `update` receives frames as they arrive, once per control step, with their times in
    `Keypoints.time_s`. If not, the package returns to an earlier state and repeats the later
    steps."""

    @property
    def wants_pairs(self) -> str:
        """Name of the estimator if it needs at least two cameras, otherwise an empty string."""
        return self.name if self.needs_pairs else ""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle a registered spec by its name, and any other spec by its fields."""
        if ESTIMATORS.get(self.name) is self:
            return find_estimator, (self.name,)
        return EstimatorSpec, tuple(getattr(self, each.name) for each in fields(self))


def _make_kalman(P: Floats, ctrl_dt: float, config: ParticleConfig) -> ParticleEstimator:
    """Return the default estimator with a single hypothesis."""
    return ParticleEstimator(P, ctrl_dt, replace(config, n_hypotheses=1))


def _make_ransac(P: Floats, ctrl_dt: float, config: TriangulationConfig) -> TriangulationEstimator:
    """Return the estimator that triangulates from the views that agree."""
    return TriangulationEstimator(P, ctrl_dt, config, config.gate_sigma)


ESTIMATORS = Registry(
    "estimator",
    {
        spec.name: spec
        for spec in (
            EstimatorSpec("particle", ParticleEstimator, ParticleConfig),
            EstimatorSpec("kalman", _make_kalman, ParticleConfig),
            EstimatorSpec("paper", PaperEstimator, PaperConfig),
            EstimatorSpec("paper_restarts", PaperRestarts, PaperConfig),
            EstimatorSpec(
                "triangulation", TriangulationEstimator, TriangulationConfig, needs_pairs=True
            ),
            EstimatorSpec("ransac", _make_ransac, TriangulationConfig, needs_pairs=True),
        )
    },
)
"""Specifications of the built-in and the registered estimators, by name."""
BUILT_IN = frozenset(ESTIMATORS.data.values())
"""Specifications of the built-in estimators. The results of all other estimators are checked
(`CheckedEstimator`)."""
OFFLINE = {"smoother": "hrc_env.tracking.smoother.smooth(P, clip, dt_s)"}
"""Function calls that run each offline estimator on a whole clip, by the estimator's name."""
EstimatorChoice = str | EstimatorSpec | Callable[..., Any]
"""Type of the argument `estimator`: a name in `ESTIMATORS`, a spec, or a function like
`EstimatorSpec.make`."""


def find_estimator(estimator: EstimatorChoice) -> EstimatorSpec:
    """Return the spec of an estimator given by name, as a spec or as a function.

    Raises:
        ConfigError: the name is unknown or that of an `OFFLINE` estimator, or the function takes
            other arguments.
    """
    if isinstance(estimator, EstimatorSpec):
        return estimator
    if callable(estimator):
        check_arguments("An estimator", estimator, "P", "ctrl_dt", "config")
        return EstimatorSpec(getattr(estimator, "__name__", type(estimator).__name__), estimator)
    given = cast(object, estimator)
    if not isinstance(given, str):
        raise ConfigError(
            "estimator must be a name, an EstimatorSpec or a function of (P, ctrl_dt, config), got "
            f"{describe(estimator)}."
        )
    if estimator in OFFLINE:
        raise ConfigError(
            f"{estimator!r} is an offline method: call {OFFLINE[estimator]} for a whole clip."
        )
    if estimator not in ESTIMATORS:
        raise make_unknown_name_error("estimator", estimator, ESTIMATORS)
    return ESTIMATORS[estimator]


def make_estimator(
    estimator: EstimatorChoice,
    P: Floats,
    ctrl_dt: float,
    config: TrackerConfig | None = None,
) -> Estimator[Any]:
    """Return an estimator for a rig of cameras.

    Args:
        estimator: a name in `ESTIMATORS`, an `EstimatorSpec`, or a function like its `make`.
        P: (C, 3, 4) projections from the world [m] to pixels.
        ctrl_dt: nominal time between two updates [s].
        config: settings of the estimator; None for the defaults. From settings of another
            estimator, only the fields of `TrackerConfig` are used.

    Returns:
        The estimator. If it is not built in, its methods and its estimates are checked
        (`checked.CheckedEstimator`). If `config.max_delay_s` is positive, late frames are processed
        at the time at which they were taken (`out_of_sequence.OutOfSequence`), unless the estimator
        handles them itself.

    Raises:
        ConfigError: the estimator is unknown or `OFFLINE`, `P` has another shape or is not finite,
            or `ctrl_dt` is not positive.
    """
    spec = find_estimator(estimator)
    cameras = np.ascontiguousarray(P, dtype=float)
    if cameras.ndim != 3 or cameras.shape[1:] != (3, 4) or not np.isfinite(cameras).all():
        raise ConfigError(f"P must be finite with shape (C, 3, 4), got {cameras.shape}.")
    if not ctrl_dt > 0:
        raise ConfigError(f"ctrl_dt must be positive, got {ctrl_dt}.")
    settings = cast_config(config, spec.config)
    made: Estimator[Any] = spec.make(cameras, ctrl_dt, settings)
    if spec not in BUILT_IN:
        made = CheckedEstimator(spec.name, made)
    if settings.max_delay_s > 0 and not spec.handles_late_frames:
        memory_s = settings.max_delay_s
        return OutOfSequence(made, len(cameras), ctrl_dt, memory_s, spec.needs_pairs)
    return made


_DT_S = 0.04
_P = np.array([[[900.0, 640, 0, 0], [0, 360, -900, 0], [0, 1, 0, 3]],
               [[640.0, -900, 0, 0], [360, 0, -900, 0], [1, 0, 0, 3]]])  # fmt: skip
"""(2, 3, 4) projections of two cameras that face the origin. They are used to check estimators."""


def check_estimator(spec: EstimatorSpec) -> None:
    """Raise `ConfigError` if an estimator is incomplete or returns invalid estimates.

    Workers that no camera sees must also have an estimate.
    """
    given = cast(object, spec)
    if not isinstance(given, EstimatorSpec):
        raise ConfigError(f"An estimator must be an EstimatorSpec, got {type(given).__name__}.")
    kind = cast(object, spec.config)
    if not (isinstance(kind, type) and issubclass(kind, TrackerConfig)):
        raise ConfigError(f"{spec.name}: config must be a subclass of TrackerConfig.")
    for name in ("needs_pairs", "handles_late_frames"):
        check_kind(f"{spec.name}: {name}", getattr(spec, name), bool)
    made = make_estimator(spec, _P, _DT_S)
    state, rngs = made.init(3, 2), [np.random.default_rng(b) for b in range(3)]
    made.reset(state, np.arange(3), rngs)
    shape = (3, len(_P), 2, N_JOINTS)
    nothing = Keypoints(np.full((*shape, 2), np.nan), np.zeros(shape), np.full(shape, np.inf))
    made.predict(state, _DT_S, rngs)
    made.update(state, nothing, rngs)
    if spec.handles_late_frames:
        times_s = np.tile([_DT_S / 2, np.nan], (3, 1))  # one frame is late, the other never comes
        made.predict(state, _DT_S, rngs)
        made.update(state, replace(nothing, time_s=times_s), rngs)
    made.estimate(state)
    made.forecast(state, 0.2)
    _check_independence(spec)


_DEPENDS_ON_OTHERS = (
    "an environment must have the same estimates in a batch as alone: draw random numbers only "
    "from rngs[b] of environment b, and do not reduce over the first axis"
)
_DEPENDS_ON_SELF = (
    "a copy of the state must lead to the same estimates: keep everything that changes in the "
    "state, nothing in self, and draw random numbers only from rngs"
)


def _check_independence(spec: EstimatorSpec) -> None:
    """Raise `ConfigError` if an environment's estimates depend on anything but its own state."""
    seeds = (0, 1)
    together = _track_people(spec, seeds)
    for row, seed in enumerate(seeds):
        for one, several in zip(_track_people(spec, (seed,)), together, strict=True):
            _check_same(spec, one, rows(several, np.array([row])), _DEPENDS_ON_OTHERS)


def _track_people(spec: EstimatorSpec, seeds: Sequence[int]) -> list[PoseEstimate]:
    """Return six successive estimates of one motionless person in each environment.

    Args:
        spec: the estimator.
        seeds: one seed for each environment.

    Raises:
        ConfigError: the estimates depend on anything but the state.
    """
    made, rngs = make_estimator(spec, _P, _DT_S), [np.random.default_rng(seed) for seed in seeds]
    state, everyone = made.init(len(seeds), 1), np.arange(len(seeds))
    made.reset(state, everyone, rngs)
    noise = [np.random.default_rng((seed, 1)) for seed in seeds]
    body = np.random.default_rng(0).uniform(-0.4, 0.4, (N_JOINTS, 3))
    homogeneous = np.append(body, np.ones((N_JOINTS, 1)), axis=1)
    image = homogeneous @ _P.swapaxes(-1, -2)
    px = (image[..., :2] / image[..., 2:])[None, :, None]

    def detect() -> Keypoints:
        shape = (len(seeds), len(_P), 1, N_JOINTS)
        moved = np.stack([each.normal(0.0, 1.0, (*shape[1:], 2)) for each in noise])
        return Keypoints(px + moved, np.full(shape, 0.9), np.full(shape, 2.0))

    estimates: list[PoseEstimate] = []
    for k in range(6):
        detected, before = detect(), (copy_arrays(state), copy_arrays(rngs))
        made.predict(state, _DT_S, rngs)
        made.update(state, detected, rngs)
        estimates.append(made.estimate(state))
        if k == 3:  # one of the environments is reset, as when its episode ends
            made.reset(state, np.flatnonzero(np.array(seeds) == 1), rngs)
        if k == 5:  # as with late frames, the estimator continues from a copy of the state
            state, rngs = before
            made.predict(state, _DT_S, rngs)
            made.update(state, detected, rngs)
            _check_same(spec, made.estimate(state), estimates[-1], _DEPENDS_ON_SELF)
            last = "estimate must change nothing"
            _check_same(spec, made.estimate(state), estimates[-1], last)
    return estimates


def _check_same(spec: EstimatorSpec, one: PoseEstimate, other: PoseEstimate, message: str) -> None:
    """Raise `ConfigError` unless two estimates are equal up to rounding errors.

    Args:
        spec: the estimator, for the error message.
        one: an estimate.
        other: an estimate that should be the same.
        message: description of the fault, for the error message.
    """
    for name in ("mean_world", "cov_world", "velocity_world", "age_s", "tracked"):
        x, y = (np.asarray(getattr(each, name), float) for each in (one, other))
        if not np.allclose(x, y, 1e-5, 1e-7):
            raise ConfigError(f"{spec.name}: {message} ({name} differs).")
