"""How tracks begin: Algorithm 1 from all over the place, the default from one camera.

    python -m benchmarks.tracking.starts

The bench's walkers, 3 px. *Locks*: share of sequences in which the median joint of `paper` is
within 10 cm (lab) after 5 frames, 20 cm (site) after 15, and for a second from then on. For
`particle` walkers differ in size (6 %, one standard deviation) and are seen by one camera for 4 s,
then by four; *triangulated*: by four in the first frame, too. No setting was chosen on these seeds.
"""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from benchmarks.common import exactly, publish, share
from benchmarks.tracking.cells import beliefs, run_cell
from benchmarks.tracking.detections import Damage, detect
from benchmarks.tracking.metrics import STATISTICS, drawn_sums, metric
from benchmarks.tracking.rigs import RIGS, Rig, make_rig
from benchmarks.tracking.sequences import Sequences
from benchmarks.tracking.walks import walk
from hrc_env.core.results import Metric
from hrc_env.experiments.study.report import Column, Report, table_of
from hrc_env.tracking.config import PaperConfig, of_kind

LOCKED = {"lab": (5, 0.1), "site": (15, 0.2)}
"""After so many frames the median joint is to be within so much [m], for `HELD` frames."""
HELD, ALONE, SIZE_STD = 25, 100, 0.06
DESIGNS: dict[str, dict[str, Any]] = {
    "m1000": {},
    "m3000": {"n_particles": 3000},
    "m1000_n3": {"n_iterations": 3},
}
STARTS = {"one_camera": 0, "triangulated": 1}
"""Frames of four cameras before the one."""
WINDOWS = {"first_second": (6, 31), "fourth_second": (75, 100), "all_again": (100, 105)}
"""Frames: the first six are those in which a second view is waited for."""


@dataclass(frozen=True)
class Arguments:
    """What is run."""

    seeds: int = 100
    """Sequences a rig."""
    first_seed: int = 20_000
    """The others count up."""
    out: Path = Path("out/starts")


def main(arguments: Arguments) -> None:
    """Begin, hold against the truth."""
    seeds = [arguments.first_seed + k for k in range(arguments.seeds)]
    metrics: dict[str, Metric] = {}
    for rig in map(make_rig, RIGS):
        metrics |= locks(rig, seeds) | one_view(rig, seeds)
    paper = {f"{rig}.{name}": f"{rig}, {name}" for rig in RIGS for name in DESIGNS}
    starts = {f"{rig}.{w}.{s}": f"{rig}, {w}, {s}" for rig in RIGS for w in WINDOWS for s in STARTS}
    locked = [Column("locks.{}", "locks [%]", 0, 100), Column("frames.{}", "frames, median", 0),
              Column("frames_most.{}", "most", 0)]  # fmt: skip
    known = [Column("rmse_m.{}", "RMSE [cm]", 1, 100), Column("median_m.{}", "median [cm]", 1, 100),
             Column("coverage95.{}", "coverage", 3)]  # fmt: skip
    parts = [table_of("`paper`", paper, locked, metrics),
             table_of("`particle`", starts, known, metrics)]  # fmt: skip
    report = Report("How tracks begin", (__doc__ or "").strip(), parts)
    publish(arguments.out, report, asdict(arguments), seeds, metrics)


def locks(rig: Rig, seeds: list[int]) -> dict[str, Metric]:
    """Of `paper`, a design after the other."""
    after, within_m = LOCKED[rig.name]
    joints = walk(rig.walk_m, seeds, after + HELD)
    px = detect(rig.P, joints, Damage(), seeds)[:, :, :, None]
    metrics = {}
    for name, values in DESIGNS.items():
        config = replace(of_kind(rig.tracker, PaperConfig), **values)
        given = Sequences(joints[:, :, None], px, {}, config)
        off = np.stack([mean for mean, _ in beliefs("paper", rig, given, seeds)]) - given.joints
        near = np.median(np.linalg.norm(off, axis=-1), axis=(2, 3)) < within_m
        first = np.where(near.any(0), near.argmax(0) + 1, len(near))
        key = f"{rig.name}.{name}"
        metrics[f"locks.{key}"] = share([*near[after - 1 :].all(0)])
        metrics[f"frames.{key}"] = exactly(float(np.median(first)), "frames", len(seeds))
        metrics[f"frames_most.{key}"] = exactly(float(first.max()), "frames", len(seeds))
    return metrics


def one_view(rig: Rig, seeds: list[int]) -> dict[str, Metric]:
    """Of `particle` from one camera, and from four for a frame."""
    sizes = [1 + SIZE_STD * np.random.default_rng([seed, 9]).standard_normal() for seed in seeds]
    joints = walk(rig.walk_m, seeds, ALONE + HELD)
    ground = joints.mean(2, keepdims=True) * [1, 1, 0]
    joints = ground + (joints - ground) * np.reshape(sizes, (-1, 1, 1))
    metrics = {}
    for start, n_all in STARTS.items():
        px = detect(rig.P, joints, Damage(), seeds)
        for k, seed in enumerate(seeds):
            px[n_all:ALONE, k, np.arange(len(rig.P)) != seed % len(rig.P)] = np.nan
        given = Sequences(joints[:, :, None], px[:, :, :, None], WINDOWS, rig.tracker)
        for window, sums in run_cell("particle", rig, given, seeds, lambda _: None).items():
            drawn = drawn_sums(sums)
            for kind in ("rmse_m", "median_m", "coverage95"):
                unit, statistic = STATISTICS[kind]
                key = f"{kind}.{rig.name}.{window}.{start}"
                metrics[key] = metric(statistic(drawn), unit, drawn)
    return metrics


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
