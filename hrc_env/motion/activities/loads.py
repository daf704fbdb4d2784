"""Loads: picked up and set down (that backwards), taken from somebody and handed over.

Recorded lifts: pelvis 0.57 to 1.01 m high, wrists at 1.3 m/s at most in the median trial.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.activities import planning as to
from hrc_env.motion.activities.planning import between
from hrc_env.motion.activities.work import get_down
from hrc_env.motion.anatomy import LEFT, SIDE_STRIDE, STAND_Z, UPPER_ARM
from hrc_env.motion.curves import hump, min_jerk, shift, wrap
from hrc_env.motion.holding import GRIPS, grip, place_load, take_load
from hrc_env.motion.kinematics import pose
from hrc_env.motion.posture import from_here, lean, look_at, stand
from hrc_env.motion.state import Triple, Worker
from hrc_env.worker.props import PROP_NAMES
from hrc_env.world import AWAY_M

BOX, BOARD = PROP_NAMES.index("box"), PROP_NAMES.index("board")
BOX_HELD, BOARD_HELD, GIVEN = (0.37, 1.10), (0.27, 0.96), (0.60, 1.14)
"""A load's middle when held or handed over: ahead [m], height in the pelvis's; judgement."""
CARRYING_SHARE = 0.95
"""Arms carry stretched to this share at most: swinging trunks need the rest; judgement."""
ON_SHOULDER, STEADY_M, NOSE_UP_RAD = (0.12, 0.165, 0.075), 0.26, 0.08
"""A board on the shoulder: ahead and aside of the root, above the shoulder's joint [m]; the hand
that steadies it: ahead of the root [m]; how much its front is higher; judgement."""
CROUCH_M = (0.15, 0.45)
"""A load at this height is gripped on the haunches; at that one, bent [m]; judgement."""
GAZE_PAST_M = 0.35
"""Who is on the haunches looks past the load, over which their head is [m]."""
GRIP_S, SHOULDER_S = 0.3, 1.0
"""To grip; from before the body to the shoulder [s]."""


@kernel
def pick_up(t: float, me: Worker) -> None:
    """Let a standing q bend down to a load, grip it and come up with it."""
    q, yaw = me.q, me.start_yaw
    gripped = me.out_at + me.out_s
    rise = gripped + GRIP_S
    down = min_jerk((t - me.out_at) / me.out_s)
    up = min_jerk((t - rise) / me.raise_s)
    onto = t - rise - me.raise_s
    turned = min_jerk(onto / me.shoulder_s) if me.shoulder_s > 0.0 else 0.0
    get_down(down - up, me)
    lean(me.lean * (down - up), me.squat, 0.0, me)
    look_at(me.gaze[0], me.gaze[1], me.gaze[2], down - up, me)
    place_load(me.start_x, me.start_y, yaw, 0.0, me)
    for i in range(6):
        at, mid = me.tool_pose[i], me.midway[i]
        q[c.PROP_POSE + i] = at + up * (mid - at) + turned * (q[c.PROP_POSE + i] - mid)
    shift(q, c.PROP_POSE, yaw, 0.06 * hump(up) + 0.15 * hump(turned), 0.0)
    q[c.PROP_POSE + 2] += 0.10 * hump(turned)
    prop = me.tool
    q[c.PROP] = prop if t >= gripped or me.hidden == 0.0 else 0.0
    for side in range(2):
        here, own = GRIPS[prop, side], me.load_grip[3 * side : 3 * side + 3]
        x, y = here[0] + turned * (own[0] - here[0]), here[1] + turned * (own[1] - here[1])
        grip(side, x, y, here[2] + turned * (own[2] - here[2]), me)
        used = 1.0 + turned * (me.load_used[side] - 1.0)
        q[c.HAND_SHARE + side] = down * used


@kernel
def plan_pick_up(draws: Floats, height: float, prop: int, on_shoulder: bool, me: Worker) -> float:
    """Plan to pick a box or board up, gripped at the height; its pace [s]."""
    _hold(prop, on_shoulder and prop == BOARD, to.dominant(draws[0], me), me)
    z = height if height > 0.0 else between(draws[1], 0.18, 0.45)
    _lay_out(prop, (AWAY_M, 0.0, z), me)
    return between(draws[2], 1.0, 1.35)


@kernel
def plan_receive(draws: Floats, height: float, me: Worker) -> float:
    """Plan to take a box that somebody ahead holds out; its pace [s]."""
    _hold(BOX, False, 1, me)
    _lay_out(BOX, _given(height, me), me)
    me.hidden = 1.0
    return between(draws[2], 0.9, 1.1)


@kernel
def plan_set_down(draws: Floats, height: float, me: Worker) -> float:
    """Plan to set down what is held, onto the height; its pace [s]."""
    z = height if height > 0.0 else between(draws[1], 0.18, 0.45)
    _lay_out(me.load_prop, (AWAY_M, 0.0, z), me)
    return between(draws[2], 1.0, 1.35)


@kernel
def plan_hand_over(draws: Floats, height: float, me: Worker) -> float:
    """Plan to hold out what is carried until somebody has it; its pace [s]."""
    _lay_out(me.load_prop, _given(height, me), me)
    me.hidden = 1.0
    return between(draws[2], 0.9, 1.1)


@kernel
def _given(height: float, me: Worker) -> Triple:
    """Where loads change hands."""
    return GIVEN[0], 0.0, height if height > 0.0 else GIVEN[1] * me.size[STAND_Z]


@kernel
def _hold(prop: int, on_shoulder: bool, side: int, me: Worker) -> None:
    """Write how a load will be carried into `load_at` and on."""
    at = me.load_at
    take_load(prop, me)
    ahead, share = BOX_HELD if prop == BOX else BOARD_HELD
    forward, aside, up = to.shoulders(me)
    lowest = up - to.in_reach(CARRYING_SHARE, ahead - forward, GRIPS[prop, 0, 1] - aside, me)
    at[0], at[2] = ahead, max(share * me.size[STAND_Z], lowest)
    if not on_shoulder:
        return
    stand(me.start_x, me.start_y, me.start_yaw, 0.0, me)
    pose(me)
    upper = LEFT + SIDE_STRIDE * side + UPPER_ARM
    at[0], at[1] = ON_SHOULDER[0], (1.0 - 2.0 * side) * ON_SHOULDER[1]
    at[2] = me.p[upper, 2] + ON_SHOULDER[2]
    sign = 1.0 - 2.0 * side  # the end of the other hand comes to the front
    at[3], at[5] = 0.5 * math.pi * sign, -NOSE_UP_RAD * sign
    me.load_used[1 - side] = 0.0
    me.load_grip[3 * side + 1] = -STEADY_M * sign


@kernel
def _lay_out(prop: int, at: Triple, me: Worker) -> None:
    """Plan where the load stands: ahead, left [m], height."""
    to.blank(me)
    to.put_tool(prop, 1, at, (0.0, 0.0, 0.0), me)
    to.look_to(at, me)


@kernel
def put_load(pose_: Floats, me: Worker) -> None:
    """Plan that the load that is taken up or laid down is at a pose (6,) then."""
    for i in range(6):
        me.tool_pose[i] = pose_[i]
    me.tool_pose[3] = me.start_yaw + wrap(pose_[3] - me.start_yaw)
    for i in range(3):
        me.gaze[i] = pose_[i]


@kernel
def finish_lift(raise_s: float, me: Worker) -> float:
    """Settle trunk, way and times of a load; from the time to raise it by a metre, how long [s]."""
    size, z = me.size, me.tool_pose[2]
    low = min(max((size[STAND_Z] - z) / 0.6, 0.0), 1.0)
    me.crouch = min(max((CROUCH_M[1] - z) / (CROUCH_M[1] - CROUCH_M[0]), 0.0), 1.0)
    me.squat = me.squat_share * low * (1.0 - me.crouch)
    shift(me.gaze, 0, me.start_yaw, GAZE_PAST_M * me.crouch, 0.0)
    to.settle_lean(me)
    shoulder = me.load_at[3] != 0.0
    mid_z = 1.15 * size[STAND_Z] if shoulder else me.load_at[2]
    ahead = 0.36 if shoulder else me.load_at[0]
    me.midway[0], me.midway[1], me.midway[2] = from_here((ahead, 0.0, mid_z), me)
    me.midway[3] = me.start_yaw
    way = abs(mid_z - z)
    me.raise_s = max(raise_s * (0.50 + 0.48 * way), 0.6)
    me.out_s = max(raise_s * (0.7 + 0.35 * low), 0.7)
    me.shoulder_s = SHOULDER_S if shoulder else 0.0
    me.lasts = me.out_at + me.out_s + GRIP_S + me.raise_s + me.shoulder_s + 0.1
    return me.lasts
