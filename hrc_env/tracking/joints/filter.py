"""The kernels of `per_joint`: one loop over (B, W), one function per step of it.

`state` and `s` are `per_joint.PerJointState` and `settings.Settings`; a worker's measurements
are z (J, C, 2), sigma (J, C), ok (J, C) as `measurements.read_worker` fills them.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.geometry.triangulation import inverse3
from hrc_env.tracking.joints.importance import (
    cholesky3,
    draw,
    weigh_camera,
    weigh_proposal,
    weighted_moments,
)
from hrc_env.tracking.measurements import read_worker
from hrc_env.tracking.models.acquisition import count_conflict
from hrc_env.tracking.models.bones import use_bones
from hrc_env.tracking.models.motion import predict_body
from hrc_env.tracking.models.proposal import contrast_of, find_mode
from hrc_env.tracking.models.swaps import undo_swaps
from hrc_env.tracking.models.upkeep import acquire, acquire_anew, check, find_joints_again

_LEAST_ESS = 8.0
"""With fewer effective particles the Gaussian at the mode is the better answer."""


@kernel(makes_arrays=True)
def predict_all(state, F, Q, dt):
    """Move every tracked body by dt [s]; F, Q (J, 2, 2) as `models.motion.damped_joints` gives."""
    for b in range(state.tracked.shape[0]):
        for w in range(state.tracked.shape[1]):
            if state.tracked[b, w]:
                offset, count = state.offset[b, w], state.offset_count[b, w]
                predict_body(state.body[b, w], state.cov[b, w], offset, count, F, Q, dt)


@kernel(makes_arrays=True)
def update_all(state, P, px, confidence, sigma_px, standing, noise, tables, n_mode, s):
    """Take one set of frames in.

    Args:
        state: changed in place.
        P: (C, 3, 4).
        px, confidence, sigma_px: as in `records.Keypoints`.
        standing: (J, 3) `acquisition.STANDING_M`.
        noise: (n, 3, M) tables of `importance.make_noise`, the first n_mode for the mode.
        tables: (B, W, J) which table each joint takes.
        n_mode: particles drawn about the mode.
        s: settings.
    """
    n_batch, n_cameras, n_workers, n_joints = confidence.shape
    z, sigma = np.empty((n_joints, n_cameras, 2)), np.empty((n_joints, n_cameras))
    ok, factor = np.empty((n_joints, n_cameras), np.bool_), np.empty((6, 6))
    for b in range(n_batch):
        for w in range(n_workers):
            read_worker(px, confidence, sigma_px, b, w, s.sigma_scale, z, sigma, ok)
            if not state.tracked[b, w]:
                acquire(state, b, w, P, z, sigma, ok, standing, s)
                continue
            swaps = (state.swap_chance[b, w], state.blind[b, w], state.believed[b, w])
            undo_swaps(P, state.body[b, w], state.cov[b, w], z, sigma, ok, *swaps, s)
            _follow(state, b, w, P, z, sigma, ok, noise, tables[b, w], n_mode, s)
            placed = np.zeros(n_joints, np.bool_)
            if not acquire_anew(state, b, w, P, z, sigma, ok, standing, s):
                find_joints_again(state, b, w, P, z, sigma, ok, s, placed)
            check(state, b, w, s, factor)


@kernel(makes_arrays=True)
def _follow(state, b, w, P, z, sigma, ok, noise, tables, n_mode, s):
    """Update every joint of a tracked worker, then let the bones speak."""
    n_joints, n_cameras = ok.shape
    body, cov, age = state.body[b, w], state.cov[b, w], state.age_s[b, w]
    belief, n_views = np.empty(n_cameras), np.zeros(n_joints, np.int64)
    particles = np.empty((6, noise.shape[2]), np.float32)
    scratch = (np.empty((6, 4, 3)), np.empty((6, 3)))
    contrast, ess = contrast_of(s.outlier_weight, s.image_area_px), state.ess[b, w]
    for j in range(n_joints):
        n_supporting = 0
        for c in range(n_cameras):
            n_views[j] += ok[j, c]
        ess[j] = 0.0
        if n_views[j] > 0:
            seen = (P, z[j], sigma[j], ok[j])
            draws = (noise[tables[j]], n_mode, s.proposal_inflation, particles)
            model = (contrast, s.gauss_newton_steps)
            ess[j] = _update_joint(seen, draws, model, body[j], cov[j], belief, scratch)
            for c in range(n_cameras):
                n_supporting += belief[c] > 0.5
        if n_supporting > 0:
            age[j] = 0.0
        state.conflict[b, w, j] = count_conflict(n_views[j], n_supporting, state.conflict[b, w, j])
    use_bones(body, cov, n_views, state.bone_length[b, w], state.bone_variance[b, w])


@kernel(makes_arrays=True)
def _update_joint(seen, draws, model, body, cov, belief, scratch):
    """One joint's importance-sampled posterior; returns the effective sample size."""
    work, gain = scratch
    prior_cov, precision, spread, moments = work[0, :3], work[1, :3], work[2, :3], work[3, :3]
    mode, mean = work[0, 3], work[1, 3]
    contrast, n_steps = model
    for i in range(3):
        for k in range(3):
            prior_cov[i, k] = cov[i, k]
    inverse3(prior_cov, precision)
    find_mode(seen, body, prior_cov, precision, contrast, n_steps, mode, spread, belief, work[4])
    ess = _sample(seen, draws, contrast, body, prior_cov, mode, spread, work, mean, moments)
    if ess < _LEAST_ESS:
        _regress(body, cov, precision, mode, spread, gain)
    else:
        _regress(body, cov, precision, mean, moments, gain)
    return ess


@kernel(makes_arrays=True)
def _sample(seen, draws, contrast, body, prior_cov, mode, spread, work, mean, moments):
    """Mean (3,) and covariance (3, 3) of weighted particles; the effective sample size."""
    P, z, sigma, ok = seen
    noise, n_mode, inflation, space = draws
    particles, weights, logs = space[:3], space[3], space[4:]
    root_mode, root_prior, shift = work[4, :3], work[5, :3], work[2, 3]
    if not (cholesky3(spread, root_mode) and cholesky3(prior_cov, root_prior)):
        return 0.0
    wider = math.sqrt(inflation)
    for i in range(3):
        shift[i] = body[i] - mode[i]
        for k in range(i + 1):
            root_mode[i, k] *= wider
    bits = logs[1].view(np.int32)
    share = n_mode / noise.shape[1]
    draw(noise, root_mode, root_prior, shift, n_mode, particles)
    weigh_proposal(particles, root_mode, root_prior, shift, share, weights, logs, bits)
    for c in range(len(P)):
        if ok[c]:
            u, v = z[c, 0], z[c, 1]
            weigh_camera(P[c], u, v, sigma[c], mode, particles, contrast, weights, logs, bits)
    ess = weighted_moments(particles, weights, mean, moments)
    for i in range(3):
        mean[i] += mode[i]
    return ess


@kernel(makes_arrays=True)
def _regress(body, cov, precision, mean, spread, gain):
    """Give the position its new mean and covariance, and the velocity what follows from them.

    With gain G = cov[:, :3] precision: body += G (mean - position) and
    cov -= G (prior - spread) G'. `gain` (6, 3) is scratch.
    """
    change = (mean[0] - body[0], mean[1] - body[1], mean[2] - body[2])
    d00, d11, d22 = cov[0, 0] - spread[0, 0], cov[1, 1] - spread[1, 1], cov[2, 2] - spread[2, 2]
    d01, d02, d12 = cov[0, 1] - spread[0, 1], cov[0, 2] - spread[0, 2], cov[1, 2] - spread[1, 2]
    for i in range(6):
        for k in range(3):
            gain[i, k] = (
                cov[i, 0] * precision[0, k]
                + cov[i, 1] * precision[1, k]
                + cov[i, 2] * precision[2, k]
            )
    for i in range(6):
        g0, g1, g2 = gain[i, 0], gain[i, 1], gain[i, 2]
        body[i] += g0 * change[0] + g1 * change[1] + g2 * change[2]
        a = g0 * d00 + g1 * d01 + g2 * d02
        b = g0 * d01 + g1 * d11 + g2 * d12
        c = g0 * d02 + g1 * d12 + g2 * d22
        for k in range(i, 6):
            cov[i, k] -= a * gain[k, 0] + b * gain[k, 1] + c * gain[k, 2]
            cov[k, i] = cov[i, k]
