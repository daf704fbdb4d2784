"""Put a baked worker into a MuJoCo model: mocap bodies, two skins, a hard hat, capsules.

The worker is moved, not simulated: 22 mocap bodies take positions and rotations straight
from `WorkerMotion`. Skins have no geoms, so what touches the worker are capsules that no
camera draws and that meet only geoms whose conaffinity has the workers' bit.
"""

from typing import Any

import mujoco
import numpy as np

from hrc_env.body import SEGMENTS, Body
from hrc_env.errors import ConfigError
from hrc_env.looks import HatLooks, Looks, SkinLooks
from hrc_env.scene.primitives import LOOKS_ONLY, WORKER_BIT, WORKER_CAPSULES, capsule
from hrc_env.typing import Ints

SKIN_SPECULAR, SKIN_SHININESS = 0.08, 0.15
HAT_SPECULAR, HAT_SHININESS = 0.45, 0.55


def add_worker(spec: Any, body: Body, looks: Looks, prefix: str) -> None:
    """Add a worker in its rest pose to a model that is being built.

    Args:
        spec: the model.
        body: measures.
        looks: surfaces and textures.
        prefix: what every name of this worker starts with, for example "worker_1/".

    Raises:
        ConfigError: the model already has a worker of this prefix.
    """
    if spec.body(prefix + SEGMENTS[0]) is not None:
        raise ConfigError(f"The model already has a worker {prefix!r}; expected a new prefix.")
    segments = {
        name: spec.worldbody.add_body(name=prefix + name, pos=position, mocap=True)
        for name, position in zip(SEGMENTS, body.rest_position, strict=True)
    }
    for skin in looks.skins:
        _add_skin(spec, skin, body, prefix)
    if looks.hat is not None:
        _add_hat(spec, segments["head"], looks.hat, prefix)
    for row, name in enumerate(body.capsule_names):
        capsule(
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


def mocap_ids(model: Any, prefix: str) -> Ints:
    """(22,) rows of `data.mocap_pos` and `data.mocap_quat` that move a worker's segments.

    `data.mocap_pos[ids] = motion.position_world` and
    `data.mocap_quat[ids] = motion.quaternion_wxyz` pose the worker.

    Raises:
        ConfigError: the model has no worker of this prefix.
    """
    bodies = [
        mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, prefix + name) for name in SEGMENTS
    ]
    if min(bodies) < 0:
        raise ConfigError(f"The model has no worker {prefix!r}: it was not added with add_worker.")
    return np.array([model.body_mocapid[row] for row in bodies], dtype=np.int64)


def capsule_geom_ids(model: Any, body: Body, prefix: str) -> Ints:
    """(K,) geoms of a worker's capsules, in the order of `body.capsule_names`."""
    return np.array([model.geom(prefix + name).id for name in body.capsule_names], dtype=np.int64)


def _add_skin(spec: Any, skin: SkinLooks, body: Body, prefix: str) -> None:
    name = prefix + skin.name
    height, width = skin.texture.shape[:2]
    texture = spec.add_texture(
        name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=width, height=height, nchannel=3
    )
    texture.data = skin.texture.tobytes()
    material = spec.add_material(name=name, specular=SKIN_SPECULAR, shininess=SKIN_SHININESS)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
    moved = np.flatnonzero(skin.weights.any(0))
    spec.add_skin(
        name=name,
        material=name,
        rgba=[1, 1, 1, 1],
        vert=skin.vertices.astype(np.float32).ravel(),
        face=skin.faces.astype(np.int32).ravel(),
        texcoord=skin.uv.astype(np.float32).ravel(),
        bodyname=[prefix + SEGMENTS[segment] for segment in moved],
        bindpos=body.rest_position[moved].astype(np.float32).ravel(),
        bindquat=np.tile(np.array([1, 0, 0, 0], np.float32), len(moved)),
        vertid=[np.flatnonzero(skin.weights[:, s]).astype(np.int32) for s in moved],
        vertweight=[skin.weights[skin.weights[:, s] > 0, s].astype(np.float32) for s in moved],
    )


def _add_hat(spec: Any, head: Any, hat: HatLooks, prefix: str) -> None:
    name = prefix + "hat"
    spec.add_mesh(
        name=name,
        uservert=hat.vertices.ravel(),
        userface=hat.faces.ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    spec.add_material(name=name, rgba=[*hat.rgb, 1], specular=HAT_SPECULAR, shininess=HAT_SHININESS)
    head.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        material=name,
        **LOOKS_ONLY,
    )
