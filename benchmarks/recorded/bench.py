"""The tracking bench on real footage: every estimator on the same detections."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path

from benchmarks.recorded.calibration import read_calibration, tracker_config
from benchmarks.recorded.detections import FOLLOWER, Detections, detections_of
from benchmarks.recorded.fetch import WHEEL, fetch_footage
from benchmarks.recorded.film import film_track
from benchmarks.recorded.films import Films
from benchmarks.recorded.lag import lag_of
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
from hrc_env.core.results import Metric, write_results
from hrc_env.core.typing import Floats
from hrc_env.geometry.cameras import projections
from hrc_env.tracking.config import TrackerConfig

Say = Callable[[float, str], None]
"""Told by how much the share that is done grew, and what is being done."""
_DETECTING, _ESTIMATING, _FILMING = 0.35, 0.35, 0.25


def run(out: Path, say: Say) -> dict[str, Metric]:
    """Run on the footage; writes results.json, real.md, real.mp4 and detections.npz into `out`.

    Args:
        out: a folder; detections that are there already are not made again.
        say: hears of the progress: shares that sum to 1.

    Raises:
        DownloadError: the footage is not there and cannot be fetched.
        WeightsError: the pose network's weights are not there.
    """
    footage = fetch_footage(lambda sentence: say(0.0, sentence))
    say(0.05, "looking at the films")
    films = Films(footage.films)
    try:
        cameras = read_calibration(footage.calibration, films.sizes_px)
        detections = detections_of(
            films,
            cameras,
            out / "detections.npz",
            lambda share: say(_DETECTING * share, "looking at the films"),
        )
    finally:
        films.close()
    pinholes = [camera.pinhole for camera in cameras]
    P, config = projections(tuple(pinholes)), tracker_config(pinholes)
    lags = lag_of(P, detections)
    in_step = detections.shifted(lags)
    metrics: dict[str, Metric] = {}
    for name in NAMES:
        say(_ESTIMATING / len(NAMES), name)
        metrics |= _of_estimator(name, P, config, detections, in_step)
    for camera, lag in zip(pinholes, lags, strict=True):
        metrics[f"real_lag_frames.{camera.name}"] = Metric(lag, lag, lag, "frames", 1)
    settings = {
        "footage": WHEEL,
        "follower": FOLLOWER,
        "dt_s": detections.dt_s,
        "tracker": asdict(config),
    }
    write_results(out / "results.json", settings, [0], dict(sorted(metrics.items())))
    (out / "real.md").write_text(markdown(metrics, NAMES))
    track = follow(DEFAULT, P, config, in_step, list(range(len(P))))
    film_track(
        out / "real.mp4",
        footage.films,
        pinholes,
        lags,
        track,
        lambda share: say(_FILMING * share, "drawing the film"),
    )
    return metrics


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


def markdown(metrics: Mapping[str, Metric], names: list[str]) -> str:
    """The table, a row an estimator, and what it says."""
    lags = [
        f"{name.rsplit('.', 1)[1]} {metric.value:+.0f}"
        for name, metric in metrics.items()
        if name.startswith("real_lag_frames.")
    ]
    header = ["", *(title for title, *_ in _COLUMNS)]
    rows = [[name, *(_cell(metrics, column, name) for column in _COLUMNS)] for name in names]
    rule = ["---", *["---:"] * len(_COLUMNS)]
    table = "\n".join("| " + " | ".join(row) + " |" for row in (header, rule, *rows))
    return (
        "# Tracking on real footage\n\n"
        "Leave-one-camera-out reprojection [px], median / 95th percentile; `renamed`: where it "
        "fits better, the held-out detector is taken to have exchanged left and right; `in "
        "step`: frames shifted by the lags below. Coverage: share of held-out detections within "
        "the 95 % region of belief and detector. Bones and jerk with all cameras; the last "
        "column is the mean share of frames in which two cameras, any pair, kept all joints "
        "fresh. The smoother is offline: it sees the whole recording at once.\n\n"
        f"{table}\n\n"
        f"Lag in frames: {', '.join(lags)}.\n"
    )


_Column = tuple[str, tuple[str, ...], float, int]
_COLUMNS: tuple[_Column, ...] = (
    ("reprojection", ("real_reprojection_px.{}.median", "real_reprojection_px.{}.p95"), 1, 1),
    (
        "renamed",
        ("real_reprojection_either_px.{}.median", "real_reprojection_either_px.{}.p95"),
        1,
        1,
    ),
    (
        "in step",
        ("real_in_step_reprojection_px.{}.median", "real_in_step_reprojection_px.{}.p95"),
        1,
        1,
    ),
    ("coverage", ("real_coverage95.{}",), 1, 3),
    ("bone std [cm]", ("real_bone_std_m.{}",), 100, 2),
    ("jerk [m/s³]", ("real_jerk.{}",), 1, 0),
    ("two cameras", ("real_two_camera_share.{}",), 1, 3),
)


def _cell(metrics: Mapping[str, Metric], column: _Column, name: str) -> str:
    _, keys, scale, digits = column
    return " / ".join(f"{scale * metrics[key.format(name)].value:.{digits}f}" for key in keys)
