"""Rows, kinds of metrics, and tables of the tracking benchmark."""

from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.tracking.names import DEFAULT, DLT, EVERYTHING, SMOOTHER, Selection
from benchmarks.tracking.sequences import MATCHED
from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import Cells, Table


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of metric that is computed for each estimator and table row."""

    title: str
    digits: int
    scale: float = 1.0

    def column(self, metric: str, name: str, heading: str) -> Column:
        """Return the table column of an estimator.

        Args:
            metric: name of the kind, one of `KINDS`.
            name: name of the estimator.
            heading: heading of the column.
        """
        return Column(f"{metric}.{{}}.{name}", heading, self.digits, self.scale)


KINDS = {
    "rmse_m": Kind("RMSE in cm", 2, 100),
    "median_m": Kind("Median error in cm", 2, 100),
    "coverage95": Kind("Coverage of the reported 95 % region", 3),
    "std_over_rmse": Kind("Reported standard deviation / RMSE", 2),
    "facing_wrong": Kind("Percent of frames in which the torso faces the wrong way", 2, 100),
}
"""Kinds of metrics by name; each has a table with one row per window."""
SHOWN = (
    ("rmse_m", DEFAULT, f"`{DEFAULT}` [cm]"),
    ("coverage95", DEFAULT, "coverage"),
    ("std_over_rmse", DEFAULT, "std/RMSE"),
    ("rmse_m", "kalman", "`kalman` [cm]"),
    ("rmse_m", "paper_restarts", "`paper_restarts` [cm]"),
    ("coverage95", "paper_restarts", "coverage"),
    ("rmse_m", "ransac", "`ransac` [cm]"),
    ("rmse_m", DLT, "DLT [cm]"),
    ("rmse_m", SMOOTHER, f"`{SMOOTHER}` [cm]"),
    ("coverage95", SMOOTHER, "coverage"),
)
"""Columns of the table in the documentation: kind, estimator and heading."""
WORDS = {
    "one_camera_half_second": "one camera, first 0.5 s",
    "one_camera_one_second": "one camera, first 1 s",
    "one_camera_two_seconds": "one camera, first 2 s",
    "one_camera": "one camera, 4 s",
}
"""Descriptions of windows in tables, if they differ from the names of the windows."""
BATCHES = {"64": "batch of 64 [us]", "hard_64": "batch of 64, `hard` [us]", "1": "alone [us]"}


def describe_rows(selection: Selection) -> dict[str, Cells]:
    """Return the descriptions of all table rows, by the key of the row."""
    return {
        f"{rig}.{window}": (f"{rig} {WORDS.get(window, window.replace('_', ' '))}",)
        for rig, _, window in selection.rows()
    }


def table_of_kind(metric: str, names: Sequence[str], selection: Selection) -> Table:
    """Return the table of one kind of metric.

    Args:
        metric: one of `KINDS`.
        names: names of the estimators.
        selection: selection of the estimators and sequences that are run.
    """
    kind = KINDS[metric]
    columns = [kind.column(metric, each, each) for each in names]
    return Table(metric, kind.title, describe_rows(selection), columns)


def times(names: Sequence[str]) -> Table:
    """Return the table of the times per update.

    Args:
        names: names of the estimators.
    """
    return Table(
        "tracking_cost",
        "Time of an update",
        {name: (f"`{name}`",) for name in names},
        [Column(f"update_us.{{}}.{batch}", words) for batch, words in BATCHES.items()],
        ("estimator",),
        "Per worker and update, with four cameras on one core. `paper` and `paper_restarts` have "
        "1,000 particles per joint.",
    )


BENCH = Table(
    "tracking",
    "Estimators on simulated sequences",
    {
        row: words
        for row, words in describe_rows(EVERYTHING).items()
        if not str(row).endswith(MATCHED)
    },
    [KINDS[metric].column(metric, name, heading) for metric, name, heading in SHOWN],
    ("sequence",),
    "RMSE of joint positions [cm]; coverage: share of joints within the reported 95 % region; "
    "std/RMSE: reported standard deviation over RMSE. "
    f"{{n[coverage95.env.after_return.{DEFAULT}]}} sequences per row, none of which was used to "
    f"choose settings ({{n[coverage95.env.after_return.{SMOOTHER}]}} for `{SMOOTHER}`, which is "
    "offline). `lab` and `site`: simulated walkers, independent detection errors of 3 px; `env`: "
    "the environment's worker through the emulator. `hard`: occlusion, 10 % gross errors and "
    "exchanged sides; `drifting`: errors that last half a second; `late`: images that arrive 40 "
    "to 220 ms late, with some lost; `one camera`: one camera for 4 s, after 1 s of four. DLT: "
    "linear triangulation of each frame.",
)
