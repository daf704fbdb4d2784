"""Calibrate hrc_env/safety/error_bounds.json: python -m assets.error_bounds.calibrate

`python -m assets.error_bounds.coverage` measures on other seeds how many errors the bounds cover.
"""

import json
import math
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import tyro
from rich.console import Console

from assets.error_bounds.episodes import CONSTANT, Drive, Errors, collect_all
from hrc_env.core.results import write_whole
from hrc_env.core.typing import Floats
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.geometry.enclosure import CAPSULES, name_part
from hrc_env.safety.error_bounds import (
    MAX_MISFIT,
    MAX_VIEWS,
    ErrorBounds,
    describe_error_bounds,
)

OUT = Path(__file__).parents[2] / "hrc_env" / "safety" / "error_bounds.json"
DRIVES = (
    Drive("scripted robot with shield", shield=CONSTANT),
    Drive("scripted robot"),
    Drive("random robot", "random"),
    Drive("scripted robot with shield, 120 ms", shield=CONSTANT,
          setup=PerceptionSetup(latency_s=0.12)),
    Drive("scripted robot with shield, 200 ms", shield=CONSTANT,
          setup=PerceptionSetup(latency_s=0.2)),
)  # fmt: skip
"""Robots and cameras of the calibration. The robot hides people from cameras, so that errors depend
on its motion."""
LEVEL = 0.999
"""Share of the errors that a bound covers."""
MAX_AGE_S = (0.06, 0.14, 0.22)
"""Upper bounds on the ages of the classes of ages [s]."""
CLASSES = (0.25, 0.5, 0.7, 0.85, 0.94, 0.98, 1.0)
"""Shares of the errors up to the upper bound of each class of expected errors."""
MIN_EPISODES = 200
"""Minimum number of episodes with errors of a part and an age; fewer give no bound."""
GROUPS = (("shoulder", "upper_arm", "forearm", "hand"), ("head", "neck", "chest", "torso",
          "abdomen", "pelvis", "thigh", "shank", "foot"))  # fmt: skip
"""Parts of the body that share the factors for views and misfit."""
TAIL = 0.995
"""Quantile of the errors by which the factors are fitted."""
MIN_ERRORS = 2000
"""Minimum number of errors in a class of views and misfit that is used for the fit."""


class Factors(NamedTuple):
    """Factors on the standard deviation of parts that share them."""

    view: Floats
    """Factor of each class of views (V,)."""
    misfit: Floats
    """Factor of each class of misfit (M,)."""


def main(seed: int = 13_000_000, episodes: int = 1536, out: Path = OUT) -> None:
    """Calibrate the bounds.

    Args:
        seed: seed of the first episode.
        episodes: number of episodes of each combination of robot and cameras.
        out: file to write.
    """
    errors = collect_all(DRIVES, seed, episodes, "Calibrating", Console())
    bounds = calibrate([_join(each) for each in zip(*errors, strict=True)])
    made = {
        "command": " ".join(["python -m assets.error_bounds.calibrate", shlex.join(sys.argv[1:])]),
        "seed": seed, "episodes": episodes, "level": LEVEL,
        "drives": [drive.name for drive in DRIVES],
    }  # fmt: skip
    write_whole(out, json.dumps({"made": made, **describe_error_bounds(bounds)}) + "\n")


def _join(parts: Sequence[Errors]) -> Errors:
    """Return several samples as one."""
    return Errors(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def join_sides(errors: Sequence[Errors]) -> dict[str, Errors]:
    """Return the errors of each part of the body, of both sides, from those of capsules (S,)."""
    of_part: dict[str, list[Errors]] = {}
    for capsule, each in zip(CAPSULES, errors, strict=True):
        of_part.setdefault(name_part(capsule), []).append(each)
    return {part: _join(sides) for part, sides in of_part.items()}


def calibrate(errors: Sequence[Errors]) -> ErrorBounds:
    """Return bounds from the errors of each capsule (S,)."""
    parts = join_sides(errors)
    factors = {
        part: found
        for group in GROUPS
        for found in [fit_factors([parts[part] for part in group])]
        for part in group
    }
    shape = len(CAPSULES), len(MAX_AGE_S), len(CLASSES)
    expected_m, bound_m = np.full(shape, -np.inf), np.zeros(shape)
    for s, capsule in enumerate(CAPSULES):
        part = name_part(capsule)
        sample, ages = parts[part], np.searchsorted(MAX_AGE_S, parts[part].age_s)
        expected = find_expected_error(sample, factors[part])
        for age in range(len(MAX_AGE_S)):
            here = ages == age
            if len(np.unique(sample.episode[here])) >= MIN_EPISODES:
                edges = np.quantile(expected[here], CLASSES)
                of_class = np.searchsorted(edges, expected[here])
                quantiles = [
                    find_quantile(sample.error_m[here][of_class == k]) for k in range(len(CLASSES))
                ]
                expected_m[s, age], bound_m[s, age] = edges, np.maximum.accumulate(quantiles)
    return ErrorBounds(
        max_age_s=np.array(MAX_AGE_S),
        view_factor=np.array([factors[name_part(name)].view for name in CAPSULES]),
        misfit_factor=np.array([factors[name_part(name)].misfit for name in CAPSULES]),
        expected_m=expected_m,
        bound_m=bound_m,
    )


def find_quantile(errors_m: Floats) -> float:
    """Return the conformal quantile of errors: the ceil((n + 1) `LEVEL`)-th smallest [m]."""
    rank = min(math.ceil((len(errors_m) + 1) * LEVEL), len(errors_m))
    return float(np.sort(errors_m)[rank - 1])


def find_expected_error(sample: Errors, factors: Factors) -> Floats:
    """Return the expected error (N,) of a sample [m]."""
    views = np.searchsorted(MAX_VIEWS, sample.n_views)
    misfit = np.searchsorted(MAX_MISFIT, sample.misfit)
    return sample.std_m * factors.view[views] * factors.misfit[misfit]


def fit_factors(parts: Sequence[Errors]) -> Factors:
    """Fit factors to the tails of normalized errors, by least squares of their logarithms.

    They are relative to many views and a small misfit, and never below 1.
    """
    n_views, n_misfits = len(MAX_VIEWS) + 1, len(MAX_MISFIT) + 1
    rows, tails, weights = [], [], []
    for p, sample in enumerate(parts):
        scaled = (sample.error_m - np.median(sample.error_m)) / sample.std_m
        views = np.searchsorted(MAX_VIEWS, sample.n_views)
        misfits = np.searchsorted(MAX_MISFIT, sample.misfit)
        for view, misfit in np.ndindex(n_views, n_misfits):
            here = (views == view) & (misfits == misfit) & (sample.age_s <= MAX_AGE_S[0])
            if np.count_nonzero(here) >= MIN_ERRORS:
                row = np.zeros(len(parts) + n_views + n_misfits)
                row[[p, len(parts) + view, len(parts) + n_views + misfit]] = 1.0
                rows.append(row)
                tails.append(math.log(np.quantile(scaled[here], TAIL)))
                weights.append(math.sqrt(np.count_nonzero(here)))
    weight = np.sqrt(weights)
    found = np.linalg.lstsq(np.array(rows) * weight[:, None], np.array(tails) * weight)[0]
    view, misfit = np.split(found[len(parts) :], [n_views])
    return Factors(
        np.exp(np.maximum.accumulate((view - view[-1])[::-1])[::-1]),
        np.exp(np.maximum.accumulate(misfit - misfit[0])),
    )


if __name__ == "__main__":
    tyro.cli(main)
