"""What is judged was not fitted: neither the bodies, nor the motions, nor the scene."""

from dataclasses import replace

import numpy as np
import pytest

from assets.emulator import holdout
from assets.emulator.bodies import compute_spread, make_anatomical, make_unfitted
from assets.emulator.clips import FIT_RIGS, find_family, list_clips
from assets.emulator.validate import Compared, by_family
from assets.emulator.watch import watch
from assets.emulator.writing import write_calibration
from hrc_env.config import HRCConfig
from hrc_env.perception.calibration import read_calibration
from hrc_env.perception.emulator import EmulatorConfig
from hrc_env.worker.body import load_body

FITTED = (holdout.FITTED_BODIES, holdout.FITTED_MOTIONS, (holdout.FITTED_SCENE,))


@pytest.mark.parametrize("name", holdout.SAMPLES)
def test_clips_hold_out_what_their_name_says_and_nothing_else(name):
    fitted = list_clips(4, 0, FIT_RIGS, *FITTED)
    clips = holdout.SAMPLES[name].clips(4)
    shared = {
        "bodies": {clip.body for clip in fitted} & {clip.body for clip in clips},
        "motions": {clip.motion for clip in fitted} & {clip.motion for clip in clips},
        "scene": {clip.scene for clip in fitted} & {clip.scene for clip in clips},
    }
    held = set(shared) if name == "everything" else {name} & set(shared)
    assert {what for what, both in shared.items() if not both} == held
    assert {find_family(clip.motion) for clip in clips} == {
        find_family(clip.motion) for clip in fitted
    }


def test_joints_of_a_body_that_was_not_looked_at_follow_from_the_others():
    name, others = "worker_7", holdout.FITTED_BODIES
    body = make_unfitted(name, others)
    moved = body.joint_offset - make_anatomical(body).joint_offset
    mean = np.mean(
        [load_body(o).joint_offset - make_anatomical(load_body(o)).joint_offset for o in others], 0
    )
    np.testing.assert_allclose(moved, mean)
    apart_m = np.linalg.norm(body.joint_offset - load_body(name).joint_offset, axis=-1)
    assert 0 < apart_m.max() < 0.03
    np.testing.assert_array_equal(body.capsule_ends, load_body(name).capsule_ends)
    assert holdout.load_joints("worker_1") is load_body("worker_1")


def test_how_far_bodies_are_apart_is_of_those_that_were_fitted():
    fitted_m, both_m = compute_spread(holdout.FITTED_BODIES), compute_spread(holdout.HELD_BODIES)
    assert 1e-3 < np.median(fitted_m) < 0.01
    assert np.abs(fitted_m - both_m).max() > 1e-4


def test_errors_are_of_the_joints_that_are_asked_for():
    (clip,) = [c for c in holdout.SAMPLES["motions"].clips(1) if c.motion == "look round"]
    (seen,) = watch("keypoints", [clip], HRCConfig())
    off_m = np.linalg.norm(seen.landmarks_world - seen.joints_world, axis=-1)
    body = load_body(clip.body)
    exact_m = np.linalg.norm(body.joint_offset - make_anatomical(body).joint_offset, axis=-1)
    np.testing.assert_allclose(off_m, np.broadcast_to(exact_m, off_m.shape), atol=1e-6)
    near = replace(seen, mean_world=seen.joints_world + np.array([0.0, 0.0, 1e-3]))
    outcomes = by_family([clip], [[near]], [[seen]])
    found = dict(holdout.compute_metrics(Compared([clip], [near], [[seen]], outcomes)))
    assert found["joint.median.stand"].value == pytest.approx(1.0)
    assert found["joint.coverage.upright"].value == 1.0
    assert found["landmark.median.all"].value == pytest.approx(1e3 * np.median(off_m[10:]), abs=1.0)


def test_estimates_are_put_right_by_the_calibration_that_was_chosen(tmp_path):
    known, (clip,) = read_calibration(), holdout.SAMPLES["motions"].clips(1)[:1]
    higher = replace(known, offset_m=known.offset_m + np.array([0.0, 0.0, 0.1]))
    write_calibration(tmp_path / "higher.json", higher, {})
    config = replace(
        HRCConfig(), emulator=EmulatorConfig(calibration=str(tmp_path / "higher.json"))
    )
    usual, there = (next(watch("keypoints", [clip], each)) for each in (HRCConfig(), config))
    up_px = np.nanmedian((there.px - usual.px)[..., 1])
    assert up_px < -5.0  # the detector means joints to be higher,
    error_m = [
        np.linalg.norm(each.mean_world - each.joints_world, axis=-1) for each in (usual, there)
    ]
    assert np.median(error_m[1]) < np.median(error_m[0]) + 0.01  # and the estimate knows
