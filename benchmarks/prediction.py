"""Where will the worker be? Forecasts up to 1 s ahead, on two kinds of motion.

    python -m benchmarks.prediction [--quick]

"env" is the environment's worker at the level `keypoints` (seeds that the network was not trained
on), "env_failing" the same while cameras fail, "walkers" and "walkers_hard" the tracking bench's,
of whom nothing here was told. All start from the same estimate, of `kalman`: `hold` stays there,
`constant_velocity` goes on, `motion_model` is the filter's own prediction, `forecast` is what
`Estimator.forecast` gives.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from benchmarks.common import CHI2_95_3D, normalised_square, publish
from benchmarks.tracking.rigs import DT_S
from benchmarks.tracking.tracks import Tracks, follow_env, follow_walkers
from hrc_env.core.batching import copied
from hrc_env.core.results import Metric
from hrc_env.experiments.study.intervals import ratio_over, rmse_over
from hrc_env.experiments.study.report import Column, Report, table_of

HORIZONS_S = (0.1, 0.2, 0.4, 0.6, 1.0)
WARM_UP, EVERY = 25, 2
NAMES = ("hold", "constant_velocity", "motion_model", "forecast")


@dataclass(frozen=True)
class Arguments:
    """Compare predictions of the worker's joints."""

    out: Path = Path("out/prediction")
    """Folder for results.json and a report."""
    quick: bool = False
    """Fewer and shorter sequences."""


class Forecasts:
    """Asked after every frame, answers after every second one: means and covariances."""

    def __init__(self) -> None:
        self.frame = 0

    def __call__(self, estimator: Any, state: Any) -> Any:
        """Forecasts (S, J, 3) and (S, J, 3, 3), and what the motion model says (S, J, 3), by
        horizon, in float32; None between."""
        self.frame += 1
        if self.frame % EVERY:
            return None
        found = []
        for horizon_s in HORIZONS_S:
            later, moved = estimator.forecast(state, horizon_s), copied(state)
            moved.trees["age_s"] -= horizon_s  # nobody is given up meanwhile
            estimator.predict(moved, horizon_s, [])
            parts = later.mean_world, later.cov_world, estimator.estimate(moved).mean_world
            found.append([part[:, 0].astype(np.float32) for part in parts])
        return found


def sources(quick: bool) -> dict[str, Callable[[], Tracks]]:
    """What to follow, by name."""
    n, n_frames = (6, 150) if quick else (32, 275)
    own, walkers = list(range(1000, 1000 + n)), list(range(500, 500 + n // 2))
    return {
        "env": lambda: follow_env(own, n_frames, look=Forecasts()),
        "env_failing": lambda: follow_env(own, n_frames, failing=True, look=Forecasts()),
        "walkers": lambda: follow_walkers(walkers, n_frames, "clean", Forecasts()),
        "walkers_hard": lambda: follow_walkers(walkers, n_frames, "hard", Forecasts()),
    }


def metrics_of(source: str, tracks: Tracks) -> dict[str, Metric]:
    """Every number with its interval over sequences, while the worker was tracked."""
    metrics = {}
    for k, horizon_s in enumerate(HORIZONS_S):
        first = int(horizon_s / DT_S + 1e-9)
        share = horizon_s / DT_S - first
        asked = range(WARM_UP, len(tracks.truth) - first - 1)
        frames = [t for t in asked if tracks.looks[t] is not None]
        at = np.array(frames)
        then = (1 - share) * tracks.truth[at + first] + share * tracks.truth[at + first + 1]
        now = [tracks.estimates[t] for t in frames]
        use = np.stack([each.tracked[:, 0] for each in now])
        place = np.stack([each.mean_world[:, 0] for each in now])
        speed = np.stack([each.velocity_world[:, 0] for each in now])
        mean, cov, moved = (
            np.stack([tracks.looks[t][k][i] for t in frames], dtype=float) for i in range(3)
        )
        means = place, place + horizon_s * speed, moved, mean
        for name, guess in zip(NAMES, means, strict=True):
            key = f"{source}.{horizon_s:g}.{name}"
            error = np.where(use[..., None, None], guess - then, np.nan)
            squared = (error**2).sum(-1)
            sums, n = np.nansum(squared, (0, 2)), np.isfinite(squared).sum((0, 2))
            metrics[f"rmse_m.{key}"] = rmse_over(sums, n, "m")
            if name == "forecast":
                inside = (normalised_square(error, cov) < CHI2_95_3D).sum((0, 2))
                spread = np.trace(cov, axis1=-2, axis2=-1) * use[..., None]
                metrics[f"coverage95.{key}"] = ratio_over(inside, n, "share")
                metrics[f"std_over_rmse.{key}"] = rmse_over(spread.sum((0, 2)), sums, "-")
    return metrics


def main(arguments: Arguments) -> None:
    """Follow, predict, compare."""
    metrics: dict[str, Metric] = {}
    asked = sources(arguments.quick)
    for source, follow in asked.items():
        metrics |= metrics_of(source, follow())
    rows = {f"{name}.{s:g}": f"{name}, {s:g} s" for name in asked for s in HORIZONS_S}
    columns = [
        *(Column(f"rmse_m.{{}}.{name}", f"{name}, RMSE [cm]", 1, 100) for name in NAMES),
        Column("coverage95.{}.forecast", "coverage", 3),
        Column("std_over_rmse.{}.forecast", "std/RMSE", 2),
    ]
    parts = [table_of("", rows, columns, metrics)]
    report = Report("Prediction", (__doc__ or "").strip(), parts)
    publish(arguments.out, report, asdict(arguments), [1000, 500], metrics)


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
