"""Hypotheses about one body: slots with a Gaussian tree each, weighted, merged and dropped.

A worker has H slots, of which the first `n_alive` are in use, the heaviest first: worker w's are
the columns w H to (w + 1) H of the arrays.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, Ints
from hrc_env.tracking.tree.evidence import distance_between


class Hypotheses(NamedTuple):
    """Hypotheses about each worker; arrays changed in place."""

    trees: Any
    """(B, W H) records of `tree.state.TREE`; log-weights of those in use sum to one."""
    views: Any
    """(B, W H, C) records of `tree.state.VIEW`."""
    noise: Any
    """(B, W H, J, C) records of `tree.state.NOISE`."""
    n_alive: Ints
    """(B, W) slots in use, at least one."""
    waited_s: Floats
    """(B, W) time since other hypotheses were looked for [s]."""


@kernel(makes_arrays=True)
def copy_slot(state, b, source, target):
    """Make slot `target` of environment b a copy of `source`."""
    state.trees[b, target] = state.trees[b, source]
    state.views[b, target] = state.views[b, source]
    state.noise[b, target] = state.noise[b, source]


@kernel(makes_arrays=True)
def exchange_slots(state, b, one, other):
    """Exchange two slots of environment b."""
    tree = state.trees[b, one : one + 1].copy()
    views, noise = state.views[b, one].copy(), state.noise[b, one].copy()
    copy_slot(state, b, other, one)
    state.trees[b, other] = tree[0]
    state.views[b, other], state.noise[b, other] = views, noise


@kernel(makes_arrays=True)
def drop(state, b, w, h):
    """Drop hypothesis h of a worker who has others; the last one takes its place."""
    first = w * (state.trees.shape[1] // state.n_alive.shape[1])
    last = state.n_alive[b, w] - 1
    if h != last:
        copy_slot(state, b, first + last, first + h)
    state.n_alive[b, w] = last


@kernel(makes_arrays=True)
def normalise(state, b, w, log_least):
    """Drop what is lighter than `log_least`; the weights of the others sum to one, best first."""
    first = w * (state.trees.shape[1] // state.n_alive.shape[1])
    trees = state.trees[b, first:]
    _share_out(trees, state.n_alive[b, w])
    for h in range(state.n_alive[b, w] - 1, -1, -1):
        if trees[h].log_weight < log_least and state.n_alive[b, w] > 1:
            drop(state, b, w, h)
    _share_out(trees, state.n_alive[b, w])
    best = 0
    for h in range(state.n_alive[b, w]):
        best = h if trees[h].log_weight > trees[best].log_weight else best
    if best > 0:
        exchange_slots(state, b, first, first + best)


@kernel
def _share_out(trees, n):
    """Make the weights of the first n sum to one."""
    most, total = -np.inf, 0.0
    for h in range(n):
        most = max(most, trees[h].log_weight)
    for h in range(n):
        total += math.exp(trees[h].log_weight - most)
    for h in range(n):
        trees[h].log_weight -= most + math.log(total)


@kernel(makes_arrays=True)
def merge(state, b, w, least_distance, work):
    """Hypotheses that have come close are one: the heavier stays, with the weight of both.

    `least_distance` is squared, in posterior deviations.
    """
    first = w * (state.trees.shape[1] // state.n_alive.shape[1])
    trees = state.trees[b, first:]
    h = 0
    while h < state.n_alive[b, w]:
        k = state.n_alive[b, w] - 1
        while k > h:
            if slot_distance(trees[h], trees[k], work) < least_distance:
                both = np.logaddexp(trees[h].log_weight, trees[k].log_weight)
                if trees[k].log_weight > trees[h].log_weight:
                    exchange_slots(state, b, first + h, first + k)
                trees[h].log_weight = both
                drop(state, b, w, k)
            k -= 1
        h += 1


@kernel
def slot_distance(one, other, work):
    """Squared distance of two hypotheses, in deviations of the wider."""
    a, b = (one.body, one.cov, one.slope), (other.body, other.cov, other.slope)
    return distance_between(a, b, work)
