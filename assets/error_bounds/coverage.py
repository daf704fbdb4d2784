"""Measure how many errors the bounds cover: python -m assets.error_bounds.coverage

The episodes have other seeds than those of the calibration. Besides the robots and cameras of the
calibration there are some to which it need not apply: a robot with the bounds themselves, fewer
cameras, another task, rendered images. Results of former runs are kept for those that are not
measured.
"""

import json
import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from assets.error_bounds.calibrate import (
    DRIVES,
    LEVEL,
    Factors,
    find_expected_error,
    join_sides,
)
from assets.error_bounds.episodes import CONSTANT, SEEDS_APART, Drive, Errors, collect_all
from hrc_env.core.results import write_whole
from hrc_env.core.typing import Bools, Floats
from hrc_env.evaluation.intervals import estimate_clustered_share
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.geometry.enclosure import CAPSULES, name_part
from hrc_env.safety.config import ShieldConfig
from hrc_env.safety.error_bounds import ErrorBounds, load_error_bounds

OUT = Path(__file__).with_name("coverage.json")
CONFORMAL = "scripted robot, conformal shield"
ELSEWHERE = (
    Drive(CONFORMAL, shield=ShieldConfig("qp", margin="conformal")),
    Drive("true joints", shield="qp", setup=PerceptionSetup("truth")),
    Drive("one camera after 1 s", shield=CONSTANT, setup=PerceptionSetup(n_cameras=1)),
    Drive("two cameras after 1 s", shield=CONSTANT, setup=PerceptionSetup(n_cameras=2)),
    Drive("handing over", shield=CONSTANT, task="HRCHandover-v0"),
    Drive("rendered images", shield=CONSTANT, setup=PerceptionSetup("pixels")),
)
"""Robots and cameras that were not calibrated."""
AVAILABLE = {drive.name: drive for drive in (*DRIVES, *ELSEWHERE)}
"""All robots and cameras by name."""
SHOWN = ("covered", "low", "high")
"""Numbers of a share in the table."""
Coverage = Mapping[str, float]
"""Numbers of one part of the body by name, with intervals "low" and "high"."""


def main(
    seed: int = 14_000_000, episodes: int = 1024, only: tuple[str, ...] = (), out: Path = OUT
) -> None:
    """Measure the coverage of the bounds of the package.

    Args:
        seed: seed of the first episode.
        episodes: number of episodes of each combination of robot and cameras.
        only: names of these combinations; none for all.
        out: file to write.
    """
    console, bounds = Console(), load_error_bounds()
    results: dict[str, Any] = json.loads(out.read_text()) if out.is_file() else {}
    for k, (name, drive) in enumerate(AVAILABLE.items()):
        if name in (only or AVAILABLE):
            first = seed + SEEDS_APART * k
            (errors,) = collect_all([drive], first, episodes, name, console)
            command = " ".join(["python -m assets.error_bounds.coverage", shlex.join(sys.argv[1:])])
            made = {"command": command, "seed": first, "episodes": episodes}
            results[name] = {"made": made, "parts": measure_coverage(errors, bounds)}
            write_whole(out, json.dumps(results, indent=1) + "\n")
            console.print(make_table(name, results[name]["parts"]))


def find_bounds(sample: Errors, bounds: ErrorBounds, s: int) -> Floats:
    """Return the bound (N,) on each error of capsule `s` [m]; NaN where none is calibrated."""
    factors = Factors(bounds.view_factor[s], bounds.misfit_factor[s])
    expected = find_expected_error(sample, factors)
    ages = np.searchsorted(bounds.max_age_s, sample.age_s)
    found = np.full(len(expected), np.nan)
    for age in range(len(bounds.max_age_s)):
        here = ages == age
        of_class = np.searchsorted(bounds.expected_m[s, age], expected[here])
        found[here] = np.append(bounds.bound_m[s, age], np.nan)[of_class]
    return found


def measure_coverage(errors: Sequence[Errors], bounds: ErrorBounds) -> dict[str, Coverage]:
    """Return how many errors of each part are covered, and by what margins.

    "bound" counts errors with a calibrated bound, "margin" all errors, which the constant margin
    must cover where there is no bound, and "constant" all errors, against that margin alone.
    """
    coverage: dict[str, Coverage] = {}
    for part, sample in join_sides(errors).items():
        s = next(k for k, name in enumerate(CAPSULES) if name_part(name) == part)
        if not len(sample.error_m):
            continue
        bound_m = find_bounds(sample, bounds, s)
        known = np.isfinite(bound_m)
        margin_m = np.where(known, bound_m, sample.constant_m)
        coverage[part] = {
            "errors": len(known), "with_bound": float(known.mean()),
            **_count_covered("bound", sample, bound_m, known),
            **_count_covered("margin", sample, margin_m, ~np.isnan(margin_m)),
            **_count_covered("constant", sample, sample.constant_m, ~np.isnan(margin_m)),
        }  # fmt: skip
    return coverage


def _count_covered(name: str, sample: Errors, margin_m: Floats, among: Bools) -> Coverage:
    """Return the share of errors below a margin, with its interval, and the mean margin.

    Errors of the same episode are dependent.
    """
    if not among.any():
        return {}
    _, episode = np.unique(sample.episode[among], return_inverse=True)
    is_covered = (sample.error_m[among] <= margin_m[among]).astype(float)
    covered = np.bincount(episode, is_covered).astype(float)
    share = estimate_clustered_share(covered, np.bincount(episode).astype(float))
    return {
        f"{name}.episodes": share.n, f"{name}.covered": share.value, f"{name}.low": share.low,
        f"{name}.high": share.high, f"{name}.mean_m": float(margin_m[among].mean()),
    }  # fmt: skip


def make_table(robot: str, parts: Mapping[str, Coverage]) -> Table:
    """Return the table of the coverage of each part of the body [%]."""
    words = {"bound": "by bounds", "margin": "with fallback", "constant": "by constant margin"}
    heads = [f"{each} [%]" for each in ("with bound", *words.values())]
    table = Table("part", *heads, title=f"{robot} (asked {100 * LEVEL:g} %)")
    for part, row in parts.items():
        cells = [part, f"{100 * row['with_bound']:.1f}"]
        for name in words:
            known = [100 * row[f"{name}.{k}"] for k in SHOWN if f"{name}.{k}" in row]
            cells.append("{:.2f} ({:.2f} to {:.2f})".format(*known) if known else "none")
        table.add_row(*cells)
    return table


if __name__ == "__main__":
    tyro.cli(main)
