"""The tracking bench as people read it: Markdown tables, and two plots beside them."""

from collections.abc import Mapping
from pathlib import Path

from benchmarks.tracking.metrics import Parts
from benchmarks.tracking.names import (
    DEFAULT,
    DLT,
    RIVALS,
    SMOOTHER,
    UNBUFFERED,
    names_of,
    rows,
)
from benchmarks.tracking.plots import plot_calibration, plot_error
from benchmarks.tracking.rigs import RIGS
from benchmarks.tracking.sequences import BOUNDED, LATE, MATCHED, TWO_WORKERS
from hrc_env.core.results import Metric
from hrc_env.tracking.estimators import ESTIMATORS

_Metrics = Mapping[str, Metric]
_Row = tuple[str, list[str]]


def write_report(out: Path, parts: Parts, metrics: _Metrics) -> None:
    """Write tracking.md, error_by_views.png and calibration.png into `out`."""
    (out / "tracking.md").write_text(markdown(metrics))
    plot_error(out / "error_by_views.png", parts)
    plot_calibration(out / "calibration.png", parts)


def markdown(metrics: _Metrics) -> str:
    """The tables: the default beside the best of the others first, then everything."""
    blocks = [
        "# Tracking bench",
        _INTRODUCTION,
        f"## {DEFAULT}, the default, and the best of the others that know no later frames",
        _lead(metrics),
        _beaten(metrics),
        "## RMSE / posterior Cramer-Rao bound",
        _bound(metrics),
        _ABOUT_THE_BOUND,
        "## Microseconds per worker and update, one core",
        _cost(metrics),
        "## RMSE in cm",
        _table(metrics, "rmse_m", 100, 2, True),
        "## Median error in cm",
        _table(metrics, "median_m", 100, 2),
        "## Coverage of the reported 95 % region",
        _table(metrics, "coverage95", 1, 3),
        "## Reported standard deviation / RMSE",
        _table(metrics, "std_over_rmse", 1, 2),
        "## Normalised estimation error squared per degree of freedom",
        _table(metrics, "nees", 1, 2),
        "## Calibration gap",
        "The largest difference between the share of joints that the reported regions of "
        "5, 10, ... 95 % hold and what they claim.",
        _table(metrics, "calibration_gap", 1, 3),
        "## Percent of frames in which the torso faces the wrong way",
        _table(metrics, "facing_wrong", 100, 2),
        "## After one camera",
        _returns(metrics),
        "## Late frames",
        _late(metrics),
        "## Two workers: changes of identity per 100 sequences",
        _swaps(metrics),
    ]
    return "\n\n".join(blocks) + "\n"


_INTRODUCTION = f"""\
Numbers in brackets are 95 % bootstrap intervals over sequences. `lab` and `site` are the bench's
own walkers and white detections of 3 px; `own` is the environment's worker seen through its
emulator of the detector. `hard` is occlusion, gross errors and exchanged sides; in `drifting`
detections err in the same way for half a second, of which nobody is told. `one_camera_...` are
the first half second, second and two seconds of the four in which one camera is left,
`after_return` is what comes a second later. `{DLT}` is plain triangulation of every frame by
itself; `{SMOOTHER}` knows the whole clip and is no rival."""
_ABOUT_THE_BOUND = """\
`matched` bodies move as the estimators' motion model says, without bones; estimators are told so
(no outliers, no exchanged sides, detections as good as they say, nothing known of bone lengths),
and still learn the joints'
places on the body. `matched_bones` have bones, to which no estimator is matched; the bound knows
the bones' directions, which nobody else can, so that it is out of reach by a second order even
for `full_state`, which filters all 90 states with the model the sequences were drawn from. The
bound is that of each drawn sequence, averaged."""


def _lead(metrics: _Metrics) -> str:
    """The default, row by row, beside the paper's algorithm and the best of the others."""
    lines = []
    for rig, _, window in rows():
        key = f"{rig}.{window}"
        best = _best(metrics, key)
        ratio = metrics[f"default_over.{key}.{best}"]
        lines.append(
            (
                f"{rig} {window}",
                [
                    _cell(metrics[f"rmse_m.{key}.{DEFAULT}"], 100, 2, True),
                    _cell(metrics[f"coverage95.{key}.{DEFAULT}"], 1, 3),
                    _cell(metrics[f"std_over_rmse.{key}.{DEFAULT}"], 1, 2),
                    _cell(metrics[f"rmse_m.{key}.paper"], 100, 2),
                    f"{_cell(metrics[f'rmse_m.{key}.{best}'], 100, 2)} {best}",
                    _cell(ratio, 1, 3, True),
                ],
            )
        )
    header = ["RMSE, cm", "coverage", "std/RMSE", "paper, cm", "best other, cm", "default / best"]
    return _lines(header, lines)


def _best(metrics: _Metrics, key: str) -> str:
    """The rival with the least error in a row."""
    return min(RIVALS, key=lambda name: metrics[f"rmse_m.{key}.{name}"].value)


def _beaten(metrics: _Metrics) -> str:
    """Where another is below the default, and whether by more than chance."""
    said = []
    for rig, _, window in rows():
        for name in RIVALS:
            ratio = metrics[f"default_over.{rig}.{window}.{name}"]
            if ratio.value > 1:
                surely = "" if ratio.low > 1 else ", the interval holds 1"
                said.append(f"- {rig} {window}: {name}, default {ratio.value:.3f} x{surely}")
    if not said:
        return f"`{DEFAULT}` has the least error in every row."
    return f"Where another's error is less than that of `{DEFAULT}`:\n\n" + "\n".join(said)


def _table(metrics: _Metrics, kind: str, scale: float, digits: int, interval: bool = False) -> str:
    """One row per rig and window, one column per estimator; what is not known is left empty."""
    names = [DEFAULT, *RIVALS, SMOOTHER]
    lines = []
    for rig, _, window in rows():
        found = [metrics.get(f"{kind}.{rig}.{window}.{name}") for name in names]
        cells = ["" if m is None else _cell(m, scale, digits, interval) for m in found]
        lines.append((f"{rig} {window}", cells))
    return _lines(names, lines)


def _bound(metrics: _Metrics) -> str:
    names = names_of(RIGS[0], MATCHED)
    lines = []
    for condition, kind in zip(BOUNDED, ("ratio_to_bound", "ratio_to_bound_bones"), strict=True):
        ratios = [_cell(metrics[f"{kind}.{name}"], 1, 3, True) for name in names]
        lines.append((f"{condition}, both rigs", ratios))
        for rig in RIGS:
            ratios = [_cell(metrics[f"{kind}_in.{rig}.{name}"], 1, 3, True) for name in names]
            lines.append((f"{condition}, {rig}", ratios))
            found = [metrics.get(f"coverage95.{rig}.{condition}.{name}") for name in names]
            lines.append(
                (
                    f"{condition}, {rig}: coverage",
                    ["" if m is None else _cell(m, 1, 3, True) for m in found],
                )
            )
    return _lines(names, lines)


def _cost(metrics: _Metrics) -> str:
    titles = {"1": "batch 1", "64": "batch 64", "hard_64": "batch 64, mean over hard"}
    lines = []
    for batch, title in titles.items():
        cells = [metrics[f"update_us.{name}.{batch}"] for name in ESTIMATORS]
        lines.append((title, [_cell(metric, 1, 1, True) for metric in cells]))
    association = metrics["association_us"]
    return (
        _lines(list(ESTIMATORS), lines)
        + "\n\nSmallest and largest of the repeats in brackets. To tell four people apart in four "
        f"cameras takes {_cell(association, 1, 0, True)} microseconds a frame."
    )


def _returns(metrics: _Metrics) -> str:
    names = [DEFAULT, *RIVALS]
    lines = []
    for rig in RIGS:
        ratios = [metrics[f"after_return_over_clean.{rig}.{name}"] for name in names]
        lines.append(
            (f"{rig}: RMSE after the return / clean", [_cell(m, 1, 2, True) for m in ratios])
        )
        mirrored = [metrics[f"mirrored_returns.{rig}.one_camera.{name}"] for name in names]
        lines.append(
            (f"{rig}: facing the wrong way, per 100", [_cell(m, 1, 1, True) for m in mirrored])
        )
    return _lines(names, lines)


def _late(metrics: _Metrics) -> str:
    """What a memory for late frames is worth."""
    lines = []
    for rig in RIGS:
        cells = []
        for name in (DEFAULT, UNBUFFERED):
            key = f"{rig}.{LATE}.{name}"
            cells.append(_cell(metrics[f"rmse_m.{key}"], 100, 2, True))
            cells.append(_cell(metrics[f"coverage95.{key}"], 1, 3))
        lines.append((rig, cells))
    said = (
        "Cameras are 40 to 220 ms late, one has half the rate, one frame in twenty is lost. "
        f"`{UNBUFFERED}` takes frames as of the moment at which they arrive."
    )
    header = [f"{DEFAULT}, cm", "coverage", f"{UNBUFFERED}, cm", "coverage"]
    return said + "\n\n" + _lines(header, lines)


def _swaps(metrics: _Metrics) -> str:
    names = [name for name in (DEFAULT, *RIVALS) if name != DLT]
    lines = []
    for rig in RIGS:
        cells = [metrics[f"identity_swaps.{rig}.{TWO_WORKERS}.{name}"] for name in names]
        lines.append((rig, [_cell(metric, 1, 1, True) for metric in cells]))
    return _lines(names, lines)


def _cell(metric: Metric, scale: float, digits: int, interval: bool = False) -> str:
    text = f"{scale * metric.value:.{digits}f}"
    if interval:
        text += f" ({scale * metric.low:.{digits}f}-{scale * metric.high:.{digits}f})"
    return text


def _lines(header: list[str], lines: list[_Row]) -> str:
    rule = ["---", *["---:"] * len(header)]
    table = [["", *header], rule, *([title, *cells] for title, cells in lines)]
    return "\n".join("| " + " | ".join(row) + " |" for row in table)
