"""A body hides what lies behind it, and not the joints that lie in it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from people import STANDING

from hrc_env.core.skeleton import JOINT
from hrc_env.geometry.enclosure import enclose
from hrc_env.geometry.shapes import CENTRE, WIDTH, set_capsules
from hrc_env.geometry.sight import is_behind_body, line_to

POST = np.array([[[0.0, 0, 0], [0, 0, 2.0]]])


def hidden(eye, joint, capsules=POST, radius=(0.1,)):
    table = np.empty((len(radius), WIDTH))
    set_capsules(table, 0, capsules, np.asarray(radius, float))
    eye, joints = np.asarray(eye, float), np.asarray(joint, float)[None]
    d, length = line_to(eye, joints, 0)
    p = eye - table[:, CENTRE : CENTRE + 3]
    return any(is_behind_body(table, k, tuple(row), d, length) for k, row in enumerate(p))


@pytest.mark.parametrize(
    ("joint", "expected"),
    [
        ((-0.5, 0, 1), True),  # behind the middle
        ((-0.5, 0.2, 1), False),  # passes beside it
        ((0.5, 0, 1), False),  # in front
        ((0, 0, 1), False),  # inside: the post's own joint
        ((-0.5, 0, 3.5), False),  # over the top
    ],
)
def test_a_post_hides_what_is_behind_it(joint, expected):
    assert hidden((3, 0, 1), joint) is expected


@settings(max_examples=100, deadline=None)
@given(st.floats(0, 0.2), st.floats(-1, 1))
def test_a_line_is_blocked_when_its_way_through_a_sphere_is_long(offset, height):
    """A ball of radius 0.1: the way through is 2 sqrt(r^2 - d^2), the limit 1.4 r."""
    ball = np.full((1, 2, 3), [0.0, 0.0, height])
    way = 2 * np.sqrt(max(0.01 - offset**2, 0))
    if abs(way - 0.14) > 1e-6:
        assert hidden((2, offset, height), (-2, offset, height), ball) is bool(way > 0.14)


def test_a_body_seen_from_the_front_hides_no_joint():
    body = enclose(STANDING)
    eye = (3.0, 0.0, 1.5)
    seen = [not hidden(eye, joint, *body) for joint in STANDING]
    assert all(seen)


def test_a_body_seen_from_the_side_hides_the_far_arm():
    body = enclose(STANDING)
    eye = (0.0, -3.0, 1.2)  # from the right
    is_hidden = {
        name: hidden(eye, STANDING[JOINT[name]], *body)
        for name in ("left_elbow", "right_elbow", "left_shoulder", "right_shoulder")
    }
    assert is_hidden["left_elbow"]
    assert is_hidden["left_shoulder"]
    assert not is_hidden["right_elbow"]
    assert not is_hidden["right_shoulder"]


def test_a_face_is_hidden_from_behind():
    body, radius = enclose(STANDING)
    body[0] = STANDING[0] + [-0.1, 0, 0.05]  # a head whose surface the nose is on
    radius[0] = 0.11
    assert hidden((-3, 0, 1.7), STANDING[0], body, radius)
    assert not hidden((3, 0, 1.7), STANDING[0], body, radius)
