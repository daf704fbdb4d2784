"""Where will the worker be? Predictions up to 1 s ahead, on two kinds of motion.

    python benchmarks/prediction.py --out DIR [--quick]

Prints a table and writes results.json and prediction.png. "own" is the environment's worker at
the level `keypoints` (seeds that the network was not trained on), "own_failing" the same while
cameras fail, "walkers" and "walkers_hard" the tracking bench's, of whom nothing here was told.
All start from the same estimate, of `kalman`: `hold` stays there, `constant_velocity` goes on,
`damped` is one exact step of the filter's own model of the body, `forecast` is what
`Estimator.forecast` gives.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from benchmarks.tracking.rigs import DT_S
from benchmarks.tracking.tracks import Tracks, follow_own, follow_walkers
from hrc_env.core.batching import copied
from hrc_env.core.records import PoseEstimate
from hrc_env.core.results import Metric, write_results
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.forecast import forecast as forecast_all
from hrc_env.tracking.hypotheses.filter import predict_all
from hrc_env.tracking.hypotheses.slots import Hypotheses, plain
from hrc_env.tracking.particle import ParticleEstimator
from hrc_env.tracking.tree.state import motion
from hrc_env.tracking.tree.work import WORK

mpl.use("Agg")
HORIZONS_S = (0.1, 0.2, 0.4, 0.6, 1.0)
CHI2_95_3D = 7.815
"""95 % of a three-dimensional normal variable lies within this squared distance."""
FIELDS = ("mean_world", "cov_world", "velocity_world", "age_s", "tracked")
WARM_UP, EVERY, N_RESAMPLED = 25, 2, 1000
Gaussian = tuple[np.ndarray, np.ndarray]
"""Means (S, J, 3) and covariances (S, J, 3, 3)."""


@dataclass(frozen=True)
class Arguments:
    """Compare predictions of the worker's joints."""

    out: Path = Path("out/prediction")
    """Folder for results.json and prediction.png."""
    quick: bool = False
    """Fewer and shorter sequences."""


def hold(estimator: ParticleEstimator, state: Hypotheses, horizon_s: float) -> Gaussian:
    """Nobody moves; the present covariance says nothing of the future and is not shown."""
    body = state.slots.body
    return body[:, 0, :, :3].copy(), np.full((*body.shape[:1], 15, 3, 3), np.nan)


def constant_velocity(
    estimator: ParticleEstimator, state: Hypotheses, horizon_s: float
) -> Gaussian:
    """Every joint goes on; the covariance with the filter's own random acceleration."""
    body, cov = state.slots.body[:, 0], state.slots.cov[:, 0]
    cross = cov[..., :3, 3:] + cov[..., 3:, :3]
    moved = cov[..., :3, :3] + horizon_s * cross + horizon_s**2 * cov[..., 3:, 3:]
    noise = estimator.config.root_acceleration * horizon_s**3 / 3 * np.eye(3)
    return body[..., :3] + horizon_s * body[..., 3:], moved + noise


def damped(estimator: ParticleEstimator, state: Hypotheses, horizon_s: float) -> Gaussian:
    """One exact step of the filter's model on a copy that learns nothing."""
    copy = copied(state)
    copy.slots.offset_count[:] = np.inf
    config = estimator.config
    model = motion(horizon_s, config.damping, config.root_acceleration)
    predict_all(plain(copy), model, 0.0, *estimator.constants[:2], np.empty(1, WORK))
    return copy.slots.body[:, 0, :, :3], copy.slots.cov[:, 0, :, :3, :3]


def forecast(estimator: ParticleEstimator, state: Hypotheses, horizon_s: float) -> Gaussian:
    """What `Estimator.forecast` gives."""
    later = estimator.forecast(state, horizon_s)
    return later.mean_world[:, 0], later.cov_world[:, 0]


PREDICTIONS: dict[str, Callable[[ParticleEstimator, Hypotheses, float], Gaussian]] = {
    "hold": hold,
    "constant_velocity": constant_velocity,
    "damped": damped,
    "forecast": forecast,
}


class Asker:
    """Asks every prediction at every second frame."""

    def __init__(self) -> None:
        self.frame = 0

    def __call__(self, estimator: Any, state: Hypotheses) -> Any:
        """Answers by name and horizon, in float32; None between."""
        self.frame += 1
        if self.frame % EVERY:
            return None
        return {
            (name, horizon_s): [
                part.astype(np.float32) for part in ask(estimator, state, horizon_s)
            ]
            for name, ask in PREDICTIONS.items()
            for horizon_s in HORIZONS_S
        }


def seeds_of(quick: bool) -> tuple[list[int], list[int]]:
    """Of the environment's own motions and of the walkers."""
    n = 6 if quick else 32
    return list(range(1000, 1000 + n)), list(range(500, 500 + n // 2))


def sources(quick: bool) -> dict[str, Callable[[], Tracks]]:
    """What to follow, by name."""
    (own, walkers), n_frames = seeds_of(quick), 150 if quick else 275
    return {
        "own": lambda: follow_own(own, n_frames, look=Asker()),
        "own_failing": lambda: follow_own(own, n_frames, failing=True, look=Asker()),
        "walkers": lambda: follow_walkers(walkers, n_frames, "clean", look=Asker()),
        "walkers_hard": lambda: follow_walkers(walkers, n_frames, "hard", look=Asker()),
    }


def sums_of(tracks: Tracks, name: str, horizon_s: float) -> dict[str, np.ndarray]:
    """Sums per sequence over frames and joints (S,), and the median error."""
    frame = horizon_s / DT_S
    first, share = int(frame + 1e-9), frame - int(frame + 1e-9)
    n_frames, n = tracks.truth.shape[:2]
    sums = {key: np.zeros(n) for key in ("n", "squared", "inside", "trace")}
    lengths: list[list[np.ndarray]] = [[] for _ in range(n)]
    for t in range(WARM_UP, n_frames - first - 1):
        if tracks.looks[t] is None:
            continue
        then = (1 - share) * tracks.truth[t + first] + share * tracks.truth[t + first + 1]
        mean, cov = (part.astype(float) for part in tracks.looks[t][name, horizon_s])
        error = mean - then
        squared = (error**2).sum(-1)
        nees = np.einsum("sji,sjik,sjk->sj", error, np.linalg.inv(cov), error)
        use = tracks.estimates[t].tracked[:, 0, None]
        sums["n"] += np.where(use, np.ones_like(squared), 0).sum(1)
        sums["squared"] += np.where(use, squared, 0).sum(1)
        sums["inside"] += np.where(use, nees < CHI2_95_3D, 0).sum(1)
        sums["trace"] += np.where(use, np.trace(cov, axis1=-2, axis2=-1), 0).sum(1)
        for s in np.flatnonzero(use[:, 0]):
            lengths[s].append(np.sqrt(squared[s]))
    median = [np.median(each) if each else np.nan for each in lengths]
    keep = sums["n"] > 0
    return {key: value[keep] for key, value in (sums | {"median": np.array(median)}).items()}


STATISTICS: dict[str, tuple[str, Callable[[dict[str, np.ndarray]], np.ndarray]]] = {
    "rmse_m": ("m", lambda s: np.sqrt(s["squared"].sum(-1) / s["n"].sum(-1))),
    "median_m": ("m", lambda s: s["median"].mean(-1)),
    "coverage95": ("share", lambda s: s["inside"].sum(-1) / s["n"].sum(-1)),
    "std_over_rmse": ("-", lambda s: np.sqrt(s["trace"].sum(-1) / s["squared"].sum(-1))),
}


def metrics_of(source: str, tracks: Tracks) -> dict[str, Metric]:
    """Every statistic with a bootstrap over sequences."""
    metrics = {}
    for name in PREDICTIONS:
        for horizon_s in HORIZONS_S:
            sums = sums_of(tracks, name, horizon_s)
            n = len(sums["n"])
            draws = np.random.default_rng(0).integers(n, size=(N_RESAMPLED, n))
            resampled = {key: value[draws] for key, value in sums.items()}
            for kind, (unit, statistic) in STATISTICS.items():
                if name == "hold" and kind in ("coverage95", "std_over_rmse"):
                    continue
                low, high = np.percentile(statistic(resampled), (2.5, 97.5))
                key = f"{kind}.{source}.{horizon_s:g}.{name}"
                metrics[key] = Metric(float(statistic(sums)), float(low), float(high), unit, n)
    return metrics


def costs_us() -> dict[str, Metric]:
    """Time of `forecast` per worker, alone and with 63 others: smallest and quartiles of many."""
    metrics, now = {}, follow_own([7], 30).estimates[-1]
    for batch in (1, 64):
        whole = PoseEstimate(*(np.repeat(getattr(now, name), batch, 0) for name in FIELDS))
        times = []
        for _ in range(300):
            begin = time.perf_counter()
            forecast_all(whole, 0.4, ParticleConfig())
            times.append(1e6 * (time.perf_counter() - begin) / batch)
        least, low, high = (float(value) for value in np.percentile(times, (0, 25, 75)))
        metrics[f"ahead_us.{batch}"] = Metric(least, low, high, "us", len(times))
    return metrics


def show(metrics: dict[str, Metric], names: list[str]) -> None:
    """The table."""
    table = Table("source", "horizon s", *PREDICTIONS)
    for source in names:
        for horizon_s in HORIZONS_S:
            cells = []
            for name in PREDICTIONS:
                key = f"{source}.{horizon_s:g}.{name}"
                cell = f"{100 * metrics[f'rmse_m.{key}'].value:.1f}"
                cell += f" ({100 * metrics[f'median_m.{key}'].value:.1f})"
                if name != "hold":
                    cell += f" {metrics[f'coverage95.{key}'].value:.3f}"
                    cell += f" {metrics[f'std_over_rmse.{key}'].value:.2f}"
                cells.append(cell)
            table.add_row(source, f"{horizon_s:g}", *cells)
    console = Console(width=140)
    console.print("RMSE (median) in cm, coverage of the 95 % region, standard deviation / RMSE")
    console.print(table)
    for batch in (1, 64):
        console.print(f"ahead, batch {batch}: {metrics[f'ahead_us.{batch}'].value:.1f} us a worker")


def draw(metrics: dict[str, Metric], names: list[str], path: Path) -> None:
    """RMSE against the horizon, a panel a source."""
    figure, axes = plt.subplots(1, len(names), figsize=(3.2 * len(names), 3.2), sharey=False)
    for axis, source in zip(np.atleast_1d(axes), names, strict=True):
        for name in PREDICTIONS:
            cells = [metrics[f"rmse_m.{source}.{h:g}.{name}"] for h in HORIZONS_S]
            axis.plot(HORIZONS_S, [100 * cell.value for cell in cells], "o-", ms=3, label=name)
            low, high = ([100 * getattr(c, end) for c in cells] for end in ("low", "high"))
            axis.fill_between(HORIZONS_S, low, high, alpha=0.15, lw=0)
        axis.set(title=source.replace("_", " "), xlabel="horizon [s]", ylim=(0, None))
        axis.grid(alpha=0.3)
    np.atleast_1d(axes)[0].set_ylabel("RMSE of a joint [cm]")
    np.atleast_1d(axes)[0].legend(frameon=False, fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=130)


def main(arguments: Arguments) -> None:
    """Follow, predict, compare."""
    metrics: dict[str, Metric] = {}
    asked = sources(arguments.quick)
    for source, follow in asked.items():
        metrics |= metrics_of(source, follow())
    metrics |= costs_us()
    arguments.out.mkdir(parents=True, exist_ok=True)
    show(metrics, list(asked))
    draw(metrics, list(asked), arguments.out / "prediction.png")
    seeds = [*seeds_of(arguments.quick)[0], *seeds_of(arguments.quick)[1]]
    config = {"forecast_s": HORIZONS_S, "quick": arguments.quick, "estimator": "kalman"}
    write_results(arguments.out / "results.json", config, seeds, metrics)


if __name__ == "__main__":
    main(tyro.cli(Arguments))
