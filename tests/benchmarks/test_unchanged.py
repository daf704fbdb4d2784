"""The comparison of two checkouts: names are translated, what differs is found."""

import math
from pathlib import Path

import pytest

from benchmarks import unchanged
from benchmarks.trajectory import differences
from hrc_env.core.errors import ConfigError

OLD = {"cost": [None, 1.0], "worker/activity": [["idle"], ["saw"]], "gone": [1.0, 2.0]}
NAMES = {"renamed": {"cost": "safety/cost"}, "words": {"saw": "sawing"}, "gone": {"gone": "why"}}


def test_names_words_and_what_is_gone_are_translated():
    assert unchanged.translated(OLD, NAMES) == {
        "safety/cost": [None, 1.0],
        "worker/activity": [["idle"], ["sawing"]],
    }


def test_moments_at_which_a_key_was_not_known_are_left_out():
    new = {"safety/cost": [0.0, 1.5]}
    old = unchanged.translated(OLD, NAMES)
    assert unchanged.matched(new, old, "safety/cost") == [None, 1.5]
    apart = differences({"safety/cost": old["safety/cost"]}, {"safety/cost": [None, 1.5]})
    assert apart == {"safety/cost": 0.5}


def test_no_number_is_no_number_only():
    assert differences({"x": [math.nan]}, {"x": [math.nan]}) == {"x": 0.0}
    assert differences({"x": [math.nan]}, {"x": [1.0]}) == {"x": math.inf}
    assert differences({"x": [[1.0, 2.0]]}, {"x": [[1.0]]}) == {"x": math.inf}


def test_a_folder_that_is_no_checkout_is_refused(tmp_path: Path):
    with pytest.raises(ConfigError, match="no checkout"):
        unchanged.main(unchanged.Arguments(tmp_path))


@pytest.mark.usefixtures("process")
def test_a_checkout_and_itself_are_the_same(capsys):
    alike = unchanged.Arguments(unchanged.ROOT, steps=4, cases=("truth", "none"))
    assert unchanged.main(alike) == 0
    assert "truth" in capsys.readouterr().out
