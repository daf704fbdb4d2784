"""Rows, columns and tables of the perception benchmark."""

from dataclasses import replace

from hrc_env.experiments.columns import Column
from hrc_env.experiments.report import Table
from hrc_env.perception.faults.fault import KINDS
from hrc_env.scene.domain_randomization import APPEARANCES

LEVELS = {"pixels": "", "keypoints": "keypoints."}
"""Perception levels, with the prefixes of their metrics."""
FAULTS = {
    "none": ("no fault",), **{kind: (f"`{kind}`",) for kind in KINDS},
}  # fmt: skip
POSTURES = {each: (each,) for each in ("stand", "walk", "carry", "work", "fold", "all")}
SHOWN = ("none", "wrong_rotation", "wrong_translation", "wrong_focal", "knocked", "noise",
         "exposure")  # fmt: skip
"""Faults for which the documentation shows the rate of reports of miscalibrated cameras."""


def belief(start: str = "", words: str = "", key: str = "{}") -> dict[str, Column]:
    """Return the columns for errors of estimates and their reported standard deviations.

    Args:
        start: prefix of the metrics' names.
        words: prefix of the columns' headings.
        key: pattern of the row in the names of metrics.
    """
    return {
        "median": Column(f"{start}error_m.{key}.median", f"{words}median [mm]", 1, 1000),
        "p95": Column(f"{start}error_m.{key}.p95", f"{words}95 % [mm]", 0, 1000),
        "coverage": Column(f"{start}coverage95.{key}", f"{words}coverage", 2),
        "std": Column(f"{start}std_over_error.{key}", f"{words}std/error", 2),
        "lost": Column(f"{start}lost_steps.{key}", f"{words}steps lost [%]", 1, 100),
    }


def make_fault_columns(level: str) -> dict[str, Column]:
    """Return the columns for faults at a perception level."""
    start, words = LEVELS[level], f"`{level}`: "
    return {
        "ratio": Column(f"{start}error_ratio.{{}}", f"{words}ratio", 2),
        **belief(start, words, "fault.{}"),
        "seen": Column(f"{start}detected.fault.{{}}", f"{words}detected by it [%]", 0, 100),
    }


def make_name_columns(level: str) -> tuple[Column, ...]:
    """Return the columns for reports of miscalibrated cameras at a perception level."""
    key, words = f"{LEVELS[level]}miscalibrated.{{}}.", f"`{level}`: "
    return (
        Column(f"{key}named", f"{words}reported", shows="count"),
        Column(f"{key}after_s", f"{words}after [s]"),
        Column(f"{key}others", f"{words}another reported [%]", 1, 100),
    )


PIXELS, EMULATED = make_fault_columns("pixels"), make_fault_columns("keypoints")
DETECTED = Column("detected.{}", "detected [%]", 1, 100)
ERROR_SHARE = Column("error_share.{}.median", "median error [% of stature]", 1, 100)
ACCURACY = Table(
    "pixels_accuracy",
    "Accuracy at `pixels`",
    {"lab": ("lab",), "site": ("site",)},
    (Column("lost_steps.{}", "episodes", shows="n"), belief()["median"], belief()["p95"]),
    ("scene",),
    "Errors of single joints without camera faults, 250 steps per episode. This is precision, not "
    "trueness: true joints are defined where the detector places them, by offsets that were fitted "
    "to the same bodies.",
)
COST = Table(
    "faults",
    "Cost of camera faults",
    FAULTS,
    [
        each if each in (PIXELS["ratio"], EMULATED["ratio"]) else replace(each, plain=True)
        for each in (
            PIXELS["median"], PIXELS["ratio"], PIXELS["p95"], PIXELS["coverage"],
            EMULATED["ratio"], EMULATED["p95"], EMULATED["coverage"],
        )
    ],
    ("fault of one camera of four",),
    "Errors of single joints. Ratio: median error with the fault over that without it, on the same "
    "seeds. Coverage: share of joints within the reported 95 % region. Laboratory, one worker, arm "
    "at rest; "
    "{n[error_ratio.lost]} episodes of 150 steps at `pixels`, {n[keypoints.error_ratio.lost]} of "
    "250 at `keypoints`.",
)  # fmt: skip
NAMED = Table(
    "miscalibration",
    "Miscalibrated cameras",
    {kind: FAULTS[kind] for kind in SHOWN},
    (*make_name_columns("pixels"), *make_name_columns("keypoints")),
    ("fault of one camera",),
    "Episodes in which the faulty camera was reported, the time until then, and the share of steps "
    "in which another camera was reported. Laboratory, arm at rest; episodes of 6 s at `pixels` "
    "and 10 s at `keypoints`. With faults that are not shown, no camera is reported in 98 % of "
    "steps.",
)
APPEARANCE = Table(
    "appearance",
    "Detection and appearance",
    {f"appearance.{name}": (f"`{name}`",) for name in APPEARANCES},
    (replace(DETECTED, heading="detected", shows="count"), ERROR_SHARE),
    ("appearance",),
    "Crops that show the whole worker; laboratory, `worker_1`.",
)
EMULATOR = Table(
    "emulator",
    "Emulator against pixels",
    POSTURES,
    (
        Column("emulator_clips.{}", "clips", 0),
        Column("emulator_median_m.{}.pixels", "median, pixels [mm]", 1, 1000),
        Column("emulator_median_m.{}.keypoints", "emulator [mm]", 1, 1000),
        Column("emulator_error_ratio.{}", "ratio", 2),
        Column("emulator_p95_m.{}.pixels", "95 %, pixels [mm]", 0, 1000),
        Column("emulator_p95_m.{}.keypoints", "emulator [mm]", 0, 1000),
        Column("emulator_error_ratio.{}.p95", "ratio", 2),
        Column("emulator_coverage95.{}.pixels", "coverage, pixels", 3),
        Column("emulator_coverage95.{}.keypoints", "emulator", 3),
    ),
    ("posture",),
    "Errors of joints after the default estimator, on {n[emulator_clips.all]} clips. Their seeds, "
    "camera positions and pairs of motion and body are not those of the fit; the bodies, motions "
    "and scenes are.",
)
LASTING = Table(
    "emulator_lasting",
    "Exchanged sides and correlation over time",
    POSTURES,
    (
        Column("emulator_exchanged.{}.pixels", "exchanged sides, pixels", 3),
        Column("emulator_exchanged.{}.keypoints", "emulator", 3),
        Column("emulator_lasting.{}.pixels", "correlation after 0.48 s, pixels", 2),
        Column("emulator_lasting.{}.keypoints", "emulator", 2),
    ),
    ("posture",),
    "The same clips: share of detections that exchange left and right of the body or its legs, and "
    "correlation of image errors, without gross errors, with those 0.48 s later.",
)
SPEED = Table(
    "speed_pixels",
    "Speed at `pixels` with four cameras",
    {
        ("4.1", "litert"): ("LiteRT, lab",),
        ("4.1.site", "litert"): ("LiteRT, site",),
        ("4.2", "litert of eight crops"): ("LiteRT, lab, two workers",),
        ("4.1.openvino", "openvino"): ("OpenVINO (bf16), lab",),
    },
    (
        Column("steps_per_s.{0}", "`env.step` [1/s]"),
        Column("step_ms.{0}", "a step [ms]"),
        Column("network_ms.{1}", "the network alone [ms]"),
    ),
    note="Median of 200 steps. The network alone: four crops on two threads, without rendering.",
)
TABLES = (SPEED, ACCURACY, COST, NAMED, APPEARANCE, EMULATOR, LASTING)
"""Tables of the benchmark in the documentation."""
