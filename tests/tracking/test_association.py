"""Whose pose is it: people who pass, hide each other, come, go and are not there at all."""

import numpy as np
import pytest
from crossing import passing, poses, shuffled, stack, standing
from hypothesis import given, settings
from hypothesis import strategies as st
from simulated import DT, LAB, generators

from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.tracking.config import TrackerConfig
from hrc_env.tracking.estimators import make_estimator
from hrc_env.tracking.oracle import estimate_prior
from hrc_env.tracking.people.association import AssociationConfig, associate

PLACES = [(0.3, -1.2), (1.2, 0.9), (1.6, -0.6), (0.2, 0.7)]


def frame(keypoints, t, **parts):
    """One frame of keypoints (T, B, C, D, J, ...), some of its fields exchanged."""
    fields = {name: getattr(keypoints, name)[t] for name in ("px", "confidence", "sigma_px")}
    return Keypoints(**{**fields, **parts})


def follow(keypoints, n_workers, estimator="particle"):
    """Sort, track, repeat: estimates of every frame of keypoints (T, B, C, D, J, ...)."""
    e, batch = make_estimator(estimator, LAB, DT), keypoints.px.shape[1]
    rngs = generators(batch)
    state = e.init(batch, n_workers)
    e.reset(state, np.arange(batch), rngs)
    estimates = []
    for t in range(len(keypoints.px)):
        e.predict(state, DT, rngs)
        e.update(state, associate(LAB, frame(keypoints, t), e.estimate(state)).keypoints, rngs)
        estimates.append(e.estimate(state))
    return estimates


def errors(estimates, people):
    """(T, B, W, n) mean joint errors of every track with every one of people (T, B, n, J, 3)."""
    mean = np.stack([e.mean_world for e in estimates])
    return np.linalg.norm(mean[:, :, :, None] - people[:, :, None], axis=-1).mean(-1)


def tracked(estimates):
    """(T, B, W)."""
    return np.stack([e.tracked for e in estimates])


def known(people, std_m=0.05):
    """A belief (1, W, ...) in the places of people (W, J, 3)."""
    shape = (1, *people.shape[:2])
    cov = np.tile(std_m**2 * np.eye(3), (*shape, 1, 1))
    zero = np.zeros(shape)
    return PoseEstimate(people[None], cov, np.zeros((*shape, 3)), zero, np.ones(shape[:2], bool))


def nobody(n_workers):
    """A belief (1, W, ...) of people whom nobody has seen."""
    return estimate_prior(1, n_workers, TrackerConfig())


def blank(keypoints, cameras):
    """One frame (1, C, D, J, ...) in which some cameras see nobody."""
    px, confidence, sigma = (
        getattr(keypoints, name).copy() for name in ("px", "confidence", "sigma_px")
    )
    px[:, cameras], confidence[:, cameras] = np.nan, 0.0
    sigma[:, cameras] = np.inf
    return Keypoints(px, confidence, sigma)


@pytest.mark.parametrize("block", range(5))
def test_two_people_who_pass_each_other_keep_their_identity(block):
    """Twenty seeds at a time walk past at 0.6 m, hide each other, and vanish for a while."""
    seeds = range(20 * block, 20 * block + 20)
    people = [passing(seed) for seed in seeds]
    seen = stack([shuffled(poses(p, s), s) for p, s in zip(people, seeds, strict=True)])
    estimates = follow(seen, 2)
    error = errors(estimates, np.stack(people, 1))
    who = error.argmin(-1)
    assert tracked(estimates)[5:].all()
    assert (who[5:] == who[5]).all()
    assert (who[5].sum(-1) == 1).all()
    assert np.median(error.min(-1)) < 0.03


@pytest.mark.parametrize("estimator", ["kalman", "paper", "triangulation"])
def test_identity_is_kept_whichever_estimator_predicts(estimator):
    people = [passing(seed) for seed in range(3)]
    seen = stack([shuffled(poses(p, s), s) for s, p in enumerate(people)])
    who = errors(follow(seen, 2, estimator), np.stack(people, 1)).argmin(-1)
    assert (who[5:] == who[5]).all()


def test_one_of_two_hidden_from_everyone_where_they_meet_is_not_taken_for_the_other():
    """Half a second in which no camera has a pose of the second person."""
    seeds = range(12)
    people = [passing(seed) for seed in seeds]
    seen = [poses(p, s) for p, s in zip(people, seeds, strict=True)]
    for each in seen:
        each.px[44:56, :, 1] = np.nan
        each.confidence[44:56, :, 1], each.sigma_px[44:56, :, 1] = 0.0, np.inf
    who = errors(
        follow(stack([shuffled(k, s) for k, s in zip(seen, seeds, strict=True)]), 2),
        np.stack(people, 1),
    ).argmin(-1)
    assert (who[-1] == who[20]).all()


def test_four_people_in_four_cameras_are_told_apart_at_once():
    people = standing(PLACES, 30)
    estimates = follow(stack([shuffled(poses(people, 1), 1)]), 4)
    error = errors(estimates, people[:, None])
    assert tracked(estimates)[0].all()
    assert sorted(error[0, 0].argmin(-1)) == [0, 1, 2, 3]
    assert error[-1, 0].min(-1).max() < 0.06


def test_who_leaves_loses_the_place_and_who_returns_gets_one():
    people = standing(PLACES[:2], 150)
    seen = poses(people, 2, damage=False)
    seen.px[40:100, :, 1] = np.nan
    seen.confidence[40:100, :, 1], seen.sigma_px[40:100, :, 1] = 0.0, np.inf
    estimates = follow(stack([shuffled(seen, 2)]), 2)
    there, who = tracked(estimates)[:, 0], errors(estimates, people[:, None])[:, 0].argmin(-1)
    assert there[39].all()
    assert there[55].all()  # for a second the prediction stands in
    assert there[75:99].sum(-1).max() == 1
    assert there[101].all()
    assert sorted(who[-1]) == [0, 1]
    np.testing.assert_array_equal(who[-1], who[39])


def test_a_phantom_of_one_camera_never_becomes_a_person():
    """One camera reports a second body, steady as a statue."""
    people = standing(PLACES[:1], 60)
    statue = standing([PLACES[1]], 60, seed=9)
    seen, phantom = poses(people, 3, damage=False), poses(statue, 3, damage=False)
    for c in range(4):
        both = blank(phantom, [k for k in range(4) if k != c])
        parts = (
            np.concatenate([getattr(seen, name), getattr(both, name)], 2)
            for name in ("px", "confidence", "sigma_px")
        )
        there = tracked(follow(stack([shuffled(Keypoints(*parts), c)]), 2))
        assert (there[:, 0].sum(-1) == 1).all()


def test_a_person_seen_twice_is_one_person():
    """Every camera reports everybody twice, a little apart; there is place for two."""
    people = standing(PLACES[:1], 40)
    twice = [poses(people, s, damage=False) for s in (4, 5)]
    parts = (
        np.concatenate([getattr(each, name) for each in twice], 2)
        for name in ("px", "confidence", "sigma_px")
    )
    there = tracked(follow(stack([shuffled(Keypoints(*parts), 4)]), 2))
    assert (there[:, 0].sum(-1) == 1).all()


def test_more_people_than_places_leave_those_who_were_there_alone():
    people = standing(PLACES, 40)
    seen = poses(people, 6, damage=False)
    seen.px[:10, :, 2:] = np.nan
    estimates = follow(stack([shuffled(seen, 6)]), 2)
    who = errors(estimates, people[:, None]).argmin(-1)
    assert sorted(who[5, 0]) == [0, 1]
    assert (who[5:] == who[5]).all()


def test_the_order_of_detections_changes_nothing():
    people = standing(PLACES, 12)
    seen = poses(people, 7)
    for belief in (known(people[5]), nobody(4), nobody(2)):
        first = associate(LAB, frame(stack([seen]), 5), belief).keypoints
        for seed in range(4):
            again = associate(LAB, frame(stack([shuffled(seen, seed)]), 5), belief).keypoints
            np.testing.assert_array_equal(again.px, first.px)
            np.testing.assert_array_equal(again.sigma_px, first.sigma_px)


def test_a_pose_is_given_once_and_copied_exactly():
    people = standing(PLACES, 3)
    seen = frame(stack([shuffled(poses(people, 8), 8)]), 1)
    done = associate(LAB, seen, known(people[1]))
    for c in range(4):
        given_away = [d for d in done.pose[0, c] if d >= 0]
        assert len(set(given_away)) == len(given_away)
        for w, d in enumerate(done.pose[0, c]):
            expected = seen.px[0, c, d] if d >= 0 else np.full((N_JOINTS, 2), np.nan)
            np.testing.assert_array_equal(done.keypoints.px[0, c, w], expected)


def test_a_camera_that_exchanges_left_and_right_still_knows_its_people():
    people = standing(PLACES[:2], 1)
    seen = poses(people, 9, damage=False)
    mirrored = seen.px[:, :, :, [0, 2, 1, 4, 3, 6, 5, 8, 7, 10, 9, 12, 11, 14, 13]]
    one = frame(stack([seen]), 0, px=np.where(np.arange(4)[:, None, None, None] == 2,
                                              mirrored, seen.px))  # fmt: skip
    np.testing.assert_array_equal(associate(LAB, one, known(people[0])).pose[0, 2], [0, 1])


def test_an_environment_does_not_depend_on_its_neighbours():
    people = [passing(seed, 20) for seed in range(8)]
    seen = stack([shuffled(poses(p, s), s) for s, p in enumerate(people)])
    together = np.stack([e.mean_world for e in follow(seen, 2)])
    for b in (0, 5):
        alone = follow(
            Keypoints(*(getattr(seen, n)[:, [b]] for n in ("px", "confidence", "sigma_px"))), 2
        )
        first = np.stack([e.mean_world[0] for e in alone])
        if b == 0:  # the estimator's own noise is environment 0's
            np.testing.assert_array_equal(first, together[:, 0])
    belief = estimate_prior(8, 2, TrackerConfig())
    whole = associate(LAB, frame(seen, 3), belief).pose
    for b in range(8):
        part = frame(Keypoints(*(getattr(seen, n)[:, [b]] for n in ("px", "confidence",
                                                                    "sigma_px"))), 3)  # fmt: skip
        np.testing.assert_array_equal(associate(LAB, part, nobody(2)).pose[0], whole[b])


ABSURD = st.sampled_from([np.nan, np.inf, -np.inf, 1e300, -1e12, 0.0, -1.0, 500.0])


@settings(max_examples=25, deadline=None)
@given(ABSURD, ABSURD, ABSURD, st.integers(0, 5), st.integers(0, 3))
def test_whatever_a_camera_reports_is_data(pixel, confidence, sigma, n_poses, n_workers):
    shape = (1, 4, n_poses, N_JOINTS)
    rng = np.random.default_rng(0)
    wrong = rng.random(shape) < 0.5
    seen = Keypoints(
        np.where(wrong[..., None], pixel, rng.uniform(0, 1000, (*shape, 2))),
        np.where(wrong, confidence, 0.9),
        np.where(wrong, sigma, 5.0),
    )
    people = standing(PLACES[:3])[0][:n_workers]
    for belief in (nobody(n_workers), known(people)):
        done = associate(LAB, seen, belief)
        assert done.pose.shape == (1, 4, n_workers)
        assert done.pose.max(initial=-1) < n_poses


def test_absurd_beliefs_get_no_poses():
    people = standing(PLACES[:2])[0]
    seen = frame(stack([poses(people[None], 1, damage=False)]), 0)
    belief = known(people)
    for value in (np.nan, np.inf, 1e200):
        lost = PoseEstimate(np.full_like(belief.mean_world, value), belief.cov_world,
                            belief.velocity_world, belief.age_s, belief.tracked)  # fmt: skip
        assert associate(LAB, seen, lost).pose.max() < 2


def test_one_camera_alone_keeps_who_is_known_and_welcomes_nobody():
    people = standing(PLACES[:2])[0]
    seen = blank(frame(stack([poses(people[None], 1, damage=False)]), 0), [1, 2, 3])
    np.testing.assert_array_equal(associate(LAB, seen, known(people)).pose[0, 0], [0, 1])
    assert associate(LAB, seen, nobody(2)).pose.max() == -1


def test_wrong_shapes_and_settings_are_said():
    seen = frame(stack([poses(standing(PLACES[:2]), 1)]), 0)
    with pytest.raises(ConfigError, match="Keypoints"):
        associate(LAB[:3], seen, nobody(2))
    with pytest.raises(ConfigError, match="gate_sigma"):
        AssociationConfig(gate_sigma=0)
    with pytest.raises(ConfigError, match="prediction_std_m"):
        AssociationConfig(prediction_std_m=-1)
