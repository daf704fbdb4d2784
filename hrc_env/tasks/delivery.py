"""Delivery: a mobile base transports material across a construction site where people work.

Zones are areas of free floor away from workplaces. In an episode, the base starts in one zone and
drives to another. The material is on the bed from the start, and is delivered when the base stands
in the destination zone; it is not unloaded. The map of the obstacles is known: the path to the
zone, which avoids all obstacles, and the ranges of the base's scanner are computed from that map,
not from images. People are not on the map; they are observed only by cameras.
"""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from hrc_env.core.declared import Records1, dtype_of, make_records
from hrc_env.core.errors import ConfigError, check_fields
from hrc_env.core.kernels import kernel
from hrc_env.core.records import RobotState
from hrc_env.core.typing import Bools, Floats, Ints, JointAngles, Points3, Rngs
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

CELL_M = 0.2
"""Spacing of the grid points of the map [m]."""
MAP_BORDER_M = 3.0
"""Width of the map's border around the area where people walk, on which the base may also drive
[m]."""
HALF_WIDTH_M = 0.40
"""Minimum distance of the base's centre from an obstacle [m]."""
TURNING_RADIUS_M = 0.66
"""Distance from an obstacle beyond which the base may have any heading [m]."""
NARROW_COST = 3.0
"""Cost of a metre of the path within `TURNING_RADIUS_M` of an obstacle; elsewhere it is 1."""
ZONE_CLEARANCE_M = 0.75
"""Minimum distance of a zone's centre from an obstacle [m]."""
ZONE_FROM_WORK_M = 1.6
"""Minimum distance of a zone's centre from a workplace [m]."""
ZONE_SPACING_M = 1.6
"""Minimum distance between the centres of two zones [m]."""
START_M = 0.2
"""Largest offset of a base's initial position from the centre of its zone, along x and y [m]."""
RAYS = 24
"""Number of the scanner's rays."""
RANGE_M = 6.0
"""Maximum range of the scanner [m]."""
ANGLES = 2 * np.pi * np.arange(RAYS) / RAYS
"""(RAYS,) direction of each ray, counterclockwise from the world's x axis [rad]."""
GRADIENT_STEP_M = 0.4
"""Step of the central differences of the remaining path length [m]."""
MARKER_HEIGHT_M = 0.05
"""Height above the floor of the zone's marker in pictures [m]."""


@dataclass(frozen=True, slots=True)
class DeliveryConfig:
    """Criteria and rewards of a delivery."""

    way_m: tuple[float, float] = (7.0, 16.0)
    """Minimum and maximum length of the path from start to destination [m]."""
    zone_m: float = 0.4
    """Radius of a zone, within which the base's centre must come to rest [m]."""
    standing_m_s: float = 0.05
    """Speed below which the base is at rest [m/s]."""
    reward: str = "dense"
    """Kind of reward: "sparse" rewards only the delivery, "dense" also every metre of progress."""
    progress_per_m: float = 1.0
    """Dense reward for every metre by which the remaining path becomes shorter."""
    delivered_bonus: float = 20.0
    """Reward for the delivery."""
    hit_penalty: float = 5.0
    """Penalty for each new contact of the base with an obstacle, for both kinds of reward."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "zone_m", "standing_m_s")
        check_fields(self, "not be negative", "progress_per_m", "delivered_bonus", "hit_penalty")
        low, high = self.way_m
        if not 0 < low < high:
            raise ConfigError(f"DeliveryConfig.way_m must be (low, high) [m], got {self.way_m}.")
        check_kind(self)


@dataclass(frozen=True, slots=True, eq=False)
class Site:
    """The task's map of a scene: obstacles, zones and the paths between them."""

    footprints: Floats
    """(N, 5) footprints of the obstacles, as in `Grounds.blocked`."""
    origin: Floats
    """(2,) position of the grids' first point, x and y [m]."""
    gaps: Floats
    """(X, Y) distance of each grid point from the nearest obstacle [m]; negative inside an
    obstacle."""
    zones: Floats
    """(Z, 2) centres of the zones between which material is transported [m]."""
    ways: Floats
    """(Z, X, Y) length of the path from each grid point to each zone [m]."""
    lengths: Floats
    """(Z, Z) length of the path from each zone (row) to each other zone (column) [m]."""


class DeliveryState:
    """State of one environment's delivery."""

    zone: int
    """Index of the destination zone."""
    goal_world: Annotated[Floats, (2,)]
    """Centre of the destination zone, x and y [m]."""
    way_m: float
    """Length of the remaining path [m]."""
    way_direction: Annotated[Floats, (2,)]
    """Unit vector from the base along the remaining path, x and y."""
    ranges_m: Annotated[Floats, (RAYS,)]
    """Range that the scanner measures along each ray [m]."""
    touching: bool
    """Whether the base touches an obstacle."""
    people: bool
    """Whether the base touches a worker."""
    hits: Annotated[Ints, (2,)]
    """Numbers of contacts of the base with obstacles and with workers that began in this
    episode."""
    delivered: bool
    """Whether the material has been delivered."""


class DeliveryStep:
    """Results of one control step of one environment."""

    progress_m: float
    """Decrease of the length of the remaining path in this step [m]."""
    hit: bool
    """Whether a contact of the base with an obstacle began in this step."""
    delivered: bool
    """Whether the base is at rest in the destination zone."""


DELIVERY = dtype_of(DeliveryState)


@dataclass(frozen=True, slots=True)
class DeliveryView:
    """Information about the task that is available to the robots."""

    goal_world: Floats
    """(B, 2) centre of the destination zone, x and y [m]."""
    way_m: Floats
    """(B,) length of the remaining path according to the map [m]."""
    way_direction: Floats
    """(B, 2) unit vector from the base along the remaining path, x and y."""
    ranges_m: Floats
    """(B, RAYS) ranges of the scanner, computed from the map [m]."""


def _has_valid_length(site: Site, config: DeliveryConfig) -> Bools:
    """Return a mask (Z, Z) of the pairs of zones with a path length within `config.way_m`."""
    low, high = config.way_m
    return (site.lengths >= low) & (site.lengths <= high)


def _measure(state: Records1[DeliveryState], robot: RobotState, site: Site) -> None:
    """Update the remaining path, its direction and the scanner ranges for the robots' positions."""
    state["ranges_m"] = ranges_m(robot.q, ANGLES, site.gaps, site.origin, CELL_M, RANGE_M)
    _follow_ways(robot.q, site.ways, site.origin, state)


@kernel
def _follow_ways(q: Floats, ways: Floats, origin: Floats, states: Records1[DeliveryState]) -> None:
    """Update the length and the direction of each base's remaining path.

    Args:
        q: (B, 3) pose of each base, x, y [m] and heading [rad].
        ways: (Z, X, Y) length of the path from each grid point to each zone [m].
        origin: (2,) position of the grid's first point [m].
        states: (B,) states with the zones, in which `way_m` and `way_direction` are written.
    """
    for b in range(len(q)):
        state, x, y = states[b], q[b, 0], q[b, 1]
        field = ways[state.zone]
        state.way_m = value_at(x, y, field, origin, CELL_M)
        dx, dy = state.goal_world[0] - x, state.goal_world[1] - y
        if state.way_m > 2 * GRADIENT_STEP_M:
            dx = value_at(x - GRADIENT_STEP_M, y, field, origin, CELL_M)
            dx -= value_at(x + GRADIENT_STEP_M, y, field, origin, CELL_M)
            dy = value_at(x, y - GRADIENT_STEP_M, field, origin, CELL_M)
            dy -= value_at(x, y + GRADIENT_STEP_M, field, origin, CELL_M)
        length = max(math.hypot(dx, dy), 1e-6)
        state.way_direction[0], state.way_direction[1] = dx / length, dy / length


class Delivery(Task[DeliveryConfig, Records1[DeliveryState]]):
    """Transport material across a construction site without hitting obstacles or workers."""

    id = "HRCDelivery-v0"
    config_type = DeliveryConfig
    observations = (
        ObservationTerm(
            name="zone_from_base",
            size=2,
            unit="m",
            frame="world",
            bound=20.0,
            scale=5.0,
            doc="Center of the zone, relative to that of the base, in x and y.",
            function=lambda belief: belief.task.goal_world - belief.robot.q[:, :2],
        ),
        ObservationTerm(
            name="remaining_path",
            size=1,
            unit="m",
            frame="-",
            bound=30.0,
            scale=5.0,
            doc="Length of the path to the zone around the obstacles of the map.",
            function=lambda belief: belief.task.way_m,
        ),
        ObservationTerm(
            name="path_direction",
            size=2,
            unit="-",
            frame="world",
            bound=1.0,
            scale=1.0,
            doc="Unit vector along this path at the base, in x and y.",
            function=lambda belief: belief.task.way_direction,
        ),
        ObservationTerm(
            name="ranges",
            size=RAYS,
            unit="m",
            frame="world",
            bound=RANGE_M,
            scale=2.0,
            doc="Distances from the center of the base to the obstacles of the map in 24 "
            "directions, 15 degrees apart, counterclockwise from the x axis; people are not on the "
            "map.",
            function=lambda belief: belief.task.ranges_m,
        ),
    )
    rewards = (
        progress("Decrease of the remaining path [m]"),
        RewardTerm(
            name="delivered",
            doc="`task.delivered_bonus` in the step in which the base comes to rest in its zone.",
            function=lambda belief, step, previous, config: (
                config.delivered_bonus * step["delivered"]
            ),
        ),
        RewardTerm(
            name="hit",
            doc="Minus `task.hit_penalty` when the base begins to touch an obstacle.",
            function=lambda belief, step, previous, config: -config.hit_penalty * step["hit"],
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

    def make_state(self, batch: int) -> Records1[DeliveryState]:
        """Return the state of `batch` environments, to be filled by `reset`."""
        return make_records(DeliveryState, batch)

    def survey(self, grounds: Grounds) -> Site:
        """Compute the zones of a scene and the paths between them.

        Raises:
            ConfigError: no pair of zones has a path of a valid length.
        """
        (x0, x1), (y0, y1) = grounds.walkable_x_m, grounds.walkable_y_m
        xs = np.arange(x0 - MAP_BORDER_M, x1 + MAP_BORDER_M, CELL_M, dtype=float)
        ys = np.arange(y0 - MAP_BORDER_M, y1 + MAP_BORDER_M, CELL_M, dtype=float)
        origin, gaps = np.array([xs[0], ys[0]]), gaps_m(xs, ys, grounds.blocked)
        inside = ((xs > x0) & (xs < x1))[:, None] & ((ys > y0) & (ys < y1))
        roomy = (gaps > ZONE_CLEARANCE_M) & inside
        points: Floats = np.asarray(np.argwhere(roomy) * CELL_M + origin, np.float64)
        works = np.array([place.xy_m for place in grounds.places]).reshape(-1, 2)
        away = np.linalg.norm(points[:, None] - works, axis=-1).min(1, initial=np.inf)
        points = points[away > ZONE_FROM_WORK_M]
        zones = points[select_apart(points, ZONE_SPACING_M)] if len(points) else points
        narrow = np.where(gaps > HALF_WIDTH_M, NARROW_COST, np.inf)
        cost = np.where(gaps > TURNING_RADIUS_M, 1.0, narrow)
        cells = [nearest_point(x, y, origin, CELL_M) for x, y in zones.tolist()]
        ways = np.array([ways_m(cost, cell, CELL_M) for cell in cells]).reshape(-1, *gaps.shape)
        lengths = np.array([ways[:, i, j] for i, j in cells]).reshape(len(zones), len(zones)).T
        site = Site(grounds.blocked, origin, gaps, zones, ways, lengths)
        if not _has_valid_length(site, self.config).any():
            (low, high), longest = self.config.way_m, lengths.max(initial=0.0)
            raise ConfigError(
                f"HRCDelivery-v0 needs a scene with two zones that are joined by a path of {low:g} "
                f"to {high:g} m; this scene has {len(zones)} zones, and its longest path is "
                f'{longest:.1f} m. Valid is scene="site", or other task.way_m.'
            )
        return site

    def draw_start(
        self, rngs: Rngs, place: Site, home_q: JointAngles, spread_rad: Floats
    ) -> JointAngles:
        """Sample initial poses (n, 3) with random headings, in zones with a valid destination."""
        has_destination = _has_valid_length(place, self.config).any(1)
        starts: list[list[float]] = []
        for rng in rngs:
            zone = rng.choice(np.flatnonzero(has_destination))
            shift = START_M * (2.0 * rng.random(2) - 1.0)
            starts.append([*(place.zones[zone] + shift), np.pi * (2.0 * rng.random() - 1.0)])
        return np.array(starts).reshape(-1, 3)

    def reset(self, state: Records1[DeliveryState], ids: Ints, rngs: Rngs, world: World) -> None:
        """Sample the destination zones of environments `ids`."""
        site: Site = world.place
        state[ids] = np.zeros((), DELIVERY)
        valid = _has_valid_length(site, self.config)
        for b, (x, y) in zip(map(int, ids), world.robot.q[:, :2].tolist(), strict=True):
            start = int(np.argmin(np.hypot(*(site.zones - [x, y]).T)))
            zone = rngs[b].choice(np.flatnonzero(valid[start]))
            state["zone"][b], state["goal_world"][b] = zone, site.zones[zone]
        rows = state[ids]
        _measure(rows, world.robot, site)
        state[ids] = rows

    def advance(
        self, state: Records1[DeliveryState], rngs: Rngs, world: World, dt_s: float
    ) -> Records1[DeliveryStep]:
        """Evaluate the positions of the bases, and return the results (B,) of the step."""
        site, robot, step = world.place, world.robot, make_records(DeliveryStep, len(state))
        step["progress_m"] = state["way_m"]
        _measure(state, robot, site)
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

    def is_terminal(self, step: Records1[DeliveryStep]) -> Bools:
        """Return a mask (B,) of the environments in which the load was delivered in this step."""
        return step["delivered"]

    def view(self, state: Records1[DeliveryState], ids: Ints) -> DeliveryView:
        """Return the destination, remaining path and scanner ranges in environments `ids`."""
        rows = state[ids]
        return DeliveryView(
            rows["goal_world"], rows["way_m"], rows["way_direction"], rows["ranges_m"]
        )

    def info(self, state: Records1[DeliveryState]) -> dict[str, Floats]:
        """Return the results (B,) of the current episode by name.

        A delivery counts as a success only if the base hit neither an obstacle nor a worker.
        """
        delivered = (state["delivered"] & ~state["hits"].any(1)).astype(float)
        return {
            "task/delivered": delivered,
            "task/not_delivered": 1.0 - delivered,
            "task/obstacle_collisions": state["hits"][:, 0].astype(float),
            "task/worker_collisions": state["hits"][:, 1].astype(float),
            "task/remaining_path_m": state["way_m"].copy(),
            "is_success": delivered,
        }

    def markers(self, view: DeliveryView) -> Points3:
        """Return a point (B, 1, 3) above the zone of each environment [m]."""
        return np.insert(view.goal_world, 2, MARKER_HEIGHT_M, axis=1)[:, None]
