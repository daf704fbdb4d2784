"""The emulator plays clips, and what it is off is closed; no pixels are needed for that."""

from dataclasses import replace

import numpy as np
import pytest

from assets.emulator import matching, validate
from assets.emulator.clips import find_family, list_fit_clips
from assets.emulator.samples import make_samples, read_postures
from assets.emulator.validate import (
    Compared,
    by_family,
    error_ratios,
    errors_in_image,
    outcome,
)
from assets.emulator.watch import watch
from assets.emulator.writing import write_calibration
from docs import tables
from hrc_env.config import HRCConfig
from hrc_env.perception.calibration import POSTURES, read_calibration
from hrc_env.perception.emulator import EmulatorConfig

ALL = [
    clip for clip in list_fit_clips(0, 3) if find_family(clip.motion) in ("stand", "walk", "fold")
]
MOTIONS = ("stand", "walk 1.1 m/s", "squat", "kneel")
CLIPS = [next(clip for clip in ALL if clip.motion == motion) for motion in MOTIONS]


@pytest.fixture(scope="module")
def played():
    """The clips as the package's own emulator plays them."""
    return list(watch("keypoints", CLIPS, HRCConfig()))


def played_with(path, calibration, clips=CLIPS):
    write_calibration(path, calibration, {})
    config = replace(HRCConfig(), emulator=EmulatorConfig(calibration=str(path)))
    return list(watch("keypoints", clips, config))


def test_every_clip_draws_errors_of_its_own(played):
    errors = [np.nan_to_num(errors_in_image(each)).ravel() for each in played]
    for k in range(1, len(errors)):
        assert abs(np.corrcoef(errors[0], errors[k])[0, 1]) < 0.5
    (again,) = watch("keypoints", CLIPS[:1], HRCConfig())
    np.testing.assert_array_equal(again.px, played[0].px)
    (other,) = watch("keypoints", [replace(CLIPS[0], draw=1)], HRCConfig())
    assert not np.array_equal(other.px, played[0].px, equal_nan=True)


def test_postures_are_shares_and_the_clips_have_them_all(played):
    shares = np.concatenate([read_postures(each) for each in played])
    assert shares.shape[1] == len(POSTURES)
    np.testing.assert_allclose(shares.sum(1), 1.0)
    assert (shares.max(0) > 0.8).all()
    np.testing.assert_array_equal(make_samples(played).posture[0], read_postures(played[0])[10:])


def test_a_file_that_is_written_anew_is_read_anew(tmp_path):
    known, path = read_calibration(), tmp_path / "one.json"
    small, large = (
        np.nanmedian([errors_in_image(each) for each in played_with(path, calibration)])
        for calibration in (known, replace(known, size=3.0 * known.size))
    )
    assert large > 1.8 * small


def test_ratios_of_errors_have_intervals_over_clips(played, monkeypatch):
    twice = [
        [replace(each, mean_world=2.0 * each.mean_world - each.joints_world)] * 2 for each in played
    ]
    families = by_family(CLIPS, [[each] for each in played], twice)
    seen = Compared(CLIPS, played, twice, families)
    monkeypatch.setattr(validate, "compared", lambda *_: seen)
    metrics = error_ratios()
    asked = tables.asked("emulator")
    assert {name for name in asked if name.split(".")[1] in families} <= metrics.keys()
    for family in families:
        for name in (f"emulator_error_ratio.{family}", f"emulator_error_ratio.{family}.p95"):
            assert metrics[name].value == pytest.approx(2.0, rel=0.05)
        less = metrics[f"emulator_coverage_difference.{family}"]
        pixels, emulated = families[family]
        assert less.value == pytest.approx(emulated.coverage - pixels.coverage)
        assert less.value < 0.0


@pytest.mark.parametrize(
    ("clips", "few"),
    [
        (CLIPS, {"IN_SPACE": 1, "DRAWS": 1, "OFTEN": 500}),
        pytest.param(ALL, {}, marks=pytest.mark.slow),
    ],
    ids=["few", "all"],
)
def test_errors_that_are_too_small_and_too_short_are_mended(clips, few, tmp_path, monkeypatch):
    for name, value in few.items():
        monkeypatch.setattr(matching, name, value)
    known, played = read_calibration(), list(watch("keypoints", clips, HRCConfig()))
    draft = replace(
        known, size=0.6 * known.size, wander_m=0.6 * known.wander_m,
        slow_s=0.4 * known.slow_s, slow_m=0.4 * known.slow_m,
    )  # fmt: skip
    told: list[float] = []
    mended = matching.matched(
        draft, clips, played, tmp_path / "draft.json", lambda share, label: told.append(share)
    )
    path = tmp_path / "one.json"
    wrong, right = (played_with(path, each, clips) for each in (draft, mended))
    median = outcome(played).px_median
    assert outcome(wrong).px_median < 0.8 * median
    assert outcome(right).px_median == pytest.approx(median, rel=0.15)
    assert 0.65 < mended.slow_s / known.slow_s < 1.3
    assert mended.slow_m / known.slow_m == pytest.approx(mended.slow_s / known.slow_s)
    assert sum(told) == pytest.approx(1.0)
    assert not (tmp_path / "draft.json").exists()
