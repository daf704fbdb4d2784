"""Functions that add workers to a MuJoCo model as mocap bodies with capsules.

A worker is moved kinematically: 22 mocap bodies take positions and rotations from `WorkerMotion`.
Contacts are computed with the capsules, which are not rendered; cameras see the visual meshes of
`worker_visuals`.
"""

from functools import lru_cache

import mujoco
import numpy as np

from hrc_env.core.typing import Floats, Ints
from hrc_env.scene.primitives import WORKER_BIT, WORKER_CAPSULES, add_capsule
from hrc_env.worker.body import SEGMENTS, Body, load_body

CAPSULE_FIELDS = ("geom_pos", "geom_quat", "geom_size", "geom_rbound", "geom_aabb")
"""Fields of MuJoCo's model that differ between the capsules of different bodies."""


def add_worker(spec: mujoco.MjSpec, body: Body, prefix: str) -> None:
    """Add a worker in its rest pose to a specification, with a prefix to all of its names."""
    segments = {
        name: spec.worldbody.add_body(name=prefix + name, pos=position, mocap=True)
        for name, position in zip(SEGMENTS, body.rest_position, strict=True)
    }
    for row, name in enumerate(body.capsule_names):
        add_capsule(
            segments[SEGMENTS[body.capsule_segment[row]]],
            body.capsule_ends[row, 0],
            body.capsule_ends[row, 1],
            float(body.capsule_radius_m[row]),
            name=prefix + name,
            group=WORKER_CAPSULES,
            contype=WORKER_BIT,
            conaffinity=0,
            density=0,
        )


def mocap_ids(model: mujoco.MjModel, prefix: str) -> Ints:
    """Return the indices (22,) of a worker's segments in `data.mocap_pos` and `data.mocap_quat`."""
    return np.array([model.body(prefix + name).mocapid[0] for name in SEGMENTS], dtype=np.int64)


def capsule_geom_ids(model: mujoco.MjModel, body: Body, prefix: str) -> Ints:
    """Return the geom indices (K,) of a worker's capsules, in the order of `body.capsule_names`."""
    return np.array([model.geom(prefix + name).id for name in body.capsule_names], dtype=np.int64)


@lru_cache(maxsize=16)
def capsule_shapes(bodies: tuple[str, ...]) -> dict[str, Floats]:
    """Return the compiled capsules of N bodies as arrays (N, K, ...) by name of MuJoCo's field."""
    shapes: dict[str, list[Floats]] = {name: [] for name in CAPSULE_FIELDS}
    for name in bodies:
        spec = mujoco.MjSpec()
        add_worker(spec, load_body(name), "")
        model = spec.compile()
        geoms = capsule_geom_ids(model, load_body(name), "")
        for field, values in shapes.items():
            values.append(getattr(model, field)[geoms])
    return {field: np.stack(values) for field, values in shapes.items()}
