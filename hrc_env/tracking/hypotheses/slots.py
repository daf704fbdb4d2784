"""Hypotheses about one body: slots with a Gaussian tree each, weighted, merged and dropped.

A worker has H slots, of which the first `n_alive` are in use, the heaviest first.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.tracking.tree.evidence import distance_between
from hrc_env.tracking.tree.state import Hypotheses


@kernel(makes_arrays=True)
def worker_slots(state, b, w):
    """Worker w of environment b alone: views (H, ...); `n_alive`, `waited_s` and `pace` (1,)."""
    trees, views, noise = state.trees[b, w], state.views[b, w], state.noise[b, w]
    n_alive, waited_s = state.n_alive[b, w : w + 1], state.waited_s[b, w : w + 1]
    return Hypotheses(trees, views, noise, n_alive, waited_s, state.pace[b, w : w + 1])


@kernel(makes_arrays=True)
def copy_slot(own, source, target):
    """Make slot `target` of a worker a copy of `source`."""
    own.trees[target] = own.trees[source]
    own.views[target] = own.views[source]
    own.noise[target] = own.noise[source]


@kernel(makes_arrays=True)
def exchange_slots(own, one, other):
    """Exchange two slots of a worker."""
    tree = own.trees[one : one + 1].copy()
    views, noise = own.views[one].copy(), own.noise[one].copy()
    copy_slot(own, other, one)
    own.trees[other] = tree[0]
    own.views[other], own.noise[other] = views, noise


@kernel(makes_arrays=True)
def drop(own, h):
    """Drop hypothesis h of a worker who has others; the last one takes its place."""
    last = own.n_alive[0] - 1
    if h != last:
        copy_slot(own, last, h)
    own.n_alive[0] = last


@kernel(makes_arrays=True)
def normalise(own, log_least):
    """Drop what is lighter than `log_least`; the weights of the others sum to one, best first."""
    trees = own.trees
    _share_out(trees, own.n_alive[0])
    for h in range(own.n_alive[0] - 1, -1, -1):
        if trees[h].log_weight < log_least and own.n_alive[0] > 1:
            drop(own, h)
    _share_out(trees, own.n_alive[0])
    best = 0
    for h in range(own.n_alive[0]):
        best = h if trees[h].log_weight > trees[best].log_weight else best
    if best > 0:
        exchange_slots(own, 0, best)


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
def merge(own, least_distance, work):
    """Hypotheses that have come close are one: the heavier stays, with the weight of both.

    `least_distance` is squared, in posterior deviations.
    """
    trees, h = own.trees, 0
    while h < own.n_alive[0]:
        for k in range(own.n_alive[0] - 1, h, -1):
            if distance_between(trees[h], trees[k], work) < least_distance:
                both = np.logaddexp(trees[h].log_weight, trees[k].log_weight)
                if trees[k].log_weight > trees[h].log_weight:
                    exchange_slots(own, h, k)
                trees[h].log_weight = both
                drop(own, k)
        h += 1
