"""Holds a board against studs without learning: what to do next follows from the observation alone.

The cups go to above the board, down onto it, and suck. The board goes up and is set upright on the
way, round the robot to before its place, and against the studs, where it stays until it is fixed.
"""

import numpy as np
from numpy.typing import NDArray

from hrc_env.observations import split

from .env_info import EnvInfo, Observation
from .manipulating import arm_action, round_the_foot, turn_towards
from .scripted import Yielding, fastest_m_s, speed_m_s

Array = NDArray[np.float64]
HALF_THICK_M, CUPS_M = 0.00625, (-0.12, -0.15)
"""From the board's middle: its face, and where cups sit across and along it [m]."""
ABOVE_M, SUCK_M = 0.12, 0.05
"""How high above the board the cups travel; so near they suck."""
OVER_M, OVER_RAD, FUNNEL_M, FUNNEL_RAD = 0.015, 0.05, 0.03, 0.2
"""So near above it they go down onto it, and the lower the less they are beyond that: a funnel,
which leaves who imitates no height at which to hesitate."""
PRESS_M = 0.02
"""How far below the board's surface the cups aim."""
FLAT_Z_M, UPRIGHT_Z_M = -0.12, 0.34
"""Heights above the foot between which the board is set upright."""
NEAR_M, FAR_M = 0.72, 1.0
"""Its distance from the robot's axis when it is upright, and on the stack."""
BEFORE_M, ALIGNED_M, ALIGNED_RAD = 0.13, 0.012, 0.03
"""Distance before its place at which it is aligned, and then pressed to it."""
STAYS = 3.0
"""It stays aligned on the way, and there, while it is off by less than so many times as much."""
THERE_M = np.array([0.003, 0.0, 0.003])
"""So near to its place along each axis it is held where it is: noise must not move it."""
CORNER_M = 0.86
"""The board's farthest corner from between the cups."""
LAST_RAD = 0.25
"""Last angle of the way round the robot, on which it goes straight."""
CARRY_M_S, PRESS_M_S, TURN_RAD_S = 0.40, 0.12, 0.9
"""Fastest with the board, and against the studs; fastest turn."""
STACK_RAD, PLACE_RAD = np.arctan2(-0.98, 0.26), np.arctan2(1.0, 0.29)
"""Where round the robot the stack is, and the board's place."""


class BoardHolder:
    """Resolved-rate carrying and holding, with or without yielding."""

    def __init__(self, env_info: EnvInfo, yielding: Yielding | None = None) -> None:
        self.env_info, self.yielding = env_info, yielding
        self._foot = env_info.chain.T_world_from_base[:3, 3]

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Actions (..., A): towards the board, or with it to its place."""
        terms = split(observation, self.env_info.layout)
        shape = terms["tool_position"].shape[:-1]
        terms = {name: np.atleast_2d(term) for name, term in terms.items()}
        velocity, turn, sucks = self._wanted(terms)
        if self.yielding is not None:
            nearest_m = terms["worker_separation"].min(axis=-1, initial=np.inf)
            share = self.yielding.share(nearest_m)[:, None]
            share = np.where(_pressing(terms)[:, None], 1.0, share)
            velocity, turn = velocity * share, turn * share
        moves = arm_action(self.env_info, terms, velocity, turn)
        if self.yielding is not None:
            wanted_m_s = fastest_m_s(velocity, turn, CORNER_M)
            moves *= self.yielding.blind_share(terms, wanted_m_s)[:, None]
        action = np.concatenate([moves, 2.0 * sucks[:, None] - 1.0], axis=1)
        return action.reshape(*shape, -1).astype(np.float32)

    def _wanted(self, terms: dict[str, Array]) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Velocity and turn rate of the tool (n, 3), and whether the cups suck (n,)."""
        held, fixed = terms["object_held"][:, 0] > 0.5, terms["screws_driven"][:, 0] > 3.5
        fetched, fetch_axes, near = self._fetch(terms)
        brought, bring_axes = self._bring(terms)
        velocity = np.where(held[:, None], brought, fetched)
        x = np.where(held[:, None], bring_axes[0], fetch_axes[0])
        z = np.where(held[:, None], bring_axes[1], fetch_axes[1])
        turn = turn_towards(terms["tool_axes"], x, z, TURN_RAD_S)
        back = np.where(terms["place_from_object"][:, 1:2] < 0.3, [0.0, -0.2, 0.0], 0.0)
        off = np.linalg.norm(terms["object_from_tool"], axis=1)[:, None] < 0.25
        velocity = np.where(fixed[:, None], back * off, velocity)
        turn[fixed] = 0.0
        return velocity, turn, ~fixed & (held | near)

    def _fetch(
        self, terms: dict[str, Array]
    ) -> tuple[Array, tuple[Array, Array], NDArray[np.bool_]]:
        """Velocity to the board, the tool's axes x and z on it, and whether cups are near it."""
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
        error = round_the_foot(terms["tool_position"], target, self._foot[:2], 0.6)
        length = np.linalg.norm(error, axis=1, keepdims=True)
        most = np.where(way[:, 2:] > -0.03, PRESS_M_S, 0.5)
        velocity = error / np.maximum(length, 1e-9) * np.minimum(speed_m_s(length, 0.5), most)
        return velocity, (along, -normal), np.linalg.norm(way, axis=1) < SUCK_M

    def _bring(self, terms: dict[str, Array]) -> tuple[Array, tuple[Array, Array]]:
        """Velocity with the board to its place, and the tool's axes x and z meanwhile."""
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
        axes = c * outward + s * up, s * outward - c * up
        velocity = self._carry(board, angle, height, share)
        velocity = np.where(last[:, None], _press(terms, to_place), velocity)
        return velocity, axes

    def _carry(self, board: Array, angle: Array, height: Array, share: Array) -> Array:
        """Velocity (n, 3) up and in from the stack, then round the robot."""
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
    """Velocity (n, 3) to before the place, and against the studs when aligned there."""
    aligned, before = _aligned(terms), to_place - [0.0, BEFORE_M, 0.0]
    left = np.sign(to_place) * np.maximum(np.abs(to_place) - THERE_M, 0.0)
    error = np.where(aligned[:, None], left, before)
    length = np.linalg.norm(error, axis=1, keepdims=True)
    most = np.where(aligned[:, None], PRESS_M_S, CARRY_M_S)
    return error / np.maximum(length, 1e-9) * np.minimum(speed_m_s(length, CARRY_M_S), most)


def _aligned(terms: dict[str, Array]) -> NDArray[np.bool_]:
    """(n,) whether the board stands right before its place, or is there."""
    to_place, axes = terms["place_from_object"], terms["object_axes"]
    off = np.abs(to_place[:, [0, 2]]).max(1)
    askew = np.linalg.norm(np.cross(axes[:, 3:], [0.0, -1.0, 0.0]), axis=1)
    askew += np.linalg.norm(np.cross(axes[:, :3], [0.0, 0.0, 1.0]), axis=1)
    slack = np.where(to_place[:, 1] < 0.5 * BEFORE_M, STAYS, 1.0)
    fine = (off < slack * ALIGNED_M) & (askew < slack * ALIGNED_RAD)
    return fine & (to_place[:, 1] < BEFORE_M + 0.05)


def _pressing(terms: dict[str, Array]) -> NDArray[np.bool_]:
    """(n,) whether the board is at its place: people work at it, and it must not move."""
    return (terms["object_held"][:, 0] > 0.5) & (
        np.linalg.norm(terms["place_from_object"], axis=1) < 0.02
    )
