"""What workers look like in the drawing model: of each worker, every body that they can have.

All of a worker's bodies hang on the same 22 mocap bodies; those that are not worn are in a group
that nobody draws, and cost a picture nothing.
"""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from hrc_env.core.typing import Ints
from hrc_env.scene.primitives import DECORATION, LOOKS_ONLY, WORKER_CAPSULES
from hrc_env.worker.body import SEGMENTS, Body
from hrc_env.worker.mesh import HatMesh, SkinMesh, WorkerMesh

SKIN_SPECULAR, SKIN_SHININESS = 0.08, 0.15
HAT_SPECULAR, HAT_SHININESS = 0.45, 0.55
WORN, PUT_AWAY = DECORATION, WORKER_CAPSULES
"""Groups of skins and hats."""


@dataclass(frozen=True, slots=True)
class Wardrobe:
    """Where the looks of W workers' N bodies are in a model."""

    skins: Ints
    """(nskin, 2) whose each skin is, and of which body."""
    hats: Ints
    """(H, 3) whose each hat is, of which body, and its geom."""


def dress(spec: Any, body: Body, looks: WorkerMesh, prefix: str) -> None:
    """Add the skins and the hat of a body to a worker whom `add_worker` has added.

    Workers who have the same body share its textures.

    Args:
        spec: the model.
        body: measures.
        looks: surfaces and textures.
        prefix: what the names of this worker's bodies start with.
    """
    for skin in looks.skins:
        _add_skin(spec, skin, body, prefix)
    if looks.hat is not None:
        _add_hat(spec, looks.hat, body, prefix)


def wardrobe(model: mujoco.MjModel, prefixes: tuple[str, ...], bodies: tuple[str, ...]) -> Wardrobe:
    """The looks in a model of workers with these prefixes, each dressed in all these bodies."""
    pairs = [(w, n) for w in range(len(prefixes)) for n in range(len(bodies))]
    of = {(w, n): f"{prefixes[w]}{bodies[n]}_" for w, n in pairs}
    skins = np.zeros((model.nskin, 2), np.int64)
    for pair, start in of.items():
        for k in range(model.nskin):
            if model.skin(k).name.startswith(start):
                skins[k] = pair
    known = {model.geom(geom).name: geom for geom in range(model.ngeom)}
    hats = [(*pair, known[f"{start}hat"]) for pair, start in of.items() if f"{start}hat" in known]
    return Wardrobe(skins, np.array(hats, np.int64).reshape(-1, 3))


def wear(model: mujoco.MjModel, looks: Wardrobe, body: Ints | None) -> None:
    """Show each worker in one of their bodies.

    Args:
        model: a drawing model of the caller's own; groups of its skins and hats are changed.
        looks: of that model.
        body: (W,) which body each has; None: all have the first.
    """
    if not len(looks.skins):
        return
    worn = np.zeros(looks.skins[:, 0].max() + 1, np.int64) if body is None else body
    skins, hats = looks.skins, looks.hats
    model.skin_group[:] = np.where(worn[skins[:, 0]] == skins[:, 1], WORN, PUT_AWAY)
    model.geom_group[hats[:, 2]] = np.where(worn[hats[:, 0]] == hats[:, 1], WORN, PUT_AWAY)


def _add_skin(spec: Any, skin: SkinMesh, body: Body, prefix: str) -> None:
    material = f"{body.name}_{skin.name}"
    if spec.material(material) is None:
        _add_cloth(spec, skin, material)
    moved = np.flatnonzero(skin.weights.any(0))
    spec.add_skin(
        name=prefix + material,
        material=material,
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


def _add_cloth(spec: Any, skin: SkinMesh, name: str) -> None:
    """The material and the texture of a skin."""
    height, width = skin.texture.shape[:2]
    texture = spec.add_texture(
        name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=width, height=height, nchannel=3
    )
    texture.data = skin.texture.tobytes()
    material = spec.add_material(name=name, specular=SKIN_SPECULAR, shininess=SKIN_SHININESS)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name


def _add_hat(spec: Any, hat: HatMesh, body: Body, prefix: str) -> None:
    name = f"{body.name}_hat"
    if spec.mesh(name) is None:
        spec.add_mesh(
            name=name,
            uservert=hat.vertices.ravel(),
            userface=hat.faces.ravel(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
        spec.add_material(
            name=name, rgba=[*hat.rgb, 1], specular=HAT_SPECULAR, shininess=HAT_SHININESS
        )
    spec.body(prefix + "head").add_geom(
        name=prefix + name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        material=name,
        **LOOKS_ONLY,
    )
