"""What decisions of workers are made from: constants, the state, draws; and where they may go."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from hrc_env.core.typing import Bools, Floats, Records
from hrc_env.motion import lying
from hrc_env.motion import state as st
from hrc_env.motion.activities.falling import fallen_root
from hrc_env.motion.activities.pieces import Clips
from hrc_env.motion.anatomy import Anatomy
from hrc_env.motion.config import MotionConfig, Numbers
from hrc_env.motion.floorplan import CELL_M, Floorplan, beside_robot, slack_at
from hrc_env.motion.schedule import HERE, Job, Schedule
from hrc_env.motion.state import (
    N_START,
    NOWHERE,
    ON_STAGE,
    UNDER_WAY,
    WAITING,
    Place,
    Worker,
    Workers,
)
from hrc_env.motion.traffic import AHEAD_M, APART_M, FALL_M, HANDS_M
from hrc_env.worker.props import PROP_NAMES
from hrc_env.world import WORKPLACE_KINDS

NEXT, BOW, LASTS, DELAY, REACTION, REACTION_S, EVENT, DWELL = range(N_START, N_START + 8)
"""Which draw decides what; the first N_START are the activity's own."""
PLACES, N_DRAWS = N_START + 8, N_START + 8 + 3 * 5
"""First of the draws for places, three for each of five; uniform numbers of one decision."""
N_STAGES = 4
"""So many of the places from which a clip has room are tried."""
ANY_ACTIVITY = -1
"""In the place of an activity: whichever is drawn."""
ROBOT_WORK_M = 1.1
"""Height of the work at the robot [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class BehaviourParams:
    """Constants."""

    config: MotionConfig
    numbers: Numbers
    plan: Floorplan
    schedule: Schedule
    clips: Clips
    anatomy: Anatomy
    """(N, ...) of the bodies that there are."""
    loads: Records
    """(L,) of `lying.LOAD`: what lies about at first."""
    fewest: int
    """Workers who are in an episode at least."""
    robot_girth_m: float = 0.0
    """How far a robot that drives reaches round the points of it that people watch [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Cast:
    """The people of one episode, and their first activities, as far as these are not drawn."""

    n_workers: int | None = None
    bodies: tuple[int, ...] | None = None
    """Row of the bodies that there are, for each of the first workers."""
    activities: tuple[int, ...] | None = None
    """The first activity of each of the first workers: indices of `state.ACTIVITY_NAMES`, or
    `ANY_ACTIVITY`."""
    mind: BehaviourParams | None = None
    """How they are with the robot; None: as in all episodes."""


@dataclass(frozen=True, slots=True)
class MotionState:
    """All that changes is in the arrays: copying them copies the state."""

    workers: Workers
    """(B, W) of WORKER."""
    loads: Records
    """(B, L) of `lying.LOAD`."""
    mind: BehaviourParams
    minds: dict[int, BehaviourParams] = field(default_factory=dict)
    """Those of environments whose episode has one of its own."""

    def mind_of(self, b: int) -> BehaviourParams:
        """Return the constants of environment b's episode."""
        return self.minds.get(b, self.mind)


@dataclass(slots=True)
class Decision:
    """A worker who decides."""

    mind: BehaviourParams
    workers: Workers
    """(W,) of their environment."""
    w: int
    draws: Floats
    """(N_DRAWS,)."""
    now: float
    """Clock [s]."""
    loads: Records
    """(L,) of their environment: what lies about."""
    load: int = 0
    """What they hold when they decide."""
    wanted: int | None = None
    """The activity that they have to begin the episode with; None: any."""

    @property
    def me(self) -> Worker:
        return self.workers[self.w]

    def go(self, going: int) -> None:
        """They are `THERE`, `UNDER_WAY` or `WAITING` now."""
        self.me["going"] = going
        if going != WAITING:
            self.me["since_s"] = 0.0

    @property
    def kind_here(self) -> str:
        """Kind of the place where they are and have something to do; else nothing."""
        at = self.me["at"]
        return "" if at in (NOWHERE, ON_STAGE) else WORKPLACE_KINDS[at]

    @property
    def job(self) -> Job:
        """What they do or want to do."""
        return self.mind.schedule.jobs[self.me["job"]]

    @property
    def loaded(self) -> bool:
        return bool(self.me["load_prop"] > 0)

    def draw(self, index: int, limits: tuple[float, float]) -> float:
        """A draw stretched to (low, high)."""
        return limits[0] + self.draws.item(index) * (limits[1] - limits[0])

    def others(self) -> Bools:
        """(W,) which other workers are there."""
        there = self.workers["present"].copy()
        there[self.w] = False
        return there


def in_the_way(who: Decision) -> Floats:
    """(n, 3) x, y, radius of where other workers will stand and work, of the robot's arm, and of
    what lies about."""
    people, rows = who.mind.config.people, []
    ends = [who.workers[name][who.others()].tolist() for name in ("end_x", "end_y", "end_yaw")]
    for x, y, yaw in zip(*ends, strict=True):
        rows.append((x, y, APART_M))
        rows.append((x + AHEAD_M * math.cos(yaw), y + AHEAD_M * math.sin(yaw), HANDS_M))
    for other in who.workers[who.others() & (who.workers["activity"] == st.FALL)]:
        rows.append((*fallen_root(float(other["time_s"]), other), FALL_M[1]))
    robot = who.me["robot_world"]
    if people.detour_m > 0.0 and np.isfinite(robot[0, 0]):
        away_m = people.detour_m + who.mind.robot_girth_m
        rows += [(x, y, away_m) for x, y, _ in robot.tolist()]
    return np.vstack([np.reshape(rows, (-1, 3)), lying.in_the_way(who.loads)])


def wished(who: Decision) -> Iterator[Place]:
    """Places for the job that nobody else has, the one last chosen first."""
    if who.me["going"] == UNDER_WAY:
        yield tuple(who.me["spot"].tolist())  # type: ignore[misc]
    yield from _free_places(who, who.job)


def free_stages(who: Decision, starts: Floats) -> Iterator[Place]:
    """The nearest few of places (k, 3) to begin a clip from that no other worker's is near."""
    away = np.hypot(*(starts[:, :2] - who.me["spot"][:2]).T)
    nearest = starts[np.argsort(away, kind="stable")[:N_STAGES]].tolist()
    return _free(who, ((x, y, yaw, 0.0) for x, y, yaw in nearest))


def _free_places(who: Decision, job: Job) -> Iterator[Place]:
    """Places for a job that no other worker's is near; of what it takes up, where that lies; for
    what they push, where nothing is."""
    if job.prop != PROP_NAMES[0] and job.by == "walk" and job.at != HERE:
        return _free(who, lying.stands(who.loads, PROP_NAMES.index(job.prop), job.at))
    free = _free(who, _candidates(who, job.at))
    return (p for p in free if not lying.is_left(who.loads, p)) if job.by == "push" else free


def _free(who: Decision, places: Iterable[Place]) -> Iterator[Place]:
    """Those of some places that no other worker's is near."""
    apart_m, spots = who.mind.config.spacing_m, who.workers["spot"][who.others(), :2].tolist()
    for place in places:
        if all(math.dist(spot, place[:2]) >= apart_m for spot in spots):
            yield place


def _candidates(who: Decision, kind: str) -> Iterator[Place]:
    """Places of a kind: drawn round the robot, the scene's elsewhere, or where the worker is."""
    draws, config, plan = who.draws[PLACES:].tolist(), who.mind.config, who.mind.plan
    if kind == HERE:
        yield tuple(who.me["spot"].tolist())  # type: ignore[misc]
    elif kind == "robot":
        for radius, azimuth, turn in zip(draws[::3], draws[1::3], draws[2::3], strict=True):
            low, high = config.near_radius_m
            r = low + radius * (high - low)
            angle = config.near_azimuth_rad * (2.0 * azimuth - 1.0)
            x, y = beside_robot(plan.grounds, r, angle)
            if slack_at(x, y, plan.slack, plan.origin) >= 0.0:
                yield x, y, angle + math.pi + 0.15 * (2.0 * turn - 1.0), ROBOT_WORK_M
    else:
        places = [place for place in plan.grounds.places if place.kind == kind]
        first = int(draws[0] * len(places))
        for place in (*places[first:], *places[:first]):
            yield lying.spot_of(place)


def take_first_place(who: Decision) -> None:
    """A place to begin at, and the job there; where all are taken, the loneliest that is free."""
    mind, me, draw = who.mind, who.me, who.draws.item(NEXT)
    begins = [k for k, _ in mind.schedule.begins]
    near = draw < mind.config.near_probability or not begins
    first = mind.schedule.robot if near else begins[int(who.draws[BOW] * len(begins))]
    jobs: tuple[int, ...] = (first, mind.schedule.robot, *begins)
    if who.wanted is not None:
        jobs = _jobs_of(who, who.wanted, near)
    for job in jobs:
        chosen = mind.schedule.jobs[job]
        for place in _free_places(who, chosen):
            me["job"], me["at"], me["spot"] = job, WORKPLACE_KINDS.index(chosen.at), place
            dwell = who.draw(DWELL, mind.config.dwell_s) * mind.config.people.tempo
            me["until_s"] = max(0.05, dwell * who.draws.item(LASTS))
            return
    me["job"], me["at"], me["spot"] = mind.schedule.robot, NOWHERE, _loneliest(who)


def jobs_by_activity(schedule: Schedule) -> dict[str, list[int]]:
    """Return the jobs with which workers can be told to begin an episode, by their activity: empty
    hands do for them, they have a place, and nobody is waited for."""
    jobs: dict[str, list[int]] = {}
    for k, job in enumerate(schedule.jobs):
        loaded = job.activity in ("set down", "hand over") or job.by != "walk"
        if job.at != HERE and not job.waits and not loaded:
            jobs.setdefault(job.activity, []).append(k)
    return jobs


def _jobs_of(who: Decision, activity: int, near: bool) -> tuple[int, ...]:
    """The jobs of an activity in the order in which they are tried, those at the robot first if
    `near`."""
    schedule = who.mind.schedule
    jobs = jobs_by_activity(schedule).get(st.ACTIVITY_NAMES[activity], [])
    first = int(who.draws[BOW] * len(jobs))
    turned = (*jobs[first:], *jobs[:first])
    return tuple(sorted(turned, key=lambda k: near and schedule.jobs[k].at != "robot"))


def _loneliest(who: Decision) -> Place:
    """Where there is room to walk, farthest from the other workers."""
    ground = who.mind.plan
    x, y = (np.argwhere(ground.slack >= 0.0) * CELL_M + ground.origin).T
    others = who.workers["spot"][who.others(), :2]
    away = np.min([np.hypot(x - ox, y - oy) for ox, oy in others], axis=0)
    k = int(np.argmax(away))
    return float(x[k]), float(y[k]), 2.0 * math.pi * who.draws.item(BOW), 0.0
