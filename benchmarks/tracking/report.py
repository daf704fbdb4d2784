"""The tracking bench as people read it: tables, and a picture of the calibration."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.common import Metrics, cell, grid, save, table
from benchmarks.tracking.env_sequences import ENV
from benchmarks.tracking.metrics import Parts
from benchmarks.tracking.names import DEFAULT, DLT, RIVALS, SMOOTHER, UNBUFFERED, names_of, rows
from benchmarks.tracking.rigs import RIGS
from benchmarks.tracking.sequences import LATE, MATCHED, TWO_WORKERS
from benchmarks.tracking.tally import N_LEVELS
from hrc_env.experiments.study.page import Part, Picture, Section, Table, write_report
from hrc_env.tracking.estimators import ESTIMATORS

_LEAD = f"""\
Numbers in brackets are 95 % bootstrap intervals over sequences. `lab` and `site` are the bench's
walkers and white detections of 3 px; `{ENV}` is the environment's worker seen through its
emulator of the detector. `hard` is occlusion, gross errors and exchanged sides; in `drifting`
detections err in the same way for half a second, of which nobody is told. `one_camera_...` are
the first half second, second and two seconds of the four in which one camera is left,
`after_return` is what comes a second later. `{DLT}` is plain triangulation of every frame by
itself; `{SMOOTHER}` knows the whole clip and is no rival."""
_ABOUT_THE_BOUND = """\
`matched` bodies move as the estimators' motion model says, without bones; estimators are told so
(no outliers, no exchanged sides, detections as good as they say, nothing known of bone lengths),
and still learn the joints' places on the body. The bound is that of each sequence, averaged."""
_TABLES: dict[str, tuple[str, float, int, bool]] = {
    "rmse_m": ("RMSE in cm", 100, 2, True),
    "median_m": ("Median error in cm", 100, 2, False),
    "coverage95": ("Coverage of the reported 95 % region", 1, 3, False),
    "std_over_rmse": ("Reported standard deviation / RMSE", 1, 2, False),
    "nees": ("Normalised estimation error squared per degree of freedom", 1, 2, False),
    "calibration_gap": (
        "Calibration gap: largest error of what regions claim to hold",
        1,
        3,
        False,
    ),
    "facing_wrong": ("Percent of frames in which the torso faces the wrong way", 100, 2, False),
}
"""Title, scale, digits and whether intervals are shown, of every table with a row a window."""
_BATCHES = {"1": "batch 1", "64": "batch 64", "hard_64": "batch 64, mean over hard"}


def report(out: Path, parts: Parts, metrics: Metrics) -> None:
    """Write report.html, report.md and calibration.png into `out`."""
    _plot_calibration(out / "calibration.png", parts)
    everybody = [DEFAULT, *RIVALS, SMOOTHER]
    rivals = [DEFAULT, *RIVALS]
    sections: list[tuple[str, tuple[Part, ...]]] = [
        (f"{DEFAULT}, the default, and the best of the others", (_lead(metrics), _beaten(metrics))),
        ("RMSE / posterior Cramer-Rao bound", (_bound(metrics), _ABOUT_THE_BOUND)),
        ("Microseconds per worker and update, one core", _cost(metrics)),
        *((title, (_by_row(metrics, kind, everybody, *how),))
          for kind, (title, *how) in _TABLES.items()),
        ("After one camera", (_returns(metrics, rivals),)),
        ("Late frames", _late(metrics)),
        ("Two workers: changes of identity per 100 sequences", (
            _by_rig([name for name in rivals if name != DLT], {"": lambda rig, name: cell(
                metrics[f"identity_swaps.{rig}.{TWO_WORKERS}.{name}"], 1, 1, True)}),)),
        ("Calibration", (Picture(out / "calibration.png", "Under the diagonal: over-confident."),)),
    ]  # fmt: skip
    write_report(out, "Tracking bench", _LEAD, [Section(*each) for each in sections])


def _lead(metrics: Metrics) -> Table:
    """The default, row by row, beside the paper's algorithm and the best of the others."""
    lines = []
    for rig, _, window in rows():
        key = f"{rig}.{window}"
        best = min(RIVALS, key=lambda name: metrics[f"rmse_m.{key}.{name}"].value)
        lines.append([
            f"{rig} {window}",
            cell(metrics[f"rmse_m.{key}.{DEFAULT}"], 100, 2, True),
            cell(metrics[f"coverage95.{key}.{DEFAULT}"], 1, 3),
            cell(metrics[f"std_over_rmse.{key}.{DEFAULT}"], 1, 2),
            cell(metrics[f"rmse_m.{key}.paper"], 100, 2),
            f"{cell(metrics[f'rmse_m.{key}.{best}'], 100, 2)} {best}",
            cell(metrics[f"default_over.{key}.{best}"], 1, 3, True),
        ])  # fmt: skip
    header = ("", "RMSE, cm", "coverage", "std/RMSE", "paper, cm", "best other, cm", "default/best")
    return table(header, lines)


def _beaten(metrics: Metrics) -> str:
    """Where another is below the default, and whether by more than chance."""
    said = []
    for rig, _, window in rows():
        for name in RIVALS:
            ratio = metrics[f"default_over.{rig}.{window}.{name}"]
            if ratio.value > 1:
                surely = "" if ratio.low > 1 else " (the interval holds 1)"
                said.append(f"{rig} {window}: {name}, default {ratio.value:.3f} x{surely}")
    if not said:
        return f"`{DEFAULT}` has the least error in every row."
    return f"Where another's error is less than that of `{DEFAULT}`: " + "; ".join(said) + "."


def _by_row(
    metrics: Metrics, kind: str, names: Sequence[str], scale: float, digits: int, interval: bool
) -> Table:
    """One row per rig and window, one column per estimator; what is not known is left empty."""
    lines = [
        [f"{rig} {window}",
         *(cell(metrics.get(f"{kind}.{rig}.{window}.{name}"), scale, digits, interval)
           for name in names)]
        for rig, _, window in rows()
    ]  # fmt: skip
    return table(["", *names], lines)


def _by_rig(names: Sequence[str], cells: dict[str, Callable[[str, str], str]]) -> Table:
    """Rows per rig and title, columns per estimator."""
    lines = [
        [f"{rig}{title}", *(one(rig, name) for name in names)]
        for rig in RIGS
        for title, one in cells.items()
    ]
    return table(["", *names], lines)


def _bound(metrics: Metrics) -> Table:
    names = names_of(MATCHED)
    both = ["both rigs", *(cell(metrics[f"ratio_to_bound.{name}"], 1, 3, True) for name in names)]
    each = _by_rig(names, {
        "": lambda rig, name: cell(metrics[f"ratio_to_bound_in.{rig}.{name}"], 1, 3, True),
        ": coverage": lambda rig, name: cell(
            metrics.get(f"coverage95.{rig}.{MATCHED}.{name}"), 1, 3, True),
    })  # fmt: skip
    return table(each.header, [both, *each.rows])


def _cost(metrics: Metrics) -> tuple[Table, str]:
    lines = [
        [title, *(cell(metrics[f"update_us.{name}.{batch}"], 1, 1, True) for name in ESTIMATORS)]
        for batch, title in _BATCHES.items()
    ]
    association = cell(metrics["association_us"], 1, 0, True)
    return table(["", *ESTIMATORS], lines), (
        "Smallest and largest of the repeats in brackets. To tell four people apart in four "
        f"cameras takes {association} microseconds a frame."
    )


def _returns(metrics: Metrics, names: Sequence[str]) -> Table:
    return _by_rig(names, {
        ": RMSE after the return / clean": lambda rig, name: cell(
            metrics[f"after_return_over_clean.{rig}.{name}"], 1, 2, True),
        ": facing the wrong way, per 100": lambda rig, name: cell(
            metrics[f"mirrored_returns.{rig}.one_camera.{name}"], 1, 1, True),
    })  # fmt: skip


def _late(metrics: Metrics) -> tuple[str, Table]:
    """What a memory for late frames is worth."""
    said = (
        "Cameras are 40 to 220 ms late, one has half the rate, one frame in twenty is lost. "
        f"`{UNBUFFERED}` takes frames as of the moment at which they arrive."
    )
    return said, _by_rig((DEFAULT, UNBUFFERED), {
        ": RMSE, cm": lambda rig, name: cell(metrics[f"rmse_m.{rig}.{LATE}.{name}"], 100, 2, True),
        ": coverage": lambda rig, name: cell(metrics[f"coverage95.{rig}.{LATE}.{name}"], 1, 3),
    })  # fmt: skip


def _plot_calibration(path: Path, parts: Parts) -> None:
    """Share of joints within the reported region, against what the region claims."""
    shown = [(rig, what) for rig in RIGS for what in ("clean", "hard", "one_camera")]
    shown += [(ENV, what) for what in ("four_cameras", "two_cameras", "one_camera")]
    figure = Figure(figsize=(12, 12.8), layout="constrained")
    axes = figure.subplots(3, 3, sharex=True, sharey=True)
    claimed = np.arange(N_LEVELS + 1) / N_LEVELS
    for axis, (rig, condition) in zip(axes.flat, shown, strict=True):
        axis.plot([0, 1], [0, 1], color="0.6", linestyle="--", label="honest")
        for name in (each for each in (DEFAULT, *RIVALS) if each != DLT):
            levels = np.array(parts[rig, condition, name][condition]["levels"]).sum(0)
            held = np.concatenate([[0], np.cumsum(levels) / levels.sum()])
            axis.plot(claimed, held, label=name, linewidth=2.4 if name == DEFAULT else 1.4)
        axis.set_title(f"{rig}, {condition}", fontsize=13)
        axis.set_aspect("equal")
        grid(axis)
    for axis in axes[:, 0]:
        axis.set_ylabel("share of joints inside it", fontsize=12)
    for axis in axes[-1]:
        axis.set_xlabel("probability that the region claims", fontsize=12)
    figure.legend(*axes.flat[0].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    save(figure, path, "Calibration: under the diagonal is over-confident")
