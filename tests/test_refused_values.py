"""Values that an environment is given or works out and are wrong in one entry only are refused."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hrc_env.control import check_action, n_actions
from hrc_env.core.errors import ConfigError
from hrc_env.env import HRCEnv
from hrc_env.observations import ObservationLayout, ObservationTerm, observe
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.pipeline import levels
from hrc_env.pipeline.levels import LEVELS, make_pipeline
from hrc_env.pipeline.sensor_input import SensorInput, TrueSensorInput, require_truth
from hrc_env.rewards import check_kind, sum_terms
from hrc_env.safety.config import ShieldConfig
from hrc_env.safety.contact import contact_force, effective_mass, find_region
from hrc_env.safety.cost import COMPONENTS, CostConfig
from hrc_env.safety.separation import protective_distance
from hrc_env.safety.shield import SHIELDS, apply_shield, find_shield
from hrc_env.scene.build import build
from hrc_env.scene.domain_randomization import AppearanceConfig
from hrc_env.scene.robot import ROBOTS, make_chain
from hrc_env.settings import resolve_settings

ARM, BASE = (make_chain(ROBOTS[name], (0.0, 0.0, 0.0)) for name in ("ur10e_like", "mobile_base"))


@pytest.mark.parametrize(
    ("action", "said"),
    [
        (np.zeros((2, 2)), r"action must have shape \(2, 3\)"),
        (np.zeros(3), r"action must have shape \(2, 3\)"),
        ([[0.0, 0.0, 0.0], [0.0, 0.0, np.nan]], "must be finite numbers"),
        ([[-np.inf, 0.0, 0.0], [0.0, 0.0, 0.0]], "must be finite numbers"),
        ("left", "must be numbers of shape"),
        ([[0.0, 0.0, 0.0], [0.0, 0.0]], "must be numbers of shape"),
        ([[0.0, 0.0, 0.0], [0.0, 0.0, None]], "must be"),
        ({}, "must be numbers of shape"),
    ],
)
def test_an_action_in_which_one_entry_is_wrong_is_refused(action, said):
    with pytest.raises(ConfigError, match=said):
        check_action(action, (2, 3), "tool")


def test_an_action_beyond_one_is_taken_as_one():
    taken = check_action([[2, -3.0, 0.5], [1.0, -1.0, 0.0]], (2, 3), "tool")
    assert taken.tolist() == [[1.0, -1.0, 0.5], [1.0, -1.0, 0.0]]


@pytest.mark.parametrize(
    ("control", "chain", "n"),
    [("joint", ARM, 6), ("tool", ARM, 3), ("twist", ARM, 6), ("joint", BASE, 3)],
)
def test_an_arm_is_moved_by_joints_or_tool_and_a_base_by_joints(control, chain, n):
    assert n_actions(control, chain) == n
    assert n_actions(control, chain, grips=True) == n + 1


@pytest.mark.parametrize(
    ("control", "chain", "said"),
    [
        ("tool", BASE, 'valid is control="joint"'),
        ("twist", BASE, 'valid is control="joint"'),
        ("twist", replace(ARM, slides=np.arange(6) == 5), 'valid is control="joint"'),
        ("torque", ARM, "Unknown control"),
    ],
)
def test_a_control_that_a_robot_has_not_is_refused(control, chain, said):
    with pytest.raises(ConfigError, match=said):
        n_actions(control, chain)


@pytest.mark.parametrize(("environment", "wrong"), [(0, np.nan), (1, np.inf), (1, -np.inf)])
def test_one_reward_of_one_environment_that_is_none_is_told(environment, wrong):
    """Even where another term makes up for it."""
    terms = {"one": np.ones(2), "two": np.ones(2), "three": np.full(2, np.float64(0.5))}
    assert sum_terms(terms, 2).tolist() == [2.5, 2.5]
    assert sum_terms({}, 2).tolist() == [0.0, 0.0]
    terms["two"][environment] = wrong
    with pytest.raises(FloatingPointError, match=r"not finite: two\.$"):
        sum_terms(terms, 2)


@pytest.mark.parametrize("value", [np.zeros(3), np.zeros((2, 1)), 0.0])
def test_a_reward_of_another_shape_is_refused(value):
    with pytest.raises(ConfigError, match="reward term 'two' must have shape"):
        sum_terms({"one": np.zeros(2), "two": value}, 2)


def test_rewards_are_of_two_kinds():
    for kind in ("dense", "sparse"):
        check_kind(SimpleNamespace(reward=kind))
    for kind in ("each", ""):
        with pytest.raises(ConfigError, match='must be "dense" or "sparse"'):
            check_kind(SimpleNamespace(reward=kind))


def seen(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the observation of two terms, of 1 and 2 entries, beside one that has none."""
    terms = tuple(
        ObservationTerm(name, lambda of: 0, "m", "world", 1.0, 1.0, "", lambda now, part=part: part)
        for name, part in (("first", first), ("absent", np.zeros((2, 9))), ("second", second))
    )
    slices = {"first": slice(0, 1), "absent": slice(1, 1), "second": slice(1, 3)}
    bound = np.ones(3, np.float32)
    where = ObservationLayout((0, 2), slices, -bound, bound, np.ones(3))
    return observe(SimpleNamespace(action=np.zeros((2, 6))), where, terms)


def test_an_observation_is_its_terms():
    assert seen(np.full((2, 1), 0.5), np.full((2, 2), 3.0)).tolist() == [[0.5, 1.0, 1.0]] * 2
    assert seen(np.full((2, 1), -np.inf), np.zeros((2, 2))).tolist() == [[-1.0, 0.0, 0.0]] * 2


@pytest.mark.parametrize(
    ("name", "n_first", "n_second"),
    [("first", 2, 2), ("first", 0, 2), ("second", 1, 1), ("second", 1, 3)],
)
def test_a_term_with_other_entries_than_it_says_is_told(name, n_first, n_second):
    with pytest.raises(ConfigError, match=f"observation term '{name}' must have shape"):
        seen(np.zeros((2, n_first)), np.zeros((2, n_second)))


@pytest.mark.parametrize(
    ("at", "said"), [((0, 0), "first"), ((1, 1), "second"), ((0, 2), "second"), ((1, 0), "first")]
)
def test_one_entry_that_is_no_number_is_told_with_its_term(at, said):
    physical = np.zeros((2, 3))
    physical[at] = np.nan
    with pytest.raises(FloatingPointError, match=rf"not finite numbers: {said}\.$"):
        seen(physical[:, :1], physical[:, 1:])


@pytest.mark.parametrize("taken", [COMPONENTS, COMPONENTS[:1], COMPONENTS[1:3]])
def test_cost_is_of_one_or_more_components(taken):
    assert CostConfig(components=taken).components == taken


@pytest.mark.parametrize(
    "refused", [(), ("contact", "contact"), ("contact", "force", "contact"), ("contact", "touch")]
)
def test_cost_is_of_different_components_that_there_are(refused):
    with pytest.raises(ConfigError, match="cost"):
        CostConfig(components=refused)


SCENE = build()
IMAGE = FaultConfig("noise", ("all",))
TIMING = FaultConfig("late", ("all",))


@pytest.mark.parametrize(
    ("level", "changes"),
    [("truth", {}), ("none", {}), ("keypoints", {}), ("keypoints", {"faults": (TIMING,)})],
)
def test_a_level_is_taken_with_what_it_knows(level, changes):
    make_pipeline(level, "particle", SCENE, 1, replace(resolve_settings().config, **changes))


@pytest.mark.parametrize(
    "changes",
    [{"appearance": AppearanceConfig(hat=0.5)}, {"faults": (IMAGE,)}, {"faults": (TIMING, IMAGE)}],
)
def test_images_may_look_different_and_have_faults(monkeypatch, changes):
    """Drawing them is another matter, which is left out here."""

    class Made:
        def __init__(self, *given):
            pass

    monkeypatch.setattr(levels, "PixelPipeline", Made)
    config = replace(resolve_settings().config, **changes)
    assert isinstance(make_pipeline("pixels", "particle", SCENE, 1, config), Made)


@pytest.mark.parametrize(
    ("level", "changes", "said"),
    [
        *((level, {"appearance": AppearanceConfig(hat=0.5)}, "Appearances need images")
          for level in LEVELS[1:]),
        *((level, {"faults": (TIMING,)}, "Faults need cameras") for level in LEVELS[2:]),
        *((level, {"faults": (IMAGE,)}, "Faults need cameras") for level in LEVELS[2:]),
        ("keypoints", {"faults": (TIMING, IMAGE)}, r"Faults of images \(noise\) need images"),
        ("keypoints", {"faults": (FaultConfig("late", ("c",)),)}, "Unknown camera of fault"),
        ("pixel", {}, "Unknown perception 'pixel'"),
    ],
)  # fmt: skip
def test_a_level_is_refused_with_what_it_does_not_know(level, changes, said):
    with pytest.raises(ConfigError, match=said):
        make_pipeline(level, "particle", SCENE, 1, replace(resolve_settings().config, **changes))


def test_truth_is_known_to_whom_it_is_told():
    told, untold = (kind(*[None] * n) for kind, n in ((TrueSensorInput, 5), (SensorInput, 3)))
    assert require_truth(told) is told
    with pytest.raises(ConfigError, match="needs a TrueSensorInput, got a SensorInput"):
        require_truth(untold)


def test_a_state_of_one_other_setting_is_refused():
    """Whichever it is: each is compared."""
    env = HRCEnv(perception="none", n_workers=0)
    simulation = env.simulation
    state = simulation.get_state()
    simulation.set_state(state)
    for name in simulation.settings:
        other = {**state, "settings": {**state["settings"], name: "other"}}
        with pytest.raises(ConfigError, match=f"taken with {name}='other'"):
            simulation.set_state(other)


SPEEDS = {"human_m_s": 1.6, "robot_m_s": 0.5}


@pytest.mark.parametrize(
    "name",
    ["reaction_s", "stopping_s", "intrusion_m", "human_uncertainty_m", "robot_uncertainty_m"],
)
def test_distances_are_of_what_is_not_negative(name):
    given = {"reaction_s": 0.1, "stopping_s": 0.3, **SPEEDS}
    assert np.isfinite(protective_distance(**{**given, name: [0.0, 0.1]})).all()
    for wrong in (-1e-9, np.nan, [0.1, -1e-9]):
        with pytest.raises(ConfigError, match=f"{name} must be a number that is not negative"):
            protective_distance(**{**given, name: wrong})


def test_masses_are_positive_and_loads_not_negative():
    assert effective_mass([1e-9, 4.0], 0.0).tolist() == [0.5e-9, 2.0]
    assert contact_force("chest", 1.0, [1e-9, 1.0]).shape == (2,)
    for moving, load in ((0.0, 0.0), ([1.0, 0.0], 1.0), (1.0, -1e-9), (1.0, [0.0, -1.0]),
                         (np.nan, 0.0), (1.0, np.nan)):  # fmt: skip
        with pytest.raises(ConfigError, match="moving_kg must be positive and load_kg not be neg"):
            effective_mass(moving, load)
    for mass in (0.0, -1.0, np.nan, [1.0, 0.0]):
        with pytest.raises(ConfigError, match="robot_kg must be a positive mass"):
            contact_force("chest", 1.0, mass)
    with pytest.raises(ConfigError, match="Unknown region of the body"):
        find_region("tail")


def test_a_shield_is_called_by_name_settings_function_or_not_at_all():
    for name, shield in SHIELDS.items():
        assert find_shield(name) is shield
    assert find_shield(print) is print
    assert find_shield(None) is None
    for settings in (ShieldConfig("ssm"), {"kind": "ssm"}):
        assert find_shield(settings).keywords["config"] == ShieldConfig("ssm")
    for wrong, said in ((3, "must be a name"), ("ssn", "Unknown shield"), ((), "must be a name")):
        with pytest.raises(ConfigError, match=said):
            find_shield(wrong)


@pytest.mark.parametrize(
    ("allowed", "said", "expected"),
    [
        (np.zeros((2, 5)), {}, r"velocities must have shape \(2, 6\)"),
        (np.where(np.arange(12).reshape(2, 6) == 11, np.nan, 0.0), {}, "velocities must be finite"),
        (np.where(np.arange(12).reshape(2, 6) == 0, np.inf, 0.0), {}, "velocities must be finite"),
        (
            np.zeros((2, 6)),
            {"near": np.zeros(2), "far": np.zeros(3)},
            "'far' of a shield must have shape",
        ),
    ],
)
def test_a_shield_in_which_one_thing_is_wrong_is_refused(allowed, said, expected):
    with pytest.raises(ConfigError, match=expected):
        apply_shield(lambda *given: (allowed, said), None, np.zeros((2, 6)), 0.04)


def test_a_shield_is_asked_about_a_copy_of_the_command_and_the_step():
    command = np.ones((2, 6))

    def halved(now: object, asked: np.ndarray, dt_s: float) -> tuple[np.ndarray, dict]:
        asked *= 0.5
        return asked, {"step_s": np.full(2, dt_s)}

    allowed, said = apply_shield(halved, SimpleNamespace(model=None), command, 0.04)
    assert (allowed == 0.5).all()
    assert (command == 1.0).all()
    assert said["shield/step_s"].tolist() == [0.04, 0.04]
    assert said["shield/scale"].tolist() == [0.5, 0.5]


@pytest.mark.parametrize("name", ["margin_m", "retreat_gain_hz", "deceleration_m_s2", "creep_m_s"])
def test_settings_of_shields_are_finite(name):
    for wrong in (np.nan, np.inf):
        with pytest.raises(ConfigError, match=f"{name} must be a finite number"):
            ShieldConfig("qp", **{name: wrong})
