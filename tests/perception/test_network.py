"""The networks: what is cut out changes nothing, and every copy says the same."""

import numpy as np

from hrc_env.core.records import Roi
from hrc_env.perception import network
from hrc_env.perception.blazepose import crop_window, detector_input, landmark_input
from hrc_env.perception.network import LANDMARK_OUTPUTS, load_landmarker, load_person_detector

MIDDLE = Roi((118.0, 138.0), 220.0, 0.1)


def test_the_pruned_network_gives_the_bits_of_the_whole_one(weights, pictures):
    content = weights["pose_landmark_full"].read_bytes()
    whole = network.load_tflite(content, LANDMARK_OUTPUTS)
    pruned = network.load_tflite(network.prune(content, LANDMARK_OUTPUTS), LANDMARK_OUTPUTS)
    for picture in pictures.values():
        image = landmark_input(crop_window(picture, MIDDLE))
        for ours, theirs in zip(pruned(image), whole(image), strict=True):
            np.testing.assert_array_equal(ours, theirs)


def test_pruning_leaves_a_smaller_file(weights):
    content = weights["pose_landmark_full"].read_bytes()
    assert len(network.prune(content, LANDMARK_OUTPUTS)) < len(content)


def test_two_copies_of_a_network_agree_bit_for_bit(weights, pictures):
    picture = next(iter(pictures.values()))
    image, _ = detector_input(picture)
    for ours, theirs in zip(
        load_person_detector()(image), load_person_detector()(image), strict=True
    ):
        np.testing.assert_array_equal(ours, theirs)


def test_results_do_not_change_when_the_network_runs_again(weights, pictures):
    landmark = load_landmarker()
    images = [landmark_input(crop_window(picture, MIDDLE)) for picture in pictures.values()]
    first = landmark(images[0])[0].copy()
    kept = landmark(images[0])[0]
    landmark(images[1])
    np.testing.assert_array_equal(kept, first)
