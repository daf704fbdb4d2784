"""Scripted picking and placing, which uses only the observation.

The agent needs no memory. If the fingers hold a piece, they lift it, carry it around the robot to a
point above its target, lower it, and open. Otherwise, they move above the first piece that is not
yet placed, descend, and close. `hrc_env.control` converts velocities of the tool to joint
velocities.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.observations import split

from .env_info import EnvInfo, Observation
from .manipulating import TURN_HZ, make_arm_action, plan_around_foot
from .scripted import Yielding, fastest_m_s, speed_m_s

Array = NDArray[np.float64]
ABOVE_M, CLEAR_M = 0.16, 0.11
"""Height above pieces at which the tool travels, and minimum height for sideways motion [m]."""
OVER_M, OVER_RAD, STILL_OVER_M = 0.006, 0.05, 0.015
"""Horizontal error [m] and angle error [rad] below which the tool starts to descend, and horizontal
error below which it continues [m].
"""
AT_M, STILL_AT_M = 0.007, 0.014
"""Distances to a piece's centre below which the fingers close, and stay closed [m].

The same distances of a held piece from its target determine when they open and stay open.
"""
PIECE_M = 0.15
"""Distance of a piece's end from the fingers [m]."""
LYING = 0.8
"""Cosine of the tilt below which a piece lies on its side; it is then ignored."""
ROUND_M = 0.50
"""Radius of the circle around the robot on which the tool travels [m].

It keeps the tool out of the space in front of the robot, which people use.
"""


@dataclass(frozen=True, slots=True)
class _View:
    """The quantities of observations that the agent uses, with one row per environment."""

    tool: Array
    """Position of the tool (n, 3) [m]."""
    finger_axis: Array
    """Unit vector from one finger to the other (n, 3)."""
    tool_axis: Array
    """Approach direction of the tool (n, 3)."""
    opening_m: Array
    """Opening of the fingers (n,) [m]."""
    to_piece: Array
    """Position of the first piece to place, relative to the tool (n, 3) [m]."""
    along: Array
    """Long axis of the piece (n, 3)."""
    to_place: Array
    """Target of the piece, relative to the piece (n, 3) [m]."""
    held: NDArray[np.bool_]
    """Mask (n,) of environments in which the fingers hold the piece."""
    nothing: NDArray[np.bool_]
    """Mask (n,) of environments in which no piece remains to be placed."""


class _Plan(NamedTuple):
    """Planned motion of the tool and command of its fingers."""

    velocity: Array
    """Velocity of the tool (n, 3) [m/s]."""
    turn: Array
    """Angular velocity of the tool (n, 3) [rad/s]."""
    grip: Array
    """Command of the fingers (n,): 1 closes, -1 opens."""


class PickPlacer:
    """An agent that picks and places by resolved-rate control and can slow down near people."""

    def __init__(self, env_info: EnvInfo, yielding: Yielding | None = None) -> None:
        self.env_info, self.yielding = env_info, yielding
        self._foot = env_info.chain.T_world_from_base[:2, 3]

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return actions (..., A) that move to the next piece or carry it to its target."""
        return self.act_on(split(observation, self.env_info.layout))

    def act_on(self, terms: dict[str, Array]) -> NDArray[np.float32]:
        """Return actions (..., A) for the terms of an observation (`EnvInfo.split`)."""
        shape = terms["tool_position"].shape[:-1]
        terms = {name: np.atleast_2d(term) for name, term in terms.items()}
        velocity, turn, grip = self._plan(_read_view(terms))
        if self.yielding is not None:
            nearest_m = terms["worker_separation"].min(axis=-1, initial=np.inf)
            share = self.yielding.share(nearest_m)[:, None]
            velocity, turn = velocity * share, turn * share
        moves = make_arm_action(self.env_info, terms, velocity, turn)
        if self.yielding is not None:
            moves *= self.yielding.blind_share(terms, fastest_m_s(velocity, turn, PIECE_M))[:, None]
        action = np.concatenate([moves, grip[:, None]], axis=1)
        return action.reshape(*shape, -1).astype(np.float32)

    def _plan(self, seen: _View) -> _Plan:
        held, at_place = seen.held, np.linalg.norm(seen.to_place, axis=1) < AT_M
        yaw = np.where(
            held, _find_turn_to_y(seen.along), _find_finger_turn(seen.finger_axis, seen.along)
        )
        way = np.where(held[:, None], seen.to_place, seen.to_piece)
        released = ~held & (np.linalg.norm(seen.to_place, axis=1) < STILL_AT_M)
        aside_m = np.linalg.norm(way[:, :2], axis=1)
        over = (aside_m < OVER_M) & (np.abs(yaw) < OVER_RAD)
        down = over | ((aside_m < STILL_OVER_M) & (way[:, 2] > -0.8 * ABOVE_M))
        low = -way[:, 2] < CLEAR_M
        away = released | seen.nothing | (low & ~down)
        target = way + np.where(down[:, None], 0.0, [0.0, 0.0, ABOVE_M])
        target[away] = [0.0, 0.0, ABOVE_M]
        near_m = np.linalg.norm(seen.to_piece, axis=1)
        closing = near_m < np.where(seen.opening_m < 0.05, STILL_AT_M, AT_M)
        closed = np.where(held, ~at_place, closing & ~released) & ~seen.nothing
        yaw = np.where(away, 0.0, yaw)
        upright = np.cross(seen.tool_axis, [0.0, 0.0, -1.0])
        turn = TURN_HZ * (upright + yaw[:, None] * [0.0, 0.0, 1.0])
        waits = ~held & closed
        velocity = np.where(waits[:, None], 0.0, self._compute_velocity(seen.tool, target))
        return _Plan(velocity, turn, 2.0 * closed - 1)

    def _compute_velocity(self, tool: Array, target: Array) -> Array:
        """Return velocities (n, 3) of the tool towards targets relative to it [m/s]."""
        error = plan_around_foot(tool, target, self._foot, ROUND_M)
        length = np.linalg.norm(error, axis=1, keepdims=True)
        most = self.env_info.control_config.tool_speed_m_s
        return error / np.maximum(length, 1e-9) * speed_m_s(length, most)


def _read_view(terms: dict[str, Array]) -> _View:
    """Extract from observations the quantities of the first piece that remains to be placed."""
    n = len(terms["object_placed"])
    axes = terms["object_axes"].reshape(n, -1, 2, 3)
    to_place = terms["place_from_object"].reshape(n, -1, 3)
    out = (np.abs(axes[:, :, 1, 2]) < LYING) | (to_place[..., 2] > CLEAR_M)  # lies, fell down
    held = terms["object_held"] > 0.5
    done = ((terms["object_placed"] > 0.5) | out) & ~held
    which = np.where(held.any(1), np.argmax(held, axis=1), np.argmin(done, axis=1))
    row = np.arange(n)
    tool_axes = terms["tool_axes"].reshape(n, 2, 3)
    return _View(
        tool=terms["tool_position"],
        finger_axis=tool_axes[:, 0],
        tool_axis=tool_axes[:, 1],
        opening_m=terms["hand_opening"][:, 0],
        to_piece=terms["object_from_tool"].reshape(n, -1, 3)[row, which],
        along=axes[row, which, 0],
        to_place=to_place[row, which],
        held=held[row, which],
        nothing=np.asarray(done.all(1)),
    )


def _find_finger_turn(finger_axis: Array, along: Array) -> Array:
    """Return the yaw angles (n,) from -pi/2 to pi/2 that align the fingers across a piece [rad]."""
    across = np.arctan2(along[:, 1], along[:, 0]) - np.pi / 2
    return _wrap_half_turn(across - np.arctan2(finger_axis[:, 1], finger_axis[:, 0]))


def _find_turn_to_y(along: Array) -> Array:
    """Return the yaw angles (n,) from -pi/2 to pi/2 that align a piece with the y axis [rad]."""
    return _wrap_half_turn(np.pi / 2 - np.arctan2(along[:, 1], along[:, 0]))


def _wrap_half_turn(angle: Array) -> Array:
    return (angle + np.pi / 2) % np.pi - np.pi / 2
