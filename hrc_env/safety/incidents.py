"""Incidents: contacts by kind and force, near misses, violations of the protective distance.

All values are computed from the true poses of the bodies at the physics steps of a control step. A
*directed speed* is the rate at which one body's motion reduced the separation, with the other body
held at its final pose. A contact begins when surfaces touch that have not touched for
`CONTACT_GAP_S`, because an arm that is hit bounces. Kind and speeds of a contact are those of the
two points that touch, along the line between them. The kind describes the robot's motion in the
previous control step, because the impact changes the motion in the step itself: the robot moved
*towards* the worker, was *fleeing*, or was *standing*. The closing speed is the sum of the robot's
speed in the previous step and the worker's, which no impact changes. The greatest speeds of the
last `N_RECENT` steps are reported beside them, because a robot may brake before it touches. The
force of a contact is computed by the model of ISO/TS 15066, A.3, with the effective mass of the
robot at the touching point along that line, and divided by the permitted force of the touched
region (`safety.contact`). A robot that moves towards a part that cannot yield (`safety.clamping`)
clamps it: then the ratio is the greater of that of the transient contact at the closing speed and
that of the quasi-static contact at the robot's own speed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np

from hrc_env.core.batching import Stateful
from hrc_env.core.declared import Records1, Records2, dtype_of, make_records
from hrc_env.core.kernels import kernel
from hrc_env.core.records import RobotState
from hrc_env.core.typing import (
    Bools,
    Capsules,
    Floats,
    Ints,
    JointAngles,
    JointVelocities,
    Points3,
    Vector3,
    Velocities3,
)
from hrc_env.geometry.chains import capsules, lever, link_frames
from hrc_env.geometry.distances import Bounds, closest_parameters, find_gap, least_separation
from hrc_env.geometry.inertia import find_mobility
from hrc_env.geometry.robot_model import RobotModel
from hrc_env.geometry.shapes import WIDTH, set_capsules
from hrc_env.safety.clamping import Installation, is_clamped
from hrc_env.safety.contact import (
    CAPSULE_REGIONS,
    REGIONS,
    BodyRegion,
    clamping_force,
    contact_force,
)
from hrc_env.safety.separation import protective_distance
from hrc_env.world import World

KINDS = ("towards", "fleeing", "standing")
MOVING_M_S = 0.05
"""Directed speed above which a robot counts as moving towards a worker or fleeing [m/s]. The value
is an estimate. Slower robots count as standing; a robot that stands or flees cannot prevent a
worker from walking into it."""
CONTACT_GAP_S = 0.5
"""Time without touch after which another touch counts as a new contact [s]."""
WATCHED_M = 1.0
"""Separation beyond which no speeds are measured [m]. Bodies never approach each other by that
distance in one step."""
NEAR_MISS_M, CLEAR_M = 0.05, 0.10
"""Separations below which a near miss begins, and beyond which it ends if there was no touch [m].
The values are estimates."""
REACTION_S = 0.1
"""Reaction time in the computation of the protective distance [s]. It is a typical value."""
N_RECENT = 5
"""Number of steps before a contact of which the greatest speeds are reported."""
TOWARDS, FLEEING, STANDING = range(len(KINDS))
WITHIN, BEYOND, NEVER = 1, 2, 3
"""Severities of a contact: within the limit of the region, beyond the limit, and contact with the
head, which is never permitted."""
REGION_NAMES = tuple(REGIONS)


class WorkerHistory:
    """History of contacts and near misses between one robot and one worker in an episode."""

    since_s: float
    """Time since the last touch of robot and worker [s]."""
    is_close: bool
    """Whether a near miss between robot and worker has begun and not yet ended."""
    contacts: Annotated[Ints, (len(KINDS),)]
    """Number of contacts of each kind in this episode."""
    near_misses: int
    """Number of near misses in this episode."""


class Incident:
    """Events between one robot and one worker in a step."""

    separation_m: float
    """Separation at the end of the step [m]. It is NaN, like the speeds, beyond `WATCHED_M`."""
    robot_m_s: float
    """Directed speed of the robot in this step [m/s]."""
    worker_m_s: float
    """Directed speed of the worker in this step [m/s]."""
    kind: int
    """Kind of the contact that begins in this step, as an index into `KINDS`; -1 if none begins."""
    region: int
    """Region of the body that is touched, as an index into `REGION_NAMES`; -1 if none is
    touched."""
    robot_speed_m_s: float
    """Speed of the robot's touching point towards the worker in the step before the contact that
    begins [m/s]; NaN if none begins."""
    closing_speed_m_s: float
    """Closing speed of the contact that begins [m/s]; NaN if none begins."""
    recent_robot_speed_m_s: float
    """Maximum of `robot_speed_m_s` over the last `N_RECENT` steps [m/s]; NaN if none begins."""
    recent_closing_speed_m_s: float
    """Maximum closing speed of the touching points in these steps and in the contact [m/s]; NaN if
    none begins."""
    force_ratio: float
    """Force of the contact that begins, divided by the permitted force; NaN if none begins."""
    is_clamped: bool
    """Whether the robot clamps the touched part in the contact that begins."""
    severity: int
    """Severity `WITHIN`, `BEYOND` or `NEVER` of the contact that begins; 0 if none begins."""
    is_separation_violated: bool
    """Whether the robot moves towards the worker within the protective distance."""
    is_near_miss: bool
    """Whether a near miss ends in this step."""


class Summary:
    """Events of one step of an environment, over all workers; NaN for values not measured."""

    robot_towards_m_s: float
    """Speed of the robot towards the nearest worker [m/s]."""
    worker_towards_m_s: float
    """Speed of the nearest worker towards the robot [m/s]."""
    separation_violated: float
    """1 if the robot moves towards any worker within the protective distance, else 0."""
    contact_robot_speed_m_s: float
    """Maximum speed of the robot's touching point before a contact that begins [m/s]."""
    contact_closing_speed_m_s: float
    """Maximum closing speed of a contact that begins [m/s]."""
    contact_recent_robot_speed_m_s: float
    """Maximum speed of that point in the last five steps before a contact that begins [m/s]."""
    contact_recent_closing_speed_m_s: float
    """Maximum closing speed in these steps and in a contact that begins [m/s]."""
    contact_force_ratio: float
    """Maximum force of a contact that begins, divided by the permitted force."""
    contact_severity: float
    """Maximum severity of a contact that begins; 0 if none begins."""
    contact_is_clamped: float
    """1 if the robot clamps a part of a body in a contact that begins, else 0."""
    contacts_towards: float
    """Number of contacts in the episode so far in which the robot moved towards the worker."""
    contacts_fleeing: float
    """Number of contacts in the episode so far in which the robot was fleeing."""
    contacts_standing: float
    """Number of contacts in the episode so far in which the robot was standing."""
    near_misses: float
    """Number of near misses in the episode so far."""


HISTORY, INCIDENT, SUMMARY = dtype_of(WorkerHistory), dtype_of(Incident), dtype_of(Summary)
NOT_ALWAYS_MEASURED = (
    "robot_towards_m_s",
    "worker_towards_m_s",
    "contact_robot_speed_m_s",
    "contact_closing_speed_m_s",
    "contact_recent_robot_speed_m_s",
    "contact_recent_closing_speed_m_s",
    "contact_force_ratio",
)
"""Fields of `Summary` that may be NaN."""


class Paths(NamedTuple):
    """Capsules of robots and workers at the end of every physics step of a control step."""

    robot_world: Capsules
    """End points of the robot's capsules (B, T, K, 2, 3) [m]."""
    robot_radius_m: Floats
    """Radii of the robot's capsules (K,) [m]."""
    workers_world: Capsules
    """End points of the workers' capsules (B, T, W, L, 2, 3) [m]."""
    worker_radius_m: Floats
    """Radii of the workers' capsules (B, W, L) [m]."""
    gaps_m: Floats
    """Separations between robot and workers (B, T, W) [m]."""


@dataclass(frozen=True, slots=True)
class RecentMotion:
    """Velocities of capsules in the last `N_RECENT` control steps, as a ring in each environment.

    They are 0 before the episode.
    """

    robot_world: Velocities3
    """Velocities of the ends of the robot's capsules (B, R, K, 2, 3) [m/s]."""
    workers_world: Velocities3
    """Velocities of the ends of the workers' capsules (B, R, W, L, 2, 3) [m/s]."""
    n_steps: Ints
    """Number of steps recorded in each environment (B,); the next one is row `n_steps` % R."""

    def record(self, paths: "Paths", took_s: float) -> None:
        """Record a step, in which `took_s` passed from the first to the last physics step [s]."""
        rows = np.arange(len(self.n_steps)), self.n_steps % N_RECENT
        self.robot_world[rows] = (paths.robot_world[:, -1] - paths.robot_world[:, 0]) / took_s
        self.workers_world[rows] = (paths.workers_world[:, -1] - paths.workers_world[:, 0]) / took_s
        self.n_steps[:] += 1

    def reset(self, ids: Ints) -> None:
        """Forget the steps of environments `ids`."""
        self.robot_world[ids], self.workers_world[ids], self.n_steps[ids] = 0.0, 0.0, 0

    def list_rows(self, b: int) -> Ints:
        """Return the rows (R,) of environment `b`, from the last step backwards."""
        last: Ints = self.n_steps[b] - 1 - np.arange(N_RECENT)
        return last % N_RECENT


@dataclass(frozen=True, slots=True)
class Touch:
    """The pair of capsules that overlaps most in a touch."""

    robot_capsule: int
    """Index of the robot's capsule."""
    worker_capsule: int
    """Index of the worker's capsule."""
    robot_along: float
    """Position of the touching point along the robot's capsule, from 0 to 1."""
    worker_along: float
    """Position of the touching point along the worker's capsule, from 0 to 1."""
    normal_world: Points3
    """Unit vector (3,) from the robot's point to the worker's; zero if the axes intersect."""
    step: int
    """Physics step of the touch."""


@dataclass(frozen=True, slots=True)
class TouchingRobots:
    """Robots in contacts: their masses, poses and surroundings."""

    model: RobotModel
    """Constant properties of the robots."""
    q: JointAngles
    """Joint positions (B, N) at the end of the step [rad], or [m] for slides."""
    load_kg: Floats
    """Mass of the load of each robot (B,) [kg]."""


class Happened(NamedTuple):
    """Events of a step in any of the environments."""

    contacts: bool
    """Whether a contact begins."""
    approaches: bool
    """Whether a robot moves towards a worker."""


class DirectedGaps(NamedTuple):
    """Separations of a robot and a worker near the end of a step."""

    end_m: float
    """Separation at the end of the step [m]."""
    robot_before_m: float
    """Separation with the robot at its initial pose [m]."""
    worker_before_m: float
    """Separation with the worker at the initial pose [m]."""


def measure_paths(
    robot_world: Capsules, robot_radius_m: Floats, workers_world: Capsules, worker_radius_m: Floats
) -> Paths:
    """Return the paths of robots and workers, together with their separations.

    Args:
        robot_world: (B, T, K, 2, 3) end points of the robot's capsules after every physics step
            [m].
        robot_radius_m: (K,) radii of the robot's capsules [m].
        workers_world: (B, T, W, L, 2, 3) end points of the workers' capsules [m].
        worker_radius_m: (B, W, L) radii of the workers' capsules [m].
    """
    radii_m = np.repeat(worker_radius_m[:, None], robot_world.shape[1], axis=1)
    gaps_m = least_separation(robot_world, robot_radius_m, workers_world, radii_m).distance_m
    arrays = (robot_world, robot_radius_m, workers_world, worker_radius_m, gaps_m)
    return Paths(*map(np.ascontiguousarray, arrays))  # as kernels require them


def find_regions(capsule_names: Sequence[str]) -> Ints:
    """Return the region (L,) of each capsule of a body, as an index into `REGION_NAMES`."""
    return np.array([REGION_NAMES.index(CAPSULE_REGIONS[name]) for name in capsule_names])


def make_history(batch: int, n_workers: int) -> Records2[WorkerHistory]:
    """Return empty histories (B, W) for the beginning of episodes."""
    history = make_records(WorkerHistory, (batch, n_workers))
    history["since_s"] = np.inf
    return history


def make_recent_motion(batch: int, n_robot: int, n_workers: int, n_worker: int) -> RecentMotion:
    """Return empty rings of velocities.

    Args:
        batch: number of environments.
        n_robot: number of the robot's capsules, including loads.
        n_workers: number of workers in each environment.
        n_worker: number of a worker's capsules.
    """
    return RecentMotion(
        np.zeros((batch, N_RECENT, n_robot, 2, 3)),
        np.zeros((batch, N_RECENT, n_workers, n_worker, 2, 3)),
        np.zeros(batch, np.int64),
    )


def detect_incidents(
    history: Records2[WorkerHistory],
    recent: RecentMotion,
    paths: Paths,
    regions: Ints,
    robots: TouchingRobots,
    stop_s: Floats,
    dt_s: float,
) -> Records2[Incident]:
    """Detect the incidents (B, W) of a step.

    Args:
        history: (B, W) histories, advanced in place by one step.
        recent: motion before this step, which is added to it.
        paths: capsules of the bodies at the physics steps.
        regions: (L,) region of each capsule of a body, as an index into `REGION_NAMES`.
        robots: the robots, for the force of contacts.
        stop_s: (B,) time that the robot needs to stop [s].
        dt_s: duration of the step [s].
    """
    incidents = make_records(Incident, (history.shape[0], history.shape[1]))
    n_steps = paths.robot_world.shape[1]
    took_s = dt_s * (n_steps - 1) / n_steps if n_steps > 1 else np.nan
    first_touch = np.empty(incidents.shape, np.int64)
    happened = _advance_history(history, incidents, paths, first_touch, took_s, dt_s)
    beginning = np.argwhere(incidents["kind"] >= 0).tolist() if happened.contacts else ()
    for b, w in beginning:
        touch = _find_touch(paths, b, w, int(first_touch[b, w]))
        region = regions[touch.worker_capsule]
        incidents["region"][b, w] = region
        _measure_contact(incidents, recent, paths, touch, (b, w), took_s)
        history["contacts"][b, w, incidents["kind"][b, w]] += 1
        touched = REGIONS[REGION_NAMES[region]]
        is_pushed = incidents["kind"][b, w] == TOWARDS
        is_stuck = _cannot_yield(robots, paths, touch, (b, w), touched.min_gap_m)
        incidents["is_clamped"][b, w] = is_pushed and is_stuck
        _rate_contact(incidents[b, w], touched, _measure_effective_mass(robots, paths, touch, b))
    recent.record(paths, took_s)
    if happened.approaches:
        b, w = np.nonzero(incidents["robot_m_s"] > MOVING_M_S)
        least_m = protective_distance(
            incidents["robot_m_s"][b, w],
            incidents["worker_m_s"][b, w],
            reaction_s=REACTION_S,
            stopping_s=stop_s[b],
        )
        incidents["is_separation_violated"][b, w] = incidents["separation_m"][b, w] < least_m
    return incidents


def _find_touch(paths: Paths, b: int, w: int, t: int) -> Touch:
    """Return the pair of capsules that overlaps most at physics step `t`."""
    robot, worker = paths.robot_world[b, t], paths.workers_world[b, t, w]
    gaps_m = np.empty((len(robot), len(worker)))
    for c, k in np.ndindex(gaps_m.shape):
        closest = closest_parameters(robot[c, 0], robot[c, 1], worker[k, 0], worker[k, 1])
        radii_m = paths.robot_radius_m[c] + paths.worker_radius_m[b, w, k]
        gaps_m[c, k] = np.sqrt(closest.squared_distance) - radii_m
    c, k = (int(index) for index in np.unravel_index(gaps_m.argmin(), gaps_m.shape))
    closest = closest_parameters(robot[c, 0], robot[c, 1], worker[k, 0], worker[k, 1])
    apart = _locate(worker[k], closest.t) - _locate(robot[c], closest.s)
    normal = apart / max(float(np.linalg.norm(apart)), 1e-9)
    return Touch(c, k, closest.s, closest.t, normal, t)


def _locate(ends: Floats, along: float) -> Floats:
    """Return the points (..., 3), or their velocities, at a position along capsules (..., 2, 3)."""
    return ends[..., 0, :] + along * (ends[..., 1, :] - ends[..., 0, :])


def _measure_contact(
    incidents: Records2[Incident],
    recent: RecentMotion,
    paths: Paths,
    touch: Touch,
    at: tuple[int, int],
    took_s: float,
) -> None:
    """Compute the kind and the speeds of a contact that begins.

    Args:
        incidents: (B, W) receives them.
        recent: motion before this step.
        paths: capsules of the bodies at the physics steps.
        touch: the capsules that touch.
        at: indices of environment and worker.
        took_s: time between the first and the last physics step [s].
    """
    b, w = at
    rows, normal = recent.list_rows(b), touch.normal_world
    of_robot = recent.robot_world[b, rows, touch.robot_capsule]
    of_worker = recent.workers_world[b, rows, w, touch.worker_capsule]
    robot_m_s = np.nan_to_num(_locate(of_robot, touch.robot_along) @ normal)
    worker_m_s = np.nan_to_num(-_locate(of_worker, touch.worker_along) @ normal)
    now = _locate(paths.workers_world[b, :, w, touch.worker_capsule], touch.worker_along)
    comes_m_s = np.nan_to_num((now[0] - now[-1]) @ normal / took_s)
    last_m_s = robot_m_s[0]
    kind = TOWARDS if last_m_s > MOVING_M_S else FLEEING if last_m_s < -MOVING_M_S else STANDING
    closing_m_s = max(last_m_s + comes_m_s, 0.0)
    incidents["kind"][b, w], incidents["robot_speed_m_s"][b, w] = kind, last_m_s
    incidents["closing_speed_m_s"][b, w] = closing_m_s
    incidents["recent_robot_speed_m_s"][b, w] = robot_m_s.max()
    incidents["recent_closing_speed_m_s"][b, w] = max(
        closing_m_s, float((robot_m_s + worker_m_s).max())
    )


def _measure_effective_mass(robots: TouchingRobots, paths: Paths, touch: Touch, b: int) -> float:
    """Return the effective mass of robot `b` at a touching point along the normal [kg].

    It is infinite if no joint moves the point along the normal.
    """
    model, one = robots.model, slice(b, b + 1)
    frames = link_frames(model.chain, robots.q[one])
    inverse = model.invert_mass_matrices(frames, robots.load_kg[one])[0]
    at = _locate(paths.robot_world[b, touch.step, touch.robot_capsule], touch.robot_along)
    link = model.list_capsule_links(paths.robot_world.shape[2])[touch.robot_capsule]
    row = np.zeros(model.chain.n_joints)
    for i in range(link + 1):
        column = lever(frames[0, i], model.chain.slides[i], at)
        row[i] = np.dot(column, touch.normal_world)
    mobility = find_mobility(inverse, row)
    return 1.0 / mobility if mobility > 0.0 else np.inf


def _cannot_yield(
    robots: TouchingRobots, paths: Paths, touch: Touch, at: tuple[int, int], min_gap_m: float
) -> bool:
    """Return whether the robot would clamp the touched part against something.

    Args:
        robots: the robots, with their surroundings.
        paths: capsules of the bodies at the physics steps.
        touch: the capsules that touch.
        at: indices of environment and worker.
        min_gap_m: gap behind the part below which it is clamped [m].
    """
    b, w = at
    own = paths.robot_world[b, touch.step]
    links, shapes = robots.model.list_capsule_links(len(own)), np.empty((len(own), WIDTH))
    set_capsules(shapes, 0, own, paths.robot_radius_m)
    part = paths.workers_world[b, touch.step, w, touch.worker_capsule]
    centre = Vector3(*_locate(part, touch.worker_along).tolist())
    reach_m = float(paths.worker_radius_m[b, w, touch.worker_capsule]) + min_gap_m
    installation = Installation(robots.model.obstacles, shapes, links)
    link = int(links[touch.robot_capsule])
    return bool(is_clamped(installation, link, centre, touch.normal_world, reach_m))


def _rate_contact(incident: Any, region: BodyRegion, robot_kg: float) -> None:
    """Compute the force ratio and the severity of a contact.

    For the head, the limit of a quasi-static contact always applies.

    Args:
        incident: the contact (a row of `INCIDENT`), with its speeds and `is_clamped`; changed in
            place.
        region: region of the body that is touched.
        robot_kg: effective mass of the robot [kg].
    """
    force_n = contact_force(region.name, incident["closing_speed_m_s"], robot_kg)
    ratio = float(force_n) / (region.transient_n or region.quasi_static_n)
    if incident["is_clamped"]:
        pressing_n = clamping_force(region.name, incident["robot_speed_m_s"], robot_kg)
        ratio = max(ratio, float(pressing_n) / region.quasi_static_n)
    incident["force_ratio"] = ratio
    within = WITHIN if ratio <= 1.0 else BEYOND
    incident["severity"] = within if region.is_touched else NEVER


@kernel(makes_arrays=True)
def _advance_history(
    history: Records2[WorkerHistory],
    incidents: Records2[Incident],
    paths: Paths,
    first_touch: Ints,
    took_s: float,
    dt_s: float,
) -> Happened:
    """Compute the incidents of a step except the properties of contacts; advance the histories.

    Args:
        history: (B, W) histories, changed in place.
        incidents: (B, W) receives the incidents.
        paths: capsules of the bodies at the physics steps.
        first_touch: (B, W) receives the physics step of the first touch; -1 for none.
        took_s: time between the first and the last physics step [s].
        dt_s: duration of the step [s].
    """
    n_robot, n_worker = paths.robot_world.shape[2], paths.workers_world.shape[3]
    bounds = Bounds(np.empty((5, n_robot)), np.empty((5, n_worker)), np.empty((n_robot, n_worker)))
    points, contacts, approaches = np.empty((2, 3)), False, False
    for b in range(history.shape[0]):
        is_near = False
        for gap_m in paths.gaps_m[b].flat:
            is_near |= gap_m < WATCHED_M
        for w in range(history.shape[1]):
            first_touch[b, w] = _find_first_touch(paths.gaps_m[b, :, w])
            gaps = DirectedGaps(np.nan, np.nan, np.nan)
            if is_near:
                gaps = _direct_gaps(paths, b, w, bounds, points)
            past, now, gap = history[b, w], incidents[b, w], gaps.end_m
            now.separation_m, now.region, now.severity = gap, -1, 0
            now.is_separation_violated = False
            now.robot_m_s = (gaps.robot_before_m - gap) / took_s
            now.worker_m_s = (gaps.worker_before_m - gap) / took_s
            approaches |= now.robot_m_s > MOVING_M_S
            is_touching = first_touch[b, w] >= 0
            now.kind, now.force_ratio, now.is_clamped = -1, np.nan, False
            now.robot_speed_m_s = now.closing_speed_m_s = np.nan
            now.recent_robot_speed_m_s = now.recent_closing_speed_m_s = np.nan
            if is_touching and past.since_s >= CONTACT_GAP_S:
                now.kind, contacts = STANDING, True  # `_measure_contact` finds the kind
            past.since_s = 0.0 if is_touching else past.since_s + dt_s
            is_calm, is_apart = past.since_s >= CONTACT_GAP_S, not gap < CLEAR_M
            now.is_near_miss = past.is_close and is_apart and is_calm
            past.near_misses += now.is_near_miss
            begins = past.is_close or (gap < NEAR_MISS_M and is_calm)
            past.is_close = begins and not (is_touching or is_apart)
    return Happened(contacts, approaches)


@kernel
def _find_first_touch(gaps_m: Floats) -> int:
    """Return the first physics step with a separation (T,) of at most 0 [m]; -1 for none."""
    for t in range(len(gaps_m)):
        if gaps_m[t] <= 0.0:
            return t
    return -1


@kernel
def _direct_gaps(paths: Paths, b: int, w: int, bounds: Bounds, points: Points3) -> DirectedGaps:
    """Return the separations of robot `b` and worker `w`; the other arguments are work arrays."""
    robot, worker, last = paths.robot_world[b], paths.workers_world[b], len(paths.gaps_m[b]) - 1
    radius_m, worker_radius_m = paths.robot_radius_m, paths.worker_radius_m[b, w]
    return DirectedGaps(
        paths.gaps_m[b, last, w],
        find_gap(robot[0], radius_m, worker[last, w], worker_radius_m, bounds, points),
        find_gap(robot[last], radius_m, worker[0, w], worker_radius_m, bounds, points),
    )


def summarize(incidents: Records2[Incident], history: Records2[WorkerHistory]) -> Records1[Summary]:
    """Return a summary for each environment (B,) of incidents and histories (B, W)."""
    summaries = make_records(Summary, len(incidents))
    _write_summaries(incidents, history, summaries)
    return summaries


@kernel
def _write_summaries(
    incidents: Records2[Incident],
    history: Records2[WorkerHistory],
    summaries: Records1[Summary],
) -> None:
    """Compute the `summaries` (B,) of incidents and histories (B, W)."""
    for b in range(len(incidents)):
        total, least = summaries[b], np.inf
        total.robot_towards_m_s = total.worker_towards_m_s = np.nan
        total.contact_robot_speed_m_s = total.contact_closing_speed_m_s = np.nan
        total.contact_recent_robot_speed_m_s = total.contact_recent_closing_speed_m_s = np.nan
        total.contact_force_ratio = np.nan
        total.contact_severity = total.contact_is_clamped = 0.0
        total.separation_violated = total.near_misses = 0.0
        total.contacts_towards = total.contacts_fleeing = total.contacts_standing = 0.0
        for w in range(incidents.shape[1]):
            one, past = incidents[b, w], history[b, w]
            if one.separation_m < least:
                least = one.separation_m
                total.robot_towards_m_s = one.robot_m_s
                total.worker_towards_m_s = one.worker_m_s
            total.separation_violated = (
                1.0 if one.is_separation_violated else total.separation_violated
            )
            total.contact_robot_speed_m_s = _find_greater(
                total.contact_robot_speed_m_s, one.robot_speed_m_s
            )
            total.contact_closing_speed_m_s = _find_greater(
                total.contact_closing_speed_m_s, one.closing_speed_m_s
            )
            total.contact_recent_robot_speed_m_s = _find_greater(
                total.contact_recent_robot_speed_m_s, one.recent_robot_speed_m_s
            )
            total.contact_recent_closing_speed_m_s = _find_greater(
                total.contact_recent_closing_speed_m_s, one.recent_closing_speed_m_s
            )
            total.contact_force_ratio = _find_greater(total.contact_force_ratio, one.force_ratio)
            total.contact_severity = max(total.contact_severity, one.severity)
            total.contact_is_clamped = 1.0 if one.is_clamped else total.contact_is_clamped
            total.contacts_towards += past.contacts[TOWARDS]
            total.contacts_fleeing += past.contacts[FLEEING]
            total.contacts_standing += past.contacts[STANDING]
            total.near_misses += past.near_misses


@kernel
def _find_greater(value: float, other: float) -> float:
    """Return the greater of two values; if one of them is NaN, return the other one."""
    return other if not value >= other and other == other else value


class IncidentMonitor(Stateful):
    """Detector of incidents, which stores the history of each worker over the steps."""

    CHANGES = ("history", "recent", "last_kind")

    def __init__(
        self,
        batch: int,
        n_workers: int,
        capsule_names: tuple[str, ...],
        n_robot: int,
        model: RobotModel,
        dt_s: float,
    ) -> None:
        """Create empty histories.

        Args:
            batch: number of environments.
            n_workers: number of workers in each environment.
            capsule_names: names of a body's capsules (`worker.body.Body.capsule_names`).
            n_robot: number of the robot's capsules, including loads.
            model: the robot's constants.
            dt_s: duration of a control step [s].
        """
        self.history = make_history(batch, n_workers)
        """Histories of the current episodes (B, W)."""
        self.recent = make_recent_motion(batch, n_robot, n_workers, len(capsule_names))
        """Motion in the last steps."""
        self.last_kind = np.full((batch, n_workers), -1)
        """Kind (B, W) of the last contact, as an index into `KINDS`; -1 before the first one."""
        self.regions, self.model, self.dt_s = find_regions(capsule_names), model, dt_s

    def reset(self, ids: Ints) -> None:
        """Begin new episodes in environments `ids`."""
        self.history[ids] = make_history(len(self.history[ids]), self.history.shape[1])
        self.recent.reset(ids)
        self.last_kind[ids] = -1

    def step(self, world: World, paths: Paths) -> Records2[Incident]:
        """Detect and return the incidents (B, W) of a control step."""
        model, objects = self.model, world.objects
        load_kg = np.zeros(len(self.history)) if objects is None else objects.held @ model.load_kg
        robots = TouchingRobots(model, world.robot.q, load_kg)
        stop_s = self.find_stop_time(world.robot)
        found = detect_incidents(
            self.history, self.recent, paths, self.regions, robots, stop_s, self.dt_s
        )
        kind = found["kind"]
        np.copyto(self.last_kind, kind, where=kind >= 0)
        return found

    def find_pushed(self, world: World, paths: Paths, commands: JointVelocities) -> Bools:
        """Return a mask (B, W) of the workers that push the robot by a touch.

        An arm that was pushed springs back. In a touch that began while the robot did not move
        towards the worker, and for `CONTACT_GAP_S` afterwards, the robot counts as pushed unless
        the commanded motion would reduce the separation by more than `MOVING_M_S`. Loads are
        ignored.

        Args:
            world: state of the robots after the step.
            paths: capsules of the bodies at the physics steps of the step.
            commands: (B, N) commanded joint velocities in the step [rad/s], or [m/s] for slides.
        """
        was_hit = (self.history["since_s"] < CONTACT_GAP_S) & (self.last_kind != TOWARDS)
        if not was_hit.any():
            return was_hit
        ids = np.flatnonzero(was_hit.any(1))
        limit = self.model.fastest_rad_s
        q, velocities = world.robot.q[ids], np.clip(np.nan_to_num(commands[ids]), -limit, limit)
        ahead = np.stack([q, q + velocities * self.dt_s], axis=1)
        arms_world = capsules(self.model.chain, ahead)
        radius_m = paths.robot_radius_m[: arms_world.shape[2]]
        workers_world = np.repeat(paths.workers_world[ids, -1:], 2, axis=1)
        worker_radius_m = np.repeat(paths.worker_radius_m[ids, None], 2, axis=1)
        gaps_m = least_separation(arms_world, radius_m, workers_world, worker_radius_m).distance_m
        comes = (gaps_m[:, 0] - gaps_m[:, 1]) / self.dt_s > MOVING_M_S
        was_hit[ids] &= ~comes
        return was_hit

    def find_stop_time(self, robot: RobotState) -> Floats:
        """Return the stopping time (B,) of robots at their maximum deceleration [s]."""
        return (np.abs(robot.qd) / self.model.slew_rad_s2).max(axis=1)
