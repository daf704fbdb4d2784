"""Props are things that two hands can hold."""

import numpy as np
import pytest

from hrc_env.core.records import Held
from hrc_env.geometry.shapes import AXES, BOX, CAPSULE, CENTRE, KIND, REACH
from hrc_env.worker.props import PROP_NAMES, PROPS, held_shapes

HELD = PROPS[1:]


def test_the_first_prop_is_nothing():
    assert PROPS[0].name == "nothing"
    assert len(PROPS[0].shapes) == 0


def test_names_are_unique_and_find_their_prop():
    assert len(set(PROP_NAMES)) == len(PROPS)
    assert PROPS[PROP_NAMES.index("hammer")].name == "hammer"


@pytest.mark.parametrize("prop", HELD, ids=lambda prop: prop.name)
def test_hands_grip_where_the_prop_is(prop):
    """A grip lies in the ball round one of the prop's parts, and the parts are known shapes."""
    assert np.isin(prop.shapes[:, KIND], [BOX, CAPSULE]).all()
    held = prop.grips[np.isfinite(prop.grips).all(-1)]
    assert len(held) > 0
    for grip in held:
        away = np.linalg.norm(prop.shapes[:, CENTRE : CENTRE + 3] - grip, axis=-1)
        assert (away <= prop.shapes[:, REACH]).any()


@pytest.mark.parametrize("prop", HELD, ids=lambda prop: prop.name)
def test_two_hands_hold_it_on_their_own_sides(prop):
    left, right = prop.grips
    if np.isfinite(left).all():
        assert left[1] > 0 > right[1]
        assert left[1] - right[1] < 0.7
    else:
        np.testing.assert_array_equal(right, 0.0)


def test_what_is_held_cannot_be_changed_by_accident():
    with pytest.raises(ValueError, match="read-only"):
        PROPS[1].shapes[0, 0] = 1.0


def test_what_is_held_goes_where_it_is_held():
    """A board that is turned by a quarter lies along world x; nobody holds the other one."""
    kind = np.array([[PROP_NAMES.index("board"), 0]])
    quarter = np.array([np.cos(np.pi / 4), 0, 0, np.sin(np.pi / 4)])
    held = Held(kind, np.full((1, 2, 3), (1.0, 2.0, 3.0)), np.tile(quarter, (1, 2, 1)))
    rows = held_shapes(held)[0]
    there = rows[np.isfinite(rows[:, REACH])]
    assert len(there) == 1
    np.testing.assert_allclose(there[0, CENTRE : CENTRE + 3], (1, 2, 3))
    np.testing.assert_allclose(there[0, AXES + 3 : AXES + 6], (-1, 0, 0), atol=1e-12)
