"""Tracking metrics: position errors, lost workers, identity switches and IDF1.

All functions compare the estimate with the ground truth; only metrics and infos may use them.
"""

import math
from dataclasses import dataclass

import numpy as np

from hrc_env.core.declared import Records1, Records2, dtype_of, make_records
from hrc_env.core.kernels import kernel
from hrc_env.core.records import PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Floats, Ints, Points3
from hrc_env.geometry.assignment import assign_rows

SAME_M = 0.5
"""Maximum mean distance of joints at which a track matches a worker [m]. It is the gate that CLEAR
MOT uses for people (Bernardin and Stiefelhagen 2008, doi:10.1155/2008/246309)."""


class Identity:
    """The tracking history of one worker, and of the slot with the same index, in an episode."""

    track: int
    """Index of the slot in the worker's most recent match; -1 before the first match."""
    matched: bool
    """Whether the worker was matched in the last step."""
    switches: int
    """Number of matches with another slot than in the previous match."""
    counted: int
    """Number of steps in which the worker was present, plus those in which the slot had a track."""


IDENTITY = dtype_of(Identity)


class TrackingError:
    """The tracking errors of one environment in one step; NaN if there is nothing to compare."""

    mpjpe_m: float
    """Mean joint position error of the tracks, each compared with the worker assigned to it in the
    best assignment [m]."""
    mpjpe_by_identity_m: float
    """Mean joint position error of the workers, each compared with the track with which it was
    matched last [m]."""
    lost: float
    """1 if fewer workers are tracked than present, else 0."""
    id_switches: float
    """Number of identity switches of all workers since the episode began."""
    idf1: float
    """IDF1 (identity F1 score) since the episode began."""


TRACKING = dtype_of(TrackingError)


@dataclass(frozen=True, slots=True, eq=False)
class Identities:
    """The matches between workers and tracks since the episodes began."""

    workers: Records2[Identity]
    """(B, W) history of each worker."""
    near: Ints
    """(B, W, W) number of steps in which each worker and each track were within `SAME_M`."""


def make_identities(batch: int, n_workers: int) -> Identities:
    """Return the identities at the start of episodes, when no worker has been matched."""
    workers = make_records(Identity, (batch, n_workers))
    workers["track"][:] = -1
    return Identities(workers, np.zeros((batch, n_workers, n_workers), np.int64))


def measure_errors(
    estimate: PoseEstimate, joints_world: Points3, present: Bools, identities: Identities
) -> Records1[TrackingError]:
    """Compare tracks with the true bodies, and advance the identities by one step.

    A match between a worker and a track is kept while they are within `SAME_M`. As many of the
    other workers and tracks as possible are matched within that distance, with the smallest sum of
    distances (CLEAR MOT). A worker matched with another slot than before counts as an identity
    switch; two workers that exchange their slots count as two switches. IDF1 is 2 m / n. For it,
    each worker is assigned to one slot for the whole episode; m is the number of steps in which
    assigned pairs were within `SAME_M`, in the assignment that maximises this number; n is the
    number of steps in which workers were present plus the number of steps in which slots had tracks
    (Ristani et al. 2016, doi:10.1007/978-3-319-48881-3_2).

    Args:
        estimate: (B, W, ...) tracks.
        joints_world: (B, W, J, 3) true joints [m].
        present: (B, W) mask of the workers that are present.
        identities: matches since the episodes began, changed in place.

    Returns:
        Tracking errors (B,) of the environments.
    """
    errors = make_records(TrackingError, len(present))
    _measure_errors(
        estimate.mean_world,
        joints_world,
        estimate.tracked,
        present,
        identities.workers,
        identities.near,
        errors,
    )
    return errors


@kernel(makes_arrays=True)
def _measure_errors(
    mean_world: Points3,
    joints_world: Points3,
    tracked: Bools,
    present: Bools,
    workers: Records2[Identity],
    near: Ints,
    errors: Records1[TrackingError],
) -> None:
    """Fill in `errors` (B,); the other arguments are those of `measure_errors`."""
    n = tracked.shape[1]
    off_m, cost, chosen = np.empty((n, n)), np.empty((n, n)), np.empty(n, np.int64)
    for b in range(len(tracked)):
        for w in range(n):
            for k in range(n):
                off_m[w, k] = np.inf
                if tracked[b, k]:
                    off_m[w, k] = _sum_distances(mean_world[b, k], joints_world[b, w]) / N_JOINTS
        errors[b].lost = tracked[b].sum() < present[b].sum()
        errors[b].mpjpe_m = _match_tracks(off_m, tracked[b], cost, chosen)
        for w in range(n):
            workers[b, w].counted += present[b, w] + tracked[b, w]
            for k in range(n):
                off_m[w, k] = off_m[w, k] if present[b, w] else np.inf
                near[b, w, k] += off_m[w, k] <= SAME_M
        errors[b].mpjpe_by_identity_m = _match_workers(off_m, workers[b], cost, chosen)
        errors[b].id_switches = workers[b]["switches"].sum()
        errors[b].idf1 = _compute_idf1(near[b], workers[b], cost, chosen)


@kernel
def _match_tracks(off_m: Floats, tracked: Bools, cost: Floats, chosen: Ints) -> float:
    """Return the mean distance of tracks from workers in the best assignment; NaN without tracks.

    Args:
        off_m: (W, W) distance of each worker from each track [m].
        tracked: (W,) mask of the slots with a track.
        cost: (W, W) work array.
        chosen: (W,) work array.
    """
    count, total = 0, 0.0
    for k in range(len(tracked)):
        if tracked[k]:
            for w in range(len(tracked)):
                cost[count, w] = off_m[w, k]
            count += 1
    assign_rows(cost[:count], chosen)
    for row in range(count):
        total += cost[row, chosen[row]]
    return total / count if count else np.nan


@kernel
def _match_workers(off_m: Floats, workers: Records1[Identity], cost: Floats, chosen: Ints) -> float:
    """Keep the matches within the gate and match the other workers with the other tracks.

    Args:
        off_m: (W, W) distance of each worker from each track [m]; infinite if one is missing.
        workers: (W,) history of each worker, changed in place.
        cost: (W, W) work array.
        chosen: (W,) work array.

    Returns:
        The mean distance of workers from the tracks with which they were matched last [m]; NaN if
        there are none.
    """
    count, total = 0, 0.0
    for w in range(len(workers)):
        worker = workers[w]
        for k in range(len(workers)):
            cost[w, k] = off_m[w, k] if off_m[w, k] <= SAME_M else 1e3  # exceeds sums within it
        if worker.matched and off_m[w, worker.track] <= SAME_M:
            cost[w, worker.track] = -1e6
    assign_rows(cost, chosen)
    for w in range(len(workers)):
        worker, k = workers[w], chosen[w]
        worker.matched = off_m[w, k] <= SAME_M
        if worker.matched:
            worker.switches += 0 <= worker.track != k
            worker.track = k
        if worker.track >= 0 and off_m[w, worker.track] != np.inf:
            count, total = count + 1, total + off_m[w, worker.track]
    return total / count if count else np.nan


@kernel
def _compute_idf1(near: Ints, workers: Records1[Identity], cost: Floats, chosen: Ints) -> float:
    """Return the IDF1 of an episode; NaN if there were neither workers nor tracks.

    Args:
        near: (W, W) number of steps in which each worker and each track were within `SAME_M`.
        workers: (W,) history of each worker.
        cost: (W, W) work array.
        chosen: (W,) work array.
    """
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
def _sum_distances(mean_world: Points3, joints_world: Points3) -> float:
    """Return the sum of the distances between the joints (J, 3) of two bodies [m]."""
    total = 0.0
    for j in range(mean_world.shape[0]):
        squared = 0.0
        for i in range(3):
            squared += (mean_world[j, i] - joints_world[j, i]) ** 2
        total += math.sqrt(squared)
    return total
