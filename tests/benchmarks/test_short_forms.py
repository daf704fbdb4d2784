"""A short form says so, with how much it plays and for how long; a whole one does not."""

from dataclasses import replace
from typing import Any

import pytest

from benchmarks.speed import bench as speed
from benchmarks.tracking import bench as tracking
from benchmarks.tracking.baselines import bench as baselines
from hrc_env.experiments.ablations import experiment as ablations
from hrc_env.experiments.impact import experiment as impact
from hrc_env.experiments.lab import experiment as lab
from hrc_env.experiments.price import experiment as price
from hrc_env.experiments.site import experiment as site


@pytest.mark.parametrize(("short", "words"), [
    (tracking.QUICK, "8 seeds of 1.6 to 20 s: too few"),
    (replace(tracking.QUICK, n_seeds=70), "70 seeds of 1.6 to 20 s: too few"),
    (speed.QUICK, "1 round of 40 s: too few"),
    (baselines.BaselinesBench(1), "1 seed of 1.6 to 20 s: too few"),
    (lab.QUICK, "2 seeds of 4 s: too few"),
    (site.QUICK, "2 seeds of 6 s: too few"),
    (ablations.QUICK, "4 seeds of 5 s: too few"),
    (price.make_experiment(quick=True), "16 seeds of 10 s: too few"),
    (price.make_experiment(quick=True, seeds=12), "24 seeds of 10 s: too few"),
    (impact.make_experiment(quick=True), "8 seeds of 4 s: too few"),
    (impact.make_experiment(quick=True, seeds=90), "90 seeds of 4 s: too few"),
])  # fmt: skip
def test_short_forms_say_how_many_seeds_they_have_and_of_how_many_seconds(
    short: Any, words: str
) -> None:
    assert short.quick_note.startswith(f"Quick run, {words}")


@pytest.mark.parametrize("whole", [
    tracking.TrackingBench(), speed.SpeedBench(), baselines.BaselinesBench(), lab.Lab(),
    site.Site(), ablations.Ablations(), price.Price(), impact.Impact(),
])  # fmt: skip
def test_whole_forms_say_nothing_of_the_kind(whole: Any) -> None:
    assert whole.quick_note == ""
