"""Versions of behaviour: a finished part is used again at the same settings and versions only."""

import hashlib
from pathlib import Path

import pytest

from hrc_env.core import versions
from hrc_env.core.errors import ConfigError
from hrc_env.core.versions import SUBSYSTEMS, read_versions
from hrc_env.experiments.versions import check_subsystems, hash_source, make_key, select_versions
from hrc_env.tracking.estimators import find_estimator


@pytest.fixture
def behaviour(tmp_path, monkeypatch):
    """A function that writes `behaviour.toml` with some versions other than 1."""
    path = tmp_path / "behaviour.toml"

    def write(**other: object) -> Path:
        lines = {**dict.fromkeys(SUBSYSTEMS, 1), **other}
        path.write_text("".join(f"{name} = {value}\n" for name, value in lines.items()))
        return path

    monkeypatch.setattr(versions, "find_behaviour", lambda: path)
    return write


def test_settings_and_versions_of_the_named_subsystems_are_in_a_key(behaviour):
    behaviour()
    before = make_key({"n": 1}, ("env", "tracker"))
    assert make_key({"n": 1}, ("tracker", "env")) == before
    assert make_key({"n": 2}, ("env", "tracker")) != before
    assert make_key({"n": 1}, ("env",)) != before
    behaviour(shield=2)
    assert make_key({"n": 1}, ("env", "tracker")) == before
    behaviour(tracker=2)
    assert make_key({"n": 1}, ("env", "tracker")) != before


def test_the_file_of_this_repository_names_every_subsystem():
    assert tuple(read_versions()) == SUBSYSTEMS
    assert select_versions(("shield", "env")).keys() == {"env", "shield"}


@pytest.mark.parametrize(
    ("other", "words"),
    [
        ({"tracker": -1}, "give tracker a whole number from 1 on, got -1"),
        ({"tracker": 0}, "got 0"),
        ({"env": 1.5}, r"give env a whole number from 1 on, got 1\.5"),
        ({"env": "true"}, "got True"),
        ({"traker": 1}, "Unknown subsystem in behaviour.toml 'traker'. Did you mean 'tracker'"),
        ({"env": "one"}, "must be lines such as `env = 1`"),
    ],
)
def test_a_file_with_wrong_versions_is_refused_in_words(behaviour, other, words):
    path = behaviour(**other)
    with pytest.raises(ConfigError, match=words):
        read_versions(path)


def test_a_file_that_is_missing_or_leaves_a_subsystem_out_is_refused_in_words(tmp_path):
    path = tmp_path / "behaviour.toml"
    with pytest.raises(ConfigError, match=r"The file behaviour\.toml .* is missing.*git checkout"):
        read_versions(path)
    path.write_text("env = 1\n")
    with pytest.raises(ConfigError, match="give tracker a whole number from 1 on, got noth"):
        read_versions(path)


@pytest.mark.parametrize(
    ("depends", "words"),
    [
        ((), r"must name the subsystems.*at least one of env, .*got none"),
        (("trackers",), "Unknown subsystem 'trackers'. Did you mean 'tracker'"),
    ],
)
def test_a_study_that_names_no_subsystem_or_an_unknown_one_is_refused_in_words(depends, words):
    with pytest.raises(ConfigError, match=words):
        check_subsystems(depends)
    with pytest.raises(ConfigError, match=words):
        make_key({}, depends)


def test_the_file_of_an_estimator_of_ones_own_counts_and_ours_have_a_version():
    here = Path(__file__).read_bytes()
    mine = hash_source(test_the_file_of_this_repository_names_every_subsystem)
    assert mine == hashlib.sha256(here).hexdigest()
    assert hash_source(find_estimator("particle").make) == ""
    assert hash_source(3) == ""
