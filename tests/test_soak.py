"""The soak's bookkeeping, on a short run and a long one."""

import json

import numpy as np
import pytest

from benchmarks import soak


def test_a_soak_of_several_workers_says_how_well_they_are_told_apart(tmp_path):
    out = tmp_path / "results.json"
    soak.main(soak.Arguments(out, 600, 2, workers=2, perception="truth", episodes=1))
    metrics = json.loads(out.read_text())["metrics"]
    assert metrics["id_switches"]["value"] == 0
    assert metrics["idf1"]["value"] == 1
    assert metrics["nans"]["value"] == 0


@pytest.mark.parametrize(
    ("steps", "num_envs", "perception"),
    [(1200, 4, "truth"), pytest.param(320_000, 64, "keypoints", marks=pytest.mark.long)],
)
def test_a_soak_counts_nothing_wrong(steps, num_envs, perception, tmp_path):
    out = tmp_path / "results.json"
    soak.main(soak.Arguments(out, steps, num_envs, perception=perception, episodes=1))
    metrics = json.loads(out.read_text())["metrics"]
    assert metrics["steps"]["value"] == steps
    assert metrics["nans"]["value"] == 0
    assert metrics["resident_memory"]["value"] > 50


def test_what_is_no_number_and_what_is_lacking_is_counted():
    everyone, lost = np.ones(3, bool), np.array([0.0, 1.0, 0.0])
    infos = {
        "cost": np.array([0.0, np.nan, np.inf]),
        "_cost": everyone,
        "tracking/lost": lost,
        "_tracking/lost": everyone,
        "tracking/mpjpe_m": np.zeros(3),
        "_tracking/mpjpe_m": np.array([True, False, False]),
    }
    assert soak.lacking(infos, everyone) == 3
    assert soak.lacking(infos, np.array([True, True, False])) == 2


def test_growth_is_counted_from_the_warm_up_on():
    notes = soak.Notes([(500_000, 100.0), (1_000_000, 110.0), (2_000_000, 111.0)])
    assert notes.warm() == [110.0, 111.0]
    short = soak.Notes([(10, 1.0), (100, 2.0), (1000, 3.0)])
    assert short.warm() == [2.0, 3.0]
