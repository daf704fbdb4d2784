"""Lines of sight: how cameras see workers, on plain arrays, one environment after the other."""

from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.geometry.lens import FOLD, distorted, magnification_at
from hrc_env.geometry.shapes import passage, set_capsules, set_rows
from hrc_env.geometry.sight import blocks, line, look, make_table, meets
from hrc_env.perception.outline import (
    facing,
    folded,
    handling,
    kneeling,
    seen_from,
    speed,
    stepping,
    window_round,
)
from hrc_env.perception.self_occlusion import body_blocks

MIN_DEPTH_M = 0.5
"""Nearer to a camera's plane there is no image of a person."""

FOCAL, CENTRE = FOLD + 1, FOLD + 3
"""Columns of a camera's row of `lenses` behind its lens: fx and fy, 0 if it has no lens; cx and
cy."""

SEEN, HIDDEN, OUTSIDE, BEHIND = range(4)
"""How a camera sees a joint: nothing before it, something before it, outside the image, behind
the camera."""

SIDE, TURN, VIEW, FOLDING, KNEELING, HANDLING, STEPPING = range(N_LOOK := 7)
"""How a camera sees a worker: side [px] and turn [rad] of the window round them, from where
(`outline.seen_from`) [rad], how folded they are, whether they then kneel, whether their hands are
busy, whether they walk."""


class World(NamedTuple):
    """What there is to see, in B environments."""

    joints: Floats
    """(B, W, J, 3) [m]."""
    velocity: Floats
    """(B, W, J, 3) [m/s]."""
    capsules: Floats
    """(B, W, K, 2, 3) the workers' [m]."""
    radius: Floats
    """(B, W, K) [m]."""
    still: Floats
    """(G, `shapes.WIDTH`)."""
    moving: Floats
    """(B, M, `shapes.WIDTH`)."""
    robot: Floats
    """(B, N, 2, 3) capsules [m]."""
    robot_radius: Floats
    """(N,) [m]."""


class Rig(NamedTuple):
    """C cameras."""

    P: Floats
    """(C, 3, 4) projections."""
    eyes: Floats
    """(C, 3) [m]."""
    image: Floats
    """(C, 3) width, height, focal length [px]."""
    lenses: Floats
    """(C, `CENTRE` + 2) lenses; zeros for pinholes."""


@kernel(makes_arrays=True)
def sight_batch(world, rig, sight, look_of):
    """Write how joints (B, C, W, J) and workers (B, C, W, `N_LOOK`) are seen; nothing errs."""
    n_workers, n_joints = world.joints.shape[1:3]
    n_body = world.radius.shape[2]
    first_body = len(world.still) + len(world.robot_radius) + world.moving.shape[1]
    table = make_table(world.still, first_body - len(world.still) + n_workers * n_body)
    view, rows = np.empty((5, len(table))), np.empty(len(table), np.int64)
    uv, depth = np.empty((n_joints, 2)), np.empty(n_joints)
    for b in range(len(world.joints)):
        fill(table, world, b)
        for w in range(n_workers):
            joints = world.joints[b, w]
            front_x, front_y = facing(joints)
            for c in range(len(rig.P)):
                mine = look_of[b, c, w]
                see(
                    rig, c, joints, joints, table, first_body, view, rows, uv, depth,
                    sight[b, c, w], mine,
                )  # fmt: skip
                mine[VIEW] = seen_from(joints, front_x, front_y, rig.eyes[c])
                mine[FOLDING] = folded(joints)
                mine[KNEELING] = kneeling(joints)
                mine[HANDLING] = handling(joints)
                mine[STEPPING] = stepping(speed(world.velocity[b, w]))


@kernel
def fill(table, world, b):
    """Write everything that moves in environment b behind what never does."""
    row, n_body = len(world.still), world.radius.shape[2]
    set_capsules(table, row, world.robot[b], world.robot_radius)
    row += len(world.robot_radius)
    set_rows(table, row, world.moving[b])
    row += world.moving.shape[1]
    for w in range(world.radius.shape[1]):
        set_capsules(table, row + w * n_body, world.capsules[b, w], world.radius[b, w])


@kernel
def see(rig, c, joints, meant, table, first_body, view, rows, uv, depth, state, look_of):
    """Project what is meant, find out what hides the joints. How many of these are seen."""
    _project(rig.P[c], meant, uv, depth)
    total = 0.0
    for j in range(1, 3):
        total += depth[j] + depth[j + 6]
    px_per_m = 4.0 * rig.image[c, 2] / max(total, 4.0 * MIN_DEPTH_M)
    if rig.lenses[c, FOCAL] > 0.0:
        px_per_m /= _distort(rig.lenses[c], uv, depth)
    look_of[SIDE], look_of[TURN] = window_round(uv, depth, px_per_m, MIN_DEPTH_M)
    _image(uv, depth, rig.image[c], state)
    return _sight(rig.eyes[c], joints, table, first_body, view, rows, state)


@kernel
def _project(P, joints, uv, depth):
    for j in range(len(joints)):
        x, y, z = joints[j, 0], joints[j, 1], joints[j, 2]
        depth[j] = P[2, 0] * x + P[2, 1] * y + P[2, 2] * z + P[2, 3]
        safe = depth[j] if abs(depth[j]) > 1e-9 else 1e-9
        uv[j, 0] = (P[0, 0] * x + P[0, 1] * y + P[0, 2] * z + P[0, 3]) / safe
        uv[j, 1] = (P[1, 0] * x + P[1, 1] * y + P[1, 2] * z + P[1, 3]) / safe


@kernel
def _distort(lenses, uv, depth):
    """Distort pinhole pixels in place. How many times longer the pinhole shows the body."""
    fx, fy, cx, cy = lenses[FOCAL], lenses[FOCAL + 1], lenses[CENTRE], lenses[CENTRE + 1]
    total, n = 0.0, 0
    for j in range(len(depth)):
        if depth[j] >= MIN_DEPTH_M:
            x, y = (uv[j, 0] - cx) / fx, (uv[j, 1] - cy) / fy
            total += magnification_at(lenses, x, y)
            n += 1
            x, y = distorted(lenses, x, y)
            uv[j, 0], uv[j, 1] = x * fx + cx, y * fy + cy
    return total / n if n > 0 else 1.0


@kernel
def _image(uv, depth, image, state):
    """Which joints are in the image."""
    for j in range(len(depth)):
        if depth[j] < MIN_DEPTH_M:
            state[j] = BEHIND
        elif uv[j, 0] < 0 or uv[j, 0] >= image[0] or uv[j, 1] < 0 or uv[j, 1] >= image[1]:
            state[j] = OUTSIDE
        else:
            state[j] = SEEN


@kernel
def _sight(eye, joints, table, first_body, view, rows, state):
    """Mark the joints in the image that something hides. Counts the seen.

    Bodies are the table's rows from `first_body` on; the rest is as in `geometry.sight`.
    """
    n_view, n_seen = look(eye, joints, table, view, rows), 0
    for j in range(len(joints)):
        if state[j] == SEEN:
            if _is_hidden(eye, joints, j, table, first_body, view, rows, n_view):
                state[j] = HIDDEN
            else:
                n_seen += 1
    return n_seen


@kernel
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
