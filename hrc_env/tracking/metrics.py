"""How far tracks are from the bodies that they follow, and whether they take one for another."""

import math
from dataclasses import dataclass

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.records import PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Ints, Points3, Records
from hrc_env.geometry.assignment import assign_rows

SAME_M = 0.5
"""A track follows a worker while their joints are this near to each other on average [m]: the gate
that CLEAR MOT takes for people (Bernardin and Stiefelhagen 2008, doi:10.1155/2008/246309)."""
IDENTITY = np.dtype(
    [
        ("track", "i8"),  # the slot with which the worker was matched last; -1: with none yet
        ("matched", "?"),  # whether in the last step
        ("switches", "i8"),  # how often it was another slot than the time before
        ("counted", "i8"),  # steps in which the worker was there, and those of the slot's track
    ],
    align=True,
)
"""What an episode has known of one worker and of the slot of the same number."""
TRACKING = np.dtype(
    [
        ("mpjpe_m", "f8"),  # mean error of tracks from the workers whom they fit best [m]
        ("mpjpe_by_identity_m", "f8"),  # of workers from the tracks they were matched with last
        ("lost", "f8"),  # 1: a worker is there who has no track
        ("id_switches", "f8"),  # in this episode so far, all workers together
        ("idf1", "f8"),  # of this episode so far
    ],
    align=True,
)
"""Errors of one environment's step; NaN where there is nothing to compare."""


@dataclass(frozen=True, slots=True, eq=False)
class Identities:
    """Who was whose track in the episodes so far."""

    workers: Records
    """(B, W) of `IDENTITY`."""
    near: Ints
    """(B, W, W) steps in which worker and track were within `SAME_M`."""


def no_identities(batch: int, n_workers: int) -> Identities:
    """Of episodes that begin."""
    workers = np.zeros((batch, n_workers), IDENTITY)
    workers["track"] = -1
    return Identities(workers, np.zeros((batch, n_workers, n_workers), np.int64))


def tracking_error(
    estimate: PoseEstimate, joints_world: Points3, present: Bools, identities: Identities
) -> Records:
    """Return (B,) of `TRACKING` for bodies (B, W, J, 3) that are `present` (B, W), and advance the
    `identities` by a step.

    A match of worker and track lasts while they are within `SAME_M`; then as many others as
    possible are matched within it, at the least sum of distances (CLEAR MOT). A worker who is
    matched with another slot than the last time has switched: two who are exchanged are two
    switches. IDF1 is 2 m / n: m steps in which workers and tracks were within `SAME_M`, each worker
    with one slot for the whole episode, in the best way; n steps of workers and of tracks together
    (Ristani et al. 2016, doi:10.1007/978-3-319-48881-3_2).
    """
    found = np.empty(len(present), TRACKING)
    _tracking_error(
        estimate.mean_world, joints_world, estimate.tracked, present,
        identities.workers, identities.near, found,
    )  # fmt: skip
    return found


@kernel(makes_arrays=True)
def _tracking_error(mean_world, joints_world, tracked, there, workers, near, found):
    n = tracked.shape[1]
    off_m, cost, chosen = np.empty((n, n)), np.empty((n, n)), np.empty(n, np.int64)
    for b in range(len(tracked)):
        for w in range(n):
            for k in range(n):
                off_m[w, k] = np.inf
                if tracked[b, k]:
                    off_m[w, k] = _joint_error(mean_world[b, k], joints_world[b, w]) / N_JOINTS
        found[b].lost = tracked[b].sum() < there[b].sum()
        found[b].mpjpe_m = _best_fit(off_m, tracked[b], cost, chosen)
        for w in range(n):
            workers[b, w].counted += there[b, w] + tracked[b, w]
            for k in range(n):
                off_m[w, k] = off_m[w, k] if there[b, w] else np.inf
                near[b, w, k] += off_m[w, k] <= SAME_M
        found[b].mpjpe_by_identity_m = _own_error(off_m, workers[b], cost, chosen)
        found[b].id_switches = workers[b].switches.sum()
        found[b].idf1 = _idf1(near[b], workers[b], cost, chosen)


@kernel
def _best_fit(off_m, tracked, cost, whom):
    """Mean distance of tracks from workers, each from another one, in the best way."""
    count, total = 0, 0.0
    for k in range(len(tracked)):
        if tracked[k]:
            for w in range(len(tracked)):
                cost[count, w] = off_m[w, k]
            count += 1
    assign_rows(cost[:count], whom)
    for row in range(count):
        total += cost[row, whom[row]]
    return total / count if count else np.nan


@kernel
def _own_error(off_m, workers, cost, chosen):
    """Keep matches within the gate, and match who is left; mean distance of workers from the tracks
    that they were matched with last."""
    count, total = 0, 0.0
    for w in range(len(workers)):
        me = workers[w]
        for k in range(len(workers)):
            cost[w, k] = off_m[w, k] if off_m[w, k] <= SAME_M else 1e3  # more than all within it
        if me.matched and off_m[w, me.track] <= SAME_M:
            cost[w, me.track] = -1e6
    assign_rows(cost, chosen)
    for w in range(len(workers)):
        me, k = workers[w], chosen[w]
        me.matched = off_m[w, k] <= SAME_M
        if me.matched:
            me.switches += 0 <= me.track != k
            me.track = k
        if me.track >= 0 and off_m[w, me.track] != np.inf:
            count, total = count + 1, total + off_m[w, me.track]
    return total / count if count else np.nan


@kernel
def _idf1(near, workers, cost, chosen):
    """Of so many steps in which each worker was near each slot's track."""
    for w in range(len(workers)):
        for k in range(len(workers)):
            cost[w, k] = -near[w, k]
    assign_rows(cost, chosen)
    matched, counted = 0, 0
    for w in range(len(workers)):
        matched += near[w, chosen[w]]
        counted += workers[w].counted
    return 2 * matched / counted if counted else np.nan


@kernel
def _joint_error(mean_world, joints_world):
    """Sum over joints of the distances between two bodies [m]."""
    total = 0.0
    for j in range(mean_world.shape[0]):
        squared = 0.0
        for i in range(3):
            squared += (mean_world[j, i] - joints_world[j, i]) ** 2
        total += math.sqrt(squared)
    return total
