"""Props are things that two hands can hold."""

import numpy as np
import pytest

from hrc_env.geometry.shapes import BOX, CAPSULE, CENTRE, KIND, REACH
from hrc_env.props import PROP_NAMES, PROPS, prop_index

HELD = PROPS[1:]


def test_the_first_prop_is_nothing():
    assert PROPS[0].name == "nothing"
    assert len(PROPS[0].shapes) == 0


def test_names_are_unique_and_find_their_prop():
    assert len(set(PROP_NAMES)) == len(PROPS)
    assert PROPS[prop_index("hammer")].name == "hammer"


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
