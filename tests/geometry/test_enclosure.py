"""The capsules of an estimated body: what they are made of, and how well they hold a true one."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from assets.enclosure.fit import fit_enclosure, measure_protrusion
from assets.enclosure.poses import play
from hrc_env.core.skeleton import JOINT, MIRROR
from hrc_env.geometry.enclosure import (
    CAPSULE,
    CAPSULES,
    N_CAPSULES,
    enclose,
    find_velocities,
    load_enclosure,
)
from hrc_env.worker.body import load_body, worker_names

RNG = np.random.default_rng(0)
JOINTS_WORLD = RNG.normal(size=(4, 2, 15, 3))
FIT_SEED, PROOF_SEED = 9_600_000, 9_700_000
EVERY = 7
"""Of the poses of episodes side by side every seventh is measured: no divisor of their number."""
ALLOWED_M = {"head": 0.03, "hand": 0.02, "foot": 0.02, "chest": 0.03, "torso": 0.03,
             "abdomen": 0.03, "pelvis": 0.03, "neck": 0.035}  # fmt: skip


def test_an_estimated_body_has_the_capsules_of_a_true_one():
    for name in worker_names():
        assert load_body(name).capsule_names == CAPSULES


@pytest.mark.parametrize("name", [name for name in CAPSULES if name != "head"])
def test_the_ends_of_a_capsule_are_weighted_sums_of_joints(name):
    enclosure, s = load_enclosure(), CAPSULE[name]
    for end in range(2):
        joints = JOINTS_WORLD[..., enclosure.joints[s, end], :]
        expected = (enclosure.weights[s, end][:, None] * joints).sum(-2)
        np.testing.assert_allclose(enclose(JOINTS_WORLD).ends_world[..., s, end, :], expected)
    np.testing.assert_allclose(enclosure.weights[s].sum(-1), 1.0, atol=1e-4)


def test_a_body_elsewhere_has_the_same_capsules_there():
    turn, step = Rotation.from_rotvec([0.3, -1.1, 2.0]).as_matrix(), np.array([1.0, -2.0, 0.5])
    here, there = enclose(JOINTS_WORLD), enclose(JOINTS_WORLD @ turn.T + step)
    np.testing.assert_allclose(there.ends_world, here.ends_world @ turn.T + step, atol=1e-4)
    np.testing.assert_allclose(there.radius_m, here.radius_m)


def test_a_mirrored_body_has_mirrored_capsules():
    body = play("worker_1", 1, n_episodes=1).joints_world[0]
    other_side = {"left": "right", "right": "left"}
    sides = []
    for name in CAPSULES:
        side, _, part = name.partition("_")
        sides.append(CAPSULE[f"{other_side[side]}_{part}" if part else name])
    flip = np.array([1.0, -1.0, 1.0])
    one, other = enclose(body), enclose(body[MIRROR] * flip)
    limbs = [s for s, name in enumerate(CAPSULES) if name.startswith(("left", "right"))]
    mirrored = other.ends_world[sides] * flip
    np.testing.assert_allclose(mirrored[limbs], one.ends_world[limbs], atol=1e-3)
    np.testing.assert_allclose(other.radius_m[sides], one.radius_m)


def test_the_head_reaches_behind_the_nose():
    """By about the diameter of a head, of somebody who looks ahead."""
    body = play("worker_1", 1, n_episodes=1).joints_world[0]
    capsules, s = enclose(body), CAPSULE["head"]
    shoulders = body[JOINT["left_shoulder"]] - body[JOINT["right_shoulder"]]
    ahead = np.cross(shoulders, [0.0, 0.0, 1.0])
    ahead /= np.linalg.norm(ahead)
    behind_m = (body[JOINT["nose"]] - capsules.ends_world[s]) @ ahead
    assert behind_m.max() + capsules.radius_m[s] > 0.2


def test_wide_people_are_thick_and_nobody_is_thinner_than_the_narrowest():
    body = play("worker_1", 1, n_episodes=1).joints_world[0]
    radii_m = np.array([enclose(scale * body).radius_m for scale in (0.1, 0.5, 1.0, 1.2, 3.0)])
    of_trunk = radii_m[:, CAPSULE["torso"]]
    assert of_trunk[0] == of_trunk[1] < of_trunk[2] < of_trunk[3] < of_trunk[4]
    assert (of_trunk[3] / of_trunk[2]) == pytest.approx(1.2, rel=0.02)
    assert np.ptp(radii_m[:, CAPSULE["head"]]) == 0.0


def test_ends_move_as_they_do_a_moment_later():
    velocity = RNG.normal(size=JOINTS_WORLD.shape)
    expected = (
        enclose(JOINTS_WORLD + 1e-6 * velocity).ends_world
        - enclose(JOINTS_WORLD - 1e-6 * velocity).ends_world
    ) / 2e-6
    found = find_velocities(enclose(JOINTS_WORLD), JOINTS_WORLD, velocity)
    limbs = [s for s in range(N_CAPSULES) if s != CAPSULE["head"]]
    np.testing.assert_allclose(found[..., limbs, :, :], expected[..., limbs, :, :], atol=1e-6)
    body = play("worker_1", 1, n_episodes=1).joints_world[:1]
    turning = np.cross([0.0, 0.0, 1.0], body)
    capsules = enclose(body)
    expected = np.cross([0.0, 0.0, 1.0], capsules.ends_world)
    np.testing.assert_allclose(find_velocities(capsules, body, turning), expected, atol=2e-3)


@pytest.mark.parametrize("joints", ["left_shoulder", "left_hip", "left_elbow", "nose"])
def test_joints_that_coincide_give_finite_capsules(joints):
    folded = JOINTS_WORLD.copy()
    folded[..., :, :] = folded[..., JOINT[joints], None, :]
    assert np.isfinite(enclose(folded).ends_world).all()
    assert np.isfinite(enclose(folded).radius_m).all()


def test_nobody_has_no_capsules():
    capsules = enclose(np.zeros((3, 0, 15, 3)))
    assert capsules.ends_world.shape == (3, 0, N_CAPSULES, 2, 3)
    assert capsules.radius_m.shape == (3, 0, N_CAPSULES)


@pytest.mark.slow
def test_a_body_that_was_left_out_of_the_fit_protrudes_by_few_centimetres():
    """In 95 % of the poses of other episodes than those of the fit."""
    bodies = [play(name, FIT_SEED + 1000 * k, 24) for k, name in enumerate(worker_names())]
    for k, name in enumerate(worker_names()):
        others = fit_enclosure([*bodies[:k], *bodies[k + 1 :]], CAPSULES)
        proof = play(name, PROOF_SEED + 1000 * k, 12)
        protrusion_m = measure_protrusion(others, proof, EVERY)
        for capsule, out_m in zip(CAPSULES, protrusion_m, strict=True):
            part = capsule.removeprefix("left_").removeprefix("right_")
            assert out_m <= ALLOWED_M.get(part, 0.02), (name, capsule)


@pytest.mark.parametrize("worker", worker_names())
def test_the_shields_margins_hold_what_protrudes(worker):
    body = play(worker, PROOF_SEED, 4)
    out_m = measure_protrusion(load_enclosure(), body, EVERY)
    assert (out_m <= load_enclosure().protrusion_m + 0.01).all()
