"""Body of a worker, with 22 segments, 15 joints and the capsules around them.

The data are read from `assets/workers/<name>.npz`, written by `assets/workers/bake.py`. In the rest
frame x is forward, y left, z up, with the origin on the floor below the pelvis; at rest all
segments are aligned with it.
"""

import functools
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hrc_env.core.batching import flatten_axes
from hrc_env.core.errors import ConfigError, check_shape, make_unknown_name_error
from hrc_env.core.kernels import kernel
from hrc_env.core.records import WorkerMotion, WorkerPath, WorkerTruth
from hrc_env.core.typing import Capsules, Floats, Ints, Points3, QuaternionsWxyz, Velocities3
from hrc_env.geometry.rotations import rotate

TRUNK = ("pelvis", "abdomen", "torso", "chest", "neck", "head")
LIMBS = ("clavicle", "upper_arm", "forearm", "hand", "thigh", "shank", "foot", "toes")
SEGMENTS = (*TRUNK, *(f"{side}_{part}" for side in ("left", "right") for part in LIMBS))
N_SEGMENTS = len(SEGMENTS)
SEGMENT: dict[str, int] = {name: index for index, name in enumerate(SEGMENTS)}
"""Row of each segment, by name."""

PARENT: Ints = np.array(
    [-1, 0, 1, 2, 3, 4, 3, 6, 7, 8, 0, 10, 11, 12, 3, 14, 15, 16, 0, 18, 19, 20]
)
"""Parent (22,) of each segment; -1 for the pelvis."""


@dataclass(frozen=True, slots=True)
class Body:
    """Measurements of one worker, or of N workers along a leading axis."""

    names: tuple[str, ...]
    """Names of the workers."""
    stature_m: Floats
    """Stature (...,) without shoes and hat [m]."""
    rest_position: Points3
    """Origins (..., S, 3) of the segments at rest [m]."""
    joint_segment: Ints
    """Index (J,) of the segment to which each of the 15 joints is fixed."""
    joint_offset: Points3
    """Position (..., J, 3) of each BlazePose joint in the frame of its segment [m]."""
    capsule_names: tuple[str, ...]
    """Names of the capsules."""
    capsule_segment: Ints
    """Index (K,) of the segment to which each capsule is fixed."""
    capsule_ends: Points3
    """End points (..., K, 2, 3) of each capsule in the frame of its segment [m]."""
    capsule_radius_m: Floats
    """Radius (..., K) of each capsule [m]."""


MEASURED = ("stature_m", "rest_position", "joint_offset", "capsule_ends", "capsule_radius_m")
"""Fields of `Body` with values that depend on the worker."""


def assets_dir() -> Path:
    """Return the path of the assets folder, which is a link to `assets/` in a checkout."""
    return Path(__file__).parents[1] / "assets"


def worker_names() -> tuple[str, ...]:
    """Return the names of the worker models in the assets."""
    return tuple(sorted(path.stem for path in (assets_dir() / "workers").glob("*.npz")))


@functools.cache
def load_body(name: str = "worker_1") -> Body:
    """Read the measurements of a worker model; raise `ConfigError` if the name is unknown."""
    with np.load(find_baked(name)) as baked:
        return Body(
            names=(name,),
            capsule_names=tuple(map(str, baked["capsule_names"])),
            joint_segment=freeze(baked["joint_segment"], np.int64),
            capsule_segment=freeze(baked["capsule_segment"], np.int64),
            **{field: freeze(baked[field], np.float64) for field in MEASURED},
        )


@functools.cache
def load_bodies(names: tuple[str, ...]) -> Body:
    """Read the measurements of several worker models, stacked along a leading axis."""
    if not names:
        raise ConfigError(f"Expected at least one worker of {', '.join(worker_names())}; got none.")
    bodies = [load_body(name) for name in names]
    measures = {
        f: freeze(np.stack([getattr(body, f) for body in bodies]), np.float64) for f in MEASURED
    }
    return replace(bodies[0], names=names, **measures)


ANY = "any"
"""Name that selects all worker models."""


def select_bodies(worker: str | tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of the worker models in a selection; `ANY` selects all of them."""
    if worker == ANY:
        return worker_names()
    names = (worker,) if isinstance(worker, str) else tuple(worker)
    valid = (*worker_names(), ANY)
    if not names or len(set(names)) < len(names):
        raise ConfigError(
            f"worker must be one or several different names of {', '.join(valid[:-1])}, or {ANY!r} "
            f"for all of them; got {worker!r}."
        )
    for name in names:
        if name not in worker_names():
            raise make_unknown_name_error("worker", name, valid)
    return names


def worker_truth(body: Body, motion: WorkerMotion) -> WorkerTruth:
    """Return the joints, joint velocities and capsules of moving bodies.

    Args:
        body: measurements of one body or of several bodies.
        motion: poses and velocities (..., S, 3 or 4) of the segments; with several bodies,
            `motion.body` contains the row of each worker's body.
    """
    position, quaternion = motion.position_world, motion.quaternion_wxyz
    lead, n_joints = position.shape[:-2], len(body.joint_segment)
    rows = _find_rows(body, motion.body, lead)
    capsules = _place_capsules(body, position, quaternion, rows)
    segments = _Segments(
        flatten_axes(position, 2),
        flatten_axes(quaternion, 2),
        flatten_axes(motion.velocity_world, 2),
        flatten_axes(motion.angular_velocity_world, 2),
    )
    offset = body.joint_offset.reshape(-1, n_joints, 3)
    joints, velocity = np.empty((2, *lead, n_joints, 3))
    written = _Joints(flatten_axes(joints, 2), flatten_axes(velocity, 2))
    _write_joints(segments, rows, body.joint_segment, offset, written)
    radius = body.capsule_radius_m.reshape(-1, len(body.capsule_names))[rows]
    return WorkerTruth(joints, velocity, capsules, radius.reshape(*lead, radius.shape[1]))


def worker_capsules(body: Body, path: WorkerPath, which: Ints | None = None) -> Capsules:
    """Return the capsules (B, T, W, K, 2, 3) of bodies along a path [m].

    Args:
        body: measurements of one body or of several bodies.
        path: path of the segments, arrays (B, T, W, S, ...).
        which: row (B, W) of each worker's body; required if `body` holds several bodies.
    """
    position = path.position_world
    over_time = None if which is None else np.asarray(which)[..., None, :]
    rows = _find_rows(body, over_time, position.shape[:-2])
    return _place_capsules(body, position, path.quaternion_wxyz, rows)


def _find_rows(body: Body, which: Ints | None, lead: tuple[int, ...]) -> Ints:
    """Return the row (count,) of each moving body in the pool of bodies."""
    rows, last = np.zeros(lead, np.int64), len(body.names) - 1
    if which is not None and last > 0:
        if which.size and not 0 <= which.min() <= which.max() <= last:
            raise ConfigError(f"Bodies must be rows 0 to {last} of {body.names}, got {which}.")
        rows[...] = which
    return rows.reshape(-1)


def _place_capsules(
    body: Body, position: Points3, quaternion: QuaternionsWxyz, rows: Ints
) -> Capsules:
    """Return the capsules (..., K, 2, 3) of bodies.

    Args:
        body: measurements of one body or of several bodies.
        position: origins (..., S, 3) of the segments [m].
        quaternion: orientations (..., S, 4) of the segments.
        rows: row (count,) of each moving body in the pool of bodies.
    """
    check_shape("position_world", position.shape[-2:], (N_SEGMENTS, 3), "segments, xyz")
    shape = (len(body.capsule_segment), 2, 3)
    ends = np.empty((len(rows), *shape))
    known = body.capsule_ends.reshape(-1, *shape)
    _write_capsules(
        flatten_axes(position, 2),
        flatten_axes(quaternion, 2),
        rows,
        body.capsule_segment,
        known,
        ends,
    )
    return ends.reshape(*position.shape[:-2], *shape)


class _Segments(NamedTuple):
    """Poses and velocities of the segments of N moving bodies, in the world frame."""

    position: Points3
    """Origins (N, S, 3) [m]."""
    quaternion: QuaternionsWxyz
    """Orientations (N, S, 4), scalar first."""
    velocity: Velocities3
    """Velocities (N, S, 3) of the origins [m/s]."""
    angular_velocity: Floats
    """Angular velocities (N, S, 3) [rad/s]."""


class _Joints(NamedTuple):
    """Joints of N moving bodies, in the world frame."""

    position: Points3
    """Positions (N, J, 3) [m]."""
    velocity: Velocities3
    """Velocities (N, J, 3) [m/s]."""


@kernel
def _write_joints(
    segments: _Segments, rows: Ints, joint_segment: Ints, joint_offset: Floats, joints: _Joints
) -> None:  # pragma: no cover - compiled
    """Compute the positions of joints, and their velocities v + omega x r.

    Args:
        segments: segments of N bodies.
        rows: row (N,) of each body in the pool.
        joint_segment: segment (J,) of each joint.
        joint_offset: positions (P, J, 3) of the joints of each body in their segments' frames [m].
        joints: positions and velocities of the joints, which are written.
    """
    for b in range(segments.position.shape[0]):
        offsets = joint_offset[rows[b]]
        for j in range(len(joint_segment)):
            s = joint_segment[j]
            arm = rotate(segments.quaternion[b, s], offsets[j])
            for i in range(3):
                k, m = (i + 1) % 3, (i + 2) % 3
                joints.position[b, j, i] = segments.position[b, s, i] + arm[i]
                omega_k = segments.angular_velocity[b, s, k]
                omega_m = segments.angular_velocity[b, s, m]
                velocity = segments.velocity[b, s, i] + omega_k * arm[m] - omega_m * arm[k]
                joints.velocity[b, j, i] = velocity


@kernel
def _write_capsules(
    position: Floats,
    quaternion: Floats,
    rows: Ints,
    capsule_segment: Ints,
    capsule_ends: Floats,
    capsules: Floats,
) -> None:  # pragma: no cover - compiled
    """Compute the end points of the capsules of bodies.

    Args:
        position: origins (N, S, 3) of the segments [m].
        quaternion: orientations (N, S, 4) of the segments.
        rows: row (N,) of each body in the pool.
        capsule_segment: segment (K,) of each capsule.
        capsule_ends: ends (P, K, 2, 3) of the capsules of each body in their segments' frames [m].
        capsules: ends (N, K, 2, 3) in the world, which are written [m].
    """
    for b in range(position.shape[0]):
        ends = capsule_ends[rows[b]]
        for k in range(len(capsule_segment)):
            s = capsule_segment[k]
            for end in range(2):
                arm = rotate(quaternion[b, s], ends[k, end])
                for i in range(3):
                    capsules[b, k, end, i] = position[b, s, i] + arm[i]


def find_baked(name: str) -> Path:
    """Return the path of a worker model's file; raise `ConfigError` if the name is unknown."""
    if name not in worker_names():
        raise make_unknown_name_error("worker", name, worker_names())
    return assets_dir() / "workers" / f"{name}.npz"


def freeze(array: np.ndarray, dtype: type) -> np.ndarray:
    """Return a read-only copy of an array, which can be shared between callers."""
    copy = np.array(array, dtype=dtype)
    copy.setflags(write=False)
    return copy
