"""Inputs of the workers' decisions: constants, state, random numbers and free workplaces."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from hrc_env.core import batching
from hrc_env.core.declared import Records1, Records2
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.motion import lying
from hrc_env.motion import state as st
from hrc_env.motion.activities.falling import predict_fallen_root
from hrc_env.motion.activities.pieces import Clips
from hrc_env.motion.anatomy import Anatomy
from hrc_env.motion.config import HandParams, MotionConfig
from hrc_env.motion.floorplan import CELL_M, Floorplan, locate_beside_robot, read_slack
from hrc_env.motion.lying import Load
from hrc_env.motion.points import Place
from hrc_env.motion.reaches import ReachDistribution, Script
from hrc_env.motion.schedule import HERE, Job, Schedule
from hrc_env.motion.state import N_START, NOWHERE, ON_STAGE, UNDER_WAY, WAITING, Worker
from hrc_env.motion.traffic import AHEAD_M, APART_M, FALL_APART_M, HANDS_M
from hrc_env.worker.props import PROP_NAMES
from hrc_env.world import WORKPLACE_KINDS

NEXT, BOW, LASTS, DELAY, REACTION, REACTION_S, EVENT, DWELL = range(N_START, N_START + 8)
"""Index of the random number for each decision; the first `N_START` belong to the activity."""
PLACES, N_DRAWS = N_START + 8, N_START + 8 + 3 * 5
"""Index of the first random number for locations, and number of random numbers of a decision.

Five locations at the robot have three random numbers each.
"""
N_STAGES = 4
"""Number of nearest locations with room for a clip that are tried."""
ANY_ACTIVITY = -1
"""Value for a random first activity."""
ROBOT_WORK_M = 1.1
"""Height of the work at the robot [m]."""
MIN_STAY_S = 0.05
"""Shortest remaining stay at the first workplace of an episode [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class BehaviourParams:
    """Constants of the workers' behaviour."""

    config: MotionConfig
    """Settings of the workers' motion."""
    hand_params: HandParams
    """Settings of the hands' motion for compiled kernels."""
    plan: Floorplan
    """Floor of the scene."""
    schedule: Schedule
    """Jobs for which the scene has workplaces."""
    clips: Clips
    """Pieces of recorded motion."""
    anatomy: Anatomy
    """Measurements (N, ...) of the pool of bodies."""
    loads: Records1[Load]
    """Loads (L,) at rest in the scene when an episode begins."""
    fewest: int
    """Minimum number of workers in an episode."""
    robot_girth_m: float = 0.0
    """Radius of a mobile robot around its two points that workers watch [m]; 0 for an arm."""
    reaches: Script | ReachDistribution = ()
    """Script of the worker's reaches, or the distribution from which episodes sample scripts."""


@dataclass(frozen=True, slots=True, eq=False)
class Cast:
    """Prescribed workers and first activities of one episode; all other choices are random."""

    n_workers: int | None = None
    """Number of workers; None if it is random."""
    bodies: tuple[int, ...] | None = None
    """Rows of the first workers' bodies in the pool; None for random bodies."""
    activities: tuple[int, ...] | None = None
    """First activities of the first workers: indices into `ACTIVITY_NAMES` or `ANY_ACTIVITY`."""
    mind: BehaviourParams | None = None
    """Constants of behaviour in this episode; None for those of `MotionState.mind`."""


@dataclass(frozen=True, slots=True)
class MotionState:
    """State of all workers; copying its arrays copies the state."""

    workers: Records2[Worker]
    """Records (B, W) of the workers."""
    loads: Records2[Load]
    """Loads (B, L) at rest in the scene."""
    mind: BehaviourParams
    """Constants of the behaviour."""
    minds: dict[int, BehaviourParams] = field(default_factory=dict)
    """Constants of the environments with a custom behaviour in this episode, by environment."""
    scripts: dict[int, Script] = field(default_factory=dict)
    """Scripts of the environments with scripted reaches in this episode, by environment."""

    def mind_of(self, b: int) -> BehaviourParams:
        """Return the constants of the current episode of environment b."""
        return self.minds.get(b, self.mind)

    @staticmethod
    def gather(parts: "Sequence[MotionState]", bounds: Sequence[int], ids: Ints) -> "MotionState":
        """Return the state of environments `ids` of several states (`batching.gather`)."""
        return MotionState(
            batching.gather([part.workers for part in parts], bounds, ids),
            batching.gather([part.loads for part in parts], bounds, ids),
            parts[0].mind,
            batching.gather_entries([part.minds for part in parts], bounds, ids),
            batching.gather_entries([part.scripts for part in parts], bounds, ids),
        )


@dataclass(slots=True)
class Decision:
    """Inputs of the decision of one worker."""

    mind: BehaviourParams
    """Constants of the behaviour."""
    workers: Records1[Worker]
    """Records (W,) of the workers of the environment."""
    w: int
    """Index of the deciding worker."""
    draws: Floats
    """Uniform random numbers (N_DRAWS,) in [0, 1)."""
    clock_s: float
    """Time since the episode began [s]."""
    loads: Records1[Load]
    """Loads (L,) at rest in the environment."""
    held_prop: int = 0
    """Prop that the worker holds at the decision, an index into `PROPS`."""
    first_activity: int | None = None
    """Activity with which the worker must begin the episode; None for any."""
    script: Script = ()
    """Script of the worker's reaches; empty for random reaches."""

    @property
    def worker(self) -> Worker:
        """Record of the deciding worker."""
        return self.workers[self.w]

    def set_travel(self, travel: int) -> None:
        """Set the progress of the errand to `THERE`, `UNDER_WAY` or `WAITING`."""
        self.worker.travel = travel
        if travel != WAITING:
            self.worker.waiting_since_s = 0.0

    @property
    def kind_here(self) -> str:
        """Kind of the worker's workplace; an empty string if there is none."""
        at = self.worker.place_kind
        return "" if at in (NOWHERE, ON_STAGE) else WORKPLACE_KINDS[at]

    @property
    def job(self) -> Job:
        """Current or next job."""
        return self.mind.schedule.jobs[self.worker.job]

    @property
    def is_loaded(self) -> bool:
        """Whether the worker carries a load."""
        return bool(self.worker.load_prop > 0)

    def draw(self, index: int, limits: tuple[float, float]) -> float:
        """Return the random number at `index`, scaled to the range [low, high)."""
        return limits[0] + self.draws.item(index) * (limits[1] - limits[0])

    def find_others(self) -> Bools:
        """Return a mask (W,) of the other workers that are present."""
        others = self.workers["is_present"].copy()
        others[self.w] = False
        return others


def list_obstacles(decision: Decision) -> Floats:
    """Return the discs (n, 3) that a path must avoid: x, y, radius [m].

    The discs cover the other workers at the ends of their activities, the robot and the loads.
    """
    people, rows = decision.mind.config.people, []
    others = decision.workers[decision.find_others()]
    ends = [others[name].tolist() for name in ("end_x", "end_y", "end_yaw")]
    for x, y, yaw in zip(*ends, strict=True):
        rows.append((x, y, APART_M))
        rows.append((x + AHEAD_M * math.cos(yaw), y + AHEAD_M * math.sin(yaw), HANDS_M))
    for other in others[others["activity"] == st.FALL]:
        rows.append((*predict_fallen_root(float(other.time_s), other), FALL_APART_M))
    robot = decision.worker.robot_world
    if people.detour_m > 0.0 and np.isfinite(robot[0, 0]):
        away_m = people.detour_m + decision.mind.robot_girth_m
        rows += [(x, y, away_m) for x, y, _ in robot.tolist()]
    return np.vstack([np.reshape(rows, (-1, 3)), lying.list_load_discs(decision.loads)])


def list_places(decision: Decision) -> Iterator[Place]:
    """Yield free workplaces for the job, beginning with the destination of a worker under way."""
    if decision.worker.travel == UNDER_WAY:
        yield Place(*decision.worker.place.tolist())
    yield from _list_free_places(decision, decision.job)


def list_stages(decision: Decision, starts: Floats) -> Iterator[Place]:
    """Yield the `N_STAGES` nearest poses for a clip, except those near another worker.

    Args:
        decision: inputs of the decision.
        starts: poses (k, 3) with room for the clip: x, y [m], heading [rad].
    """
    away = np.hypot(*(starts[:, :2] - decision.worker.place[:2]).T)
    nearest = starts[np.argsort(away, kind="stable")[:N_STAGES]].tolist()
    return _keep_free(decision, (Place(x, y, yaw, 0.0) for x, y, yaw in nearest))


def _list_free_places(decision: Decision, job: Job) -> Iterator[Place]:
    """Yield the workplaces for a job, except those near another worker.

    If a job needs a load, they are those at which such a load rests. A prop is pushed to a
    workplace without loads.
    """
    if job.prop != PROP_NAMES[0] and job.by == "walk" and job.at != HERE:
        kind = PROP_NAMES.index(job.prop)
        return _keep_free(decision, lying.list_stands(decision.loads, kind, job.at))
    free = _keep_free(decision, _list_candidates(decision, job.at))
    if job.by != "push":
        return free
    return (place for place in free if not lying.has_load_at(decision.loads, place))


def _keep_free(decision: Decision, places: Iterable[Place]) -> Iterator[Place]:
    """Yield the given workplaces except those near another worker."""
    apart_m = decision.mind.config.spacing_m
    taken = decision.workers["place"][decision.find_others(), :2].tolist()
    for place in places:
        if all(math.dist(point, place[:2]) >= apart_m for point in taken):
            yield place


def _list_candidates(decision: Decision, kind: str) -> Iterator[Place]:
    """Yield workplaces of a kind.

    Those at the robot are sampled, all others are defined by the scene; "here" is the current one.
    """
    draws, config, plan = decision.draws[PLACES:].tolist(), decision.mind.config, decision.mind.plan
    if kind == HERE:
        yield Place(*decision.worker.place.tolist())
    elif kind == "robot":
        for radius, azimuth, turn in zip(draws[::3], draws[1::3], draws[2::3], strict=True):
            low, high = config.near_radius_m
            r = low + radius * (high - low)
            angle = config.near_azimuth_rad * (2.0 * azimuth - 1.0)
            x, y = locate_beside_robot(plan.grounds, r, angle)
            if read_slack(x, y, plan.grid) >= 0.0:
                yaw = angle + math.pi + 0.15 * (2.0 * turn - 1.0)
                yield Place(x, y, yaw, ROBOT_WORK_M)
    else:
        places = [place for place in plan.grounds.places if place.kind == kind]
        first = int(draws[0] * len(places))
        for place in (*places[first:], *places[:first]):
            yield lying.get_place(place)


def take_first_place(decision: Decision) -> None:
    """Choose the job and the workplace with which a worker begins an episode.

    With probability `MotionConfig.near_probability`, and with a script, it is the job at the robot,
    otherwise a random job that begins an errand. If its workplaces are taken, the job at the robot
    and all jobs that begin errands are tried in turn. If a first activity is prescribed, only the
    jobs of this activity are tried. If no workplace is free, the worker begins without an errand at
    the location farthest from the other workers.

    Args:
        decision: inputs of the decision; its worker's `job`, `place_kind`, `place` and, at a
            workplace, `stay_until_s` are set.
    """
    config, schedule, worker = decision.mind.config, decision.mind.schedule, decision.worker
    robot_job, errand_jobs = schedule.robot, [choice.job for choice in schedule.begins]
    is_at_robot = decision.draws.item(NEXT) < config.near_probability or not errand_jobs
    is_at_robot |= bool(decision.script)
    preferred_job = robot_job
    if not is_at_robot:
        preferred_job = errand_jobs[int(decision.draws[BOW] * len(errand_jobs))]
    candidate_jobs: tuple[int, ...] = (preferred_job, robot_job, *errand_jobs)
    if decision.first_activity is not None:
        candidate_jobs = _list_jobs(decision, decision.first_activity, is_at_robot)
    for k in candidate_jobs:
        job = schedule.jobs[k]
        for place in _list_free_places(decision, job):
            worker.job, worker.place_kind = k, WORKPLACE_KINDS.index(job.at)
            worker.place[:] = place
            dwell_s = decision.draw(DWELL, config.dwell_s) * config.people.tempo
            # The episode begins in the middle of the stay, at a time of 0.
            worker.stay_until_s = max(MIN_STAY_S, dwell_s * decision.draws.item(LASTS))
            return
    worker.job, worker.place_kind = robot_job, NOWHERE
    worker.place[:] = _find_remotest(decision)


def group_jobs(schedule: Schedule) -> dict[str, list[int]]:
    """Return the jobs with which an episode can begin on request, by activity.

    These jobs begin with empty hands at a workplace, and do not wait for a signal.
    """
    jobs: dict[str, list[int]] = {}
    for k, job in enumerate(schedule.jobs):
        loaded = job.activity in ("set down", "hand over") or job.by != "walk"
        if job.at != HERE and not job.waits and not loaded:
            jobs.setdefault(job.activity, []).append(k)
    return jobs


def _list_jobs(decision: Decision, activity: int, near: bool) -> tuple[int, ...]:
    """Return the jobs of an activity in the order in which they are tried.

    Args:
        decision: inputs of the decision.
        activity: index into `ACTIVITY_NAMES`.
        near: whether jobs at the robot come first.
    """
    schedule = decision.mind.schedule
    jobs = group_jobs(schedule).get(st.ACTIVITY_NAMES[activity], [])
    first = int(decision.draws[BOW] * len(jobs))
    turned = (*jobs[first:], *jobs[:first])
    return tuple(sorted(turned, key=lambda k: near and schedule.jobs[k].at != "robot"))


def _find_remotest(decision: Decision) -> Place:
    """Return the walkable location with the greatest distance from the nearest other worker."""
    grid = decision.mind.plan.grid
    x, y = (np.argwhere(grid.slack >= 0.0) * CELL_M + grid.origin).T
    others = decision.workers["place"][decision.find_others(), :2]
    away = np.min([np.hypot(x - ox, y - oy) for ox, oy in others], axis=0)
    k = int(np.argmax(away))
    return Place(float(x[k]), float(y[k]), 2.0 * math.pi * decision.draws.item(BOW), 0.0)
