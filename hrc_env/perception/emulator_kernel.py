"""The emulator's inner loop: one environment after the other, on plain arrays."""

import math

import numba
import numpy as np

from hrc_env.perception.noise import error_share
from hrc_env.perception.self_occlusion import bounding_spheres, hidden_by_capsules

MIN_DEPTH_M = 0.5
"""Nearer to a camera's plane there is no image of a person."""

UNSURE = 0.7
"""How much the logit of the reported visibility drops when errors are larger by one step."""


@numba.njit(cache=True, nogil=True, error_model="numpy")
def emulate_batch(
    slow, size, swapped, missed, normals, uniforms,
    joints, capsules, radius, hidden, P, eyes, image,
    scalars, per_joint, mirror, visibility, error, px, confidence, sigma,
):  # fmt: skip
    """Advance the errors by one image and write keypoints; arguments as in `emulate`."""
    batch, n_cameras, n_workers, n_joints = confidence.shape
    n_body = capsules.shape[2]
    n = n_workers * n_body
    centre, reach, radii = np.empty((n, 3)), np.empty(n), np.empty(n)
    for w in range(n_workers):
        radii[w * n_body : (w + 1) * n_body] = radius
    uv, depth, state = np.empty((n_joints, 2)), np.empty(n_joints), np.empty(n_joints, np.int64)
    for b in range(batch):
        bodies = capsules[b].reshape(n, 2, 3)
        bounding_spheres(bodies, radii, centre, reach)
        for c in range(n_cameras):
            for w in range(n_workers):
                _project(P[c], joints[b, w], uv, depth)
                n_seen = _sight(
                    uv, depth, hidden[b, c, w], eyes[c], joints[b, w], bodies, radii, centre,
                    reach, image[c], state,
                )  # fmt: skip
                _burst(swapped, b, c, w, uniforms[b, c, w, 0], scalars[6], scalars[7])
                _burst(missed, b, c, w, uniforms[b, c, w, 1], scalars[8], scalars[9])
                found = n_seen >= scalars[10] and not missed[b, c, w]
                _report(
                    slow[b, c, w], size[b, c, w], normals[b, c, w], uv, depth, state, image[c, 2],
                    found, swapped[b, c, w], scalars, per_joint, mirror, visibility, error,
                    px[b, c, w], confidence[b, c, w], sigma[b, c, w],
                )  # fmt: skip


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _project(P, joints, uv, depth):
    for j in range(len(joints)):
        x, y, z = joints[j, 0], joints[j, 1], joints[j, 2]
        depth[j] = P[2, 0] * x + P[2, 1] * y + P[2, 2] * z + P[2, 3]
        safe = depth[j] if abs(depth[j]) > 1e-9 else 1e-9
        uv[j, 0] = (P[0, 0] * x + P[0, 1] * y + P[0, 2] * z + P[0, 3]) / safe
        uv[j, 1] = (P[1, 0] * x + P[1, 1] * y + P[1, 2] * z + P[1, 3]) / safe


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _sight(
    uv, depth, hidden, eye, joints, bodies, radii, centre, reach, image, state
):  # fmt: skip
    """How each joint appears: 0 seen, 1 hidden, 2 outside, 3 not ahead. Counts the seen."""
    n_seen = 0
    for j in range(len(joints)):
        if depth[j] < MIN_DEPTH_M:
            state[j] = 3
        elif uv[j, 0] < 0 or uv[j, 0] >= image[0] or uv[j, 1] < 0 or uv[j, 1] >= image[1]:
            state[j] = 2
        elif hidden[j] or hidden_by_capsules(eye, joints[j], bodies, radii, centre, reach):
            state[j] = 1
        else:
            state[j] = 0
            n_seen += 1
    return n_seen


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _burst(active, b, c, w, uniform, begin, end):
    """A two-state Markov chain: bursts of mean length 1 / end images."""
    if active[b, c, w]:
        active[b, c, w] = uniform >= end
    else:
        active[b, c, w] = uniform < begin


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _report(
    slow, size, normals, uv, depth, state, focal_px,
    found, swapped, scalars, per_joint, mirror, visibility, error,
    px, confidence, sigma,
):  # fmt: skip
    """Errors of one worker in one image, and what is then reported of each joint."""
    stature_m, keep, renew, share_slow, share_new = scalars[:5]
    stature_px = focal_px * stature_m / max(depth.mean(), MIN_DEPTH_M)
    for j in range(len(depth)):
        slow[j, 0] = keep * slow[j, 0] + renew * normals[j, 0]
        slow[j, 1] = keep * slow[j, 1] + renew * normals[j, 1]
        size[j] = keep * size[j] + renew * normals[j, 2]
        label = mirror[j] if swapped else j
        if not found or state[j] == 3:
            px[label, 0] = px[label, 1] = np.nan
            confidence[label] = 0.0
            sigma[label] = np.inf
            continue
        seen = per_joint[0 if state[j] == 0 else 1, :, j]
        scale = seen[0] * math.exp(seen[2] * size[j])
        dx = scale * (share_slow * slow[j, 0] + share_new * normals[j, 3])
        dy = scale * (share_slow * slow[j, 1] + share_new * normals[j, 4])
        shrink = stature_px * min(1.0, scalars[5] / max(math.sqrt(dx * dx + dy * dy), 1e-12))
        px[label, 0] = uv[j, 0] + shrink * dx
        px[label, 1] = uv[j, 1] + shrink * dy
        visible = 1.0 / (1.0 + math.exp(-(seen[1] - UNSURE * size[j])))
        confidence[label] = min(visible, scalars[11]) if state[j] == 2 else visible
        sigma[label] = stature_px * error_share(confidence[label], visibility, error)
