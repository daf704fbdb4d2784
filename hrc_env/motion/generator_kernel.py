"""The compiled part of the worker: from what workers do to where their bodies are, one by one."""

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.motion.holding import prop_pose
from hrc_env.motion.kinematics import pose, quaternion, spin
from hrc_env.motion.state import RATE_H_S, evaluate

PARKED_Z_M = -100.0
"""Who is not in an episode is so far below the floor, where no camera looks [m]."""
HALT_S = 0.3
"""Time in which hands come to a halt, and go on [s]."""


@kernel
def _pose(
    b: int, w: int, later_s: float, clock_s: Floats, time_s: Floats, activity: Ints, pace: Floats,
    plan: Floats, prints: Floats, stance: Floats, offset: Floats, traits: Floats, body: Ints,
    bones: Floats, frame: Floats, size: Floats, frames: Floats, q: Floats, p: Floats, r: Floats,
) -> None:  # fmt: skip
    """Worker (b, w) a little later than now: points p and frames r of `kinematics.pose`."""
    mine = body[b, w]
    t, clock = time_s[b, w] + pace[b, w, 0] * later_s, clock_s[b, w] + later_s
    evaluate(
        activity[b, w], t, clock, plan[b, w], prints[b, w], stance[b, w], offset[b, w],
        traits[b, w], size[mine], frames, q,
    )  # fmt: skip
    pose(q, bones[mine], frame[mine], size[mine], p, r)


@kernel
def _place(present: float, p: Floats, r: Floats, position: Floats, quaternion_: Floats) -> None:
    """Write a pose into (22, ...) arrays; far below the floor of who is not there."""
    down = 0.0 if present > 0.0 else PARKED_Z_M
    for s in range(position.shape[0]):
        for i in range(3):
            position[s, i] = p[s, i]
        position[s, 2] += down
        quaternion(r, s, quaternion_)


@kernel
def _rates(p: Floats, r: Floats, velocity: Floats, turning: Floats) -> None:
    """Velocities (22, 3) from the poses now, p[0] and r[0], and RATE_H_S later, p[1] and r[1]."""
    rate = 1.0 / RATE_H_S
    for s in range(velocity.shape[0]):
        for i in range(3):
            velocity[s, i] = (p[1, s, i] - p[0, s, i]) * rate
        spin(r[0], r[1], s, RATE_H_S, turning)


@kernel
def _tick(dt_s: float, pace: Floats) -> None:
    """Let a worker's pace (now, wished) come nearer to the wished one."""
    most = dt_s / HALT_S
    pace[0] += min(max(pace[1] - pace[0], -most), most)


@kernel
def move_on(
    dt_s: float, n_steps: int, done: Ints, ticked: Bools,
    clock_s: Floats, time_s: Floats, duration_s: Floats, activity: Ints, pace: Floats,
    plan: Floats, prints: Floats, stance: Floats, offset: Floats, traits: Floats,
    present: Floats, body: Ints, bones: Floats, frame: Floats, size: Floats, frames: Floats,
    position: Floats, quaternion_: Floats, velocity: Floats, turning: Floats, held: Floats,
    q: Floats, p: Floats, r: Floats,
) -> bool:  # fmt: skip
    """Move every environment on until done or someone must decide; whether anyone must."""
    waiting = False
    for b in range(done.shape[0]):
        while done[b] < n_steps:
            t, due = done[b], False
            for w in range(time_s.shape[1]):
                if not ticked[b]:
                    _tick(dt_s, pace[b, w])
                    time_s[b, w] += dt_s * pace[b, w, 0]
                    clock_s[b, w] += dt_s
                back = pace[b, w, 0] < 0.0 and time_s[b, w] <= 0.0
                due = due or back or time_s[b, w] >= duration_s[b, w]
            ticked[b] = due
            if due:
                waiting = True
                break
            for w in range(time_s.shape[1]):
                for i in range(1 if t == n_steps - 1 else 0, -1, -1):
                    _pose(
                        b, w, i * RATE_H_S, clock_s, time_s, activity, pace, plan, prints, stance,
                        offset, traits, body, bones, frame, size, frames, q, p[i], r[i],
                    )  # fmt: skip
                _place(present[b, w], p[0], r[0], position[b, t, w], quaternion_[b, t, w])
                if t == n_steps - 1:
                    _rates(p, r, velocity[b, w], turning[b, w])
                    prop_pose(q, held[b, w])
            done[b] += 1
    return waiting


@kernel
def bodies_now(
    rows: Ints, clock_s: Floats, time_s: Floats, duration_s: Floats, activity: Ints, pace: Floats,
    plan: Floats, prints: Floats, stance: Floats, offset: Floats, traits: Floats,
    present: Floats, body: Ints, bones: Floats, frame: Floats, size: Floats, frames: Floats,
    position: Floats, quaternion_: Floats, velocity: Floats, turning: Floats, held: Floats,
    q: Floats, p: Floats, r: Floats,
) -> None:  # fmt: skip
    """Bodies of some environments as they are, into arrays (rows, W, ...)."""
    for row in range(rows.shape[0]):
        b = rows[row]
        for w in range(time_s.shape[1]):
            for i in range(1, -1, -1):
                _pose(
                    b, w, i * RATE_H_S, clock_s, time_s, activity, pace, plan, prints, stance,
                    offset, traits, body, bones, frame, size, frames, q, p[i], r[i],
                )  # fmt: skip
            _place(present[b, w], p[0], r[0], position[row, w], quaternion_[row, w])
            _rates(p, r, velocity[row, w], turning[row, w])
            prop_pose(q, held[row, w])
