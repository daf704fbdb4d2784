"""Entries of the leaderboard: written, judged, replayed, refused and ranked."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

from hrc_env.__main__ import main
from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.core.results import Metric
from hrc_env.evaluation.intervals import estimate_rate
from hrc_env.experiments import entries, leaderboard
from hrc_env.experiments.entries import (
    METRICS,
    RATE_PER_HOUR,
    Entry,
    make_entry,
    plan_judging,
    plan_replay,
    rank,
    read_entry,
    write_entry,
)
from hrc_env.experiments.leaderboard import MAIN, SEED, VERSION, draw_first_seed, make_plan

TASK = "HRCReach-v0"
KEY = f"{TASK}.{MAIN[0]}"
POLICY = """
import hrc_env


def make(env_info):
    return hrc_env.make_agent("scripted", env_info)
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The working directory, with a policy; the benchmark has its main conditions only."""
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(POLICY)
    few = {name: leaderboard.CONDITIONS[name] for name in MAIN}
    monkeypatch.setattr(leaderboard, "CONDITIONS", few)
    return tmp_path


@pytest.fixture
def entry(folder):
    """An entry of the policy, as its author writes it."""
    words = ["--ids", TASK, "--seeds", "2", "--enter", "entry.json", "--engine", "serial"]
    assert main(["benchmark", "--policy", "mine:make", *words]) == 0
    return folder / "entry.json"


@pytest.fixture
def bare(folder):
    """An entry with one number that was never played."""
    scores = {f"{KEY}.goals_per_minute": Metric(12.345678, 11.0, math.nan, "1/min", 2)}
    path = folder / "bare.json"
    write_entry(path, make_entry(make_plan("mine:make", [TASK], n=2), scores))
    return path


def change(path, **values):
    """Change values of an entry, or with a dict some values in a part of it."""
    content = json.loads(path.read_text())
    for name, value in values.items():
        content[name] = {**content[name], **value} if isinstance(value, dict) else value
    path.write_text(json.dumps(content))


def said(capsys, *words):
    """What a command says that fails."""
    assert main([*map(str, words)]) == 2
    return " ".join(capsys.readouterr().err.split())


def test_entries_are_written_and_read(bare):
    entry = read_entry(bare)
    assert repr(entry.scores) == repr(
        {f"{KEY}.goals_per_minute": Metric(12.346, 11.0, math.nan, "", 2)}
    )
    assert (entry.policy, entry.kind, entry.ids) == ("mine:make", "public seeds", (TASK,))
    setup = entry.setup
    assert setup is not None
    assert (setup.n, setup.first_seed, setup.salt, setup.files) == (2, SEED, None, ("mine.py",))
    assert setup.sha256 == make_plan("mine:make").submission.sha256


def test_an_entry_of_another_version_is_refused(bare):
    change(bare, version=VERSION + 1)
    with pytest.raises(ConfigError, match=r"version 2 .* Run python -m hrc_env benchmark again"):
        read_entry(bare)


FEW = '{"version": 1, "policy": "a", "commit": "b", "date": "c", "scores": {"d": %s}}'


@pytest.mark.parametrize(
    "text",
    ["{}", "[]", "no JSON", '{"version": 1, "scores": [1]}', FEW % "[1, 2, 3]", FEW % "3",
     FEW % '["much", 1, 2, 3]'],
)  # fmt: skip
def test_a_file_that_is_no_entry_is_refused(text, bare):
    bare.write_text(text)
    with pytest.raises(ConfigError, match="is not a result of the benchmark"):
        read_entry(bare)


def test_an_entry_that_does_not_exist_is_refused(folder, capsys):
    assert "no.json cannot be read: No such file" in said(capsys, "evaluate", "--verify", "no.json")


def test_a_former_entry_is_read_and_not_replayed(bare):
    content = json.loads(bare.read_text())
    del content["setup"]
    bare.write_text(json.dumps(content))
    assert read_entry(bare).kind == "no digest"
    with pytest.raises(ConfigError, match="has no digest of its policy"):
        plan_replay(bare)


@pytest.mark.parametrize(
    ("setup", "says"),
    [
        ({"hrc_env": "0.0.9"}, r"other versions of this package.*: hrc_env 0.0.9 there and"),
        ({"behaviour": {"env": 1}}, r"other versions of this package.*: env 1 there and \d+ here"),
        ({"first_seed": 5}, "first seed must be 5000000, which follows from its digest"),
        ({"salt": "chosen"}, r"was changed: its first seed must be \d+"),
        ({"sha256": "0" * 64}, "its SHA-256 is [0-9a-f]{64}, but the entry states 0{64}"),
        ({"n": "many"}, "setup.n"),
    ],
)
def test_an_entry_that_was_changed_is_not_replayed(setup, says, bare):
    change(bare, setup=setup)
    with pytest.raises(ConfigError, match=says):
        plan_replay(bare)


def test_a_salt_of_another_policy_gives_other_seeds(bare):
    """A changed digest fails even with seeds that were computed for it."""
    first = draw_first_seed("0" * 64, "salt")
    change(bare, setup={"salt": "salt", "sha256": "0" * 64, "first_seed": first})
    with pytest.raises(ConfigError, match="is not the one of"):
        plan_replay(bare)


def test_a_policy_that_is_missing_or_changed_is_not_replayed(bare):
    Path("mine.py").write_text(POLICY + "# changed\n")
    with pytest.raises(ConfigError, match="The policy 'mine:make' is not the one of"):
        plan_replay(bare)
    Path("mine.py").unlink()
    with pytest.raises(ConfigError, match=r"The policy of .* is missing: .* \(mine.py\) beside"):
        plan_replay(bare)


def test_files_may_lie_beside_the_entry(bare, monkeypatch, tmp_path_factory):
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    assert list(plan_replay(bare).submission.files) == ["mine.py"]
    Path("runs").mkdir()
    monkeypatch.chdir("runs")
    change(bare, policy="runs/theirs/mine.zip")
    with pytest.raises(ConfigError, match="is missing"):
        plan_replay(bare)


def test_salts_are_drawn_anew(bare):
    one, two, given = plan_judging(bare), plan_judging(bare), plan_judging(bare, salt="given")
    assert one.salt != two.salt
    assert one.first_seed != two.first_seed
    assert given.first_seed == draw_first_seed(given.submission.sha256, "given")
    with pytest.raises(ConfigError, match="--salt must not be empty"):
        plan_judging(bare, salt="")


@pytest.mark.slow
def test_an_entry_is_judged_and_verified(entry, capsys):
    assert main(["evaluate", "--verify", str(entry)]) == 0
    assert "Verified: 10 numbers" in capsys.readouterr().out
    words = ["--seeds", "3", "--salt", "drawn later", "--enter", "judged.json"]
    assert main(["judge", str(entry), *words, "--engine", "serial"]) == 0
    public, judged = read_entry(entry), read_entry(Path("judged.json"))
    assert public.setup is not None
    assert judged.setup is not None
    assert judged.kind == "judged"
    assert judged.setup.sha256 == public.setup.sha256
    assert judged.setup.first_seed == draw_first_seed(judged.setup.sha256, "drawn later")
    assert {each.n for each in judged.scores.values()} == {3}
    assert judged.scores != public.scores
    assert main(["evaluate", "--verify", "judged.json"]) == 0


@pytest.mark.slow
def test_a_number_that_was_changed_does_not_replay(entry, capsys):
    scores = json.loads(entry.read_text())["scores"]
    goals = f"{KEY}.goals_per_minute"
    for k, extra in ((0, 0.001), (3, 62)):  # the value, and the number of episodes
        numbers = [*scores[goals]]
        numbers[k] += extra
        change(entry, scores={goals: numbers})
        text = said(capsys, "evaluate", "--verify", entry)
        assert f"does not replay: {goals} is {numbers[0]:g}" in text
        change(entry, scores=scores)
    fewer = {name: each for name, each in scores.items() if "towards" not in name}
    content = json.loads(entry.read_text())
    entry.write_text(json.dumps({**content, "scores": fewer}))
    text = said(capsys, "evaluate", "--verify", entry)
    assert f"{KEY}.towards_per_hour is missing in the entry" in text


def test_verify_takes_its_settings_from_the_entry(bare, capsys):
    text = said(capsys, "evaluate", "--verify", bare, "--episodes", "3", "--agent", "random")
    assert "leave out agent, episodes" in text


def test_libraries_that_differ_are_named(bare):
    change(bare, setup={"libraries": {"numpy": "1.0"}})
    with pytest.raises(HRCError, match=r"Libraries differ, too: numpy 1.0 there and"):
        entries.check_replay(bare, {})


def scored(goals, n_contacts, hours=3.0):
    """Metrics of the main conditions, with contacts towards the worker in some hours."""
    towards = estimate_rate([n_contacts], hours, "1/h")
    each = {name: Metric(goals, goals, goals, "", 1000) for name in METRICS}
    each["towards_per_hour"] = replace(towards, n=1000)
    return {f"{TASK}.{name}.{metric}": m for name in MAIN for metric, m in each.items()}


def test_goals_count_only_where_contacts_are_known_to_be_rare(bare):
    setup = read_entry(bare).setup
    assert setup is not None
    judged = replace(setup, salt="salt")

    def make(scores, setup):
        return Entry("policy", "abc", "2026-11-29", scores, setup)

    given = {
        "dangerous": make(scored(90.0, 40), judged),
        "slow": make(scored(10.0, 0), judged),
        "fast": make(scored(50.0, 6), judged),
        "few episodes": make(scored(60.0, 0, hours=0.178), judged),
        "public": make(scored(70.0, 0), setup),
        "former": make(scored(80.0, 1), None),
    }
    places = rank(given, TASK)
    order = list(dict.fromkeys(place.name for place in places))
    assert order == ["fast", "slow", "public", "former", "dangerous", "few episodes"]
    assert len(places) == 12
    assert {place.name for place in places if place.is_qualified} == {"fast", "slow"}
    highs = [place.metrics["towards_per_hour"].high for place in places if not place.is_qualified]
    assert highs == sorted(highs)
    assert rank(given, "HRCDelivery-v0") == []


def test_episodes_without_contact_that_qualify_are_as_many_as_stated():
    """Of 10 s each, as `RATE_PER_HOUR` says."""
    high = [estimate_rate([0], n * 10 / 3600).high for n in (64, 265, 266, 1000)]
    assert high[0] == pytest.approx(20.75, abs=0.01)
    assert high[1] > RATE_PER_HOUR >= high[2]
    assert high[3] == pytest.approx(1.3, abs=0.05)
