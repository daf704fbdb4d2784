"""Hypotheses about one body: slots with a Gaussian tree each, weighted, merged and dropped.

A worker has H slots, of which the first `n_alive` are in use, the heaviest first. Every slot is
a column of `tree.state.Trees`: worker w's are the columns w H to (w + 1) H.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Ints
from hrc_env.tracking.tree.evidence import distance_between
from hrc_env.tracking.tree.state import Trees


class Hypotheses(NamedTuple):
    """Hypotheses about each worker; arrays changed in place."""

    slots: Trees
    """Arrays (B, W H, ...), one Gaussian tree each."""
    log_weight: Floats
    """(B, W H) log-probabilities of the slots in use, which sum to one after an update."""
    pose_log_prior: Floats
    """(B, W H) what `anatomy` says of their poses; part of the weights."""
    n_alive: Ints
    """(B, W) slots in use, at least one."""
    waited_s: Floats
    """(B, W) time since other hypotheses were looked for [s]."""


def plain(state: Hypotheses) -> tuple[Any, ...]:
    """Hypotheses as kernels take them."""
    return tuple(state.slots), *state[1:]


@kernel(makes_arrays=True)
def hypotheses(state):
    """The hypotheses that `plain` gave."""
    slots, log_weight, pose_log_prior, n_alive, waited_s = state
    return Hypotheses(Trees(*slots), log_weight, pose_log_prior, n_alive, waited_s)


@kernel
def copy_slot(slots, b, source, target):
    """Make slot `target` of environment b a copy of `source`."""
    _move_slot(slots, b, source, target, False)


@kernel
def exchange_slots(slots, b, one, other):
    """Exchange two slots of environment b."""
    _move_slot(slots, b, one, other, True)


@kernel
def _move_slot(slots, b, source, target, both):
    _move(slots.body[b], source, target, both)
    _move(slots.cov[b], source, target, both)
    _move(slots.slope[b], source, target, both)
    _move(slots.age_s[b], source, target, both)
    _move(slots.tracked[b], source, target, both)
    _move(slots.conflict[b], source, target, both)
    _move(slots.offset[b], source, target, both)
    _move(slots.offset_count[b], source, target, both)
    _move(slots.bone_length[b], source, target, both)
    _move(slots.bone_variance[b], source, target, both)
    _move(slots.swap_chance[b], source, target, both)
    _move(slots.blind[b], source, target, both)
    _move(slots.believed[b], source, target, both)
    _move(slots.noise_factor[b], source, target, both)
    _move(slots.noise_sums[b], source, target, both)
    _move(slots.noise_last[b], source, target, both)


@kernel(makes_arrays=True)
def _move(rows, source, target, both):
    """rows[target] = rows[source], and the other way round if `both`."""
    kept = rows[target : target + 1].copy()
    rows[target] = rows[source]
    if both:
        rows[source : source + 1] = kept


@kernel
def drop(state, b, w, h):
    """Drop hypothesis h of a worker who has others; the last one takes its place."""
    first = w * (state.log_weight.shape[1] // state.n_alive.shape[1])
    last = state.n_alive[b, w] - 1
    if h != last:
        copy_slot(state.slots, b, first + last, first + h)
        state.log_weight[b, first + h] = state.log_weight[b, first + last]
        state.pose_log_prior[b, first + h] = state.pose_log_prior[b, first + last]
    state.n_alive[b, w] = last


@kernel(makes_arrays=True)
def normalise(state, b, w, log_least):
    """Drop what is lighter than `log_least`; the weights of the others sum to one, best first."""
    first = w * (state.log_weight.shape[1] // state.n_alive.shape[1])
    log_weight = state.log_weight[b, first : first + state.n_alive[b, w]]
    _share_out(log_weight)
    for h in range(state.n_alive[b, w] - 1, -1, -1):
        if log_weight[h] < log_least and state.n_alive[b, w] > 1:
            drop(state, b, w, h)
    _share_out(log_weight[: state.n_alive[b, w]])
    best = 0
    for h in range(state.n_alive[b, w]):
        best = h if log_weight[h] > log_weight[best] else best
    if best > 0:
        pose_log_prior = state.pose_log_prior[b, first : first + len(log_weight)]
        exchange_slots(state.slots, b, first, first + best)
        log_weight[0], log_weight[best] = log_weight[best], log_weight[0]
        pose_log_prior[0], pose_log_prior[best] = pose_log_prior[best], pose_log_prior[0]


@kernel(makes_arrays=True)
def _share_out(log_weight):
    """Make weights sum to one."""
    most, total = log_weight.max(), 0.0
    for h in range(len(log_weight)):
        total += math.exp(log_weight[h] - most)
    log_weight -= most + math.log(total)


@kernel
def merge(state, b, w, least_distance, work):
    """Hypotheses that have come close are one: the heavier stays, with the weight of both.

    `least_distance` is squared, in posterior deviations.
    """
    first = w * (state.log_weight.shape[1] // state.n_alive.shape[1])
    log_weight = state.log_weight[b]
    h = 0
    while h < state.n_alive[b, w]:
        k = state.n_alive[b, w] - 1
        while k > h:
            if slot_distance(state.slots, b, first + h, first + k, work) < least_distance:
                if log_weight[first + k] > log_weight[first + h]:
                    exchange_slots(state.slots, b, first + h, first + k)
                    state.pose_log_prior[b, first + h] = state.pose_log_prior[b, first + k]
                both = np.logaddexp(log_weight[first + h], log_weight[first + k])
                log_weight[first + h] = both
                drop(state, b, w, k)
            k -= 1
        h += 1


@kernel
def slot_distance(slots, b, one, other, work):
    """Squared distance of two hypotheses, in deviations of the wider."""
    a = (slots.body[b, one], slots.cov[b, one], slots.slope[b, one])
    return distance_between(
        a, (slots.body[b, other], slots.cov[b, other], slots.slope[b, other]), work
    )
