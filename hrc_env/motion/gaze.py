"""Where the head turns to see something."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion.anatomy import STAND_Z
from hrc_env.motion.curves import wrap

NECK_SHARE = 0.70
"""Height of the eyes above the pelvis as a share of the pelvis's; from the baked bodies."""
HEAD_SHARE = 0.75
"""The head's share of a turn of gaze, the eyes do the rest (Freedman & Sparks 1997: 70-80 %)."""
MOST_YAW_RAD, MOST_DOWN_RAD, MOST_UP_RAD = 1.2, 0.75, 0.75
"""How far neck and head turn from the chest; comfortable ranges, judgement."""


@kernel
def look_at(x: float, y: float, z: float, share: float, size: Floats, q: Floats) -> None:
    """Turn the head to a point of the world, by a share; everything but the head stands in q."""
    if share <= 0.0:
        return
    tilt = q[c.PELVIS_PITCH] + q[c.SPINE_FLEX]
    heading = q[c.HEADING] + q[c.PELVIS_YAW]
    tall = NECK_SHARE * size[STAND_Z]
    ahead = math.sin(0.6 * tilt) * tall
    dx = x - q[c.ROOT_X] - math.cos(heading) * ahead
    dy = y - q[c.ROOT_Y] - math.sin(heading) * ahead
    dz = z - q[c.PELVIS_Z] - math.cos(0.6 * tilt) * tall
    yaw = wrap(math.atan2(dy, dx) - heading - q[c.SPINE_TWIST])
    down = math.atan2(-dz, math.hypot(dx, dy)) - tilt
    limit = MOST_DOWN_RAD if down > 0.0 else MOST_UP_RAD
    yaw = MOST_YAW_RAD * math.tanh(HEAD_SHARE * yaw / MOST_YAW_RAD)
    down = limit * math.tanh(HEAD_SHARE * down / limit)
    q[c.HEAD_YAW] += share * (yaw - q[c.HEAD_YAW])
    q[c.HEAD_PITCH] += share * (down - q[c.HEAD_PITCH])
