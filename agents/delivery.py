"""Scripted delivery by a mobile base, which uses only the observation and the map.

The route descends a cost-to-go field of path lengths to the zone (Dijkstra), in which cells near
standing people have a higher cost. Fields are cached, since they change only when a person stops or
starts walking. Velocities are chosen as in the dynamic window approach (Fox, Burgard and Thrun
1997, doi:10.1109/100.580977): each candidate is scored by the positions that it reaches in the next
two seconds, from their path length and their clearance to obstacles and to the predicted positions
of people. The base drives around people who stand and wait for it, to avoid a deadlock.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.skeleton import N_JOINTS
from hrc_env.geometry.ways import gaps_m, nearest_point, ways_m
from hrc_env.observations import split

from .env_info import EnvInfo, Observation
from .scripted import Yielding

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
CELL_M = 0.2
"""Cell size of the cost-to-go fields [m]."""
BEYOND_M = 3.0
"""Margin of the cost-to-go fields around the area where people walk [m]."""
FREE_M, NARROW_M, DEAR = 0.68, 0.54, 4.0
"""Clearance above which ground is free [m], minimum clearance of a route [m], and cost factor for
clearances between the two.
"""
BODY_M, BASE_M, DISC_M, DISC_AT_M = 0.30, 0.60, 0.47, 0.22
"""Radii of a person, of the base in any orientation, and of two discs that contain it [m].

The discs are `DISC_AT_M` ahead of and behind the centre of the base.
"""
STANDS_M_S, STOOD_M, STOOD_DEAR, SPOT_M = 0.25, 1.1, 6.0, 0.4
"""Speed below which a person counts as standing [m/s], radius around them within which ground has a
higher cost [m], factor on this cost, and resolution of their position [m].

Positions of standing people are rounded to multiples of `SPOT_M`.
"""
BRAKE_M_S2, GONE_S, KEEP_M = 1.5, 0.3, 0.2
"""Parameters of the maximum speed towards a person, sqrt(2 a (gap - GONE_S v - KEEP_M)).

Here a is the deceleration `BRAKE_M_S2` and v the person's speed.
"""
SPEEDS_M_S, HEADINGS = (0.25, 0.6, 1.0, 1.35), 24
"""Speeds of the candidate velocities [m/s], and number of their headings."""
TIMES_S = np.array([0.2, 0.5, 0.8, 1.2, 1.6, 2.0])
"""Times after which candidate velocities are evaluated [s]."""
NEAR_M, NEAR_GAIN_HZ, STOP_M = 1.0, 1.2, 0.15
"""Distance below which the base drives straight to the zone [m], gain of this approach [1/s], and
distance below which it stops [m].
"""
GOOD_M, PEOPLE_PRICE, TOUCH_PRICE, FAST_PRICE, WALL_PRICE = 0.7, 6.0, 60.0, 20.0, 200.0
"""Clearance to people above which there is no cost [m], and weights of the costs, relative to a
metre of the route.
"""
BESIDE_M, NEAR_PRICE = 0.25, 4.0
"""Additional clearance to obstacles [m], and weight of the cost of a smaller one.

This clearance allows for the errors of a policy that imitates this agent.
"""
SLOW_M_S, STAY_M = 0.2, 0.25
"""Speed below which the base turns along the route [m/s], and separation from workers below which
it does not turn at such speeds [m].
"""
CHANGE_PRICE_S, TURN_HZ, TURN_RAD_S = 0.1, 1.5, 1.0
"""Weight of the cost of a change of velocity [s], gain of turns [1/s], and maximum turn rate
[rad/s].
"""
FIELDS = 1024
"""Number of cost-to-go fields in the cache."""


class People(NamedTuple):
    """Estimated workers relative to each base; untracked ones get a position far away."""

    position: Array
    """Horizontal positions relative to the base (n, W, 2) [m]."""
    velocity: Array
    """Horizontal velocities (n, W, 2) [m/s]."""


class Cells(NamedTuple):
    """Indices of the grid cells that contain some positions, and the offsets within the cells."""

    i: Indices
    j: Indices
    u: Array
    """Offset along the first axis, as a fraction of the cell size."""
    v: Array
    """Offset along the second axis, as a fraction of the cell size."""


class Deliverer:
    """An agent that drives along a planned route and can slow down near people."""

    def __init__(self, env_info: EnvInfo, yielding: Yielding | None = None) -> None:
        self.env_info, self.yielding = env_info, yielding
        grounds = env_info.map
        (x0, x1), (y0, y1) = grounds.walkable_x_m, grounds.walkable_y_m
        self._xs = np.arange(x0 - BEYOND_M, x1 + BEYOND_M, CELL_M)
        self._ys = np.arange(y0 - BEYOND_M, y1 + BEYOND_M, CELL_M)
        self._origin = np.array([self._xs[0], self._ys[0]])
        self._gaps = gaps_m(self._xs, self._ys, grounds.blocked)
        self._price = np.where(self._gaps > FREE_M, 1.0, DEAR)
        self._price[self._gaps < NARROW_M] = np.inf
        self._fields = np.zeros((FIELDS, *self._gaps.shape), np.float32)
        self._rows: dict[tuple[tuple[int, int], ...], int] = {}
        angles = 2 * np.pi * np.arange(HEADINGS) / HEADINGS
        heads = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        self._window = np.concatenate([np.zeros((1, 2)), *(s * heads for s in SPEEDS_M_S)])
        fastest = env_info.chain.velocity_limit_rad_s
        self._most = env_info.control_config.joint_speed_share * fastest

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return actions (..., 3) that drive to the zone and avoid people."""
        terms = split(observation, self.env_info.layout)
        shape = terms["slide_position"].shape[:-1]
        terms = {name: np.atleast_2d(term) for name, term in terms.items()}
        place, speed = terms["slide_position"], terms["slide_velocity"]
        yaw = np.arctan2(terms["joint_angle_sin"], terms["joint_angle_cos"])[:, 0]
        people = _read_people(terms)
        field = self._find_fields(place, terms["zone_from_base"], people)
        velocity = self._choose_velocity(place, speed, yaw, terms["zone_from_base"], field, people)
        driving = np.linalg.norm(velocity, axis=1, keepdims=True) > SLOW_M_S
        turn = self._compute_turn(place, yaw, np.where(driving, velocity, terms["path_direction"]))
        near_m = terms["worker_separation"].min(axis=-1, initial=np.inf)
        waits = (near_m < STAY_M) | (np.linalg.norm(terms["zone_from_base"], axis=1) < NEAR_M)
        turn = np.where(waits & ~driving[:, 0], 0.0, turn)
        if self.yielding is not None:
            share = self.yielding.share(near_m)
            share *= self.yielding.blind_share(
                terms, share * (np.linalg.norm(velocity, axis=1) + BASE_M * np.abs(turn))
            )
            velocity, turn = velocity * share[:, None], turn * share
        action = np.concatenate([velocity, turn[:, None]], axis=1) / self._most
        action = np.clip(action, -1.0, 1.0)
        return action.reshape(*shape, -1).astype(np.float32)

    def _find_fields(self, place: Array, zone: Array, people: People) -> Indices:
        """Return the indices (n,) of the cached fields for each base's zone and standing people."""
        stands = np.linalg.norm(people.velocity, axis=-1) < STANDS_M_S
        spots = np.rint((place[:, None] + people.position) / SPOT_M)
        rows = np.empty(len(place), np.int64)
        if len(place) > len(self._fields):  # all current fields must fit
            self._fields, self._rows = np.zeros((len(place), *self._gaps.shape), np.float32), {}
        for b, (x, y) in enumerate((place + zone).tolist()):
            standing = {(int(i), int(j)) for i, j in spots[b, stands[b]] if abs(i) < 1e3}
            key = (nearest_point(x, y, self._origin, CELL_M), *sorted(standing))
            row = self._rows.pop(key, None)
            self._rows[key] = rows[b] = self._make_field(key) if row is None else row
        return rows

    def _make_field(self, key: tuple[tuple[int, int], ...]) -> int:
        """Compute a field, which replaces the least recently used one in a full cache.

        The result is the field's index.
        """
        row = len(self._rows)
        if row == len(self._fields):
            row = self._rows.pop(next(iter(self._rows)))
        goal, *standing = key
        price = self._price
        for i, j in standing:
            away = np.hypot(self._xs[:, None] - SPOT_M * i, self._ys - SPOT_M * j)
            price = price * np.where(away < STOOD_M, STOOD_DEAR, 1.0)
        self._fields[row] = ways_m(price, goal, CELL_M)
        return row

    def _choose_velocity(
        self, place: Array, speed: Array, yaw: Array, zone: Array, field: Indices, people: People
    ) -> Array:
        """Return the candidate velocities (n, 2) of lowest cost [m/s]."""
        n, away_m = len(place), np.linalg.norm(zone, axis=1)
        straight = (
            zone * np.minimum(NEAR_GAIN_HZ, SPEEDS_M_S[-1] / np.maximum(away_m, 1e-6))[:, None]
        )
        window = np.broadcast_to(self._window, (n, *self._window.shape))
        window = np.concatenate([straight[:, None], window], axis=1)
        shift = _predict_shifts(speed[:, None], window)  # (n, C, T, 2)
        at = place[:, None, None] + shift
        ahead = DISC_AT_M * np.stack([np.cos(yaw), np.sin(yaw)], axis=1)[:, None, None]
        room = np.minimum(
            self._interpolate(self._gaps, at + ahead), self._interpolate(self._gaps, at - ahead)
        )
        price = WALL_PRICE * np.maximum(DISC_M - room, 0.0).sum(-1)
        price += NEAR_PRICE * np.maximum(DISC_M + BESIDE_M - room, 0.0).sum(-1)
        price += self._get_lengths(field, at[:, :, -1]) + 0.5 * self._get_lengths(
            field, at[:, :, 2]
        )
        price += CHANGE_PRICE_S * np.linalg.norm(window - speed[:, None], axis=-1)
        price += _price_people(shift, window, people)
        direct = (away_m < NEAR_M) & (price[:, 0] < price[:, 1:].min(1) + 1.0)
        best = window[np.arange(n), np.where(direct, 0, np.argmin(price, axis=1))]
        return np.where((away_m < STOP_M)[:, None], 0.0, best)

    def _get_lengths(self, field: Indices, at: Array) -> Array:
        """Return the path costs (n, C) from positions (n, C, 2) to the zone [m]."""
        i, j, u, v = self._locate(at)
        k = field[:, None]
        low = self._fields[k, i, j] * (1 - v) + self._fields[k, i, j + 1] * v
        high = self._fields[k, i + 1, j] * (1 - v) + self._fields[k, i + 1, j + 1] * v
        return low * (1 - u) + high * u

    def _interpolate(self, grid: Array, at: Array) -> Array:
        """Return bilinearly interpolated values of a grid at positions (..., 2)."""
        i, j, u, v = self._locate(at)
        low = grid[i, j] * (1 - v) + grid[i, j + 1] * v
        return low * (1 - u) + (grid[i + 1, j] * (1 - v) + grid[i + 1, j + 1] * v) * u

    def _locate(self, at: Array) -> Cells:
        most = np.array(self._gaps.shape) - 1.001
        cells = np.clip((at - self._origin) / CELL_M, 0.0, most)
        low = cells.astype(np.int64)
        share = cells - low
        return Cells(low[..., 0], low[..., 1], share[..., 0], share[..., 1])

    def _compute_turn(self, place: Array, yaw: Array, towards: Array) -> Array:
        """Return turn rates (n,) towards directions (n, 2) [rad/s], or 0 where there is no room."""
        wanted = np.arctan2(towards[:, 1], towards[:, 0])
        error = (wanted - yaw + np.pi) % (2 * np.pi) - np.pi
        rate = np.clip(TURN_HZ * error, -TURN_RAD_S, TURN_RAD_S)
        then = yaw + 0.4 * np.sign(rate)
        ahead = DISC_AT_M * np.stack([np.cos(then), np.sin(then)], axis=1)
        gaps = self._gaps
        room = np.minimum(
            self._interpolate(gaps, place + ahead), self._interpolate(gaps, place - ahead)
        )
        roomy = self._interpolate(gaps, place) > BASE_M + 0.04
        return np.where(roomy | (room > DISC_M), rate, 0.0)


def _read_people(terms: dict[str, Array]) -> People:
    """Extract the estimated workers from the terms of an observation."""
    n = len(terms["remaining_path"])
    joints = terms["worker_joints_from_tool"].reshape(n, -1, N_JOINTS, 3)[..., :2].mean(2)
    moving = terms["worker_joints_velocity"].reshape(n, -1, N_JOINTS, 3)[..., :2].mean(2)
    known = (terms["worker_tracked"] > 0.5)[..., None]
    return People(np.where(known, joints, 1e4), np.where(known, moving, 0.0))


def _predict_shifts(speed: Array, window: Array) -> Array:
    """Return displacements (n, C, T, 2) of the base while it accelerates to each velocity."""
    change = window - speed
    ramp = np.abs(change) / BRAKE_M_S2
    t, ramp, change = TIMES_S[:, None], ramp[:, :, None], change[:, :, None]
    early = 0.5 * BRAKE_M_S2 * np.sign(change) * t**2 + speed[:, :, None] * t
    late = window[:, :, None] * t - 0.5 * change * ramp
    return np.where(t < ramp, early, late)


def _price_people(shift: Array, window: Array, people: People) -> Array:
    """Return the cost (n, C) of future proximity to people, and of driving towards them."""
    price = np.zeros(shift.shape[:2])
    for w in range(people.position.shape[1]):
        position, moving = people.position[:, w], people.velocity[:, w]
        there = position[:, None] + moving[:, None] * TIMES_S[:, None]  # (n, T, 2)
        gap = np.linalg.norm(there[:, None] - shift, axis=-1) - BODY_M - BASE_M
        price += PEOPLE_PRICE * np.square(np.maximum(GOOD_M - gap, 0.0)).sum(-1)
        price += TOUCH_PRICE * np.maximum(0.1 - gap, 0.0).sum(-1)
        away_m = np.linalg.norm(position, axis=-1)
        towards = position / np.maximum(away_m, 1e-6)[:, None]
        walking = np.linalg.norm(moving, axis=-1)
        left_m = np.maximum(away_m - BODY_M - BASE_M - GONE_S * walking - KEEP_M, 0.0)
        closing = (window * towards[:, None]).sum(-1)
        most = np.sqrt(2 * BRAKE_M_S2 * left_m)[:, None]
        price += FAST_PRICE * np.maximum(closing - most, 0.0)
    return price
