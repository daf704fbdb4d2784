"""Scripted holding of a drywall board, which uses only the observation.

The suction cups move above the board, descend onto it, and grip it. The board is lifted and set
upright, carried around the robot to a point in front of its target, and pressed against the studs
until it is fixed.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.observations import split

from .env_info import EnvInfo, Observation
from .manipulating import make_arm_action, plan_around_foot, turn_towards
from .scripted import Yielding, fastest_m_s, speed_m_s

Array = NDArray[np.float64]
HALF_THICK_M, CUPS_M = 0.00625, (-0.12, -0.15)
"""Offset of the board's face from its centre, and offsets of the suction cups across and along the
board [m].
"""
ABOVE_M, SUCK_M = 0.12, 0.05
"""Height above the board at which the suction cups travel, and distance below which suction is
switched on [m].
"""
OVER_M, OVER_RAD, FUNNEL_M, FUNNEL_RAD = 0.015, 0.05, 0.03, 0.2
"""Position and angle errors below which the cups descend onto the board [m, rad], and widths of the
funnel beyond these errors [m, rad].

Within the funnel, the height grows with the error, which keeps a policy that imitates this agent
from hesitating at one height.
"""
PRESS_M = 0.02
"""Depth below the board's surface of the suction cups' target [m]."""
FLAT_Z_M, UPRIGHT_Z_M = -0.12, 0.34
"""Heights relative to the robot's base between which the board is turned upright [m]."""
NEAR_M, FAR_M = 0.72, 1.0
"""Distances of the board from the robot's vertical axis when it is upright and on the stack [m]."""
BEFORE_M, ALIGNED_M, ALIGNED_RAD = 0.13, 0.012, 0.03
"""Distance in front of the target at which the board is aligned [m], and maximum errors of an
aligned board [m, rad].
"""
STAYS = 3.0
"""Factor on `ALIGNED_M` and `ALIGNED_RAD` for a board on its way to the studs, which still counts
as aligned within these wider limits.
"""
THERE_M = np.array([0.003, 0.0, 0.003])
"""Position errors along x, y and z below which the board is held still [m]; smaller errors are
noise.
"""
CORNER_M = 0.86
"""Distance of the board's farthest corner from the centre of the cups [m]."""
LAST_RAD = 0.25
"""Angle from the target around the robot below which the board moves in a straight line [rad]."""
CARRY_M_S, PRESS_M_S, TURN_RAD_S = 0.40, 0.12, 0.9
"""Maximum speeds with the board and against the studs [m/s]; maximum turn rate [rad/s]."""
STACK_RAD, PLACE_RAD = np.arctan2(-0.98, 0.26), np.arctan2(1.0, 0.29)
"""Directions from the robot to the stack and to the board's target [rad]."""


class ToolAxes(NamedTuple):
    """Desired axes of the tool, each (n, 3)."""

    x: Array
    z: Array


class Fetch(NamedTuple):
    """Motion of the tool while it fetches the board."""

    velocity: Array
    """Velocity of the tool (n, 3) [m/s]."""
    axes: ToolAxes
    near: NDArray[np.bool_]
    """Mask (n,) of environments in which the suction cups are close to the board."""


class Bring(NamedTuple):
    """Motion of the tool while it holds the board."""

    velocity: Array
    """Velocity of the tool (n, 3) [m/s]."""
    axes: ToolAxes


class Plan(NamedTuple):
    """Planned motion of the tool and state of its suction cups."""

    velocity: Array
    """Velocity of the tool's origin (n, 3) [m/s]."""
    turn: Array
    """Angular velocity of the tool (n, 3) [rad/s]."""
    sucks: NDArray[np.bool_]
    """Mask (n,) of environments in which suction is on."""


class BoardHolder:
    """An agent that carries and holds the board and can slow down near people."""

    def __init__(self, env_info: EnvInfo, yielding: Yielding | None = None) -> None:
        self.env_info, self.yielding = env_info, yielding
        self._foot = env_info.chain.T_world_from_base[:3, 3]

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return actions (..., A) that move to the board or carry it to its target."""
        terms = split(observation, self.env_info.layout)
        shape = terms["tool_position"].shape[:-1]
        terms = {name: np.atleast_2d(term) for name, term in terms.items()}
        velocity, turn, sucks = self._plan(terms)
        if self.yielding is not None:
            nearest_m = terms["worker_separation"].min(axis=-1, initial=np.inf)
            share = self.yielding.share(nearest_m)[:, None]
            share = np.where(_is_pressing(terms)[:, None], 1.0, share)
            velocity, turn = velocity * share, turn * share
        moves = make_arm_action(self.env_info, terms, velocity, turn)
        if self.yielding is not None:
            wanted_m_s = fastest_m_s(velocity, turn, CORNER_M)
            moves *= self.yielding.blind_share(terms, wanted_m_s)[:, None]
        action = np.concatenate([moves, 2.0 * sucks[:, None] - 1.0], axis=1)
        return action.reshape(*shape, -1).astype(np.float32)

    def _plan(self, terms: dict[str, Array]) -> Plan:
        held, fixed = terms["object_held"][:, 0] > 0.5, terms["screws_driven"][:, 0] > 3.5
        fetch, bring = self._fetch(terms), self._bring(terms)
        velocity = np.where(held[:, None], bring.velocity, fetch.velocity)
        x = np.where(held[:, None], bring.axes.x, fetch.axes.x)
        z = np.where(held[:, None], bring.axes.z, fetch.axes.z)
        turn = turn_towards(terms["tool_axes"], x, z, TURN_RAD_S)
        back = np.where(terms["place_from_object"][:, 1:2] < 0.3, [0.0, -0.2, 0.0], 0.0)
        off = np.linalg.norm(terms["object_from_tool"], axis=1)[:, None] < 0.25
        velocity = np.where(fixed[:, None], back * off, velocity)
        turn[fixed] = 0.0
        return Plan(velocity, turn, ~fixed & (held | fetch.near))

    def _fetch(self, terms: dict[str, Array]) -> Fetch:
        along, normal = terms["object_axes"][:, :3], terms["object_axes"][:, 3:]
        across = np.cross(along, normal)
        way = terms["object_from_tool"] + CUPS_M[0] * across + CUPS_M[1] * along
        way += (HALF_THICK_M - PRESS_M) * normal
        aside_m = np.linalg.norm(way[:, :2], axis=1)
        askew = np.linalg.norm(np.cross(terms["tool_axes"][:, 3:], -normal), axis=1)
        askew += np.linalg.norm(np.cross(terms["tool_axes"][:, :3], along), axis=1)
        off = np.maximum((aside_m - OVER_M) / FUNNEL_M, (askew - OVER_RAD) / FUNNEL_RAD)
        target = way.copy()
        target[:, 2] += ABOVE_M * np.clip(off, 0.0, 1.0)
        error = plan_around_foot(terms["tool_position"], target, self._foot[:2], 0.6)
        length = np.linalg.norm(error, axis=1, keepdims=True)
        most = np.where(way[:, 2:] > -0.03, PRESS_M_S, 0.5)
        velocity = error / np.maximum(length, 1e-9) * np.minimum(speed_m_s(length, 0.5), most)
        near = np.linalg.norm(way, axis=1) < SUCK_M
        return Fetch(velocity, ToolAxes(along, -normal), near)

    def _bring(self, terms: dict[str, Array]) -> Bring:
        board = terms["tool_position"] + terms["object_from_tool"] - self._foot
        to_place = terms["place_from_object"]
        angle = np.arctan2(board[:, 1], board[:, 0])
        height = np.clip((board[:, 2] - FLAT_Z_M) / (UPRIGHT_Z_M - 0.02 - FLAT_Z_M), 0.0, 1.0)
        last = angle > PLACE_RAD - LAST_RAD
        tilt = 0.5 * np.pi * np.where(last, 1.0, height)
        share = np.clip((angle - STACK_RAD) / (PLACE_RAD - LAST_RAD - STACK_RAD), 0.0, 1.0)
        heading = (share - 0.5) * np.pi
        outward = np.stack([np.cos(heading), np.sin(heading), np.zeros(len(heading))], axis=1)
        up, c, s = np.array([0.0, 0.0, 1.0]), np.cos(tilt)[:, None], np.sin(tilt)[:, None]
        axes = ToolAxes(c * outward + s * up, s * outward - c * up)
        velocity = self._carry(board, angle, height, share)
        velocity = np.where(last[:, None], _press(terms, to_place), velocity)
        return Bring(velocity, axes)

    def _carry(self, board: Array, angle: Array, height: Array, share: Array) -> Array:
        """Return the velocity (n, 3) that lifts the board and carries it around the robot."""
        radius = np.linalg.norm(board[:, :2], axis=1)
        outward = board[:, :2] / np.maximum(radius, 1e-6)[:, None]
        aside = np.stack([-outward[:, 1], outward[:, 0]], axis=1)
        wanted = FAR_M + (NEAR_M - FAR_M) * height
        inward = np.clip(3.0 * (wanted - radius), -CARRY_M_S, CARRY_M_S)
        rising = np.clip(3.0 * (UPRIGHT_Z_M - board[:, 2]), -0.2, 0.2)
        round_m_s = CARRY_M_S * (height > 0.97)
        flat = inward[:, None] * outward + round_m_s[:, None] * aside
        return np.concatenate([flat, rising[:, None]], axis=1)


def _press(terms: dict[str, Array], to_place: Array) -> Array:
    """Return the velocity (n, 3) to a point before the target or, once aligned, to the studs."""
    aligned, before = _is_aligned(terms), to_place - [0.0, BEFORE_M, 0.0]
    left = np.sign(to_place) * np.maximum(np.abs(to_place) - THERE_M, 0.0)
    error = np.where(aligned[:, None], left, before)
    length = np.linalg.norm(error, axis=1, keepdims=True)
    most = np.where(aligned[:, None], PRESS_M_S, CARRY_M_S)
    return error / np.maximum(length, 1e-9) * np.minimum(speed_m_s(length, CARRY_M_S), most)


def _is_aligned(terms: dict[str, Array]) -> NDArray[np.bool_]:
    """Return a mask (n,) of boards that are aligned in front of their target, or at it."""
    to_place, axes = terms["place_from_object"], terms["object_axes"]
    off = np.abs(to_place[:, [0, 2]]).max(1)
    askew = np.linalg.norm(np.cross(axes[:, 3:], [0.0, -1.0, 0.0]), axis=1)
    askew += np.linalg.norm(np.cross(axes[:, :3], [0.0, 0.0, 1.0]), axis=1)
    slack = np.where(to_place[:, 1] < 0.5 * BEFORE_M, STAYS, 1.0)
    fine = (off < slack * ALIGNED_M) & (askew < slack * ALIGNED_RAD)
    return fine & (to_place[:, 1] < BEFORE_M + 0.05)


def _is_pressing(terms: dict[str, Array]) -> NDArray[np.bool_]:
    """Return a mask (n,) of boards that are pressed at their target while people work on them."""
    return (terms["object_held"][:, 0] > 0.5) & (
        np.linalg.norm(terms["place_from_object"], axis=1) < 0.02
    )
