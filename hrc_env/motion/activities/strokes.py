"""What hands and tools do at work: strokes in bursts, moving along the work between them."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.motion import controls as c
from hrc_env.motion.curves import min_jerk, shift
from hrc_env.motion.posture import from_root
from hrc_env.motion.state import Worker

STILL, STRIKE, BORE, PRESS, SAW, SHIFT, BUSY, JAB = range(8)
"""Nothing; hammer; drill, the other hand fetching screws or not; saw; still; busy hands; a beat."""
PAUSE_S, EASE_S, FETCH_S = 0.7, 0.25, 0.55
"""Between two bursts; in which strokes begin and end; from a screw's place to the pouch [s]."""


@kernel
def stroke(t: float, me: Worker) -> None:
    """Add what the stroke does at time t of the work (0 to `hold_s`) to the tool's pose in q, and
    write how far the other hand is from its target."""
    q = me.q
    kind, side = me.stroke, me.side
    other = c.HAND_TARGET + 3 * (1 - side)
    q[other : other + 3] = 0.0
    cycle = me.burst_s + PAUSE_S
    n = math.floor(t / cycle)
    u = t - n * cycle
    _wander(n, u, other, me)
    ease = min_jerk(u / EASE_S) - min_jerk((u - me.burst_s + EASE_S) / EASE_S)
    if ease <= 0.0 or t >= me.hold_s:
        return
    turn = 2.0 * math.pi * me.stroke_hz * u
    if kind == STRIKE:
        _strike(ease, turn, me)
    elif kind in (BORE, PRESS):
        push = min_jerk(u / 0.5) - min_jerk((u - me.burst_s + 0.5) / 0.5)
        _along(me.stroke_m * push, me)
        if kind == BORE:
            _fetch(u, other, me)
    elif kind == SAW:
        _along(-ease * me.stroke_m * math.sin(turn), me)
        q[c.SPINE_TWIST] += (1.0 - 2.0 * side) * 0.10 * ease * math.sin(turn)
    elif kind in (BUSY, JAB):
        _busy(ease, turn, other, me)


@kernel
def _wander(n: int, u: float, other: int, me: Worker) -> None:
    """Go to and fro along the work, or down, a place a burst."""
    q = me.q
    on = min_jerk((u - me.burst_s) / PAUSE_S)
    if me.down_m > 0.0:
        last = round(me.hold_s / (me.burst_s + PAUSE_S)) - 1.0
        down = me.down_m * min(n + on, last)
        q[c.PROP_POSE + 2] -= down
        q[other + 2] -= down
    here = n % 2
    share = here + on * (1.0 - 2.0 * here)
    shift(q, c.PROP_POSE, me.start_yaw, 0.0, me.wander_m * share)
    shift(q, other, me.start_yaw, 0.0, me.wander_m * share)


@kernel
def screws(me: Worker) -> tuple[int, bool]:
    """How many bursts of work are done, and whether one goes on."""
    t = me.time_s - me.out_at - me.take_s - me.out_s
    cycle = me.burst_s + PAUSE_S
    if t <= 0.0:
        return 0, False
    if t >= me.hold_s:
        return round(me.hold_s / cycle), False
    n = int(t / cycle)
    goes_on = t - n * cycle < me.burst_s
    return (n, me.pace > 0.0) if goes_on else (n + 1, False)


@kernel
def _along(way: float, me: Worker) -> None:
    """Move the tool where it points."""
    q = me.q
    pitch, yaw = me.tool_pose[4], me.tool_pose[3]
    q[c.PROP_POSE] += math.cos(yaw) * math.cos(pitch) * way
    q[c.PROP_POSE + 1] += math.sin(yaw) * math.cos(pitch) * way
    q[c.PROP_POSE + 2] -= math.sin(pitch) * way


@kernel
def _strike(ease: float, turn: float, me: Worker) -> None:
    """Swing the hammer back slowly and forward faster, round the wrist and with the arm."""
    q, size = me.q, me.stroke_m
    skew = min(1.5 * size, 0.35)
    back = 0.5 * ease * (1.0 - math.cos(turn + skew * math.sin(turn)))
    _along(-size * back, me)
    q[c.PROP_POSE + 2] += 0.35 * size * back
    past_shoulder = (1.0 - 2.0 * me.side) * 0.6 * size * back
    shift(q, c.PROP_POSE, me.start_yaw, 0.0, past_shoulder)
    q[c.PROP_POSE + 4] -= min(0.3 + 2.2 * size, 1.1) * back


@kernel
def _fetch(u: float, other: int, me: Worker) -> None:
    """Take the other hand to the belt for the next screw, and back."""
    q = me.q
    late = u - me.burst_s + 0.05 + FETCH_S
    fetch = min_jerk((u - 0.1) / FETCH_S) - min_jerk(late / FETCH_S)
    if fetch <= 0.0:
        return
    hand = (other - c.HAND_TARGET) // 3
    target = me.target[3 * hand : 3 * hand + 3]
    x, y = from_root(0.17, (1.0 - 2.0 * hand) * 0.34, me)
    q[other] += fetch * (x - target[0])
    q[other + 1] += fetch * (y - target[1])
    q[other + 2] += fetch * (q[c.PELVIS_Z] + 0.06 - target[2])


@kernel
def _busy(ease: float, turn: float, other: int, me: Worker) -> None:
    """Small movements of both hands, or of the pointing one alone."""
    q, size = me.q, ease * me.stroke_m
    if me.stroke == JAB:
        q[c.PROP_POSE + 2] += size * math.sin(turn)
        return
    q[c.PROP_POSE] += size * math.sin(turn)
    q[c.PROP_POSE + 1] += size * math.sin(0.7 * turn)
    q[c.PROP_POSE + 2] += 0.5 * size * math.sin(1.3 * turn)
    q[other] += size * math.sin(0.8 * turn)
    q[other + 1] -= size * math.sin(0.6 * turn)
    q[other + 2] += 0.5 * size * math.sin(1.1 * turn)
