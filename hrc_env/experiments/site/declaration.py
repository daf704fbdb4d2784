"""The site's study as it is declared: question, estimators and tables."""

from itertools import product

from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import Table
from hrc_env.experiments.rigs import MULTI, SPOKEN

TITLE = "One camera or four: the paper's simulation, again"
ASKED = """\
A worker walks over a construction site of 20 x 20 m, behind and past what stands there, before four
cameras in the corners: how well is the head (the nose) known from one camera, and from four? All
estimators are given the same detections (MediaPipe Pose on rendered images, crops follow the
four-camera track): of one camera or four from the first frame on, as the paper has it, or of all
for a second and then of some. Errors are of every frame after that second, also where the track is
lost."""
ESTIMATORS = ("particle", "paper")
"""Default estimators, which also have cameras alone from the first frame on, and own crops."""
ALSO = ("kalman", "paper_restarts")
"""These are given the film, too: single cameras get the best estimator that there is."""
PAPER_RMSE_M = {
    "camera_1": 6.771, "camera_2": 3.763, "camera_3": 5.630, "camera_4": 12.814, MULTI: 0.133,
}  # fmt: skip
"""RMSE that the paper reports; its unit is not printed, metres are meant."""
COLUMNS = [Column(f"{{}}.{c}", f"{words} [m]", 3) for c, words in SPOKEN.items()]
NUMBERS = {
    "over_best": Column("over_multi.particle.camera_4", "", 0, plain=True),
    "over_best_paper": Column("over_multi.paper_restarts.camera_4", "", 0, plain=True),
    "depth": Column("rmse_m.particle.camera_4", plain=True),
}


def everybody(estimators: tuple[str, ...]) -> tuple[str, ...]:
    """Return all estimators that are given the film, those that were asked for first."""
    return tuple(dict.fromkeys((*estimators, *ALSO)))


def errors(estimators: tuple[str, ...], seconds: float) -> Table:
    """Return the table of errors.

    Args:
        estimators: that were asked for.
        seconds: length of a walk [s].
    """
    first = estimators[0]
    rows = {
        "printed": ("the paper reports",),
        **{f"rmse_m.alone.{name}": (f"`{name}`, from the first frame",) for name in estimators},
        **{f"rmse_m.{name}": (f"`{name}`",) for name in everybody(estimators)},
        **{f"closed_rmse_m.{name}": (f"`{name}`, own crops",) for name in estimators},
    }
    return Table(
        "site",
        "Site: RMSE of the head",
        rows,
        COLUMNS,
        note=f"{{n[rmse_m.{first}.{MULTI}]}} walks of {seconds:g} s, with 95 % bootstrap intervals "
        "over walks. From the first frame: the cameras of the column and no others, ever, as in "
        "the paper; in other rows all four look until the worker, who may begin out of sight, was "
        "seen for a second, which is judged in none. Own crops: "
        f"{{n[closed_rmse_m.{first}.{MULTI}]}} walks in which the crops follow the estimator's own "
        "prediction.",
        numbers=NUMBERS,
        printed={f"printed.{camera}": value for camera, value in PAPER_RMSE_M.items()},
    )


def comparisons(estimators: tuple[str, ...]) -> tuple[Table, Table]:
    """Return the tables of differences from the first estimator, and of one camera over four.

    Args:
        estimators: that were asked for.
    """
    first, *others = everybody(estimators)
    starts = (("alone.", "from the first frame: "), ("", ""))
    rivals = {
        f"{start}{name}": (f"{words}`{name}`",) for name, (start, words) in product(others, starts)
    }
    less = [Column(f"difference.rmse_m.{{}}.{c}", w, 3, signed=True) for c, w in SPOKEN.items()]
    ratios = [Column(f"over_multi.{{}}.{c}", w) for c, w in SPOKEN.items() if c != MULTI]
    return (
        Table("site_less", f"RMSE [m] of `{first}` less that of", rivals, less),
        Table(
            "site_ratios", "RMSE of one camera over that of four, walk by walk",
            {name: (f"`{name}`",) for name in everybody(estimators)}, ratios,
        ),
    )  # fmt: skip
