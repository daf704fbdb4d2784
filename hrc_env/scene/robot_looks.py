"""How far what is drawn of a robot and the capsules that stand for it are apart.

Cameras see a robot's looks; distances, contacts and shields take its capsules. Points all over both
surfaces are compared, in the pose in which every joint is at 0.
"""

import warnings
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import mujoco
import numpy as np
from scipy.spatial import ConvexHull, KDTree, QhullError

from hrc_env.core.typing import Bools, Floats, Points3
from hrc_env.scene.robot_chain import id_of, link_of, parsed

if TYPE_CHECKING:
    from hrc_env.scene.robot import Robot

BARE_M = 0.1
"""A capsule that reaches out of the looks by more than this is drawn [m]."""
INSIDE_M = 0.005
"""Points of a capsule that are deeper in another one are on no surface [m]."""
UNLIKE_M = 0.05
"""Looks and capsules that differ by more are worth a warning [m]."""
SPACING_M = 0.02
"""Distance of neighbouring points on a surface [m]."""
MOST_POINTS = 4000
"""Of one mesh at that spacing."""


class Mismatch(NamedTuple):
    """How far one capsule and the looks on the links around it are apart."""

    bare_m: float
    """How far the capsule reaches out of all looks at most [m]; infinite without any."""
    outside_m: float
    """How far looks of its link reach out of all capsules at most [m]."""


@lru_cache(maxsize=64)
def bare_capsules(robot: "Robot") -> frozenset[str]:
    """Return the capsules that reach out of all looks around them by more than `BARE_M`: these are
    drawn, so that cameras see what distances count. The fingers' and cups' own are not."""
    gripped = robot.hand or robot.suction
    spans = gripped.spans if gripped else ()
    return frozenset(
        name
        for name, each in compare_looks(robot).items()
        if name not in spans and each.bare_m > BARE_M
    )


def compare_looks(robot: "Robot", spacing_m: float = SPACING_M) -> dict[str, Mismatch]:
    """Return how far each capsule and what is drawn on its link and the next ones are apart, in the
    pose at rest; points on surfaces are `spacing_m` apart."""
    model = parsed(robot).compile()
    data, gripped = mujoco.MjData(model), robot.hand or robot.suction
    data.qpos[: len(robot.joints)] = robot.home_q
    mujoco.mj_kinematics(model, data)
    bodies = model.jnt_bodyid[[id_of(model, "joint", name) for name in robot.joints]].tolist()
    carrier = [link_of(model, bodies, body) for body in model.geom_bodyid]
    capsules = [id_of(model, "geom", name) for name in robot.capsules]
    pads = [id_of(model, "geom", name) for name in gripped.pads] if gripped else []
    looks = [geom for geom in range(model.ngeom) if geom not in (*capsules, *pads)]
    points = {geom: surface_of(model, data, geom, spacing_m) for geom in (*looks, *capsules)}
    along = data.geom_xmat[capsules].reshape(-1, 3, 3)[..., 2] * model.geom_size[capsules, 1:2]
    middle = data.geom_xpos[capsules]
    ends, radius_m = np.stack([middle - along, middle + along], 1), model.geom_size[capsules, 0]
    solids = [solid_of(model, data, geom) for geom in looks]
    found = {}
    for k, (name, geom) in enumerate(zip(robot.capsules, capsules, strict=True)):
        link, others = carrier[geom], np.arange(len(capsules)) != k
        hull = points[geom]
        hull = hull[_outside_m(hull, ends[others], radius_m[others]) > -INSIDE_M]
        near = [points[each] for each in looks if abs(carrier[each] - link) <= 1]
        own = [points[each] for each in looks if carrier[each] == link]
        hidden = np.any([solid.holds(hull) for solid in solids], axis=0)
        found[name] = Mismatch(
            bare_m(hull[~hidden] if solids else hull, near), outside_capsules_m(own, ends, radius_m)
        )
    return found


def warn_of_looks(robot: "Robot") -> None:
    """Warn where looks and capsules of a robot differ by more than `UNLIKE_M`."""
    drawn = bare_capsules(robot)
    for name, each in compare_looks(robot).items():
        if name not in drawn and each.bare_m > UNLIKE_M:
            warnings.warn(
                f"{robot.name}: capsule {name!r} reaches {100 * each.bare_m:.0f} cm out of what is "
                "drawn of the robot: cameras do not see what distances count. Draw it, or shorten "
                "the capsule.",
                stacklevel=4,
            )
        if each.outside_m > UNLIKE_M:
            warnings.warn(
                f"{robot.name}: what is drawn on the link of capsule {name!r} reaches "
                f"{100 * each.outside_m:.0f} cm out of all capsules: people may touch what shields "
                "do not know of. Add a capsule to that link.",
                stacklevel=4,
            )


def surface_of(
    model: mujoco.MjModel, data: mujoco.MjData, geom: int, spacing_m: float = SPACING_M
) -> Points3:
    """Return points (N, 3) all over the surface of a geom in the world [m]."""
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    if kind == int(mujoco.mjtGeom.mjGEOM_MESH):
        local = _on_mesh(model, int(model.geom_dataid[geom]), spacing_m)
    else:
        local = _ON_SHAPES.get(kind, _on_nothing)(size, spacing_m)
    return data.geom_xpos[geom] + local @ data.geom_xmat[geom].reshape(3, 3).T


class Solid(NamedTuple):
    """A geom, for asking what is in it."""

    kind: int
    size: Floats
    at_world: Points3
    turn_world: Floats
    around_m: float
    """No point of it is farther from its middle [m]."""
    sides: Floats
    """(F, 4) of a mesh's convex hull; of none for other kinds."""

    def holds(self, points_world: Points3) -> Bools:
        """Return which points (N, 3) are inside; of a mesh, inside of its convex hull."""
        off = points_world - self.at_world
        near = np.linalg.norm(off, axis=-1) < self.around_m
        near[near] = self._holds(off[near] @ self.turn_world)
        return near

    def _holds(self, local: Points3) -> Bools:
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
        found = {int(kind): test for kind, test in inside.items()}.get(self.kind)
        return np.zeros(len(local), np.bool_) if found is None else np.asarray(found())


def solid_of(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Solid:
    """Return a geom in its pose in the world."""
    kind, sides = int(model.geom_type[geom]), np.zeros((0, 4))
    if kind == int(mujoco.mjtGeom.mjGEOM_MESH):
        corners = _triangles(model, int(model.geom_dataid[geom]))
        sides = _sides_of_hull(corners.reshape(-1, 3))
    turn = data.geom_xmat[geom].reshape(3, 3).copy()
    at, around_m = data.geom_xpos[geom].copy(), float(model.geom_rbound[geom])
    return Solid(kind, model.geom_size[geom].copy(), at, turn, around_m, sides)


def _sides_of_hull(points_m: Points3) -> Floats:
    """Return the sides (F, 4) of the convex hull of points (N, 3): normals outwards, and less their
    distance from the origin; of points in a plane, a side that leaves nothing inside."""
    try:
        return np.asarray(ConvexHull(points_m).equations, np.float64)
    except (QhullError, ValueError):
        return np.array([[0.0, 0.0, 0.0, 1.0]])


def _are_inside(sides: Floats, points_m: Points3) -> Bools:
    """Return which of some points (M, 3) are behind all sides (F, 4) of a hull."""
    return np.asarray((points_m @ sides[:, :3].T + sides[:, 3] <= 0.0).all(-1))


def outside_capsules_m(looks: Sequence[Points3], ends_world: Floats, radius_m: Floats) -> float:
    """Return how far points (N, 3) of looks are outside of all capsules (K, 2, 3) at most [m]."""
    if not looks:
        return 0.0
    return max(float(_outside_m(np.concatenate(looks), ends_world, radius_m).max()), 0.0)


def _outside_m(points_world: Points3, ends_world: Floats, radius_m: Floats) -> Floats:
    """Return how far points (N, 3) are out of the nearest of capsules (K, 2, 3) [m]."""
    if not len(ends_world):
        return np.full(len(points_world), np.inf)
    start, along = ends_world[:, 0], ends_world[:, 1] - ends_world[:, 0]
    squared = np.maximum((along**2).sum(-1), 1e-12)
    off = points_world[:, None] - start
    share = np.clip((off * along).sum(-1) / squared, 0.0, 1.0)
    away = np.linalg.norm(off - share[..., None] * along, axis=-1) - radius_m
    return np.asarray(away.min(1))


def bare_m(capsule_points: Points3, looks: Sequence[Points3]) -> float:
    """Return how far a capsule's surface (N, 3) is from the nearest point of looks (M, 3) [m]."""
    points_world = np.concatenate([np.zeros((0, 3)), *looks])
    if not len(points_world):
        return np.inf
    if not len(capsule_points):
        return 0.0
    return float(KDTree(points_world).query(capsule_points)[0].max())


def _grid(length_m: float, spacing_m: float) -> int:
    return int(np.clip(np.ceil(length_m / spacing_m), 1, 60 * SPACING_M / spacing_m)) + 1


def _on_box(size: Floats, spacing_m: float) -> Points3:
    axes = [np.linspace(-half, half, _grid(2 * half, spacing_m)) for half in size]
    faces = []
    for k in range(3):
        flat = np.stack(np.meshgrid(*(axes[i] for i in range(3) if i != k)), -1).reshape(-1, 2)
        for side in (-size[k], size[k]):
            faces.append(np.insert(flat, k, side, axis=1))
    return np.concatenate(faces)


def _on_round(radius_m: float, half_m: float, cap: Floats, spacing_m: float) -> Points3:
    """Return points on a tube about z and on its ends; `cap` (n, 2): radius and height of rings."""
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


_ON_SHAPES: dict[int, Any] = {
    int(mujoco.mjtGeom.mjGEOM_BOX): _on_box,
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): _on_capsule,
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): _on_cylinder,
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): _on_ellipsoid,
    int(mujoco.mjtGeom.mjGEOM_SPHERE): _on_sphere,
}


def _on_mesh(model: mujoco.MjModel, mesh: int, spacing_m: float) -> Points3:
    """Return points on a mesh: corners of its triangles, and more where these are large."""
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
    """Return the corners (T, 3, 3) of a mesh [m]."""
    first, n = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    faces = model.mesh_vertadr[mesh] + model.mesh_face[first : first + n]
    return np.asarray(model.mesh_vert[faces], np.float64)
