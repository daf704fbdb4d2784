"""What a worker does next: decided when an activity has ended, from uniform draws in [0, 1).

A worker dwells at one place (at the robot, or away from it), does a few things there, and
walks on. Nothing here looks at the robot's arm: the worker does not react to it. `config` is
a `MotionConfig` in the form that `config.numbers` gives.
"""

import math

import numpy as np

from hrc_env.motion import plans as pl
from hrc_env.motion.compiled import compiled
from hrc_env.motion.config import MotionConfig
from hrc_env.motion.curves import wrap
from hrc_env.motion.hands import plan_lift, plan_reach
from hrc_env.motion.paths import along, lay_path
from hrc_env.motion.walk import plan_walk
from hrc_env.typing import Floats

N_DRAWS = 40
"""Uniform numbers that one decision may use."""
N_PLACES = 6
"""Places considered at most before one is taken that is near another worker's."""
PLACE_DRAWS = 16
"""First of the draws that choose a place: the zone, its dwell, the path, then three a place."""
SPOT_X, SPOT_Y, SPOT_YAW, SPOT_NEAR, SPOT_UNTIL = range(5)
"""Columns of a worker's place: where, which way, whether at the robot, until which clock [s]."""
N_SPOT = 5
SWAY_M = 0.05
"""Paths keep this further away, because bodies sway about them [m]."""
BODY_M = 0.36
"""Hands reach no nearer to their own root than this [m]."""


@compiled
def between(draw: float, limits: tuple[float, float]) -> float:
    """A uniform draw in [0, 1) stretched to (low, high)."""
    return limits[0] + draw * (limits[1] - limits[0])


@compiled
def choose_place(
    draws: Floats, config: MotionConfig, spots: Floats, w: int, clock_s: float
) -> None:
    """Fill the worker's row of spots (W, 5), away from the other workers' places if possible."""
    wished = draws[PLACE_DRAWS] < config.near_probability
    near = wished
    mine = spots[w]
    for i in range(N_PLACES):
        near = wished if i < N_PLACES // 2 else not wished  # crowded there: go elsewhere
        radii = config.near_radius_m if near else config.away_radius_m
        widest = config.near_azimuth_rad if near else config.away_azimuth_rad
        at = PLACE_DRAWS + 3 + 3 * i
        radius = between(draws[at], radii)
        azimuth = config.robot_front_rad + widest * (2.0 * draws[at + 1] - 1.0)
        x = config.robot_xy_m[0] + radius * math.cos(azimuth)
        y = config.robot_xy_m[1] + radius * math.sin(azimuth)
        mine[SPOT_X] = min(max(x, config.walkable_x_m[0]), config.walkable_x_m[1])
        mine[SPOT_Y] = min(max(y, config.walkable_y_m[0]), config.walkable_y_m[1])
        turn = 2.0 * draws[at + 2] - 1.0
        mine[SPOT_YAW] = azimuth + math.pi + 0.15 * turn if near else azimuth + 1.2 * turn
        free = True
        for other in range(spots.shape[0]):
            dx, dy = spots[other, SPOT_X] - mine[SPOT_X], spots[other, SPOT_Y] - mine[SPOT_Y]
            free = free and (other == w or dx * dx + dy * dy > config.spacing_m**2)
        if free:
            break
    mine[SPOT_NEAR] = 1.0 if near else 0.0
    mine[SPOT_UNTIL] = clock_s + between(draws[PLACE_DRAWS + 1], config.dwell_s)


@compiled
def _via(draw: float, plan: Floats, config: MotionConfig) -> Floats:
    """The corner (1, 3) of a path that keeps clear of the robot; START and END are set."""
    x0, y0, x2, y2 = plan[pl.START_X], plan[pl.START_Y], plan[pl.END_X], plan[pl.END_Y]
    bow, via = 0.24 * (draw - 0.5), np.full((1, 3), 5.0)
    x = 0.5 * (x0 + x2) - bow * (y2 - y0)
    y = 0.5 * (y0 + y2) + bow * (x2 - x0)
    bx, by = config.robot_xy_m
    for _ in range(24):
        via[0, 0] = x = min(max(x, config.walkable_x_m[0]), config.walkable_x_m[1])
        via[0, 1] = y = min(max(y, config.walkable_y_m[0]), config.walkable_y_m[1])
        lay_path((x0, y0), via, (x2, y2), plan)
        nearest = 1e9
        for i in range(1, 12):
            px, py = along(i / 12.0 * plan[pl.LENGTH], plan)
            nearest = min(nearest, math.hypot(px - bx, py - by))
        away = math.hypot(x - bx, y - by)
        if nearest >= config.clearance_m + SWAY_M or away < 1e-6:
            break
        x, y = x + 0.1 * (x - bx) / away, y + 0.1 * (y - by) / away
    return via


@compiled
def walk_on(
    draws: Floats, config: MotionConfig, spots: Floats, w: int, clock_s: float,
    traits: Floats, plan: Floats, prints: Floats, stance: Floats, size: Floats,
) -> float:  # fmt: skip
    """Choose another place and plan the walk to it; returns its duration [s]."""
    choose_place(draws, config, spots, w, clock_s)
    start = (plan[pl.START_X], plan[pl.START_Y], plan[pl.START_YAW])
    end = (spots[w, SPOT_X], spots[w, SPOT_Y], spots[w, SPOT_YAW])
    plan[pl.END_X], plan[pl.END_Y] = end[0], end[1]
    via = _via(draws[PLACE_DRAWS + 2], plan, config)
    pace = traits[pl.SPEED_TRAIT]
    return plan_walk(start, via, end, pace, plan, prints, stance, size)


@compiled
def next_work(draws: Floats, config: MotionConfig, near: bool) -> int:
    """Which activity a worker who stays at their place does next."""
    if near:
        return pl.REACH if draws[0] < config.near_reach_probability else pl.STAND
    if draws[0] < config.away_lift_probability:
        return pl.LIFT
    if draws[0] < config.away_lift_probability + config.away_reach_probability:
        return pl.REACH
    return pl.STAND


@compiled
def _target(
    draws: Floats, config: MotionConfig, near: bool, plan: Floats
) -> tuple[float, float, float]:
    """A world point for the hands: in the robot's workspace, or ahead of the worker."""
    z = between(draws[3], config.target_z_m)
    x, y = plan[pl.START_X], plan[pl.START_Y]
    if not near:
        ahead, left = 0.36 + 0.3 * draws[1], 0.7 * (draws[2] - 0.5)
        cos, sin = math.cos(plan[pl.START_YAW]), math.sin(plan[pl.START_YAW])
        return x + cos * ahead - sin * left, y + sin * ahead + cos * left, z
    bx, by = config.robot_xy_m
    own = math.hypot(x - bx, y - by)
    low, high = config.target_radius_m
    radius = between(draws[1], (min(low, own - BODY_M), min(high, own - BODY_M)))
    azimuth = math.atan2(y - by, x - bx) + config.target_spread_rad * (2.0 * draws[2] - 1.0)
    return bx + radius * math.cos(azimuth), by + radius * math.sin(azimuth), z


@compiled
def start_reach(
    draws: Floats, config: MotionConfig, near: bool, traits: Floats, plan: Floats,
    offset: Floats, frame: Floats, size: Floats, q: Floats, p: Floats, r: Floats,
) -> float:  # fmt: skip
    """Draw a reach: where to, with which hand, how fast, for how long."""
    target = _target(draws, config, near, plan)
    dx, dy = target[0] - plan[pl.START_X], target[1] - plan[pl.START_Y]
    side = wrap(math.atan2(dy, dx) - plan[pl.START_YAW])
    right = 0.5 + (traits[pl.RIGHT_HANDED] - 0.5) * math.exp(-((side / 0.2) ** 2))
    right = min(max(right - side / 0.4, 0.0), 1.0)
    used = (0.0, 1.0) if draws[4] < right else (1.0, 0.0)
    if draws[5] < config.two_hands_probability and abs(side) < 0.6:
        used = (1.0, 1.0)
    sudden = draws[6] < config.sudden_probability
    peak = config.sudden_speed_m_s if sudden else between(draws[7], config.hand_speed_m_s)
    hold = 0.15 + 0.2 * draws[8] if sudden else between(draws[8], config.hold_s)
    fidget = (0.035 * draws[9] * draws[9], 0.6 + 0.8 * draws[10])
    plan[pl.OUT_AT] = 0.05 if sudden else 0.1 + 0.5 * draws[11]
    return plan_reach(target, used, peak, hold, fidget, plan, traits, offset, frame, size, q, p, r)


@compiled
def start_lift(
    draws: Floats, config: MotionConfig, traits: Floats, plan: Floats,
    offset: Floats, frame: Floats, size: Floats, q: Floats, p: Floats, r: Floats,
) -> float:  # fmt: skip
    """Draw a lift: where the load stands and how long bending, raising and holding take."""
    plan[pl.OUT_AT] = 0.1 + 0.4 * draws[11]
    times = (between(draws[1], config.lift_s), between(draws[2], config.lift_s), 0.3 + draws[3])
    z = between(draws[4], config.load_z_m)
    ahead = 0.38 + 0.08 * draws[5]
    return plan_lift(ahead, z, times, plan, traits, offset, frame, size, q, p, r)
