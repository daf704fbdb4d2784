"""The worker's body: 22 segments, 15 joints, the capsules round them.

Numbers that `assets/workers/bake.py` wrote into `assets/workers/<name>.npz`. Rest frame: x forward,
y left, z up, origin on the floor below the pelvis; all segments are world-aligned at rest.
"""

import functools
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hrc_env.core.batching import flat
from hrc_env.core.errors import ConfigError, check_shape, unknown
from hrc_env.core.kernels import kernel
from hrc_env.core.records import WorkerMotion, WorkerPath, WorkerTruth
from hrc_env.core.typing import Capsules, Floats, Ints, Points3, QuaternionsWxyz
from hrc_env.geometry.rotations import rotate

TRUNK = ("pelvis", "abdomen", "torso", "chest", "neck", "head")
LIMBS = ("clavicle", "upper_arm", "forearm", "hand", "thigh", "shank", "foot", "toes")
SEGMENTS = (*TRUNK, *(f"{side}_{part}" for side in ("left", "right") for part in LIMBS))
N_SEGMENTS = len(SEGMENTS)
SEGMENT: dict[str, int] = {name: index for index, name in enumerate(SEGMENTS)}

PARENT: Ints = np.array(
    [-1, 0, 1, 2, 3, 4, 3, 6, 7, 8, 0, 10, 11, 12, 3, 14, 15, 16, 0, 18, 19, 20]
)
"""(22,) segment that each segment hangs on; -1 for the pelvis."""


@dataclass(frozen=True, slots=True)
class Body:
    """One worker's measures, all in metres; or those of N workers, with a first axis of N."""

    names: tuple[str, ...]
    stature_m: Any
    """(...,) barefoot, without the hat."""
    rest_position: Points3
    """(..., S, 3) origins of the segments at rest."""
    joint_segment: Ints
    """(J,) segment that carries each of the 15 joints."""
    joint_offset: Points3
    """(..., J, 3) the joint in that segment's frame, where BlazePose would place it."""
    capsule_names: tuple[str, ...]
    capsule_segment: Ints
    """(K,) segment that carries each capsule."""
    capsule_ends: Points3
    """(..., K, 2, 3) end points in that segment's frame."""
    capsule_radius_m: Floats
    """(..., K)."""


OWN = ("stature_m", "rest_position", "joint_offset", "capsule_ends", "capsule_radius_m")
"""What differs from body to body."""


def assets_dir() -> Path:
    """Return the folder of assets; in a checkout it is a link to `assets/` beside the package."""
    return Path(__file__).parents[1] / "assets"


def worker_names() -> tuple[str, ...]:
    """Names of the baked workers."""
    return tuple(sorted(path.stem for path in (assets_dir() / "workers").glob("*.npz")))


@functools.cache
def load_body(name: str = "worker_1") -> Body:
    """Read a baked worker's measures; `ConfigError` where no worker of that name was baked."""
    with np.load(baked_path(name)) as baked:
        return Body(
            names=(name,),
            capsule_names=tuple(map(str, baked["capsule_names"])),
            joint_segment=fixed(baked["joint_segment"], np.int64),
            capsule_segment=fixed(baked["capsule_segment"], np.int64),
            **{field: fixed(baked[field], np.float64) for field in OWN},
        )


@functools.cache
def stack(names: tuple[str, ...]) -> Body:
    """Read several baked workers."""
    if not names:
        raise ConfigError(f"Expected at least one worker of {', '.join(worker_names())}; got none.")
    bodies = [load_body(name) for name in names]
    own = {f: fixed(np.stack([getattr(body, f) for body in bodies]), np.float64) for f in OWN}
    return replace(bodies[0], names=names, **own)


ANY = "any"
"""Stands for all baked workers."""


def pool(worker: str | tuple[str, ...]) -> tuple[str, ...]:
    """The bodies that workers can have: of one name, of several, or all of them (`ANY`)."""
    if worker == ANY:
        return worker_names()
    names = (worker,) if isinstance(worker, str) else tuple(worker)
    valid = (*worker_names(), ANY)
    if not names or len(set(names)) < len(names):
        raise ConfigError(
            f"worker must be a name or several different ones of {', '.join(valid[:-1])}, "
            f"or {ANY!r} for all of them; got {worker!r}."
        )
    for name in names:
        if name not in worker_names():
            raise unknown("worker", name, valid)
    return names


def worker_truth(body: Body, motion: WorkerMotion) -> WorkerTruth:
    """Where the joints and capsules of bodies in motion are, and how fast the joints.

    `motion` has segments (..., S, 3 or 4); its `body` says rows of several bodies.
    """
    position, quaternion = motion.position_world, motion.quaternion_wxyz
    lead, n_joints = position.shape[:-2], len(body.joint_segment)
    rows = _rows(body, motion.body, lead)
    capsules = _capsules_of(body, position, quaternion, rows)
    segments = (position, quaternion, motion.velocity_world, motion.angular_velocity_world)
    offset = body.joint_offset.reshape(-1, n_joints, 3)
    joints, velocity = np.empty((2, *lead, n_joints, 3))
    out = flat(joints, 2), flat(velocity, 2)
    _joints(tuple(flat(each, 2) for each in segments), rows, body.joint_segment, offset, out)
    radius = body.capsule_radius_m.reshape(-1, len(body.capsule_names))[rows]
    return WorkerTruth(joints, velocity, capsules, radius.reshape(*lead, radius.shape[1]))


def worker_capsules(body: Body, path: WorkerPath, which: Ints | None = None) -> Capsules:
    """(B, T, W, K, 2, 3) the bodies' capsules along a path [m]; `which` (B, W) of several."""
    position = path.position_world
    over_time = None if which is None else np.asarray(which)[..., None, :]
    rows = _rows(body, over_time, position.shape[:-2])
    return _capsules_of(body, position, path.quaternion_wxyz, rows)


def _rows(body: Body, which: Ints | None, lead: tuple[int, ...]) -> Ints:
    """(count,) row of every body in motion."""
    rows, last = np.zeros(lead, np.int64), len(body.names) - 1
    if which is not None and last > 0:
        if which.size and not 0 <= which.min() <= which.max() <= last:
            raise ConfigError(f"Bodies must be rows 0 to {last} of {body.names}, got {which}.")
        rows[...] = which
    return rows.reshape(-1)


def _capsules_of(
    body: Body, position: Points3, quaternion: QuaternionsWxyz, rows: Ints
) -> Capsules:
    check_shape("position_world", position.shape[-2:], (N_SEGMENTS, 3), "segments, xyz")
    shape = (len(body.capsule_segment), 2, 3)
    ends = np.empty((len(rows), *shape))
    known = body.capsule_ends.reshape(-1, *shape)
    _capsules(flat(position, 2), flat(quaternion, 2), rows, body.capsule_segment, known, ends)
    return ends.reshape(*position.shape[:-2], *shape)


@kernel
def _joints(segments, rows, segment, offset, out):  # pragma: no cover - compiled
    """Joints, and how fast their segments carry them: v + omega x r (rigid body kinematics)."""
    position, quaternion, linear, angular = segments
    joints, velocity = out
    for b in range(position.shape[0]):
        mine = offset[rows[b]]
        for j in range(len(segment)):
            s = segment[j]
            arm = rotate(quaternion[b, s], mine[j])
            for i in range(3):
                k, m = (i + 1) % 3, (i + 2) % 3
                joints[b, j, i] = position[b, s, i] + arm[i]
                omega_k, omega_m = angular[b, s, k], angular[b, s, m]
                velocity[b, j, i] = linear[b, s, i] + omega_k * arm[m] - omega_m * arm[k]


@kernel
def _capsules(position, quaternion, rows, segment, ends, capsules):  # pragma: no cover - compiled
    """Both ends of the capsules of bodies."""
    for b in range(position.shape[0]):
        mine = ends[rows[b]]
        for k in range(len(segment)):
            s = segment[k]
            for end in range(2):
                arm = rotate(quaternion[b, s], mine[k, end])
                for i in range(3):
                    capsules[b, k, end, i] = position[b, s, i] + arm[i]


def baked_path(name: str) -> Path:
    """The file of a worker; `ConfigError` where none of that name was baked."""
    if name not in worker_names():
        raise unknown("worker", name, worker_names())
    return assets_dir() / "workers" / f"{name}.npz"


def fixed(array: np.ndarray, dtype: type) -> np.ndarray:
    """A read-only copy: bodies are shared, nobody may write into them."""
    copy = np.array(array, dtype=dtype)
    copy.setflags(write=False)
    return copy
