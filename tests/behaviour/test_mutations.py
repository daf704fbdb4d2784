"""The net is attacked by honest changes: the list, the draws, and how mutants are judged."""

import json
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from tests.behaviour import mutants
from tests.behaviour.mutants import (
    CODE,
    LEFT_OUT,
    NAMED,
    ROOT,
    SEMANTIC,
    Edit,
    Mutant,
    MutantError,
    changes_code,
    child,
    draw,
    draw_mutants,
    read_list,
)
from tests.behaviour.mutate import (
    Arguments,
    Judge,
    Kept,
    Notice,
    Processes,
    Result,
    digest_checkout,
    read_notice,
)
from tests.behaviour.mutations import find_candidates
from tests.behaviour.rooms import ROOMS

DRAWS = sorted(each.stem for each in mutants.FOLDER.glob("draw_*.toml"))


def changed(line: str) -> dict[str, set[str]]:
    """The changes that a function of one line allows, by kind."""
    text = f"def f(a_world, a_cam, R, c, b, n_seen, dt_s, q_rad):\n    {line}\n"
    found: dict[str, set[str]] = {}
    for each in find_candidates(text):
        found.setdefault(each.kind, set()).add(each.after.strip())
    return found


@pytest.mark.parametrize(
    ("line", "kind", "after"),
    [
        ("x = 0.05", "constant", {"x = 0.1", "x = 0.5", "x = 0.025"}),
        ("x = 3", "constant", {"x = 4", "x = 2"}),
        ("x = b_m < c_m", "comparison", {"x = b_m > c_m"}),
        ("x = n_seen < c", "comparison", {"x = n_seen > c", "x = n_seen <= c"}),
        ("x = b_m < 0", "comparison", {"x = b_m > 0"}),
        ("x = -b", "sign", {"x = (b)"}),
        ("x = b - c", "sign", {"x = b + c"}),
        ("x = (b + c) * b", "term", {"x = ((b)) * b", "x = (b) * b"}),
        ("x += b", "sign", {"x -= b"}),
        ("x = np.radians(b)", "units", {"x = (b)"}),
        ("x = b * dt_s", "units", {"x = b * (2.0 * dt_s)"}),
        ("x = R.T @ b", "frames", {"x = R @ b"}),
        ("x = R @ b", "frames", {"x = R.swapaxes(-1, -2) @ b"}),
        ("x = a_cam", "frames", {"x = a_world"}),
        ("x = b[c]", "cameras", {"x = b[c - 1]"}),
        ('x = J["left_hip"]', "joints", {"x = J['right_hip']"}),
        ("x = q[b, c]", "index", {"x = q[c, b]"}),
        ("x = q[1:]", "off by one", {"x = q[2:]"}),
        ("x = range(n_seen)", "off by one", {"x = range(n_seen - 1)"}),
        ("x = b and c", "logic", {"x = b or c"}),
        ("x = not b", "logic", {"x = (b)"}),
        ("x = np.minimum(b, c)", "extremes", {"x = np.maximum(b, c)"}),
        ("x = math.sin(b)", "trigonometry", {"x = math.cos(b)"}),
    ],
)
def test_a_line_allows_each_kind_of_change(line, kind, after):
    assert changed(line)[kind] & after, changed(line)
    assert changed(line)[kind] <= after


@pytest.mark.parametrize(
    "line",
    [
        "raise ConfigError(f'{b}', 3)", "warnings.warn('x', stacklevel=3)", "'Text, 3 < 4.'",
        "x = f'{b + 1:.3f}'", "x = np.zeros((4, 3))", "x: int | None", "assert b < 3",
        "x = b.sum(axis=1)", "x = b[:0]", "x = np.maximum(b, 1e-9)", "x = isinstance(b, int)",
        "MAPS_KEPT = 64", 'x = np.array([("a", "f8", (3,))])',
    ],
)  # fmt: skip
def test_what_surely_changes_nothing_is_left_out(line):
    assert not set(changed(line)) - {"extremes"}, changed(line)


def test_decorators_and_annotations_are_left_out():
    text = "@lru_cache(maxsize=16)\ndef f(x: A | B = None) -> tuple[int, 3]:\n    return x\n"
    assert not find_candidates(text)


def test_every_room_of_the_code_has_probes_and_tests_that_are_there():
    for room in CODE.values():
        assert set(room.probes) <= set(ROOMS)
        for path in (room.path, *room.tests):
            assert (ROOT / path).exists(), path
    assert all((ROOT / path).exists() for path in LEFT_OUT)


def test_the_first_list_holds_the_nine_changes_that_were_not_noticed():
    named = read_list(NAMED)
    assert len(named) == 9
    assert all(changes_code(each) for each in named)


def test_the_semantic_list_has_enough_of_each_kind():
    semantic = read_list(SEMANTIC)
    counts = Counter(each.kind for each in semantic)
    assert set(counts) == {"truth", "stream", "cameras", "frames"}
    assert min(counts.values()) >= 4
    assert all(changes_code(each) for each in semantic)
    assert len({each.name for each in semantic}) == len(semantic)


def test_the_unseen_list_is_of_the_code_that_says_what_cameras_do_not_see():
    unseen = read_list("unseen")
    assert len({each.key for each in unseen}) == 40
    assert {each.room for each in unseen} == {
        "pipeline", "tracking", "safety", "perception", "scene",
    }  # fmt: skip


@pytest.mark.parametrize("name", DRAWS)
def test_a_draw_has_enough_of_each_room(name):
    drawn = read_list(name)  # it fits the code of its day; lines may have changed since
    assert len(drawn) == 80
    assert len({each.key for each in drawn}) == len(drawn)
    assert min(Counter(each.room for each in drawn)[room] for room in CODE) >= 4


# A checkout of one line.


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A checkout with a room "rewards" of one number, whose unit test holds it."""
    monkeypatch.setattr(mutants, "SETTINGS", ())
    (tmp_path / "hrc_env").mkdir()
    (tmp_path / "hrc_env" / "__init__.py").write_text("")
    (tmp_path / "hrc_env" / "rewards.py").write_text('"""Rewards."""\n\nBONUS = 5.0\nREST = 1.0\n')
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "test_rewards.py").write_text(
        "from hrc_env.rewards import BONUS\n\n\ndef test_bonus():\n    assert BONUS == 5.0\n"
    )
    (tmp_path / "pyproject.toml").write_text(
        '[tool.pytest.ini_options]\nmarkers = ["slow: x", "long: x"]\n'
    )
    folder = tmp_path / "tests" / "behaviour" / "mutants"
    folder.mkdir(parents=True)
    (folder.parent / "__init__.py").write_text("")
    for name in ("__init__.py", "child.py"):
        (folder / name).write_text((mutants.FOLDER / name).read_text())
    source = mutants.FOLDER.parent / "mutations.py"
    (folder.parent / "mutations.py").write_text(source.read_text())
    (folder.parent / "rooms.py").write_text(
        "Placed = None\n\n\ndef probes(rooms):\n    return ()\n"
    )
    (folder.parent / "playing.py").write_text("def play(label):\n    ...\n")
    return tmp_path


def mutant(before: str, after: str, line: int = 3) -> Mutant:
    edit = Edit("hrc_env/rewards.py", line, before, after)
    return Mutant(f"{before} -> {after}", "rewards", "constant", (edit,))


def judge_of(place: Path, **settings) -> Judge:
    arguments = Arguments(probes=("none",), **settings)
    return Judge([place], place / "kernels", "state", arguments, place / "out")


@pytest.mark.parametrize(
    ("after", "by", "how"),
    [
        ("BONUS = 50.0", "tests/test_rewards.py::test_bonus", "test"),
        ("BONUS = 1 / 0", "tests/test_rewards.py", "exception"),
        ("BONUS = 5.0  # a comment", None, None),
    ],
)
def test_a_change_is_noticed_by_what_it_breaks_and_by_nothing_else(place, after, by, how):
    text = (place / "hrc_env" / "rewards.py").read_text()
    judge = judge_of(place)
    judge.require_tests = lambda room, copy: None  # type: ignore[method-assign]
    found = judge.judge(mutant("BONUS = 5.0", after)).notice
    assert (found and found.by, found and found.how) == (by, how)
    assert (place / "hrc_env" / "rewards.py").read_text() == text


def test_a_mutant_is_judged_by_nothing_that_the_unchanged_code_does_not_pass(place):
    path = place / "hrc_env" / "rewards.py"
    path.write_text(path.read_text().replace("5.0", "6.0"))
    with pytest.raises(MutantError, match="unchanged code does not pass the tests of rewards"):
        judge_of(place).judge(mutant("BONUS = 6.0", "BONUS = 5.0"))


def test_what_the_unchanged_code_has_passed_is_not_run_again(place):
    judge_of(place).judge(mutant("REST = 1.0", "REST = 2.0", 4))
    kept = json.loads((place / "out" / "baseline.json").read_text())
    assert kept["checkout"] == "state"
    assert len(kept["passed"]) == 2
    again = judge_of(place)
    again._run_tests = None  # type: ignore[assignment]
    again.require_tests("rewards", place)


def test_a_mutant_that_does_not_fit_the_code_is_refused_and_changes_nothing(place):
    edits = (*mutant("REST = 1.0", "REST = 2.0", 4).edits, *mutant("BONUS = 7.0", "x").edits)
    text = (place / "hrc_env" / "rewards.py").read_text()
    with pytest.raises(MutantError, match=r"expected to be 'BONUS = 7\.0'"):
        Mutant("two", "rewards", "constant", edits).write_into(place)
    assert (place / "hrc_env" / "rewards.py").read_text() == text


def test_a_line_that_has_moved_is_found_where_there_is_one_such_line():
    edit = Edit("f.py", 1, "a = 1", "a = 2")
    assert edit.apply("# new\na = 1\n") == "# new\na = 2\n"
    with pytest.raises(MutantError, match="it is in 2 other places"):
        edit.apply("# new\na = 1\na = 1\n")


def test_a_process_that_hangs_ends(tmp_path):
    command = [sys.executable, "-c", 'import time; print(\'MUTANT {"playing": "a"}\', flush=True)']
    command[-1] += "; time.sleep(60)"
    status, output, complaint = Processes().run(command, tmp_path, {}, 1.5)
    assert read_notice(status, output, complaint) == Notice(
        "a", "hang", "It took longer than the limit."
    )


def test_a_crash_and_an_exception_count_as_noticed():
    output = f'{child.MARK}{{"playing": "env/reach"}}\n'
    assert read_notice(-11, output, "") == Notice("env/reach", "crash", "exit status -11: ")
    found = read_notice(child.NOTICED, output, "Traceback\nZeroDivisionError: x\n")
    assert found == Notice("env/reach", "exception", "ZeroDivisionError: x")
    assert read_notice(child.SAME, output, "") is None


# Lists and draws.


def test_a_text_that_is_not_there_exactly_once_is_refused(place):
    entry = '[[mutant]]\nname = "n"\nroom = "rewards"\nkind = "truth"\n[[mutant.edits]]\n'
    entry += 'file = "hrc_env/rewards.py"\nold = "{}"\nnew = "x"\n'
    for old, times in (("GONE", 0), ("= ", 2)):
        (place / "some.toml").write_text(entry.format(old))
        with pytest.raises(MutantError, match=f"exactly once, and is there {times} times"):
            read_list("some", place, place)
    (place / "some.toml").write_text(entry.format("BONUS = 5.0"))
    assert read_list("some", place, place)[0].edits == mutant("BONUS = 5.0", "x").edits


def test_an_unknown_list_is_refused_with_the_valid_ones():
    with pytest.raises(MutantError, match=f"Valid are .*{NAMED}, {SEMANTIC}"):
        read_list("draw_Z")


def test_a_draw_is_made_once_and_is_the_same_for_a_seed(tmp_path):
    for name in (NAMED, SEMANTIC):
        text = (mutants.FOLDER / f"{name}.toml").read_text()
        (tmp_path / f"{name}.toml").write_text(text)
    path = draw("A", 1, 80, tmp_path)
    text, drawn = path.read_text(), read_list("draw_A", tmp_path)
    assert [each.edits for each in drawn[:9]] == [each.edits for each in read_list(NAMED)]
    assert len(drawn) == 80
    assert draw("A", 1, 80, tmp_path).read_text() == text
    for seed, n in ((2, 80), (1, 90)):
        with pytest.raises(MutantError, match="A draw is made once"):
            draw("A", seed, n, tmp_path)
    other = read_list(draw("B", 1, 80, tmp_path).stem, tmp_path)
    assert not {each.key for each in other} & {each.key for each in drawn}
    path.unlink()
    assert draw("A", 1, 80, tmp_path).exists()


def test_a_draw_that_is_too_small_is_refused():
    with pytest.raises(MutantError, match="at least 60 mutants, got 59"):
        draw_mutants(np.random.default_rng(0), 59, (), (), set())


# Results.


def test_a_run_goes_on_from_what_is_finished(tmp_path):
    one, other = mutant("a", "b"), mutant("a", "c")
    path = tmp_path / "out" / "draw.json"
    Kept(path, "state").add(Result(one, Notice("env/x", "probe"), 1.0, "state"))
    path.with_suffix(".draft").write_text("half a fi")
    kept = Kept(path, "state")
    assert kept.has(one)
    assert not kept.has(other)
    kept.add(Result(other, None, 2.0, "state"))
    assert [each["noticed_by"] for each in Kept(path, "state").entries.values()] == ["env/x", None]
    assert not Kept(path, "later").entries
    assert list(Kept(path, "later", takes_noticed=True).entries) == [one.name]


def test_a_digest_sees_code_and_probes_but_not_this_tool(place):
    before = digest_checkout(place)
    (place / "tests" / "behaviour" / "mutations.py").write_text("")
    (place / "README.md").write_text("x")
    assert digest_checkout(place) == before
    (place / "hrc_env" / "rewards.py").write_text("BONUS = 6.0\n")
    assert digest_checkout(place) != before


def test_probes_that_are_named_as_the_file_come_first_and_then_the_short_ones(monkeypatch):
    from tests.behaviour import rooms
    from tests.behaviour.probe import Played, Probe

    def probe(name: str, is_short: bool, subject: str = "") -> rooms.Placed:
        played = Probe(
            name=name, play=lambda inputs: Played({}), is_short=is_short, subject=subject
        )
        return rooms.Placed("env", played)

    placed = [probe("long", False), probe("short", True), probe("x", False, "HRCPickPlace-v0")]
    monkeypatch.setattr(rooms, "probes", lambda names: placed)
    assert child.order_probes(("env",), ("pick_place",)) == ["env/x", "env/short", "env/long"]
