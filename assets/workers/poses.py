"""At rest, and a dozen working poses to photograph a worker in: joint angles to 22 segments."""

import numpy as np

from assets.rotations import quaternion_from_matrix
from hrc_env.core.records import WorkerMotion
from hrc_env.geometry.rotations import about_axis
from hrc_env.worker.body import N_SEGMENTS, PARENT, SEGMENT, Body

HANGING, ALONG, STRAIGHT = (5, 10), (18, 6), (2, 4, 4)
POSES: dict[str, dict] = {
    "stand": {"left": (HANGING, ALONG), "right": (HANGING, ALONG)},
    "stride": {"left": ((-25, 8), (0, 6)), "right": ((25, 8), (55, 0)),
               "legs": ((28, 2, 5), (-18, 2, 12))},
    "swing": {"left": ((-8, 8), (15, 6)), "right": ((8, 8), (35, 2)),
              "legs": ((12, 2, 15), (5, 2, 60))},
    "step": {"left": ((25, 8), (55, 0)), "right": ((-25, 8), (0, 6)),
             "legs": ((-18, 2, 12), (28, 2, 5))},
    "carry": {"lean": 6, "left": ((15, 12), (95, -8)), "right": ((15, 12), (95, -8)),
              "legs": ((14, 3, 10), (-10, 3, 8))},
    "reach": {"lean": 14, "left": ((75, 5), (85, 0)), "right": ((10, 10), (30, 5)),
              "legs": ((18, 4, 15), (-8, 4, 8))},
    "point": {"lean": 8, "left": ((10, 10), (30, 5)), "right": ((75, 25), (85, 20)),
              "legs": ((-8, 4, 8), (18, 4, 15))},
    "drill": {"lean": 8, "left": ((50, 20), (95, -25)), "right": ((40, 20), (95, -15)),
              "legs": ((10, 6, 8), (-6, 6, 6))},
    "overhead": {"lean": -6, "left": ((160, 15), (172, 0)), "right": ((150, 15), (170, 0)),
                 "legs": ((3, 6, 5), (3, 6, 5))},
    "spread": {"left": ((5, 75), (15, 80)), "right": ((5, 75), (15, 80)),
               "legs": ((2, 12, 4), (2, 12, 4))},
    "stoop": {"lean": 45, "left": ((45, 8), (60, 5)), "right": ((45, 8), (60, 5)),
              "legs": ((20, 6, 20), (20, 6, 20))},
}  # fmt: skip
"""Angles in degrees. lean: trunk forward; arms: (upper arm, forearm), each (forward, outward) from
hanging down; legs: left and right (forward, outward, knee flexion). All in degrees."""


def rest_motion(body: Body) -> WorkerMotion:
    """The body at rest and still, without leading axes: (S, ...)."""
    upright = np.zeros((N_SEGMENTS, 4))
    upright[:, 0] = 1.0
    still = np.zeros((N_SEGMENTS, 3))
    return WorkerMotion(body.rest_position.copy(), upright, still, still.copy())


def posed(
    body: Body, name: str, xy: tuple[float, float], yaw: float, jitter: np.ndarray
) -> WorkerMotion:
    """The body, still, in a named pose; `jitter` (12,) degrees are added to its angles."""
    pose, rest = POSES[name], body.rest_position
    heading = about_axis("z", yaw)
    lean = np.radians(pose.get("lean", 0) + jitter[0])
    turn = np.tile(heading, (N_SEGMENTS, 1, 1))
    turn[0] = heading @ about_axis("y", 0.4 * lean)
    for segment, share in (("abdomen", 0.6), ("torso", 0.85), ("chest", 1.0), ("neck", 0.7),
                           ("head", 0.4)):  # fmt: skip
        turn[SEGMENT[segment]] = heading @ about_axis("y", share * lean)
    turn[SEGMENT["head"]] = turn[SEGMENT["head"]] @ about_axis("z", np.radians(3 * jitter[1]))
    for index, side in enumerate(("left", "right")):
        shift = jitter[2 + 5 * index : 7 + 5 * index]
        _arm(turn, rest, side, pose[side], shift)
        _leg(turn, rest, side, pose.get("legs", (STRAIGHT, STRAIGHT))[index], shift, heading)
    position = np.zeros((N_SEGMENTS, 3))
    for s in range(1, N_SEGMENTS):
        position[s] = position[PARENT[s]] + turn[PARENT[s]] @ (rest[s] - rest[PARENT[s]])
    feet = [SEGMENT[f"{side}_foot"] for side in ("left", "right")]
    position[:, 2] -= position[feet, 2].min() - rest[feet[0], 2]
    position[:, :2] += xy
    still = np.zeros((N_SEGMENTS, 3))
    return WorkerMotion(position, quaternion_from_matrix(turn), still, still)


def _arm(turn: np.ndarray, rest: np.ndarray, side: str, angles: tuple, shift: np.ndarray) -> None:
    """Turn an arm's segments into the directions of the angles."""
    s = {part: SEGMENT[f"{side}_{part}"] for part in ("clavicle", "upper_arm", "forearm", "hand")}
    sign = 1 if side == "left" else -1
    chest = turn[SEGMENT["chest"]]
    (forward, outward), (fore_forward, fore_outward) = angles
    lift = np.radians(25 * max(0, forward - 70) / 110)
    turn[s["clavicle"]] = chest @ about_axis("x", sign * lift)
    upper = _direction(forward + shift[0], outward + shift[1], sign)
    fore = _direction(fore_forward + shift[2], fore_outward + shift[3], sign)
    turn[s["upper_arm"]] = chest @ _shortest(rest[s["forearm"]] - rest[s["upper_arm"]], upper)
    bone = turn[s["upper_arm"]] @ (rest[s["hand"]] - rest[s["forearm"]])
    turn[s["forearm"]] = _shortest(bone, chest @ fore) @ turn[s["upper_arm"]]
    turn[s["hand"]] = turn[s["forearm"]]


def _leg(
    turn: np.ndarray,
    rest: np.ndarray,
    side: str,
    angles: tuple,
    shift: np.ndarray,
    heading: np.ndarray,
) -> None:
    """Turn a leg's segments; the foot stays level."""
    s = {part: SEGMENT[f"{side}_{part}"] for part in ("thigh", "shank", "foot", "toes")}
    sign = 1 if side == "left" else -1
    forward, outward, flexion = angles
    thigh = _direction(forward + shift[4], outward, sign)
    shank = _direction(forward + shift[4] - flexion, 0.4 * outward, sign)
    turn[s["thigh"]] = heading @ _shortest(rest[s["shank"]] - rest[s["thigh"]], thigh)
    bone = turn[s["thigh"]] @ (rest[s["foot"]] - rest[s["shank"]])
    turn[s["shank"]] = _shortest(bone, heading @ shank) @ turn[s["thigh"]]
    turn[s["foot"]] = turn[s["toes"]] = heading @ about_axis("z", sign * np.radians(8))


def _direction(forward_deg: float, outward_deg: float, sign: int) -> np.ndarray:
    """Unit vector from hanging down, raised forward, then away from the body."""
    f, o = np.radians([forward_deg, outward_deg])
    return np.array([np.sin(f) * np.cos(o), sign * np.sin(o), -np.cos(f) * np.cos(o)])


def _shortest(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """The smallest rotation that takes one direction to another (not for opposite ones)."""
    a, b = start / np.linalg.norm(start), end / np.linalg.norm(end)
    v = np.cross(a, b)
    K = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + K + K @ K / (1 + a @ b)
