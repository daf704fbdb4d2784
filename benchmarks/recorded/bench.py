"""The tracking benchmark on recorded videos, with the same detections for all estimators."""

from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from benchmarks.recorded.calibration import read_calibration, tracker_config
from benchmarks.recorded.detections import FOLLOWER, Detections, make_detections
from benchmarks.recorded.fetch import POSE2SIM, fetch_recording
from benchmarks.recorded.films import Films
from benchmarks.recorded.metrics import (
    NAMES,
    SMOOTHER,
    bone_std,
    follow,
    foretell,
    jerk,
    summarize_foretold,
)
from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats
from hrc_env.experiments.cache import PartCache
from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import Metrics, Report, Table
from hrc_env.geometry.cameras import projections
from hrc_env.tracking.config import TrackerConfig

_DETECTING = 0.5
"""Fraction of the total progress that is assigned to detection."""
_LEAD = """\
Leave-one-camera-out reprojection [px]; best of both sides: where it fits better, left and right of
the held-out detections are exchanged. Coverage: share of held-out detections within the 95 % region
of estimate and detector. Bones and jerk are those with all cameras. The smoother is offline: it
uses the whole recording."""
FOOTAGE = Table(
    "footage",
    "Recorded footage",
    {name: (f"`{name}`",) for name in NAMES},
    (
        Column("real_reprojection_px.{}.median", "held-out camera, median [px]"),
        Column("real_reprojection_px.{}.p95", "95 % [px]", 0),
        Column("real_reprojection_either_px.{}.median", "best of both sides, median [px]"),
        Column("real_reprojection_either_px.{}.p95", "95 % [px]", 0),
        Column("real_coverage95.{}", "coverage", 3),
        Column("real_bone_std_m.{}", "std of bones [cm]", 2, 100),
        Column("real_jerk.{}", "jerk [m/s³]", 0),
    ),
    ("estimator",),
    "100 frames at 60 Hz of one person (`Demo_SinglePerson` of Pose2Sim); all estimators receive "
    "the same detections. Each of the four cameras in turn is held out, and its detections are "
    "compared with the estimate from the other three: median and 95th percentile of the distance, "
    "also with left and right exchanged where that fits better, and coverage of the 95 % region. "
    "Standard deviation of bone lengths and jerk (root mean square of the third derivative) are of "
    f"the estimate from all cameras. `{SMOOTHER}` is offline.",
)


@dataclass(frozen=True, slots=True)
class RecordedBench:
    """Benchmark of the estimators on a recorded sequence. It has no configurable settings."""

    name = "bench recorded"
    depends = ("tracker", "detector")
    seeds = (0,)
    n_parts = 1

    def settings(self) -> dict[str, Any]:
        """Return the settings on which all results depend."""
        return {"recording": POSE2SIM.requirement, "follower": FOLLOWER}

    def play(self, cache: PartCache) -> dict[str, Metric]:
        """Run all estimators on the detections of the person, which are computed or from the cache.

        The recording is downloaded if it is missing.

        Raises:
            DownloadError: the recording is missing and cannot be downloaded.
            WeightsError: the weights of the pose network are missing.
        """
        recording = fetch_recording(lambda sentence: cache.progress(0.0, sentence))
        with closing(Films(recording.films)) as films:
            cameras = read_calibration(recording.calibration, films.sizes_px)
            detections = make_detections(films, cameras, replace(cache, n_parts=1 / _DETECTING))
        pinholes = [replace(camera, lens=None) for camera in cameras]
        P, tracker = projections(tuple(pinholes)), tracker_config(pinholes)
        metrics: dict[str, Metric] = {}
        for name in NAMES:
            metrics |= _of_estimator(name, P, tracker, detections)
            cache.progress((1 - _DETECTING) / len(NAMES), name)
        return dict(sorted(metrics.items()))

    def metrics(self, played: dict[str, Metric]) -> dict[str, Metric]:
        """Return all metrics of the results, by name."""
        return played

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the table that this benchmark fills in the documentation."""
        return (FOOTAGE,)

    def report(self, played: dict[str, Metric], metrics: Metrics, figures: Path) -> Report:
        """Return the report, with its tables and figures."""
        return report(metrics)


def _of_estimator(
    name: str, P: Floats, config: TrackerConfig, detections: Detections
) -> dict[str, Metric]:
    """Compute the metrics of one estimator."""
    metrics = {}
    for kind, metric in summarize_foretold(foretell(name, P, config, detections)).items():
        measure, *part = kind.split(".")
        label = f"reprojection_{measure}" if part else measure
        metrics[".".join([f"real_{label}", name, *part])] = metric
    track = follow(name, P, config, detections, list(range(len(P))))
    metrics[f"real_bone_std_m.{name}"] = bone_std(track)
    metrics[f"real_jerk.{name}"] = jerk(track, detections.dt_s)
    return metrics


def report(metrics: Metrics) -> Report:
    """Return the report, with one row per estimator."""
    parts = [FOOTAGE.to_markdown(metrics)]
    spread = "95 % intervals over blocks of frames, those of bones and jerk with least and largest"
    return Report("Tracking on recorded films", _LEAD, parts, spread)
