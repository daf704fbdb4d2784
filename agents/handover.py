"""Scripted handover of a tool, which uses only the observation.

The fingers move in front of the tool, approach it, close, and lift it. They bring its handle to the
estimated position of a worker's hand, wait until the worker takes it, open and retreat.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.skeleton import JOINT
from hrc_env.observations import split

from .env_info import EnvInfo, Observation
from .manipulating import make_arm_action, plan_around_foot, turn_towards
from .scripted import Yielding, fastest_m_s, speed_m_s

Array = NDArray[np.float64]
GRIP_UP_M, HANDLE_UP_M, HAND_M = -0.08, 0.12, 0.09
"""Heights of the grasp point and of the handle above the tool's centre, and distance of a hand
beyond its wrist [m].
"""
BEFORE_M, LEVEL_M, AT_M, STILL_AT_M = 0.12, 0.008, 0.010, 0.018
"""Distance in front of the tool at which the fingers align, error below which they are aligned, and
distances below which they close and stay closed [m].
"""
TOOL_M = 0.20
"""Distance of the tool's farthest end from the fingers [m]."""
STAND_M, LIFTED_M = (0.30, -0.62, 0.10), 0.08
"""Position of the tool on its stand, relative to the robot's base, and height above it from which
the tool may move sideways [m].
"""
ROUND_M = 0.58
"""Radius of the circle around the robot on which the fingers travel [m]."""
TURN_RAD_S, FAST_M_S, BRING_M_S, OFFER_M_S = 1.1, 0.5, 0.35, 0.15
"""Maximum turn rate [rad/s], and maximum speeds without the tool, with it, and close to the hand
[m/s].
"""
OFFERED_M = 0.05
"""Distance to the estimated hand below which the handle is held still for the worker [m]."""
NEAR_M, REACH_M, HIGH_M = 0.35, 1.0, 0.15
"""Distance to the hand below which the handle moves slowly, maximum distance of hands from the
robot's vertical axis, and their minimum height above its base [m].
"""
WAIT_M, BACK_M = (0.58, 0.0, 0.30), 0.30
"""Position relative to the robot's base at which the tool waits for a hand, and length of the
retreat [m].
"""


class Fetch(NamedTuple):
    """Motion of the fingers while they fetch the tool."""

    velocity: Array
    """Velocity of the fingers (n, 3) [m/s]."""
    closes: NDArray[np.bool_]
    """Mask (n,) of environments in which the fingers close."""
    heading: Array
    """Desired pointing direction of the fingers, a horizontal unit vector (n, 3)."""


class Bring(NamedTuple):
    """Motion of the fingers while they hold the tool."""

    velocity: Array
    """Velocity of the fingers (n, 3) [m/s]."""
    heading: Array
    """Desired pointing direction of the fingers, a horizontal unit vector (n, 3)."""


class Hand(NamedTuple):
    """The nearest hand that a worker holds out, for each environment."""

    position: Array
    """Position relative to the robot's base (n, 3) [m]."""
    is_out: NDArray[np.bool_]
    """Mask (n,) of environments in which a worker holds out a hand."""


class Bringer:
    """An agent that brings the tool by resolved-rate control and can slow down near people."""

    def __init__(self, env_info: EnvInfo, yielding: Yielding | None = None) -> None:
        self.env_info, self.yielding = env_info, yielding
        self._foot = env_info.chain.T_world_from_base[:3, 3]

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return actions (..., A) that fetch the tool, bring it to the hand, and retreat."""
        terms = split(observation, self.env_info.layout)
        shape = terms["tool_position"].shape[:-1]
        terms = {name: np.atleast_2d(term) for name, term in terms.items()}
        held, taken = terms["object_held"][:, 0] > 0.5, terms["object_taken"][:, 0] > 0.5
        fetch, bring = self._fetch(terms), self._bring(terms)
        velocity = np.where(held[:, None], bring.velocity, fetch.velocity)
        heading = np.where((held | taken)[:, None], bring.heading, fetch.heading)
        velocity = np.where(taken[:, None], self._leave(terms, held), velocity)
        turn = turn_towards(terms["tool_axes"], _rotate_left(heading), heading, TURN_RAD_S)
        if self.yielding is not None:
            nearest_m = terms["worker_separation"].min(axis=-1, initial=np.inf)
            share = np.where(held, 1.0, self.yielding.share(nearest_m))[:, None]
            velocity, turn = velocity * share, turn * share
        moves = make_arm_action(self.env_info, terms, velocity, turn)
        if self.yielding is not None:
            moves *= self.yielding.blind_share(terms, fastest_m_s(velocity, turn, TOOL_M))[:, None]
        grip = np.where((held | fetch.closes) & ~taken, 1.0, -1.0)
        action = np.concatenate([moves, grip[:, None]], axis=1)
        return action.reshape(*shape, -1).astype(np.float32)

    def _fetch(self, terms: dict[str, Array]) -> Fetch:
        way = terms["object_from_tool"] + [0.0, 0.0, GRIP_UP_M]
        away = terms["tool_position"] + way - self._foot
        heading = _flatten(away)
        ahead = (way * heading).sum(1)
        aside = way - ahead[:, None] * heading
        level = np.linalg.norm(aside, axis=1) < LEVEL_M
        level &= (terms["tool_axes"][:, 3:] * heading).sum(1) > 0.995
        near = np.linalg.norm(way, axis=1)
        closes = near < np.where(terms["hand_opening"][:, 0] < 0.05, STILL_AT_M, AT_M)
        inside = ahead < BEFORE_M - 0.02
        target = (
            way - np.where(level | inside & (near < 2 * BEFORE_M), 0.0, BEFORE_M)[:, None] * heading
        )
        target = plan_around_foot(terms["tool_position"], target, self._foot[:2], ROUND_M)
        velocity = np.where(closes[:, None], 0.0, _approach(target, FAST_M_S))
        return Fetch(velocity, closes, heading)

    def _bring(self, terms: dict[str, Array]) -> Bring:
        tool = terms["tool_position"] + terms["object_from_tool"] - self._foot
        low = (tool[:, 2] < STAND_M[2] + LIFTED_M) & (
            np.linalg.norm(tool[:, :2] - STAND_M[:2], axis=1) < 0.10
        )
        hand, there = self._find_hand(terms)
        target = np.where(there[:, None], hand - [0.0, 0.0, HANDLE_UP_M], WAIT_M) - tool
        target = np.where(low[:, None], [0.0, 0.0, 0.15], target)
        target[there & ~low & (np.linalg.norm(target, axis=1) < OFFERED_M)] = 0.0
        left_m = np.linalg.norm(target, axis=1, keepdims=True)
        most = np.where(there[:, None] & (left_m < NEAR_M), OFFER_M_S, BRING_M_S)
        velocity = target / np.maximum(left_m, 1e-9) * np.minimum(speed_m_s(left_m, 0.35), most)
        turned = np.where(low[:, None], [STAND_M[0], STAND_M[1], 0.0], tool)
        return Bring(velocity, _flatten(turned))

    def _find_hand(self, terms: dict[str, Array]) -> Hand:
        n = len(terms["tool_position"])
        joints = terms["worker_joints_from_tool"].reshape(n, -1, 15, 3)
        joints = joints + (terms["tool_position"] - self._foot)[:, None, None]
        wrists = joints[:, :, [JOINT["left_wrist"], JOINT["right_wrist"]]]
        fore = wrists - joints[:, :, [JOINT["left_elbow"], JOINT["right_elbow"]]]
        length = np.maximum(np.linalg.norm(fore, axis=-1, keepdims=True), 1e-6)
        hands = (wrists + HAND_M * fore / length).reshape(n, -1, 3)
        away = np.linalg.norm(hands[..., :2], axis=-1)
        known = np.repeat(terms["worker_tracked"] > 0.5, 2, axis=1)
        out = known & (away < REACH_M) & (hands[..., 2] > HIGH_M)
        away = np.where(out, away, np.inf)
        nearest = np.argmin(away, axis=1)
        return Hand(hands[np.arange(n), nearest], out.any(1))

    def _leave(self, terms: dict[str, Array], held: NDArray[np.bool_]) -> Array:
        """Return the velocity (n, 3) of the retreat from the tool, once the fingers are open."""
        back = -terms["tool_axes"][:, 3:] * 0.2
        near = np.linalg.norm(terms["object_from_tool"], axis=1) < BACK_M
        opened = terms["hand_opening"][:, 0] > 0.025
        return np.where((near & opened & ~held)[:, None], back, 0.0)


def _approach(way: Array, most_m_s: float) -> Array:
    length = np.linalg.norm(way, axis=1, keepdims=True)
    return way / np.maximum(length, 1e-9) * speed_m_s(length, most_m_s)


def _flatten(way: Array) -> Array:
    """Project vectors (n, 3) onto the horizontal plane and normalize them."""
    level = way * [1.0, 1.0, 0.0]
    return level / np.maximum(np.linalg.norm(level, axis=1, keepdims=True), 1e-9)


def _rotate_left(heading: Array) -> Array:
    """Rotate horizontal vectors (n, 3) by 90 degrees to the left."""
    return np.stack([-heading[:, 1], heading[:, 0], np.zeros(len(heading))], axis=1)
