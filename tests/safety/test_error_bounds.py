"""Calibrated bounds on the errors of estimated bodies: which apply, and what is refused."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from assets.error_bounds import calibrate as calibration
from assets.error_bounds.coverage import measure_coverage
from assets.error_bounds.episodes import Drive, Errors, collect_errors
from hrc_env.core.errors import ConfigError
from hrc_env.core.skeleton import JOINT
from hrc_env.geometry.enclosure import CAPSULE, CAPSULES
from hrc_env.safety import config as shield_config
from hrc_env.safety import error_bounds
from hrc_env.safety.built_in import limit_command
from hrc_env.safety.config import ShieldConfig
from hrc_env.safety.error_bounds import (
    NOT_CALIBRATED,
    find_support,
    load_error_bounds,
    read_error_bounds,
)
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.estimators import EstimatorSpec
from hrc_env.tracking.particle import ParticleEstimator

PACKAGED = Path(error_bounds.__file__).with_suffix(".json")
CONFORMAL, CONSTANT = (ShieldConfig("qp", margin=each) for each in ("conformal", "constant"))


@pytest.fixture(scope="module")
def belief():
    """What eight robots believe of their workers, whom four cameras see."""
    envs = gymnasium.make_vec("HRCReach-v0", 8, perception="keypoints", num_threads=1)
    envs.reset(seed=400)
    first = envs.unwrapped.shards.first
    for _ in range(60):
        envs.step(np.zeros(envs.action_space.shape, np.float32))
    return first.belief


def seen_as(belief, joint=None, **values):
    """The belief with other values of one joint, or of all joints."""
    changed = {name: getattr(belief.estimate, name).copy() for name in values}
    for name, value in values.items():
        changed[name][..., slice(None) if joint is None else JOINT[joint]] = value
    return replace(belief, estimate=replace(belief.estimate, **changed))


WELL = {"n_views": 4, "misfit": 1.0, "age_s": 0.0}


def support_of(belief, capsule):
    found = find_support(belief.estimate, load_error_bounds())
    s = CAPSULE[capsule]
    return found.factor[0, 0, s], found.age_class[0, 0, s]


@pytest.mark.parametrize(
    ("name", "value"), [("n_views", 1), ("misfit", 40.0), ("age_s", 0.12), ("age_s", 1.0)]
)
def test_the_worst_joint_of_a_capsule_counts(belief, name, value):
    well = seen_as(belief, **WELL)
    ill = seen_as(well, "left_wrist", **{name: value})
    changed = {
        each for each in CAPSULES if support_of(well, each) != support_of(ill, each)
    }  # fmt: skip
    assert {"left_hand", "left_forearm"} <= changed
    assert all(each.startswith("left_") for each in changed)
    factor, age_class = support_of(ill, "left_hand")
    assert factor >= support_of(well, "left_hand")[0]
    if name == "age_s":
        assert age_class == (NOT_CALIBRATED if value > 0.5 else 1)


@pytest.mark.parametrize(
    ("arguments", "is_calibrated"),
    [
        ({}, True),
        ({"estimator": "kalman"}, True),
        ({"estimator": "triangulation"}, False),
        ({"estimator": EstimatorSpec("mine", ParticleEstimator, ParticleConfig)}, False),
        ({"config": {"emulator": {"error_scale": 2.0}}}, False),
        ({"config": {"tracker": {"damping": 0.4}}}, False),
        ({"perception": "truth"}, True),
        ({"perception": "none"}, False),
    ],
)
def test_bounds_apply_to_the_default_estimator_and_settings_alone(arguments, is_calibrated):
    envs = gymnasium.make_vec("HRCReach-v0", 2, **{"perception": "keypoints", **arguments})
    envs.reset(seed=0)
    for _ in range(3):
        envs.step(np.zeros(envs.action_space.shape, np.float32))
    estimate = envs.unwrapped.simulation.belief.estimate
    assert (estimate.calibrated == is_calibrated).all()
    if not is_calibrated:
        found = find_support(estimate, load_error_bounds())
        assert (found.age_class == NOT_CALIBRATED).all()


def test_an_estimate_that_no_camera_supports_has_no_bound(belief):
    unknown = seen_as(seen_as(belief, **WELL), misfit=np.nan)
    assert (find_support(unknown.estimate, load_error_bounds()).age_class == NOT_CALIBRATED).all()


def clearance(belief, config):
    """The clearances of the robots that are near their workers."""
    command = np.zeros_like(belief.robot.q)
    found_m = limit_command(belief, command, 0.04, config).values["clearance_m"]
    near = belief.separation.distance_m[:, 0] < 0.1
    assert near.sum() >= 2
    return found_m[near]


def with_bounds(monkeypatch, **values):
    bounds = load_error_bounds()._replace(**values)
    monkeypatch.setattr(shield_config, "load_error_bounds", lambda: bounds)


def test_the_clearance_is_the_gap_less_the_bound(belief, monkeypatch):
    near, bounds = seen_as(belief, **WELL), load_error_bounds()
    everywhere = np.full_like(bounds.expected_m, np.inf)
    measured = []
    for bound_m in (0.02, 0.12):
        with_bounds(
            monkeypatch, expected_m=everywhere, bound_m=np.full_like(bounds.bound_m, bound_m)
        )
        measured.append(clearance(near, CONFORMAL))
    assert measured[0] - measured[1] == pytest.approx(0.1)
    wider = replace(CONFORMAL, margin_m=0.05, hand_margin_m=0.05)
    assert clearance(near, wider) == pytest.approx(measured[1] - 0.05)


def test_a_wide_bound_makes_distant_pairs_relevant(belief, monkeypatch):
    near, bounds, wide_m = seen_as(belief, **WELL), load_error_bounds(), 0.7
    with_bounds(
        monkeypatch, expected_m=np.full_like(bounds.expected_m, np.inf),
        bound_m=np.full_like(bounds.bound_m, wide_m),
    )  # fmt: skip
    apart_m = near.separation.distance_m[:, 0]
    distant = (apart_m > 0.35) & (apart_m < 0.65)
    assert distant.any()
    command = np.zeros_like(near.robot.q)
    found_m = limit_command(near, command, 0.04, CONFORMAL).values["clearance_m"]
    assert (found_m[distant] < apart_m[distant] - wide_m + 1e-9).all()


def test_a_lost_worker_has_no_bound(belief):
    lost = seen_as(seen_as(belief, **WELL), unobserved_s=0.3)
    np.testing.assert_array_equal(clearance(lost, CONFORMAL), clearance(lost, CONSTANT))


def test_where_nothing_is_calibrated_the_constants_hold(belief, monkeypatch):
    near, constant = seen_as(belief, **WELL), clearance(belief, CONSTANT)
    assert (clearance(near, CONFORMAL) != constant).all()
    np.testing.assert_array_equal(clearance(seen_as(near, misfit=np.nan), CONFORMAL), constant)
    old = seen_as(near, age_s=0.24)
    np.testing.assert_array_equal(clearance(old, CONFORMAL), clearance(old, CONSTANT))
    with_bounds(monkeypatch, expected_m=np.full_like(load_error_bounds().expected_m, -np.inf))
    np.testing.assert_array_equal(clearance(near, CONFORMAL), constant)


@pytest.fixture
def changed(tmp_path):
    """A function that writes the package's bounds with some changes, and returns the path."""

    def write(**changes):
        path = tmp_path / "error_bounds.json"
        path.write_text(json.dumps({**json.loads(PACKAGED.read_text()), **changes}))
        return path

    return write


def test_bounds_of_another_version_are_refused_with_the_command_that_renews_them(changed):
    versions = json.loads(PACKAGED.read_text())["versions"]
    path = changed(versions={**versions, "tracker": versions["tracker"] + 1})
    with pytest.raises(ConfigError, match=r"tracker \d+ \(now \d+\).*assets.error_bounds"):
        read_error_bounds(path)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"bound_m": [[[0.2, 0.1]]]}, "shape"),
        ({"max_age_s": [0.3, 0.2, 0.1]}, "must not decrease"),
        ({"view_factor": "wide"}, "must be calibrated error bounds"),
        ({"versions": {}}, "must be calibrated error bounds"),
    ],
)
def test_malformed_bounds_are_refused(changed, changes, words):
    with pytest.raises(ConfigError, match=words):
        read_error_bounds(changed(**changes))


def test_a_bound_that_falls_with_the_expected_error_is_refused(changed):
    bound_m = np.array(json.loads(PACKAGED.read_text())["bound_m"])
    bound_m[3, 0, -1] = -1.0
    with pytest.raises(ConfigError, match="bound_m must not decrease"):
        read_error_bounds(changed(bound_m=bound_m.tolist()))


def test_without_a_file_a_conformal_margin_is_refused_and_a_constant_one_works(
    tmp_path, monkeypatch
):
    copied = tmp_path / "error_bounds.py"
    shutil.copy(error_bounds.__file__, copied)
    monkeypatch.setattr(error_bounds, "__file__", str(copied))
    load_error_bounds.cache_clear()
    try:
        for shield in ("qp", "ssm", CONFORMAL, {"kind": "qp"}):
            with pytest.raises(ConfigError, match=r"missing.*margin='constant'"):
                gymnasium.make("HRCReach-v0", shield=shield)
        gymnasium.make("HRCReach-v0", shield=CONSTANT)
    finally:
        load_error_bounds.cache_clear()


def test_an_unknown_margin_is_refused():
    with pytest.raises(ConfigError, match="conformal"):
        ShieldConfig("qp", margin="conform")


# --- The calibration -----------------------------------------------------------------------------


def sample(n, std_of, seed=0, views=(4,), misfits=(1.0,)):
    """Errors that are normal with a standard deviation of `std_of`(views, misfit) times 2 cm."""
    rng = np.random.default_rng(seed)
    n_views, misfit = rng.choice(views, n), rng.choice(misfits, n)
    std_m = rng.uniform(0.01, 0.03, n)
    return Errors(
        error_m=rng.normal(size=n) * std_m * std_of(n_views, misfit), gap_m=np.full(n, 0.2),
        std_m=std_m, constant_m=np.full(n, 0.05), n_views=n_views, misfit=misfit,
        age_s=np.zeros(n), episode=np.arange(n) % 500,
    )  # fmt: skip


def test_factors_are_the_ratios_of_the_tails():
    def std_of(n_views, misfit):
        return np.where(n_views < 2, 1.8, 1.0) * np.where(misfit > 9.0, 1.5, 1.0)

    parts = [sample(200_000, std_of, seed, (1, 2, 4), (1.0, 6.0, 12.0, 30.0)) for seed in (0, 1)]
    factors = calibration.fit_factors(parts)
    np.testing.assert_allclose(factors.view, [1.8, 1.0, 1.0], rtol=0.05)
    np.testing.assert_allclose(factors.misfit, [1.0, 1.0, 1.5, 1.5], rtol=0.05)


def test_the_quantile_counts_the_error_to_come():
    """The ceil((n + 1) level)-th smallest, and the largest of few."""
    errors = np.random.default_rng(0).permutation(np.arange(1, 2001.0))
    assert calibration.find_quantile(errors) == 1999.0
    assert calibration.find_quantile(errors[:100]) == errors[:100].max()


def test_bounds_cover_as_many_of_other_errors_as_was_asked():
    def std_of(n_views, misfit):
        return np.where(n_views < 2, 2.5, 1.0) * np.where(misfit > 9.0, 2.0, 1.0)

    choices = (1, 2, 4), (1.0, 6.0, 12.0, 30.0)
    errors = [sample(100_000, std_of, s, *choices) for s in range(len(CAPSULES))]
    bounds = calibration.calibrate(errors)
    fresh = [sample(100_000, std_of, 100 + s, *choices) for s in range(len(CAPSULES))]
    for part, row in measure_coverage(fresh, bounds).items():
        assert row["with_bound"] > 0.99, part
        assert row["bound.covered"] == pytest.approx(calibration.LEVEL, abs=5e-4), part
        assert row["bound.low"] < calibration.LEVEL < row["bound.high"] + 5e-4
        assert row["constant.covered"] < 0.95, "the constant margin is too small for them"


def test_a_part_with_errors_of_few_episodes_has_no_bound():
    errors = [sample(20_000, lambda *_: 1.0, s) for s in range(len(CAPSULES))]
    head = CAPSULE["head"]
    few = errors[head].episode % (calibration.MIN_EPISODES - 1)
    errors[head] = errors[head]._replace(episode=few)
    bounds = calibration.calibrate(errors)
    assert np.isneginf(bounds.expected_m[head]).all()
    assert np.isfinite(bounds.expected_m[CAPSULE["chest"], 0]).all()
    assert np.isneginf(bounds.expected_m[:, 1:]).all(), "no error is older"


@pytest.mark.slow
def test_in_other_episodes_the_packages_bounds_cover_what_they_say():
    errors = collect_errors(Drive("shielded", shield=CONSTANT), seed=15_000_000, n_episodes=192)
    for part, row in measure_coverage(errors, load_error_bounds()).items():
        if row["bound.episodes"] >= 100:
            assert row["bound.covered"] > 0.995, part
            assert row["with_bound"] > 0.95, part
    assert {"hand", "forearm", "head", "chest"} <= set(
        measure_coverage(errors, load_error_bounds())
    )
