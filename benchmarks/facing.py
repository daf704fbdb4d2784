"""Accuracy of a single camera, by the direction in which the worker faces.

    python -m benchmarks.facing

The paper concludes that a single camera gives an accurate 3D pose only of people who face it. In
this study, workers with all body shapes work in view of the four cameras of the laboratory, which
record each moment from four directions. Errors are grouped by the absolute angle between the
heading of the trunk and the direction to the camera. The study measures the errors of detections in
the image of each camera while all four cameras work, and 3D errors with a single camera that
remains after the first second, which is not evaluated. Joints that furniture, robot or load hides
from the camera, or that are outside its image, are excluded; joints that the body itself hides are
included.
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
from hrc_env.evaluation.intervals import estimate_binned_quantile, estimate_clustered_share
from hrc_env.experiments.ablations.play import BODIES, Walks, make_walks
from hrc_env.experiments.cache import Part, PartCache, PartProgress
from hrc_env.experiments.columns import Column
from hrc_env.experiments.lab.sides import MISSED_CONFIDENCE, MISSED_SHARE
from hrc_env.experiments.report import Metrics, Report, Table, describe_quick_run
from hrc_env.experiments.rigs import ALL, DT_S, N_WARM_UP, SINGLE, Rig, keep_cameras
from hrc_env.experiments.runner import run_experiment
from hrc_env.experiments.versions import make_key
from hrc_env.geometry.cameras import project, projections
from hrc_env.geometry.sight import find_hidden
from hrc_env.pipeline.levels import make_pipeline
from hrc_env.pipeline.sensor_input import TrueSensorInput
from hrc_env.scene.build import build
from hrc_env.scene.rigs import RIGS
from hrc_env.worker.body import worker_truth

YAWS = {0: "faces it", 45: "45 degrees", 90: "sideways", 135: "135 degrees", 180: "turns its back"}
"""Descriptions of the ranges of angles by their centre [degrees]. The ranges are 45 degrees wide;
the first and the last are half as wide.
"""
ESTIMATORS = {"keypoints": ("particle", "paper"), "pixels": ("particle",)}
"""Estimators that are evaluated with one camera, by perception level."""
SHARES = Bins(np.geomspace(1e-4, 10, 600))
"""Bins of image errors, as fractions of the stature."""
Counts = dict[str, Any]
"""Arrays of counts by name, each with one row per episode."""


@dataclass(frozen=True, slots=True)
class Facing:
    """Experiment on the accuracy of one camera by the direction in which the worker faces."""

    name = "facing"
    depends = ("env", "tracker", "emulator", "detector", "motion")
    episodes: tuple[int, int] = (120, 12)
    """Number of episodes at the levels `keypoints` and `pixels`."""
    seconds: float = 10.0
    """Duration of an episode [s], including the first second, which is not evaluated."""
    seed: int = 3_000_000
    """Seed of the first episode; it increases by one with each further episode."""

    @property
    def seeds(self) -> Sequence[int]:
        """Seeds of the episodes."""
        return range(self.seed, self.seed + max(self.episodes))

    @property
    def n_parts(self) -> int:
        """Number of parts, one per perception level."""
        return len(ESTIMATORS)

    @property
    def quick_note(self) -> str:
        """Warning for the tables and figures of a short run, or "" if the run is long enough."""
        is_short = max(self.episodes) < max(Facing().episodes)
        return describe_quick_run(max(self.episodes), self.seconds) if is_short else ""

    def settings(self) -> dict[str, Any]:
        """Return the settings on which all results depend."""
        return asdict(self)

    def play(self, cache: PartCache) -> dict[str, Metric]:
        """Return the metrics of both perception levels, computed or from the cache."""
        key = make_key({"seconds": self.seconds, "seed": self.seed}, self.depends)
        metrics: dict[str, Metric] = {}
        parts = [
            Part(f"{level}.{n}", partial(self._measure, level, n), key)
            for level, n in zip(ESTIMATORS, self.episodes, strict=True)
        ]
        for part in cache.make_parts(parts, one_core=True):
            metrics |= {name: Metric(**metric) for name, metric in part.items()}
        return metrics

    def _measure(self, level: str, n: int, tick: PartProgress) -> dict[str, Any]:
        """Measure a perception level and return its metrics in the form of JSON."""
        return {name: asdict(m) for name, m in measure_level(level, n, self).items()}

    def metrics(self, played: dict[str, Metric]) -> dict[str, Metric]:
        """Return all metrics of the results, by name."""
        return played

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the table that this benchmark fills in the documentation."""
        return (TABLE,)

    def report(self, played: dict[str, Metric], metrics: Metrics, figures: Path) -> Report:
        """Return the report with the table."""
        return Report(
            "Accuracy of one camera by the worker's direction",
            (__doc__ or "").strip(),
            [TABLE.to_markdown(metrics)],
        )


class Frame(NamedTuple):
    """A frame of B episodes, with C evaluated cameras and J joints of one worker."""

    joints_world: Points3
    """True joints (B, J, 3) [m]."""
    eyes_world: Points3
    """Positions of the cameras (C, 3) [m]."""
    yaw: Ints
    """Index (B, C) in `YAWS` of the worker's direction relative to each camera."""
    free: Bools
    """Mask (B, C, J) of joints in the image that nothing except the body itself hides."""
    off_share: Floats
    """Error in the image, as a fraction of the stature in the image (B, C, J); NaN without a
    detection.
    """
    sure: Bools
    """Mask (B, C, J) of joints that the detector reports with high confidence."""
    estimate: PoseEstimate
    """Estimated pose after the frame."""


def iterate_frames(
    level: str, estimator: str, kept: Rig, walks: Walks, seeds: Sequence[int], ids: Ints
) -> Iterator[Frame]:
    """Yield the frames of the episodes `ids` after the warm-up, with the cameras `kept`."""
    turn, batch = keep_cameras(RIGS["lab"], kept), np.arange(len(ids))
    config = HRCConfig(worker=BODIES, faults=turn.faults)
    scene = build(config.scene, "lab", 1, walks.bodies.names)
    pipeline = make_pipeline(level, estimator, scene, len(ids), config)
    rngs = [[np.random.default_rng([seeds[b], k]) for b in ids.tolist()] for k in (2, 3)]
    cameras = [scene.cameras[c] for c in kept]
    eyes, P = np.stack([camera.eye_world for camera in cameras]), projections(tuple(cameras))
    size = np.array([(camera.width_px, camera.height_px) for camera in cameras])[:, None]
    focal = np.array([camera.K[0, 0] for camera in cameras])[:, None]
    with closing(pipeline):
        pipeline.reset(batch, *rngs)
        for t, motions in enumerate(walks.motions):
            motion, q = rows(motions, ids), walks.q[ids]
            truth = worker_truth(walks.bodies, motion)
            present = np.ones((len(ids), 1), bool)
            pipeline.sensor.expose(TrueSensorInput(batch, q, motion, truth, present))
            estimate = pipeline.perceive(batch, *rngs)
            if t < N_WARM_UP:
                continue
            joints = truth.joints_world[:, 0]
            px, depth_m = project(P, joints)
            keypoints = pipeline.keypoints
            sure = keypoints.confidence[:, kept, 0] >= MISSED_CONFIDENCE
            off_px = np.linalg.norm(keypoints.px[:, kept, 0] - px, axis=-1)
            stature_m = walks.bodies.stature_m[motion.body[:, 0]][:, None, None]
            inside = (depth_m > 0) & ((px > 0) & (px < size)).all(-1)
            free = inside & ~find_hidden(scene.surroundings(q, motion.held), eyes, joints)
            share = off_px * depth_m / (focal * stature_m)
            yield Frame(joints, eyes, find_yaw(joints, eyes), free, share, sure, estimate)


def find_yaw(joints_world: Points3, eyes_world: Points3) -> Ints:
    """Return the index (B, C) in `YAWS` of bodies (B, J, 3) as seen from cameras (C, 3)."""
    to_eye = eyes_world - joints_world[:, None, TORSO].mean(2)
    turn = heading(joints_world)[:, None] - np.arctan2(to_eye[..., 1], to_eye[..., 0])
    return np.rint(np.abs((turn + np.pi) % (2 * np.pi) - np.pi) / np.radians(45)).astype(int)


def count_errors(
    level: str, estimator: str, kept: Rig, walks: Walks, seeds: Sequence[int]
) -> Counts:
    """Count errors and joints by "<name>.<yaw>", with one row per episode.

    With all cameras, all episodes are simulated; with a single camera, every fourth one.
    """
    ids, counts = np.arange(len(seeds)), Counts()
    if len(kept) == 1:
        ids = ids[kept[0] :: len(SINGLE)]
    for frame in iterate_frames(level, estimator, kept, walks, seeds, ids):
        ray = frame.joints_world[:, None] - frame.eyes_world[:, None]
        ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
        off = (frame.estimate.mean_world[:, 0] - frame.joints_world)[:, None]
        across = np.linalg.norm(off - (off * ray).sum(-1, keepdims=True) * ray, axis=-1)
        error = np.broadcast_to(np.linalg.norm(off, axis=-1), across.shape)
        missed = ~(frame.sure & (frame.off_share <= MISSED_SHARE))
        for k, yaw in enumerate(YAWS):
            here = frame.free & (frame.yaw == k)[..., None]
            is_found = here & np.isfinite(frame.off_share)
            for name, values in (
                ("free", here.sum((1, 2))),
                ("missed", (here & missed).sum((1, 2))),
                ("off_share", SHARES.count(frame.off_share, is_found)),
                ("error_m", ERRORS_M.count(error, here)),
                ("across_m", ERRORS_M.count(across, here)),
            ):
                empty = np.zeros((len(seeds), *values.shape[1:]), np.int64)
                counts.setdefault(f"{name}.{yaw}", empty)[ids] += values
    return counts


def measure_level(level: str, n_episodes: int, facing: Facing) -> dict[str, Metric]:
    """Compute the metrics of a perception level, with confidence intervals over episodes."""
    seeds, metrics = tuple(range(facing.seed, facing.seed + n_episodes)), {}
    walks = make_walks("lab", 1, seeds, round(facing.seconds / DT_S))
    seen = count_errors(level, "particle", ALL, walks, seeds)
    for yaw in YAWS:
        missed = estimate_clustered_share(seen[f"missed.{yaw}"], seen[f"free.{yaw}"])
        metrics[f"missed.{level}.{yaw}"] = missed
        metrics |= _measure_quantiles(
            f"off_share.{level}.{yaw}", SHARES, seen[f"off_share.{yaw}"], "share"
        )
    for estimator in ESTIMATORS[level]:
        parts = [count_errors(level, estimator, kept, walks, seeds) for kept in SINGLE]
        for yaw, name in product(YAWS, ("error_m", "across_m")):
            together = sum(part[f"{name}.{yaw}"] for part in parts)
            metrics |= _measure_quantiles(
                f"{name}.{level}.{yaw}.{estimator}", ERRORS_M, together, "m"
            )
    return metrics


def _measure_quantiles(key: str, bins: Bins, counts: Ints, unit: str) -> dict[str, Metric]:
    return {
        f"{key}.{name}": estimate_binned_quantile(bins, counts, q, unit)
        for name, q in (("median", 0.5), ("p95", 0.95))
    }


TABLE = Table(
    "facing",
    "Accuracy of one camera by the worker's direction",
    {
        f"{level}.{yaw}": (f"`{level}`", words)
        for level in ESTIMATORS
        for yaw, words in YAWS.items()
    },
    (
        Column("off_share.{}.median", "image error [% of stature]", 2, 100),
        Column("missed.{}", "missed [%]", 1, 100),
        Column("error_m.{}.particle.median", "`particle`, median [mm]", 0, 1000),
        Column("error_m.{}.particle.p95", "95 % [mm]", 0, 1000),
        Column("across_m.{}.particle.median", "across the ray, median [mm]", 0, 1000),
        Column("error_m.{}.paper.median", "`paper`, median [mm]", 0, 1000),
    ),
    ("level", "worker"),
    "{n[missed.keypoints.0]} episodes of 10 s at `keypoints` and {n[missed.pixels.0]} at `pixels`; "
    "95 % intervals over episodes. Joints count if only the body itself hides them from the "
    "camera. Image error and missed joints are those of detections while all four cameras work; a "
    "joint is missed if its confidence is low or its image error exceeds 5 % of the stature. The "
    "other columns are errors in space while one of the four cameras works.",
)  # fmt: skip


def make_study() -> Facing:
    """Return the experiment with default settings."""
    return Facing()


def main() -> int:
    """Run the experiment and print its report; return the exit status."""
    arguments = tyro.cli(Arguments, default=Arguments(Path("out/facing")), description=__doc__)
    facing = Facing(episodes=(12, 4)) if arguments.quick else Facing()
    run = partial(
        run_experiment, facing, overwrite=arguments.overwrite, engine=arguments.choose_engine()
    )
    return show(run, arguments.out, "facing")


if __name__ == "__main__":
    sys.exit(show_errors(main))
