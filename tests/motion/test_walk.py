"""Walking, against 68 recorded trials: the fits are quoted in `hrc_env.motion.walk`."""

import numpy as np
import pytest
from recorded import walk_straight

from hrc_env.worker.body import SEGMENT

SPEEDS = (0.8, 1.0, 1.2, 1.4)


@pytest.fixture(scope="module", params=SPEEDS)
def walk(request):
    recorded = walk_straight(request.param)
    recorded.position = recorded.motion.position_world[0, :, 0]
    recorded.velocity = recorded.motion.velocity_world[0, :, 0]
    x = recorded.position[:, 0, 0]
    recorded.steady = (x > 1.6) & (x < 4.4)
    recorded.speed = recorded.velocity[recorded.steady, 0, 0].mean()
    recorded.wished = request.param
    return recorded


def knee_flexion_deg(position, side):
    hip, knee, ankle = (position[:, SEGMENT[f"{side}_{n}"]] for n in ("thigh", "shank", "foot"))
    thigh, shank = knee - hip, ankle - knee
    cosine = (thigh * shank).sum(-1) / np.linalg.norm(thigh, axis=-1)
    return np.degrees(np.arccos(np.clip(cosine / np.linalg.norm(shank, axis=-1), -1, 1)))


def test_the_walker_keeps_the_wished_speed(walk):
    assert walk.speed == pytest.approx(walk.wished, rel=0.02)


def test_cadence_is_that_of_the_recordings(walk):
    toes = walk.position[walk.steady][:, SEGMENT["left_toes"], 2]
    landings = np.flatnonzero((toes[1:] < 0.055) & (toes[:-1] >= 0.055))
    strides = np.diff(landings) * walk.dt_s
    cadence = 2 * 60 / (strides.mean() if len(strides) else 2 * walk.plan["step_period"])
    assert cadence == pytest.approx(96.2 * walk.speed**0.468, rel=0.1)


def test_step_length_and_width_are_those_of_the_recordings(walk):
    prints = walk.prints[3 : int(walk.plan["step_count"]) - 4]
    step = np.abs(np.diff(prints[:, :2], axis=0))
    assert step[:, 0].mean() == pytest.approx(0.345 + 0.286 * walk.speed, rel=0.1)
    assert 0.05 <= step[:, 1].mean() <= 0.09


def test_the_pelvis_bobs_and_the_knees_bend_as_people_do(walk):
    height = walk.position[walk.steady, 0, 2]
    assert 0.015 < np.ptp(height) < 0.05
    flexion = knee_flexion_deg(walk.position[walk.steady], "right")
    assert 65 < flexion.max() < 79
    assert flexion.min() > 3  # never locked, never backwards


def test_knees_bend_forwards(walk):
    hip, knee, ankle = (
        walk.position[:, SEGMENT[f"left_{n}"], 0] for n in ("thigh", "shank", "foot")
    )
    assert (knee - 0.5 * (hip + ankle)).min() > 0.0


def test_ankles_and_wrists_are_as_fast_as_recorded(walk):
    for name, slow, fast in (("left_foot", 2.3, 4.7), ("right_hand", 1.0, 2.8)):
        fastest = np.linalg.norm(walk.velocity[walk.steady][:, SEGMENT[name]], axis=-1)
        assert slow < np.percentile(fastest, 95) < fast, name


def test_a_loaded_foot_does_not_creep(walk):
    for side in ("left", "right"):
        ball = walk.position[:, SEGMENT[f"{side}_toes"]]
        creep = np.linalg.norm(walk.velocity[:, SEGMENT[f"{side}_toes"], :2], axis=-1)
        loaded = ball[:, 2] < ball[:, 2].min() + 1e-4
        assert loaded.mean() > 0.4
        assert np.percentile(creep[loaded], 95) < 0.05


def test_one_foot_is_always_on_the_floor_and_none_below(walk):
    toes = walk.position[:, [SEGMENT["left_toes"], SEGMENT["right_toes"]], 2]
    ankles = walk.position[:, [SEGMENT["left_foot"], SEGMENT["right_foot"]], 2]
    resting_toes, resting_ankle = toes[0].min(), ankles[0].min()
    assert toes.min() > resting_toes - 0.002
    down = (toes < resting_toes + 0.002) | (ankles < resting_ankle + 0.012)
    assert down.any(-1).all()


def test_the_walk_begins_and_ends_at_rest(walk):
    assert np.abs(walk.velocity[[0, -1]]).max() < 0.1
    assert walk.position[-1, 0, 0] == pytest.approx(6.0, abs=0.03)
