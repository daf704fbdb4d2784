"""Reaching and lifting."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recorded import begin, standing, started, watched

from hrc_env.core.typing import Vector3
from hrc_env.motion import generator
from hrc_env.motion import state as ws
from hrc_env.motion.anatomy import GRIP_M
from hrc_env.motion.feet import place_foot
from hrc_env.motion.hands import LiftTimes, plan_lift, plan_reach
from hrc_env.motion.points import Sides
from hrc_env.worker.body import SEGMENT

RIGHT = Sides(0.0, 1.0)

STATE, RNGS = started(1, config=generator.MotionConfig(near_probability=1.0))


def worker(activity, planner, *arguments):
    """A worker at (0.4, 0) facing the robot, who has just begun to reach or lift."""
    me = standing(STATE, 0.4, np.pi)
    me["out_at"] = 0.2
    place_foot(0.0, 0, me["footprints"], me["stance"], me)
    place_foot(0.0, 1, me["footprints"], me["stance"], me)
    begin(me, activity, planner(*arguments, me))
    me["clock_s"] = 0.0
    return STATE, me


def grips(motion):
    """(..., 2, 3) where the hands grip: beyond the wrist along the forearm."""
    position = motion.position_world[..., 0, :, :]
    both = []
    for side in ("left", "right"):
        wrist = position[..., SEGMENT[f"{side}_hand"], :]
        along = wrist - position[..., SEGMENT[f"{side}_forearm"], :]
        both.append(wrist + GRIP_M * along / np.linalg.norm(along, axis=-1, keepdims=True))
    return np.stack(both, -2)


@settings(max_examples=25, deadline=None)
@given(
    ahead=st.floats(0.36, 0.75), left=st.floats(-0.25, 0.25), z=st.floats(0.85, 1.4),
    right=st.booleans(),
)  # fmt: skip
def test_a_hand_comes_to_where_it_was_sent(ahead, left, z, right):
    target = Vector3(0.4 - ahead, -left, z)
    used = RIGHT if right else Sides(1.0, 0.0)
    state, plan = worker(ws.REACH, plan_reach, target, used, 1.0, 1.0, 0.0, 1.0)
    out = float(plan["out_at"] + plan["out_s"] + 0.5)
    motion = watched(state, RNGS, out, 1)
    assert np.linalg.norm(grips(motion)[0, 0, int(right)] - target) < 0.03


def test_the_trunk_leans_only_as_far_as_the_arm_falls_short():
    leans = []
    for ahead in (0.4, 0.65, 0.8):
        _, plan = worker(
            ws.REACH, plan_reach, Vector3(0.4 - ahead, 0.1, 1.1), RIGHT, 1.0, 1.0, 0.0, 1.0
        )
        leans.append(plan["lean"])
    assert leans[0] == 0.0
    assert 0.0 < leans[1] < leans[2]


def test_a_target_out_of_reach_is_approached_not_torn_at():
    state, plan = worker(ws.REACH, plan_reach, Vector3(-1.5, 0.0, 1.1), RIGHT, 1.0, 1.0, 0.0, 1.0)
    motion = watched(state, RNGS, 0.02, 150)
    assert np.isfinite(motion.position_world).all()
    assert plan["target"][3] > -1.2


@pytest.mark.parametrize("peak_m_s", [0.5, 1.0, 1.5, 2.5])
def test_a_hand_is_about_as_fast_as_was_drawn(peak_m_s):
    state, plan = worker(
        ws.REACH, plan_reach, Vector3(-0.2, 0.1, 1.2), RIGHT, peak_m_s, 0.5, 0.0, 1.0
    )
    motion = watched(state, RNGS, 0.005, int((plan["out_s"] + 0.4) / 0.005))
    hand = np.linalg.norm(motion.velocity_world[0, :, 0, SEGMENT["right_hand"]], axis=-1)
    assert hand.max() == pytest.approx(peak_m_s, rel=0.3)


def test_feet_stay_where_they_are_while_hands_work():
    state, _ = worker(
        ws.REACH, plan_reach, Vector3(-0.3, 0.0, 0.9), Sides(1.0, 1.0), 1.2, 0.5, 0.02, 1.0
    )
    feet = [SEGMENT[f"{side}_{part}"] for side in ("left", "right") for part in ("foot", "toes")]
    motion = watched(state, RNGS, 0.02, 100)
    assert np.abs(motion.velocity_world[..., feet, :]).max() < 1e-6


@pytest.mark.parametrize("squat", [0.4, 1.0])
def test_a_load_is_gripped_raised_and_put_back(squat):
    STATE.workers["squat_share"] = squat
    state, plan = worker(ws.LIFT, plan_lift, 0.42, 0.3, LiftTimes(1.2, 1.2, 0.5))
    motion = watched(state, RNGS, 0.01, int(state.workers["duration_s"][0, 0] / 0.01) - 1)
    hands = grips(motion)[0]
    gripping = int((plan["out_at"] + plan["out_s"] + 0.1) / 0.01)
    assert np.abs(hands[gripping, :, 2] - 0.3).max() < 0.03
    assert hands[..., 2].max() > 1.0
    assert 0.45 < motion.position_world[0, :, 0, 0, 2].min() < 0.85
    assert np.abs(hands[-1] - hands[0]).max() < 0.15  # hanging again
