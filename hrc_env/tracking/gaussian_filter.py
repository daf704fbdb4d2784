"""The kernels of the default estimator: one loop over (B, W), one function per step of it.

`state` and `s` are `particle.ParticleState` and `particle.Settings`; a worker's measurements
are z (J, C, 2), sigma (J, C), ok (J, C) as `measurements.read_worker` fills them.
"""

import math

import numba
import numpy as np

from hrc_env.geometry.triangulation import inverse3
from hrc_env.tracking.acquisition import (
    complete_body,
    count_conflict,
    distance,
    find_again,
    middle_of,
    triangulate_body,
)
from hrc_env.tracking.bones import use_bones
from hrc_env.tracking.importance import (
    cholesky3,
    draw,
    weigh_camera,
    weigh_proposal,
    weighted_moments,
)
from hrc_env.tracking.measurements import read_worker
from hrc_env.tracking.motion_model import is_positive_definite, predict_body
from hrc_env.tracking.proposal import find_mode
from hrc_env.tracking.swaps import undo_swaps

_LEAST_ESS = 8.0
"""With fewer effective particles the Gaussian at the mode is the better answer."""
_FOUND_SPEED_STD_M_S = 1.0
_FURTHEST_STD = 4.0
"""A body further than this many prior deviations from the prior has been lost."""
_JIT = {"cache": True, "nogil": True, "error_model": "numpy"}


@numba.njit(**_JIT)
def predict_all(state, F, Q, dt):
    """Move every tracked body by dt [s]; F, Q (J, 2, 2) as `motion_model.damped_joints` gives."""
    for b in range(state.tracked.shape[0]):
        for w in range(state.tracked.shape[1]):
            if state.tracked[b, w]:
                offset, count = state.offset[b, w], state.offset_count[b, w]
                predict_body(state.body[b, w], state.cov[b, w], offset, count, F, Q, dt)


@numba.njit(**_JIT)
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
    ok = np.empty((n_joints, n_cameras), np.bool_)
    for b in range(n_batch):
        for w in range(n_workers):
            read_worker(px, confidence, sigma_px, b, w, s.sigma_scale, z, sigma, ok)
            if not state.tracked[b, w]:
                _acquire(state, b, w, P, z, sigma, ok, standing, s)
                continue
            swaps = (state.swap_chance[b, w], state.blind[b, w], state.believed[b, w])
            undo_swaps(P, state.body[b, w], state.cov[b, w], z, sigma, ok, *swaps, s)
            _follow(state, b, w, P, z, sigma, ok, noise, tables[b, w], n_mode, s)
            _check(state, b, w, s)


@numba.njit(**_JIT)
def _acquire(state, b, w, P, z, sigma, ok, standing, s):
    """Start a track when two views agree on enough joints."""
    n_joints = len(ok)
    points, spread = np.empty((n_joints, 3)), np.ones((n_joints, 3, 3))
    found = np.empty(n_joints, np.bool_)
    gate, radius = s.gate_sigma, s.body_radius_m
    n_found = triangulate_body(P, z, sigma, ok, gate, radius, points, spread, found)
    if n_found < s.acquire_min_joints:
        return
    complete_body(standing, points, spread, found)
    for j in range(n_joints):
        _place(state.body[b, w, j], state.cov[b, w, j], points[j], spread[j])
        if found[j]:
            state.age_s[b, w, j] = 0.0
    state.tracked[b, w] = True


@numba.njit(**_JIT)
def _place(body, cov, point, spread):
    """Put a joint at rest at a point."""
    body[:3], body[3:] = point, 0.0
    cov[:] = 0.0
    cov[:3, :3] = spread
    for i in range(3):
        cov[3 + i, 3 + i] = _FOUND_SPEED_STD_M_S**2


@numba.njit(**_JIT)
def _follow(state, b, w, P, z, sigma, ok, noise, tables, n_mode, s):
    """Update every joint of a tracked worker, then let the bones speak."""
    n_joints, n_cameras = ok.shape
    body, cov, age = state.body[b, w], state.cov[b, w], state.age_s[b, w]
    belief, n_views = np.empty(n_cameras), np.zeros(n_joints, np.int64)
    n_particles = noise.shape[2]
    particles = np.empty((3, n_particles), np.float32)
    weights, work = np.empty(n_particles, np.float32), np.empty((2, n_particles), np.float32)
    for j in range(n_joints):
        n_supporting = 0
        for c in range(n_cameras):
            n_views[j] += ok[j, c]
        state.ess[b, w, j] = 0.0
        if n_views[j] > 0:
            seen = (P, z[j], sigma[j], ok[j])
            draws = (noise[tables[j]], n_mode, particles, weights, work)
            state.ess[b, w, j] = _update_joint(seen, draws, s, body[j], cov[j], belief)
            for c in range(n_cameras):
                n_supporting += belief[c] > 0.5
        if n_supporting > 0:
            age[j] = 0.0
        state.conflict[b, w, j] = count_conflict(n_views[j], n_supporting, state.conflict[b, w, j])
    use_bones(body, cov, n_views, state.bone_length[b, w], state.bone_variance[b, w])
    _find_again(state, b, w, P, z, sigma, ok, s)


@numba.njit(**_JIT)
def _update_joint(seen, draws, s, body, cov, belief):
    """One joint's importance-sampled posterior; returns the effective sample size."""
    P, z, sigma, ok = seen
    noise, n_mode, particles, weights, work = draws
    prior_cov, precision, spread = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    root_mode, root_prior = np.empty((3, 3)), np.empty((3, 3))
    mode, mean, shift = np.empty(3), np.empty(3), np.empty(3)
    prior_cov[:] = cov[:3, :3]
    inverse3(prior_cov, precision)
    find_mode(P, z, sigma, ok, body, prior_cov, precision, s, mode, spread, belief)
    sampled = cholesky3(spread, root_mode) and cholesky3(prior_cov, root_prior)
    ess = 0.0
    if sampled:
        root_mode *= math.sqrt(s.proposal_inflation)
        shift[:] = body[:3] - mode
        bits = work[1].view(np.int32)
        share = n_mode / noise.shape[1]
        draw(noise, root_mode, root_prior, shift, n_mode, particles)
        weigh_proposal(particles, root_mode, root_prior, shift, share, weights, work, bits)
        for c in range(len(P)):
            if ok[c]:
                u, v = z[c, 0], z[c, 1]
                weigh_camera(P[c], u, v, sigma[c], mode, particles, s, weights, work, bits)
        ess = weighted_moments(particles, weights, mean, prior_cov)
    if ess < _LEAST_ESS:
        mean[:] = 0.0
        prior_cov[:] = spread
    mean += mode
    _regress(body, cov, precision, mean, prior_cov)
    return ess


@numba.njit(**_JIT)
def _regress(body, cov, precision, mean, spread):
    """Give the position its new mean and covariance, and the velocity what follows from them."""
    gain, change, middle = np.empty((6, 3)), np.empty(3), np.empty((3, 3))
    for i in range(6):
        for k in range(3):
            gain[i, k] = 0.0
            for m in range(3):
                gain[i, k] += cov[i, m] * precision[m, k]
    for i in range(3):
        change[i] = mean[i] - body[i]
        for k in range(3):
            middle[i, k] = cov[i, k] - spread[i, k]
    for i in range(6):
        for k in range(3):
            body[i] += gain[i, k] * change[k]
    for i in range(6):
        a = gain[i, 0] * middle[0, 0] + gain[i, 1] * middle[1, 0] + gain[i, 2] * middle[2, 0]
        b = gain[i, 0] * middle[0, 1] + gain[i, 1] * middle[1, 1] + gain[i, 2] * middle[2, 1]
        c = gain[i, 0] * middle[0, 2] + gain[i, 1] * middle[1, 2] + gain[i, 2] * middle[2, 2]
        for k in range(i, 6):
            cov[i, k] -= a * gain[k, 0] + b * gain[k, 1] + c * gain[k, 2]
    for i in range(6):
        for k in range(i):
            cov[i, k] = cov[k, i]


@numba.njit(**_JIT)
def _find_again(state, b, w, P, z, sigma, ok, s):
    """Joints that have been elsewhere for a while, as two views say, are put there."""
    everyone, middle = np.ones(len(ok), np.bool_), np.empty(3)
    point, spread = np.empty(3), np.empty((3, 3))
    for j in range(len(ok)):
        if state.conflict[b, w, j] < s.conflict_frames:
            continue
        middle_of(state.body[b, w], everyone, middle)
        gate, radius = s.gate_sigma, s.body_radius_m
        if find_again(P, z[j], sigma[j], ok[j], gate, radius, middle, point, spread):
            _place(state.body[b, w, j], state.cov[b, w, j], point, spread)
            state.age_s[b, w, j], state.conflict[b, w, j] = 0.0, 0


@numba.njit(**_JIT)
def _check(state, b, w, s):
    """Keep covariances positive definite; a body that has left the world is lost."""
    body, cov, inside = state.body[b, w], state.cov[b, w], True
    for j in range(len(body)):
        if not is_positive_definite(cov[j]):
            for i in range(6):
                variance = cov[j, i, i]
                cov[j, i, :], cov[j, :, i] = 0.0, 0.0
                cov[j, i, i] = max(variance, 1e-4)
        away = distance(body[j], s.prior_mean_world)
        inside &= away < _FURTHEST_STD * s.prior_std_m and math.isfinite(cov[j].sum())
        inside &= math.isfinite(body[j].sum())
    if inside:
        return
    state.tracked[b, w] = False
    for j in range(len(body)):
        body[j, 3:] = 0.0
        cov[j] = np.eye(6) * s.prior_std_m**2
        state.age_s[b, w, j] = s.max_age_s
        for i in range(3):
            body[j, i] = s.prior_mean_world[i]
