"""The emulator's inner loop: one environment after the other, on plain arrays."""

import math

import numba
import numpy as np

from hrc_env.compiled import JIT, LEAN
from hrc_env.geometry.shapes import passage, set_capsules, set_rows
from hrc_env.geometry.sight import blocks, line, look, make_table, meets
from hrc_env.optics.lens import FOLD, bent, stretch_at
from hrc_env.perception.noise import error_share
from hrc_env.perception.self_occlusion import body_blocks

MIN_DEPTH_M = 0.5
"""Nearer to a camera's plane there is no image of a person."""

FOCAL, CENTRE = FOLD + 1, FOLD + 3
"""Columns of a camera's row of `bending` behind its lens: fx and fy, 0 if it has no lens; cx and
cy."""

UNSURE = 0.7
"""How much the logit of the reported visibility drops when errors are larger by one step."""


@numba.njit(**JIT)
def emulate_batch(
    slow, size, swapped, missed, normals, uniforms,
    joints, capsules, radius, still, moving, robot, robot_radius,
    P, eyes, image, bending, scalars, per_joint, mirror, visibility, error, px, confidence, sigma,
):  # fmt: skip
    """Advance the errors by one image and write keypoints; arguments as in `emulate`."""
    batch, n_cameras, n_workers, n_joints = confidence.shape
    n_body, n_moving = radius.shape[2], moving.shape[1]
    first_moving = len(still) + len(robot_radius)
    first_body = first_moving + n_moving
    table = make_table(still, len(robot_radius) + n_moving + n_workers * n_body)
    view, rows = np.empty((5, len(table))), np.empty(len(table), np.int64)
    uv, depth, state = np.empty((n_joints, 2)), np.empty(n_joints), np.empty(n_joints, np.int64)
    for b in range(batch):
        set_capsules(table, len(still), robot[b], robot_radius)
        set_rows(table, first_moving, moving[b])
        for w in range(n_workers):
            set_capsules(table, first_body + w * n_body, capsules[b, w], radius[b, w])
        for c in range(n_cameras):
            for w in range(n_workers):
                _project(P[c], joints[b, w], uv, depth)
                _burst(swapped, b, c, w, uniforms[b, c, w, 0], scalars[6], scalars[7])
                _burst(missed, b, c, w, uniforms[b, c, w, 1], scalars[8], scalars[9])
                found = not missed[b, c, w]
                focal_px = image[c, 2]
                if bending[c, FOCAL] > 0.0:
                    focal_px /= _bend(bending[c], uv, depth)
                if found:
                    _image(uv, depth, image[c], state)
                    n_seen = _sight(eyes[c], joints[b, w], table, first_body, view, rows, state)
                    found = n_seen >= scalars[10]
                _report(
                    slow[b, c, w], size[b, c, w], normals[b, c, w], uv, depth, state, focal_px,
                    found, swapped[b, c, w], scalars, per_joint, mirror, visibility, error,
                    px[b, c, w], confidence[b, c, w], sigma[b, c, w],
                )  # fmt: skip


@numba.njit(**LEAN)
def _project(P, joints, uv, depth):
    for j in range(len(joints)):
        x, y, z = joints[j, 0], joints[j, 1], joints[j, 2]
        depth[j] = P[2, 0] * x + P[2, 1] * y + P[2, 2] * z + P[2, 3]
        safe = depth[j] if abs(depth[j]) > 1e-9 else 1e-9
        uv[j, 0] = (P[0, 0] * x + P[0, 1] * y + P[0, 2] * z + P[0, 3]) / safe
        uv[j, 1] = (P[1, 0] * x + P[1, 1] * y + P[1, 2] * z + P[1, 3]) / safe


@numba.njit(**LEAN)
def _bend(bending, uv, depth):
    """Bend pinhole pixels in place. How many times longer the pinhole shows the body."""
    fx, fy, cx, cy = bending[FOCAL], bending[FOCAL + 1], bending[CENTRE], bending[CENTRE + 1]
    total, n = 0.0, 0
    for j in range(len(depth)):
        if depth[j] >= MIN_DEPTH_M:
            x, y = (uv[j, 0] - cx) / fx, (uv[j, 1] - cy) / fy
            total += stretch_at(bending, x, y)
            n += 1
            x, y = bent(bending, x, y)
            uv[j, 0], uv[j, 1] = x * fx + cx, y * fy + cy
    return total / n if n > 0 else 1.0


@numba.njit(**LEAN)
def _image(uv, depth, image, state):
    """Where each joint appears: 0 in the image, 2 outside, 3 not ahead."""
    for j in range(len(depth)):
        if depth[j] < MIN_DEPTH_M:
            state[j] = 3
        elif uv[j, 0] < 0 or uv[j, 0] >= image[0] or uv[j, 1] < 0 or uv[j, 1] >= image[1]:
            state[j] = 2
        else:
            state[j] = 0


@numba.njit(**LEAN)
def _sight(eye, joints, table, first_body, view, rows, state):
    """State 1 for joints in the image that something hides. Counts the seen.

    Bodies are the table's rows from `first_body` on; the rest is as in `geometry.sight`.
    """
    n_view, n_seen = look(eye, joints, table, view, rows), 0
    for j in range(len(joints)):
        if state[j] == 0:
            if _is_hidden(eye, joints, j, table, first_body, view, rows, n_view):
                state[j] = 1
            else:
                n_seen += 1
    return n_seen


@numba.njit(**LEAN)
def _is_hidden(eye, joints, j, table, first_body, view, rows, n_view):
    dx, dy, dz, length = line(eye, joints, j)
    for i in range(n_view):
        if meets(view, i, dx, dy, dz, length):
            row, px, py, pz = rows[i], -view[0, i], -view[1, i], -view[2, i]
            if row >= first_body:
                if body_blocks(table, row, px, py, pz, dx, dy, dz, length):
                    return True
                continue
            enter, leave = passage(table, row, px, py, pz, dx, dy, dz)
            if blocks(enter, leave, length):
                return True
    return False


@numba.njit(**LEAN)
def _burst(active, b, c, w, uniform, begin, end):
    """A two-state Markov chain: bursts of mean length 1 / end images."""
    if active[b, c, w]:
        active[b, c, w] = uniform >= end
    else:
        active[b, c, w] = uniform < begin


@numba.njit(**LEAN)
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
        group = 0 if state[j] == 0 else 1
        scale = per_joint[group, 0, j] * math.exp(per_joint[group, 2, j] * size[j])
        dx = scale * (share_slow * slow[j, 0] + share_new * normals[j, 3])
        dy = scale * (share_slow * slow[j, 1] + share_new * normals[j, 4])
        shrink = stature_px * min(1.0, scalars[5] / max(math.sqrt(dx * dx + dy * dy), 1e-12))
        px[label, 0] = uv[j, 0] + shrink * dx
        px[label, 1] = uv[j, 1] + shrink * dy
        visible = 1.0 / (1.0 + math.exp(UNSURE * size[j] - per_joint[group, 1, j]))
        confidence[label] = min(visible, scalars[11]) if state[j] == 2 else visible
        sigma[label] = stature_px * error_share(confidence[label], visibility, error)
