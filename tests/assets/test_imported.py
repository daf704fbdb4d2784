"""Recordings are played before the cameras as they were recorded."""

import numpy as np
import pytest

from assets.emulator.clips import DT_S, UNSEEN_RIG, find_family, list_recorded_clips
from assets.emulator.recorded import MADE, RECORDINGS, perform_clip, recording
from hrc_env.motion.repertoire import SCENES
from hrc_env.worker.body import load_body

BROAD, SHORT = "made-broad", "made-short"


def test_no_recording_is_called_as_a_motion_of_the_repertoire():
    assert not RECORDINGS.keys() & SCENES.keys()
    assert {find_family(name) for name in RECORDINGS} == {"recorded"}
    people = [name for name, role in RECORDINGS.items() if role == "validated" and name not in MADE]
    assert len(people) >= 20


def test_clips_of_recordings_are_of_one_role_in_both_scenes():
    clips = list_recorded_clips("validated", 2, 0, (UNSEEN_RIG,))
    assert {RECORDINGS[clip.motion] for clip in clips} == {"validated"}
    for name in {clip.motion for clip in clips}:
        assert (
            sorted(clip.scene for clip in clips if clip.motion == name)
            == ["lab"] * 2 + ["site"] * 2
        )


@pytest.mark.parametrize("least_s", [0.5, 6.0])
def test_a_recording_goes_forth_and_back_if_it_is_short_and_never_faster(least_s):
    clip, body = recording(SHORT), load_body()
    lasts_s = len(clip.controls) / clip.fps
    played = perform_clip(clip, body, DT_S, (1.0, -2.0), 0.7, least_s).position_world[:, 0]
    assert len(played) == pytest.approx(max(lasts_s, least_s) / DT_S, abs=1)
    np.testing.assert_allclose(played[0, 0, :2], (1.0, -2.0), atol=0.02)
    often = perform_clip(clip, body, 1 / clip.fps, (1.0, -2.0), 0.7, 0.0).position_world[:, 0]
    fastest = np.linalg.norm(np.diff(often, axis=0), axis=-1).max(0) * clip.fps
    speed = np.linalg.norm(np.diff(played, axis=0), axis=-1).max(0) / DT_S
    assert (speed < 1.05 * fastest + 0.02).all()
    if least_s > 3.0 * lasts_s:
        back = round(0.5 * np.pi * lasts_s * 2 / DT_S)
        np.testing.assert_allclose(played[back], played[0], atol=0.05)
