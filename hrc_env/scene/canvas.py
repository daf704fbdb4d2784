"""Renderer of a posed scene from a camera, with a separate OpenGL context.

The context is made when the first picture is rendered, and is current only during rendering:
threads may take turns, and several canvases never interfere with each other.
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import RenderingError, check_shape
from hrc_env.core.records import Roi, WorkerMotion
from hrc_env.core.typing import Capsules, Floats, Image, JointAngles, Points3
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.scene import gl
from hrc_env.scene.build import Scene, drawing_model, find_visuals
from hrc_env.scene.domain_randomization import (
    Look,
    add_litter,
    hide_hats,
    randomize,
    restore,
)
from hrc_env.scene.primitives import (
    DECORATION,
    OVERHEAD,
    ROBOT_CAPSULES,
    ROBOT_LOOKS,
    SOLID,
    rod_pose,
)
from hrc_env.scene.rig import glcam_axes
from hrc_env.scene.worker_visuals import PARKED_M, show_bodies, show_workers

SPHERE_M = 1e-6
"""Half length of a capsule below which it is rendered as a sphere [m]."""
ALL_GROUPS = (SOLID, DECORATION, ROBOT_LOOKS, OVERHEAD)
"""Groups of geoms that are visible in pictures."""


@dataclass(frozen=True, slots=True)
class Part:
    """A part of the scene that a picture shows."""

    category: mujoco.mjtCatBit
    """MuJoCo's category of the shown geoms: all, static or dynamic."""
    sky: bool
    """Whether the background is the sky; otherwise it is black."""
    sunny: bool = True
    """Whether the lights that cast shadows are on."""


EVERYTHING = Part(mujoco.mjtCatBit.mjCAT_ALL, True)
"""Part that comprises the whole scene."""
STILL = Part(mujoco.mjtCatBit.mjCAT_STATIC, True)
"""Part that comprises the static geoms."""
MOVING = Part(mujoco.mjtCatBit.mjCAT_DYNAMIC, False)
"""Part that comprises the moving geoms."""
IN_THE_SHADE = Part(mujoco.mjtCatBit.mjCAT_STATIC, True, sunny=False)
"""Part that comprises the static geoms, with lights that cast shadows switched off."""
BEFORE_THE_SUN = Part(mujoco.mjtCatBit.mjCAT_DYNAMIC, False, sunny=False)
"""Part that comprises the moving geoms, with lights that cast shadows switched off."""


@dataclass(frozen=True, slots=True, eq=False)
class Marks:
    """Capsules to show in a picture in addition to the scene; a capsule of length 0 is a sphere."""

    ends_world: Capsules
    """(N, 2, 3) end points of the capsules' axes [m]."""
    radius_m: Floats
    """(N,) radii of the capsules [m]."""
    rgb: Floats
    """(N, 3) RGB colours in [0, 1]."""


class Spheres(NamedTuple):
    """Centres and radii of spheres in the world frame."""

    centre_world: Points3
    """(N, 3) centres [m]."""
    radius_m: Floats
    """(N,) radii [m]."""


class Canvas:
    """Renderer of pictures of a scene, with a fixed size.

    Args:
        scene: the scene.
        width_px: width of the pictures [px].
        height_px: height of the pictures [px].
        quality: values of fields of MuJoCo's visual.quality by name.
    """

    def __init__(
        self, scene: Scene, width_px: int, height_px: int, quality: dict[str, int]
    ) -> None:
        self.scene, self.width_px, self.height_px = scene, width_px, height_px
        self._built = drawing_model(scene)
        self._model = copy.copy(self._built)  # for separate appearance and settings
        for name, value in quality.items():
            setattr(self._model.vis.quality, name, value)
        view = self._model.vis.global_
        view.offwidth, view.offheight = width_px, height_px
        self._data = mujoco.MjData(self._model)
        self._visuals = find_visuals(scene)
        self._look: Look | None = None
        show_bodies(self._model, self._visuals, None)
        self._option = mujoco.MjvOption()
        self._option.sitegroup[:] = 0
        self._camera = mujoco.MjvCamera()
        mujoco.mjv_defaultFreeCamera(self._model, self._camera)
        self._drawing: gl.Drawing | None = None
        self._lists: dict[Part, Any] = {}
        self._shown: Any = None
        self._fresh: set[Part] = set()
        self._kept: dict[Any, Any] = {}  # pictures of static geoms, for subclasses
        self._closed = False
        self.groups(ALL_GROUPS)

    def randomize(self, look: Look | None) -> None:
        """Set the appearance from the next pose on; None for the scene as built."""
        if look is self._look:
            return
        self._look = look
        self._kept.clear()
        if look is None:
            restore(self._model, self._built)
        else:
            randomize(self._model, self._built, self._visuals, look)
        self._take_over_textures()

    def pose(self, q: JointAngles, motion: WorkerMotion | None) -> None:
        """Pose the robot, the workers and the objects.

        Args:
            q: (N,) joint angles of the robot [rad], or (nq,) generalized positions of the robot,
                fingers and loose objects.
            motion: poses of the workers and their props, arrays (W, S, ...); None keeps them.
        """
        if len(q) != self._model.nq:
            check_shape("q", np.shape(q), self.scene.home_q.shape, "one angle per joint")
        self._data.qpos[: len(q)] = q
        if motion is not None:
            show_workers(self._model, self._data, self._visuals, motion)
            if self._look is not None:
                hide_hats(self._model, self._visuals, self._look)
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        self._fresh.clear()

    def show(self, part: Part = EVERYTHING, shadows: bool = False) -> None:
        """Choose the part of the scene that the next pictures show, in the current pose."""
        self._open()
        if part not in self._lists:
            self._lists[part] = mujoco.MjvScene(self._model, maxgeom=self._model.ngeom + 64)
        self._shown = self._lists[part]
        if part in self._fresh:
            return
        self._fresh.add(part)
        category = int(part.category)
        mujoco.mjv_updateScene(
            self._model, self._data, self._option, None, self._camera, category, self._shown
        )
        if self._look is not None and part.sky:
            add_litter(self._shown, self.scene.grounds, self._look)
        for light in self._shown.lights[: 0 if part.sunny else self._shown.nlight]:
            if light.castshadow:
                light.diffuse, light.specular = np.zeros(3), np.zeros(3)
        flags = self._shown.flags
        flags[mujoco.mjtRndFlag.mjRND_SHADOW.value] = shadows
        flags[mujoco.mjtRndFlag.mjRND_SKYBOX.value] = part.sky
        flags[mujoco.mjtRndFlag.mjRND_REFLECTION.value] = 0
        flags[mujoco.mjtRndFlag.mjRND_HAZE.value] = 0

    def show_marks(self, marks: Marks) -> None:
        """Let the next pictures show only marks, with the lights of the scene."""
        self._open()
        self._shown = mujoco.MjvScene(self._model, maxgeom=len(marks.radius_m) + 64)
        category = int(mujoco.mjtCatBit.mjCAT_DECOR)
        mujoco.mjv_updateScene(
            self._model, self._data, self._option, None, self._camera, category, self._shown
        )
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_SKYBOX):
            self._shown.flags[flag.value] = 0
        for (start, end), radius_m, rgb in zip(
            marks.ends_world, marks.radius_m, marks.rgb, strict=True
        ):
            middle, quaternion, half_m = rod_pose(start, end)
            turn, kind = np.zeros(9), mujoco.mjtGeom.mjGEOM_CAPSULE
            mujoco.mju_quat2Mat(turn, quaternion)
            if half_m < SPHERE_M:
                kind, turn = mujoco.mjtGeom.mjGEOM_SPHERE, np.eye(3).ravel()
            geom = self._shown.geoms[self._shown.ngeom]
            size, rgba = np.array([radius_m, half_m, 0.0]), np.array([*rgb, 1.0], np.float32)
            mujoco.mjv_initGeom(geom, int(kind), size, middle, turn, rgba)
            self._shown.ngeom += 1

    def groups(self, groups: Sequence[int]) -> None:
        """Restrict the next pictures to geoms of some groups."""
        self._option.geomgroup[:] = 0
        self._option.geomgroup[list(groups)] = 1
        self._fresh.clear()

    def aim(self, camera: PinholeCamera, window: Roi, height_px: float) -> None:
        """Render the next pictures from a camera, within a rotated rectangle of its image.

        Args:
            camera: the camera.
            window: centre, rotation and width (`side_px`) of the rectangle [px of the image].
            height_px: height of the rectangle [px of the image].
        """
        c, s = np.cos(window.rotation_rad), np.sin(window.rotation_rad)
        dx = window.centre_px[0] - camera.K[0, 2]
        dy = window.centre_px[1] - camera.K[1, 2]
        u, v = c * dx + s * dy, c * dy - s * dx  # the centre in the turned camera's image
        right, up, back = glcam_axes(camera).T
        for eye in self._shown.camera:
            scale = eye.frustum_near / camera.K[0, 0]
            eye.pos, eye.forward, eye.up = camera.eye_world, -back, s * right + c * up
            eye.frustum_center, eye.frustum_width = u * scale, window.side_px / 2 * scale
            eye.frustum_top = (height_px / 2 - v) * scale
            eye.frustum_bottom = (-height_px / 2 - v) * scale

    def aim_along(self, axes: Floats, middle_world: Floats, half_m: float, far_m: float) -> None:
        """Render the next pictures by a parallel projection, for example along sun rays.

        Args:
            axes: (3, 3) matrix with the directions right, down and along the rays as columns.
            middle_world: (3,) centre of the square in the near plane [m].
            half_m: half the side length of the square [m].
            far_m: distance of the far plane from the near plane [m].
        """
        _, down, direction = axes.T
        for eye in self._shown.camera:
            eye.orthographic = 1
            eye.pos, eye.forward, eye.up = middle_world - direction, direction, -down
            eye.frustum_near, eye.frustum_far = 1.0, 1.0 + far_m
            eye.frustum_center, eye.frustum_width = 0.0, half_m
            eye.frustum_top, eye.frustum_bottom = half_m, -half_m

    def sun_axes(self) -> Floats | None:
        """Return the axes (3, 3) of the first light that casts shadows; None if there is none.

        The columns are the directions right, down and along the light's rays.
        """
        shining = np.flatnonzero(self._model.light_castshadow & self._model.light_active)
        if not len(shining):
            return None
        along = self._data.light_xdir[shining[0]].copy()
        right = np.cross(along, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(along, right), along], -1)

    def find_moving_spheres(self) -> Spheres:
        """Return bounding spheres of moving geoms.

        A skin is covered by the spheres of its capsules.
        """
        model, bodies = self._model, self._model.geom_bodyid
        moving = (model.body_weldid[bodies] != 0) | (model.body_mocapid[bodies] >= 0)
        moving &= self._data.geom_xpos[:, 2] > PARKED_M[2] / 2
        moving &= model.geom_group != ROBOT_CAPSULES
        return Spheres(self._data.geom_xpos[moving], model.geom_rbound[moving])

    def read(self, rgb: NDArray[np.uint8] | None, z: NDArray[np.float32] | None) -> None:
        """Render a picture into arrays, bottom row first, which is the order of OpenGL.

        Args:
            rgb: (H, W, 3) output of the colours, which may be smaller than the canvas; None for no
                colours.
            z: (H, W) output of the depths, from 1 (near) to 0 (far); None for no depths.
        """
        shapes = [each.shape for each in (rgb, z) if each is not None]
        rect = mujoco.MjrRect(0, 0, shapes[0][1], shapes[0][0])
        with self._open().current() as looks:
            mujoco.mjr_render(rect, self._shown, looks)
            mujoco.mjr_readPixels(rgb, z, rect, looks)

    def paint(self) -> Image:
        """Render the picture (H, W, 3), top row first."""
        rgb = np.empty((self.height_px, self.width_px, 3), np.uint8)
        self.read(rgb, None)
        return np.ascontiguousarray(rgb[::-1])

    def depth_m(self) -> NDArray[np.float32]:
        """Render the distances (H, W) along the optical axis [m], top row first.

        For pixels without a geom, it is the distance of the far plane.
        """
        z = np.empty((self.height_px, self.width_px), np.float32)
        self.read(None, z)
        return self.distance_m(z[::-1])

    def distance_m(self, z: NDArray[np.float32]) -> NDArray[np.float32]:
        """Convert depths that `read` returned to distances along the optical axis [m]."""
        eye = self._shown.camera[0]
        near, far = float(eye.frustum_near), float(eye.frustum_far)
        return (near * far / (near + z.astype(float) * (far - near))).astype(np.float32)

    def close(self) -> None:
        """Free the context; the canvas cannot be used afterwards. A second call has no effect."""
        if self._drawing is not None:
            self._drawing.free()
        self._drawing = self._shown = None
        self._lists.clear()
        self._closed = True

    def __del__(self) -> None:
        try:  # at exit, modules may already be unloaded
            self.close()
        except Exception:
            return

    def _take_over_textures(self) -> None:
        """Copy the assignment of textures to materials into the context."""
        if self._drawing is not None:
            textures = self._model.mat_texid.ravel()
            self._drawing.looks.mat_texid[: len(textures)] = textures

    def _open(self) -> gl.Drawing:
        """Return the OpenGL context, which is made at the first call."""
        if self._closed:
            raise RenderingError("This renderer has been closed: create a new one.")
        if self._drawing is None:
            self._drawing = gl.new_context(self.width_px, self.height_px, self._model)
            with self._drawing.current() as looks:
                mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, looks)
                looks.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        return self._drawing
