"""Sampling: recorded parts are replayed, and one that comes out otherwise makes its study stale."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest

from benchmarks import records, results, verify
from benchmarks.replays import Replay, find_row, walk
from benchmarks.studies import COMMANDS, Command
from benchmarks.verify import Arguments, compute_found_share, draw, main
from docs import tables
from hrc_env.core.errors import ConfigError, DownloadError
from hrc_env.experiments.runner import make_cache

ROWS = ("lab", "site")
SEEDS = range(5)


@dataclass(frozen=True)
class Toy:
    """An experiment, and how much is played."""

    n: int = 1
    name = "toy"
    depends = ("env", "tracker")
    seeds = (0,)
    n_parts = 11

    def settings(self):
        return {"asked": "always the same"}

    def play(self, cache):
        """Numbers of every row and seed; nobody looks into parts before all are there."""
        found = {}
        for row in ROWS:
            for seed in SEEDS:

                def make(tick, row=row, seed=seed):
                    values = np.random.default_rng([len(row), seed]).normal(size=50)
                    values = (self.n * values).tolist()
                    return {"t": [float(seed)], "values": values, "row": row}

                found[row, seed] = cache.make_part(f"{row}.{seed}", make)
        found["learnt"] = cache.make_part("training.0", lambda tick: {"sha256": "abc"})
        return found


@pytest.fixture
def toy(tmp_path, monkeypatch):
    """A study with recorded parts, and a function that says with which settings it is replayed."""
    monkeypatch.setattr(tables, "RESULTS", tmp_path / "results")
    for name, path in {"WHOLE": "results/whole", "OUT": "out"}.items():
        monkeypatch.setattr(results, name, tmp_path / path)
    for name in list(COMMANDS):
        monkeypatch.delitem(COMMANDS, name)
    monkeypatch.setitem(COMMANDS, "toy", Command("python -m toy", 1, Toy.depends))
    replays = {}
    monkeypatch.setattr(verify, "REPLAYS", replays)

    def replayed_with(config, **changes):
        replays["toy"] = Replay(
            lambda given: walk(config, given), trainings=("training.",), **changes
        )

    Toy().play(make_cache(Toy(), tmp_path / "made", lambda share, label: None))
    versions = results.select_versions(Toy.depends)
    records.write("toy", versions, tmp_path / "made", 0.0)
    (tmp_path / "results" / "whole").mkdir(parents=True)
    whole = {"command": "python -m toy", "depends": versions}
    (tmp_path / "results" / "whole" / "toy.json").write_text(json.dumps(whole))
    replayed_with(Toy())
    return replayed_with


def verified(tmp_path, **arguments):
    """The exit status of a run, and its outcome."""
    out = tmp_path / "verify.json"
    status = main(Arguments(**{"seed": 1, "out": out, **arguments}))
    return status, json.loads(out.read_text())


def test_parts_that_come_out_again_leave_a_study_fresh(toy, tmp_path, capsys):
    status, outcome = verified(tmp_path, share=0.3, strict=True)
    assert status == 0
    assert outcome["n_parts"] == 10  # a training is not played
    assert len(outcome["drawn"]["toy"]) >= 3
    assert outcome["spoiled"] == outcome["skipped"] == outcome["lacking"] == {}
    assert results.explain_stale("toy") == ""
    assert "0 differ" in capsys.readouterr().out


def test_at_least_one_part_of_every_row_is_replayed(toy, tmp_path):
    _, outcome = verified(tmp_path, share=0.0)
    assert {label.split(".")[0] for label in outcome["drawn"]["toy"]} == set(ROWS)


def test_a_spoiled_part_is_found_and_makes_its_study_stale(toy, tmp_path, capsys):
    record = records.read("toy")
    part = record.parts["site.3"]
    part.summary["values*"][2] += 1e-4
    records.save("toy", record)
    status, outcome = verified(tmp_path, share=1.0)
    assert status == 1
    assert outcome["spoiled"]["toy"].keys() == {"site.3"}
    assert results.explain_stale("toy").startswith(
        "replayed, part site.3 differs: values* has mean"
    )
    assert "toy is stale: 1 of its parts differ" in capsys.readouterr().out
    status, outcome = verified(tmp_path, share=1.0)
    assert "it is stale already: replayed, part site.3" in outcome["skipped"]["toy"]


def test_other_behaviour_is_found_by_the_first_part(toy, tmp_path):
    toy(Toy(2))
    status, outcome = verified(tmp_path, share=0.0)
    assert status == 1
    assert len(outcome["spoiled"]["toy"]) == 2
    assert "part lab." in results.explain_stale("toy")
    assert "(and 1 more)" in results.explain_stale("toy")


def test_a_part_with_other_settings_or_that_is_no_longer_made_or_fails_is_found(toy, tmp_path):
    record = records.read("toy")
    parts = {"lab.0": replace(record.parts["lab.0"], key="other"),
             "gone.0": record.parts["lab.0"]}  # fmt: skip
    records.save("toy", replace(record, parts=parts))
    _, outcome = verified(tmp_path)
    assert "its settings differ from those of its record" in outcome["spoiled"]["toy"]["lab.0"]
    assert "no longer computes it" in outcome["spoiled"]["toy"]["gone.0"]
    records.save("toy", record)
    toy(Toy("not a number"))
    _, outcome = verified(tmp_path, share=0.0)
    assert all("it fails with" in words for words in outcome["spoiled"]["toy"].values())


def test_what_a_machine_lacks_spoils_nothing_and_is_named(toy, tmp_path, monkeypatch, capsys):
    def fail(given):
        raise DownloadError("The film cannot be fetched.")

    monkeypatch.setitem(verify.REPLAYS, "toy", Replay(fail))
    status, outcome = verified(tmp_path, share=0.0)
    assert (status, outcome["spoiled"]) == (0, {})
    assert len(outcome["lacking"]["toy"]) == 3
    assert "The film cannot be fetched" in capsys.readouterr().out
    monkeypatch.setitem(verify.REPLAYS, "toy", Replay(lambda given: None, learnt=("",)))
    assert verified(tmp_path, share=0.0, strict=True)[0] == 1


def test_a_study_without_recorded_parts_is_named_and_fails_only_if_strict(toy, tmp_path, capsys):
    records.get_path("toy").unlink()
    status, outcome = verified(tmp_path)
    assert status == 0
    assert "the next `make results` records them" in outcome["skipped"]["toy"]
    assert "toy: not replayed, it has no recorded parts" in capsys.readouterr().out
    assert verified(tmp_path, strict=True)[0] == 1


def test_parts_that_take_long_or_hold_times_are_left_out(toy, tmp_path):
    record = records.read("toy")
    slow = replace(record.parts["lab.1"], seconds=1e4)
    records.save("toy", replace(record, parts={**record.parts, "lab.1": slow}))
    toy(Toy(), timed=("site.",))
    _, outcome = verified(tmp_path, share=1.0)
    assert outcome["too_long"] == {"toy": ["lab.1"]}
    assert outcome["drawn"]["toy"] == ["lab.0", "lab.2", "lab.3", "lab.4"]


def test_a_draw_is_the_same_for_a_seed_and_covers_the_share():
    choices = {("one", f"{row}.{k}"): 1.0 + k for row in "abc" for k in range(100)}
    drawn, n = draw(choices, 0.02, np.random.default_rng(3))
    again, _ = draw(choices, 0.02, np.random.default_rng(3))
    assert drawn == again
    assert n == 6 <= len(drawn["one"]) <= 8


def test_the_share_that_is_found_is_exact():
    assert compute_found_share(10, 10) == 0.1
    assert compute_found_share(10, 0) is None
    share = compute_found_share(100, 10)
    rng, n_spoiled = np.random.default_rng(0), round(100 * share)
    found = [rng.choice(100, 10, replace=False).min() < n_spoiled for _ in range(4000)]
    assert 0.94 < np.mean(found) < 0.975
    fewer = [rng.choice(100, 10, replace=False).min() < n_spoiled - 1 for _ in range(4000)]
    assert np.mean(fewer) < 0.955


@pytest.mark.parametrize(
    "change",
    [
        lambda values: values[:-1],
        lambda values: values[::-1],
        lambda values: [*values[:-1], float("nan")],
        lambda values: [values[0] + 1e-3, *values[1:]],
    ],
)
def test_a_summary_tells_number_order_gaps_and_size(change):
    values = np.random.default_rng(2).normal(size=100).tolist()
    before, now = (records.summarize({"a": [{"x": each}]}) for each in (values, change(values)))
    assert records.describe_difference(before, now)


def test_a_summary_forgives_rounding_and_forgets_the_clock():
    values = 1e3 * np.random.default_rng(2).normal(size=100)
    before = records.summarize({"episodes": [{"r": float(v), "t": 1.0} for v in values]})
    now = records.summarize({"episodes": [{"r": float(v + 1e-7), "t": 9.0} for v in values]})
    assert before.keys() == {"episodes*/r"}
    assert records.describe_difference(before, now) == ""
    assert "is missing" in records.describe_difference(before, {})
    words = records.summarize({"row": "lab"}), records.summarize({"row": "site"})
    assert records.describe_difference(*words)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"share": 2.0}, r"--share must be in \[0, 1\], got 2.0"),
        ({"longest": 0.0}, "--longest must be positive"),
        ({"only": ("sites",)}, "Unknown study 'sites'. Did you mean 'site'"),
    ],
)
def test_arguments_that_cannot_work_are_refused_in_words(given, words):
    with pytest.raises(ConfigError, match=words):
        Arguments(**given)


def test_rows_are_those_of_the_tables():
    assert find_row("site", "one_camera.3") == "one_camera"
    assert find_row("price", "one_camera.fast.proof.19000500") == "one_camera.fast"
    assert find_row("kept", "HRCReach-v0.limited.qp.1000000") == "HRCReach-v0.limited.qp"
    recorded = {find_row("kept", label) for label in records.read("kept").parts}
    assert len(recorded) == len(records.read("kept").parts)
