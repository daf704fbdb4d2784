"""The default estimator bears motions that it does not expect, and exchanged sides.

White detections of 3 px; people run at 3 and 3.5 m/s, turn over in the air, fall and roll on the
floor, seen by four cameras, or by one while they fall and lie; the environment's workers run and
fall, too; two of four cameras exchange left and right in the first frame.
"""

from typing import Any

import numpy as np
import pytest
from figures import Figure, count

from benchmarks.tracking.cells import run_cell
from benchmarks.tracking.detections import SURPRISES
from benchmarks.tracking.metrics import STATISTICS, metric, resample_sums
from benchmarks.tracking.names import DEFAULT, DLT
from benchmarks.tracking.rigs import RIGS, make_rig
from benchmarks.tracking.sequences import make_sequences

SEEDS = list(range(491_000, 491_150))
"""Bounds come from seeds 30000 to 30199 and 490000 to 490049; settings from 1000 to 1023
and 7000 to 7199."""
LEAST_COVERAGE = {
    "fallen_one_camera": 0.8, "worker_falls_one_camera": 0.85, "acrobat": 0.8,
    "acrobat_one_camera": 0.7, "small_circles_one_camera": 0.85,
}  # fmt: skip
"""Of the reported 95 % region, by window, where it is not 0.9."""
ACROBAT_ON_SITE = 0.75
HONEST = (0.6, 1.6)
"""Reported standard deviation over RMSE while one camera is left."""
MOST_OVER_DLT = {"fallen_one_camera": 1.3, "acrobat_one_camera": np.inf}
"""RMSE over that of plain triangulation, which stays where it was when one view is left."""


def track(rig_name: str, condition: str, seeds: list[int]) -> dict[str, dict[str, Any]]:
    """Return, by window: the RMSE over that of plain triangulation, the coverage, the reported
    deviation over the RMSE, and how many sequences have the body facing the wrong way in any
    frame."""
    rig, found = make_rig(rig_name), {}
    given = make_sequences(rig, condition, seeds)
    ours, plain = (run_cell(name, rig, given, seeds, lambda _: None) for name in (DEFAULT, DLT))
    _, rmse = STATISTICS["rmse_m"]
    _, coverage = STATISTICS["coverage95"]
    _, deviation = STATISTICS["std_over_rmse"]
    for window, sums in ours.items():
        drawn = resample_sums(sums)
        found[window] = {
            "over_dlt": metric(rmse(drawn) / rmse(resample_sums(plain[window])), "-", drawn),
            "coverage": metric(coverage(drawn), "share", drawn),
            "deviation": metric(deviation(drawn), "-", drawn),
            "n_mirrored": int(np.count_nonzero(sums["wrong_way"])),
        }
    return found


def test_an_acrobat_is_tracked_about_as_well_as_by_triangulation():
    assert 0.3 < track("lab", "acrobat", [1, 2])["acrobat"]["over_dlt"].value < 1.25


def test_a_mirrored_start_is_put_right():
    assert track("lab", "mirrored_start", [1, 2])["mirrored_start"]["n_mirrored"] == 0


@pytest.mark.long
@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("condition", ["clean", *SURPRISES])
def test_what_is_not_expected_is_tracked(rig, condition, figures):
    bounded = []
    for window, found in track(rig, condition, SEEDS).items():
        name, least = f"surprises.{rig}.{window}", LEAST_COVERAGE.get(window, 0.9)
        if (rig, window) == ("site", "acrobat"):
            least = ACROBAT_ON_SITE
        most = MOST_OVER_DLT.get(window, 1.0)
        bounded.append(Figure(f"{name}.over_dlt", found["over_dlt"], most=most))
        bounded.append(Figure(f"{name}.coverage", found["coverage"], least=least))
        if window.endswith("one_camera") and condition != "acrobat_one_camera":
            bounded.append(Figure(f"{name}.deviation", found["deviation"], *HONEST))
        if condition == "mirrored_start":
            mirrored = count(found["n_mirrored"], len(SEEDS))
            bounded.append(Figure(f"{name}.mirrored", mirrored, most=0.03))
    figures.hold(*bounded)
