"""`help` of a public class shows the docstrings of its fields, and reads them only then."""

import pydoc

import pytest

import hrc_env
from hrc_env.core import docstrings

RECORDS = [
    name
    for name in hrc_env.PUBLIC
    if isinstance(kind := getattr(hrc_env, name, None), type) and docstrings.list_attributes(kind)
]


def test_the_records_that_users_fill_and_read_are_among_them():
    assert {
        "Belief", "EnvConfig", "EnvInfo", "Episode", "EstimatorSpec", "Goal", "HRCConfig",
        "Keypoints", "PoseEstimate", "ResetOptions", "Robot", "Row", "Study", "Task",
        "Transition", "World",
    } <= set(RECORDS)  # fmt: skip


@pytest.mark.parametrize("name", RECORDS)
def test_help_shows_every_field_with_its_meaning(name):
    kind = getattr(hrc_env, name)
    text = " ".join(pydoc.plain(pydoc.render_doc(kind)).replace("|", "").split())
    for each in docstrings.list_attributes(kind):
        entry = " ".join(f"{each.name} ({each.annotation}): {each.doc}".replace("|", "").split())
        assert entry in text
    assert docstrings.get_own_doc(kind) in kind.__doc__
    assert "Attributes:" not in docstrings.get_own_doc(kind)


def test_fields_are_read_only_when_help_is(monkeypatch):
    class Point:
        """A point."""

        x: float
        """Its place [m]."""

    monkeypatch.setattr(docstrings, "list_attributes", lambda kind: pytest.fail("read too early"))
    docstrings.show_attributes(Point)
    assert docstrings.get_own_doc(Point) == "A point."


def test_a_class_without_source_or_docstring_stays_as_it_is():
    made, bare = type("Made", (), {"__doc__": "A made class."}), type("Bare", (), {})
    docstrings.show_attributes(made)
    docstrings.show_attributes(bare)
    assert (made.__doc__, bare.__doc__) == ("A made class.", None)
    assert docstrings.get_own_doc(bare) == ""


def test_a_subclass_has_its_own_docstring():
    class Mine(hrc_env.Task):
        """A task of my own."""

    assert Mine.__doc__ == "A task of my own."
    assert "Attributes:" in (hrc_env.Task.__doc__ or "")
