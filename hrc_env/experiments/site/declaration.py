"""The declaration of the site study: question, estimators and tables."""

from itertools import product
from typing import NamedTuple

from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import Table
from hrc_env.experiments.rigs import CAMERA_LABELS, MULTI

TITLE = "One camera or four: the paper's simulation reproduced"
QUESTION = """\
A worker walks over a construction site of 20 x 20 m, behind and past obstacles, in view of four
cameras in the corners. How accurate is the head (the nose) from one camera, and from four? All
estimators receive the same detections (MediaPipe Pose on rendered images, crops follow the
four-camera track): of one camera or four from the first frame on, as in the paper, or of all for a
second and then of some. Errors are of every frame after that second, including those of lost
tracks."""
ESTIMATORS = ("particle", "paper")
"""Default estimators. They are also evaluated with single cameras from the first frame on, and with
crops that follow the estimator itself."""
ALSO = ("kalman", "paper_restarts")
"""Further estimators that are replayed on the film; they include the best one for a single
camera."""
PAPER_RMSE_M = {
    "camera_1": 6.771, "camera_2": 3.763, "camera_3": 5.630, "camera_4": 12.814, MULTI: 0.133,
}  # fmt: skip
"""RMSE that the paper reports [m]. The paper does not state the unit; metres are assumed."""
COLUMNS = [Column(f"{{}}.{c}", f"{words} [m]", 3) for c, words in CAMERA_LABELS.items()]
NUMBERS = {
    "over_best": Column("over_multi.particle.camera_4", "", 0, plain=True),
    "over_best_paper": Column("over_multi.paper_restarts.camera_4", "", 0, plain=True),
    "depth": Column("rmse_m.particle.camera_4", plain=True),
}


def list_estimators(estimators: tuple[str, ...]) -> tuple[str, ...]:
    """Return all estimators that are replayed on the film; the requested ones come first."""
    return tuple(dict.fromkeys((*estimators, *ALSO)))


def make_errors_table(estimators: tuple[str, ...], seconds: float) -> Table:
    """Return the table of errors.

    Args:
        estimators: requested estimators.
        seconds: duration of a walk [s].
    """
    first = estimators[0]
    rows = {
        "printed": ("the paper reports",),
        **{f"rmse_m.alone.{name}": (f"`{name}`, from the first frame",) for name in estimators},
        **{f"rmse_m.{name}": (f"`{name}`",) for name in list_estimators(estimators)},
        **{f"closed_rmse_m.{name}": (f"`{name}`, own crops",) for name in estimators},
    }
    return Table(
        "site",
        "Site: RMSE of the head",
        rows,
        COLUMNS,
        note=f"{{n[rmse_m.{first}.{MULTI}]}} walks of {seconds:g} s; 95 % bootstrap intervals over "
        "walks. From the first frame: only the cameras of the column are used, as in the paper. In "
        "other rows all four cameras are used until the worker, who may begin out of sight, has "
        "been visible for a second. No row evaluates that second. Own crops: the crops follow the "
        f"estimator's own prediction, in {{n[closed_rmse_m.{first}.{MULTI}]}} walks.",
        numbers=NUMBERS,
        printed={f"printed.{camera}": value for camera, value in PAPER_RMSE_M.items()},
    )


class Comparisons(NamedTuple):
    """The tables that compare estimators."""

    differences: Table
    """Differences from the first estimator."""
    ratios: Table
    """Errors with one camera divided by errors with four."""


def make_comparison_tables(estimators: tuple[str, ...]) -> Comparisons:
    """Return the tables of differences from the first estimator, and of one camera over four.

    Args:
        estimators: requested estimators.
    """
    first, *others = list_estimators(estimators)
    starts = (("alone.", "from the first frame: "), ("", ""))
    rivals = {
        f"{start}{name}": (f"{words}`{name}`",) for name, (start, words) in product(others, starts)
    }
    less = [
        Column(f"difference.rmse_m.{{}}.{c}", w, 3, signed=True) for c, w in CAMERA_LABELS.items()
    ]
    ratios = [Column(f"over_multi.{{}}.{c}", w) for c, w in CAMERA_LABELS.items() if c != MULTI]
    everyone = {name: (f"`{name}`",) for name in list_estimators(estimators)}
    return Comparisons(
        Table("site_less", f"RMSE [m] of `{first}` minus that of", rivals, less),
        Table(
            "site_ratios", "RMSE of one camera over that of four, walk by walk", everyone, ratios
        ),
    )
