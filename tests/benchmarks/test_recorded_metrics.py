"""Measures that need no truth, held against recordings whose truth is known."""

import numpy as np
import pytest
from recorded_stored import SIGMA_PX, recording

from benchmarks.recorded.metrics import (
    Track,
    bone_std,
    follow,
    foretell,
    jerk,
    summarize_foretold,
)
from hrc_env.core.skeleton import MIRROR


def test_a_camera_that_was_held_out_is_foretold_within_the_claimed_region():
    rig, _, detections = recording(n_frames=100)  # ten blocks
    metrics = summarize_foretold(foretell("kalman", rig.P, rig.tracker, detections))
    assert metrics["px.median"].value < 4 * SIGMA_PX
    assert metrics["px.median"].low <= metrics["px.median"].value <= metrics["px.median"].high
    assert metrics["coverage95"].value > 0.85
    assert metrics["px.p95"].n == 100 * 4 * 15


def test_sides_that_the_held_out_detector_exchanged_count_only_in_the_plain_measure():
    rig, _, detections = recording(n_frames=60)
    detections.px[30:50, 1] = detections.px[30:50, 1][:, MIRROR]
    metrics = summarize_foretold(foretell("kalman", rig.P, rig.tracker, detections))
    assert metrics["px.p95"].value > 2 * metrics["either_px.p95"].value


def test_detections_that_are_not_sure_are_no_yardstick():
    rig, _, detections = recording(n_frames=30)
    detections.px[:, 2, 5] += 500
    detections.confidence[:, 2, 5] = 0.2
    foretold = foretell("kalman", rig.P, rig.tracker, detections)
    assert np.isnan(foretold.off_px[:, 2, 5]).all()
    assert foretold.off_px[:, 2, 4].max() < 200


def test_rigid_bodies_have_no_bone_spread_and_even_motion_no_jerk():
    n_frames = 20
    body = np.random.default_rng(0).standard_normal((15, 3))
    joints = body + np.arange(n_frames)[:, None, None] * [0.01, 0.02, 0.0]
    track = Track(joints, np.ones((n_frames, 15, 3, 3)), np.ones(20, bool))
    assert bone_std(track).value == pytest.approx(0, abs=1e-12)
    assert jerk(track, 0.04).value == pytest.approx(0, abs=1e-6)
    shaken = joints + 0.001 * np.random.default_rng(1).standard_normal(joints.shape)
    assert jerk(Track(shaken, track.cov_world, track.tracked), 0.04).value > 10


def test_a_track_is_near_the_truth():
    rig, joints, detections = recording(n_frames=50)
    track = follow("kalman", rig.P, rig.tracker, detections, [0, 1, 2, 3])
    assert track.tracked[5:].all()
    assert np.linalg.norm(track.mean_world - joints, axis=-1)[10:].mean() < 0.03
