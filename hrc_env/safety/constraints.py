"""Constraints n.J qd <= b on the speed at which a robot's capsules approach estimated bodies.

For every pair of a robot's capsule and a capsule of an estimated body (`geometry.enclosure`; here
called a segment), n is the unit vector from the robot's nearest point to the body's, and the
clearance is

    D = gap - margin - error - v_h T_h

with v_h the estimated speed of the body's point along -n, T_h `ShieldConfig.worker_time_s`, and the
margin `margin_m` or `hand_margin_m`. The error is either a calibrated quantile
(`safety.error_bounds`) or

    error = p + Z_d,   Z_d = max(z, predicted + k seen + k' max(seen - s', 0))

with p the distance by which a true body may protrude from the segment (`Enclosure.protrusion_m`),
and sigma_n = sqrt(n' Sigma n) the root of predicted^2 + seen^2. From `ShieldConfig` come k
`n_sigmas`, k' `single_view_sigmas`, s' `single_view_std_m` and z `min_uncertainty_m`. If a body has
not been detected recently, for example because images are delayed, most of the deviation is due to
prediction, which overestimates it. A `seen` above s' indicates a part that a single camera locates,
for which actual errors exceed the estimated ones. If D >= 0, the robot may approach at a speed from
which it can stop within D (the robot's part of `separation.protective_distance`); if D < 0, it must
retreat. Constraints that no reachable command violates are omitted.

A segment that may be touched causes no retreat while its speed of approach does not exceed the
contact speed that its region of the body tolerates from the effective mass of the robot at its
nearest point along n (`safety.contact`). Capsules that may touch it brake within gap - margin -
error until the sum of their speed and that of the segment is below that limit. If the segment would
be clamped (`safety.clamping`), their own speed must also be below the limit for clamping. Points of
other capsules may approach at `creep_m_s` if D permits less.

A worker without a recent detection may be anywhere within walking distance of the last detected
position. That distance is subtracted from D as well, and if D < 0, the robot neither approaches nor
retreats. The same holds for people who may be on patches of floor that no camera has observed to be
empty.
"""

import math
from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import (
    Bools,
    Capsules,
    Covariances3,
    Floats,
    Ints,
    JointVelocities,
    Points3,
    Transforms,
    Vector3,
    Velocities3,
)
from hrc_env.core.vacancy import POSSIBLE, STATURE_M
from hrc_env.geometry.chains import lever
from hrc_env.geometry.distances import closest_parameters
from hrc_env.geometry.inertia import find_mobility
from hrc_env.geometry.shapes import WIDTH, set_capsules
from hrc_env.safety.clamping import Installation, is_clamped
from hrc_env.safety.config import ShieldParams
from hrc_env.safety.contact import ContactLimits, find_permitted_speeds
from hrc_env.safety.error_bounds import Support, find_error_bound

MAX_CONSTRAINTS = 32
"""Maximum number of constraints of one robot; if there are more, the tightest are kept."""
ABSENT_M = 1e3
"""Coordinate beyond which a capsule is regarded as that of an absent load [m]."""
RANKING_HZ = 1e-4
"""Ratio of retreat speed to -D for positions where a lost worker may be [1/s]. It causes hardly any
motion, but makes the constraints of the nearest pairs the tightest ones."""


class Robots(NamedTuple):
    """The robots that a shield commands, one row per environment."""

    frames: Transforms
    """Poses of the links in the world (B, N, 4, 4)."""
    slides: Bools
    """Mask of the prismatic joints (N,)."""
    links: Ints
    """Index of the link that carries each capsule (K,)."""
    capsules: Capsules
    """End points of the capsules in the world frame (B, K, 2, 3) [m]."""
    radii_m: Floats
    """Radius of each capsule (K,) [m]."""
    low: JointVelocities
    """Minimum reachable joint velocities (B, N) [rad/s]."""
    high: JointVelocities
    """Maximum reachable joint velocities (B, N) [rad/s]."""
    slew: Floats
    """Maximum rate of change of each joint velocity (N,) [rad/s^2]."""
    inverse_mass: Floats
    """Inverse of the mass matrix (B, N, N), including loads [1 / (kg m^2); 1/kg for slides]; read
    only for robots that may touch a worker."""
    obstacles: Floats
    """Fixed shapes around the robot (G, `shapes.WIDTH`)."""


class Bodies(NamedTuple):
    """The estimated bodies of the workers, one row per environment and worker."""

    segments: Capsules
    """End points of the segments in the world frame (B, W, S, 2, 3) [m]."""
    radii_m: Floats
    """Radius of each segment (B, W, S) [m]."""
    velocity: Velocities3
    """Estimated velocities of the end points (B, W, S, 2, 3) [m/s]."""
    cov: Covariances3
    """Covariance of each joint's position (B, W, J, 3, 3) [m^2]."""
    age_s: Floats
    """Time since each joint was last supported by a measurement (B, W, J) [s]."""
    is_located: Bools
    """Mask (B, W) of the workers that have a track, or are lost but have a known last position."""
    moved_m: Floats
    """Distance that a lost worker may have walked since the last detection (B, W) [m]; 0 for
    others."""
    may_touch: Bools
    """Mask (B, W, S) of the segments that may be touched."""
    limits: ContactLimits
    """Contact limits of the segments (S,)."""
    robot_share_m_s: Floats
    """Maximum speed of each of the robot's capsules in an allowed touch (K,) [m/s]."""
    joints: Ints
    """Indices of the joints on which the end points depend (S, 2, T)."""
    shares: Floats
    """Influence of these joints on the end points (S, 2, T), with the sum 1 for each."""
    support: Support
    """Properties that determine the calibrated bounds on the errors of segments (B, W, S)."""


class UnseenFloors(NamedTuple):
    """Patches of floor on which there may be people that no camera has detected."""

    centres_world: Points3
    """Centres of the patches of floor (N, 3) [m]."""
    level: Ints
    """State of each patch (B, N): `POSSIBLE`, `PROBABLY_EMPTY` or `EMPTY`."""
    reach_m: Floats
    """Distance from the centre of a patch within which a person's hands may be (B,) [m]."""


class Constraints(NamedTuple):
    """The constraints J qd <= b on joint velocities, and the box low <= qd <= high."""

    J: Floats
    """Rows n.J (B, M, N) of the constraints, of which the first `n_rows` are used [m/rad; 1 for
    prismatic joints]."""
    b: Floats
    """Maximum speed of approach (B, M) [m/s]; a negative value is the minimum speed of a
    retreat."""
    n_rows: Ints
    """Number of constraints of each robot (B,)."""
    low: JointVelocities
    """Minimum reachable joint velocities (B, N) [rad/s]."""
    high: JointVelocities
    """Maximum reachable joint velocities (B, N) [rad/s]."""
    clearance_m: Floats
    """Smallest clearance D of the relevant pairs (B,) [m]; infinite if there are none."""


class Arm(NamedTuple):
    """One robot, with the fields of one row of `Robots`."""

    frames: Transforms
    """Poses of the links in the world (N, 4, 4)."""
    slides: Bools
    """Mask of the prismatic joints (N,)."""
    low: JointVelocities
    """Minimum reachable joint velocities (N,) [rad/s]."""
    high: JointVelocities
    """Maximum reachable joint velocities (N,) [rad/s]."""
    slew: Floats
    """Maximum rate of change of each joint velocity (N,) [rad/s^2]."""


class Segment(NamedTuple):
    """One segment of one estimated body of `Bodies`."""

    ends: Floats
    """End points (2, 3) [m]."""
    radius_m: float
    """Radius [m]."""
    velocity: Velocities3
    """Estimated velocities of the end points (2, 3) [m/s]."""
    joints: Ints
    """Indices of the joints on which the end points depend (2, T)."""
    shares: Floats
    """Influence of these joints on the end points (2, T)."""
    cov: Covariances3
    """Covariance of each joint's position (J, 3, 3) [m^2]."""
    age_s: Floats
    """Time since each joint was last supported by a measurement (J,) [s]."""
    capsule: int
    """Index of the segment in `CAPSULES`."""
    error_factor: float
    """Expected error divided by the standard deviation."""
    age_class: int
    """Class of the segment's age, or `NOT_CALIBRATED`."""


class Nearest(NamedTuple):
    """Distance and parameter of the nearest points of a robot's capsule and a body's segment."""

    distance_m: float
    """Distance between the two axes [m]."""
    along: float
    """Position of the point along the segment, from 0 at its first end to 1 at its second."""


class Pair(NamedTuple):
    """A robot's capsule and a body's segment that may touch."""

    e: int
    """Index of the environment."""
    c: int
    """Index of the robot's capsule."""
    w: int
    """Index of the worker."""
    s: int
    """Index of the segment."""
    along: float
    """Position of the segment's nearest point, from 0 at its first end to 1 at its second."""
    comes_m_s: float
    """Speed of that point towards the robot [m/s]; 0 if it moves away."""


class Approach(NamedTuple):
    """Motion of a point of a body towards a robot, and its uncertainty."""

    speed_m_s: float
    """Speed along -n [m/s]."""
    std_m: float
    """Standard deviation of the position along n [m]."""


class Reach(NamedTuple):
    """Limits on the motion of a point of a robot along n that commands can cause."""

    max_speed_m_s: float
    """Maximum speed of approach that a command can reach [m/s]."""
    deceleration_m_s2: float
    """Deceleration that the joints can achieve along n [m/s^2]."""


@kernel(makes_arrays=True)
def add_worker_constraints(
    robots: Robots, bodies: Bodies, params: ShieldParams, out: Constraints
) -> None:
    """Write the tightest constraints of every robot against every located worker.

    Args:
        robots: link frames, capsules and velocities within reach.
        bodies: estimated segments with velocities, covariances and ages.
        params: margins, limits and gains of the shield.
        out: receives `J`, `b`, `n_rows` and `clearance_m`; `low` and `high` are left unchanged.
    """
    n_caps, n_segments = robots.capsules.shape[1], bodies.segments.shape[2]
    rods, limbs, shapes = (
        np.empty((n_caps, 5)),
        np.empty((n_segments, 5)),
        np.empty((n_caps, WIDTH)),
    )
    normal, point, row = np.empty(3), np.empty(3), np.empty(len(robots.slides))
    for e in range(len(robots.capsules)):
        out.n_rows[e], out.clearance_m[e] = 0, np.inf
        arm = Arm(robots.frames[e], robots.slides, robots.low[e], robots.high[e], robots.slew)
        for c in range(n_caps):
            bound_capsule(robots.capsules[e, c], robots.radii_m[c], rods[c])
            rods[c, 4] = find_stopping_distance(arm, robots.links[c], robots.capsules[e, c], params)
        set_capsules(shapes, 0, robots.capsules[e], robots.radii_m)
        for w in range(bodies.segments.shape[1]):
            if not bodies.is_located[e, w]:
                continue
            moved = bodies.moved_m[e, w]
            for s in range(n_segments):
                segment = select_segment(bodies, e, w, s)
                bound_capsule(segment.ends, segment.radius_m, limbs[s])
                limbs[s, 4] = bound_deduction(segment, params) + moved
            for c, s in np.ndindex(n_caps, n_segments):
                if sphere_gap(rods[c], limbs[s]) > rods[c, 4] + limbs[s, 4]:
                    continue
                segment = select_segment(bodies, e, w, s)
                nearest = find_nearest(robots.capsules[e, c], segment.ends, point, normal)
                towards = project_motion(segment, nearest.along, normal)
                gap = nearest.distance_m - robots.radii_m[c] - segment.radius_m
                near = gap - find_margin(segment, towards.std_m, params) - moved
                clear = near - find_travel(towards.speed_m_s, params)
                out.clearance_m[e] = min(out.clearance_m[e], clear)
                link = int(robots.links[c])
                reach = write_row(arm, link, point, normal, row)
                braking = min(reach.deceleration_m_s2, params.deceleration_m_s2)
                bound = bound_approach(clear, braking, moved > 0.0, params)
                if bound < reach.max_speed_m_s and bodies.may_touch[e, w, s]:
                    pair = Pair(e, c, w, s, nearest.along, max(towards.speed_m_s, 0.0))
                    touch_m_s = limit_touch(robots, bodies, pair, shapes, normal, row)
                    if touch_m_s >= 0.0:
                        bound = max(bound, bound_touch(near, touch_m_s, braking, params))
                if bound < reach.max_speed_m_s:
                    keep_tightest(row, bound, e, out)


@kernel(makes_arrays=True)
def add_floor_constraints(
    robots: Robots, floor: UnseenFloors, params: ShieldParams, out: Constraints
) -> None:
    """Add constraints on the approach of robots to patches of floor that may not be empty.

    Args:
        robots: link frames, capsules and velocities within reach.
        floor: patches of floor and their states.
        params: margins, limits and gains of the shield.
        out: present constraints, to which the new ones are added.
    """
    body, rod, limb = np.empty((2, 3)), np.empty(5), np.empty(5)
    normal, point, row = np.empty(3), np.empty(3), np.empty(len(robots.slides))
    for e in range(len(robots.capsules)):
        arm = Arm(robots.frames[e], robots.slides, robots.low[e], robots.high[e], robots.slew)
        reach_m = floor.reach_m[e]
        for c in range(robots.capsules.shape[1]):
            bound_capsule(robots.capsules[e, c], robots.radii_m[c], rod)
            stop_m = find_stopping_distance(arm, robots.links[c], robots.capsules[e, c], params)
            for n in range(len(floor.centres_world)):
                if floor.level[e, n] != POSSIBLE:
                    continue
                body[0], body[1] = floor.centres_world[n], floor.centres_world[n]
                body[1, 2] += STATURE_M
                bound_capsule(body, reach_m, limb)
                if sphere_gap(rod, limb) > stop_m:
                    continue
                nearest = find_nearest(robots.capsules[e, c], body, point, normal)
                clear = nearest.distance_m - robots.radii_m[c] - reach_m
                out.clearance_m[e] = min(out.clearance_m[e], clear)
                reach = write_row(arm, robots.links[c], point, normal, row)
                braking = min(reach.deceleration_m_s2, params.deceleration_m_s2)
                bound = bound_approach(clear, braking, True, params)
                if bound < reach.max_speed_m_s:
                    keep_tightest(row, bound, e, out)


@kernel
def bound_capsule(ends: Floats, radius_m: float, sphere: Floats) -> None:
    """Write the bounding sphere of a capsule to `sphere`.

    Args:
        ends: (2, 3) end points of the capsule [m].
        radius_m: radius of the capsule [m].
        sphere: (5,) receives the centre and the radius [m]; its last value is left unchanged.
    """
    squared = 0.0
    for i in range(3):
        sphere[i] = 0.5 * (ends[0, i] + ends[1, i])
        squared += (ends[1, i] - ends[0, i]) ** 2
    sphere[3] = 0.5 * math.sqrt(squared) + radius_m


@kernel
def sphere_gap(one: Floats, other: Floats) -> float:
    """Return the distance between the surfaces of two spheres from `bound_capsule` [m]."""
    dx, dy, dz = one[0] - other[0], one[1] - other[1], one[2] - other[2]
    return math.sqrt(dx * dx + dy * dy + dz * dz) - one[3] - other[3]


@kernel
def find_stopping_distance(arm: Arm, link: int, ends: Floats, params: ShieldParams) -> float:
    """Return an upper bound on the stopping distance of a capsule [m].

    Pairs with a greater clearance are irrelevant. The bound uses the fact that no point of a
    capsule is faster than the faster of its ends. It is -inf for an absent load.

    Args:
        arm: the robot.
        link: index of the link that carries the capsule.
        ends: (2, 3) the capsule's end points [m].
        params: reaction time and deceleration.
    """
    fastest, longest_s = 0.0, 0.0
    for end in range(2):
        if abs(ends[end, 0]) > ABSENT_M:
            return -np.inf
        vx, vy, vz, either = 0.0, 0.0, 0.0, 0.0
        for i in range(link + 1):
            x, y, z = lever(arm.frames[i], arm.slides[i], ends[end])
            low, high = arm.low[i], arm.high[i]
            middle, half = 0.5 * (low + high), 0.5 * (high - low)
            vx, vy, vz = vx + middle * x, vy + middle * y, vz + middle * z
            either += half * math.sqrt(x * x + y * y + z * z)
            longest_s = max(longest_s, max(abs(low), abs(high)) / arm.slew[i])
        fastest = max(fastest, math.sqrt(vx * vx + vy * vy + vz * vz) + either)
    braking_s = max(fastest / params.deceleration_m_s2, longest_s)
    return fastest * (params.reaction_s + 0.5 * braking_s)


@kernel(makes_arrays=True)
def select_segment(bodies: Bodies, e: int, w: int, s: int) -> Segment:
    """Return segment `s` of worker `w` in environment `e`."""
    return Segment(
        bodies.segments[e, w, s],
        bodies.radii_m[e, w, s],
        bodies.velocity[e, w, s],
        bodies.joints[s],
        bodies.shares[s],
        bodies.cov[e, w],
        bodies.age_s[e, w],
        s,
        bodies.support.factor[e, w, s],
        bodies.support.age_class[e, w, s],
    )


@kernel
def bound_deduction(segment: Segment, params: ShieldParams) -> float:
    """Return an upper bound on the difference between gap and clearance of a segment [m].

    The bound holds for every direction of n.
    """
    squared, variance = 0.0, 0.0
    for end in range(2):
        v, of_end = segment.velocity[end], 0.0
        squared = max(squared, v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        for k in range(segment.joints.shape[1]):
            S = segment.cov[segment.joints[end, k]]
            of_end += segment.shares[end, k] * (S[0, 0] + S[1, 1] + S[2, 2])
        variance = max(variance, of_end)
    std_m, bounds = math.sqrt(variance), params.bounds
    error_m = params.protrusion_m[segment.capsule] + std_m + find_uncertainty(std_m, 0.0, params)
    if segment.age_class >= 0:
        error_m = max(error_m, bounds.bound_m[segment.capsule, segment.age_class, -1])
    margin_m = params.margins_m[segment.capsule] + error_m
    return margin_m + find_travel(math.sqrt(squared), params)


@kernel
def find_margin(segment: Segment, std_m: float, params: ShieldParams) -> float:
    """Return the distance to subtract from the gap of a segment, for the error of its estimate [m].

    Args:
        segment: the segment of an estimated body.
        std_m: standard deviation of the position along n [m].
        params: margins and calibrated bounds.
    """
    s = segment.capsule
    constant_m = params.protrusion_m[s]
    constant_m += find_uncertainty(std_m, find_segment_age(segment), params)
    expected_m = segment.error_factor * std_m
    error_m = find_error_bound(params.bounds, s, segment.age_class, expected_m, constant_m)
    return params.margins_m[s] + error_m


@kernel
def find_uncertainty(std_m: float, age_s: float, params: ShieldParams) -> float:
    """Return the uncertainty margin Z_d [m].

    Args:
        std_m: standard deviation of the position along n [m].
        age_s: time since the part of the body was last detected [s].
        params: factors on both parts of the standard deviation.
    """
    predicted = min(std_m, params.prediction_growth_m_s * age_s)
    seen = math.sqrt(std_m * std_m - predicted * predicted)
    doubt = params.single_view_sigmas * max(0.0, seen - params.single_view_std_m)
    return max(params.min_uncertainty_m, predicted + params.n_sigmas * seen + doubt)


@kernel
def find_travel(speed_m_s: float, params: ShieldParams) -> float:
    """Return the distance that a worker may approach before the robot has stopped [m].

    Args:
        speed_m_s: estimated speed towards the robot [m/s].
        params: time of the worker's approach, and the speed that replaces or increases the
            estimated one.
    """
    if params.follows_estimate:
        speed_m_s = max(speed_m_s, 0.0) + params.worker_m_s
    else:
        speed_m_s = params.worker_m_s
    return speed_m_s * params.travel_s


@kernel
def find_segment_age(segment: Segment) -> float:
    """Return the time since any joint of a segment was last detected [s]."""
    least = np.inf
    for end in range(2):
        for k in range(segment.joints.shape[1]):
            if segment.shares[end, k] > 0.0:
                j: int = segment.joints[end, k]
                least = min(least, float(segment.age_s[j]))
    return least


@kernel
def find_nearest(capsule: Floats, segment: Floats, point: Floats, normal: Floats) -> Nearest:
    """Find the nearest points of the axes of a robot's capsule and a body's segment.

    Args:
        capsule: (2, 3) end points [m].
        segment: (2, 3) end points [m].
        point: (3,) receives the nearest point on the robot's axis [m].
        normal: (3,) receives n, the unit vector from that point to the body.
    """
    squared, u, t = closest_parameters(capsule[0], capsule[1], segment[0], segment[1])
    distance = math.sqrt(squared)
    for i in range(3):
        point[i] = capsule[0, i] + u * (capsule[1, i] - capsule[0, i])
        to = segment[0, i] + t * (segment[1, i] - segment[0, i])
        normal[i] = (to - point[i]) / max(distance, 1e-6)
    return Nearest(distance, t)


@kernel
def project_motion(segment: Segment, along: float, normal: Floats) -> Approach:
    """Project the velocity and the covariance of a point of a segment onto n.

    Args:
        segment: the segment of an estimated body.
        along: position of the point, from 0 at the segment's first end to 1 at its second.
        normal: (3,) unit vector n.
    """
    nx, ny, nz = normal[0], normal[1], normal[2]
    speed, variance = 0.0, 0.0
    for end in range(2):
        share = along if end else 1.0 - along
        v = segment.velocity[end]
        speed -= share * (nx * v[0] + ny * v[1] + nz * v[2])
        for k in range(segment.joints.shape[1]):
            S = segment.cov[segment.joints[end, k]]
            across = nx * (ny * S[0, 1] + nz * S[0, 2]) + ny * nz * S[1, 2]
            squares = nx * nx * S[0, 0] + ny * ny * S[1, 1] + nz * nz * S[2, 2]
            variance += share * segment.shares[end, k] * (squares + 2.0 * across)
    return Approach(speed, math.sqrt(max(variance, 0.0)))


@kernel
def write_row(arm: Arm, link: int, point: Floats, normal: Floats, row: Floats) -> Reach:
    """Write n.J of a point of a robot to `row`, and return the reachable motion along n.

    Args:
        arm: the robot.
        link: index of the link that carries the point.
        point: (3,) the point in the world frame [m].
        normal: (3,) unit vector n.
        row: (N,) receives n.J.
    """
    fastest, slowing = 0.0, 0.0
    for i in range(len(row)):
        row[i] = 0.0
        if i <= link:
            x, y, z = lever(arm.frames[i], arm.slides[i], point)
            row[i] = x * normal[0] + y * normal[1] + z * normal[2]
            fastest += max(row[i] * arm.low[i], row[i] * arm.high[i])
            slowing += abs(row[i]) * arm.slew[i]
    return Reach(fastest, slowing)


@kernel
def bound_approach(
    clearance_m: float, braking_m_s2: float, is_lost: bool, params: ShieldParams
) -> float:
    """Return the maximum speed of approach [m/s]; a negative value is the minimum speed of retreat.

    Args:
        clearance_m: clearance D [m].
        braking_m_s2: maximum deceleration of the point [m/s^2].
        is_lost: whether the worker's position is only known from an earlier detection; the robot
            does not retreat from such workers.
        params: reaction time, and gain and limit of a retreat.
    """
    if clearance_m < 0.0:
        if is_lost:
            return RANKING_HZ * clearance_m
        return max(-params.retreat_m_s, params.gain_hz * clearance_m)
    reaction_s = params.reaction_s
    root = math.sqrt(reaction_s**2 + 2.0 * clearance_m / max(braking_m_s2, 1e-9))
    return braking_m_s2 * (root - reaction_s)


@kernel
def limit_touch(
    robots: Robots, bodies: Bodies, pair: Pair, shapes: Floats, normal: Floats, row: Floats
) -> float:
    """Return the maximum speed of a robot in a touch of a segment [m/s]; -1 if none is tolerated.

    Args:
        robots: the robots, with their mass matrices and surroundings.
        bodies: the estimated bodies, with the limits of their segments.
        pair: the capsule and the segment.
        shapes: (K, `shapes.WIDTH`) the capsules of the robot.
        normal: (3,) unit vector n.
        row: (N,) row n.J.
    """
    e, w, s, along = pair.e, pair.w, pair.s, pair.along
    mobility = find_mobility(robots.inverse_mass[e], row)
    permitted = find_permitted_speeds(bodies.limits, s, mobility)
    left_m_s = permitted.free_m_s - pair.comes_m_s
    if left_m_s <= 0.0:
        return -1.0
    touch_m_s = min(left_m_s, bodies.robot_share_m_s[pair.c])
    if permitted.clamping_m_s < touch_m_s:
        ends = bodies.segments[e, w, s]
        centre = Vector3(
            ends[0, 0] + along * (ends[1, 0] - ends[0, 0]),
            ends[0, 1] + along * (ends[1, 1] - ends[0, 1]),
            ends[0, 2] + along * (ends[1, 2] - ends[0, 2]),
        )
        reach_m = bodies.radii_m[e, w, s] + bodies.limits.min_gap_m[s]
        installation = Installation(robots.obstacles, shapes, robots.links)
        if is_clamped(installation, robots.links[pair.c], centre, normal, reach_m):
            return permitted.clamping_m_s
    return touch_m_s


@kernel
def bound_touch(
    near_m: float, touch_m_s: float, braking_m_s2: float, params: ShieldParams
) -> float:
    """Return the maximum speed of approach to a segment that may be touched [m/s].

    Args:
        near_m: gap - margin - error [m].
        touch_m_s: allowed speed of the robot in the touch [m/s]; with 0 it only makes small
            corrections.
        braking_m_s2: maximum deceleration of the point [m/s^2].
        params: reaction time and speed of corrections.
    """
    if touch_m_s == 0.0:
        return params.creep_m_s
    root = math.sqrt(touch_m_s**2 + 2.0 * braking_m_s2 * max(near_m, 0.0))
    return max(touch_m_s, root - braking_m_s2 * params.reaction_s)


@kernel
def keep_tightest(row: Floats, bound: float, e: int, out: Constraints) -> None:
    """Add a constraint to environment `e`; if all rows are used, replace a looser one.

    Args:
        row: (N,) row n.J.
        bound: maximum speed of approach [m/s].
        e: index of the environment.
        out: constraints so far.
    """
    at = out.n_rows[e]
    if at == MAX_CONSTRAINTS:
        at = np.argmax(out.b[e])
        if out.b[e, at] <= bound:
            return
    else:
        out.n_rows[e] = at + 1
    for i in range(len(row)):
        out.J[e, at, i] = row[i]
    out.b[e, at] = bound
