"""The ablations in the order of the report, and the columns of their tables."""

from hrc_env.experiments.ablations.ablation import Ablation
from hrc_env.experiments.ablations.questions.faults import CALIBRATION, LATENCY
from hrc_env.experiments.ablations.questions.filters import ALGORITHM_1, FILTER, KINEMATICS
from hrc_env.experiments.ablations.questions.rigs import CAMERAS, OCCLUSION, WORKERS
from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import Table

TITLE = "Ablations of rigs, detections and estimators"
QUESTION = """\
Questions that the paper's two experiments leave open. Detections come from the calibrated emulator
(`perception="keypoints"`), as these are questions about estimators and rigs. The estimator is the
default, `particle`, unless a setting names another; settings are changed one at a time. Workers of
all bodies work beside an arm that rests, on the same walks in every setting of a scene.

Every joint of every frame after the first second counts. If the track is lost, the last estimate,
or the prior, is evaluated. *Coverage*: the share of joints within the reported 95 % region; *lost*:
the share of time without a track; *switches*: changes of a worker from one track to another, per
minute; *IDF1*: how consistently workers keep their tracks (`hrc_env/tracking/metrics.py`);
*difference*: from the reference setting, walk by walk; a dot marks a p-value below .05 after Holm's
correction for all differences of the study."""
ABLATIONS: dict[str, Ablation] = {
    ablation.name: ablation
    for ablation in (
        CAMERAS, ALGORITHM_1, LATENCY, CALIBRATION, OCCLUSION, WORKERS, FILTER, KINEMATICS,
    )
}  # fmt: skip
"""Ablations by name, in the order of the report."""
COLUMNS = (
    Column("error_m.{}.median", "median [mm]", 1, 1000),
    Column("error_m.{}.p95", "95 % [mm]", 0, 1000),
)
"""Columns of the tables in the documentation and in the report."""
MORE = (
    Column("difference.error_m.{}.median", "difference of median [mm]", 1, 1000, signed=True),
    Column("difference.error_m.{}.p95", "difference of 95 % [mm]", 0, 1000, signed=True),
    Column("rmse_m.{}", "RMSE [mm]", 0, 1000),
    Column("coverage95.{}", "coverage [%]", 1, 100),
    Column("lost.{}", "lost [%]", 2, 100),
)
"""Further columns of the tables in the report."""
OF_SEVERAL = (
    Column("id_switches.{}", "switches [1/min]", 2),
    Column("idf1.{}", "IDF1 [%]", 1, 100),
)
"""Further columns for ablations with several workers."""
_SHOWN = {
    "cameras": "n1 n2 n3 n4 n8 corners walls low one_side two_neighbours two_opposite two_beside",
    "algorithm1": "n1_m100 n1_m10000 sigma_1cm n1_m1000",
    "latency": "told_120ms untold_120ms",
    "calibration": "all_rotation_1deg site_all_rotation_1deg",
    "occlusion": "lab_lost_1 lab_lost_2 lab_lost_3 dropped_60pct dropped_90pct",
    "workers": "lab_2 lab_3",
    "filter": "4cam_bones_of_any_length 4cam_no_outliers 4cam_reported_noise "
    "1cam_bones_of_any_length 1cam_no_floor 1cam_velocity_forgotten 1cam_mode_for_mean "
    "1cam_no_turned_body",
}
"""Names of the settings in the table of the documentation, by ablation."""


def make_table(seconds: float) -> Table:
    """Return the table for the documentation.

    Args:
        seconds: duration of an episode [s].
    """
    return Table(
        "ablations",
        "Ablations: error of a joint",
        {
            f"{study}.{name}": (f"`{study}`", ABLATIONS[study].find_setting(name).words)
            for study, names in _SHOWN.items()
            for name in names.split()
        },
        COLUMNS,
        ("study", "setting"),
        f"{{n[error_m.cameras.n1.median]}} episodes of {seconds:g} s per setting, with the same "
        "walks in every setting; level `keypoints`, estimator `particle` unless stated otherwise.",
    )


def list_columns(ablation: Ablation) -> tuple[Column, ...]:
    """Return the columns of an ablation's table."""
    several = any(setting.n_workers > 1 for setting in ablation.settings)
    return (*COLUMNS, *MORE, *(OF_SEVERAL if several else ()))
