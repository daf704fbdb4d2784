"""What is wrong with a function of a user's own is said when it is registered, or at make."""

import dataclasses
from typing import Any

import gymnasium
import numpy as np
import pytest

import hrc_env
from hrc_env import ConfigError, EstimatorSpec, Goal, HRCEnv, ObservationTerm, RewardTerm
from hrc_env.core.errors import HRCError
from hrc_env.core.registry import FILES
from hrc_env.registration import import_files
from hrc_env.safety.shield import SHIELDS
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.estimators import ESTIMATORS
from hrc_env.tracking.particle import ParticleEstimator
from tests.registrations import registrations_restored
from tests.tasks.variants import vary

REACH = hrc_env.find_task("HRCReach-v0")


class Own:
    """An estimator that is as it should be."""

    def __init__(self, P: Any, ctrl_dt: float, config: ParticleConfig) -> None:
        self.inner, self.config = ParticleEstimator(P, ctrl_dt, config), config

    def init(self, batch, n_workers):
        return self.inner.init(batch, n_workers)

    def reset(self, state, ids, rngs):
        self.inner.reset(state, ids, rngs)

    def predict(self, state, dt_s, rngs):
        self.inner.predict(state, dt_s, rngs)

    def update(self, state, keypoints, rngs):
        self.inner.update(state, keypoints, rngs)

    def estimate(self, state):
        return self.inner.estimate(state)

    def forecast(self, state, horizon_s):
        return self.inner.forecast(state, horizon_s)


def estimator(name: str, hook: Any) -> EstimatorSpec:
    return EstimatorSpec("own_bad", type("Bad", (Own,), {name: hook}), ParticleConfig)


def without_ages(self, state):
    return dataclasses.replace(self.inner.estimate(state), age_s=np.zeros(3))


ESTIMATOR_FAULTS: dict[str, tuple[EstimatorSpec, str]] = {
    "init": (estimator("init", lambda self, batch: 0), "(batch, n_workers)"),
    "reset": (estimator("reset", lambda self, state: 0), "(state, ids, rngs)"),
    "predict": (estimator("predict", lambda self, state, dt_s: 0), "(state, dt_s, rngs)"),
    "update": (estimator("update", lambda self, state, k: 0), "(state, keypoints, rngs)"),
    "estimate": (estimator("estimate", lambda self: 0), "(state)"),
    "forecast": (estimator("forecast", lambda self, state: 0), "(state, horizon_s)"),
    "no estimate": (estimator("estimate", lambda self, state: None), "a PoseEstimate, got None"),
    "no forecast": (estimator("forecast", lambda self, s, h: None), "a PoseEstimate, got None"),
    "shape": (estimator("estimate", without_ages), "estimate.age_s must have shape"),
    "rows": (
        estimator("init", lambda self, b, w: np.zeros((w + 5, b))),
        "must have leading axes (B, W)",
    ),
}


@pytest.mark.parametrize("name", ESTIMATOR_FAULTS)
def test_an_estimator_is_refused_when_it_is_registered_and_at_make(name: str) -> None:
    spec, words = ESTIMATOR_FAULTS[name]
    for do in (
        lambda: hrc_env.register_estimator(spec),
        lambda: HRCEnv(perception="keypoints", estimator=spec),
        lambda: hrc_env.HRCVectorEnv(3, estimator=spec),
    ):
        with pytest.raises(ConfigError) as error:
            do()
        assert words in str(error.value)
    assert "own_bad" not in ESTIMATORS


def test_an_estimator_that_is_as_it_should_be_is_taken() -> None:
    env = HRCEnv(perception="keypoints", estimator=EstimatorSpec("own", Own, ParticleConfig))
    env.reset(seed=0)


def rewarding(function: Any) -> dict[str, Any]:
    return {"rewards": (*REACH.rewards, RewardTerm("mine", "Mine.", function))}


def seeing(size: int, function: Any) -> dict[str, Any]:
    term = ObservationTerm("mine", size, "m", "world", 1.0, 1.0, "Mine.", function)
    return {"observations": (*REACH.observations, term)}


TASK_FAULTS: dict[str, tuple[dict[str, Any], str]] = {
    "arguments": ({"is_terminal": lambda self, step, more: False}, "(self, step)"),
    "end, shape": ({"is_terminal": lambda self, step: np.zeros(7, bool)}, "must have shape (2,)"),
    "end, none": ({"is_terminal": lambda self, step: None}, "True or False for all"),
    "reward, shape": (rewarding(lambda *_: np.zeros(7)), "'mine' must have shape (2,)"),
    "seen, shape": (seeing(2, lambda now: np.zeros((2, 3))), "'mine' must have shape (2,)"),
    "markers": ({"markers": lambda self, view: np.zeros((2, 5))}, "points (B, M, 3)"),
    "start": ({"draw_start": lambda self, r, p, h, s: np.full((len(r), 6), np.nan)}, "finite"),
    "scene": ({"make_scene": lambda self: "<body/>"}, "must be a TaskScene"),
    "places": ({"reach_targets": lambda self: [(0.4, 0.3, 1.0)]}, "must be a ReachTarget"),
    "loads": ({"is_load": lambda self, state: np.zeros(9, bool)}, "must have shape (2, 0)"),
    "signal": ({"signal": lambda self, state: "go"}, "must be a WorkerSignal or None"),
    "effects": ({"effects": lambda self, state: "go"}, "must be an Effects or None"),
    "contact": ({"allowed_contact": lambda self, now: np.ones((9, 9))}, "capsules of a body"),
    "info": ({"info": lambda self, state: None}, "must be a Mapping"),
    "defaults": ({"defaults": [1]}, "must be a Mapping"),
    "limit": ({"max_episode_steps": "many"}, "must be a whole number"),
    "view": ({"viewpoint": "besides"}, "Did you mean 'beside'"),
}


@pytest.mark.parametrize("name", TASK_FAULTS)
def test_a_task_is_refused_when_it_is_registered_and_at_make(name: str) -> None:
    changes, words = TASK_FAULTS[name]
    task = vary(REACH, id="OwnBad-v0", **changes)
    for do in (
        lambda: hrc_env.register_task(task),
        lambda: HRCEnv(task, perception="none"),
        lambda: hrc_env.HRCVectorEnv(3, task=task, perception="none"),
    ):
        with pytest.raises(ConfigError) as error:
            do()
        assert words in str(error.value)
    assert "OwnBad-v0" not in hrc_env.IDS


def test_places_of_a_goal_are_checked_before_the_episode() -> None:
    env = HRCEnv(vary(REACH, goal_targets=lambda self, goal: [goal]), perception="none")
    with pytest.raises(ConfigError, match=r"goal_targets\[0\] must be a ReachTarget"):
        env.reset(seed=0, options={"goal": (0.5, 0.3, 1.1)})


def test_functions_of_terms_and_goals_are_checked_when_they_are_made() -> None:
    with pytest.raises(ConfigError, match=r"'mine' must be a function of \(belief\)"):
        seeing(1, lambda: 0)
    with pytest.raises(ConfigError, match=r"'mine' must be a function of \(belief, step"):
        rewarding(lambda belief: 0)
    with pytest.raises(ConfigError, match=r"Goal.reward must be a function of \(achieved"):
        Goal(3, 1.0, lambda now: 0, lambda now: 0, lambda achieved: 0, "Mine.")


SHIELD_FAULTS = {
    "nothing": (lambda belief, velocities, dt_s: None, "must return a pair"),
    "shape": (lambda belief, velocities, dt_s: (velocities[:, :2], {}), "velocities must have"),
    "values": (
        lambda belief, velocities, dt_s: (velocities, {"a": np.zeros(7)}),
        "'a' of a shield",
    ),
}


@pytest.mark.parametrize("name", SHIELD_FAULTS)
def test_a_shield_is_refused_at_make(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    shield, words = SHIELD_FAULTS[name]
    monkeypatch.setitem(SHIELDS.data, "own_bad", shield)
    for given in (shield, "own_bad"):
        with pytest.raises(ConfigError) as error:
            HRCEnv(perception="truth", shield=given)
        assert words in str(error.value)


def test_a_shield_of_other_arguments_is_refused_when_it_is_registered() -> None:
    with pytest.raises(ConfigError, match=r"own_bad must be a function of \(belief, velocities"):
        hrc_env.register_shield("own_bad", lambda belief, velocities: (velocities, {}))
    assert "own_bad" not in SHIELDS


def test_a_detector_that_wants_arguments_is_refused_when_it_is_registered() -> None:
    with pytest.raises(ConfigError, match=r"own_bad: make must be a function of \(\)"):
        hrc_env.register_detector("own_bad", lambda crop: crop)


class ActsOnNothing:
    def act(self):
        return np.zeros(6)


@pytest.mark.parametrize(("make", "words"), [
    (lambda: None, "must be a function of (env_info)"),
    (lambda info: None, "must have act(observation)"),
    (lambda info: ActsOnNothing(), "act must be a function of (observation)"),
])  # fmt: skip
def test_an_agent_is_refused_before_it_acts(make: Any, words: str) -> None:
    with pytest.raises(HRCError) as error:
        hrc_env.evaluate(make, 1, perception="none")
    assert words in str(error.value)


def test_registrations_end_with_the_test_that_made_them(tmp_path):
    """Two tests of one process may use the same name; the files of examples are modules, too."""
    path = tmp_path / "own_shield.py"
    path.write_text(
        "import hrc_env\n"
        "class Short(hrc_env.find_task('HRCReach-v0')):\n"
        "    id = 'HRCShort-v0'\n"
        "hrc_env.register_task(Short)\n"
        "hrc_env.register_shield('own', lambda belief, velocities, dt_s: (velocities, {}))\n"
    )
    for _ in range(2):
        with registrations_restored():
            import_files(str(path))
            assert "own" in SHIELDS
            assert "HRCShort-v0" in hrc_env.IDS
            assert "HRCShort-v0" in gymnasium.registry
        assert "own" not in SHIELDS
        assert "HRCShort-v0" not in hrc_env.IDS
        assert "HRCShort-v0" not in gymnasium.registry
        assert str(path) not in FILES
