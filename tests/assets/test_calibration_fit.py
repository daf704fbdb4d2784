"""The fit finds the numbers that errors were made with."""

from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest

from assets.emulator.clips import FAMILIES, TIMES, list_fit_clips, list_unseen_clips
from assets.emulator.fit.fit import fit as fit_of
from assets.emulator.fit.novelty import new_of, novel_of
from assets.emulator.samples import Samples
from hrc_env.motion.repertoire import REPERTOIRE
from hrc_env.perception.calibration import (
    INNER,
    KIND,
    KINDS,
    N_POSES,
    N_VIEWS,
    NEXT,
    POSTURES,
    SHAPES,
    read_calibration,
)
from hrc_env.perception.outline import pose_of
from hrc_env.worker.body import load_body

L, T, C, J = 24, 50, 4, 15
STANDING, FOLDED, KNEELING = (
    np.eye(len(POSTURES))[POSTURES.index(name)] for name in ("standing", "folded", "kneeling")
)
STANDING_BODY = load_body().rest_position[load_body().joint_segment] + load_body().joint_offset
BETWEEN_M = np.full((len(KINDS), 3), 0.007)
HIP, ELBOW = KINDS.index("hip"), KINDS.index("elbow")


def made(error, **changes):
    """Samples of upright workers, seen from anywhere, with errors (L, T, C, J, 2)."""
    rng = np.random.default_rng(5)
    view = np.broadcast_to(rng.uniform(-np.pi, np.pi, (L, 1, C)), (L, T, C))
    nowhere = np.full((L, T, J, 3), np.nan)
    parts = {
        "error": error, "confidence": rng.uniform(0.9, 0.99, (L, T, C, J)),
        "sight": np.zeros((L, T, C, J), int), "view": view,
        "posture": np.tile(STANDING, (L, T, 1)),
        "speed_m_s": np.full((L, T), 0.1), "missed": np.zeros((L, T, C), bool),
        "exchanged": np.zeros((L, T, C, 2), bool), "shown": np.zeros((L, T, C, J, 2, 3)),
        "offset_m": nowhere, "counts": np.ones((L, T), bool),
    }  # fmt: skip
    return Samples(**(parts | changes))


def fit(samples):
    return fit_of(samples, (np.zeros((J, 3, N_POSES)), 0.05), BETWEEN_M)


def white(size=0.01, seed=1):
    return size * np.random.default_rng(seed).standard_normal((L, T, C, J, 2))


def test_sizes_are_found():
    known = fit(made(white(0.012)))
    np.testing.assert_allclose(known.size[0, 0], 0.012, rtol=0.08)
    assert known.spread[0, 0].max() < 0.15


def test_heavy_tails_are_found():
    rng = np.random.default_rng(2)
    error = white() * np.exp(0.6 * rng.standard_normal((L, T, C, J, 1)))
    np.testing.assert_allclose(fit(made(error)).spread[0, 0], 0.6, atol=0.1)


def test_new_errors_are_known_from_lasting_ones():
    assert fit(made(white())).shares[:, 2].min() > 0.9
    staying = np.broadcast_to(white()[:, :1], (L, T, C, J, 2))
    assert fit(made(staying)).shares[:, 2].max() < 0.1


def test_biases_by_view_are_found():
    samples = made(white(0.005))
    front = np.cos(samples.view) > np.cos(np.pi / N_VIEWS)
    samples.error[front] += np.where((KIND == HIP)[:, None], [0.0, 0.02], 0.0)
    bias = fit(samples).bias
    assert bias[0, HIP, 1] == pytest.approx(0.02, rel=0.3)
    assert abs(bias[N_VIEWS // 2, HIP, 1]) < 0.003


def test_offsets_in_space_are_found():
    rng = np.random.default_rng(3)
    offset = 0.01 * rng.standard_normal((L, T, J, 3)) + np.array([0.0, 0.0, 0.03])
    known = fit(made(white(), offset_m=offset))
    np.testing.assert_allclose(known.offset_m[0], [[0.0, 0.0, 0.03]] * len(KINDS), atol=0.002)


def in_space(offset_m):
    """Errors (L, T, C, J, 2) as cameras all round show offsets (L, T, J, 3), and how they do."""
    azimuth = np.linspace(0.3, 2 * np.pi, C, endpoint=False)
    right = np.stack([-np.sin(azimuth), np.cos(azimuth), 0 * azimuth], -1)
    down = np.tile([0.0, 0.0, -1.0], (C, 1))
    shown = np.broadcast_to(np.stack([right, down], 1)[:, None], (L, T, C, J, 2, 3)) / 2.0
    return np.einsum("ltcjka,ltja->ltcjk", shown, offset_m), shown


def test_what_varies_in_space_is_told_from_what_cameras_err_on_their_own():
    rng = np.random.default_rng(3)
    std = np.array([0.03, 0.02, 0.0])
    error, shown = in_space(std * rng.standard_normal((L, T, J, 3)))
    wander = fit(made(error + white(0.01), shown=shown)).wander_m[0]
    np.testing.assert_allclose(wander, np.tile(np.maximum(std, 0.002), (len(KINDS), 1)), atol=0.003)
    assert fit(made(white(0.01), shown=shown)).wander_m[0].max() < 0.004


def test_what_varies_in_space_together_is_found():
    """Elbows with their shoulders, and the right hip with the left one."""
    rng = np.random.default_rng(3)
    normal = rng.standard_normal((L, T, J, 3))
    for j in range(J):
        if KIND[j] == ELBOW or (KIND[j] == HIP and NEXT[j] != j):
            normal[:, :, j] = 0.8 * normal[:, :, NEXT[j]] + 0.6 * normal[:, :, j]
    error, shown = in_space(0.03 * normal)
    posture = np.tile(STANDING, (L, T, 1))
    posture[L // 3 :], posture[2 * L // 3 :] = FOLDED, KNEELING
    limb = fit(made(error + white(0.01), shown=shown, posture=posture)).space_limb
    np.testing.assert_allclose(limb[[ELBOW, HIP]], 0.8, atol=0.1)
    assert np.abs(np.delete(limb, [ELBOW, HIP], 0)).max() < 0.2


def test_errors_along_a_limb_are_alike():
    error = white()
    for j in np.flatnonzero(KIND == ELBOW):
        error[..., j, :] = 0.5 * error[..., INNER[j], :] + np.sqrt(0.75) * error[..., j, :]
    assert fit(made(error)).limb[ELBOW] == pytest.approx(0.5, abs=0.05)


def test_exchanged_sides_and_misses_are_counted():
    exchanged = np.zeros((L, T, C, 2), bool)
    exchanged[:, :5, :, 0] = True
    missed = np.zeros((L, T, C), bool)
    missed[:, 10:20] = True
    known = fit(made(white(), exchanged=exchanged, missed=missed))
    np.testing.assert_allclose(known.swap_share[..., 0], 0.125, atol=0.01)
    assert known.miss_share[0, 15] == pytest.approx(0.2, abs=0.02)
    np.testing.assert_allclose(known.swap_share[..., 1], 0.0)


def test_how_long_mishaps_last_is_found():
    rng = np.random.default_rng(6)
    latent, keep = rng.standard_normal((L, 1, C)), np.exp(-0.04 / 0.8)
    slow = [latent]
    for _ in range(T * 4 - 1):
        slow.append(keep * slow[-1] + np.sqrt(1 - keep**2) * rng.standard_normal((L, 1, C)))
    missed = np.concatenate(slow, 1).reshape(L, 4, T, C).reshape(4 * L, T, C) < -0.5
    one = made(white())
    four = {f.name: np.concatenate([getattr(one, f.name)] * 4) for f in fields(Samples)}
    assert fit(Samples(**{**four, "missed": missed})).miss_s == pytest.approx(0.8, rel=0.35)


def test_what_happens_often_in_some_views_does_not_seem_to_last():
    """It comes anew in every image, nearly always from some directions, hardly ever from others."""
    rng = np.random.default_rng(8)
    view = np.broadcast_to(np.where(np.arange(C) < 2, 0.0, np.pi), (L, T, C))
    exchanged = np.zeros((L, T, C, 2), bool)
    exchanged[..., 0] = rng.random((L, T, C)) < np.where(np.arange(C) < 2, 0.01, 0.6)
    known = fit(made(white(), view=view, exchanged=exchanged))
    assert known.swap_share[0, 4, 0] > 0.4
    assert known.swap_s[0] < 0.4


def told_clips(error_m, new_m):
    """Clips (L) of a body whose estimates are off by so much, and its nose so much from the pose
    that is known."""
    rng = np.random.default_rng(2)
    body = np.broadcast_to(STANDING_BODY, (60, J, 3)).copy()
    body[:, 0, 2] += new_m * np.sqrt(J)
    nothing, cov = np.zeros((60, J, 3)), np.broadcast_to(1e-4 * np.eye(3), (60, J, 3, 3))
    for _ in range(L):
        said = body + error_m * rng.standard_normal(body.shape)
        yield SimpleNamespace(
            joints_world=body, tracker_mean_world=said, tracker_cov_world=cov,
            tracker_velocity_world=nothing, tracked=np.ones(60, bool),
        )  # fmt: skip


def test_what_is_told_of_new_poses_is_as_large_as_their_errors():
    zero = {"offset_m", "wander_m", "between_m"}
    known = replace(
        read_calibration(), poses=np.repeat(pose_of(STANDING_BODY)[..., None], N_POSES, -1),
        near_m=np.array(0.0), **{name: np.zeros(SHAPES[name]) for name in zero},
    )  # fmt: skip
    wrong = list(told_clips(0.05, 0.1))
    novel = novel_of(known, [*told_clips(0.01, 0.005), *wrong])
    variance_m2 = (
        0.01**2 + (novel[KIND] * new_of(wrong[0].tracker_mean_world, known)[:, None] ** 2) ** 2
    )
    error_m = wrong[0].tracker_mean_world - wrong[0].joints_world
    told_m2, squared_m2 = 3 * variance_m2.mean(), (error_m**2).sum(-1).mean()
    assert 0.8 < told_m2 / squared_m2 < 1.25
    assert novel.min() > 2.0
    assert novel_of(known, list(told_clips(0.008, 0.1))).max() < 0.5


def test_every_motion_has_a_family_and_unseen_clips_are_others():
    assert sorted(sum(FAMILIES.values(), ())) == sorted(REPERTOIRE)
    ours, others = list_fit_clips(2, 0), list_unseen_clips(2, 0)
    once = sum(TIMES.get(family, 1) * len(motions) for family, motions in FAMILIES.items())
    assert len(ours) == len(others) == 4 * once
    assert len(list_fit_clips(0, 0)) == once
    assert {clip.motion for clip in list_fit_clips(0, 0)} == set(REPERTOIRE)
    played = {(clip.scene, clip.motion, clip.body) for clip in ours}
    assert sum((c.scene, c.motion, c.body) in played for c in others) < len(others) / 2
    assert not {clip.seed for clip in ours} & {clip.seed for clip in others}
