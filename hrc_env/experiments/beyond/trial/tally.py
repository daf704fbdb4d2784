"""Sums over episodes: what all numbers of the experiment are made of, a row an episode."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.experiments.study.counts import ERRORS_M

Rows = dict[str, list[Any]]
"""Sums by name, one an episode."""


@dataclass(frozen=True, slots=True)
class Played:
    """What was believed of B episodes in the T frames after the warm-up, worker by worker."""

    error_m: Floats
    """(B, T, W, J) from the true joint to the track that fits the worker best."""
    inside: Bools
    """(B, T, W, J) whether the truth lies in the reported 95 % region."""
    lost: Bools
    """(B, T, W) whether no track is the worker's."""
    n_seeing: Ints
    """(B, T, W, J) cameras that see the joint, by truth; empty unless asked for."""


def sums_of(played: Played) -> Rows:
    """Everything of some episodes; `seen_<k>_<name>` are of joints that k cameras see."""
    error_m, inside = played.error_m, played.inside
    rows = _sums(error_m, inside, np.ones(error_m.shape, bool))
    rows["lost"] = played.lost.sum((1, 2)).tolist()
    rows["frames"] = [played.lost[0].size] * len(error_m)
    if played.n_seeing.size:
        for k in range(played.n_seeing.max() + 1):
            part = _sums(error_m, inside, played.n_seeing == k)
            rows |= {f"seen_{k}_{name}": values for name, values in part.items()}
    return rows


def joined(parts: Sequence[Rows]) -> Rows:
    """Rows one after the other; who has none of a name is empty there."""
    names = dict.fromkeys(name for part in parts for name in part)
    return {name: [value for part in parts for value in part.get(name, [None])] for name in names}


def _sums(error_m: Floats, inside: Bools, which: Bools) -> Rows:
    """Of the values (B, ...) that count."""
    axes = tuple(range(1, error_m.ndim))
    return {
        "errors": ERRORS_M.count(error_m, which).tolist(),
        "squares": np.where(which, error_m**2, 0.0).sum(axes).tolist(),
        "inside": (inside & which).sum(axes).tolist(),
        "joints": which.sum(axes).tolist(),
    }
