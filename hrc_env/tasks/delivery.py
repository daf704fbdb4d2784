"""Delivering: a base that drives brings material across a site, among the people who work there.

Zones lie where there is room and nobody's workplace; an episode has two of them, far enough apart.
The material is on the bed from the start, and counts as delivered when the base stands in its
zone; nothing is unloaded. The map of what stands there is known: the way to the zone, which leads
round all of it, and the ranges of the base's scanner are of that map, not of pictures. People are
not on it: they are known by the estimate only.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hrc_env.core.errors import ConfigError, check_fields
from hrc_env.core.kernels import kernel
from hrc_env.core.records import RobotState
from hrc_env.core.typing import Bools, Floats, Ints, JointAngles, Points3, Records, Rngs
from hrc_env.geometry.ways import (
    find_overlaps,
    gaps_m,
    nearest_point,
    ranges_m,
    select_apart,
    value_at,
    ways_m,
)
from hrc_env.observations import ObservationTerm
from hrc_env.rewards import RewardTerm, check_kind, progress
from hrc_env.tasks import BUILT_IN
from hrc_env.tasks.task import Task
from hrc_env.world import Grounds, World

CELL_M, AROUND_M = 0.2, 3.0
"""Grid of the map; how far beyond where people walk the base may drive [m]."""
HALF_WIDTH_M, ROUND_M = 0.40, 0.66
"""Nearer to anything the base's middle cannot be; from here on it may turn as it likes [m]."""
TIGHT, ROOMY_M = 3.0, 0.75
"""A metre of a way between the two counts so often; zones have so much room at least [m]."""
OFF_WORK_M, APART_M = 1.6, 1.6
"""Zones are so far from workplaces, and from each other [m]."""
START_M, RAYS, RANGE_M = 0.2, 24, 6.0
"""Bases start within so much of a zone's middle; rays of the scanner, and how far they reach."""
ANGLES = 2 * np.pi * np.arange(RAYS) / RAYS
AHEAD_M = 0.4
"""The direction of the way is that of its fall over so much to each side [m]."""
MARKED_M = 0.05
"""Pictures show the zone so high [m]."""


@dataclass(frozen=True, slots=True)
class DeliveryConfig:
    """What counts as delivered, and what that is worth."""

    way_m: tuple[float, float] = (7.0, 16.0)
    """Length of the way between start and destination [m]."""
    zone_m: float = 0.4
    """The base is in its zone when its middle is nearer to the zone's than this [m],"""
    standing_m_s: float = 0.05
    """and stands there when it is slower than this [m/s]."""
    reward: str = "dense"
    """"dense": coming nearer counts, too; "sparse": only the delivery."""
    progress_per_m: float = 1.0
    """Dense reward for every metre of the way that the base leaves behind."""
    delivered_bonus: float = 20.0
    """Reward for the delivery."""
    hit_penalty: float = 5.0
    """Taken off, dense and sparse, whenever the base begins to touch what stands there."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "zone_m", "standing_m_s")
        check_fields(self, "not be negative", "progress_per_m", "delivered_bonus", "hit_penalty")
        low, high = self.way_m
        if not 0 < low < high:
            raise ConfigError(f"DeliveryConfig.way_m must be (low, high) [m], got {self.way_m}.")
        check_kind(self)


@dataclass(frozen=True, slots=True, eq=False)
class Site:
    """What the task makes of a place."""

    footprints: Floats
    """(N, 5) of what stands there."""
    origin: Floats
    """(2,) first point of the grids [m]."""
    gaps: Floats
    """(X, Y) distance from what stands there [m]."""
    zones: Floats
    """(Z, 2) where material may begin and go [m]."""
    ways: Floats
    """(Z, X, Y) length of the way to each zone [m]."""
    lengths: Floats
    """(Z, Z) of the way from each zone to each [m]."""


DELIVERY = np.dtype(
    [
        ("zone", "i8"),  # where the material goes
        ("goal_world", "f8", (2,)),  # the same [m]
        ("way_m", "f8"),  # what is left of the way [m]
        ("way_direction", "f8", (2,)),  # where it leads
        ("ranges_m", "f8", (RAYS,)),  # of the scanner [m]
        ("touching", "?"),  # whether the base touches what stands there
        ("people", "?"),  # whether it touches a worker
        ("hits", "i8", (2,)),  # how often it began to: what stands there, people
        ("delivered", "?"),
    ],
    align=True,
)
"""The task of one environment."""
DELIVERY_STEP = np.dtype([("progress_m", "f8"), ("hit", "?"), ("delivered", "?")], align=True)
"""Metres of the way that were gained in a step; whether something was hit, and the end."""


@dataclass(frozen=True, slots=True)
class DeliveryView:
    """The robots' view of their task."""

    goal_world: Floats
    """(B, 2) middle of the zone [m]."""
    way_m: Floats
    """(B,)."""
    way_direction: Floats
    """(B, 2)."""
    ranges_m: Floats
    """(B, RAYS)."""


def _fit(site: Site, config: DeliveryConfig) -> Bools:
    """(Z, Z) whether the way from one zone to another has the length that is wanted."""
    low, high = config.way_m
    return (site.lengths >= low) & (site.lengths <= high)


def _look(state: Records, robot: RobotState, site: Site) -> None:
    """What is left of the way, where it leads, and what the scanner measures on the map."""
    state["ranges_m"] = ranges_m(robot.q, ANGLES, site.gaps, site.origin, CELL_M, RANGE_M)
    _follow(robot.q, site.ways, site.origin, state)


@kernel
def _follow(q: Floats, ways: Floats, origin: Floats, state: Records) -> None:
    for b in range(len(q)):
        now, x, y = state[b], q[b, 0], q[b, 1]
        field = ways[now.zone]
        now.way_m = value_at(x, y, field, origin, CELL_M)
        dx, dy = now.goal_world[0] - x, now.goal_world[1] - y
        if now.way_m > 2 * AHEAD_M:
            dx = value_at(x - AHEAD_M, y, field, origin, CELL_M)
            dx -= value_at(x + AHEAD_M, y, field, origin, CELL_M)
            dy = value_at(x, y - AHEAD_M, field, origin, CELL_M)
            dy -= value_at(x, y + AHEAD_M, field, origin, CELL_M)
        length = max(math.hypot(dx, dy), 1e-6)
        now.way_direction[0], now.way_direction[1] = dx / length, dy / length


class Delivery(Task[DeliveryConfig, Records]):
    """Bring material across a construction site, among the workers, and hit nothing."""

    id = "HRCDelivery-v0"
    config_type = DeliveryConfig
    observations = (
        ObservationTerm(
            "zone_from_base", 2, "m", "world", 20.0, 5.0,
            "From the middle of the base to that of its zone, x and y.",
            lambda now: now.task.goal_world - now.robot.q[:, :2],
        ),
        ObservationTerm(
            "way_left", 1, "m", "-", 30.0, 5.0,
            "Length of the way to the zone round what stands there, by the map.",
            lambda now: now.task.way_m,
        ),
        ObservationTerm(
            "way_direction", 2, "-", "world", 1.0, 1.0,
            "Unit vector along that way from where the base is, x and y.",
            lambda now: now.task.way_direction,
        ),
        ObservationTerm(
            "ranges", RAYS, "m", "world", RANGE_M, 2.0,
            "From the middle of the base to what stands there by the map, at 24 angles from the x "
            "axis to the left, 15 degrees apart; people are not on the map.",
            lambda now: now.task.ranges_m,
        ),
    )  # fmt: skip
    rewards = (
        progress("Metres of the way that the base left behind"),
        RewardTerm(
            "delivered",
            "`task.delivered_bonus` for the step in which the base stands in its zone.",
            lambda now, step, previous, config: config.delivered_bonus * step["delivered"],
        ),
        RewardTerm(
            "hit",
            "Minus `task.hit_penalty` when the base begins to touch what stands there.",
            lambda now, step, previous, config: -config.hit_penalty * step["hit"],
        ),
    )
    achieved = "task/delivered"
    failed = "task/not_delivered"
    max_episode_steps = BUILT_IN[id].max_episode_steps
    robot = "mobile_base"
    needs_mobile_base = True
    scene = "site"
    n_workers = 4
    viewpoint = "yard"
    defaults: ClassVar = {
        "control": {"joint_speed_share": 1.0},
        "motion": {"near_probability": 0.0},
    }

    def make_state(self, batch: int) -> Records:
        return np.zeros(batch, DELIVERY)

    def survey(self, grounds: Grounds) -> Site:
        """Return the zones of a place and the ways between them.

        Raises:
            ConfigError: no two zones are far enough apart.
        """
        (x0, x1), (y0, y1) = grounds.walkable_x_m, grounds.walkable_y_m
        xs = np.arange(x0 - AROUND_M, x1 + AROUND_M, CELL_M, dtype=float)
        ys = np.arange(y0 - AROUND_M, y1 + AROUND_M, CELL_M, dtype=float)
        origin, gaps = np.array([xs[0], ys[0]]), gaps_m(xs, ys, grounds.blocked)
        roomy = (gaps > ROOMY_M) & ((xs > x0) & (xs < x1))[:, None] & ((ys > y0) & (ys < y1))
        points: Floats = np.asarray(np.argwhere(roomy) * CELL_M + origin, np.float64)
        works = np.array([place.xy_m for place in grounds.places]).reshape(-1, 2)
        away = np.linalg.norm(points[:, None] - works, axis=-1).min(1, initial=np.inf)
        points = points[away > OFF_WORK_M]
        zones = points[select_apart(points, APART_M)] if len(points) else points
        price = np.where(gaps > ROUND_M, 1.0, np.where(gaps > HALF_WIDTH_M, TIGHT, np.inf))
        cells = [nearest_point(x, y, origin, CELL_M) for x, y in zones.tolist()]
        ways = np.array([ways_m(price, cell, CELL_M) for cell in cells]).reshape(-1, *gaps.shape)
        lengths = np.array([ways[:, i, j] for i, j in cells]).reshape(len(zones), len(zones)).T
        low, high = self.config.way_m
        if not ((lengths >= low) & (lengths <= high)).any():
            longest = lengths.max(initial=0.0)
            raise ConfigError(
                f"HRCDelivery-v0 needs a place with two zones that a way of {low:g} to {high:g} m "
                f"joins; here are {len(zones)} zones, and the longest way is {longest:.1f} m. "
                'Valid is scene="site", or other task.way_m.'
            )
        return Site(grounds.blocked, origin, gaps, zones, ways, lengths)

    def draw_start(
        self, rngs: Rngs, place: Site, home_q: JointAngles, spread_rad: Floats
    ) -> JointAngles:
        """(n, 3) where bases begin: in a zone from which another is far enough, turned anyhow."""
        fit = _fit(place, self.config).any(1)
        places = []
        for rng in rngs:
            zone = rng.choice(np.flatnonzero(fit))
            shift = START_M * (2.0 * rng.random(2) - 1.0)
            places.append([*(place.zones[zone] + shift), np.pi * (2.0 * rng.random() - 1.0)])
        return np.array(places).reshape(-1, 3)

    def reset(self, state: Records, ids: Ints, rngs: Rngs, world: World) -> None:
        """Choose where the material of environments `ids` goes."""
        site: Site = world.place
        state[ids] = np.zeros((), DELIVERY)
        for b, (x, y) in zip(ids.tolist(), world.robot.q[:, :2].tolist(), strict=True):
            here = int(np.argmin(np.hypot(*(site.zones - [x, y]).T)))
            zone = rngs[b].choice(np.flatnonzero(_fit(site, self.config)[here]))
            state["zone"][b], state["goal_world"][b] = zone, site.zones[zone]
        own = state[ids]
        _look(own, world.robot, site)
        state[ids] = own

    def advance(self, state: Records, rngs: Rngs, world: World, dt_s: float) -> Records:
        """Judge where the bases are; (B,) of `DELIVERY_STEP`."""
        site, robot, step = world.place, world.robot, np.zeros(len(state), DELIVERY_STEP)
        step["progress_m"] = state["way_m"]
        _look(state, robot, site)
        step["progress_m"] -= state["way_m"]
        touching = find_overlaps(robot.capsules_world, robot.capsule_radius_m, site.footprints)
        people = np.zeros(len(state), bool) if world.touched is None else world.touched
        step["hit"] = touching & ~state["touching"]
        state["hits"][:, 0] += step["hit"]
        state["hits"][:, 1] += people & ~state["people"]
        state["touching"], state["people"] = touching, people
        off_m = np.linalg.norm(robot.q[:, :2] - state["goal_world"], axis=1)
        speed_m_s = np.linalg.norm(robot.qd[:, :2], axis=1)
        step["delivered"] = (off_m < self.config.zone_m) & (speed_m_s < self.config.standing_m_s)
        state["delivered"] |= step["delivered"]
        return step

    def is_terminal(self, step: Records) -> Bools:
        return step["delivered"]

    def view(self, state: Records, ids: Ints) -> DeliveryView:
        """What robots `ids` know of their task."""
        own = state[ids]
        return DeliveryView(own["goal_world"], own["way_m"], own["way_direction"], own["ranges_m"])

    def info(self, state: Records) -> dict[str, Floats]:
        """What the episode has come to so far, (B,) each: delivered counts if nothing was hit."""
        delivered = (state["delivered"] & ~state["hits"].any(1)).astype(float)
        return {
            "task/delivered": delivered,
            "task/not_delivered": 1.0 - delivered,
            "task/fixed_hits": state["hits"][:, 0].astype(float),
            "task/people_hits": state["hits"][:, 1].astype(float),
            "task/way_left_m": state["way_m"].copy(),
            "is_success": delivered,
        }

    def markers(self, view: DeliveryView) -> Points3:
        return np.insert(view.goal_world, 2, MARKED_M, axis=1)[:, None]
