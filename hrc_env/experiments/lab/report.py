"""The report of the laboratory experiment."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from hrc_env.core.results import Metric
from hrc_env.core.skeleton import JOINTS
from hrc_env.experiments.lab.figures import SPOKEN
from hrc_env.experiments.lab.metrics import ALL, COLUMNS
from hrc_env.experiments.lab.motions import MOTIONS
from hrc_env.experiments.lab.sides import MISSED_CONFIDENCE, MISSED_SHARE
from hrc_env.experiments.study.page import Part, Picture, Section, Table, said, write_report

if TYPE_CHECKING:
    from hrc_env.experiments.lab.experiment import LabConfig

Metrics = Mapping[str, Metric]
TITLE = "What one camera does not see: the paper's laboratory, again"
ABOUT_MISSES = f"""\
The network always returns its points, so "missed" needs a definition: a camera has missed a joint
whose visibility it reports below {MISSED_CONFIDENCE}, or that it puts off by more than
{MISSED_SHARE:.0%} of the worker's stature in the image. Four cameras have missed a joint whose
estimate is further from the truth than that. A side is turned away from a camera when its
shoulder and hip are further from it by 8 cm than the other's."""
ASSUMED = """\
What had to be assumed: where the four cameras hang (under the ceiling, in the corners) and look;
the lens (Kannala-Brandt, from the field of view that the paper states); what the worker's motions
are in detail (ours are closed forms of time; a board in both hands stands for the
whiteboard); bodies (eight, in turns);
clothing and light. The paper gives no numbers for this experiment, only pictures. The robot
stands in the room with its arm at rest."""


def report(out: Path, config: "LabConfig", seeds: Sequence[int], metrics: Metrics) -> None:
    """Write report.html and report.md into `out`; the figures are there."""
    four = [metrics[f"error_m.particle.multi.{ALL}.{word}"] for word in ("median", "p95")]
    median, p95 = (said(each, 1000, 0) for each in four)
    lead = (
        "A worker stands, walks, bends, lifts and carries in a room of 6.1 x 5.5 m before four "
        f"wide lenses. Four cameras and `particle` know the 15 joints to {median} mm (median; 95th "
        f"percentile {p95} mm); what one camera misses on the side turned away from it, the others "
        "see."
    )
    sections = [
        Section("What was done", (_done(config, seeds),)),
        Section("What came out", _came_out(metrics, out / "figures")),
        Section("The side turned away", _far_side(metrics, out / "figures")),
        Section("Joint by joint", (_joints(metrics),)),
        Section("What it does not mean", (ASSUMED, f"Settings: {asdict(config)}.")),
    ]
    write_report(out, TITLE, lead, sections)


def _done(config: "LabConfig", seeds: Sequence[int]) -> str:
    return (
        f"{len(seeds)} films of each of {len(MOTIONS)} motions (seeds {seeds[0]} to {seeds[-1]}, "
        f"at most {config.max_frames} images at 25 Hz), rendered through lenses of 118.2 x 69.5 "
        f"degrees; MediaPipe Pose on crops that follow the four-camera track (network full, of "
        f"workers who are folded up {config.folded}). Every estimator is "
        "given the same detections: half a second of all cameras, which is not judged, and then "
        "those of one camera or of all."
    )


def _came_out(metrics: Metrics, figures: Path) -> tuple[Part, ...]:
    return (
        Picture(
            figures / "figure_6.png",
            "The paper's figure 6: what one camera was shown and found (blue left, orange right), "
            "the body from that camera alone, and from four; grey is the truth. Each is the frame "
            "of its film in which that camera missed most.",
        ),
        *(_errors(metrics, name) for name in ("particle", "paper", "kalman")),
        "Median (95th percentile) of all 15 joints, in millimetres.",
        Picture(figures / "errors.png", "The same for `particle`, with 95 % intervals over films."),
    )


def _errors(metrics: Metrics, estimator: str) -> Table:
    rows = []
    for motion in (*MOTIONS, ALL):
        cells = []
        for column in COLUMNS:
            key = f"error_m.{estimator}.{column}.{motion}"
            median, p95 = (1000 * metrics[f"{key}.{word}"].value for word in ("median", "p95"))
            cells.append(f"{median:.0f} ({p95:.0f})")
        rows.append((motion.replace("_", " "), *cells))
    return Table((f"`{estimator}` [mm]", *SPOKEN.values()), tuple(rows))


def _far_side(metrics: Metrics, figures: Path) -> tuple[Part, ...]:
    rows = []
    for motion in (*MOTIONS, ALL):
        shares = []
        for column in COLUMNS[:4]:
            missed = metrics[f"missed_far.{column}.{motion}"].value
            back = metrics[f"recovered_far.{column}.{motion}"].value
            shares.append(f"{missed:.0%} -> {back:.0%}" if missed > 0 else f"{missed:.0%}")
        shares.append(f"{metrics[f'missed.multi.{motion}'].value:.1%}")
        rows.append((motion.replace("_", " "), *shares))
    header = ("missed -> of these known with four", *(SPOKEN[c] for c in COLUMNS[:4]))
    return (
        ABOUT_MISSES,
        Table((*header, "four miss, of all joints"), tuple(rows)),
        Picture(figures / "far_side.png", "Joints on the side turned away from a camera."),
    )


def _joints(metrics: Metrics) -> Table:
    rows = [
        (
            joint.replace("_", " "),
            *(
                f"{1000 * metrics[f'error_m.by_joint.{column}.{joint}.median'].value:.0f}"
                for column in COLUMNS
            ),
        )
        for joint in JOINTS
    ]
    return Table(("median error [mm], `particle`", *SPOKEN.values()), tuple(rows))
