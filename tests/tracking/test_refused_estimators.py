"""What an estimator is given, lacks or says that is wrong in one thing only is refused."""

import pickle
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Any

import cloudpickle
import numpy as np
import pytest
from simulated import DT, LAB, keypoints

from hrc_env.core.errors import ConfigError
from hrc_env.core.records import PoseEstimate
from hrc_env.tracking.config import PaperConfig, ParticleConfig, TrackerConfig, TriangulationConfig
from hrc_env.tracking.estimators import (
    ESTIMATORS,
    EstimatorSpec,
    check_estimator,
    find_estimator,
    make_estimator,
)
from hrc_env.tracking.forecast import forecast
from hrc_env.tracking.out_of_sequence import OutOfSequence
from hrc_env.tracking.smoother import smooth

SHAPE = (3, 2, 15)


def believed(**changes: Any) -> PoseEstimate:
    """Return what is believed of workers whom nobody has seen, with some fields replaced."""
    return PoseEstimate(
        **{
            "mean_world": np.zeros((*SHAPE, 3)),
            "cov_world": np.tile(np.eye(3), (*SHAPE, 1, 1)),
            "velocity_world": np.zeros((*SHAPE, 3)),
            "age_s": np.ones(SHAPE),
            "tracked": np.zeros(SHAPE[:2], bool),
            "unknown": np.ones(SHAPE[:2], bool),
            "unobserved_s": np.ones(SHAPE[:2]),
            "seen_world": np.full((*SHAPE, 3), np.nan),
        }
        | changes
    )


@dataclass
class Told:
    """An estimator that says what it is told to."""

    now: Any
    later: Any
    config: TrackerConfig = field(default_factory=TrackerConfig)

    def init(self, batch: int, n_workers: int) -> tuple[int, int]:
        """Keep the numbers of environments and workers."""
        return batch, n_workers

    def reset(self, state: tuple[int, int], ids: Any, rngs: Any) -> None:
        """Do nothing."""

    predict = update = reset

    def estimate(self, state: tuple[int, int]) -> Any:
        """Return what it was told of now."""
        return first(self.now, *state)

    def forecast(self, state: tuple[int, int], horizon_s: float) -> Any:
        """Return what it was told of later."""
        return first(self.later, *state)


def first(told: Any, batch: int, n_workers: int) -> Any:
    """Return what was told of the first environments and workers, of as many as were asked for."""
    if (batch, n_workers) == SHAPE[:2] or not isinstance(told, PoseEstimate):
        return told
    arrays = {each.name: getattr(told, each.name)[:batch, :n_workers] for each in fields(told)}
    return replace(told, **arrays)


def spec_of(now: Any = None, later: Any = None, **changes: Any) -> EstimatorSpec:
    """Return the spec of an estimator that says these, or what is right."""
    told = Told(believed() if now is None else now, believed() if later is None else later)
    return replace(EstimatorSpec("told", lambda *given: told), **changes)


def bad(name: str, value: float, at: Any) -> PoseEstimate:
    """Return what is believed with one number replaced."""
    right = believed()
    array = np.array(getattr(right, name), float)
    array[at] = value
    return replace(right, **{name: array})


def without(name: str) -> Callable[..., Any]:
    """Return what makes an estimator that lacks a method."""
    return lambda *given: type("Lacking", (Told,), {name: None})(believed(), believed())


WRONG = {
    "of another kind": ({}, "must return a PoseEstimate, got dict"),
    "less": (believed(mean_world=np.zeros((3, 2, 15, 2))), "mean_world must have shape"),
    "a covariance a number": (believed(cov_world=np.ones((3, 2, 15, 3))), "cov_world must have"),
    "a velocity a worker": (believed(velocity_world=np.ones((3, 2, 3))), "velocity_world must"),
    "an age a worker": (believed(age_s=np.ones((3, 2))), "age_s must have shape"),
    "a track a joint": (believed(tracked=np.zeros(SHAPE, bool)), "tracked must have shape"),
    "one mean": (bad("mean_world", np.nan, (2, 1, 14, 2)), "mean_world must be finite"),
    "one covariance": (bad("cov_world", np.inf, (0, 0, 0, 0, 0)), "cov_world must be finite"),
    "one velocity": (bad("velocity_world", np.nan, (0, 1, 3, 1)), "velocity_world must be fin"),
    "one age": (bad("age_s", np.inf, (1, 0, 7)), "age_s must be finite"),
    "a flat covariance": (bad("cov_world", 0.0, (2, 1, 14, 2, 2)), "must be positive definite"),
    "a negative covariance": (bad("cov_world", -1.0, (0, 0, 0, 0, 0)), "must be positive def"),
}  # fmt: skip


def test_what_is_right_is_taken():
    check_estimator(spec_of())
    check_estimator(spec_of(bad("cov_world", 1e-12, np.s_[:, 0, 0, 0, 0]), config=ParticleConfig))
    for spec in ESTIMATORS.values():
        check_estimator(spec)


@pytest.mark.parametrize("when", ["estimate", "forecast"])
@pytest.mark.parametrize("name", WRONG)
def test_a_belief_in_which_one_thing_is_wrong_is_refused(name, when):
    belief, said = WRONG[name]
    given = {"now" if when == "estimate" else "later": belief}
    with pytest.raises(ConfigError, match=rf"told: {when}.*{said}"):
        check_estimator(spec_of(**given))


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("particle", "must be an EstimatorSpec, got str"),
        (spec_of(config=dict), "must be a subclass of TrackerConfig"),
        (spec_of(config=TrackerConfig()), "must be a subclass of TrackerConfig"),
        (spec_of(needs_pairs="no"), "told: needs_pairs must be a bool, got str 'no'"),
        (spec_of(handles_late_frames=None), "told: handles_late_frames must be a bool, got None"),
        *(
            (spec_of(make=without(name)), f"the estimator lacks {name};")
            for name in ("init", "reset", "predict", "update", "estimate", "forecast")
        ),
    ],
)
def test_an_estimator_that_lacks_one_thing_is_refused(spec, said):
    with pytest.raises(ConfigError, match=said):
        check_estimator(spec)


@pytest.mark.parametrize(
    ("P", "said"),
    [
        (LAB[0], "P must be finite with shape"),
        (LAB[None], "P must be finite with shape"),
        (np.swapaxes(LAB, 1, 2), "P must be finite with shape"),
        (LAB[:, :, :3], "P must be finite with shape"),
        (np.where(np.arange(4) == 3, np.nan, LAB), "P must be finite with shape"),
        (np.zeros(()), "P must be finite with shape"),
    ],
)
def test_a_rig_of_another_shape_is_refused(P, said):
    with pytest.raises(ConfigError, match=said):
        make_estimator("particle", P, DT)


@pytest.mark.parametrize("ctrl_dt", [0.0, -0.04, np.nan])
def test_a_time_between_updates_that_is_none_is_refused(ctrl_dt):
    with pytest.raises(ConfigError, match="ctrl_dt must be positive"):
        make_estimator("particle", LAB, ctrl_dt)


def test_a_delay_is_used_where_one_is_set():
    for delay_s, late in ((0.0, False), (0.04, True)):
        made = make_estimator("particle", LAB, 1e-3, ParticleConfig(max_delay_s=delay_s))
        assert isinstance(made, OutOfSequence) == late


def test_who_handles_late_frames_gets_them_as_they_arrive():
    """With their times, once a step; nothing is replayed."""
    seen: list[Any] = []

    class Own(Told):
        def update(self, state: None, keypoints: Any, rngs: Any) -> None:
            seen.append(keypoints.time_s)

    spec = spec_of(make=lambda *given: Own(believed(), believed()), handles_late_frames=True)
    check_estimator(spec)
    assert any(times is not None and (times[:, 0] < DT).all() for times in seen)
    made = make_estimator(spec, LAB, DT, TrackerConfig(max_delay_s=0.5))
    assert not isinstance(made, OutOfSequence)
    kept = pickle.loads(cloudpickle.dumps(spec))
    assert kept.handles_late_frames


def test_an_estimator_is_called_by_its_name_itself_or_what_makes_it():
    for name, spec in ESTIMATORS.items():
        assert find_estimator(name) is spec
        assert find_estimator(spec) is spec
    made = find_estimator(Told)
    assert (made.name, made.make) == ("Told", Told)
    for name, said in (("smoother", "is an offline method"), ("partikel", "Unknown estimator")):
        with pytest.raises(ConfigError, match=said):
            find_estimator(name)


TIMES = [(True, DT), (True, 1e-3), (False, 0.0), (False, -DT), (False, np.nan)]


@pytest.mark.parametrize(("taken", "dt_s"), TIMES)
def test_a_clip_needs_a_time_between_its_frames(taken, dt_s):
    clip = [keypoints(np.full((1, 4, 15, 2), np.nan))]
    if taken:
        assert smooth(LAB, clip, dt_s).tracked.shape == (1, 1, 1)
        return
    with pytest.raises(
        ConfigError, match="a clip must have frames, and dt_s must be positive, got 1"
    ):
        smooth(LAB, clip, dt_s)


@pytest.mark.parametrize(
    ("taken", "horizon_s"),
    [(True, 1.0), (True, 1e-9), (False, np.nextafter(1.0, 2.0)), (False, 0.0), (False, np.nan)],
)
def test_a_horizon_ends_with_the_first_second(taken, horizon_s):
    if taken:
        assert forecast(believed(), horizon_s, TrackerConfig()).tracked.shape == (3, 2)
        return
    with pytest.raises(ConfigError, match="A horizon must be"):
        forecast(believed(), horizon_s, TrackerConfig())


ROOM = ((-3.0, 3.0), (-2.0, 2.0), (0.0, 2.2))


@pytest.mark.parametrize(
    ("kind", "name", "taken", "refused"),
    [
        (TriangulationConfig, "lost_after_s", 3.0, 3.0001),  # max_age_s is 3 s
        (ParticleConfig, "noise_bounds", (2.0, 2.0), (2.0, 1.999)),
        (ParticleConfig, "noise_bounds", (1e-9, 1e9), (0.0, 1e9)),
        (ParticleConfig, "noise_bounds", (1e-9, 1e9), (1.0, np.inf)),
        (ParticleConfig, "noise_bounds", (1.0, 1.0), (-1.0, 1.0)),
        (ParticleConfig, "noise_bounds", (1.0, 6.0), (np.nan, 6.0)),
        (PaperConfig, "n_particles", 10, 9),
        (PaperConfig, "initial_bounds_m", ((0.0, 0.5),) * 3, ROOM[:2]),
        (PaperConfig, "initial_bounds_m", (), ROOM[:1]),
        (PaperConfig, "initial_bounds_m", ROOM, (*ROOM[:2], (2.2, 2.2))),
        (PaperConfig, "initial_bounds_m", ROOM, ((3.0, -3.0), *ROOM[1:])),
        (PaperConfig, "initial_bounds_m", ROOM, (*ROOM[:2], (0.0, np.inf))),
        (PaperConfig, "initial_bounds_m", ROOM, tuple((0.0, *pair) for pair in ROOM)),
        (PaperConfig, "initial_bounds_m", ROOM, ROOM[0]),
    ],
)
def test_settings_end_where_they_say(kind, name, taken, refused):
    changes = {"max_age_s": 3.0} if name == "lost_after_s" else {}
    assert getattr(kind(**{name: taken}, **changes), name) == taken
    with pytest.raises(ConfigError, match=name):
        kind(**{name: refused}, **changes)
