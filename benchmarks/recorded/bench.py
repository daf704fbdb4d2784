"""The tracking bench on recorded films: every estimator on the same detections."""

from dataclasses import replace
from pathlib import Path

from benchmarks.common import exactly
from benchmarks.recorded.calibration import read_calibration, tracker_config
from benchmarks.recorded.detections import FOLLOWER, Detections, detections_of, lag_of
from benchmarks.recorded.fetch import WHEEL, fetch_recording
from benchmarks.recorded.film import film_track
from benchmarks.recorded.films import Films
from benchmarks.recorded.metrics import (
    NAMES,
    bone_std,
    follow,
    foretell,
    foretold_metrics,
    jerk,
    two_camera_share,
)
from benchmarks.tracking.names import DEFAULT
from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats
from hrc_env.experiments.study.cache import PartCache
from hrc_env.experiments.study.report import Column, Metrics, Report, picture, table_of
from hrc_env.experiments.study.runner import Study
from hrc_env.geometry.cameras import projections
from hrc_env.tracking.config import TrackerConfig

FILM = "recorded.mp4"
_DETECTING, _ESTIMATING, _FILMING = 0.35, 0.35, 0.25
_LEAD = """\
Leave-one-camera-out reprojection [px]; `renamed`: where it fits better, the held-out detector is
taken to have exchanged left and right; `in step`: frames shifted by the lags below. Coverage: share
of held-out detections within the 95 % region of belief and detector. Bones and jerk with all
cameras; the last column is the mean share of frames in which two cameras, any pair, kept all joints
fresh. The smoother is offline: it sees the whole recording at once. Intervals are of blocks of
frames; of bones, jerk and pairs of cameras, the least and the largest."""
_COLUMNS = [
    *(
        Column(f"real_{kind}_px.{{}}.{part}", f"{words}{part}")
        for kind, words in (
            ("reprojection", ""),
            ("reprojection_either", "renamed, "),
            ("in_step_reprojection", "in step, "),
        )
        for part in ("median", "p95")
    ),
    Column("real_coverage95.{}", "coverage", 3),
    Column("real_bone_std_m.{}", "bone std [cm]", 2, 100),
    Column("real_jerk.{}", "jerk [m/s³]", 0),
    Column("real_two_camera_share.{}", "two cameras", 3),
]


def play(config: None, parts: PartCache) -> dict[str, Metric]:
    """Fetch, detect, estimate, film; detections that are there already are not made again.

    Raises:
        DownloadError: the recording is not there and cannot be fetched.
        WeightsError: the pose network's weights are not there.
    """
    recording = fetch_recording(lambda sentence: parts.progress(0.0, sentence))
    parts.progress(0.05, "detecting")
    films = Films(recording.films)
    try:
        cameras = read_calibration(recording.calibration, films.sizes_px)
        detections = detections_of(
            films,
            cameras,
            parts.folder / "detections.npz",
            lambda share: parts.progress(_DETECTING * share, "detecting"),
        )
    finally:
        films.close()
    pinholes = [replace(camera, lens=None) for camera in cameras]
    P, tracker = projections(tuple(pinholes)), tracker_config(pinholes)
    lags = lag_of(P, detections)
    in_step = detections.shifted(lags)
    metrics: dict[str, Metric] = {}
    for name in NAMES:
        parts.progress(_ESTIMATING / len(NAMES), name)
        metrics |= _of_estimator(name, P, tracker, detections, in_step)
    for camera, lag in zip(pinholes, lags, strict=True):
        metrics[f"real_lag_frames.{camera.name}"] = exactly(lag, "frames")
    film_track(
        parts.folder.parent / "figures" / FILM,
        recording.films,
        pinholes,
        lags,
        follow(DEFAULT, P, tracker, in_step, list(range(len(P)))),
        lambda share: parts.progress(_FILMING * share, "drawing the film"),
    )
    return dict(sorted(metrics.items()))


def _of_estimator(
    name: str, P: Floats, config: TrackerConfig, recorded: Detections, in_step: Detections
) -> dict[str, Metric]:
    """Everything about one estimator: on frames as recorded, and its errors with these in step."""
    metrics = {}
    for step, detections in (("", recorded), ("in_step_", in_step)):
        for kind, metric in foretold_metrics(foretell(name, P, config, detections)).items():
            measure, *part = kind.split(".")
            label = f"reprojection_{measure}" if part else measure
            metrics[".".join([f"real_{step}{label}", name, *part])] = metric
    track = follow(name, P, config, recorded, list(range(len(P))))
    metrics[f"real_bone_std_m.{name}"] = bone_std(track)
    metrics[f"real_jerk.{name}"] = jerk(track, recorded.dt_s)
    metrics[f"real_two_camera_share.{name}"] = two_camera_share(name, P, config, recorded)
    return metrics


def report(metrics: Metrics, figures: Path) -> Report:
    """The table, a row an estimator, and what it says; the film is there."""
    lags = [
        f"{name.rsplit('.', 1)[1]} {metric.value:+.0f}"
        for name, metric in metrics.items()
        if name.startswith("real_lag_frames.")
    ]
    return Report("Tracking on recorded films", _LEAD, [
        table_of("", {name: name for name in NAMES}, _COLUMNS, metrics),
        f"Lag in frames: {', '.join(lags)}.",
        picture(figures / Path(FILM).with_suffix(".png"), f"The middle frame of {FILM}."),
    ], "95 % intervals over stretches of the film, or the smallest and the largest")  # fmt: skip


RECORDED = Study(
    name="bench recorded",
    modules=("benchmarks.recorded.metrics",),
    settings=lambda _: {"recording": WHEEL, "follower": FOLLOWER},
    seeds=lambda _: [0],
    n_parts=lambda _: 1,
    play=play,
    metrics=lambda _, played: played,
    report=lambda _, played, *rest: report(*rest),
)
