"""A calibration file says what is wrong with it, and how to get another one."""

import dataclasses
import json

import numpy as np
import pytest

from assets.emulator.writing import write_calibration
from hrc_env.core.errors import ConfigError
from hrc_env.perception.calibration import (
    PACKAGED,
    SHAPES,
    VERSION,
    read_calibration,
)
from hrc_env.settings import resolve_settings


def changed(tmp_path, **changes):
    """A copy of the package's file with other entries."""
    content = json.loads(PACKAGED.read_text()) | changes
    path = tmp_path / "other.json"
    path.write_text(json.dumps(content))
    return path


def test_what_is_written_is_read_again(tmp_path):
    known = read_calibration()
    write_calibration(tmp_path / "copy.json", known, {"seed": 3})
    again = read_calibration(tmp_path / "copy.json")
    for each in dataclasses.fields(known):
        np.testing.assert_allclose(
            getattr(again, each.name), getattr(known, each.name), rtol=1e-3, atol=1e-12
        )


def test_the_packaged_file_is_small_and_says_where_it_comes_from():
    assert PACKAGED.stat().st_size < 40_000
    made = json.loads(PACKAGED.read_text())["made"]
    assert "calibrate-keypoints" in made["command"]
    assert {"seed", "git", "clips"} <= set(made)


def test_shares_of_errors_add_up_to_one():
    np.testing.assert_allclose(read_calibration().shares.sum(1), 1.0, atol=2e-3)


def test_a_file_of_another_version_is_refused_with_the_command_that_makes_a_new_one(tmp_path):
    path = changed(tmp_path, version=VERSION + 1)
    with pytest.raises(ConfigError, match=f"version {VERSION + 1}.*emulator.calibrate --out"):
        resolve_settings(config={"emulator": {"calibration": str(path)}})


@pytest.mark.parametrize("text", ["", "{", "[]", "\x00", '{"format": "something else"}'])
def test_a_broken_file_is_refused(tmp_path, text):
    path = tmp_path / "broken.json"
    path.write_text(text)
    with pytest.raises(ConfigError, match="is not a calibration of keypoints"):
        read_calibration(path)


def test_a_file_that_is_not_there_is_refused():
    with pytest.raises(ConfigError, match="cannot be read"):
        resolve_settings(config={"emulator": {"calibration": "nowhere.json"}})


def test_a_missing_table_is_named(tmp_path):
    tables = json.loads(PACKAGED.read_text())["tables"]
    del tables["bias"]
    with pytest.raises(ConfigError, match="missing: bias"):
        read_calibration(changed(tmp_path, tables=tables))


@pytest.mark.parametrize(
    ("name", "value"),
    [("size", -1.0), ("common", 2.0), ("limb", 1.5), ("bias", "none"), ("sigma", float("nan"))],
)
def test_impossible_numbers_are_named(tmp_path, name, value):
    tables = json.loads(PACKAGED.read_text())["tables"]
    tables[name] = np.full(SHAPES[name], value).tolist()
    with pytest.raises(ConfigError, match=f"table '{name}' must hold"):
        read_calibration(changed(tmp_path, tables=tables))
