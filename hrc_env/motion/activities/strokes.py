"""What hands and tools do at work: strokes in bursts, moving along the work between them.

A stroke moves the tool's pose in q, and writes how far the other hand is from its target into
that hand's target (to which `work.hands_on` adds the target itself).
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.curves import min_jerk

STILL, STRIKE, BORE, PRESS, SAW, SHIFT, BUSY, JAB = range(8)
"""Nothing; a hammer's blows; a drill's thrusts, the other hand fetching screws or not; a saw's
strokes; holding still at one place after the other; the small movements of busy hands; beating
the air."""
PAUSE_S = 0.7
"""Between two bursts [s]: time to go on to the next nail; judgement."""
EASE_S = 0.25
"""In which strokes begin and end [s]."""


@kernel
def stroke(t: float, plan: Floats, q: Floats) -> None:
    """Add what the stroke does at time t of the work (0 to HOLD_S)."""
    kind, side = int(plan[pl.STROKE]), int(plan[pl.SIDE])
    other = c.HAND_TARGET + 3 * (1 - side)
    for i in range(3):
        q[other + i] = 0.0
    cycle = plan[pl.BURST_S] + PAUSE_S
    n = math.floor(t / cycle)
    u = t - n * cycle
    _wander(n, u, other, plan, q)
    ease = min_jerk(u / EASE_S) - min_jerk((u - plan[pl.BURST_S] + EASE_S) / EASE_S)
    if ease <= 0.0 or t >= plan[pl.HOLD_S]:
        return
    turn = 2.0 * math.pi * plan[pl.STROKE_HZ] * u
    if kind == STRIKE:
        _strike(ease, turn, plan, q)
    elif kind in (BORE, PRESS):
        _bore(u, plan, q)
        if kind == BORE:
            _fetch(u, other, plan, q)
    elif kind == SAW:
        _along(-ease * plan[pl.STROKE_M] * math.sin(turn), plan, q)
        q[c.SPINE_TWIST] += (1.0 - 2.0 * side) * 0.10 * ease * math.sin(turn)
    elif kind in (BUSY, JAB):
        _busy(ease, turn, other, plan, q)


@kernel
def _wander(n: int, u: float, other: int, plan: Floats, q: Floats) -> None:
    """Go to and fro along the work, a place a burst."""
    on = min_jerk((u - plan[pl.BURST_S]) / PAUSE_S)
    here = n % 2
    share = here + on * (1.0 - 2.0 * here)
    left = plan[pl.WANDER_M] * share
    x, y = -math.sin(plan[pl.START_YAW]) * left, math.cos(plan[pl.START_YAW]) * left
    q[c.PROP_POSE] += x
    q[c.PROP_POSE + 1] += y
    q[other] += x
    q[other + 1] += y


@kernel
def _along(way: float, plan: Floats, q: Floats) -> None:
    """Move the tool where it points."""
    pitch, yaw = plan[pl.TOOL_POSE + 4], plan[pl.TOOL_POSE + 3]
    q[c.PROP_POSE] += math.cos(yaw) * math.cos(pitch) * way
    q[c.PROP_POSE + 1] += math.sin(yaw) * math.cos(pitch) * way
    q[c.PROP_POSE + 2] -= math.sin(pitch) * way


@kernel
def _strike(ease: float, turn: float, plan: Floats, q: Floats) -> None:
    """Swing the hammer back slowly and forward faster, round the wrist and with the arm."""
    size = plan[pl.STROKE_M]
    skew = min(1.5 * size, 0.35)
    back = 0.5 * ease * (1.0 - math.cos(turn + skew * math.sin(turn)))
    _along(-size * back, plan, q)
    q[c.PROP_POSE + 2] += 0.35 * size * back
    out = (1.0 - 2.0 * plan[pl.SIDE]) * 0.6 * size * back  # past the shoulder
    q[c.PROP_POSE] -= math.sin(plan[pl.START_YAW]) * out
    q[c.PROP_POSE + 1] += math.cos(plan[pl.START_YAW]) * out
    q[c.PROP_POSE + 4] -= min(0.3 + 2.2 * size, 1.1) * back


@kernel
def _bore(u: float, plan: Floats, q: Floats) -> None:
    """Lean on the drill."""
    push = min_jerk(u / 0.5) - min_jerk((u - plan[pl.BURST_S] + 0.5) / 0.5)
    _along(plan[pl.STROKE_M] * push, plan, q)


@kernel
def _fetch(u: float, other: int, plan: Floats, q: Floats) -> None:
    """Take the other hand to the belt for the next screw, and back."""
    late = u - plan[pl.BURST_S] + 0.05 + FETCH_S
    fetch = min_jerk((u - 0.1) / FETCH_S) - min_jerk(late / FETCH_S)
    if fetch <= 0.0:
        return
    hand = (other - c.HAND_TARGET) // 3
    cos, sin = math.cos(q[c.HEADING]), math.sin(q[c.HEADING])
    ahead, left = 0.17, (1.0 - 2.0 * hand) * 0.34
    at = pl.TARGET + 3 * hand
    x = q[c.ROOT_X] + cos * ahead - sin * left
    y = q[c.ROOT_Y] + sin * ahead + cos * left
    q[other] += fetch * (x - plan[at])
    q[other + 1] += fetch * (y - plan[at + 1])
    q[other + 2] += fetch * (q[c.PELVIS_Z] + 0.06 - plan[at + 2])


FETCH_S = 0.55
"""From a screw's place to the pouch [s]: at 0.4 m about 1.4 m/s at most."""


@kernel
def _busy(ease: float, turn: float, other: int, plan: Floats, q: Floats) -> None:
    """Small movements of both hands, or of the pointing one alone."""
    size = ease * plan[pl.STROKE_M]
    if plan[pl.STROKE] == JAB:
        q[c.PROP_POSE + 2] += size * math.sin(turn)
        return
    q[c.PROP_POSE] += size * math.sin(turn)
    q[c.PROP_POSE + 1] += size * math.sin(0.7 * turn)
    q[c.PROP_POSE + 2] += 0.5 * size * math.sin(1.3 * turn)
    q[other] += size * math.sin(0.8 * turn)
    q[other + 1] -= size * math.sin(0.6 * turn)
    q[other + 2] += 0.5 * size * math.sin(1.1 * turn)
