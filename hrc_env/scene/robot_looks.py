"""Comparison of a robot's visual geoms with the capsules that represent it.

Cameras see the visual geoms, whereas distances, contacts and shields use the capsules. Points on
both surfaces are compared in the home pose.
"""

import warnings
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import mujoco
import numpy as np
from scipy.spatial import ConvexHull, KDTree, QhullError

from hrc_env.core.typing import Bools, Floats, Points3
from hrc_env.scene.robot_chain import find_id, find_link, parse_mjcf

if TYPE_CHECKING:
    from hrc_env.scene.robot import Robot

BARE_M = 0.1
"""Distance between a capsule's surface and the visual geoms above which the capsule is rendered
[m]."""
INSIDE_M = 0.005
"""Depth in another capsule beyond which a point on a capsule is not on the outer surface [m]."""
UNLIKE_M = 0.05
"""Difference between visual geoms and capsules above which a warning is issued [m]."""
SPACING_M = 0.02
"""Spacing of points on a surface [m]."""
MOST_POINTS = 4000
"""Maximum number of random points on a mesh at the spacing `SPACING_M`."""


class Mismatch(NamedTuple):
    """Difference between a capsule and the visual geoms on neighbouring links."""

    bare_m: float
    """Largest distance of the capsule's surface from the nearest visual geom [m]; infinite if there
    is none."""
    outside_m: float
    """Largest distance of visual geoms on the capsule's link from the nearest capsule [m]."""


@lru_cache(maxsize=64)
def bare_capsules(robot: "Robot") -> frozenset[str]:
    """Return the names of capsules that extend farther than `BARE_M` from visual geoms.

    These capsules are rendered, so that cameras see the surface to which distances are measured.
    Capsules of fingers and cups are never included.
    """
    hand = robot.hand or robot.suction
    spans = hand.spans if hand else ()
    return frozenset(
        name
        for name, mismatch in compare_looks(robot).items()
        if name not in spans and mismatch.bare_m > BARE_M
    )


def compare_looks(robot: "Robot", spacing_m: float = SPACING_M) -> dict[str, Mismatch]:
    """Compare each capsule with the visual geoms on its link and adjacent links, in the home pose.

    Args:
        robot: the robot.
        spacing_m: spacing of points on a surface [m].
    """
    model = parse_mjcf(robot).compile()
    data, hand = mujoco.MjData(model), robot.hand or robot.suction
    data.qpos[: len(robot.joints)] = robot.home_q
    mujoco.mj_kinematics(model, data)
    bodies = model.jnt_bodyid[[find_id(model, "joint", name) for name in robot.joints]].tolist()
    carrier = [find_link(model, bodies, body) for body in model.geom_bodyid]
    capsules = [find_id(model, "geom", name) for name in robot.capsules]
    pads = [find_id(model, "geom", name) for name in hand.pads] if hand else []
    looks = [geom for geom in range(model.ngeom) if geom not in (*capsules, *pads)]
    geoms = (*looks, *capsules)
    points = {geom: sample_surface(model, data, geom, spacing_m) for geom in geoms}
    along = data.geom_xmat[capsules].reshape(-1, 3, 3)[..., 2] * model.geom_size[capsules, 1:2]
    middle = data.geom_xpos[capsules]
    ends, radius_m = np.stack([middle - along, middle + along], 1), model.geom_size[capsules, 0]
    solids = [make_solid(model, data, geom) for geom in looks]
    mismatches: dict[str, Mismatch] = {}
    for k, (name, geom) in enumerate(zip(robot.capsules, capsules, strict=True)):
        link, others = carrier[geom], np.arange(len(capsules)) != k
        hull = points[geom]
        hull = hull[_outside_m(hull, ends[others], radius_m[others]) > -INSIDE_M]
        near = [points[each] for each in looks if abs(carrier[each] - link) <= 1]
        of_link = [points[each] for each in looks if carrier[each] == link]
        hidden = np.any([solid.contains(hull) for solid in solids], axis=0)
        mismatches[name] = Mismatch(
            bare_m=distance_from_looks_m(hull[~hidden] if solids else hull, near),
            outside_m=distance_from_capsules_m(of_link, ends, radius_m),
        )
    return mismatches


def warn_of_mismatch(robot: "Robot") -> None:
    """Issue a warning if visual geoms and capsules of a robot differ by more than `UNLIKE_M`."""
    drawn = bare_capsules(robot)
    for name, mismatch in compare_looks(robot).items():
        if name not in drawn and mismatch.bare_m > UNLIKE_M:
            warnings.warn(
                f"{robot.name}: capsule {name!r} reaches {100 * mismatch.bare_m:.0f} cm beyond the "
                "robot's visual geoms: cameras do not see the surface from which distances are "
                "measured. Add a visual geom, or shorten the capsule.",
                stacklevel=4,
            )
        if mismatch.outside_m > UNLIKE_M:
            warnings.warn(
                f"{robot.name}: visual geoms on the link of capsule {name!r} reach "
                f"{100 * mismatch.outside_m:.0f} cm beyond all capsules: people may touch a part "
                "that shields do not consider. Add a capsule to that link.",
                stacklevel=4,
            )


def sample_surface(
    model: mujoco.MjModel, data: mujoco.MjData, geom: int, spacing_m: float = SPACING_M
) -> Points3:
    """Sample points (N, 3) on the surface of a geom in the world [m].

    Args:
        model: the model.
        data: state of the model.
        geom: index of the geom.
        spacing_m: spacing of the points [m].
    """
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    if kind == int(mujoco.mjtGeom.mjGEOM_MESH):
        local = _on_mesh(model, int(model.geom_dataid[geom]), spacing_m)
    else:
        local = _ON_SHAPES.get(kind, _on_nothing)(size, spacing_m)
    return data.geom_xpos[geom] + local @ data.geom_xmat[geom].reshape(3, 3).T


class Solid(NamedTuple):
    """Geom in a given pose, used to determine whether points are inside it."""

    kind: int
    """MuJoCo's type of the geom."""
    size: Floats
    """(3,) MuJoCo's sizes of the geom [m]."""
    position_world: Points3
    """(3,) centre of the geom [m]."""
    rotation: Floats
    """(3, 3) rotation world_from_geom."""
    bounding_radius_m: float
    """Radius of a sphere around the centre that contains the geom [m]."""
    sides: Floats
    """(F, 4) half-spaces of a mesh's convex hull; empty for other types."""

    def contains(self, points_world: Points3) -> Bools:
        """Return a mask (N,) of points (N, 3) inside the geom; a mesh counts as its convex hull."""
        off = points_world - self.position_world
        inside = np.linalg.norm(off, axis=-1) < self.bounding_radius_m
        inside[inside] = self._contains(off[inside] @ self.rotation)
        return inside

    def _contains(self, local: Points3) -> Bools:
        """Return a mask (N,) of the points (N, 3) inside the geom, in the frame of the geom."""
        flat, height, size = np.hypot(*local[:, :2].T), np.abs(local[:, 2]), self.size
        inside = {
            mujoco.mjtGeom.mjGEOM_MESH: lambda: _are_inside(self.sides, local),
            mujoco.mjtGeom.mjGEOM_BOX: lambda: (np.abs(local) < size).all(-1),
            mujoco.mjtGeom.mjGEOM_CYLINDER: lambda: (flat < size[0]) & (height < size[1]),
            mujoco.mjtGeom.mjGEOM_CAPSULE: lambda: (
                np.hypot(flat, np.maximum(height - size[1], 0.0)) < size[0]
            ),
            mujoco.mjtGeom.mjGEOM_SPHERE: lambda: np.hypot(flat, height) < size[0],
            mujoco.mjtGeom.mjGEOM_ELLIPSOID: lambda: np.linalg.norm(local / size, axis=-1) < 1.0,
        }
        test = {int(kind): test for kind, test in inside.items()}.get(self.kind)
        return np.zeros(len(local), np.bool_) if test is None else np.asarray(test())


def make_solid(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Solid:
    """Return a geom in its pose in the world as a `Solid`."""
    kind, sides = int(model.geom_type[geom]), np.zeros((0, 4))
    if kind == int(mujoco.mjtGeom.mjGEOM_MESH):
        corners = _triangles(model, int(model.geom_dataid[geom]))
        sides = _sides_of_hull(corners.reshape(-1, 3))
    return Solid(
        kind=kind,
        size=model.geom_size[geom].copy(),
        position_world=data.geom_xpos[geom].copy(),
        rotation=data.geom_xmat[geom].reshape(3, 3).copy(),
        bounding_radius_m=float(model.geom_rbound[geom]),
        sides=sides,
    )


def _sides_of_hull(points_m: Points3) -> Floats:
    """Return the half-spaces (F, 4) of the convex hull of points (N, 3).

    A half-space is given by the outward normal and minus the distance from the origin. For coplanar
    points, there is one half-space that contains no point.
    """
    try:
        return np.asarray(ConvexHull(points_m).equations, np.float64)
    except (QhullError, ValueError):
        return np.array([[0.0, 0.0, 0.0, 1.0]])


def _are_inside(sides: Floats, points_m: Points3) -> Bools:
    """Return a mask (M,) of the points (M, 3) that are in all half-spaces (F, 4) of a hull."""
    return np.asarray((points_m @ sides[:, :3].T + sides[:, 3] <= 0.0).all(-1))


def distance_from_capsules_m(
    looks: Sequence[Points3], ends_world: Floats, radius_m: Floats
) -> float:
    """Return the largest distance of visual geoms from the nearest capsule [m].

    Args:
        looks: points (N, 3) on each visual geom [m].
        ends_world: (K, 2, 3) end points of the capsules' axes [m].
        radius_m: (K,) radii of the capsules [m].
    """
    if not looks:
        return 0.0
    return max(float(_outside_m(np.concatenate(looks), ends_world, radius_m).max()), 0.0)


def _outside_m(points_world: Points3, ends_world: Floats, radius_m: Floats) -> Floats:
    """Return the distance (N,) of points (N, 3) from the nearest of capsules (K, 2, 3) [m]."""
    if not len(ends_world):
        return np.full(len(points_world), np.inf)
    start, along = ends_world[:, 0], ends_world[:, 1] - ends_world[:, 0]
    squared = np.maximum((along**2).sum(-1), 1e-12)
    off = points_world[:, None] - start
    share = np.clip((off * along).sum(-1) / squared, 0.0, 1.0)
    away = np.linalg.norm(off - share[..., None] * along, axis=-1) - radius_m
    return np.asarray(away.min(1))


def distance_from_looks_m(capsule_points: Points3, looks: Sequence[Points3]) -> float:
    """Return the largest distance of a capsule's surface from the nearest visual geom [m].

    Args:
        capsule_points: (N, 3) points on the capsule's surface [m].
        looks: points (M, 3) on each visual geom [m].
    """
    points_world = np.concatenate([np.zeros((0, 3)), *looks])
    if not len(points_world):
        return np.inf
    if not len(capsule_points):
        return 0.0
    return float(KDTree(points_world).query(capsule_points)[0].max())


def _grid(length_m: float, spacing_m: float) -> int:
    """Return the number of points along a length (rounded up) for a given spacing."""
    return int(np.clip(np.ceil(length_m / spacing_m), 1, 60 * SPACING_M / spacing_m)) + 1


def _on_box(size: Floats, spacing_m: float) -> Points3:
    """Sample points (N, 3) on a box with half edge lengths `size` (3,) [m]."""
    axes = [np.linspace(-half, half, _grid(2 * half, spacing_m)) for half in size]
    faces: list[Points3] = []
    for k in range(3):
        flat = np.stack(np.meshgrid(*(axes[i] for i in range(3) if i != k)), -1).reshape(-1, 2)
        for side in (-size[k], size[k]):
            faces.append(np.insert(flat, k, side, axis=1))
    return np.concatenate(faces)


def _on_round(radius_m: float, half_m: float, cap: Floats, spacing_m: float) -> Points3:
    """Sample points (N, 3) on a tube about z and on its caps.

    Args:
        radius_m: radius of the tube [m].
        half_m: half length of the tube [m].
        cap: (n, 2) radius and height above the tube's end of the n rings of a cap [m].
        spacing_m: spacing of the points [m].
    """
    around = np.linspace(0, 2 * np.pi, _grid(2 * np.pi * radius_m, spacing_m), endpoint=False)
    tube = [(radius_m, z) for z in np.linspace(-half_m, half_m, _grid(2 * half_m, spacing_m))]
    rings = np.array(
        [*tube, *((r, half_m + h) for r, h in cap), *((r, -half_m - h) for r, h in cap)]
    )
    x, y = np.cos(around), np.sin(around)
    return np.concatenate([np.stack([r * x, r * y, np.full_like(x, z)], -1) for r, z in rings])


def _on_capsule(size: Floats, spacing_m: float) -> Points3:
    rise = np.linspace(0.0, np.pi / 2, _grid(np.pi / 2 * size[0], spacing_m))
    return _on_round(
        size[0], size[1], size[0] * np.stack([np.cos(rise), np.sin(rise)], -1), spacing_m
    )


def _on_cylinder(size: Floats, spacing_m: float) -> Points3:
    radii = np.linspace(0.0, size[0], _grid(size[0], spacing_m))
    return _on_round(size[0], size[1], np.stack([radii, 0 * radii], -1), spacing_m)


def _on_ellipsoid(size: Floats, spacing_m: float) -> Points3:
    return _on_capsule(np.array([1.0, 0.0, 0.0]), spacing_m / size.max()) * size


def _on_sphere(size: Floats, spacing_m: float) -> Points3:
    return _on_capsule(np.array([size[0], 0.0, 0.0]), spacing_m)


def _on_nothing(size: Floats, spacing_m: float) -> Points3:
    return np.zeros((0, 3))


_ON_SHAPES: dict[int, Callable[[Floats, float], Points3]] = {
    int(mujoco.mjtGeom.mjGEOM_BOX): _on_box,
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): _on_capsule,
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): _on_cylinder,
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): _on_ellipsoid,
    int(mujoco.mjtGeom.mjGEOM_SPHERE): _on_sphere,
}


def _on_mesh(model: mujoco.MjModel, mesh: int, spacing_m: float) -> Points3:
    """Sample points (N, 3) on a mesh [m]: vertices and, by area, random points on its triangles."""
    corners = _triangles(model, mesh)
    n = len(corners)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=-1) / 2
    rng = np.random.default_rng(0)
    most = MOST_POINTS * SPACING_M / spacing_m
    count = int(min(most, area.sum() / spacing_m**2 * 4 + 1))
    chosen = rng.choice(n, count, p=area / area.sum())
    u, v = rng.random((2, count, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = np.moveaxis(corners[chosen], 1, 0)
    return np.concatenate([a + u * (b - a) + v * (c - a), corners.reshape(-1, 3)[::3]])


def _triangles(model: mujoco.MjModel, mesh: int) -> Floats:
    """Return the vertices (T, 3, 3) of the triangles of a mesh [m]."""
    first, n = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    faces = model.mesh_vertadr[mesh] + model.mesh_face[first : first + n]
    return np.asarray(model.mesh_vert[faces], np.float64)
