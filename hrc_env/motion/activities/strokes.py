"""Movements of hands and tools at work: bursts of strokes and displacements between them."""

import math
from typing import NamedTuple

from hrc_env.core.kernels import kernel
from hrc_env.motion import controls as c
from hrc_env.motion.curves import min_jerk, shift
from hrc_env.motion.posture import locate_from_root
from hrc_env.motion.state import Worker

STILL, STRIKE, BORE, PRESS, SAW, SHIFT, BUSY, JAB = range(8)
"""Kinds of strokes.

They are: no strokes; blows of a hammer; drilling while the other hand fetches screws; drilling;
sawing; displacements along the work only; small movements of both hands; beats of a pointing hand.
"""
PAUSE_S = 0.7
"""Time between two bursts [s]."""
EASE_S = 0.25
"""Time in which the amplitude of strokes rises, and equally decreases [s]."""
FETCH_S = 0.55
"""Time in which the hand moves from the work to the pouch [s]."""


class ScrewProgress(NamedTuple):
    """Progress of driving screws."""

    n_done: int
    """Number of screws that have been driven."""
    is_driving: bool
    """Whether a screw is being driven."""


@kernel
def apply_stroke(t: float, worker: Worker) -> None:
    """Add the stroke to the pose of the tool, and compute the other hand's offset from its target.

    Args:
        t: time since the hands arrived at the work [s], from 0 to `hold_s`.
        worker: record with the plan; its `q` is changed.
    """
    q = worker.q
    kind, side = worker.stroke, worker.side
    other = c.HAND_TARGET + 3 * (1 - side)
    q[other : other + 3] = 0.0
    cycle = worker.burst_s + PAUSE_S
    n = math.floor(t / cycle)
    u = t - n * cycle
    _wander(n, u, other, worker)
    ease = min_jerk(u / EASE_S) - min_jerk((u - worker.burst_s + EASE_S) / EASE_S)
    if ease <= 0.0 or t >= worker.hold_s:
        return
    turn = 2.0 * math.pi * worker.stroke_hz * u
    if kind == STRIKE:
        _strike(ease, turn, worker)
    elif kind in (BORE, PRESS):
        push = min_jerk(u / 0.5) - min_jerk((u - worker.burst_s + 0.5) / 0.5)
        _advance_tool(worker.stroke_m * push, worker)
        if kind == BORE:
            _fetch(u, other, worker)
    elif kind == SAW:
        _advance_tool(-ease * worker.stroke_m * math.sin(turn), worker)
        q[c.SPINE_TWIST] += (1.0 - 2.0 * side) * 0.10 * ease * math.sin(turn)
    elif kind in (BUSY, JAB):
        _fidget(ease, turn, other, worker)


@kernel
def _wander(n: int, u: float, other: int, worker: Worker) -> None:
    """Move tool and hands along the work or down, by one position per burst.

    Args:
        n: index of the burst.
        u: time since the burst began [s].
        other: column of the other hand's target.
        worker: record of the worker; its `q` is changed.
    """
    q = worker.q
    on = min_jerk((u - worker.burst_s) / PAUSE_S)
    if worker.down_m > 0.0:
        last = round(worker.hold_s / (worker.burst_s + PAUSE_S)) - 1.0
        down = worker.down_m * min(n + on, last)
        q[c.PROP_POSE + 2] -= down
        q[other + 2] -= down
    here = n % 2
    share = here + on * (1.0 - 2.0 * here)
    shift(q, c.PROP_POSE, worker.start_yaw, 0.0, worker.wander_m * share)
    shift(q, other, worker.start_yaw, 0.0, worker.wander_m * share)


@kernel
def count_screws(worker: Worker) -> ScrewProgress:
    """Return the number of screws that have been driven, and whether one is being driven."""
    t = worker.time_s - worker.out_at - worker.take_s - worker.out_s
    cycle = worker.burst_s + PAUSE_S
    if t <= 0.0:
        return ScrewProgress(0, False)
    if t >= worker.hold_s:
        return ScrewProgress(round(worker.hold_s / cycle), False)
    n = int(t / cycle)
    goes_on = t - n * cycle < worker.burst_s
    if goes_on:
        return ScrewProgress(n, worker.pace > 0.0)
    return ScrewProgress(n + 1, False)


@kernel
def _advance_tool(way: float, worker: Worker) -> None:
    """Move the tool along its x axis by a distance [m]."""
    q = worker.q
    pitch, yaw = worker.tool_pose[4], worker.tool_pose[3]
    q[c.PROP_POSE] += math.cos(yaw) * math.cos(pitch) * way
    q[c.PROP_POSE + 1] += math.sin(yaw) * math.cos(pitch) * way
    q[c.PROP_POSE + 2] -= math.sin(pitch) * way


@kernel
def _strike(ease: float, turn: float, worker: Worker) -> None:
    """Swing the hammer with wrist and arm, slowly back and faster forward.

    Args:
        ease: weight of the stroke.
        turn: phase of the stroke [rad].
        worker: record of the worker; its `q` is changed.
    """
    q, size = worker.q, worker.stroke_m
    skew = min(1.5 * size, 0.35)
    back = 0.5 * ease * (1.0 - math.cos(turn + skew * math.sin(turn)))
    _advance_tool(-size * back, worker)
    q[c.PROP_POSE + 2] += 0.35 * size * back
    past_shoulder = (1.0 - 2.0 * worker.side) * 0.6 * size * back
    shift(q, c.PROP_POSE, worker.start_yaw, 0.0, past_shoulder)
    q[c.PROP_POSE + 4] -= min(0.3 + 2.2 * size, 1.1) * back


@kernel
def _fetch(u: float, other: int, worker: Worker) -> None:
    """Move the other hand to the pouch on the belt for the next screw, and back.

    Args:
        u: time since the burst began [s].
        other: column of the other hand's target.
        worker: record of the worker; its `q` is changed.
    """
    q = worker.q
    late = u - worker.burst_s + 0.05 + FETCH_S
    fetch = min_jerk((u - 0.1) / FETCH_S) - min_jerk(late / FETCH_S)
    if fetch <= 0.0:
        return
    hand = (other - c.HAND_TARGET) // 3
    target = worker.target[3 * hand : 3 * hand + 3]
    x, y = locate_from_root(0.17, (1.0 - 2.0 * hand) * 0.34, worker)
    q[other] += fetch * (x - target[0])
    q[other + 1] += fetch * (y - target[1])
    q[other + 2] += fetch * (q[c.PELVIS_Z] + 0.06 - target[2])


@kernel
def _fidget(ease: float, turn: float, other: int, worker: Worker) -> None:
    """Add small movements of both hands, or of a pointing hand alone.

    Args:
        ease: weight of the movement.
        turn: phase of the movement [rad].
        other: column of the other hand's target.
        worker: record of the worker; its `q` is changed.
    """
    q, size = worker.q, ease * worker.stroke_m
    if worker.stroke == JAB:
        q[c.PROP_POSE + 2] += size * math.sin(turn)
        return
    q[c.PROP_POSE] += size * math.sin(turn)
    q[c.PROP_POSE + 1] += size * math.sin(0.7 * turn)
    q[c.PROP_POSE + 2] += 0.5 * size * math.sin(1.3 * turn)
    q[other] += size * math.sin(0.8 * turn)
    q[other + 1] -= size * math.sin(0.6 * turn)
    q[other + 2] += 0.5 * size * math.sin(1.1 * turn)
