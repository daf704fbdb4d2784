"""Brings a tool to a hand without learning: what to do next follows from the observation alone.

The fingers go to before the tool, to it, close, and lift it. They bring its handle to where a hand
of the worker is estimated to be, wait until it is taken, let go and go back.
"""

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.skeleton import JOINT
from hrc_env.observations import split

from .env_info import EnvInfo, Observation
from .manipulating import arm_action, round_the_foot, turn_towards
from .scripted import Yielding, fastest_m_s, speed_m_s

Array = NDArray[np.float64]
GRIP_UP_M, HANDLE_UP_M, HAND_M = -0.08, 0.12, 0.09
"""Above the tool's middle: where it is gripped, its handle; and a hand beyond its wrist."""
BEFORE_M, LEVEL_M, AT_M, STILL_AT_M = 0.12, 0.008, 0.010, 0.018
"""The fingers stop so far before the tool until they are level with it; so near they close, and
stay closed."""
TOOL_M = 0.20
"""The tool's farthest end from the fingers."""
STAND_M, LIFTED_M = (0.30, -0.62, 0.10), 0.08
"""Where its middle stands from the robot's foot; so far above that it may leave sideways."""
ROUND_M = 0.58
"""Round the robot the fingers travel on a circle of this radius."""
TURN_RAD_S, FAST_M_S, BRING_M_S, OFFER_M_S = 1.1, 0.5, 0.35, 0.15
"""Fastest turn, and way; with the tool; near the hand."""
OFFERED_M = 0.05
"""Distance to the estimated hand below which the handle is held still: the hand comes to it."""
NEAR_M, REACH_M, HIGH_M = 0.35, 1.0, 0.15
"""So near its handle is to the hand when it goes slowly. Hands are brought a tool that are nearer
to the robot's axis than this, and higher above its foot."""
WAIT_M, BACK_M = (0.58, 0.0, 0.30), 0.30
"""Where the tool's middle waits for a hand, from the foot; how far the fingers go back."""


class Bringer:
    """Resolved-rate bringing, with or without yielding."""

    def __init__(self, env_info: EnvInfo, yielding: Yielding | None = None) -> None:
        self.env_info, self.yielding = env_info, yielding
        self._foot = env_info.chain.T_world_from_base[:3, 3]

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Actions (..., A): towards the tool, with it to the hand, away from it."""
        terms = split(observation, self.env_info.layout)
        shape = terms["tool_position"].shape[:-1]
        terms = {name: np.atleast_2d(term) for name, term in terms.items()}
        held, taken = terms["object_held"][:, 0] > 0.5, terms["object_taken"][:, 0] > 0.5
        fetched, closes, heading = self._fetch(terms)
        brought, towards = self._bring(terms)
        velocity = np.where(held[:, None], brought, fetched)
        heading = np.where((held | taken)[:, None], towards, heading)
        velocity = np.where(taken[:, None], self._leave(terms, held), velocity)
        turn = turn_towards(terms["tool_axes"], _left_of(heading), heading, TURN_RAD_S)
        if self.yielding is not None:
            nearest_m = terms["worker_separation"].min(axis=-1, initial=np.inf)
            share = np.where(held, 1.0, self.yielding.share(nearest_m))[:, None]
            velocity, turn = velocity * share, turn * share
        moves = arm_action(self.env_info, terms, velocity, turn)
        if self.yielding is not None:
            moves *= self.yielding.blind_share(terms, fastest_m_s(velocity, turn, TOOL_M))[:, None]
        grip = np.where((held | closes) & ~taken, 1.0, -1.0)
        action = np.concatenate([moves, grip[:, None]], axis=1)
        return action.reshape(*shape, -1).astype(np.float32)

    def _fetch(self, terms: dict[str, Array]) -> tuple[Array, NDArray[np.bool_], Array]:
        """Velocity to the tool, whether fingers close on it, and which way they point."""
        way = terms["object_from_tool"] + [0.0, 0.0, GRIP_UP_M]
        away = terms["tool_position"] + way - self._foot
        heading = _flat(away)
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
        target = round_the_foot(terms["tool_position"], target, self._foot[:2], ROUND_M)
        return np.where(closes[:, None], 0.0, _towards(target, FAST_M_S)), closes, heading

    def _bring(self, terms: dict[str, Array]) -> tuple[Array, Array]:
        """Velocity with the tool, and which way the fingers point."""
        tool = terms["tool_position"] + terms["object_from_tool"] - self._foot
        low = (tool[:, 2] < STAND_M[2] + LIFTED_M) & (
            np.linalg.norm(tool[:, :2] - STAND_M[:2], axis=1) < 0.10
        )
        hand, there = self._hand(terms)
        target = np.where(there[:, None], hand - [0.0, 0.0, HANDLE_UP_M], WAIT_M) - tool
        target = np.where(low[:, None], [0.0, 0.0, 0.15], target)
        target[there & ~low & (np.linalg.norm(target, axis=1) < OFFERED_M)] = 0.0
        left_m = np.linalg.norm(target, axis=1, keepdims=True)
        most = np.where(there[:, None] & (left_m < NEAR_M), OFFER_M_S, BRING_M_S)
        velocity = target / np.maximum(left_m, 1e-9) * np.minimum(speed_m_s(left_m, 0.35), most)
        turned = np.where(low[:, None], [STAND_M[0], STAND_M[1], 0.0], tool)
        return velocity, _flat(turned)

    def _hand(self, terms: dict[str, Array]) -> tuple[Array, NDArray[np.bool_]]:
        """(n, 3) the estimated hand that is put out, from the robot's foot, and whether one is."""
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
        return hands[np.arange(n), nearest], out.any(1)

    def _leave(self, terms: dict[str, Array], held: NDArray[np.bool_]) -> Array:
        """Velocity (n, 3) back from the tool, when the fingers are open."""
        back = -terms["tool_axes"][:, 3:] * 0.2
        near = np.linalg.norm(terms["object_from_tool"], axis=1) < BACK_M
        opened = terms["hand_opening"][:, 0] > 0.025
        return np.where((near & opened & ~held)[:, None], back, 0.0)


def _towards(way: Array, most_m_s: float) -> Array:
    length = np.linalg.norm(way, axis=1, keepdims=True)
    return way / np.maximum(length, 1e-9) * speed_m_s(length, most_m_s)


def _flat(way: Array) -> Array:
    """Unit vectors of ways (n, 3) on the ground."""
    level = way * [1.0, 1.0, 0.0]
    return level / np.maximum(np.linalg.norm(level, axis=1, keepdims=True), 1e-9)


def _left_of(heading: Array) -> Array:
    """(n, 3) level vectors to the left of level ones."""
    return np.stack([-heading[:, 1], heading[:, 0], np.zeros(len(heading))], axis=1)
