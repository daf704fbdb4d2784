"""BlazePose's arithmetic: against the official package, and its invariances."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stored import PICTURES

from hrc_env.core.records import Roi
from hrc_env.perception import blazepose as bp
from hrc_env.perception.network import load_landmarker, load_person_detector

coordinates = st.floats(-500, 500)
angles = st.floats(-math.pi, math.pi)


def logit(p):
    return math.log(p / (1 - p))


def find(picture, detect, landmark):
    """Both stages on a whole picture: (35, 3) px and visibility, and the person flag."""
    image, square = bp.detector_input(picture)
    person = bp.decode_people(*detect(image))[0]
    window = bp.person_window(person, square)
    points, flag, heat = landmark(bp.landmark_input(bp.crop_window(picture, window)))
    found = bp.decode_landmarks(points, heat)
    found[:, :2] = bp.to_image(found[:, :2], window)
    return found, flag


@pytest.mark.parametrize("name", PICTURES)
def test_landmarks_agree_with_the_official_package(name, weights, pictures, reference):
    found, flag = find(pictures[name], load_person_detector(), load_landmarker())
    error_px = np.linalg.norm(found[:33, :2] - reference[name][:, :2], axis=1)
    assert flag > 0.9
    assert np.median(error_px) < 0.05
    assert np.percentile(error_px, 90) < 0.5
    assert error_px.max() < 1.0  # where the heatmap is just sure or just not, little moves it
    np.testing.assert_allclose(found[:33, 2], reference[name][:, 2], atol=0.02)


def test_a_region_of_interest_found_again_from_its_landmarks_finds_the_same(
    weights, pictures, reference
):
    landmark = load_landmarker()
    found, _ = find(pictures["walk.png"], load_person_detector(), landmark)
    window = bp.window_from_points(found[33, :2], found[34, :2])
    picture = bp.crop_window(pictures["walk.png"], window)
    points, _, heat = landmark(bp.landmark_input(picture))
    again = bp.to_image(bp.decode_landmarks(points, heat)[:33, :2], window)
    stature_px = np.ptp(reference["walk.png"][:, 1])
    assert np.median(np.linalg.norm(again - found[:33, :2], axis=1)) < 0.01 * stature_px


def test_an_empty_room_holds_nobody(weights):
    image, _ = bp.detector_input(np.full((240, 320, 3), 128, np.uint8))
    assert bp.decode_people(*load_person_detector()(image)) == []


def test_anchors_cover_the_image_symmetrically():
    assert bp.ANCHORS.shape == (2254, 2)
    np.testing.assert_allclose(np.sort(bp.ANCHORS[:, 0]), np.sort(1 - bp.ANCHORS[:, 0]))


@settings(max_examples=50, deadline=None)
@given(coordinates, coordinates, st.floats(1, 300), angles)
def test_the_window_turns_with_the_body(x, y, radius, angle):
    """A body upright in the image has a window without rotation; leaning right turns it so."""
    rim = np.array([x + radius * math.sin(angle), y - radius * math.cos(angle)])
    window = bp.window_from_points(np.array([x, y]), rim)
    assert abs(bp.wrap_angle(window.rotation_rad - angle)) < 1e-6
    assert window.side_px == pytest.approx(2.5 * radius)


@settings(max_examples=50, deadline=None)
@given(coordinates, coordinates, st.floats(1, 300), angles)
def test_the_rim_lies_straight_above_the_middle_of_its_window(x, y, radius, angle):
    centre = np.array([x, y])
    rim = centre + radius * np.array([math.sin(angle), -math.cos(angle)])
    window = bp.window_from_points(centre, rim)
    np.testing.assert_allclose(bp.to_image(np.array([0.5, 0.5 - 0.4]), window), rim, atol=1e-6)


@settings(max_examples=20, deadline=None)
@given(angles)
def test_turning_the_window_turns_the_crop_back(angle):
    """A dot at a place of the window appears at that place of the crop, however it is turned."""
    window = Roi((150.0, 140.0), 160.0, angle)
    place = np.array([0.7, 0.35])
    x, y = bp.to_image(place, window)
    rows, columns = np.mgrid[:300, :300] + 0.0
    dot = np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / 50)
    picture = np.repeat((255 * dot).astype(np.uint8)[:, :, None], 3, axis=2)
    crop = bp.crop_window(picture, window)[:, :, 0].astype(float)
    rows, columns = np.mgrid[:256, :256] + 0.0
    centre = np.array([(crop * columns).sum(), (crop * rows).sum()]) / crop.sum()
    np.testing.assert_allclose(centre / 256, place, atol=0.002)


def test_overlapping_detections_become_their_weighted_mean():
    score = np.array([0.9, 0.6, 0.8])
    box = np.array([[0.1, 0.1, 0.3, 0.3], [0.12, 0.1, 0.32, 0.3], [0.7, 0.7, 0.9, 0.9]])
    keypoints = np.tile(box[:, None, :2], (1, 2, 1))
    first, second = bp.merge_people(score, box, keypoints)
    assert first.score == 0.9
    assert first.hip[0] == pytest.approx((0.9 * 0.1 + 0.6 * 0.12) / 1.5)
    np.testing.assert_allclose(second.box, box[2])


def test_the_heatmap_moves_a_landmark_where_it_is_sure():
    points, heat = np.zeros((39, 5), np.float32), np.full((64, 64, 39), -20, np.float32)
    points[:, :2] = 100.0  # cell 25 of 64
    heat[27, 24, 0] = logit(0.9)  # row 27, column 24, landmark 0: sure
    heat[27, 24, 1] = logit(0.4)  # landmark 1: not sure enough
    found = bp.decode_landmarks(points, heat)
    np.testing.assert_allclose(found[0, :2], [24 / 64, 27 / 64], atol=1e-5)
    np.testing.assert_allclose(found[1, :2], [100 / 256, 100 / 256])
    assert found[0, 2] == 0.5


def test_a_landmark_outside_the_heatmap_stays_where_it_is():
    points, heat = np.zeros((39, 5), np.float32), np.full((64, 64, 39), 5, np.float32)
    points[:, 0] = -30.0
    found = bp.decode_landmarks(points, heat)
    np.testing.assert_allclose(found[:, 0], -30 / 256)
