"""The report of the perception benchmark."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks.common import list_endings
from benchmarks.perception.declaration import (
    ACCURACY,
    DETECTED,
    EMULATOR,
    ERROR_SHARE,
    FAULTS,
    LASTING,
    LEVELS,
    NAMED,
    SPEED,
    belief,
    make_fault_columns,
)
from benchmarks.perception.speed import REST, STAGES
from benchmarks.perception.views import ROWS
from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import Metrics, Report, format_metrics

_LEAD = """\
Intervals of shares are exact. The level is `pixels` unless stated otherwise; every camera takes an
image in every step."""
_ABOUT_SPEED = """\
Steps per second are those of the median step. The times of the stages were measured in other steps,
on the thread that steps: `detect` is the network and the wait for it. The runtime is LiteRT unless
stated otherwise."""
_ABOUT_ERRORS = """\
The arm rests. Errors are those of single joints in 3D while the worker is tracked. Coverage is the
share of joints within the reported 95 % region; std/error is the reported standard deviation over
the root mean square of the error. Rows of poses include all scenes."""
_ABOUT_FAULTS = """\
One camera has the fault during the whole episode; episodes rotate over the cameras. The ratio is
the median error with the fault over that without it, on the same seeds. `keypoints` does not
simulate faults of images."""
_ABOUT_CROPS = """\
Crops around the true joints that show the whole worker, each detected without a previous track.
Errors are mean distances of a crop's joints from the truth in the image, in % of stature."""
_ABOUT_THE_EMULATOR = """\
Error of the estimate at `keypoints` over that at `pixels`, on clips and viewpoints that the
emulator's calibration has not seen, by family of motions (`assets.emulator`)."""


def report(config: Any, found: Any, metrics: Metrics, figures: Path) -> Report:
    """Return the report, with its tables and figures.

    Args:
        config: settings of the benchmark (unused).
        found: parts of the benchmark (unused).
        metrics: metrics by name.
        figures: folder of figures (unused).
    """
    del config, found, figures
    kinds = {kind: words for kind, (words,) in FAULTS.items()}
    views = {
        f"{kind}.{row}": f"{kind}: {row.replace('_', ' ')}"
        for kind in ROWS
        for row in list_endings(metrics, f"detected.{kind}.")
    }
    paces = {name: name for name in list_endings(metrics, "steps_per_s.")}
    names = list_endings(metrics, "lost_steps.")
    estimates = {name: name.replace(".", ": ") for name in names if not name.startswith("fault.")}
    faults = [
        each
        for level in LEVELS
        for name, each in make_fault_columns(level).items()
        if name != "lost"
    ]
    stages = [Column(f"stage_ms.{each}.{{}}", f"{each} [ms]") for each in (*STAGES, REST)]
    less = Column(
        "emulator_coverage_difference.{}", "coverage minus that of pixels", 3, signed=True
    )
    parts = (
        "## Speed", SPEED.to_markdown(metrics),
        format_metrics("cameras.workers", paces, [Column("steps_per_s.{}", "steps [1/s]"), *stages],
                 metrics),
        _ABOUT_SPEED,
        "## Error of the estimate", ACCURACY.to_markdown(metrics),
        format_metrics("", estimates, [*belief().values()], metrics), _ABOUT_ERRORS,
        "## Faults of one of four cameras, lab",
        format_metrics("", kinds, faults, metrics), _ABOUT_FAULTS,
        "## Cameras named as miscalibrated", replace(NAMED, rows=FAULTS).to_markdown(metrics),
        "## Single crops", format_metrics("", views, [
            DETECTED, ERROR_SHARE, Column("error_share.{}.p95", "95 % [% of stature]", 1, 100),
        ], metrics), _ABOUT_CROPS,
        "## Comparison of emulator and pixels",
        replace(EMULATOR, columns=(*EMULATOR.columns, less)).to_markdown(metrics),
        LASTING.to_markdown(metrics), _ABOUT_THE_EMULATOR,
    )  # fmt: skip
    spread = "95 % intervals over episodes, crops or clips"
    return Report("Perception bench", _LEAD, [*filter(None, parts)], spread)
