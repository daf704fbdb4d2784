"""Estimators without memory: all views by weight, or the views that agree."""

import numpy as np
import pytest
from simulated import DT, LAB, Damage, detections, generators, keypoints, track, walk

from hrc_env.tracking.estimators import make_estimator


def error_m(estimates, joints):
    mean = np.stack([e.mean_world[:, 0] for e in estimates])
    return np.linalg.norm(mean - joints, axis=-1)


def test_without_gross_errors_both_are_the_same_and_with_them_only_ransac_holds():
    joints = walk(0, 60)[:, None]
    clean = detections(joints[:, 0], Damage(), 0)[:, None]
    gross = detections(joints[:, 0], Damage(outliers=0.1), 0)[:, None]
    names = ("triangulation", "ransac")
    plain, robust = (error_m(track(make_estimator(n, LAB, DT), clean), joints) for n in names)
    assert np.quantile(np.abs(plain - robust), 0.99) < 1e-3  # a fair pixel may miss the gate
    plain, robust = (error_m(track(make_estimator(n, LAB, DT), gross), joints) for n in names)
    assert np.sqrt((robust**2).mean()) < 0.6 * np.sqrt((plain**2).mean())
    assert np.quantile(robust, 0.9) < 0.04 < np.quantile(plain, 0.9)


@pytest.mark.parametrize("name", ["triangulation", "ransac"])
def test_a_view_counts_by_the_inverse_of_its_variance(name):
    joints = np.repeat(walk(1, 1), 400, 0)
    rng = np.random.default_rng(0)
    sigma_px = np.array([1.0, 1.0, 20.0, 20.0])[:, None]
    exact = detections(joints[:1], Damage(sigma_px=0.0), 0)
    noise = sigma_px[..., None] * rng.standard_normal((400, 4, 15, 2))
    e, rngs = make_estimator(name, LAB, DT), generators(1)
    state, errors = e.init(1, 1), []
    for px in exact + noise:
        e.predict(state, DT, rngs)
        e.update(
            state,
            keypoints(px[None], np.broadcast_to(sigma_px[None, :, None], (1, 4, 1, 15))),
            rngs,
        )
        errors.append(e.estimate(state).mean_world[0, 0] - joints[0])
    alone = make_estimator(name, LAB[:2], DT)
    two = track(alone, (exact + noise)[:, None, :2], 1.0)
    rmse = np.sqrt(np.mean(np.square(errors[1:])))
    assert rmse < 1.02 * np.sqrt(
        np.mean(np.square([t.mean_world[0, 0] - joints[0] for t in two[1:]]))
    )


@pytest.mark.parametrize("name", ["triangulation", "ransac"])
def test_a_joint_moves_only_when_two_views_make_a_point(name):
    px = detections(walk(2, 20), Damage(), 2)[:, None]
    px[10:, :, 1:, 5] = np.nan
    estimates = track(make_estimator(name, LAB, DT), px)
    held, moved = (estimates[-1].mean_world - estimates[9].mean_world)[0, 0, [5, 6]]
    assert (held == 0).all()
    assert (moved != 0).all()
    assert estimates[-1].age_s[0, 0, 5] == pytest.approx(10 * DT)
