"""What the hypotheses of `particle` buy, part by part: python benchmarks/tracking_ablation.py

Every variant runs on the tracking bench's sequences; writes `ablation.json` and `ablation.md`.
"""

import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from rich.console import Console

from benchmarks.tracking.rigs import DT_S, RIGS, Rig, make_rig
from benchmarks.tracking.sequences import Sequences, make_sequences
from hrc_env.cli.progress import track
from hrc_env.core.results import Metric, write_results
from hrc_env.core.typing import Floats
from hrc_env.experiments.ablations.questions.filters import VARIANTS, estimator_of
from hrc_env.tracking.estimators import make_estimator

PLAIN = {"one_view_inflation": 1.0}
"""What all have in common: the report is not widened, so that it is theirs."""
WINDOWS = {
    "clean": ("clean",),
    "hard": ("hard",),
    "occluded": ("occluded",),
    "one_camera": ("one_camera", "after_return"),
}
INSIDE_95 = 7.815
COLUMNS = {
    "rmse_m": ("m", "RMSE cm", 100, 2),
    "coverage95": ("share", "coverage", 1, 3),
    "std_over_rmse": ("-", "std/RMSE", 1, 2),
    "turned": ("share", "yaw wrong %", 100, 1),
    "turned_sequences": ("-", "in sequences", 1, 0),
    "hypotheses": ("-", "hypotheses", 1, 2),
    "update_us": ("us", "us", 1, 0),
}
"""Name, unit, heading, factor and digits of what is measured of every window."""


@dataclass(frozen=True)
class Arguments:
    """Run the ablation."""

    out: Path = Path("out/tracking_ablation")
    """Where to write."""
    seeds: int = 24
    """Sequences per rig and condition."""
    conditions: tuple[str, ...] = ("one_camera", "hard")
    """Of clean, occluded, hard, one_camera."""


def left(joints: Floats) -> Floats:
    """From right to left across the torso, on the ground: (..., J, 3) to (..., 2)."""
    return joints[..., 1, :2] - joints[..., 2, :2] + joints[..., 7, :2] - joints[..., 8, :2]


def beliefs(name: str, rig: Rig, sequences: Sequences) -> Iterator[tuple[Any, float, float]]:
    """Estimate, mean number of hypotheses and us per worker after each frame."""
    n = sequences.joints.shape[1]
    estimator = make_estimator(name, rig.P, DT_S, sequences.config)
    rngs = [np.random.default_rng([k, 4]) for k in range(n)]
    state: Any = estimator.init(n, 1)
    for t in range(len(sequences.joints)):
        keypoints = sequences.keypoints(t)
        begun = time.perf_counter()
        estimator.predict(state, DT_S, rngs)
        estimator.update(state, keypoints, rngs)
        spent_us = 1e6 * (time.perf_counter() - begun) / n
        n_alive = state.n_alive.mean() if hasattr(state, "n_alive") else 1.0
        yield estimator.estimate(state), float(n_alive), spent_us


def measure(name: str, rig: Rig, sequences: Sequences) -> dict[str, dict[str, float]]:
    """All columns of every window that is asked about."""
    seen = list(beliefs(name, rig, sequences))
    mean = np.stack([belief.mean_world for belief, _, _ in seen])
    cov = np.stack([belief.cov_world for belief, _, _ in seen])
    error = mean - sequences.joints
    nees = np.einsum("...i,...ij,...j->...", error, np.linalg.inv(cov), error)
    turned = (left(mean) * left(sequences.joints)).sum(-1)[..., 0] < 0
    out = {}
    for window, (begin, end) in sequences.windows.items():
        if window not in sum(WINDOWS.values(), ()):
            continue
        part = slice(begin, end)
        rmse = np.sqrt((error[part] ** 2).sum(-1).mean())
        std = np.sqrt(np.trace(cov[part], axis1=-2, axis2=-1).mean())
        out[window] = {
            "rmse_m": rmse,
            "coverage95": (nees[part] < INSIDE_95).mean(),
            "std_over_rmse": std / rmse,
            "turned": turned[part].mean(),
            "turned_sequences": turned[part].any(0).sum(),
            "hypotheses": np.mean([n for _, n, _ in seen[part]]),
            "update_us": np.mean([us for _, _, us in seen[part]]),
        }
    return out


def table(metrics: dict[str, Metric], windows: list[tuple[str, str]]) -> str:
    """Markdown: one part per rig and window, one line per variant."""
    lines = []
    for rig, window in windows:
        lines += ["", f"| {rig}, {window} | " + " | ".join(c[1] for c in COLUMNS.values()) + " |"]
        lines += ["|---" * (len(COLUMNS) + 1) + "|"]
        for variant in VARIANTS:
            cells = [
                f"{factor * metrics[f'{kind}.{rig}.{window}.{variant}'].value:.{digits}f}"
                for kind, (_, _, factor, digits) in COLUMNS.items()
            ]
            lines.append(f"| {variant} | " + " | ".join(cells) + " |")
    return "\n".join(lines).strip() + "\n"


def main() -> None:
    """Every variant on every rig and condition."""
    args = tyro.cli(Arguments)
    seeds = [1000 + k for k in range(args.seeds)]
    metrics: dict[str, Metric] = {}
    windows: list[tuple[str, str]] = []
    cells = [(rig, condition) for rig in RIGS for condition in args.conditions]
    for rig_name, condition in track(cells, "variants"):
        rig = make_rig(rig_name)
        sequences = make_sequences(rig, condition, seeds)
        windows += [(rig_name, window) for window in WINDOWS[condition]]
        for variant, change in VARIANTS.items():
            name = estimator_of(variant)
            changed = replace(sequences, config=replace(sequences.config, **PLAIN, **change))
            for window, values in measure(name, rig, changed).items():
                for kind, value in values.items():
                    key, number = f"{kind}.{rig_name}.{window}.{variant}", float(value)
                    unit = COLUMNS[kind][0]
                    metrics[key] = Metric(number, number, number, unit, args.seeds)
    config = {**asdict(args), "out": str(args.out), "variants": VARIANTS}
    write_results(args.out / "ablation.json", config, seeds, metrics)
    (args.out / "ablation.md").write_text(table(metrics, windows))
    Console(soft_wrap=True).print(table(metrics, windows))


if __name__ == "__main__":
    main()
