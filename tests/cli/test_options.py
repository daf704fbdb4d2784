"""Options of commands: unknown ones are answered with the nearest, switches come in two ways."""

import pytest

from hrc_env.__main__ import COMMANDS, main
from hrc_env.cli.experiment import Experiment
from hrc_env.cli.options import normalize_words
from hrc_env.cli.play import Play
from hrc_env.cli.train import Train
from hrc_env.core.errors import ConfigError


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("--film False", "--no-film"),
        ("--film=false", "--no-film"),
        ("--no-film", "--no-film"),
        ("--film True", "--film"),
        ("--film", "--film"),
        ("--her", "--her True"),
        ("--her True", "--her True"),
        ("--no-her", "--her False"),
        ("--her=False", "--her False"),
        ("--her None --film", "--film"),
        ("--num_envs 3 --film False --seed 1", "--num_envs 3 --no-film --seed 1"),
    ],
)
def test_a_switch_is_given_with_its_value_or_without(words, expected):
    assert normalize_words(Train, words.split(), "train") == expected.split()


def test_a_word_behind_a_switch_that_is_no_value_stays_what_it_is():
    assert normalize_words(Play, ["--viewer", "HRCReach-v0"], "play") == ["--viewer", "HRCReach-v0"]


def test_switches_of_an_experiment_are_found():
    words = ["impact", "--quick", "True", "--robots", "a:b", "c"]
    expected = ["impact", "--quick", "--robots", "a:b", "c"]
    assert normalize_words(Experiment, words, "experiment") == expected


@pytest.mark.parametrize("words", [["--film=maybe"], ["--no-film", "True"], ["--no-her=False"]])
def test_a_switch_with_another_value_says_what_it_takes(words):
    with pytest.raises(
        ConfigError, match=r"takes True, False or no value \(--\w+, --no-\w+\); got"
    ):
        normalize_words(Train, words, "train")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["play", "--perceptoin", "truth"], "Unknown option '--perceptoin'. Did you mean '--perc"),
        (["train", "--no-flim"], "Did you mean '--no-film'?"),
        (["train", "--epsiodes=4"], "Did you mean '--episodes'? python -m hrc_env train --help"),
        (["experiment", "impact", "--qick"], "'--quick'? python -m hrc_env experiment impact --h"),
        (["experiment", "impct"], "Unknown command 'impct'. Did you mean 'impact'?"),
        (["check", "--xyzzy"], "Unknown option '--xyzzy'. python -m hrc_env check --help lists"),
    ],
)
def test_an_unknown_option_is_answered_with_the_nearest(words, said, capsys):
    assert main(words) == 2
    assert said in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("name", COMMANDS)
def test_help_is_an_option_of_every_command(name, capsys):
    with pytest.raises(SystemExit) as end:
        main([name, "--help"])
    assert end.value.code == 0
    assert "usage" in capsys.readouterr().out
