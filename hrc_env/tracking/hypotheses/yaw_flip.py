"""The other body that one camera can hardly tell from this one: turned the other way.

Seen by one camera, a line from shoulder to shoulder that recedes looks as one that comes
nearer. The other body has its shoulders and hips reflected across the ray to its middle, but
is no mirror image: it is the same body, turned, whose nose and toes are in front again. Its
uncertainty is the reflected one, because what is not known lies along the same ray.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.geometry.lines_of_sight import eye_of
from hrc_env.tracking.models.acquisition import heading
from hrc_env.tracking.tree.gaussian import multiply

_TORSO = (1, 2, 7, 8)
_LEAST_TURN = 0.35
"""Bodies that are turned by less [rad] are one hypothesis."""


@kernel(makes_arrays=True)
def turn_of(camera, body):
    """By how much [rad] the other body of `body` (J, 6) is turned; 0 if that is not known."""
    cos, sin, known = heading(body)
    if not known:
        return 0.0
    eye, x, y = eye_of(camera), 0.0, 0.0
    for j in _TORSO:
        x += 0.25 * body[j, 0]
        y += 0.25 * body[j, 1]
    # forwards is across the shoulders, so that reflecting the shoulders across the ray
    # turns it to the mirror image of its opposite
    turn = 2.0 * math.atan2(y - eye[1], x - eye[0]) - 2.0 * math.atan2(sin, cos)
    return math.atan2(math.sin(turn), math.cos(turn))


@kernel
def heads_like(one, other):
    """Whether two bodies (J, 6) are turned alike."""
    a, b = heading(one), heading(other)
    return a[0] * b[0] + a[1] * b[1] > math.cos(_LEAST_TURN)


@kernel(makes_arrays=True)
def turn_body(camera, turn, body, cov, slope):
    """Make a Gaussian (J, 6), (J, 6, 6), (J, 6, 6) the other body's, in place."""
    middle, across, speed = np.zeros(6), np.zeros(2), np.zeros(2)
    for j in _TORSO:
        for i in range(6):
            middle[i] += 0.25 * body[j, i]
    for left in (1, 7):
        for i in range(2):
            across[i] += body[left, i] - body[left + 1, i]
            speed[i] += body[left, 3 + i] - body[left + 1, 3 + i]
    rate = (across[0] * speed[1] - across[1] * speed[0]) / (across[0] ** 2 + across[1] ** 2)
    rate = min(max(rate, -4.0), 4.0)
    cos, sin = math.cos(turn), math.sin(turn)
    for j in range(len(body)):
        x, y = body[j, 0] - middle[0], body[j, 1] - middle[1]
        # relative to the body as it turns; the other one turns the other way
        vx, vy = body[j, 3] - middle[3] + rate * y, body[j, 4] - middle[4] - rate * x
        body[j, 0], body[j, 1] = middle[0] + cos * x - sin * y, middle[1] + sin * x + cos * y
        x, y = body[j, 0] - middle[0], body[j, 1] - middle[1]
        body[j, 3] = middle[3] + cos * vx - sin * vy + rate * y
        body[j, 4] = middle[4] + sin * vx + cos * vy - rate * x
    eye, mirror = eye_of(camera), np.eye(3)
    ray = middle[:3] - eye
    ray /= math.sqrt(ray[0] ** 2 + ray[1] ** 2 + ray[2] ** 2)
    for i in range(3):
        for k in range(3):
            mirror[i, k] -= 2.0 * ray[i] * ray[k]
    both = np.zeros((6, 6))
    both[:3, :3], both[3:, 3:] = mirror, mirror
    half = np.empty((6, 6))
    for j in range(len(body)):
        multiply(both, cov[j], half)
        multiply(half, both, cov[j])
        multiply(both, slope[j], half)
        multiply(half, both, slope[j])
