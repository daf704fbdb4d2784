"""Work in place: get down to it, take a tool from the belt, work, and all of it backwards.

The first half of such an activity and its second half are mirror images in time.
"""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.getting_down import get_down
from hrc_env.motion.activities.strokes import stroke
from hrc_env.motion.curves import min_jerk
from hrc_env.motion.gaze import look_at
from hrc_env.motion.holding import GRIPS, TWO_HANDED, grip
from hrc_env.motion.posture import lean, stand

GAZE_LEAD_S = 0.25
"""Eyes and head set off before the hand (Land & Hayhoe 2001: about half a second at most)."""
BELT_AHEAD_M, BELT_SIDE_M, BELT_UP_M, BELT_PITCH_RAD = 0.10, 0.29, 0.06, 1.3
"""Where a tool hangs, from the pelvis [m], and how it points; judgement."""
BELLY_AHEAD_M, BELLY_SIDE_M, BELLY_UP_M = 0.34, 0.06, 0.22
"""Where the other hand is on its way down to the floor, from the pelvis [m]; judgement."""
EARLY_SHARE = 0.55
"""Share of getting down in which hands come before the body."""
ELBOWS_RAD, LOW_ELBOWS_RAD = 0.25, 0.4
"""How far elbows are turned outwards at work, and at floor height; judgement."""
JOIN_AT = 0.3
"""Share of the way from which the second hand comes to a tool for two; judgement."""
RISE, OVER_KNEE_M, LOW_M = 0.5, 0.22, 0.6
"""Hands go up ahead of the shoulder, by this share of the height, and down over the knees, so
far ahead and up on the way to work below LOW_M [m]; judgement."""
DRAWN_SHARE = 0.6
"""Share of the way at which what is drawn out with both hands is out."""


@kernel
def extend(down: float, out: float, plan: Floats, size: Floats, q: Floats) -> None:
    """A standing body's q at a share of getting down, and of reaching out from there."""
    get_down(down, plan, size, q)
    belt(int(plan[pl.SIDE]), c.PROP_POSE, q)
    lean(plan[pl.LEAN] * out, plan[pl.SQUAT], plan[pl.TWIST] * out, q)
    for i in range(6):
        q[c.PROP_POSE + i] += out * (plan[pl.TOOL_POSE + i] - q[c.PROP_POSE + i])
    _round(c.PROP_POSE, plan[pl.TOOL_POSE + 2], out, q)


@kernel
def _round(at: int, goal_z: float, out: float, q: Floats) -> None:
    """Send q[at:], on its way out to a height, round shoulder or knee."""
    high = RISE * max(goal_z - q[c.PELVIS_Z] - 0.3, 0.0)
    bulge = max(high, OVER_KNEE_M if goal_z < LOW_M else 0.0) * 4.0 * out * (1.0 - out)
    q[at] += math.cos(q[c.HEADING]) * bulge
    q[at + 1] += math.sin(q[c.HEADING]) * bulge
    q[at + 2] += bulge if goal_z < LOW_M else 0.0


@kernel
def belt(side: int, at: int, q: Floats) -> None:
    """Write the pose of a tool on the belt, on that side, into q[at:]."""
    cos, sin = math.cos(q[c.HEADING]), math.sin(q[c.HEADING])
    left = (1.0 - 2.0 * side) * BELT_SIDE_M
    q[at] = q[c.ROOT_X] + cos * BELT_AHEAD_M - sin * left
    q[at + 1] = q[c.ROOT_Y] + sin * BELT_AHEAD_M + cos * left
    q[at + 2] = q[c.PELVIS_Z] + BELT_UP_M
    q[at + 3], q[at + 4], q[at + 5] = q[c.HEADING], BELT_PITCH_RAD, 0.0


@kernel
def hands_on(out: float, taken: float, early: float, plan: Floats, q: Floats) -> None:
    """Send the tool's hand to the tool, the other to its own target or to the tool.

    Both are before the body, by the share `early`, when thighs rise of those who get down.
    """
    side, tool = int(plan[pl.SIDE]), int(plan[pl.TOOL])
    other = 1 - side
    both = TWO_HANDED[tool]
    low = plan[pl.TOOL_POSE + 2] < LOW_M and not both
    for hand in range(2):
        at = c.HAND_TARGET + 3 * hand
        if hand == side or both:
            of = hand if both else 1
            grip(hand, GRIPS[tool, of, 0], GRIPS[tool, of, 1], GRIPS[tool, of, 2], q)
        else:
            for i in range(3):
                q[at + i] += plan[pl.TARGET + 3 * other + i]
            if low:
                _from_belly(hand, at, 1.0 - out, plan, q)
            _round(at, plan[pl.TARGET + 3 * other + 2], out, q)
    for hand in range(2):
        q[c.SWIVEL + hand] += LOW_ELBOWS_RAD * early if low else ELBOWS_RAD * out
    q[c.HAND_SHARE + side] = max(taken, early) if low else taken
    joined = early if low else out
    if both and taken != out:
        joined = min_jerk((out - JOIN_AT) / (1.0 - JOIN_AT))
    q[c.HAND_SHARE + other] = joined * plan[pl.USE_LEFT + other]


@kernel
def _from_belly(hand: int, at: int, share: float, plan: Floats, q: Floats) -> None:
    """Bring the target q[at:] of a hand back to before the belly by a share: over the thighs."""
    cos, sin = math.cos(q[c.HEADING]), math.sin(q[c.HEADING])
    left = (1.0 - 2.0 * hand) * BELLY_SIDE_M
    goal = pl.TARGET + 3 * hand
    q[at] += share * (q[c.ROOT_X] + cos * BELLY_AHEAD_M - sin * left - plan[goal])
    q[at + 1] += share * (q[c.ROOT_Y] + sin * BELLY_AHEAD_M + cos * left - plan[goal + 1])
    q[at + 2] += share * (q[c.PELVIS_Z] + BELLY_UP_M - plan[goal + 2])


@kernel
def work(t: float, plan: Floats, clock_s: float, traits: Floats, size: Floats, q: Floats) -> None:
    """The control vector of someone who works in place with a tool, or empty hands."""
    stand(plan[pl.START_X], plan[pl.START_Y], plan[pl.START_YAW], clock_s, traits, size, q)
    near_end = min(t, plan[pl.LASTS] - t)
    down = min_jerk(near_end / plan[pl.SETTLE_S])
    since = near_end - plan[pl.OUT_AT] - plan[pl.TAKE_S]
    out = min_jerk(since / plan[pl.OUT_S])
    taken = min_jerk(1.0 + since / plan[pl.TAKE_S]) if plan[pl.TAKE_S] > 0.0 else out
    extend(down, out, plan, size, q)
    working = t - plan[pl.OUT_AT] - plan[pl.TAKE_S] - plan[pl.OUT_S]
    if out >= 1.0:
        stroke(working, plan, q)
    else:
        stroke(0.0 if working < 0.0 else plan[pl.HOLD_S], plan, q)
    hands_on(out, taken, min_jerk(near_end / (EARLY_SHARE * plan[pl.SETTLE_S])), plan, q)
    drawn = DRAWN_SHARE * plan[pl.OUT_S] if TWO_HANDED[int(plan[pl.TOOL])] else 0.0
    q[c.PROP] = plan[pl.TOOL] if since >= drawn else 0.0
    looking = min_jerk((since + GAZE_LEAD_S) / 0.6)
    look_at(plan[pl.GAZE_X], plan[pl.GAZE_Y], plan[pl.GAZE_Z], looking, size, q)
