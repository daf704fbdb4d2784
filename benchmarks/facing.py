"""Is one camera accurate when the worker faces it? python -m benchmarks.facing [--quick]

The paper concludes that a single camera gives an accurate 3D pose only of somebody who faces it.
Here workers of all bodies work before the four cameras of the laboratory, which see every moment at
four yaws. Sorted by the angle between where the trunk faces and where the camera is, left and right
together: errors of detections in each camera's image, while all four follow; and errors in the room
where one camera is left after the first second, which is not judged. Joints that furniture, robot
or load hides from that camera, or that its image leaves out, do not count; what the body itself
hides does.
"""

import sys
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import tyro

from benchmarks.command import Arguments
from benchmarks.tracking.matched import heading
from hrc_env.cli.entry import show_errors
from hrc_env.cli.show import show
from hrc_env.config import HRCConfig
from hrc_env.core.batching import rows
from hrc_env.core.records import PoseEstimate
from hrc_env.core.results import Metric
from hrc_env.core.skeleton import TORSO
from hrc_env.core.typing import Bools, Floats, Ints, Points3
from hrc_env.evaluation.counts import ERRORS_M, Bins
from hrc_env.evaluation.intervals import counted_quantile_over, ratio_over
from hrc_env.experiments.ablations.play import BODIES, Walks, walks_of
from hrc_env.experiments.cache import Part, PartCache, PartProgress
from hrc_env.experiments.columns import Column
from hrc_env.experiments.lab.sides import MISSED_CONFIDENCE, MISSED_SHARE
from hrc_env.experiments.report import Metrics, Report, Table, quick_words
from hrc_env.experiments.rigs import ALL, DT_S, N_WARM_UP, SINGLE, Rig, left_with
from hrc_env.experiments.runner import run_experiment
from hrc_env.experiments.versions import key_of
from hrc_env.geometry.cameras import project, projections
from hrc_env.geometry.sight import find_hidden
from hrc_env.pipeline.levels import make_pipeline
from hrc_env.pipeline.sensor_input import TrueSensorInput
from hrc_env.scene.build import build
from hrc_env.scene.rigs import RIGS
from hrc_env.worker.body import worker_truth

YAWS = {0: "faces it", 45: "45 degrees", 90: "sideways", 135: "135 degrees", 180: "turns its back"}
"""Middles of the ranges of 45 degrees (the outer ones are half), and words."""
ESTIMATORS = {"keypoints": ("particle", "paper"), "pixels": ("particle",)}
"""With one camera, by level."""
SHARES = Bins(np.geomspace(1e-4, 10, 600))
Counts = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Facing:
    """The experiment, and how much is played."""

    name = "facing"
    depends = ("env", "tracker", "emulator", "detector", "motion")
    episodes: tuple[int, int] = (120, 12)
    """At the levels `keypoints` and `pixels`."""
    seconds: float = 10.0
    """Length of an episode [s], the first second included."""
    seed: int = 3_000_000
    """Of the first episode."""

    @property
    def seeds(self) -> Sequence[int]:
        """One an episode."""
        return range(self.seed, self.seed + max(self.episodes))

    @property
    def n_parts(self) -> int:
        """Levels."""
        return len(ESTIMATORS)

    @property
    def quick_note(self) -> str:
        """The warning on tables and figures of a short run; "" if it is long enough."""
        is_short = max(self.episodes) < max(Facing().episodes)
        return quick_words(max(self.episodes), self.seconds) if is_short else ""

    def settings(self) -> dict[str, Any]:
        """Return what all numbers depend on."""
        return asdict(self)

    def play(self, cache: PartCache) -> dict[str, Metric]:
        """Return the numbers of both levels, each from the cache or anew."""
        key = key_of({"seconds": self.seconds, "seed": self.seed}, self.depends)
        metrics: dict[str, Metric] = {}
        parts = [
            Part(f"{level}.{n}", partial(self._measure, level, n), key)
            for level, n in zip(ESTIMATORS, self.episodes, strict=True)
        ]
        for part in cache.parts(parts, one_core=True):
            metrics |= {name: Metric(**each) for name, each in part.items()}
        return metrics

    def _measure(self, level: str, n: int, tick: PartProgress) -> dict[str, Any]:
        """Return the numbers of a level."""
        return {name: asdict(each) for name, each in metrics_of(level, n, self).items()}

    def metrics(self, played: dict[str, Metric]) -> dict[str, Metric]:
        """Return every number."""
        return played

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the table of the documentation."""
        return (TABLE,)

    def report(self, played: dict[str, Metric], metrics: Metrics, figures: Path) -> Report:
        """Return the table."""
        return Report("Facing the camera", (__doc__ or "").strip(), [TABLE.markdown(metrics)])


class Frame(NamedTuple):
    """A moment of some episodes; C cameras that are judged, J joints of one worker."""

    joints_world: Points3  # (B, J, 3)
    eyes_world: Points3  # (C, 3)
    yaw: Ints  # (B, C) which of `YAWS`
    free: Bools  # (B, C, J) nothing but the body may hide the joint
    off_share: Floats  # (B, C, J) error in the image, of the stature there; NaN: no detection
    sure: Bools  # (B, C, J) whether the detector is
    said: PoseEstimate


def frames(
    level: str, estimator: str, kept: Rig, walks: Walks, seeds: Sequence[int], ids: Ints
) -> Iterator[Frame]:
    """What the cameras `kept` and the estimator make of episodes `ids`, after the warm-up."""
    turn, batch = left_with(RIGS["lab"], kept), np.arange(len(ids))
    config = HRCConfig(worker=BODIES, faults=turn.faults)
    scene = build(config.scene, "lab", 1, walks.bodies.names)
    pipeline = make_pipeline(level, estimator, scene, len(ids), config)
    rngs = [[np.random.default_rng([seeds[b], k]) for b in ids.tolist()] for k in (2, 3)]
    cameras = [scene.cameras[c] for c in kept]
    eyes, P = np.stack([each.eye_world for each in cameras]), projections(tuple(cameras))
    size = np.array([(each.width_px, each.height_px) for each in cameras])[:, None]
    focal = np.array([each.K[0, 0] for each in cameras])[:, None]
    with closing(pipeline):
        pipeline.reset(batch, *rngs)
        for t, motions in enumerate(walks.motions):
            motion, q = rows(motions, ids), walks.q[ids]
            truth = worker_truth(walks.bodies, motion)
            there = np.ones((len(ids), 1), bool)
            pipeline.sensor.expose(TrueSensorInput(batch, q, motion, truth, there))
            said = pipeline.perceive(batch, *rngs)
            if t < N_WARM_UP:
                continue
            joints = truth.joints_world[:, 0]
            px, depth_m = project(P, joints)
            found = pipeline.keypoints
            sure = found.confidence[:, kept, 0] >= MISSED_CONFIDENCE
            off_px = np.linalg.norm(found.px[:, kept, 0] - px, axis=-1)
            stature_m = walks.bodies.stature_m[motion.body[:, 0]][:, None, None]
            inside = (depth_m > 0) & ((px > 0) & (px < size)).all(-1)
            free = inside & ~find_hidden(scene.surroundings(q, motion.held), eyes, joints)
            share = off_px * depth_m / (focal * stature_m)
            yield Frame(joints, eyes, yaw_of(joints, eyes), free, share, sure, said)


def yaw_of(joints_world: Points3, eyes_world: Points3) -> Ints:
    """(B, C) which of `YAWS` a body (B, J, 3) has to each eye (C, 3)."""
    to_eye = eyes_world - joints_world[:, None, TORSO].mean(2)
    turn = heading(joints_world)[:, None] - np.arctan2(to_eye[..., 1], to_eye[..., 0])
    return np.rint(np.abs((turn + np.pi) % (2 * np.pi) - np.pi) / np.radians(45)).astype(int)


def counted(level: str, estimator: str, kept: Rig, walks: Walks, seeds: Sequence[int]) -> Counts:
    """By "<number>.<yaw>", an episode a row: counts of errors, and numbers of joints that were free
    or missed. What cameras see while all follow; or where one is left, every fourth episode."""
    ids, found = np.arange(len(seeds)), Counts()
    if len(kept) == 1:
        ids = ids[kept[0] :: len(SINGLE)]
    for now in frames(level, estimator, kept, walks, seeds, ids):
        ray = now.joints_world[:, None] - now.eyes_world[:, None]
        ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
        off = (now.said.mean_world[:, 0] - now.joints_world)[:, None]
        across = np.linalg.norm(off - (off * ray).sum(-1, keepdims=True) * ray, axis=-1)
        error = np.broadcast_to(np.linalg.norm(off, axis=-1), across.shape)
        missed = ~(now.sure & (now.off_share <= MISSED_SHARE))
        for k, yaw in enumerate(YAWS):
            here = now.free & (now.yaw == k)[..., None]
            for name, values in (
                ("free", here.sum((1, 2))),
                ("missed", (here & missed).sum((1, 2))),
                ("off_share", SHARES.count(now.off_share, here & np.isfinite(now.off_share))),
                ("error_m", ERRORS_M.count(error, here)),
                ("across_m", ERRORS_M.count(across, here)),
            ):
                empty = np.zeros((len(seeds), *values.shape[1:]), np.int64)
                found.setdefault(f"{name}.{yaw}", empty)[ids] += values
    return found


def metrics_of(level: str, n_episodes: int, facing: Facing) -> dict[str, Metric]:
    """Every number of a level, with its interval over episodes."""
    seeds, metrics = tuple(range(facing.seed, facing.seed + n_episodes)), {}
    walks = walks_of("lab", 1, seeds, round(facing.seconds / DT_S))
    seen = counted(level, "particle", ALL, walks, seeds)
    for yaw in YAWS:
        missed = ratio_over(seen[f"missed.{yaw}"], seen[f"free.{yaw}"], "share")
        metrics[f"missed.{level}.{yaw}"] = missed
        metrics |= _quantiles(f"off_share.{level}.{yaw}", SHARES, seen[f"off_share.{yaw}"], "share")
    for estimator in ESTIMATORS[level]:
        parts = [counted(level, estimator, kept, walks, seeds) for kept in SINGLE]
        for yaw, name in product(YAWS, ("error_m", "across_m")):
            together = sum(part[f"{name}.{yaw}"] for part in parts)
            metrics |= _quantiles(f"{name}.{level}.{yaw}.{estimator}", ERRORS_M, together, "m")
    return metrics


def _quantiles(key: str, bins: Bins, counts: Ints, unit: str) -> dict[str, Metric]:
    return {
        f"{key}.{name}": counted_quantile_over(bins, counts, q, unit)
        for name, q in (("median", 0.5), ("p95", 0.95))
    }


TABLE = Table(
    "facing",
    "One camera, by how the worker is turned to it",
    {
        f"{level}.{yaw}": (f"`{level}`", words)
        for level in ESTIMATORS
        for yaw, words in YAWS.items()
    },
    (
        Column("off_share.{}.median", "in the image [% of stature]", 2, 100),
        Column("missed.{}", "missed [%]", 1, 100),
        Column("error_m.{}.particle.median", "`particle` [mm]", 0, 1000),
        Column("error_m.{}.particle.p95", "95 % [mm]", 0, 1000),
        Column("across_m.{}.particle.median", "across the ray [mm]", 0, 1000),
        Column("error_m.{}.paper.median", "`paper` [mm]", 0, 1000),
    ),
    ("level", "worker"),
    "Medians, and a 95th percentile, of joints that nothing but the body itself hides. "
    "{n[missed.keypoints.0]} episodes of 10 s at `keypoints`, {n[missed.pixels.0]} at "
    "`pixels`, with 95 % intervals over episodes. In the image: while four cameras follow. "
    "The rest: where one of four is left after the first second. Missed: not sure, or more "
    "than 5 % of stature away.",
)  # fmt: skip


def make_study() -> Facing:
    """Return the experiment as the command makes it."""
    return Facing()


def main() -> int:
    """Follow, sort, write, show."""
    arguments = tyro.cli(Arguments, default=Arguments(Path("out/facing")), description=__doc__)
    facing = Facing(episodes=(12, 4)) if arguments.quick else Facing()
    run = partial(run_experiment, facing, overwrite=arguments.overwrite, engine=arguments.chosen())
    return show(run, arguments.out, "facing")


if __name__ == "__main__":
    sys.exit(show_errors(main))
