"""What workers notice of the robot, and what that does to what they are at.

Somebody who notices takes a while, and then pauses or takes the hands away and steps back, or
does neither; which, and how long it takes, is drawn when an activity begins. Hands pause by
their activity's time coming to a halt, and are taken away by its going backwards; walkers brake.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Ints
from hrc_env.motion import plans as pl
from hrc_env.motion.anatomy import CHEST, HAND, HEAD, LEFT, SIDE_STRIDE
from hrc_env.motion.state import (
    ACTS_AT,
    BACK_AWAY,
    CALM_AT,
    DELAY_S,
    DOING,
    KIND,
    LASTS_S,
    NO_REACTION,
    PAUSE,
    UNTIL_AT,
)
from hrc_env.motion.traffic import goes, meets
from hrc_env.motion.walk import brake

BODY_POINTS = (CHEST, HEAD, LEFT + HAND, LEFT + SIDE_STRIDE + HAND)
"""Segments that people guard."""
WITHDRAW = -1.6
"""Hands come back so much faster than they went."""


@kernel
def notice(
    dt_s: float, people: tuple[float, float, float], robot_world: Floats, seen: Floats,
    position_world: Floats, present: Floats, alert: Floats, pace: Floats, clock_s: Floats,
    time_s: Floats, duration_s: Floats, activity: Ints, plan: Floats, prints: Floats,
    stance: Floats, body: Ints, size: Floats,
) -> None:  # fmt: skip
    """Let every worker look at the robot, and react when it is time.

    Args:
        dt_s: since the last look.
        people: `PeopleConfig.notice_m`, `.fast_m_s`, `.calm_s`.
        robot_world: (B, P, 3) points of the arm now [m].
        seen: (B, P, 3) the same at the last look; made those of now.
        position_world: (B, W, 22, 3) the workers' segments now [m].
        present, alert, pace, clock_s, time_s, duration_s, activity, plan, prints, stance: of
            `MotionState`; what a reaction changes is written.
        body: (B, W) which body each has.
        size: (N, N_SIZES) of the bodies.
    """
    for b in range(clock_s.shape[0]):
        for w in range(clock_s.shape[1]):
            mine, clock = alert[b, w], clock_s[b, w]
            if present[b, w] == 0.0:
                continue
            if mine[DOING] == PAUSE and clock >= mine[UNTIL_AT]:
                mine[DOING], pace[b, w, 1] = NO_REACTION, 1.0
            if clock >= mine[ACTS_AT]:
                mine[ACTS_AT] = math.inf
                _react(
                    w, mine, pace[b], clock, time_s[b], duration_s[b], activity[b], plan[b],
                    prints[b, w], stance[b, w], present[b], size[body[b, w]],
                )  # fmt: skip
                mine[CALM_AT] = clock + mine[LASTS_S] + people[2]
                continue
            wakeful = mine[KIND] != NO_REACTION and mine[ACTS_AT] == math.inf
            if (
                wakeful
                and clock > mine[CALM_AT]
                and _startling(dt_s, people, robot_world[b], seen[b], position_world[b, w])
            ):
                mine[ACTS_AT] = clock + mine[DELAY_S]
        for k in range(seen.shape[1]):
            for i in range(3):
                seen[b, k, i] = robot_world[b, k, i]


@kernel
def _startling(
    dt_s: float, people: tuple[float, float, float], robot: Floats, before: Floats, body: Floats
) -> bool:
    """Whether a point of the arm is near, or comes fast from not far."""
    for segment in BODY_POINTS:
        for k in range(robot.shape[0]):
            now, then = 0.0, 0.0
            for i in range(3):
                now += (robot[k, i] - body[segment, i]) ** 2
                then += (before[k, i] - body[segment, i]) ** 2
            now, then = math.sqrt(now), math.sqrt(then)
            if now < people[0]:
                return True
            if now < 2.0 * people[0] and then - now > people[1] * dt_s:
                return True
    return False


@kernel
def _react(
    w: int, mine: Floats, pace: Floats, clock: float, time_s: Floats, duration_s: Floats,
    activity: Ints, plan: Floats, prints: Floats, stance: Floats, present: Floats, size: Floats,
) -> None:  # fmt: skip
    """Do what worker w does about the robot, if what they are at allows it."""
    kind = activity[w]
    if goes(kind):
        if (kind == pl.WALK or kind == pl.CARRY) and _brake(
            w, time_s, duration_s, activity, plan, prints, stance, present, size
        ):
            mine[DOING] = PAUSE
            mine[UNTIL_AT] = clock + duration_s[w] - time_s[w] + mine[LASTS_S]
    elif mine[KIND] == BACK_AWAY and withdraws(kind):
        mine[DOING] = BACK_AWAY
        if kind == pl.STAND or kind == pl.LOOK_ROUND:
            duration_s[w] = time_s[w]
        else:
            pace[w, 1] = WITHDRAW
    else:
        mine[DOING], mine[UNTIL_AT], pace[w, 1] = PAUSE, clock + mine[LASTS_S], 0.0


@kernel
def withdraws(activity: int) -> bool:
    """Whether one can step back from it: standing up, with empty hands."""
    return activity <= pl.REACH or activity == pl.LOOK_ROUND or pl.HAMMER <= activity <= pl.POINT


@kernel(makes_arrays=True)
def _brake(
    w: int, time_s: Floats, duration_s: Floats, activity: Ints, plan: Floats, prints: Floats,
    stance: Floats, present: Floats, size: Floats,
) -> bool:  # fmt: skip
    """Brake a walker, unless somebody would walk into them; whether they do."""
    old_plan, old_prints, old_s = plan[w].copy(), prints.copy(), duration_s[w]
    lasts = brake(time_s[w], plan[w], prints, stance, size)
    if lasts < 0.0:
        return False
    duration_s[w] = lasts
    found, _, _ = meets(w, activity, time_s, duration_s, plan, present)
    if found >= 0.0:
        plan[w], prints[:], duration_s[w] = old_plan, old_prints, old_s
    return found < 0.0
