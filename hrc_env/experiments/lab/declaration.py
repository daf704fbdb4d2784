"""The declaration of the laboratory study: question, estimators and tables."""

from hrc_env.experiments.columns import Column
from hrc_env.experiments.lab.motions import MOTIONS
from hrc_env.experiments.lab.sides import MISSED_CONFIDENCE, MISSED_SHARE
from hrc_env.experiments.report import Table
from hrc_env.experiments.rigs import CAMERA_LABELS, MULTI

TITLE = "Joints that one camera misses: the paper's laboratory reproduced"
QUESTION = f"""\
A worker stands, walks, bends, lifts and carries in a room of 6.1 x 5.5 m in view of four lenses of
118.2 x 69.5 degrees. Which joints does one camera miss on the side turned away from it, and which
do four cameras recover? All estimators receive the same detections (MediaPipe Pose on rendered
images; crops follow the four-camera track): half a second of all cameras, which is not evaluated,
and then those of one camera or of all.

A camera has *missed* a joint if it reports a visibility below {MISSED_CONFIDENCE}, or if the joint
is off by more than {MISSED_SHARE:.0%} of the stature in the image; four cameras have missed it if
the estimate is further from the truth than that. A side is *turned away* if its shoulder and hip
are further from the camera than the other's by 8 cm."""
ESTIMATORS = ("particle", "paper", "paper_restarts", "kalman")
"""Estimators that are replayed on the films. Missed joints are counted for the first one."""
SINGLE = tuple(camera for camera in CAMERA_LABELS if camera != MULTI)
ALL = "all"
"""Name of the results over all motions."""
SHOWN = "paper_restarts"
"""Second estimator in the table of the documentation, which contains its errors over all
motions."""
WORDS = {
    **{motion: motion for motion in (*MOTIONS, ALL)},
    "moving_board": "moving a board in both hands",
    "moving_wood": "moving wood on the shoulder",
}
"""Descriptions of motions."""
COLUMNS = [
    Column(
        f"error_m.{{0}}.{c}.{{1}}.median", f"{words} [mm]", 0, 1000,
        beside=f"error_m.{{0}}.{c}.{{1}}.p95",
    )
    for c, words in CAMERA_LABELS.items()
]  # fmt: skip
ERRORS = Table(
    "lab",
    "Laboratory: error of a joint, median (95th percentile)",
    {
        **{(ESTIMATORS[0], motion): (words,) for motion, words in WORDS.items()},
        (SHOWN, ALL): (f"{WORDS[ALL]}, `{SHOWN}`",),
    },
    COLUMNS,
    ("motion",),
    f"{{n[missed.camera_1.standing]}} films of each of six motions, 15 joints. The estimator is "
    f"`{ESTIMATORS[0]}`, except in the last row.",
)
FAR = Table(
    "lab_far",
    "Joints of the side turned away",
    {motion: (words,) for motion, words in WORDS.items()},
    [
        *(
            Column(f"{what}.{c}.{{}}", f"{words}, {CAMERA_LABELS[c]} [%]", 0, 100)
            for what, words in (
                ("missed_far", "missed"), ("recovered_far", "of these located by four"),
            )
            for c in SINGLE
        ),
        Column("missed.multi.{}", "four miss, of all joints [%]", 1, 100),
    ],
    ("motion",),
)  # fmt: skip
LESS = Table(
    "lab_less",
    f"`{ESTIMATORS[0]}` minus others, film by film, median [mm]",
    {name: (f"`{name}`",) for name in ESTIMATORS[1:]},
    [
        Column(f"difference.error_m.{{}}.{c}.median", words, 1, 1000, signed=True)
        for c, words in CAMERA_LABELS.items()
    ],
)


def make_errors_table(estimator: str) -> Table:
    """Return the table of an estimator's errors, with one row per motion."""
    rows = {(estimator, m): (words,) for m, words in WORDS.items()}
    return Table("lab_errors", f"`{estimator}`", rows, COLUMNS, ("motion",))
