"""Lines of sight: how cameras see workers, one environment after the other."""

from typing import NamedTuple

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats
from hrc_env.geometry.lens import FOLD, distort_point, magnification_at
from hrc_env.geometry.shapes import set_capsules, set_rows
from hrc_env.geometry.sight import is_hidden, make_occluders, select_occluders
from hrc_env.geometry.triangulation import pixel_of
from hrc_env.perception import outline
from hrc_env.perception.windows import MIN_DEPTH_M, window_round

SEEN, HIDDEN, OUTSIDE, BEHIND = range(4)
"""How a camera sees a joint: free, behind something, outside the image, behind the camera."""
SIDE, TURN, VIEW, FOLDING, KNEELING, HANDLING, STEPPING = range(N_LOOK := 7)
"""How a camera sees a worker: side [px] and turn [rad] of the window round them, from where
(`outline.seen_from`) [rad], and what `outline` says of their posture."""
CAMERA = np.dtype(
    [
        ("P", "f8", (3, 4)),  # projection
        ("eye", "f8", (3,)),  # [m]
        ("size_px", "f8", (2,)),  # width, height
        ("focal_px", "f8", (2,)),  # fx, fy
        ("centre_px", "f8", (2,)),  # cx, cy
        ("lens", "f8", (FOLD + 1,)),  # `lens.lens_row`
        ("has_lens", "?"),
    ],
    align=True,
)
JOINTS_SEEN = np.dtype(
    [
        ("uv", "f8", (N_JOINTS, 2)),  # pixels of the image, as the lens distorts it
        ("depth", "f8", (N_JOINTS,)),  # [m]
        ("sight", "i8", (N_JOINTS,)),  # `SEEN` to `BEHIND`
        ("look", "f8", (N_LOOK,)),  # `SIDE` to `STEPPING`
    ],
    align=True,
)
"""A worker in one image."""


class World(NamedTuple):
    """What there is to see, in B environments."""

    joints: Floats  # (B, W, J, 3) [m]
    velocity: Floats  # (B, W, J, 3) [m/s]
    capsules: Floats  # (B, W, K, 2, 3) the workers' [m]
    radius: Floats  # (B, W, K) [m]
    still: Floats  # (G, `shapes.WIDTH`)
    moving: Floats  # (B, M, `shapes.WIDTH`)
    robot: Floats  # (B, N, 2, 3) capsules [m]
    robot_radius: Floats  # (N,) [m]


@kernel(makes_arrays=True)
def sight_batch(world, rig, sight, look_of):
    """Write how joints (B, C, W, J) and workers (B, C, W, `N_LOOK`) are seen; nothing errs."""
    occluders, room = occluders_of(world), np.empty(1, JOINTS_SEEN)
    for b in range(len(world.joints)):
        fill(occluders.table, world, b)
        for w in range(world.joints.shape[1]):
            joints = world.joints[b, w]
            front_x, front_y = outline.facing(joints)
            for c in range(len(rig)):
                seen = room[0]  # within the loop: a record does not keep its array alive
                see(rig[c], joints, joints, occluders, seen)
                seen.look[VIEW] = outline.seen_from(joints, front_x, front_y, rig[c].eye)
                seen.look[FOLDING] = outline.folded(joints)
                seen.look[KNEELING] = outline.kneeling(joints)
                seen.look[HANDLING] = outline.handling(joints)
                seen.look[STEPPING] = outline.stepping(outline.speed(world.velocity[b, w]))
                sight[b, c, w], look_of[b, c, w] = seen.sight, seen.look


@kernel(makes_arrays=True)
def occluders_of(world):
    """Room for all that can stand in the way in an environment, and what never moves of it."""
    n_bodies, n_body = world.radius.shape[1:]
    n_more = len(world.robot_radius) + world.moving.shape[1]
    return make_occluders(world.still, n_more, n_bodies * n_body)


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
def see(camera, joints, meant, occluders, seen):
    """Project what is meant (J, 3), find out what hides the joints. How many of these are seen."""
    uv, depth = seen.uv, seen.depth
    seen.look[SIDE], seen.look[TURN] = frame(camera, meant, uv, depth)
    n_view, n_seen = select_occluders(camera.eye, joints, occluders), 0
    for j in range(len(joints)):
        seen.sight[j] = _in_image(camera, uv[j], depth[j])
        if seen.sight[j] == SEEN:
            if is_hidden(camera.eye, joints, j, occluders, n_view):
                seen.sight[j] = HIDDEN
            else:
                n_seen += 1
    return n_seen


@kernel
def frame(camera, joints, uv, depth):
    """Side [px] and turn [rad] of the window round joints (J, 3); where in the image these are
    (J, 2) and their depths (J,) are written."""
    for j in range(len(joints)):
        x, y, z = joints[j, 0], joints[j, 1], joints[j, 2]
        uv[j, 0], uv[j, 1], depth[j] = pixel_of(camera.P, x, y, z)
    total = 0.0
    for j in range(1, 3):
        total += depth[j] + depth[j + 6]
    px_per_m = 4.0 * camera.focal_px[0] / max(total, 4.0 * MIN_DEPTH_M)
    if camera.has_lens:
        px_per_m /= _distort(camera, uv, depth)
    return window_round(uv, depth, px_per_m, MIN_DEPTH_M)


@kernel
def _distort(camera, uv, depth):
    """Distort pinhole pixels in place. How many times longer the pinhole shows the body."""
    fx, fy = camera.focal_px[0], camera.focal_px[1]
    cx, cy = camera.centre_px[0], camera.centre_px[1]
    total, n = 0.0, 0
    for j in range(len(depth)):
        if depth[j] >= MIN_DEPTH_M:
            x, y = (uv[j, 0] - cx) / fx, (uv[j, 1] - cy) / fy
            total += magnification_at(camera.lens, x, y)
            n += 1
            x, y = distort_point(camera.lens, x, y)
            uv[j, 0], uv[j, 1] = x * fx + cx, y * fy + cy
    return total / n if n > 0 else 1.0


@kernel
def _in_image(camera, pixel, depth):
    """`SEEN` for a pixel that lies in the image, else `OUTSIDE` or `BEHIND`."""
    if depth < MIN_DEPTH_M:
        return BEHIND
    for i in range(2):
        if pixel[i] < 0.0 or pixel[i] >= camera.size_px[i]:
            return OUTSIDE
    return SEEN
