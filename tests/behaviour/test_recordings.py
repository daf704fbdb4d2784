"""The probes' own machinery: what counts as a difference, and what is refused."""

import numpy as np
import pytest

from tests.behaviour import accept, doors
from tests.behaviour.probe import Played, Probe, RecordingError, compare, path_of, read, write
from tests.behaviour.rooms import ROOMS, Placed, probes


def make_played(n_settled=None):
    values = {
        "angle": np.linspace(0, 1, 12).reshape(6, 2),
        "words": np.array(["walk", "walk", "stand", "", "", "reach"]),
        "goals": np.arange(6.0),
        "age": np.array([0.0, np.nan, 1.0, np.inf, 2.0, 3.0]),
    }
    return Played(values, n_settled, frozenset({"goals"}))


def change(played, name, step, value):
    values = {key: np.array(each) for key, each in played.values.items()}
    values[name][step] = value
    return Played(values, played.n_settled, played.events)


def test_the_same_differs_in_nothing():
    assert compare(make_played(), make_played()) == []


@pytest.mark.parametrize(
    ("name", "step", "value", "size"),
    [
        ("angle", 3, 2.0, pytest.approx(1.37, abs=0.1)),
        ("words", 2, "run", np.inf),
        ("age", 1, 0.0, np.inf),
        ("age", 3, 5.0, np.inf),
    ],
)
def test_a_difference_is_given_by_name_step_and_size(name, step, value, size):
    (found,) = compare(make_played(), change(make_played(), name, step, value))
    assert (found.name, found.step, found.size) == (name, step, size)


def test_rounding_is_no_difference_and_ten_times_as_much_is():
    assert compare(make_played(), change(make_played(), "goals", 4, 4.0 + 1e-6)) == []
    assert compare(make_played(), change(make_played(), "goals", 4, 4.0 + 1e-5))


def test_after_the_first_contact_events_alone_are_compared():
    recorded = make_played(n_settled=3)
    assert compare(recorded, change(recorded, "angle", 4, 9.0)) == []
    assert compare(recorded, change(recorded, "goals", 4, 4.0005)) == []
    assert compare(recorded, change(recorded, "goals", 4, 5.0))
    assert compare(recorded, change(recorded, "angle", 2, 9.0))
    assert compare(recorded, make_played(n_settled=4))


def test_values_that_come_and_go_are_differences():
    recorded, now = make_played(), make_played()
    now.values["new"] = now.values.pop("angle")
    assert {each.name for each in compare(recorded, now)} == {"angle", "new"}


def test_a_value_without_steps_is_compared_by_its_shape():
    empty = Played({"found": np.zeros((0, 3))})
    assert compare(empty, empty) == []
    assert compare(empty, Played({"found": np.zeros((1, 3))}))


def test_a_recording_reads_back(tmp_path):
    write(tmp_path / "a.npz", {"actions": np.ones((3, 2), np.float32)}, make_played(2))
    inputs, played = read(tmp_path / "a.npz")
    assert inputs["actions"].shape == (3, 2)
    assert compare(played, make_played(2)) == []
    assert [each.name for each in tmp_path.iterdir()] == ["a.npz"]


def test_a_missing_recording_and_one_of_another_format_are_refused_in_words(monkeypatch, tmp_path):
    monkeypatch.setattr("tests.behaviour.probe.FOLDER", tmp_path)
    path = path_of("env", Probe(name="some", play=lambda inputs: make_played()))
    with pytest.raises(RecordingError, match=r"no recording env/some.npz.*--accept"):
        read(path)
    monkeypatch.setattr("tests.behaviour.probe.FORMAT", 7)
    write(path, {}, make_played())
    monkeypatch.setattr("tests.behaviour.probe.FORMAT", 1)
    with pytest.raises(RecordingError, match="is of format 7, and this code reads format 1"):
        read(path)
    path.write_bytes(b"nothing")
    with pytest.raises(RecordingError, match="is no recording"):
        read(path)


def test_every_room_has_probes_with_names_of_their_own_and_a_short_form():
    placed = list(probes())
    assert len({each.label for each in placed}) == len(placed)
    for room in ROOMS:
        assert any(each.probe.is_short for each in placed if each.room == room), room


def test_no_recording_is_of_a_probe_that_is_gone():
    known = {path_of(each.room, each.probe) for each in probes()}
    kept = set(accept.ROOT.joinpath(accept.RECORDED).glob("*/*.npz"))
    assert kept == known


def test_no_commit_changes_doors_and_recorded_values_at_once():
    assert accept.find_mixed_commits() == []


def test_a_version_needs_an_entry_that_names_what_moves():
    raised = {("env", 2): ["HRCReach-v0", "reward"], ("tracker", 3): []}
    full = "# Changelog\n\n- env 2, tracker 3: `HRCReach-v0` (reward):\n  the bonus is 6.\n"
    accept.check_changelog(full, raised)
    for missing in ("env 2", "tracker 3", "HRCReach-v0", "reward"):
        with pytest.raises(accept.RefusedError, match=missing):
            accept.check_changelog(full.replace(missing, "-"), raised)


def test_uncommitted_changes_elsewhere_are_refused(monkeypatch):
    status = " M hrc_env/env.py\n M CHANGELOG.md\n?? tests/behaviour/recorded/env/new.npz\n"
    monkeypatch.setattr(accept, "_git", lambda *words: status)
    with pytest.raises(accept.RefusedError, match=r"not committed: hrc_env/env\.py\. Commit"):
        accept.check_ready()
    monkeypatch.setattr(accept, "_git", lambda *words: status.partition("\n")[2])
    accept.check_ready()


def test_versions_are_written_beside_their_comments(monkeypatch, tmp_path):
    path = tmp_path / "behaviour.toml"
    path.write_text("# Why.\n" + "".join(f"{name} = 1\n" for name in set(ROOMS.values())))
    monkeypatch.setattr(accept, "VERSIONS", path)
    accept.write_versions(doors.read_versions(path) | {"tracker": 2})
    assert doors.read_versions(path)["tracker"] == 2
    assert path.read_text().startswith("# Why.\n")


def test_every_room_speaks_for_a_subsystem_and_every_subsystem_has_a_room():
    assert set(ROOMS.values()) == set(doors.subsystems())


def test_what_an_environment_probe_shows_is_put_in_words():
    probe = Probe(name="some", play=lambda inputs: make_played(), subject="HRCReach-v0")
    recorded = make_played()
    now = Played({**recorded.values, "reward/goal": np.ones(6), "cost": np.ones(6)})
    words = accept.describe(Placed("env", probe), compare(recorded, now))
    assert words == ["HRCReach-v0", "cost", "reward"]
