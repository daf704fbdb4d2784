"""Where a worker's body goes for work in place: onto a knee, onto the haunches, forward."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.worker import Worker
from hrc_env.motion.anatomy import ANKLE_Z, LEG, STAND_SHARE, STAND_Z, THIGH_LENGTH
from hrc_env.motion.feet import raise_heel

KNEE_M = 0.055
"""Height of a kneeling knee's joint above the floor [m]; half a knee."""
KNEEL_HEEL_RAD, HAUNCH_HEEL_RAD = 1.2, 0.55
"""How far the heel goes up of a kneeling foot, of both on the haunches; judgement."""
FRONT_LEG, REAR_LEG = 0.38, -0.72
"""Kneeling feet ahead of where they stood, in lengths of the leg; from the two shanks' lie."""
HAUNCH_SHARE = 0.46
"""Height of the pelvis on the haunches as a share of the standing one; judgement."""
STEP_AT_S, STEP_PERIOD_S, STEP_SWING_S = 0.08, 0.42, 0.38
"""First lift-off, and the two times of `plans` of the steps that widen a stance [s]."""


@kernel
def get_down(down: float, plan: Floats, size: Floats, q: Floats) -> None:
    """Lower a standing body by the share `down`, heels included; the feet's steps are planned."""
    ahead = plan[pl.AHEAD] * down
    q[c.ROOT_X] += math.cos(q[c.HEADING]) * ahead
    q[c.ROOT_Y] += math.sin(q[c.HEADING]) * ahead
    kneel, crouch = plan[pl.KNEEL] * down, plan[pl.CROUCH] * down
    if kneel > 0.0:
        over = size[STAND_Z] - size[ANKLE_Z] - STAND_SHARE * size[LEG]
        low = KNEE_M + size[THIGH_LENGTH] + over
        q[c.PELVIS_Z] += kneel * (low - size[STAND_Z])
        q[c.PELVIS_PITCH] += 0.06 * kneel
        raise_heel(int(plan[pl.STEP_FIRST]), KNEEL_HEEL_RAD * kneel * kneel, size, q)
    if crouch > 0.0:
        q[c.PELVIS_Z] -= crouch * (1.0 - HAUNCH_SHARE) * size[STAND_Z]
        q[c.PELVIS_PITCH] += 0.25 * crouch
        q[c.SPINE_FLEX] += 0.40 * crouch
        for side in range(2):
            raise_heel(side, HAUNCH_HEEL_RAD * crouch, size, q)


@kernel
def step_into(first: int, ahead: float, other: float, out: float, me: Worker) -> None:
    """Plan one step of foot `first` (and one of the other, unless 0) that the end goes back.

    Args:
        first: 0 left, 1 right.
        ahead: how far that foot goes forward [m].
        other: how far the other one goes.
        out: how far both go sideways, apart [m].
        me: its plan's START stands.
    """
    plan = me.plan
    cos, sin = math.cos(plan[pl.START_YAW]), math.sin(plan[pl.START_YAW])
    plan[pl.STEP_START], plan[pl.STEP_FIRST] = STEP_AT_S, first
    plan[pl.STEP_PERIOD], plan[pl.STEP_SWING] = STEP_PERIOD_S, STEP_SWING_S
    plan[pl.STEP_COUNT] = 1.0 if other == 0.0 else 2.0
    for k in range(2):
        side = (first + k) % 2
        forward, left = (other if k else ahead), (1.0 - 2.0 * side) * out
        for i in range(5):
            me.prints[k, i] = me.stance[side, i]
        me.prints[k, 0] += cos * forward - sin * left
        me.prints[k, 1] += sin * forward + cos * left
        me.prints[k, 3] = 0.3
