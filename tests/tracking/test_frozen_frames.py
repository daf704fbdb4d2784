"""Cameras that repeat themselves are left out."""

import numpy as np

from hrc_env.core.records import Keypoints
from hrc_env.tracking.frozen_frames import LEAST_NEW, forget_frozen, leave_out_frozen, make_frozen


def image(*values):
    """One environment, a camera a value; NaN sees nobody."""
    px = np.zeros((1, len(values), 1, 15, 2)) + np.array(values)[None, :, None, None, None]
    seen = np.isfinite(px[..., 0])
    return Keypoints(px, np.where(seen, 0.9, 0.0), np.where(seen, 3.0, np.inf))


def believed(state, *values):
    found = image(*values)
    leave_out_frozen(state, np.array([0]), found)
    missing = np.isnan(found.px[0, :, 0, 0, 0])
    assert (found.confidence[0, missing] == 0).all()
    assert np.isinf(found.sigma_px[0, missing]).all()
    return (~missing).tolist()


def test_who_repeats_an_image_is_left_out_and_the_others_are_not():
    state = make_frozen(1, 2)
    assert believed(state, 1.0, 1.0) == [True, True]
    assert believed(state, 1.0, 2.0) == [False, True]
    assert believed(state, 1.0, 3.0) == [False, True]


def test_one_new_image_is_not_enough_and_several_are():
    state = make_frozen(1, 1)
    for value in (1.0, 1.0):
        believed(state, value)
    told = [believed(state, 2.0 + k)[0] for k in range(LEAST_NEW)]
    assert told == [*[False] * (LEAST_NEW - 1), True]


def test_nobody_seen_is_no_repetition():
    state = make_frozen(1, 1)
    believed(state, 1.0)
    for _ in range(3):
        assert believed(state, np.nan) == [False]
    assert believed(state, 2.0) == [True]


def test_a_reset_believes_everybody():
    state = make_frozen(1, 1)
    for value in (1.0, 1.0):
        believed(state, value)
    forget_frozen(state, np.array([0]))
    assert believed(state, 1.0) == [True]
