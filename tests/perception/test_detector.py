"""Eyes: crops in, keypoints out, whoever does the work."""

import pickle
import subprocess
import time

import numpy as np
import pytest
from stored import Stills, hung_in_a_room

from hrc_env.core.errors import ConfigError, WeightsError
from hrc_env.core.records import Roi
from hrc_env.core.skeleton import BLAZEPOSE_INDEX
from hrc_env.geometry.cameras import pinhole
from hrc_env.perception import detector as detector_module
from hrc_env.perception.detector import DetectorConfig, PoseDetector
from hrc_env.perception.network import load_landmarker
from hrc_env.perception.searching import search_windows

NAMES = ["stand.png", "walk.png", "reach.png", "robot_in_front.png"]
WINDOW = Roi((118.0, 138.0), 220.0, 0.0)


def camera(width_px=256, height_px=256):
    return pinhole("still", np.array([4.0, 0, 1]), np.array([0, 0, 1.0]), 60, width_px, height_px)


def new_detector(n_cameras, config=None, **size):
    return PoseDetector([camera(**size)] * n_cameras, config)


@pytest.fixture
def four(weights, pictures):
    """Eyes of four cameras that each see another picture."""
    detector = new_detector(4)
    yield detector, Stills(pictures[name] for name in NAMES)
    detector.close()


def test_every_camera_reports_the_joints_of_its_picture(four, reference):
    detector, stills = four
    sight = detector.detect(stills, [WINDOW] * 4)
    for c, name in enumerate(NAMES):
        official = reference[name][BLAZEPOSE_INDEX, :2]
        stature_px = np.ptp(official[:, 1])
        error = np.linalg.norm(sight.px[c] - official, axis=1) / stature_px
        assert np.median(error) < 0.03, name
    assert np.all(sight.sigma_px > 0)
    assert np.all((sight.confidence > 0) & (sight.confidence <= 1))


def test_an_empty_room_is_nan_without_confidence_and_with_infinite_sigma(four, pictures):
    detector, _ = four
    room = np.full((256, 256, 3), 128, np.uint8)
    sight = detector.detect(Stills([pictures["stand.png"], room, room, room]), [WINDOW] * 4)
    assert np.isfinite(sight.px[0]).all()
    assert np.isnan(sight.px[1:]).all()
    assert np.all(sight.confidence[1:] == 0)
    assert np.all(np.isinf(sight.sigma_px[1:]))


def test_a_camera_without_a_window_does_not_look(four):
    detector, stills = four
    sight = detector.detect(stills, [WINDOW, None, WINDOW, None])
    assert np.isfinite(sight.px[[0, 2]]).all()
    assert np.isnan(sight.px[[1, 3]]).all()


def test_without_any_window_the_eyes_search_the_whole_image(weights, pictures, reference):
    detector = new_detector(1, width_px=1920, height_px=1080)
    for left, top in ((40, 300), (700, 200), (1200, 400)):
        sight = detector.detect(Stills([hung_in_a_room(pictures["walk.png"], left, top)]), [None])
        found = (sight.px[0] - [left, top]) / 2
        official = reference["walk.png"][BLAZEPOSE_INDEX, :2]
        error = np.linalg.norm(found - official, axis=1) / np.ptp(official[:, 1])
        assert np.median(error) < 0.02
        assert sight.windows[0] is not None
    detector.close()


def test_one_search_serves_several_workers(weights, pictures):
    """The second look is given whom the search found, and may not take the first one's person."""
    detector = new_detector(1, width_px=1920, height_px=1080)
    room = Stills([hung_in_a_room(pictures["stand.png"], 600, 300)])
    people = detector.search(room)
    searching = detector.detect(room, [None], track=0)
    given = detector.detect(room, [None], track=1, found=people)
    np.testing.assert_array_equal(given.px, searching.px)
    other = detector.detect(room, [None], track=2, others=[given.windows], found=people)
    assert np.isnan(other.px).all()
    assert other.windows == [None]
    detector.close()


def test_one_person_in_two_search_windows_is_one_person(weights, pictures):
    detector = new_detector(1, width_px=1920, height_px=1080)
    room = hung_in_a_room(pictures["stand.png"], 600, 300)  # in the first and second square
    (people,) = detector.search(Stills([room]))
    assert len(people) == 1
    detector.close()


def test_search_windows_cover_the_image_and_overlap():
    windows = search_windows(camera(1920, 1080))
    assert [w.side_px for w in windows] == [1080.0] * 3
    assert windows[0].centre_px == (540.0, 540.0)
    assert windows[-1].centre_px == (1380.0, 540.0)
    assert len(search_windows(camera(500, 500))) == 1
    assert search_windows(camera(1080, 1920))[0].centre_px == (540.0, 540.0)


def test_what_is_seen_does_not_depend_on_who_does_the_work(four):
    """Slow crops leave everything to the helper, fast ones half to each thread."""
    detector, stills = four

    class Slow:
        def crop(self, camera_index, window):
            time.sleep(0.03)
            return stills.crop(camera_index, window)

    first = detector.detect(stills, [WINDOW] * 4, track=0)
    for track, source in enumerate((Slow(), stills, Slow()), start=1):
        again = detector.detect(source, [WINDOW] * 4, track=track)
        np.testing.assert_array_equal(again.px, first.px)
        np.testing.assert_array_equal(again.confidence, first.confidence)


def test_a_source_may_use_one_buffer_for_all_crops(four):
    detector, stills = four
    buffer = np.empty((256, 256, 3), np.uint8)

    class Frugal:
        def crop(self, camera_index, window):
            buffer[:] = stills.crop(camera_index, window)
            return buffer

    first, again = (
        detector.detect(stills, [WINDOW] * 4, 0),
        detector.detect(Frugal(), [WINDOW] * 4, 1),
    )
    np.testing.assert_array_equal(again.px, first.px)


def test_what_a_camera_does_not_see_is_black_and_joints_there_are_guesses(weights, pictures):
    """The source goes on drawing beyond the image's lower border; the detector do not look."""
    detector = PoseDetector([camera(256, 190)])
    sight = detector.detect(Stills([pictures["stand.png"]]), [WINDOW])
    outside = sight.px[0, :, 1] >= 190
    assert outside.any()
    assert np.all(sight.confidence[0, outside] <= 0.1)
    assert np.all(np.isfinite(sight.sigma_px[0]))
    assert sight.sigma_px[0, outside].min() > 3 * sight.sigma_px[0].min()
    detector.close()


def test_the_detector_stage_is_asked_of_a_new_track_and_then_in_turns(four, monkeypatch):
    _, stills = four
    asked = []
    find = detector_module.find_people
    monkeypatch.setattr(
        detector_module, "find_people", lambda *args: asked.append(1) or find(*args)
    )
    detector = new_detector(4, DetectorConfig(check_every=4, check_presence=0.5))
    counts = []
    for _ in range(9):
        asked.clear()
        detector.detect(stills, [WINDOW] * 4)
        counts.append(len(asked))
    assert counts[0] == 4
    assert counts[1:] == [1] * 8  # one of four cameras each time
    detector.forget(0)
    asked.clear()
    detector.detect(stills, [WINDOW] * 4)
    assert len(asked) == 4
    detector.close()


def test_somebody_far_from_the_middle_of_the_window_is_somebody_else(weights, pictures):
    detector = new_detector(1)
    aside = Roi((0.0, 138.0), 240.0, 0.0)
    assert np.isnan(detector.detect(Stills([pictures["stand.png"]]), [aside]).px).all()
    detector.close()


def test_an_error_of_the_source_is_passed_on_and_the_eyes_go_on(four):
    detector, stills = four

    class Broken:
        def crop(self, camera_index, window):
            if camera_index == 2:
                raise OSError("no picture")
            return stills.crop(camera_index, window)

    with pytest.raises(OSError, match="no picture"):
        detector.detect(Broken(), [WINDOW] * 4)
    assert np.isfinite(detector.detect(stills, [WINDOW] * 4).px).all()


def test_a_detector_can_be_pickled_and_closed_at_any_time(four):
    detector, stills = four
    first = detector.detect(stills, [WINDOW] * 4)
    copy = pickle.loads(pickle.dumps(detector))
    detector.close()
    detector.close()
    for each in (copy, detector):
        np.testing.assert_array_equal(each.detect(stills, [WINDOW] * 4).px, first.px)
    copy.close()


def test_folded_workers_have_a_network_of_their_own(four, monkeypatch):
    """Here the same one, told apart by what it is asked."""
    _, stills = four
    asked = []

    def load(network, runtime):
        landmark = load_landmarker("full", runtime)
        return lambda image: asked.append(network) or landmark(image)

    monkeypatch.setattr(detector_module.network, "load_landmarker", load)
    monkeypatch.setattr(detector_module, "fetch_weights", lambda names: names)
    detector = new_detector(4, DetectorConfig(folded_network="heavy"))
    detector.detect(stills, [WINDOW] * 4)
    assert set(asked) == {"full"}
    asked.clear()
    detector.detect(stills, [WINDOW] * 4, folded=True)
    assert set(asked) == {"heavy"}
    detector.close()


def test_a_network_that_there_is_not_is_told_those_that_there_are():
    with pytest.raises(ConfigError, match="Did you mean 'heavy'"):
        DetectorConfig(folded_network="heavvy")


def test_wrong_shapes_are_explained(four):
    detector, stills = four
    with pytest.raises(ConfigError, match="one entry per camera"):
        detector.detect(stills, [WINDOW] * 3)

    class Small:
        def crop(self, camera_index, window):
            return np.zeros((128, 128, 3), np.uint8)

    with pytest.raises(ConfigError, match=r"\(256, 256, 3\)"):
        detector.detect(Small(), [WINDOW] * 4)


def test_eyes_without_weights_and_network_say_so_at_once(tmp_path, monkeypatch):
    monkeypatch.setenv("HRC_ENV_CACHE", str(tmp_path))
    failed = subprocess.CompletedProcess([], 1, "", "ERROR: no route to host")
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: failed)
    with pytest.raises(WeightsError, match="no route to host") as error:
        new_detector(1)
    for part in (
        "python -m hrc_env setup",
        "Without a network connection, copy",
        "perception='keypoints'",
    ):
        assert part in str(error.value)
