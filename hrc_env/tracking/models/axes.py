"""How a body is turned in space: the axes in which joints have their mean places.

A trunk that leans little counts as upright, as people's are: where one view leaves open how far it
leans, that tells the depth. One that lies takes head and arms with it; the legs go with it, or hang
below it as those of who bends down, whichever they are nearer to.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import JOINT

_LEANS, _LIES = math.cos(math.radians(25.0)), math.cos(math.radians(50.0))
"""Up to the first angle a trunk is upright, from the second on it lies; judgement."""
_SHORT_M = 0.05
_KNEE, _FOOT = JOINT["left_knee"], JOINT["left_foot"]


@kernel
def leaning(body):
    """How far a trunk lies, 0 to 1, and the direction from its hips to its shoulders."""
    x, y, z = _trunk(body, 0), _trunk(body, 1), _trunk(body, 2)
    length = math.sqrt(x * x + y * y + z * z) + 1e-9
    lies = min(max((z / length - _LEANS) / (_LIES - _LEANS), 0.0), 1.0)
    return lies, (x / length, y / length, z / length)


@kernel
def _trunk(body, i):
    return body[1, i] + body[2, i] - body[7, i] - body[8, i]


@kernel
def part_of(j):
    """Which axes joint j goes by: 0 the trunk's, 1 the legs'."""
    return 1 if j >= _KNEE else 0


@kernel
def set_axes(body, root, offset, axes):
    """Fill axes (2, 3, 3), columns forward, left, up of trunk and legs; whether they are known.

    `body` is (J, 3+), `root` begins with the middle of its torso, `offset` are the joints' mean
    places (J, 3).
    """
    trunk, legs = axes[0], axes[1]
    lies, along = leaning(body)
    for i in range(3):
        legs[i, 2] = 1.0 if i == 2 else 0.0
        trunk[i, 2] = lies * along[i] + (1.0 - lies) * legs[i, 2]
    known = _turn(body, trunk)
    if not _turn(body, legs) or _legs_follow(body, root, offset, axes):
        for i in range(3):
            for k in range(3):
                legs[i, k] = trunk[i, k]
    return known


@kernel
def _turn(body, axes):
    """Make axes (3, 3) of a body that has up in the last column; whether its left is known."""
    length = along = across = 0.0
    for i in range(3):
        axes[i, 1] = body[1, i] - body[2, i] + body[7, i] - body[8, i]
        length += axes[i, 2] * axes[i, 2]
        along += axes[i, 1] * axes[i, 2]
    for i in range(3):
        axes[i, 1] -= along * axes[i, 2] / length
        axes[i, 2] /= math.sqrt(length)
        across += axes[i, 1] * axes[i, 1]
    if across < _SHORT_M * _SHORT_M:
        return False
    for i in range(3):
        axes[i, 1] /= math.sqrt(across)
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        axes[i, 0] = axes[a, 1] * axes[b, 2] - axes[b, 1] * axes[a, 2]
    return True


@kernel
def _legs_follow(body, root, offset, axes):
    """Whether knees and ankles are nearer to where the trunk's axes put them than below it."""
    difference = 0.0
    for j in range(_KNEE, _FOOT):
        for i in range(3):
            along = below = body[j, i] - root[i]
            for k in range(3):
                along -= axes[0, i, k] * offset[j, k]
                below -= axes[1, i, k] * offset[j, k]
            difference += along * along - below * below
    return difference < 0.0
