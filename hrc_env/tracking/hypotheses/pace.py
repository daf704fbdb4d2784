"""How vigorously a body turns, tips over and travels: what one view shows of that is less sure.

The motion model is that of people who walk and work. With one view, who spins, falls or runs is
farther from the estimate than the Gaussian says: the depth of joints is told by how the body is
turned, and that is found late. `widening` says by how much.
"""

import math

from hrc_env.core.kernels import kernel

LASTS_S = 0.7
"""Time constant of these means [s]."""
MOST_RAD_S = 15.0
"""No person turns faster."""
TURNS, TIPS, TRAVELS = (2.3, 1.1), (0.52, 5.0), (1.63, 1.1)
"""Rates up to which the model is right, and the logarithm of the factor on the covariance for every
unit above them [1/(rad/s)], [1/(m/s)]; fitted to people who walk, spin, fall, tumble and run."""
MOST_MOVING, MOST = 10.5, 25.0
"""Greatest factor for the movement, and together with that for a body that lies."""


@kernel
def update_pace(pace, body, dt):
    """Take the present body (J, 6), `dt` after the last one, into the means."""
    ax, ay = _across(body, 0), _across(body, 1)
    ux, uy, uz = _trunk(body, 0), _trunk(body, 1), _trunk(body, 2)
    flat, length = math.hypot(ax, ay) + 1e-9, math.sqrt(ux * ux + uy * uy + uz * uz) + 1e-9
    ax, ay, ux, uy, uz = ax / flat, ay / flat, ux / length, uy / length, uz / length
    if pace.known and dt > 0.0:
        turned = abs(
            math.atan2(
                pace.across[0] * ay - pace.across[1] * ax, pace.across[0] * ax + pace.across[1] * ay
            )
        )
        cosine = pace.up[0] * ux + pace.up[1] * uy + pace.up[2] * uz
        tipped = math.acos(min(max(cosine, -1.0), 1.0))
        keep = math.exp(-dt / LASTS_S)
        pace.turns = _mean(pace.turns, turned / dt, keep)
        pace.tips = _mean(pace.tips, tipped / dt, keep)
        speed = math.sqrt(_speed(body, 3) ** 2 + _speed(body, 4) ** 2 + _speed(body, 5) ** 2)
        pace.travels = _mean(pace.travels, speed, keep)
    pace.across[0], pace.across[1] = ax, ay
    pace.up[0], pace.up[1], pace.up[2] = ux, uy, uz
    pace.known = True


@kernel
def forget_pace(pace):
    """Begin with a worker anew."""
    pace.known, pace.since_s = False, 0.0
    pace.turns = pace.tips = pace.travels = 0.0


@kernel
def widening(pace):
    """The factor on the covariance of a worker whom one camera alone sees."""
    log = TURNS[1] * max(pace.turns - TURNS[0], 0.0)
    log += TIPS[1] * max(pace.tips - TIPS[0], 0.0)
    log += TRAVELS[1] * max(pace.travels - TRAVELS[0], 0.0)
    return min(math.exp(log), MOST_MOVING)


@kernel
def _mean(before, rate, keep):
    return keep * before + (1.0 - keep) * min(rate, MOST_RAD_S)


@kernel
def _across(body, i):
    return body[1, i] + body[7, i] - body[2, i] - body[8, i]


@kernel
def _trunk(body, i):
    return body[1, i] + body[2, i] - body[7, i] - body[8, i]


@kernel
def _speed(body, i):
    return 0.25 * (body[1, i] + body[2, i] + body[7, i] + body[8, i])
