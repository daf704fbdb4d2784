"""The perception bench as people read it."""

from pathlib import Path
from typing import Any

from benchmarks.common import keys
from benchmarks.perception.speed import REST, STAGES
from benchmarks.perception.views import ROWS
from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import Metrics, Report, table_of
from hrc_env.perception.faults.fault import KINDS

_LEAD = """\
Intervals of shares are exact. Level `pixels` unless it says otherwise; every camera looks in every
step."""
_ABOUT_SPEED = """\
Steps a second are of the median step; the milliseconds of each stage were taken in steps of their
own, on the thread that steps: `detect` is the network and waiting for it. On LiteRT unless
something else stands there. The network alone takes four crops on two threads in """
_ABOUT_ERRORS = """\
The arm rests. Errors are of single joints in 3D while the worker is tracked; coverage is the share
of joints inside the reported 95 % region, and the deviation that is reported is set beside the
root mean square of the error. Rows by pose are of all scenes."""
_ABOUT_FAULTS = """\
The cameras have the fault in turns, all the time. The ratio is that of median errors with and
without it on the same seeds. `keypoints` knows no faults of images."""
_ABOUT_NAMED = """\
Percent of episodes in which the camera with the fault is named in
`info["perception/miscalibrated"]`, after how long (the median), and percent of steps in which
another one is."""
_ABOUT_CROPS = """\
Crops round the true joints with the whole worker in view, looked at as if for the first time.
Errors are mean distances of a crop's joints from the truth in the image, in % of stature."""
_ABOUT_THE_EMULATOR = """\
Error of the estimate at `keypoints` over that at `pixels`, on clips and viewpoints that the
emulator's calibration has not seen, by family of motions (`assets.emulator`)."""
_LEVELS = {"": "", "keypoints.": "`keypoints`: "}
"""What begins the keys and the headings of each level's columns."""


def report(config: Any, found: Any, metrics: Metrics, figures: Path) -> Report:
    """What is to be read."""
    del config, found, figures
    kinds = {kind: f"`{kind}`" for kind in KINDS if f"error_ratio.{kind}" in metrics}
    views = {
        f"{kind}.{row}": f"{kind}: {row.replace('_', ' ')}"
        for kind in ROWS
        for row in keys(metrics, f"detected.{kind}.")
    }
    every = {"none": "no fault", **kinds}
    families = {name: name for name in keys(metrics, "emulator_coverage_difference.")}
    return Report("Perception bench", _LEAD, (
        "## Speed", table_of("cameras.workers", _named(metrics, "steps_per_s."), [
            Column("steps_per_s.{}", "steps a second"),
            *(Column(f"stage_ms.{stage}.{{}}", f"{stage} [ms]") for stage in (*STAGES, REST)),
        ], metrics),
        _ABOUT_SPEED + ", ".join(f"{metrics[f'network_ms.{name}'].value:.1f} ms ({name})"
                                 for name in keys(metrics, "network_ms.")) + ".",
        "## Error of the estimate", table_of("", _estimates(metrics), _belief_columns(), metrics),
        _ABOUT_ERRORS,
        "## Faults of one of four cameras, lab", fault_table(every, metrics), _ABOUT_FAULTS,
        "## Cameras named as miscalibrated", table_of("", every, [
            Column(f"{start}miscalibrated.{{}}.{key}", words + title, 1, scale)
            for start, words in _LEVELS.items() for key, title, scale in (
                ("named", "named [%]", 100), ("after_s", "after [s]", 1),
                ("others", "others [%]", 100))
        ], metrics), _ABOUT_NAMED,
        "## Single crops", table_of("", views, [
            Column("detected.{}", "detected [%]", 1, 100),
            Column("error_share.{}.median", "median error [%]", 1, 100),
            Column("error_share.{}.p95", "p95 [%]", 1, 100),
        ], metrics), _ABOUT_CROPS,
        "## The emulator beside the pixels", table_of("", families, [
            Column("emulator_error_ratio.{}", "median", 2),
            Column("emulator_error_ratio.{}.p95", "p95", 2),
            Column("emulator_coverage_difference.{}", "coverage less pixels'", 3, signed=True),
        ], metrics), _ABOUT_THE_EMULATOR,
    ), "95 % intervals over episodes, crops or clips")  # fmt: skip


def _named(metrics: Metrics, start: str) -> dict[str, str]:
    return {name: name.replace("_", " ") for name in keys(metrics, start)}


def _estimates(metrics: Metrics) -> dict[str, str]:
    names = keys(metrics, "lost_steps.")
    return {name: name.replace(".", ": ") for name in names if not name.startswith("fault.")}


def _belief_columns(start: str = "", words: str = "", row: str = "{}") -> list[Column]:
    """Of an estimate's error and what it says of it."""
    return [
        Column(f"{start}error_m.{row}.median", f"{words}median [mm]", 1, 1000),
        Column(f"{start}error_m.{row}.p95", f"{words}p95 [mm]", 0, 1000),
        Column(f"{start}coverage95.{row}", f"{words}coverage", 2),
        Column(f"{start}std_over_error.{row}", f"{words}std/error", 2),
        Column(f"{start}lost_steps.{row}", f"{words}steps lost [%]", 1, 100),
    ]


def fault_table(kinds: dict[str, str], metrics: Metrics) -> str:
    """A row for every fault."""
    columns = []
    for start, words in _LEVELS.items():
        columns.append(Column(f"{start}error_ratio.{{}}", f"{words}ratio", 2))
        columns += _belief_columns(start, words, "fault.{}")[:4]
        columns.append(Column(f"{start}detected.fault.{{}}", f"{words}seen by it [%]", 0, 100))
    return table_of("", kinds, columns, metrics)
