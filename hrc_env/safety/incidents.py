"""What happened to people: contacts by kind and how hard, near misses, broken distances.

All of it is counted on the truth, from where bodies were in the physics steps of a control step. A
*directed speed* is by how much one body's motion narrowed the separation while the other is held
where it is at the end. A contact begins when surfaces touch that have not for `AGAIN_S`: an arm
that was rammed bounces. Its kind is what the robot did in the control step before, as in the step
itself the impact changes it: it came *towards* the worker, it was *fleeing*, or it was *standing*.
Its closing speed is that speed and the worker's, whom no impact moves. How hard a contact is: the
force of ISO/TS 15066, A.3, as a share of what the region that was hit bears (`safety.contact`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hrc_env.core.batching import Stateful
from hrc_env.core.kernels import kernel
from hrc_env.core.records import RobotState
from hrc_env.core.typing import Capsules, Floats, Ints, Records
from hrc_env.geometry.distances import least_separation
from hrc_env.geometry.robot_model import RobotModel
from hrc_env.safety.contact import REGIONS, contact_force
from hrc_env.safety.separation import protective_distance
from hrc_env.world import World

KINDS = ("towards", "fleeing", "standing")
MOVING_M_S = 0.05
"""From this directed speed on a robot comes or flees [m/s]; a judgement. One that stands or flees
cannot help it when somebody walks into it."""
AGAIN_S = 0.5
"""Who touches again within this time is in the same contact [s]."""
WATCHED_M = 1.0
"""Farther away nothing is looked at [m]; bodies never close so much in a step."""
CLOSE_M, CLEAR_M = 0.05, 0.10
"""A near miss is nearer than the one, and ends beyond the other without a touch [m]; judgement."""
REACTION_S = 0.1
"""Between somebody's coming and the brakes, in the protective distance [s]; a usual value."""
TOWARDS, FLEEING, STANDING = range(len(KINDS))
WITHIN, BEYOND, NEVER = 1, 2, 3
"""A contact that its region bears, one that it does not, and the head, which is never to be hit."""
_SIDED = {
    "shoulder": "back and shoulders", "upper_arm": "upper arm and elbow",
    "forearm": "lower arm and wrist", "thigh": "thigh and knee", "shank": "lower leg",
    "foot": "lower leg", "hand": "hand and fingers",
}  # fmt: skip
CAPSULE_REGIONS: dict[str, str] = {
    "head": "skull and forehead", "neck": "neck", "chest": "chest", "torso": "chest",
    "abdomen": "abdomen", "pelvis": "pelvis",
    **{f"{side}_{part}": region for part, region in _SIDED.items() for side in ("left", "right")},
}  # fmt: skip
"""Of a body's capsules (`worker.body.Body.capsule_names`)."""
REGION_NAMES = tuple(REGIONS)
WATCH = np.dtype(
    [
        # directed speed of the robot in the last step [m/s]; since they touched last [s]; whether
        # they are as close as in a near miss
        ("robot_m_s", "f8"), ("since_s", "f8"), ("close", "?"),
        # contacts of each kind and near misses in this episode
        ("contacts", "i8", (len(KINDS),)), ("near_misses", "i8"),
    ],
    align=True,
)  # fmt: skip
"""What an episode has known of one worker."""
INCIDENT = np.dtype(
    [
        # at the end of the step [m]; directed speeds [m/s]; NaN beyond `WATCHED_M`
        ("separation_m", "f8"), ("robot_m_s", "f8"), ("worker_m_s", "f8"),
        # of a contact that begins: index into `KINDS`, into `REGION_NAMES`; -1: none begins
        ("kind", "i8"), ("region", "i8"),
        # its robot's directed speed before, its closing speed [m/s]; force as a share of what is
        # permitted; `WITHIN`, `BEYOND`, `NEVER` or 0
        ("came_m_s", "f8"), ("closing_m_s", "f8"), ("force_ratio", "f8"), ("severity", "i8"),
        # nearer than the protective distance and coming; a near miss ends
        ("too_near", "?"), ("near_miss", "?"),
    ],
    align=True,
)  # fmt: skip
"""What happened to one worker in a step."""
SUMMARY = np.dtype(
    [
        # of the nearest worker [m/s]; whether the robot is too near to anybody
        ("robot_towards_m_s", "f8"), ("worker_towards_m_s", "f8"), ("too_near", "f8"),
        # of contacts that begin, the greatest of all workers
        ("contact_came_m_s", "f8"), ("contact_closing_m_s", "f8"), ("contact_force_ratio", "f8"),
        ("contact_severity", "f8"),
        # in the episode so far
        *((f"contacts_{kind}", "f8") for kind in KINDS), ("near_misses", "f8"),
    ],
    align=True,
)  # fmt: skip
"""What happened in one environment's step, NaN where there is nothing to say."""
AT_TIMES = (
    "robot_towards_m_s", "worker_towards_m_s", "contact_came_m_s", "contact_closing_m_s",
    "contact_force_ratio",
)  # fmt: skip
"""What there is not always something to say of."""


@dataclass(frozen=True, slots=True)
class Paths:
    """Where bodies were at the end of every physics step of a control step."""

    robot_world: Capsules
    """(B, T, K, 2, 3) [m]."""
    robot_radius_m: Floats
    """(K,)."""
    workers_world: Capsules
    """(B, T, W, L, 2, 3) [m]."""
    worker_radius_m: Floats
    """(B, W, L)."""
    gaps_m: Floats
    """(B, T, W) separations [m]."""


def measured(
    robot_world: Capsules, robot_radius_m: Floats, workers_world: Capsules, worker_radius_m: Floats
) -> Paths:
    """Bodies, as `Paths` has them, with their separations."""
    radii_m = np.repeat(worker_radius_m[:, None], robot_world.shape[1], axis=1)
    gaps_m = least_separation(robot_world, robot_radius_m, workers_world, radii_m).distance_m
    return Paths(robot_world, robot_radius_m, workers_world, worker_radius_m, gaps_m)


def regions_of(capsule_names: Sequence[str]) -> Ints:
    """(L,) index into `REGION_NAMES` of each capsule of a body."""
    return np.array([REGION_NAMES.index(CAPSULE_REGIONS[name]) for name in capsule_names])


def nothing_yet(batch: int, n_workers: int) -> Records:
    """(B, W) of `WATCH`, of episodes that begin."""
    state = np.zeros((batch, n_workers), WATCH)
    state["since_s"] = np.inf
    return state


def noted(
    state: Records, paths: Paths, regions: Ints, robot_kg: Floats, stop_s: Floats, dt_s: float
) -> Records:
    """(B, W) of `INCIDENT`, what happened in a step; `state` goes on by it in place.

    Args:
        regions: (L,) index into `REGION_NAMES` of each capsule of a body.
        robot_kg: (B,) effective mass with which the robot hits [kg].
        stop_s: (B,) how long it takes to stop [s].
    """
    found, n_steps = np.empty(state.shape, INCIDENT), paths.robot_world.shape[1]
    took_s = dt_s * (n_steps - 1) / n_steps if n_steps > 1 else np.nan
    touch = paths.gaps_m <= 0.0
    first = np.where(touch.any(1), touch.argmax(1), -1)
    _note(state, found, _gaps_m(paths), first, took_s, dt_s)
    for b, w in np.argwhere(found["kind"] >= 0).tolist():
        hit = found[b, w]
        hit["region"] = regions[_touched(paths, b, w, int(first[b, w]))]
        _weigh(hit, float(robot_kg[b]))
    b, w = np.nonzero(found["robot_m_s"] > MOVING_M_S)
    if len(b):
        coming = found[b, w]
        speeds = coming["robot_m_s"], coming["worker_m_s"]
        least_m = protective_distance(*speeds, reaction_s=REACTION_S, stopping_s=stop_s[b])
        found["too_near"][b, w] = coming["separation_m"] < least_m
    return found


def _gaps_m(paths: Paths) -> Floats:
    """(3, B, W) separations [m] at the end of a step, with the robot where it began, and with the
    worker where they did; NaN where all are far."""
    at_end = paths.gaps_m[:, -1]
    gaps_m = np.full((3, *at_end.shape), np.nan)
    near = np.flatnonzero(paths.gaps_m.min((1, 2), initial=np.inf) < WATCHED_M)
    if len(near):
        robot = paths.robot_world[near][:, [0, -1]]
        workers = paths.workers_world[near][:, [-1, 0]]
        radius_m = np.repeat(paths.worker_radius_m[near, None], 2, axis=1)
        found = least_separation(robot, paths.robot_radius_m, workers, radius_m)
        gaps_m[0, near], gaps_m[1:, near] = at_end[near], found.distance_m.swapaxes(0, 1)
    return gaps_m


def _touched(paths: Paths, b: int, w: int, t: int) -> int:
    """Which capsule of a worker is deepest in the robot."""
    capsules, radius_m = paths.workers_world[b, t, w], paths.worker_radius_m[b, w]
    ends = paths.robot_world[b : b + 1, t], paths.robot_radius_m
    gaps = least_separation(*ends, capsules[None, :, None], radius_m[None, :, None])
    return int(gaps.distance_m[0].argmin())


def _weigh(hit: Records, robot_kg: float) -> None:
    """How hard a contact is; of the head, against what it bears when it is clamped."""
    region = REGIONS[REGION_NAMES[hit["region"]]]
    bears_n = region.transient_n or region.quasi_static_n
    hit["force_ratio"] = contact_force(region.name, hit["closing_m_s"], robot_kg) / bears_n
    within = WITHIN if hit["force_ratio"] <= 1.0 else BEYOND
    hit["severity"] = within if region.is_touched else NEVER


@kernel
def _note(state, found, gaps, first, took, dt):
    for b in range(state.shape[0]):
        for w in range(state.shape[1]):
            mine, now, gap = state[b, w], found[b, w], gaps[0, b, w]
            now.separation_m, now.region, now.severity, now.too_near = gap, -1, 0, False
            now.robot_m_s = (gaps[1, b, w] - gap) / took
            now.worker_m_s = (gaps[2, b, w] - gap) / took
            touching = first[b, w] >= 0
            _begin(mine, now, touching and mine.since_s >= AGAIN_S)
            mine.robot_m_s = _or_zero(now.robot_m_s)
            mine.since_s = 0.0 if touching else mine.since_s + dt
            calm, apart = mine.since_s >= AGAIN_S, not gap < CLEAR_M
            now.near_miss = mine.close and apart and calm
            mine.near_misses += now.near_miss
            mine.close = (mine.close or (gap < CLOSE_M and calm)) and not (touching or apart)


@kernel
def _begin(mine, now, begins):
    """A contact that begins, or none."""
    now.kind, now.came_m_s, now.closing_m_s, now.force_ratio = -1, np.nan, np.nan, np.nan
    if begins:
        speed = mine.robot_m_s
        now.kind = TOWARDS if speed > MOVING_M_S else STANDING
        if speed < -MOVING_M_S:
            now.kind = FLEEING
        now.came_m_s = speed
        now.closing_m_s = max(speed + _or_zero(now.worker_m_s), 0.0)
        mine.contacts[now.kind] += 1


@kernel
def _or_zero(value):
    return value if value == value else 0.0


def summed_up(found: Records, state: Records) -> Records:
    """(B,) of `SUMMARY`, from what happened to each worker and what is known of them, (B, W)."""
    told = np.empty(len(found), SUMMARY)
    _sum_up(found, state, told)
    return told


@kernel
def _sum_up(found, state, told):
    for b in range(len(found)):
        all_, least = told[b], np.inf
        all_.robot_towards_m_s = all_.worker_towards_m_s = np.nan
        all_.contact_came_m_s = all_.contact_closing_m_s = all_.contact_force_ratio = np.nan
        all_.contact_severity = all_.too_near = all_.near_misses = 0.0
        all_.contacts_towards = all_.contacts_fleeing = all_.contacts_standing = 0.0
        for w in range(found.shape[1]):
            one, known = found[b, w], state[b, w]
            if one.separation_m < least:
                least = one.separation_m
                all_.robot_towards_m_s, all_.worker_towards_m_s = one.robot_m_s, one.worker_m_s
            all_.too_near = 1.0 if one.too_near else all_.too_near
            all_.contact_came_m_s = _more(all_.contact_came_m_s, one.came_m_s)
            all_.contact_closing_m_s = _more(all_.contact_closing_m_s, one.closing_m_s)
            all_.contact_force_ratio = _more(all_.contact_force_ratio, one.force_ratio)
            all_.contact_severity = max(all_.contact_severity, one.severity)
            all_.contacts_towards += known.contacts[TOWARDS]
            all_.contacts_fleeing += known.contacts[FLEEING]
            all_.contacts_standing += known.contacts[STANDING]
            all_.near_misses += known.near_misses


@kernel
def _more(value, other):
    """The greater, of one that is no number the other."""
    return other if not value >= other and other == other else value


class IncidentMonitor(Stateful):
    """Detects incidents step after step, and keeps what episodes have known of each worker."""

    CHANGES = ("known",)

    def __init__(
        self, batch: int, n_workers: int, capsule_names: tuple[str, ...], model: RobotModel,
        dt_s: float,
    ) -> None:  # fmt: skip
        self.known = nothing_yet(batch, n_workers)
        """(B, W) of `WATCH`."""
        self.regions, self.model, self.dt_s = regions_of(capsule_names), model, dt_s

    def reset(self, ids: Ints) -> None:
        """Begin environments `ids` anew."""
        self.known[ids] = nothing_yet(*self.known[ids].shape)

    def step(self, world: World, paths: Paths) -> Records:
        """(B, W) of `INCIDENT`: what happened in a step in which bodies went so."""
        hits_kg, stop_s = np.full(len(self.known), self.model.mass_kg), self.stop_s(world.robot)
        if world.objects is not None:
            hits_kg += world.objects.held @ self.model.load_kg
        return noted(self.known, paths, self.regions, hits_kg, stop_s, self.dt_s)

    def stop_s(self, robot: RobotState) -> Floats:
        """(B,) how long robots take to stand still [s], as fast as commands may change."""
        return (np.abs(robot.qd) / self.model.slew_rad_s2).max(axis=1)
