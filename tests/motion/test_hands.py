"""Reaching and lifting."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recorded import started, watched

from hrc_env.core.batching import one
from hrc_env.motion import controls as c
from hrc_env.motion import generator
from hrc_env.motion import plans as pl
from hrc_env.motion.anatomy import GRIP_M
from hrc_env.motion.feet import foot
from hrc_env.motion.hands import plan_lift, plan_reach
from hrc_env.motion.kinematics import N_FRAMES, N_POINTS
from hrc_env.worker.body import SEGMENT

STATE, RNGS = started(1, config=generator.MotionConfig(near_probability=1.0))


def worker(activity, planner, *arguments):
    """A worker at (0.4, 0) facing the robot, who has just begun to reach or lift."""
    state = STATE
    plan, prints, stance = state.plan[0, 0], state.prints[0, 0], state.stance[0, 0]
    bones = one(state.anatomy, 0)
    plan[:] = 0.0
    plan[pl.STEP_PERIOD], plan[pl.STEP_SWING] = 1.0, 0.5
    plan[pl.START_X] = plan[pl.END_X] = 0.4
    plan[pl.START_YAW] = plan[pl.END_YAW] = np.pi
    plan[pl.OUT_AT] = 0.2
    stance[:, :3] = [(0.4, -0.1, np.pi), (0.4, 0.1, np.pi)]
    q, p, r = np.zeros(c.N_CONTROLS), np.zeros((N_POINTS, 3)), np.zeros((N_FRAMES, 3, 3))
    for side in range(2):
        foot(0.0, side, plan, prints, stance, bones.size, q)
    constants = (plan, state.traits[0, 0], bones.offset, bones.frame, bones.size, q, p, r)
    lasts = planner(*arguments, *constants)
    state.activity[:], state.time_s[:], state.clock_s[:] = activity, 0.0, 0.0
    state.duration_s[:], state.offset[:] = lasts, 0.0
    return state, plan


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
    target = (0.4 - ahead, -left, z)
    used = (0.0, 1.0) if right else (1.0, 0.0)
    state, plan = worker(pl.REACH, plan_reach, target, used, 1.0, 1.0, (0.0, 1.0))
    out = float(plan[pl.OUT_AT] + plan[pl.OUT_S] + 0.5)
    motion = watched(state, RNGS, out, 1)
    assert np.linalg.norm(grips(motion)[0, 0, int(right)] - target) < 0.03


def test_the_trunk_leans_only_as_far_as_the_arm_falls_short():
    leans = []
    for ahead in (0.4, 0.65, 0.8):
        _, plan = worker(
            pl.REACH, plan_reach, (0.4 - ahead, 0.1, 1.1), (0.0, 1.0), 1.0, 1.0, (0.0, 1.0)
        )
        leans.append(plan[pl.LEAN])
    assert leans[0] == 0.0
    assert 0.0 < leans[1] < leans[2]


def test_a_target_out_of_reach_is_approached_not_torn_at():
    state, plan = worker(pl.REACH, plan_reach, (-1.5, 0.0, 1.1), (0.0, 1.0), 1.0, 1.0, (0.0, 1.0))
    motion = watched(state, RNGS, 0.02, 150)
    assert np.isfinite(motion.position_world).all()
    assert plan[pl.TARGET + 3] > -1.2


@pytest.mark.parametrize("peak_m_s", [0.5, 1.0, 1.5, 2.5])
def test_a_hand_is_about_as_fast_as_was_drawn(peak_m_s):
    state, plan = worker(
        pl.REACH, plan_reach, (-0.2, 0.1, 1.2), (0.0, 1.0), peak_m_s, 0.5, (0.0, 1.0)
    )
    motion = watched(state, RNGS, 0.005, int((plan[pl.OUT_S] + 0.4) / 0.005))
    hand = np.linalg.norm(motion.velocity_world[0, :, 0, SEGMENT["right_hand"]], axis=-1)
    assert hand.max() == pytest.approx(peak_m_s, rel=0.3)


def test_feet_stay_where_they_are_while_hands_work():
    state, _ = worker(pl.REACH, plan_reach, (-0.3, 0.0, 0.9), (1.0, 1.0), 1.2, 0.5, (0.02, 1.0))
    feet = [SEGMENT[f"{side}_{part}"] for side in ("left", "right") for part in ("foot", "toes")]
    motion = watched(state, RNGS, 0.02, 100)
    assert np.abs(motion.velocity_world[..., feet, :]).max() < 1e-6


@pytest.mark.parametrize("squat", [0.4, 1.0])
def test_a_load_is_gripped_raised_and_put_back(squat):
    STATE.traits[..., pl.SQUAT_TRAIT] = squat
    state, plan = worker(pl.LIFT, plan_lift, 0.42, 0.3, (1.2, 1.2, 0.5))
    motion = watched(state, RNGS, 0.01, int(state.duration_s[0, 0] / 0.01) - 1)
    hands = grips(motion)[0]
    gripping = int((plan[pl.OUT_AT] + plan[pl.OUT_S] + 0.1) / 0.01)
    assert np.abs(hands[gripping, :, 2] - 0.3).max() < 0.03
    assert hands[..., 2].max() > 1.0
    assert 0.45 < motion.position_world[0, :, 0, 0, 2].min() < 0.85
    assert np.abs(hands[-1] - hands[0]).max() < 0.15  # hanging again
