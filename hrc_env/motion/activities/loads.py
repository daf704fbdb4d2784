"""Handling of loads: picking up, setting down, receiving and handing over.

Setting down is picking up in reverse. In recorded lifts, the pelvis is 0.57 to 1.01 m high, and the
maximum speed of the wrists is 1.3 m/s in the median trial.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Vector3
from hrc_env.motion import controls as c
from hrc_env.motion.activities import planning as to
from hrc_env.motion.activities.planning import scale_draw
from hrc_env.motion.activities.work import get_down
from hrc_env.motion.anatomy import LEFT, SIDE_STRIDE, STAND_Z, UPPER_ARM
from hrc_env.motion.curves import hump, min_jerk, shift, wrap
from hrc_env.motion.holding import GRIPS, grip, place_load, take_load
from hrc_env.motion.kinematics import pose
from hrc_env.motion.posture import lean, locate_ahead, look_at, stand
from hrc_env.motion.state import Worker
from hrc_env.worker.props import PROP_NAMES
from hrc_env.world import AWAY_M

BOX = PROP_NAMES.index("box")
BOARD = PROP_NAMES.index("board")
BOX_AHEAD_M = 0.37
"""Distance of a held box ahead of the root [m]. The value is an estimate."""
BOX_HEIGHT = 1.10
"""Height of a held box, as a multiple of pelvis height. The value is an estimate."""
BOARD_AHEAD_M = 0.27
"""Distance of a held board ahead of the root [m]. The value is an estimate."""
BOARD_HEIGHT = 0.96
"""Height of a held board, as a multiple of pelvis height. The value is an estimate."""
GIVEN_AHEAD_M = 0.60
"""Distance ahead of the root of a load that is handed over [m]. The value is an estimate."""
GIVEN_HEIGHT = 1.14
"""Height of a load that is handed over, as a multiple of pelvis height.

The value is an estimate.
"""
CARRYING_SHARE = 0.95
"""Maximum extension of carrying arms, as a fraction of their length.

The value is an estimate; the difference from 1 is a reserve for the swinging trunk.
"""
ON_SHOULDER_M = (0.12, 0.165, 0.075)
"""Position of a board on the shoulder [m]: ahead of and beside the root, above the shoulder."""
STEADY_M = 0.26
"""Distance of the steadying hand from the middle of a board on the shoulder [m].

The value is an estimate.
"""
NOSE_UP_RAD = 0.08
"""Pitch of a board on the shoulder, with its front end up [rad]. The value is an estimate."""
CROUCH_M = 0.15
"""Height of a load that is gripped in a full squat [m]. The value is an estimate."""
BENT_M = 0.45
"""Height of a load that is gripped by bending the trunk only [m]. The value is an estimate."""
GAZE_PAST_M = 0.35
"""Distance from a load to the point beyond it at which a squatting worker looks [m]."""
GRIP_S = 0.3
"""Time to grip a load [s]."""
SHOULDER_S = 1.0
"""Time to move a load from in front of the body to the shoulder [s]."""


@kernel
def pick_up(t: float, worker: Worker) -> None:
    """Add picking up a load to the pose of a standing worker: bend down, grip and raise it.

    Args:
        t: time since the activity began [s].
        worker: record with the plan; its `q`, a relaxed stance, is changed.
    """
    q, yaw = worker.q, worker.start_yaw
    gripped = worker.out_at + worker.out_s
    rise = gripped + GRIP_S
    down = min_jerk((t - worker.out_at) / worker.out_s)
    up = min_jerk((t - rise) / worker.raise_s)
    onto = t - rise - worker.raise_s
    turned = min_jerk(onto / worker.shoulder_s) if worker.shoulder_s > 0.0 else 0.0
    get_down(down - up, worker)
    lean(worker.lean * (down - up), worker.squat, 0.0, worker)
    look_at(worker.gaze[0], worker.gaze[1], worker.gaze[2], down - up, worker)
    place_load(worker.start_x, worker.start_y, yaw, 0.0, worker)
    for i in range(6):
        at, mid = worker.tool_pose[i], worker.midway[i]
        q[c.PROP_POSE + i] = at + up * (mid - at) + turned * (q[c.PROP_POSE + i] - mid)
    shift(q, c.PROP_POSE, yaw, 0.06 * hump(up) + 0.15 * hump(turned), 0.0)
    q[c.PROP_POSE + 2] += 0.10 * hump(turned)
    prop = worker.tool
    q[c.PROP] = prop if t >= gripped or not worker.is_hidden else 0.0
    for side in range(2):
        here, carried = GRIPS[prop, side], worker.load_grip[3 * side : 3 * side + 3]
        x, y = here[0] + turned * (carried[0] - here[0]), here[1] + turned * (carried[1] - here[1])
        grip(side, x, y, here[2] + turned * (carried[2] - here[2]), worker)
        used = 1.0 + turned * (worker.load_used[side] - 1.0)
        q[c.HAND_SHARE + side] = down * used


@kernel
def plan_pick_up(
    draws: Floats, height: float, prop: int, on_shoulder: bool, worker: Worker
) -> float:
    """Plan to pick up a box or board.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        height: height of the grips [m]; 0 for a random height.
        prop: kind of the load, an index into `PROPS`.
        on_shoulder: whether to carry a board on the shoulder.
        worker: record into which the plan is written.

    Returns:
        The time in which the load is raised by a metre [s].
    """
    _plan_carrying(prop, on_shoulder and prop == BOARD, to.choose_hand(draws[0], worker), worker)
    z = height if height > 0.0 else scale_draw(draws[1], 0.18, 0.45)
    _plan_load_place(prop, Vector3(AWAY_M, 0.0, z), worker)
    return scale_draw(draws[2], 1.0, 1.35)


@kernel
def plan_receive(draws: Floats, height: float, worker: Worker) -> float:
    """Plan to receive a box that another person holds out.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        height: height of the box [m]; 0 for the usual height.
        worker: record into which the plan is written.

    Returns:
        The time in which the load is raised by a metre [s].
    """
    _plan_carrying(BOX, False, 1, worker)
    _plan_load_place(BOX, _find_handover_point(height, worker), worker)
    worker.is_hidden = True
    return scale_draw(draws[2], 0.9, 1.1)


@kernel
def plan_set_down(draws: Floats, height: float, worker: Worker) -> float:
    """Plan to set down the held load.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        height: height of the grips at rest [m]; 0 for a random height.
        worker: record into which the plan is written.

    Returns:
        The time in which the load is raised by a metre [s].
    """
    z = height if height > 0.0 else scale_draw(draws[1], 0.18, 0.45)
    _plan_load_place(worker.load_prop, Vector3(AWAY_M, 0.0, z), worker)
    return scale_draw(draws[2], 1.0, 1.35)


@kernel
def plan_hand_over(draws: Floats, height: float, worker: Worker) -> float:
    """Plan to hold out the load until another person takes it.

    Args:
        draws: uniform random numbers (N_START,) in [0, 1).
        height: height of the load [m]; 0 for the usual height.
        worker: record into which the plan is written.

    Returns:
        The time in which the load is raised by a metre [s].
    """
    _plan_load_place(worker.load_prop, _find_handover_point(height, worker), worker)
    worker.is_hidden = True
    return scale_draw(draws[2], 0.9, 1.1)


@kernel
def _find_handover_point(height: float, worker: Worker) -> Vector3:
    """Return the position of a handover relative to the worker: ahead, to the left, height [m]."""
    usual = GIVEN_HEIGHT * worker.lengths[STAND_Z]
    return Vector3(GIVEN_AHEAD_M, 0.0, height if height > 0.0 else usual)


@kernel
def _plan_carrying(prop: int, on_shoulder: bool, side: int, worker: Worker) -> None:
    """Plan the pose and grips of a carried load.

    Args:
        prop: kind of the load, an index into `PROPS`.
        on_shoulder: whether the load is carried on a shoulder.
        side: side of the shoulder, 0 left, 1 right.
        worker: record of the worker; its `load_...` fields are written.
    """
    at = worker.load_at
    take_load(prop, worker)
    ahead = BOX_AHEAD_M if prop == BOX else BOARD_AHEAD_M
    share = BOX_HEIGHT if prop == BOX else BOARD_HEIGHT
    forward, aside, up = to.locate_shoulders(worker)
    lowest = up - to.measure_reach(
        CARRYING_SHARE, ahead - forward, GRIPS[prop, 0, 1] - aside, worker
    )
    at[0], at[2] = ahead, max(share * worker.lengths[STAND_Z], lowest)
    if not on_shoulder:
        return
    stand(worker.start_x, worker.start_y, worker.start_yaw, 0.0, worker)
    pose(worker)
    upper = LEFT + SIDE_STRIDE * side + UPPER_ARM
    at[0], at[1] = ON_SHOULDER_M[0], (1.0 - 2.0 * side) * ON_SHOULDER_M[1]
    at[2] = worker.p[upper, 2] + ON_SHOULDER_M[2]
    sign = 1.0 - 2.0 * side  # the end at the other hand points forward
    at[3], at[5] = 0.5 * math.pi * sign, -NOSE_UP_RAD * sign
    worker.load_used[1 - side] = 0.0
    worker.load_grip[3 * side + 1] = -STEADY_M * sign


@kernel
def _plan_load_place(prop: int, at: Vector3, worker: Worker) -> None:
    """Plan the position of a load at rest.

    Args:
        prop: kind of the load, an index into `PROPS`.
        at: position relative to the worker: ahead, to the left, height [m].
        worker: record into which the plan is written.
    """
    to.clear_plan(worker)
    to.plan_tool(prop, 1, at, Vector3(0.0, 0.0, 0.0), worker)
    to.plan_gaze(at, worker)


@kernel
def plan_load_pose(pose_world: Floats, worker: Worker) -> None:
    """Plan to pick up or lay down the load at a pose (6,) in the world frame."""
    for i in range(6):
        worker.tool_pose[i] = pose_world[i]
    worker.tool_pose[3] = worker.start_yaw + wrap(pose_world[3] - worker.start_yaw)
    for i in range(3):
        worker.gaze[i] = pose_world[i]


@kernel
def finish_lift(raise_s: float, worker: Worker) -> float:
    """Complete the plan of handling a load by its path, the lean of the trunk and durations.

    Args:
        raise_s: time in which the load is raised by a metre [s].
        worker: record into which the plan is written.

    Returns:
        The duration [s].
    """
    size, z = worker.lengths, worker.tool_pose[2]
    low = min(max((size[STAND_Z] - z) / 0.6, 0.0), 1.0)
    worker.crouch = min(max((BENT_M - z) / (BENT_M - CROUCH_M), 0.0), 1.0)
    worker.squat = worker.squat_share * low * (1.0 - worker.crouch)
    shift(worker.gaze, 0, worker.start_yaw, GAZE_PAST_M * worker.crouch, 0.0)
    to.find_lean(worker)
    shoulder = worker.load_at[3] != 0.0
    mid_z = 1.15 * size[STAND_Z] if shoulder else worker.load_at[2]
    ahead = 0.36 if shoulder else worker.load_at[0]
    worker.midway[0], worker.midway[1], worker.midway[2] = locate_ahead(ahead, 0.0, mid_z, worker)
    worker.midway[3] = worker.start_yaw
    way = abs(mid_z - z)
    worker.raise_s = max(raise_s * (0.50 + 0.48 * way), 0.6)
    worker.out_s = max(raise_s * (0.7 + 0.35 * low), 0.7)
    worker.shoulder_s = SHOULDER_S if shoulder else 0.0
    worker.total_s = (
        worker.out_at + worker.out_s + GRIP_S + worker.raise_s + worker.shoulder_s + 0.1
    )
    return worker.total_s
