"""The built-in shields, which limit joint velocities by the constraints of `safety.constraints`.

"sara" executes or refuses a command as a whole (`safety.reachability`). "ssm" scales all joint
velocities by one factor, which preserves the path. "qp" and "pfl" select the
nearest velocities that the arm can reach within a step. A constraint that requires a retreat is
split into two: a constraint against approaching, with a very large weight, and a constraint to
retreat. With a single constraint, an arm that retreats from one hand would push its wrist into the
other hand.

A task may allow parts of estimated bodies to touch the robot's hand (`Task.allowed_contact`), such
as the forearms and hands of a worker who takes a tool. While these approach no faster than their
region of the body tolerates in a contact with this arm and its load, no link retreats from them,
which keeps the held object within reach. The last link and its load may touch them at
`contact_speed_m_s` at most, if the region tolerates the sum of both speeds. Other links may
approach at `creep_m_s`. The constraints for all other people and parts of the body are unchanged.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from hrc_env.belief import Belief
from hrc_env.core.errors import require
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Bools, Floats, Ints, JointVelocities, Transforms, Velocities3
from hrc_env.core.vacancy import WALKING_M_S
from hrc_env.geometry import chains
from hrc_env.geometry.chains import lever
from hrc_env.geometry.enclosure import (
    CAPSULES,
    BodyCapsules,
    enclose,
    find_shares,
    find_velocities,
    load_enclosure,
)
from hrc_env.geometry.robot_model import RobotModel
from hrc_env.safety.config import ShieldConfig, ShieldParams
from hrc_env.safety.constraints import (
    ABSENT_M,
    MAX_CONSTRAINTS,
    Bodies,
    Constraints,
    Robots,
    UnseenFloors,
    add_floor_constraints,
    add_worker_constraints,
)
from hrc_env.safety.contact import (
    CAPSULE_REGIONS,
    make_contact_limits,
    permitted_contact_speed,
)
from hrc_env.safety.error_bounds import NOT_CALIBRATED, ErrorBounds, Support, find_support
from hrc_env.safety.reachability import (
    STANDSTILL_M_S,
    Sweep,
    Verification,
    brake,
    sweep_path,
    verify_sweep,
)
from hrc_env.safety.solver import Problem, constraint_violation, solve
from hrc_env.safety.unseen import HAND_M, find_undetected

NO_APPROACH_WEIGHT, RETREAT_WEIGHT = 1e4, 30.0
"""Weights of violations [m/s] of the constraints against approaching and of those to retreat,
relative to changes of joint velocities [rad/s]."""
TOLERANCE_M_S = 1e-6
"""Violation below which a constraint counts as satisfied [m/s]."""
LIMITS = make_contact_limits(CAPSULES)
"""Contact limits of the capsules of an estimated body (S,)."""


class ShieldOutput(NamedTuple):
    """The result of a shield."""

    velocities: JointVelocities
    """Joint velocities that the arm receives (B, N) [rad/s]."""
    values: Mapping[str, Floats]
    """Reported values (B,) by name; info contains each of them as "shield/NAME"."""


@dataclass(frozen=True, slots=True, eq=False)
class ArmPose:
    """Poses of the links and capsules of the robots that a shield commands."""

    model: RobotModel
    """Constant properties of the robot."""
    frames: Transforms
    """Poses of the links in the world (B, N, 4, 4)."""
    links: Ints
    """Index of the link that carries each capsule (K,)."""


class KnownBodies(NamedTuple):
    """Bodies with known instead of estimated surfaces, for upper bounds on performance."""

    capsules: BodyCapsules
    """Capsules of the bodies (B, W, S, ...)."""
    velocity_world: Velocities3
    """Velocities of the ends of the capsules (B, W, S, 2, 3) [m/s]."""


def limit_command(
    belief: Belief,
    velocities: JointVelocities,
    dt_s: float,
    config: ShieldConfig,
    known: KnownBodies | None = None,
) -> ShieldOutput:
    """Return the safe joint velocities nearest to the given ones; implements `shield.Shield`.

    The reported values are

    - "clearance_m" (B,): the smallest clearance D of the relevant pairs [m], NaN if there are none;
    - "slack" (B,): the maximum violation of a constraint, including retreats [m/s];
    - "unknown" (B,): 1 while a worker's position is unknown or the last detection is too old.

    Args:
        belief: the robot's knowledge of itself and of the workers.
        velocities: (B, N) joint velocities of the agent [rad/s].
        dt_s: time until the next command [s].
        config: kind, margins and limits.
        known: bodies to use instead of the estimated ones; None without such knowledge.

    Raises:
        ConfigError: the belief lacks the `RobotModel` or the current command.
    """
    if config.kind == "sara":
        return execute_verified(belief, velocities, dt_s, config, known)
    pose, undetected = describe_pose(belief), find_undetected(belief, config)
    found = build_constraints(belief, pose, undetected.is_lost, velocities, dt_s, config, known)
    limit = partial(limit_speed, pose.frames, pose.model.chain.slides, pose.links,
                    belief.robot.capsules_world, undetected.speed_limit_m_s)  # fmt: skip
    wanted, allowed, slack = velocities.copy(), np.empty_like(velocities), np.empty(len(velocities))
    limit(wanted)
    choose = scale_velocities if config.kind == "ssm" else find_nearest_velocities
    choose(found, wanted, allowed)
    limit(allowed)
    find_slack(found, allowed, slack)
    values = _describe_limits(belief, undetected.is_lost, found.clearance_m, slack)
    return ShieldOutput(allowed, values)


def execute_verified(
    belief: Belief,
    velocities: JointVelocities,
    dt_s: float,
    config: ShieldConfig,
    known: KnownBodies | None = None,
) -> ShieldOutput:
    """Return the given joint velocities where they are verified; the other robots brake.

    See `limit_command`. "clearance_m" is the smallest gap between the reachable sets, and "slack"
    the speed of the allowed motion above the limit, where people can be.
    """
    pose, undetected = describe_pose(belief), find_undetected(belief, config)
    model, command = pose.model, require(belief.command, "The current command of the joints")
    params, bodies = _select_bodies(belief, pose, undetected.is_lost, config, known)
    limit = partial(limit_speed, pose.frames, model.chain.slides, pose.links,
                    belief.robot.capsules_world, undetected.speed_limit_m_s)  # fmt: skip
    hold_s, change = max(config.reaction_s, dt_s), model.slew_rad_s2 * dt_s
    tolerated_m_s = find_tolerated_speeds(model.mass_kg + weigh_loads(belief, model))

    def verify(intended: JointVelocities) -> Verification:
        reached = np.clip(intended, command - change, command + change)
        sweep = sweep_path(belief.robot, model, pose.links, reached, hold_s)
        found = verify_sweep(sweep, bodies, tolerated_m_s, params, config.latency_s)
        near = _is_near_unseen_floor(belief, sweep, config)
        fastest = np.where(near, sweep.speed_m_s.max((1, 2)) - STANDSTILL_M_S, 0.0)
        return replace(found, excess_m_s=np.maximum(found.excess_m_s, fastest))

    wanted = velocities.copy()
    limit(wanted)
    found = verify(wanted)
    is_verified = found.excess_m_s <= 0.0
    allowed = np.where(is_verified[:, None], wanted, brake(command, model, dt_s))
    limit(allowed)
    slack = found.excess_m_s if is_verified.all() else verify(allowed).excess_m_s
    values = _describe_limits(belief, undetected.is_lost, found.gap_m, slack)
    return ShieldOutput(allowed, values)


def _describe_limits(
    belief: Belief, is_lost: Bools, clearance_m: Floats, slack: Floats
) -> Mapping[str, Floats]:
    """Return the reported values of `limit_command`."""
    return {
        "clearance_m": np.where(np.isinf(clearance_m), np.nan, clearance_m),
        "slack": slack,
        "unknown": (belief.estimate.unknown | is_lost).any(1).astype(float),
    }


def _is_near_unseen_floor(belief: Belief, sweep: Sweep, config: ShieldConfig) -> Bools:
    """Return whether people on unobserved floor can reach a robot before it stands still (B,)."""
    floor = belief.unseen
    if floor is None:
        return np.zeros(len(sweep.until_s), bool)
    path_m = (sweep.radii_m - belief.robot.capsule_radius_m).sum(1).max(1) * 2.0
    walked_m = WALKING_M_S * (floor.age_s + sweep.until_s[:, -1] + config.latency_s)
    return floor.possible_m < path_m + walked_m + HAND_M


def describe_pose(belief: Belief) -> ArmPose:
    """Return the poses of links and capsules. Loads are attached to the last link."""
    model = require(belief.model, "The robot's model (RobotModel) for a built-in shield")
    links = model.list_capsule_links(len(belief.robot.capsule_radius_m))
    return ArmPose(model, chains.link_frames(model.chain, belief.robot.q), links)


def weigh_loads(belief: Belief, model: RobotModel) -> Floats:
    """Return the mass of the objects that each robot holds (B,) [kg]."""
    if belief.objects is None:
        return np.zeros(len(belief.action))
    held_kg: Floats = belief.objects.held @ model.load_kg
    return held_kg


def build_constraints(
    belief: Belief,
    pose: ArmPose,
    is_lost: Bools,
    wanted: JointVelocities,
    dt_s: float,
    config: ShieldConfig,
    known: KnownBodies | None = None,
) -> Constraints:
    """Return the tightest constraints on the joint velocities of every robot.

    For "ssm", the reachable velocities are those between zero and `wanted`; for other kinds, those
    that the slew rate permits until the next command.

    Args:
        belief: the robot's knowledge of itself and of the workers.
        pose: poses of the robots' links and capsules.
        is_lost: (B, W) mask of the workers that were detected once, but not recently.
        wanted: (B, N) joint velocities of the agent [rad/s].
        dt_s: time until the next command [s].
        config: kind, margins and limits.
        known: bodies to use instead of the estimated ones, as in `limit_command`.
    """
    model, batch = pose.model, len(wanted)
    low, high = np.minimum(wanted, 0.0), np.maximum(wanted, 0.0)
    if config.kind != "ssm":
        in_force = require(
            belief.command, "The current command of the joints for a built-in shield"
        )
        most, change = model.fastest_rad_s, model.slew_rad_s2 * dt_s
        low = np.minimum(np.maximum(-most, in_force - change), most)
        high = np.maximum(np.minimum(most, in_force + change), -most)
    found = Constraints(
        J=np.empty((batch, MAX_CONSTRAINTS, model.chain.n_joints)),
        b=np.empty((batch, MAX_CONSTRAINTS)),
        n_rows=np.empty(batch, np.int64),
        low=low,
        high=high,
        clearance_m=np.empty(batch),
    )
    params, bodies = _select_bodies(belief, pose, is_lost, config, known)
    robots = Robots(
        frames=pose.frames,
        slides=model.chain.slides,
        links=pose.links,
        capsules=belief.robot.capsules_world,
        radii_m=belief.robot.capsule_radius_m,
        low=low,
        high=high,
        slew=model.slew_rad_s2,
        inverse_mass=_invert_mass_matrices(belief, pose, bodies),
        obstacles=model.obstacles,
    )
    floor = belief.unseen
    add_worker_constraints(robots, bodies, params, found)
    if floor is not None and np.isfinite(floor.possible_m).any():
        walked_m = WALKING_M_S * (floor.age_s + config.reaction_s + config.latency_s)
        unseen = UnseenFloors(floor.floor_world, floor.level, floor.piece_m + HAND_M + walked_m)
        add_floor_constraints(robots, unseen, params, found)
    return found


def _invert_mass_matrices(belief: Belief, pose: ArmPose, bodies: Bodies) -> Floats:
    """Return the inverse mass matrices (B, N, N) of the robots that may touch a worker.

    Those of other robots are NaN; their constraints do not depend on them.

    Args:
        belief: the robot's knowledge of itself and of the workers.
        pose: poses of the robots' links and capsules.
        bodies: the estimated bodies, with the segments that may be touched.
    """
    model, n_joints = pose.model, pose.model.chain.n_joints
    may_touch = np.asarray(bodies.may_touch.any((1, 2)))
    inverse = np.full((len(may_touch), n_joints, n_joints), np.nan)
    if may_touch.any():
        load_kg = weigh_loads(belief, model)[may_touch]
        inverse[may_touch] = model.invert_mass_matrices(pose.frames[may_touch], load_kg)
    return inverse


def describe_bodies(
    belief: Belief, pose: ArmPose, is_lost: Bools, config: ShieldConfig, bounds: ErrorBounds
) -> Bodies:
    """Return the estimated bodies of the workers.

    Lost workers are assumed to be at rest at their last estimate, whose error is not calibrated.

    Args:
        belief: the robot's knowledge of itself and of the workers.
        pose: poses of the robots' links and capsules.
        is_lost: (B, W) mask of the workers that were detected once, but not recently.
        config: kind, margins and limits.
        bounds: calibrated bounds on the errors of segments.
    """
    estimate = belief.estimate
    mean, velocity, cov = estimate.mean_world, estimate.velocity_world, estimate.cov_world
    touches = _find_allowed_touches(belief, pose, config)
    may_touch = touches.may_touch
    if is_lost.any():
        lost = is_lost[..., None, None]
        mean, velocity = np.where(lost, estimate.seen_world, mean), np.where(lost, 0.0, velocity)
        cov = np.where(lost[..., None], 0.0, cov)
        may_touch = may_touch & ~lost[..., 0]
    walking_m_s = WALKING_M_S if config.worker_speed_m_s is None else config.worker_speed_m_s
    capsules, enclosure, support = enclose(mean), load_enclosure(), find_support(estimate, bounds)
    support.age_class[is_lost] = NOT_CALIBRATED
    return Bodies(
        segments=capsules.ends_world,
        radii_m=capsules.radius_m,
        velocity=find_velocities(capsules, mean, velocity),
        cov=cov,
        age_s=estimate.age_s,
        is_located=estimate.tracked | is_lost,
        moved_m=np.where(is_lost, walking_m_s * estimate.unobserved_s, 0.0),
        may_touch=may_touch,
        limits=LIMITS,
        robot_share_m_s=touches.capsule_m_s,
        joints=enclosure.joints,
        shares=find_shares(),
        support=support,
    )


def _select_bodies(
    belief: Belief,
    pose: ArmPose,
    is_lost: Bools,
    config: ShieldConfig,
    known: KnownBodies | None,
) -> tuple[ShieldParams, Bodies]:
    """Return the settings and the bodies to use: the estimated ones, or the known ones.

    The surfaces of known bodies have no errors; only `min_uncertainty_m` remains.
    """
    params = config.make_params()
    bodies = describe_bodies(belief, pose, is_lost, config, params.bounds)
    if known is None:
        return params, bodies
    age_class = np.full_like(bodies.support.age_class, NOT_CALIBRATED)
    bodies = bodies._replace(
        segments=known.capsules.ends_world,
        radii_m=known.capsules.radius_m,
        velocity=known.velocity_world,
        cov=np.zeros_like(bodies.cov),
        support=Support(bodies.support.factor, age_class),
    )
    return params._replace(protrusion_m=np.zeros_like(params.protrusion_m)), bodies


@dataclass(frozen=True, slots=True)
class AllowedTouches:
    """Touches of estimated bodies that are allowed, if their regions tolerate them."""

    may_touch: Bools
    """Mask (B, W, S) of the segments that may be touched."""
    capsule_m_s: Floats
    """Maximum speed of each of the robot's capsules in an allowed touch (K,) [m/s]."""


def find_tolerated_speeds(mass_kg: Floats) -> Floats:
    """Return the speed of a robot that each segment tolerates in a contact (B, S) [m/s].

    Args:
        mass_kg: (B,) effective mass of the robot by the standard's rule [kg].
    """
    regions = [CAPSULE_REGIONS[name] for name in CAPSULES]
    speeds = {name: permitted_contact_speed(name, mass_kg) for name in set(regions)}
    return np.stack([speeds[name] for name in regions], axis=1)


def _find_allowed_touches(belief: Belief, pose: ArmPose, config: ShieldConfig) -> AllowedTouches:
    """Return the allowed touches: all for "pfl" and "sara", otherwise those of the task."""
    links = pose.links
    shape = (*belief.estimate.tracked.shape, len(CAPSULES))
    if config.kind in ("pfl", "sara"):
        most_m_s = np.inf if config.kind == "pfl" else config.contact_speed_m_s
        return AllowedTouches(np.ones(shape, bool), np.full(len(links), most_m_s))
    if belief.allowed_contact is None:
        return AllowedTouches(np.zeros(shape, bool), np.zeros(len(links)))
    is_last = links == pose.model.chain.n_joints - 1
    return AllowedTouches(belief.allowed_contact, np.where(is_last, config.contact_speed_m_s, 0.0))


@kernel
def scale_velocities(
    constraints: Constraints, wanted: JointVelocities, allowed: JointVelocities
) -> None:
    """Scale the velocities of all joints by the largest factor that the constraints permit.

    The factor is in [0, 1]. If a constraint J v <= b has b <= 0 and the motion has J v > 0, it is
    0: the robot stops, and the constraint may stay violated.

    Args:
        constraints: constraints of every robot.
        wanted: (B, N) joint velocities of the agent [rad/s].
        allowed: (B, N) receives the allowed joint velocities [rad/s].
    """
    J, b = constraints.J, constraints.b
    for e in range(len(wanted)):
        share = 1.0
        for r in range(constraints.n_rows[e]):
            speed = constraint_violation(J[e, r], 0.0, wanted[e])
            if speed > 0.0:
                share = min(share, max(b[e, r], 0.0) / speed)
        for i in range(wanted.shape[1]):
            allowed[e, i] = share * wanted[e, i]


@kernel(makes_arrays=True)
def find_nearest_velocities(
    constraints: Constraints, wanted: JointVelocities, allowed: JointVelocities
) -> None:
    """Find the reachable joint velocities nearest to `wanted` that satisfy the constraints.

    If the wanted velocities satisfy all constraints, they are returned unchanged, even if they are
    not reachable.

    Args:
        constraints: constraints of every robot.
        wanted: (B, N) joint velocities of the agent [rad/s].
        allowed: (B, N) receives the allowed joint velocities [rad/s].
    """
    J, b, count = constraints.J, constraints.b, constraints.n_rows
    low, high = constraints.low, constraints.high
    n = wanted.shape[1]
    rows, bound = np.empty((2 * MAX_CONSTRAINTS, n)), np.empty(2 * MAX_CONSTRAINTS)
    weight, scratch = np.empty(2 * MAX_CONSTRAINTS), np.empty((n + 3, n))
    for e in range(len(wanted)):
        holds, x = True, allowed[e]
        for i in range(n):
            x[i] = min(high[e, i], max(low[e, i], wanted[e, i]))
        for r in range(count[e]):
            holds &= constraint_violation(J[e, r], b[e, r], x) <= TOLERANCE_M_S
        if holds:
            for i in range(n):
                x[i] = wanted[e, i]
            continue
        m = 0
        for r in range(count[e]):
            for away in range(2 if b[e, r] < 0.0 else 1):
                for i in range(n):
                    rows[m, i] = J[e, r, i]
                bound[m] = b[e, r] if away else max(b[e, r], 0.0)
                weight[m] = RETREAT_WEIGHT if away else NO_APPROACH_WEIGHT
                m += 1
        problem = Problem(rows[:m], bound[:m], weight[:m], low[e], high[e], wanted[e])
        solve(problem, x, scratch)


@kernel
def limit_speed(
    frames: Transforms,
    slides: Bools,
    links: Ints,
    capsules: Floats,
    limit_m_s: Floats,
    allowed: JointVelocities,
) -> None:
    """Scale joint velocities so that no end point of a capsule exceeds a speed limit.

    Args:
        frames: (B, N, 4, 4) world_from_link.
        slides: (N,) mask of the prismatic joints.
        links: (K,) index of the link that carries each capsule.
        capsules: (B, K, 2, 3) end points in the world [m].
        limit_m_s: (B,) speed limit of every point [m/s]; infinite if there is no limit.
        allowed: (B, N) joint velocities, changed in place [rad/s].
    """
    for e in range(len(allowed)):
        if limit_m_s[e] == np.inf:
            continue
        fastest = 0.0
        for c in range(len(links)):
            for end in range(2):
                point, vx, vy, vz = capsules[e, c, end], 0.0, 0.0, 0.0
                for i in range(links[c] + 1 if abs(point[0]) <= ABSENT_M else 0):
                    x, y, z = lever(frames[e, i], slides[i], point)
                    qd = allowed[e, i]
                    vx, vy, vz = vx + qd * x, vy + qd * y, vz + qd * z
                fastest = max(fastest, math.sqrt(vx * vx + vy * vy + vz * vz))
        if fastest > limit_m_s[e]:
            for i in range(allowed.shape[1]):
                allowed[e, i] *= limit_m_s[e] / fastest


@kernel
def find_slack(constraints: Constraints, allowed: JointVelocities, slack: Floats) -> None:
    """Write the maximum constraint violation of the `allowed` velocities to `slack` (B,) [m/s]."""
    for e in range(len(allowed)):
        slack[e] = 0.0
        for r in range(constraints.n_rows[e]):
            violation = constraint_violation(constraints.J[e, r], constraints.b[e, r], allowed[e])
            slack[e] = max(slack[e], violation)
