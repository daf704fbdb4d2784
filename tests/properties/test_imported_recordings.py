"""Recordings that nothing was fitted on: pixels see them, and the emulator errs as much.

Each is imported by `hrc_env.mocap`, played by workers in both scenes, and tracked by the default.
"""

import pytest
from figures import Figure

from assets.emulator.clips import UNSEEN_RIG, UNSEEN_SEEDS, list_recorded_clips
from assets.emulator.recorded import MADE
from assets.emulator.validate import accuracy, apart, compared, in_space
from hrc_env.config import HRCConfig

FRESH_SEED = UNSEEN_SEEDS + 4900
"""Bounds come from `UNSEEN_SEEDS` itself."""


@pytest.mark.long
def test_recordings_are_seen_as_the_repertoire_is(figures, pixels):
    """Intervals are bootstraps over clips, one of each recording in each scene."""
    clips = list_recorded_clips("validated", 1, FRESH_SEED, (UNSEEN_RIG,))
    assert len([clip for clip in clips if clip.motion not in MADE]) >= 40
    seen = compared(clips, lambda share, label: None, HRCConfig(), None)
    by_pixels = [in_space([each]) for each in seen.pixels]
    median_mm, _, coverage = accuracy(by_pixels)
    off = apart("all", by_pixels, [in_space(each) for each in seen.emulated])
    figures.hold(
        Figure("imported.median_mm", median_mm, most=26.0),
        Figure("imported.coverage", coverage, least=0.9),
        Figure("imported.emulator_over_pixels", off["emulator_error_ratio.all"], 0.85, 1.15),
        Figure("imported.emulator_less_pixels_coverage",
               off["emulator_coverage_difference.all"], -0.03, 0.06),
    )  # fmt: skip
