"""Kernels that compute the views of workers in cameras, one environment after another."""

from typing import Annotated, NamedTuple

import numpy as np

from hrc_env.core.declared import Records1, dtype_of
from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Capsules, Floats, Ints, Points2, Points3, Velocities3
from hrc_env.geometry.lens import FOLD, distort_point, magnification_at
from hrc_env.geometry.shapes import set_capsules, set_rows
from hrc_env.geometry.sight import Occluders, is_hidden, make_occluders, select_occluders
from hrc_env.geometry.triangulation import pixel_of
from hrc_env.perception import outline
from hrc_env.perception.windows import MIN_DEPTH_M, Window, fit_window

SEEN, HIDDEN, OUTSIDE, BEHIND = range(4)
"""Values of the visibility of a joint: seen, occluded, outside the image, or behind the camera."""
SIDE, TURN, VIEW, FOLDING, KNEELING, HANDLING, STEPPING = range(N_LOOK := 7)
"""Columns that describe the view of a worker: side [px] and rotation [rad] of the window around the
body, viewing direction (`outline.view_angle`) [rad], and four measures of the posture, which are
computed by the functions of `outline` with the corresponding names."""


class ImageCamera:
    """Parameters of a camera, its lens and its image."""

    P: Annotated[Floats, (3, 4)]
    """Projection matrix to pinhole pixels."""
    eye: Annotated[Floats, (3,)]
    """Optical centre in the world frame [m]."""
    size_px: Annotated[Floats, (2,)]
    """Width and height of the image [px]."""
    focal_px: Annotated[Floats, (2,)]
    """Focal lengths fx and fy [px]."""
    centre_px: Annotated[Floats, (2,)]
    """Principal point cx and cy [px]."""
    lens: Annotated[Floats, (FOLD + 1,)]
    """Row of the lens, as returned by `lens.lens_row`."""
    has_lens: bool
    """Whether the lens distorts the image."""


class WorkerView:
    """The view of a worker in the image of a camera."""

    uv: Annotated[Points2, (N_JOINTS, 2)]
    """Joints in pixels of the image, including lens distortion [px]."""
    depth: Annotated[Floats, (N_JOINTS,)]
    """Depth of each joint along the camera's axis [m]."""
    sight: Annotated[Ints, (N_JOINTS,)]
    """Visibility of each joint: `SEEN`, `HIDDEN`, `OUTSIDE` or `BEHIND`."""
    look: Annotated[Floats, (N_LOOK,)]
    """View of the worker, in the columns `SIDE` to `STEPPING`."""


CAMERA = dtype_of(ImageCamera)
"""The dtype of `ImageCamera`."""
WORKER_VIEW = dtype_of(WorkerView)
"""The dtype of `WorkerView`."""


class World(NamedTuple):
    """The workers and their surroundings in B environments."""

    joints: Points3
    """(B, W, J, 3) positions of the workers' joints [m]."""
    velocity: Velocities3
    """(B, W, J, 3) velocities of the joints [m/s]."""
    capsules: Capsules
    """(B, W, K, 2, 3) capsules of the workers' bodies [m]."""
    radius: Floats
    """(B, W, K) radii of the workers' capsules [m]."""
    still: Floats
    """(G, `shapes.WIDTH`) shapes that never move."""
    moving: Floats
    """(B, M, `shapes.WIDTH`) movable shapes, such as carried objects."""
    robot: Capsules
    """(B, N, 2, 3) capsules of the robot [m]."""
    robot_radius: Floats
    """(N,) radii of the robot's capsules [m]."""


@kernel(makes_arrays=True)
def view_workers(world: World, rig: Records1[ImageCamera], sight: Ints, look_of: Floats) -> None:
    """Compute the true visibilities of joints and the views of workers in cameras.

    Args:
        world: workers and surroundings in B environments.
        rig: (C,) cameras.
        sight: (B, C, W, J) output: visibility of the joints, `SEEN` to `BEHIND`.
        look_of: (B, C, W, `N_LOOK`) output: the columns `SIDE` to `STEPPING`.
    """
    occluders, views = make_room(world), np.empty(1, WORKER_VIEW)
    for b in range(len(world.joints)):
        place_moving(occluders.table, world, b)
        for w in range(world.joints.shape[1]):
            joints = world.joints[b, w]
            front = outline.facing(joints)
            for c in range(len(rig)):
                view = views[0]  # inside the loop, because a record does not keep its array alive
                view_worker(rig[c], joints, joints, occluders, view)
                view.look[VIEW] = outline.view_angle(joints, front, rig[c].eye)
                view.look[FOLDING] = outline.folding(joints)
                view.look[KNEELING] = outline.kneeling(joints)
                view.look[HANDLING] = outline.handling(joints)
                view.look[STEPPING] = outline.stepping(outline.speed(world.velocity[b, w]))
                sight[b, c, w], look_of[b, c, w] = view.sight, view.look


@kernel(makes_arrays=True)
def make_room(world: World) -> Occluders:
    """Return a table of the static shapes, with empty rows for an environment's moving shapes."""
    n_bodies, n_body = world.radius.shape[1:]
    n_more = len(world.robot_radius) + world.moving.shape[1]
    return make_occluders(world.still, n_more, n_bodies * n_body)


@kernel
def place_moving(table: Floats, world: World, b: int) -> None:
    """Copy the moving shapes of environment b to a table, after the static shapes."""
    row, n_body = len(world.still), world.radius.shape[2]
    set_capsules(table, row, world.robot[b], world.robot_radius)
    row += len(world.robot_radius)
    set_rows(table, row, world.moving[b])
    row += world.moving.shape[1]
    for w in range(world.radius.shape[1]):
        set_capsules(table, row + w * n_body, world.capsules[b, w], world.radius[b, w])


@kernel
def view_worker(
    camera: ImageCamera, joints: Points3, meant: Points3, occluders: Occluders, view: WorkerView
) -> int:
    """Project a worker into an image, and determine the visibility of the joints.

    Args:
        camera: the camera.
        joints: (J, 3) true joints, which are tested for occlusion [m].
        meant: (J, 3) positions of the joints including the detector's errors, which are projected
            [m].
        occluders: all shapes of the environment.
        view: output: the view, except the columns of `look` after `TURN`.

    Returns:
        The number of visible joints.
    """
    uv, depth = view.uv, view.depth
    view.look[SIDE], view.look[TURN] = project_worker(camera, meant, uv, depth)
    n_view, n_seen = select_occluders(camera.eye, joints, occluders), 0
    for j in range(len(joints)):
        view.sight[j] = _locate_pixel(camera, uv[j], depth[j])
        if view.sight[j] == SEEN:
            if is_hidden(camera.eye, joints, j, occluders, n_view):
                view.sight[j] = HIDDEN
            else:
                n_seen += 1
    return n_seen


@kernel
def project_worker(camera: ImageCamera, joints: Points3, uv: Points2, depth: Floats) -> Window:
    """Project joints into an image, and return the window around them.

    Args:
        camera: the camera.
        joints: (J, 3) positions of the joints [m].
        uv: (J, 2) output: the joints in pixels of the image [px].
        depth: (J,) output: the depths along the camera's axis [m].
    """
    for j in range(len(joints)):
        x, y, z = joints[j, 0], joints[j, 1], joints[j, 2]
        uv[j, 0], uv[j, 1], depth[j] = pixel_of(camera.P, x, y, z)
    total = 0.0
    for j in range(1, 3):
        total += depth[j] + depth[j + 6]
    px_per_m = 4.0 * camera.focal_px[0] / max(total, 4.0 * MIN_DEPTH_M)
    if camera.has_lens:
        px_per_m /= _distort_joints(camera, uv, depth)
    return fit_window(uv, depth, px_per_m, MIN_DEPTH_M)


@kernel
def _distort_joints(camera: ImageCamera, uv: Points2, depth: Floats) -> float:
    """Distort pinhole pixels in place, and return the mean magnification of the pinhole image.

    The magnification at a joint is the ratio of lengths in the pinhole image to lengths in the
    distorted image. Joints nearer than `MIN_DEPTH_M` are not changed and not included in the mean.

    Args:
        camera: the camera.
        uv: (J, 2) pixels of the joints without distortion, replaced by those with distortion [px].
        depth: (J,) distances along the camera's axis [m].

    Returns:
        The mean over the joints; 1 if no joint is included.
    """
    focal_x, focal_y = camera.focal_px[0], camera.focal_px[1]
    centre_x, centre_y = camera.centre_px[0], camera.centre_px[1]
    total, n_joints = 0.0, 0
    for j in range(len(depth)):
        if depth[j] >= MIN_DEPTH_M:
            x, y = (uv[j, 0] - centre_x) / focal_x, (uv[j, 1] - centre_y) / focal_y
            total += magnification_at(camera.lens, x, y)
            n_joints += 1
            lens_x, lens_y = distort_point(camera.lens, x, y)
            uv[j, 0], uv[j, 1] = lens_x * focal_x + centre_x, lens_y * focal_y + centre_y
    return total / n_joints if n_joints > 0 else 1.0


@kernel
def _locate_pixel(camera: ImageCamera, pixel: Floats, depth: float) -> int:
    """Return `SEEN` for a pixel (2,) inside the image, otherwise `OUTSIDE` or `BEHIND`."""
    if depth < MIN_DEPTH_M:
        return BEHIND
    for i in range(2):
        if pixel[i] < 0.0 or pixel[i] >= camera.size_px[i]:
            return OUTSIDE
    return SEEN
