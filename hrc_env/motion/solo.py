"""One activity by itself, from its beginning to its end: for reports, pictures and tests."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import Held, WorkerMotion
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.worker import Worker
from hrc_env.motion.anatomy import anatomy
from hrc_env.motion.feet import feet
from hrc_env.motion.holding import N_HELD, drop_load, prop_pose
from hrc_env.motion.kinematics import N_FRAMES, N_POINTS, pose, quaternion
from hrc_env.motion.state import RATE_H_S, evaluate, settle, stop
from hrc_env.worker.body import N_SEGMENTS, Body


@dataclass(frozen=True, slots=True)
class Film:
    """What a worker did."""

    activity: int
    time_s: Floats
    """(T,) since the activity began."""
    controls: Floats
    """(T, N_CONTROLS)."""
    motion: WorkerMotion
    """Arrays (T, 1, ...)."""
    worker: Worker
    """As the activity planned it."""


def alone(
    body: Body, xy_m: tuple[float, float] = (0.0, 0.0), yaw_rad: float = 0.0, right: bool = True
) -> Worker:
    """A worker at a point, feet side by side, who has nothing to do."""
    bones = anatomy(body)
    zeros = np.zeros
    me = Worker(
        zeros(pl.N_TRAITS), zeros(pl.N_PLAN), zeros((pl.MAX_STEPS, 5)), zeros((2, 5)),
        bones.offset, bones.frame, bones.size,
        zeros(c.N_CONTROLS), zeros((N_POINTS, 3)), zeros((N_FRAMES, 3, 3)),
    )  # fmt: skip
    me.traits[pl.SPEED_TRAIT], me.traits[pl.SQUAT_TRAIT] = 1.2, 0.7
    me.traits[pl.RIGHT_HANDED] = 0.9 if right else 0.1
    settle(*xy_m, yaw_rad, me.plan, me.prints, me.stance, me.size)
    rest(me)
    return me


def rest(me: Worker, activity: int = pl.STAND) -> None:
    """End an activity: stand where it ended."""
    stop(me.plan, me.prints, me.stance)
    if activity in pl.GIVING or activity == pl.PUSH:
        drop_load(me.plan)
    feet(0.0, me.plan, me.prints, me.stance, me.size, me.q)


def play(me: Worker, activity: int, time_s: Floats, clock_s: float = 0.0) -> Film:
    """The worker at the times (T,) of an activity that began at a clock."""
    controls = np.empty((len(time_s), c.N_CONTROLS))
    place, turn = np.empty((len(time_s), N_SEGMENTS, 3)), np.empty((len(time_s), N_SEGMENTS, 4))
    rate, held = np.empty_like(place), np.empty((len(time_s), N_HELD))
    _play(activity, clock_s, time_s, me, controls, place, turn, rate, held)
    things = Held(held[:, None, 0].astype(int), held[:, None, 1:4], held[:, None, 4:])
    spin = np.zeros_like(rate)[:, None]
    motion = WorkerMotion(place[:, None], turn[:, None], rate[:, None], spin, things)
    copy = Worker(*(np.copy(part) for part in me))
    return Film(activity, time_s, controls, motion, copy)


@kernel(makes_arrays=True)
def _play(
    activity: int, clock_s: float, time_s: Floats, me: Worker,
    controls: Floats, place: Floats, turn: Floats, rate: Floats, held: Floats,
) -> None:  # fmt: skip
    """Fill the arrays of a film."""
    offset = np.zeros((c.N_BLENDED, 2))
    later, frames = np.zeros((N_POINTS, 3)), np.zeros((1, 1))
    for k in range(len(time_s)):
        t, q, p, r = time_s[k], controls[k], me.p, me.r
        for i in range(1, -1, -1):
            h = i * RATE_H_S
            evaluate(
                activity, t + h, clock_s + t + h, me.plan, me.prints, me.stance, offset,
                me.traits, me.size, frames, q,
            )  # fmt: skip
            pose(q, me.bones, me.frame, me.size, p, r)
            if i == 1:
                later[:] = p
        for s in range(place.shape[1]):
            for i in range(3):
                place[k, s, i] = p[s, i]
                rate[k, s, i] = (later[s, i] - p[s, i]) / RATE_H_S
            quaternion(r, s, turn[k])
        prop_pose(q, held[k])
