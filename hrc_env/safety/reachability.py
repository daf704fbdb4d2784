"""Verification that a robot can stop before its reachable set meets that of a person.

The method is that of the SARA shield (Thumm and Althoff 2022, arXiv:2205.06311; Thumm et al. 2024,
arXiv:2412.10180). The intended velocity is executed for a short time, and then the robot brakes
along its path with its maximum deceleration. This intention is verified if, until standstill, the
space that the robot sweeps does not intersect the space that people can reach meanwhile, or if the
robot is slower there than the region of the body tolerates in a contact. Otherwise the robot brakes
at once: by induction, it then follows the end of an intention that was verified before.

Bodies are those of the other shields (`constraints.Bodies`): every segment grows by the margin for
the error of its estimate and by the distance that it covers at the assumed speed. Unlike in the
source, limits are speeds instead of energies (`contact.permitted_contact_speed`), and contacts are
not classified into clamping and free ones.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import RobotState
from hrc_env.core.typing import Capsules, Floats, Ints, JointVelocities
from hrc_env.geometry import chains
from hrc_env.geometry.robot_model import RobotModel
from hrc_env.safety.config import ShieldParams
from hrc_env.safety.constraints import (
    ABSENT_M,
    Bodies,
    bound_capsule,
    bound_deduction,
    find_margin,
    find_nearest,
    project_motion,
    select_segment,
    sphere_gap,
)

N_INTERVALS = 5
"""Number of intervals into which the time until standstill is divided."""
STANDSTILL_M_S = 1e-3
"""Speed below which the robot counts as standing [m/s]."""


class Sweep(NamedTuple):
    """Space that robots sweep until standstill, in K intervals."""

    capsules: Capsules
    """End points of the capsules in the middle of each interval (B, K, C, 2, 3) [m]."""
    radii_m: Floats
    """Radii that cover the capsules during the whole interval (B, K, C) [m]."""
    speed_m_s: Floats
    """Maximum speed of each capsule in each interval (B, K, C) [m/s]."""
    until_s: Floats
    """End of each interval (B, K) [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Verification:
    """Result of the verification of intended velocities."""

    gap_m: Floats
    """Smallest gap between the reachable sets of robot and people (B,) [m]; negative if they
    intersect, infinite if no person is near."""
    excess_m_s: Floats
    """Maximum speed above the limit within reach of a person (B,) [m/s]; 0 if the intention is
    verified."""


def find_braking_time(velocities: JointVelocities, model: RobotModel) -> Floats:
    """Return the time (B,) in which robots stop along their path at maximum deceleration [s]."""
    times_s: Floats = np.max(np.abs(velocities) / model.slew_rad_s2, axis=1)
    return times_s


def brake(command: JointVelocities, model: RobotModel, dt_s: float) -> JointVelocities:
    """Return the joint velocities (B, N) after braking along the path for one step [rad/s].

    Args:
        command: (B, N) current joint velocities [rad/s].
        model: limits of the robot.
        dt_s: duration of the step [s].
    """
    stop_s = np.maximum(find_braking_time(command, model), 1e-9)
    return command * np.maximum(1.0 - dt_s / stop_s, 0.0)[:, None]


def sweep_path(
    robot: RobotState, model: RobotModel, links: Ints, velocities: JointVelocities, hold_s: float
) -> Sweep:
    """Return the space that robots sweep if they move on for some time and then brake.

    Args:
        robot: state of the robots, with the capsules of their loads.
        model: kinematics and limits of the robot.
        links: index of the link that carries each capsule (C,).
        velocities: (B, N) intended joint velocities [rad/s].
        hold_s: time before the robot brakes [s].
    """
    brake_s = find_braking_time(velocities, model)[:, None]
    total_s = hold_s + brake_s
    times_s = total_s * np.linspace(0.0, 1.0, 2 * N_INTERVALS + 1)
    late_s = np.maximum(times_s - hold_s, 0.0)
    rate = 1.0 - late_s / np.maximum(brake_s, 1e-9)
    rate = np.where(late_s > 0.0, np.maximum(rate, 0.0), 1.0)
    moved_s = times_s - np.square(late_s) / (2.0 * np.maximum(brake_s, 1e-9))
    frames = chains.link_frames(
        model.chain, robot.q[:, None] + moved_s[..., None] * velocities[:, None]
    )[:, :, links]
    first = frames[:, 0]
    ends = robot.capsules_world
    local = np.einsum("bcji,bcej->bcei", first[..., :3, :3], ends - first[..., None, :3, 3])
    path = np.einsum("btcij,bcej->btcei", frames[..., :3, :3], local)
    path += frames[..., None, :3, 3]
    start, middle, stop = path[:, :-1:2], path[:, 1::2], path[:, 2::2]
    before_m, after_m = (np.linalg.norm(each - middle, axis=-1).max(-1) for each in (start, stop))
    half_s = moved_s[:, 1::2] - moved_s[:, :-1:2]
    speed_m_s = before_m * (rate[:, :-1:2] / np.maximum(half_s, 1e-9))[..., None]
    radii_m = robot.capsule_radius_m + np.maximum(before_m, after_m)
    return Sweep(np.ascontiguousarray(middle), radii_m, speed_m_s, times_s[:, 2::2])


def verify_sweep(
    sweep: Sweep, bodies: Bodies, tolerated_m_s: Floats, params: ShieldParams, latency_s: float
) -> Verification:
    """Verify that robots are slow enough wherever people can be until the robots stand still.

    Args:
        sweep: space that the robots sweep.
        bodies: estimated bodies.
        tolerated_m_s: (B, S) speed that each segment tolerates in a contact [m/s].
        params: margins of the shield and the speed of people.
        latency_s: additional age of the estimate [s].
    """
    result = Verification(np.empty(len(sweep.until_s)), np.empty(len(sweep.until_s)))
    _find_excess(sweep, bodies, tolerated_m_s, params, latency_s, result.gap_m, result.excess_m_s)
    return result


@kernel(makes_arrays=True)
def _find_excess(
    sweep: Sweep,
    bodies: Bodies,
    tolerated_m_s: Floats,
    params: ShieldParams,
    latency_s: float,
    gaps_m: Floats,
    excess_m_s: Floats,
) -> None:
    """Compute the smallest gap and the largest excess speed of `Verification` for every robot.

    Args:
        sweep: space that the robots sweep.
        bodies: estimated bodies.
        tolerated_m_s: (B, S) speed that each segment tolerates in a contact [m/s].
        params: margins of the shield and the speed of people.
        latency_s: additional age of the estimate [s].
        gaps_m: (B,) receives the smallest gaps [m].
        excess_m_s: (B,) receives the largest speeds above a limit [m/s].
    """
    n_intervals, n_caps = sweep.speed_m_s.shape[1], sweep.speed_m_s.shape[2]
    n_segments = bodies.segments.shape[2]
    rod, limb, normal, point = np.empty(5), np.empty(5), np.empty(3), np.empty(3)
    for e in range(len(sweep.speed_m_s)):
        gaps_m[e], excess_m_s[e] = np.inf, 0.0
        for w in range(bodies.segments.shape[1]):
            if not bodies.is_located[e, w]:
                continue
            for s in range(n_segments):
                segment = select_segment(bodies, e, w, s)
                bound_capsule(segment.ends, segment.radius_m, limb)
                most_m = bound_deduction(segment, params) + bodies.moved_m[e, w]
                person_m_s = find_fastest(segment.velocity, params)
                for k, c in np.ndindex(n_intervals, n_caps):
                    capsule, radius_m = sweep.capsules[e, k, c], sweep.radii_m[e, k, c]
                    if abs(capsule[0, 0]) > ABSENT_M:
                        continue
                    reach_m = person_m_s * (sweep.until_s[e, k] + latency_s)
                    bound_capsule(capsule, radius_m, rod)
                    if sphere_gap(rod, limb) > most_m + reach_m:
                        continue
                    nearest = find_nearest(capsule, segment.ends, point, normal)
                    std_m = project_motion(segment, nearest.along, normal).std_m
                    gap = nearest.distance_m - radius_m - segment.radius_m - bodies.moved_m[e, w]
                    gap -= find_margin(segment, std_m, params) + reach_m
                    gaps_m[e] = min(gaps_m[e], gap)
                    if gap < 0.0:
                        tolerated = tolerated_m_s[e, s] if bodies.may_touch[e, w, s] else 0.0
                        limit = min(tolerated, bodies.robot_share_m_s[c])
                        excess = sweep.speed_m_s[e, k, c] - max(limit, STANDSTILL_M_S)
                        excess_m_s[e] = max(excess_m_s[e], excess)


@kernel
def find_fastest(velocity: Floats, params: ShieldParams) -> float:
    """Return the speed at which any point of a segment may move [m/s].

    Args:
        velocity: (2, 3) estimated velocities of its ends [m/s].
        params: the speed of people, or the amount added to the estimated one.
    """
    if not params.follows_estimate:
        return params.worker_m_s
    fastest = 0.0
    for end in range(2):
        v = velocity[end]
        fastest = max(fastest, math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]))
    return fastest + params.worker_m_s
