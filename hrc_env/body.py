"""The worker's body: 22 segments, 15 joints, the capsules round them, and how it looks.

A body is numbers that `assets/workers/bake.py` wrote once into `assets/workers/<name>.npz`;
the README beside them says where they come from. Rest frame: x forward, y left, z up, soles
at z = 0, origin on the floor below the pelvis. All segment frames are world-aligned at rest,
so that a pose is 22 positions and rotations and nothing else.
"""

import functools
import math
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray

from hrc_env.compiled import LEAN
from hrc_env.errors import check_shape, unknown
from hrc_env.records import WorkerMotion, WorkerPath, WorkerTruth
from hrc_env.typing import Capsules, Floats, Ints, Points3, QuaternionsWxyz

TRUNK = ("pelvis", "abdomen", "torso", "chest", "neck", "head")
LIMBS = ("clavicle", "upper_arm", "forearm", "hand", "thigh", "shank", "foot", "toes")
SEGMENTS: tuple[str, ...] = (
    *TRUNK,
    *(f"left_{part}" for part in LIMBS),
    *(f"right_{part}" for part in LIMBS),
)
N_SEGMENTS = len(SEGMENTS)
SEGMENT: dict[str, int] = {name: index for index, name in enumerate(SEGMENTS)}

PARENT: Ints = np.array(
    [-1, 0, 1, 2, 3, 4, 3, 6, 7, 8, 0, 10, 11, 12, 3, 14, 15, 16, 0, 18, 19, 20]
)
"""(22,) segment that each segment hangs on; -1 for the pelvis."""


@dataclass(frozen=True, slots=True)
class Body:
    """One worker's measures, all in metres."""

    name: str
    stature_m: float
    """Barefoot, without the hat."""
    rest_position: Points3
    """(S, 3) origins of the segments at rest."""
    joint_segment: Ints
    """(J,) segment that carries each of the 15 joints."""
    joint_offset: Points3
    """(J, 3) the joint in that segment's frame, where BlazePose would place it."""
    capsule_names: tuple[str, ...]
    capsule_segment: Ints
    """(K,) segment that carries each capsule."""
    capsule_ends: Points3
    """(K, 2, 3) end points in that segment's frame."""
    capsule_radius_m: Floats
    """(K,)."""


@dataclass(frozen=True, slots=True)
class SkinLooks:
    """A textured surface that follows the segments (linear blend skinning)."""

    name: str
    vertices: Points3
    """(V, 3) at rest [m]."""
    faces: Ints
    """(F, 3) counter-clockwise seen from outside."""
    uv: Floats
    """(V, 2) texture coordinates in [0, 1], v = 0 at the texture's first row."""
    weights: Floats
    """(V, S) share of each segment; at most four a vertex, rows sum to 1."""
    texture: NDArray[np.uint8]
    """(H, W, 3) RGB."""


@dataclass(frozen=True, slots=True)
class HatLooks:
    """A hard hat; it moves with the head."""

    vertices: Points3
    """(V, 3) in the head's frame [m]."""
    faces: Ints
    """(F, 3)."""
    rgb: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Looks:
    """What a worker looks like; the room `scene` draws it."""

    skins: tuple[SkinLooks, ...]
    hat: HatLooks | None
    """None for who wears none."""


def assets_dir() -> Path:
    """The folder of assets: `hrc_env/assets` when installed, `../assets` in a checkout."""
    installed = Path(__file__).parent / "assets"
    return installed if installed.is_dir() else Path(__file__).parents[1] / "assets"


def worker_names() -> tuple[str, ...]:
    """Names of the baked workers."""
    return tuple(sorted(path.stem for path in (assets_dir() / "workers").glob("*.npz")))


@functools.cache
def load_body(name: str = "worker_1") -> Body:
    """Read a baked worker's measures.

    Raises:
        ConfigError: no worker of that name has been baked.
    """
    with np.load(_path(name)) as baked:
        return Body(
            name=name,
            stature_m=float(baked["stature_m"]),
            rest_position=_fixed(baked["rest_position"], np.float64),
            joint_segment=_fixed(baked["joint_segment"], np.int64),
            joint_offset=_fixed(baked["joint_offset"], np.float64),
            capsule_names=tuple(str(capsule) for capsule in baked["capsule_names"]),
            capsule_segment=_fixed(baked["capsule_segment"], np.int64),
            capsule_ends=_fixed(baked["capsule_ends"], np.float64),
            capsule_radius_m=_fixed(baked["capsule_radius_m"], np.float64),
        )


@functools.cache
def load_looks(name: str = "worker_1") -> Looks:
    """Read a baked worker's surfaces and textures.

    Raises:
        ConfigError: no worker of that name has been baked.
    """
    with np.load(_path(name)) as baked:
        return Looks(tuple(_skin(baked, skin) for skin in ("skin", "cloth")), _hat(baked))


def rest_motion(body: Body) -> WorkerMotion:
    """The body at rest and still, without leading axes: (S, ...)."""
    upright = np.zeros((N_SEGMENTS, 4))
    upright[:, 0] = 1.0
    still = np.zeros((N_SEGMENTS, 3))
    return WorkerMotion(body.rest_position.copy(), upright, still, still.copy())


def worker_truth(body: Body, motion: WorkerMotion) -> WorkerTruth:
    """Where the joints and capsules of a body in motion are, and how fast the joints.

    Args:
        body: the worker's measures.
        motion: segments (..., S, 3 or 4) with any leading axes.

    Returns:
        The truth with the same leading axes. A joint moves with its segment:
        v + omega x r (rigid body kinematics).
    """
    position, quaternion = motion.position_world, motion.quaternion_wxyz
    capsules = _capsules_of(body, position, quaternion)
    lead, n_joints = position.shape[:-2], len(body.joint_segment)
    joints, velocity = np.empty((*lead, n_joints, 3)), np.empty((*lead, n_joints, 3))
    _joints(
        _flat(position), _flat(quaternion),
        _flat(motion.velocity_world), _flat(motion.angular_velocity_world),
        body.joint_segment, body.joint_offset, _flat(joints), _flat(velocity),
    )  # fmt: skip
    return WorkerTruth(joints, velocity, capsules, body.capsule_radius_m)


def worker_capsules(body: Body, path: WorkerPath) -> Capsules:
    """(B, T, W, K, 2, 3) the body's capsules along a path [m]."""
    return _capsules_of(body, path.position_world, path.quaternion_wxyz)


def _capsules_of(body: Body, position: Points3, quaternion: QuaternionsWxyz) -> Capsules:
    """Capsules (..., K, 2, 3) of bodies with any leading axes."""
    check_shape("position_world", position.shape[-2:], (N_SEGMENTS, 3), "segments, xyz")
    flat, shape = _flat(position), body.capsule_ends.shape
    ends = np.empty((len(flat), *shape))
    _capsules(flat, _flat(quaternion), body.capsule_segment, body.capsule_ends, ends)
    return ends.reshape(*position.shape[:-2], *shape)


def _flat(array: Floats) -> Floats:
    """(..., n, m) as (count, n, m), contiguous."""
    whole = np.ascontiguousarray(array)
    return whole.reshape(math.prod(whole.shape[:-2]), *whole.shape[-2:])


@numba.njit(**LEAN)
def _turned(quaternion, offset):  # pragma: no cover - compiled
    """An offset turned by a unit quaternion: v + 2 w (u x v) + 2 u x (u x v)."""
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    a = 2.0 * (y * offset[2] - z * offset[1])
    b = 2.0 * (z * offset[0] - x * offset[2])
    c = 2.0 * (x * offset[1] - y * offset[0])
    return (
        offset[0] + w * a + y * c - z * b,
        offset[1] + w * b + z * a - x * c,
        offset[2] + w * c + x * b - y * a,
    )


@numba.njit(**LEAN)
def _joints(
    position, quaternion, linear, angular, segment, offset, joints, velocity
):  # pragma: no cover - compiled
    """Joints, and how fast the segments carry them, one body after the other."""
    for b in range(position.shape[0]):
        for j in range(len(segment)):
            s = segment[j]
            arm = _turned(quaternion[b, s], offset[j])
            for i in range(3):
                k, m = (i + 1) % 3, (i + 2) % 3
                joints[b, j, i] = position[b, s, i] + arm[i]
                omega_k, omega_m = angular[b, s, k], angular[b, s, m]
                velocity[b, j, i] = linear[b, s, i] + omega_k * arm[m] - omega_m * arm[k]


@numba.njit(**LEAN)
def _capsules(position, quaternion, segment, ends, capsules):  # pragma: no cover - compiled
    """Both ends of the capsules of bodies."""
    for b in range(position.shape[0]):
        for k in range(len(segment)):
            s = segment[k]
            for end in range(2):
                arm = _turned(quaternion[b, s], ends[k, end])
                for i in range(3):
                    capsules[b, k, end, i] = position[b, s, i] + arm[i]


def _path(name: str) -> Path:
    if name not in worker_names():
        raise unknown("worker", name, worker_names())
    return assets_dir() / "workers" / f"{name}.npz"


def _fixed(array: np.ndarray, dtype: type) -> np.ndarray:
    """A read-only copy: bodies are shared, nobody may write into them."""
    copy = np.array(array, dtype=dtype)
    copy.setflags(write=False)
    return copy


def _skin(baked: np.lib.npyio.NpzFile, name: str) -> SkinLooks:
    segment, share = baked[f"{name}_weight_segment"], baked[f"{name}_weight"].astype(float)
    weights = np.zeros((len(segment), N_SEGMENTS))
    np.add.at(weights, (np.arange(len(segment))[:, None], segment), share)
    return SkinLooks(
        name=name,
        vertices=_fixed(baked[f"{name}_vertices"] * float(baked["unit_m"]), np.float64),
        faces=_fixed(baked[f"{name}_faces"], np.int64),
        uv=_fixed(baked[f"{name}_uv"] / 65535.0, np.float64),
        weights=_fixed(weights / weights.sum(1, keepdims=True), np.float64),
        texture=_texture(baked, name),
    )


def _hat(baked: np.lib.npyio.NpzFile) -> HatLooks | None:
    if "hat_vertices" not in baked:
        return None
    red, green, blue = (float(value) / 255 for value in baked["hat_rgb"])
    return HatLooks(
        vertices=_fixed(baked["hat_vertices"] * float(baked["unit_m"]), np.float64),
        faces=_fixed(baked["hat_faces"], np.int64),
        rgb=(red, green, blue),
    )


def _texture(baked: np.lib.npyio.NpzFile, name: str) -> NDArray[np.uint8]:
    """Palette colours, darkened by the coarse shade map (creases, folds)."""
    colours = baked[f"{name}_palette"][baked[f"{name}_paint"]].astype(np.float32)
    shade = _enlarged(baked[f"{name}_shade"].astype(np.float32) / 200.0, colours.shape[:2])
    return _fixed(np.clip(colours * shade[..., None], 0.0, 255.0), np.uint8)


def _enlarged(image: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """(h, w) to a larger (H, W), bilinear, pixel centres at half-integers."""
    for axis in (0, 1):
        size, old = shape[axis], image.shape[axis]
        at = np.clip((np.arange(size) + 0.5) * old / size - 0.5, 0, old - 1)
        low = np.minimum(at.astype(int), old - 2)
        part = (at - low).astype(np.float32).reshape((-1, 1) if axis == 0 else (1, -1))
        image = image.take(low, axis) * (1 - part) + image.take(low + 1, axis) * part
    return image
