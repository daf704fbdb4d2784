"""Estimators by name, and what each of them can do.

| name | what it is |
|---|---|
| `particle` | the default: hypotheses about what is discrete, each with one Gaussian on the body |
| `kalman` | the same with one hypothesis: a Gaussian on the kinematic tree |
| `paper` | the paper's Algorithm 1 as printed: particles begin all over the place |
| `paper_restarts` | the same, begun, repaired and given up as the others are |
| `triangulation` | every frame by itself, all views by weighted least squares; gaps are held |
| `ransac` | the same from the views that agree |

`smoother` is offline: `smoother.smooth` takes a whole clip (`OFFLINE`).

A control step is `predict` and then `update`; `estimate` may be asked at any time.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Protocol, TypeVar

import numpy as np

from hrc_env.core.batching import copied, rows
from hrc_env.core.brought import check_arguments, check_kind, described
from hrc_env.core.errors import ConfigError, unknown
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.registry import Registry
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Ints, Rngs
from hrc_env.tracking.checked import CheckedEstimator
from hrc_env.tracking.config import (
    PaperConfig,
    ParticleConfig,
    TrackerConfig,
    TriangulationConfig,
    of_kind,
)
from hrc_env.tracking.out_of_sequence import OutOfSequence
from hrc_env.tracking.paper import PaperEstimator
from hrc_env.tracking.paper_restarts import PaperRestarts
from hrc_env.tracking.particle import ParticleEstimator
from hrc_env.tracking.triangulating import TriangulationEstimator

State = TypeVar("State")


class Estimator(Protocol[State]):
    """From keypoints to a belief, for B environments with W workers each.

    A control step is `predict` and then `update`; in between, level "pixels" puts the cameras'
    windows where `estimate` expects the workers. The state is an array, or a record of arrays, with
    leading axes (B, W), changed in place: copying the arrays copies it. Random numbers for
    environment b come from `rngs[b]` only, and nothing that happens in one environment depends on
    the others or on how many there are.
    Positions are in the world, +Z up, in metres and seconds; pixels are those of the cameras'
    projections, u to the right and v down.

    A frame that arrives late is no concern of an estimator. The package keeps what was believed at
    the end of every control step (copies of the state), goes back to the last one before the frame
    was taken, and calls `predict` and `update` again from there. So `predict` may be asked for
    parts of a control step, and `update` comes once for each moment at which frames were taken; an
    estimator that would rather do this itself says so (`EstimatorSpec.handles_late_frames`).
    """

    @property
    def config(self) -> TrackerConfig:
        """The settings."""
        ...

    def init(self, batch: int, n_workers: int) -> State:
        """Return a state in which no worker has been seen."""
        ...

    def reset(self, state: State, ids: Ints, rngs: Rngs) -> None:
        """Start environments `ids` anew.

        Args:
            state: as `init` made it; changed in place.
            ids: rows of the environments.
            rngs: one generator for each environment of the batch.
        """
        ...

    def predict(self, state: State, dt_s: float, rngs: Rngs) -> None:
        """Let time pass (Algorithm 1, line 7): move means on, widen covariances, count ages up.

        Args:
            state: changed in place.
            dt_s: time since the last call, above 0 [s]: a control step, or where cameras are late
                or out of step the part of one up to the next frame.
            rngs: one generator for each environment of the batch.
        """
        ...

    def update(self, state: State, keypoints: Keypoints, rngs: Rngs) -> None:
        """Take one set of frames in (lines 8 to 17); whatever they show, it does not raise.

        Args:
            state: changed in place.
            keypoints: (B, C, W, J) in pinhole pixels, already sorted by worker. A joint that was
                not found, and every joint of a camera that gave no frame, has NaN pixels,
                confidence 0 and infinite sigma: that is no measurement, never one at 0. All of
                them belong to the time up to which `predict` was called; `Keypoints.time_s` is of
                interest to who handles late frames alone.
            rngs: one generator for each environment of the batch.
        """
        ...

    def estimate(self, state: State) -> PoseEstimate:
        """Return what is believed now, in arrays of its own."""
        ...

    def forecast(self, state: State, horizon_s: float) -> PoseEstimate:
        """Return what is expected in `horizon_s`, in (0, 1] [s]; the state stays as it is."""
        ...


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class EstimatorSpec:
    """An estimator by name: how it is made, and what may be set.

    `register_estimator` takes one; `estimator=` of an environment takes its name, it, or `make`.
    """

    name: str
    """As which it is registered and named in errors."""
    make: Callable[[Floats, float, Any], Estimator[Any]]
    """(P, ctrl_dt, config) -> estimator: projections from the world to pixels (C, 3, 4), time
    between updates [s], and settings, of the kind `config`."""
    config: type[TrackerConfig] = TrackerConfig
    """The kind of its settings."""
    needs_pairs: bool = False
    """Whether it makes nothing of a camera alone: beside a frame that comes alone, because it is
    late or of another rate, it is then shown the other cameras' last ones."""
    handles_late_frames: bool = False
    """Whether it uses late frames at their own time by itself. False, the default: the package
    does, round any estimator, by going back and replaying what came since. True: `update` gets
    frames as they arrive, once a control step, with their times in `Keypoints.time_s`."""

    @property
    def wants_pairs(self) -> str:
        """Its name, if it needs two cameras; else ""."""
        return self.name if self.needs_pairs else ""

    def __reduce__(self) -> tuple[Any, ...]:
        """A spec that is known by its name is pickled as that."""
        if ESTIMATORS.get(self.name) is self:
            return estimator_called, (self.name,)
        return EstimatorSpec, tuple(getattr(self, each.name) for each in fields(self))


def _kalman(P: Floats, ctrl_dt: float, config: ParticleConfig) -> ParticleEstimator:
    return ParticleEstimator(P, ctrl_dt, replace(config, n_hypotheses=1))


def _ransac(P: Floats, ctrl_dt: float, config: TriangulationConfig) -> TriangulationEstimator:
    return TriangulationEstimator(P, ctrl_dt, config, config.gate_sigma)


ESTIMATORS = Registry(
    "estimator",
    {
        spec.name: spec
        for spec in (
            EstimatorSpec("particle", ParticleEstimator, ParticleConfig),
            EstimatorSpec("kalman", _kalman, ParticleConfig),
            EstimatorSpec("paper", PaperEstimator, PaperConfig),
            EstimatorSpec("paper_restarts", PaperRestarts, PaperConfig),
            EstimatorSpec(
                "triangulation", TriangulationEstimator, TriangulationConfig, needs_pairs=True
            ),
            EstimatorSpec("ransac", _ransac, TriangulationConfig, needs_pairs=True),
        )
    },
)
"""By name: those of this package, and those that were registered."""
BUILT_IN = frozenset(ESTIMATORS.data.values())
"""Those of this package; what others give is checked (`checked.CheckedEstimator`)."""
OFFLINE = {"smoother": "hrc_env.tracking.smoother.smooth(P, clip, dt_s)"}
"""What needs the future, and the function that gives it a whole clip."""


EstimatorChoice = str | EstimatorSpec | Callable[..., Any]
"""A name in `ESTIMATORS`, a spec, or a function as `EstimatorSpec.make`."""


def estimator_called(estimator: EstimatorChoice) -> EstimatorSpec:
    """Return the spec of an estimator that is given by name, as a spec or as `EstimatorSpec.make`.

    Raises:
        ConfigError: the name is unknown or `OFFLINE`, or the function takes other arguments.
    """
    if isinstance(estimator, EstimatorSpec):
        return estimator
    if callable(estimator):
        check_arguments("An estimator", estimator, "P", "ctrl_dt", "config")
        return EstimatorSpec(getattr(estimator, "__name__", type(estimator).__name__), estimator)
    if not isinstance(estimator, str):
        raise ConfigError(
            "estimator must be a name, an EstimatorSpec or a function of (P, ctrl_dt, config), got "
            f"{described(estimator)}."
        )
    if estimator in OFFLINE:
        raise ConfigError(
            f"{estimator!r} needs the future: call {OFFLINE[estimator]} for a whole clip."
        )
    if estimator not in ESTIMATORS:
        raise unknown("estimator", estimator, ESTIMATORS)
    return ESTIMATORS[estimator]


def make_estimator(
    estimator: EstimatorChoice,
    P: Floats,
    ctrl_dt: float,
    config: TrackerConfig | None = None,
) -> Estimator[Any]:
    """Return an estimator for a rig of cameras.

    Args:
        estimator: a name in `ESTIMATORS`, an `EstimatorSpec`, or a function as its `make`.
        P: (C, 3, 4) projections from the world [m] to pixels.
        ctrl_dt: usual time between two updates [s].
        config: its settings; of another estimator's those that all share count. None: the defaults.

    Returns:
        The estimator. Of one that is not built in, arguments and estimates are checked
        (`checked.CheckedEstimator`); with `config.longest_delay_s` late frames are used at their
        own time (`out_of_sequence.OutOfSequence`), unless it handles them itself.

    Raises:
        ConfigError: the estimator is unknown or needs the future (`OFFLINE`), P is of another shape
            or not finite, `ctrl_dt` is not positive.
    """
    spec = estimator_called(estimator)
    P = np.ascontiguousarray(P, dtype=float)
    if P.ndim != 3 or P.shape[1:] != (3, 4) or not np.isfinite(P).all():
        raise ConfigError(f"P must be finite with shape (C, 3, 4), got {P.shape}.")
    if not ctrl_dt > 0:
        raise ConfigError(f"ctrl_dt must be positive, got {ctrl_dt}.")
    settings = of_kind(config, spec.config)
    made = spec.make(P, ctrl_dt, settings)
    if spec not in BUILT_IN:
        made = CheckedEstimator(spec.name, made)
    if settings.longest_delay_s > 0 and not spec.handles_late_frames:
        return OutOfSequence(made, len(P), ctrl_dt, settings.longest_delay_s, spec.needs_pairs)
    return made


_DT_S = 0.04
_P = np.array([[[900.0, 640, 0, 0], [0, 360, -900, 0], [0, 1, 0, 3]],
               [[640.0, -900, 0, 0], [360, 0, -900, 0], [1, 0, 0, 3]]])  # fmt: skip
"""Two cameras that look at the origin."""


def check_estimator(spec: EstimatorSpec) -> None:
    """Raise `ConfigError` for what an estimator lacks, or for estimates that are none.

    It is asked about workers of whom nobody sees anything: those must have an estimate, too.
    """
    if not isinstance(spec, EstimatorSpec):
        raise ConfigError(f"An estimator must be an EstimatorSpec, got {type(spec).__name__}.")
    if not (isinstance(spec.config, type) and issubclass(spec.config, TrackerConfig)):
        raise ConfigError(f"{spec.name}: config must be a kind of TrackerConfig.")
    for name in ("needs_pairs", "handles_late_frames"):
        check_kind(f"{spec.name}: {name}", getattr(spec, name), bool)
    made = make_estimator(spec, _P, _DT_S)
    state, rngs = made.init(3, 2), [np.random.default_rng(b) for b in range(3)]
    made.reset(state, np.arange(3), rngs)
    seen = (3, len(_P), 2, N_JOINTS)
    nothing = Keypoints(np.full((*seen, 2), np.nan), np.zeros(seen), np.full(seen, np.inf))
    made.predict(state, _DT_S, rngs)
    made.update(state, nothing, rngs)
    if spec.handles_late_frames:
        times_s = np.tile([_DT_S / 2, np.nan], (3, 1))  # one frame is late, the other never comes
        made.predict(state, _DT_S, rngs)
        made.update(state, replace(nothing, time_s=times_s), rngs)
    made.estimate(state)
    made.forecast(state, 0.2)
    _check_alone(spec)


def _check_alone(spec: EstimatorSpec) -> None:
    """Raise `ConfigError` for an estimator in which environments depend on each other, or on
    anything outside its state."""
    seeds = (0, 1)
    together = _followed(spec, seeds)
    for row, seed in enumerate(seeds):
        for one, several in zip(_followed(spec, (seed,)), together, strict=True):
            _check_same(spec, one, rows(several, np.array([row])), (
                "one environment is estimated otherwise beside others than alone: draw from "
                "rngs[b] of environment b only, and take nothing over the first axis"
            ))  # fmt: skip


def _followed(spec: EstimatorSpec, seeds: Sequence[int]) -> list[PoseEstimate]:
    """Return the estimates of standing people, one in each environment."""
    made, rngs = make_estimator(spec, _P, _DT_S), [np.random.default_rng(seed) for seed in seeds]
    state, everyone = made.init(len(seeds), 1), np.arange(len(seeds))
    made.reset(state, everyone, rngs)
    noise = [np.random.default_rng((seed, 1)) for seed in seeds]
    body = np.random.default_rng(0).uniform(-0.4, 0.4, (N_JOINTS, 3))
    homogeneous = np.append(body, np.ones((N_JOINTS, 1)), axis=1)
    image = homogeneous @ _P.swapaxes(-1, -2)
    px = (image[..., :2] / image[..., 2:])[None, :, None]

    def look() -> Keypoints:
        shape = (len(seeds), len(_P), 1, N_JOINTS)
        moved = np.stack([each.normal(0.0, 1.0, (*shape[1:], 2)) for each in noise])
        return Keypoints(px + moved, np.full(shape, 0.9), np.full(shape, 2.0))

    found: list[PoseEstimate] = []
    for k in range(6):
        seen, before = look(), (copied(state), copied(rngs))
        made.predict(state, _DT_S, rngs)
        made.update(state, seen, rngs)
        found.append(made.estimate(state))
        if k == 3:  # it forgets one of them, as when its episode ends
            made.reset(state, np.flatnonzero(np.array(seeds) == 1), rngs)
        if k == 5:  # late frames: it goes on from a copy of the state
            state, rngs = before
            made.predict(state, _DT_S, rngs)
            made.update(state, seen, rngs)
            _check_same(spec, made.estimate(state), found[-1], (
                "it comes to something else from a copy of its state: keep all that changes in the "
                "state, nothing in self, and draw from rngs only"
            ))  # fmt: skip
            _check_same(spec, made.estimate(state), found[-1], "estimate must change nothing")
    return found


def _check_same(spec: EstimatorSpec, one: PoseEstimate, other: PoseEstimate, said: str) -> None:
    for name in ("mean_world", "cov_world", "velocity_world", "age_s", "tracked"):
        x, y = (np.asarray(getattr(each, name), float) for each in (one, other))
        if not np.allclose(x, y, 1e-5, 1e-7):
            raise ConfigError(f"{spec.name}: {said} ({name} differs).")
