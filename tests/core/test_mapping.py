"""Settings from mappings: errors call fields as the user wrote them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from hrc_env.core.errors import ConfigError
from hrc_env.core.mapping import convert_to_plain, from_mapping
from hrc_env.settings import resolve_settings

EYE = [2.0, 2.0, 2.0]


def camera(**other):
    return {"scene": {"cameras": [{"name": "a", "eye_world": EYE, **other}]}}


@pytest.mark.parametrize(
    ("config", "said"),
    [
        ({"task": {"radius_m": -1}}, r"^task\.radius_m must be positive, got -1\.0\.$"),
        ({"task": {"height_m": [2, 1]}}, r"^task\.height_m must be \(low, high\)"),
        ({"control": {"joint_speed_share": 2}}, r"^control\.joint_speed_share must"),
        ({"cost": {"proximity_m": -1}}, r"^cost\.proximity_m must not be negative"),
        ({"reward": {"proximity_reach_m": 0}}, r"^reward\.proximity_reach_m must"),
        ({"scene": {"sim_dt": 0}}, r"^scene\.sim_dt must be positive"),
        ({"tracker": {"n_hypotheses": 0}}, r"^tracker\.n_hypotheses must be positive"),
        (
            {"tracker": {"lost_after_s": 9}},
            r"^tracker\.lost_after_s \(9\.0\) must not exceed tracker\.max_age_s",
        ),
        ({"tracker": {"mirrored_parts": ["x"]}}, r"Unknown part in tracker\.mirrored_parts 'x'"),
        ({"detector": {"runtime": "x"}}, r"^Unknown detector\.runtime 'x'"),
        ({"detector": {"search_every": 0}}, r"^detector\.search_every must be positive"),
        ({"motion": {"spacing_m": 0.1}}, r"^motion\.spacing_m must be 0\.8 or more"),
        ({"motion": {"people": {"tempo": -1}}}, r"^motion\.people\.tempo must be"),
        ({"appearance": {"light": [3, 1]}}, r"^appearance\.light must be two factors"),
        (camera(width_px=3), r"^Camera 'a': scene\.cameras\[0\]\.width_px must be from 64"),
        (camera(hfov_deg=500), r"^scene\.cameras\[0\]: Camera 'a': horizontal field"),
        (camera(lens={"model": "x"}), r"^scene\.cameras\[0\]\.lens: Unknown lens model 'x'"),
        (camera(name=3), r"scene\.cameras\[0\]\.name must be a str, got 3"),
        ({"faults": [{"kind": "x", "cameras": ["a"]}]}, r"^faults\[0\]: Unknown fault 'x'"),
    ],
)
def test_a_nested_value_that_cannot_work_is_called_by_its_path(config, said):
    with pytest.raises(ConfigError, match=said):
        resolve_settings(config=config)


@pytest.mark.parametrize(
    ("refused", "said"),
    [
        ({"people": {"tempo": -1}}, r"^people\.tempo must be 0 or more"),
        ({"appearance": {"litter": 999}}, r"^appearance\.litter must be from"),
        ({"cameras": [{"name": "a", "eye_world": EYE, "rate_hz": -1}]},
         r"^Camera 'a': cameras\[0\]\.rate_hz must"),
        ({"faults": [{"kind": "late", "cameras": [0], "amount": 9}]},
         r"^faults\[0\]: Fault 'late': amount must"),
    ],
)  # fmt: skip
def test_so_is_one_of_a_keyword_argument(refused, said):
    with pytest.raises(ConfigError, match=said):
        resolve_settings(**refused)


@dataclass(frozen=True)
class Odd:
    """A setting whose sentence has names of fields in quotes and paths."""

    size_px: int = 1
    own: int = 1

    def __post_init__(self) -> None:
        raise ConfigError("own size_px is 'size_px' of other.size_px, not own.")


def test_only_the_fields_themselves_are_called_by_their_path():
    said = r"^a\.own a\.size_px is 'size_px' of other\.size_px, not own\.$"
    with pytest.raises(ConfigError, match=said):
        from_mapping(Odd, {}, "a.")


def test_numbers_of_numpy_are_numbers():
    config = resolve_settings(
        config={"task": {"radius_m": np.float32(0.25)}, "tracker": {"n_hypotheses": 2}}
    ).config
    assert config.task.radius_m == 0.25
    assert type(config.task.radius_m) is float


def test_plain_values_are_what_json_has():
    value = {"a": (np.int64(1), [Path("b.toml")]), "mode": AutoresetMode.SAME_STEP}
    assert convert_to_plain(value) == {"a": (1, ["b.toml"]), "mode": AutoresetMode.SAME_STEP.value}
    assert convert_to_plain(np.eye(2)) == [[1.0, 0.0], [0.0, 1.0]]
    assert convert_to_plain(len) is len
