"""The kernels of `kalman`: one loop over (B, W), one function per step of it.

`state` and `s` are `kalman.KalmanState` and `settings.Settings`; a worker's measurements are
z (J, C, 2), sigma (J, C), ok (J, C) as `measurements.read_worker` fills them.
"""

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.tracking.measurements import read_worker
from hrc_env.tracking.models.acquisition import count_conflict
from hrc_env.tracking.models.noise import learn_noise, scale_sigma
from hrc_env.tracking.models.proposal import contrast_of
from hrc_env.tracking.models.swaps import undo_swaps
from hrc_env.tracking.models.upkeep import (
    acquire,
    acquire_anew,
    check,
    find_joints_again,
    grow_older,
)
from hrc_env.tracking.tree.bone_lengths import learn_lengths, stiff_lengths
from hrc_env.tracking.tree.gaussian import PARENT
from hrc_env.tracking.tree.predict import predict_tree
from hrc_env.tracking.tree.search import find_pose
from hrc_env.tracking.tree.update import correct_mean, update_tree
from hrc_env.tracking.tree.work import make_work


@kernel(makes_arrays=True)
def predict_all(state, model, dt, s):
    """Let dt [s] pass: bodies move and ages grow; `model` as in `tree.predict.predict_tree`."""
    work = make_work(0)
    for b in range(state.tracked.shape[0]):
        for w in range(state.tracked.shape[1]):
            if state.tracked[b, w]:
                gaussian = (state.body[b, w], state.cov[b, w], state.slope[b, w])
                places = (state.offset[b, w], state.offset_count[b, w])
                predict_tree(*gaussian, *places, model, dt, work)
            grow_older(state, b, w, dt, s)


@kernel(makes_arrays=True)
def update_all(state, P, px, confidence, sigma_px, standing, s, noise):
    """Take one set of frames in.

    Args:
        state: changed in place.
        P: (C, 3, 4).
        px, confidence, sigma_px: as in `records.Keypoints`.
        standing: (J, 3) `acquisition.STANDING_M`.
        s: settings.
        noise: `noise.NoiseModel`.
    """
    n_batch, n_cameras, n_workers, n_joints = confidence.shape
    z, sigma = np.empty((n_joints, n_cameras, 2)), np.empty((n_joints, n_cameras))
    ok, belief = np.empty((n_joints, n_cameras), np.bool_), np.empty((n_joints, n_cameras))
    scratch = (belief, np.empty(n_joints), make_work(n_cameras))
    placed, predicted = np.empty(n_joints, np.bool_), np.empty((n_joints, 3, 3))
    for b in range(n_batch):
        for w in range(n_workers):
            read_worker(px, confidence, sigma_px, b, w, s.sigma_scale, z, sigma, ok)
            scale_sigma(state.noise_factor[b, w], sigma)
            if not state.tracked[b, w]:
                if acquire(state, b, w, P, z, sigma, ok, standing, s):
                    state.slope[b, w] = 0.0
                continue
            swaps = (state.swap_chance[b, w], state.blind[b, w], state.believed[b, w])
            undo_swaps(P, state.body[b, w], state.cov[b, w], z, sigma, ok, *swaps, s)
            seen = (P, z, sigma, ok)
            keep_positions(state.cov[b, w], predicted)
            follow(state, b, w, seen, s, scratch)
            known = (state.noise_factor[b, w], state.noise_sums[b, w], state.noise_last[b, w])
            body = (state.body[b, w], state.cov[b, w], predicted)
            learn_noise(seen, belief, body, *known, noise, scratch[2])
            look_after(state, b, w, seen, standing, s, placed, scratch[2].a)


@kernel
def keep_positions(cov, out):
    """Copy the covariances of the positions (J, 3, 3) out of those of the joints (J, 6, 6)."""
    for j in range(len(cov)):
        for i in range(3):
            for k in range(3):
                out[j, i, k] = cov[j, i, k]


@kernel
def follow(state, b, w, seen, s, scratch):
    """Update a tracked worker: search, condition, correct the mean, learn the bones."""
    condition(state, b, w, seen, s, scratch)
    settle(state, b, w, seen, s, scratch)


@kernel
def condition(state, b, w, seen, s, scratch):
    """Search the mode and condition the tree there; belief (J, C) says what was believed.

    `scratch` is belief (J, C), variances of the bones as measurements (J,), and `work.Work`.
    """
    belief, give, work = scratch
    body, cov, slope = state.body[b, w], state.cov[b, w], state.slope[b, w]
    contrast = contrast_of(s.outlier_weight, s.image_area_px)
    stiff_lengths(state.bone_variance[b, w], s.bone_give, give)
    bones = (state.bone_length[b, w], give)
    how = (contrast, s.floor_std_m, s.gauss_newton_steps)
    find_pose(body, cov, slope, seen, bones, *how, belief, work)
    update_tree(body, cov, slope, work)


@kernel
def settle(state, b, w, seen, s, scratch):
    """Go from the mode to the mean, and learn what is to be learnt from it."""
    belief, _, work = scratch
    if s.mean_correction > 0.0:
        gaussian = (state.body[b, w], state.cov[b, w], state.slope[b, w])
        correct_mean(*gaussian, seen, belief, s.mean_correction, work)
    keep_books(state, b, w, seen, belief, work.n_views)


@kernel
def keep_books(state, b, w, seen, belief, n_views):
    """Ages, conflicts and bone lengths of a worker who has been updated.

    `belief` (J, C) is how far each measurement was believed; `n_views` (J,) is scratch.
    """
    ok = seen[3]
    for j in range(len(ok)):
        n_views[j], n_supporting = 0, 0
        for c in range(ok.shape[1]):
            n_views[j] += ok[j, c]
            n_supporting += belief[j, c] > 0.5
        if n_supporting > 0:
            state.age_s[b, w, j] = 0.0
        conflict = state.conflict[b, w, j]
        state.conflict[b, w, j] = count_conflict(n_views[j], n_supporting, conflict)
    bones = (state.bone_length[b, w], state.bone_variance[b, w])
    learn_lengths(state.body[b, w], state.cov[b, w], state.slope[b, w], n_views, *bones)


@kernel
def look_after(state, b, w, seen, standing, s, placed, factor):
    """Find joints or the whole body again where the views say so; notice a body that is lost.

    `placed` (J,) and `factor` (6, 6) are scratch. What is known of a joint that was put
    somewhere is its own.
    """
    P, z, sigma, ok = seen
    placed[:] = acquire_anew(state, b, w, P, z, sigma, ok, standing, s)
    find_joints_again(state, b, w, P, z, sigma, ok, s, placed)
    for j in range(len(placed)):
        if placed[j] or (PARENT[j] >= 0 and placed[PARENT[j]]):
            state.slope[b, w, j] = 0.0
    if not check(state, b, w, s, factor):
        state.slope[b, w] = 0.0
