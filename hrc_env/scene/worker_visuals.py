"""Skins, hats and props of workers in the drawing model; the physics contains only capsules.

All visual bodies of a worker are attached to the same 22 mocap bodies, which are followed by a
mocap body for each prop. Bodies and props that are not in use are in a group that is not rendered.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from hrc_env.core.records import Held, WorkerMotion
from hrc_env.core.typing import Ints
from hrc_env.scene.primitives import DECORATION, LOOKS_ONLY, WORKER_CAPSULES
from hrc_env.scene.worker import mocap_ids
from hrc_env.worker.body import SEGMENTS, Body, assets_dir
from hrc_env.worker.mesh import HatMesh, SkinMesh, WorkerMesh
from hrc_env.worker.props import PROP_NAMES

SKIN_SPECULAR, SKIN_SHININESS = 0.08, 0.15
"""Material properties of skins and clothes."""
HAT_SPECULAR, HAT_SHININESS = 0.45, 0.55
"""Material properties of hats."""
SHOWN = DECORATION
"""Group of visual geoms that are rendered."""
HIDDEN = WORKER_CAPSULES
"""Group of visual geoms that are not rendered."""
PARKED_M = (0.0, 0.0, -30.0)
"""Position of props that are not in use [m]."""
LOAD = "load_"
"""Prefix of the names of bodies for props that lie on the floor."""


@dataclass(frozen=True, slots=True)
class WorkerVisuals:
    """Indices of the skins, hats and props of W workers in a drawing model."""

    segments: Ints
    """(W, S) mocap index of every body segment."""
    skins: Ints
    """(nskin, 2) indices of the worker and the body of each skin."""
    hats: Ints
    """(H, 3) indices of the worker, the body and the geom of each hat."""
    props: Ints
    """(N, len(PROPS) - 1) mocap indices of the copies of each prop, with a column for each prop; -1
    in unused rows. They follow those of the workers."""


def add_visuals(spec: mujoco.MjSpec, body: Body, looks: WorkerMesh, prefix: str) -> None:
    """Add the skins and the hat of a body to a worker; workers with the same body share textures.

    Args:
        spec: specification of the scene, to which `add_worker` has added the worker.
        body: the body.
        looks: meshes of the body.
        prefix: prefix of the worker's names.
    """
    for skin in looks.skins:
        _add_skin(spec, skin, body, prefix)
    if looks.hat is not None:
        _add_hat(spec, looks.hat, body, prefix)


def add_props(spec: mujoco.MjSpec, prefixes: tuple[str, ...], loads: tuple[str, ...]) -> None:
    """Add a copy of every prop for each worker, and the loads on the floor, all out of view.

    Without workers, nothing is added.

    Args:
        spec: specification of the scene, to which the workers have been added.
        prefixes: prefixes of the workers' names.
        loads: names of the props that lie on the floor.
    """
    for prefix in prefixes:
        props = mujoco.MjSpec.from_file(str(assets_dir() / "scenes" / "props.xml"))
        spec.attach(props, prefix=prefix, frame=spec.worldbody.add_frame())
    for k, name in enumerate(loads if prefixes else ()):
        body = spec.worldbody.add_body(name=f"{LOAD}{k}/{name}", mocap=True, pos=PARKED_M)
        for geom in spec.body(prefixes[0] + name).geoms:
            body.add_geom(
                type=geom.type,
                size=geom.size,
                pos=geom.pos,
                quat=geom.quat,
                meshname=geom.meshname,
                material=geom.material,
                **LOOKS_ONLY,
            )


def index_visuals(
    model: mujoco.MjModel, prefixes: tuple[str, ...], bodies: tuple[str, ...]
) -> WorkerVisuals:
    """Return the indices of skins, hats and props in a drawing model.

    Args:
        model: the drawing model.
        prefixes: prefixes of the workers' names.
        bodies: names of the bodies that each worker can have.
    """
    pairs = [(w, n) for w in range(len(prefixes)) for n in range(len(bodies))]
    starts = {(w, n): f"{prefixes[w]}{bodies[n]}_" for w, n in pairs}
    skins = np.zeros((model.nskin, 2), np.int64)
    for pair, start in starts.items():
        for k in range(model.nskin):
            if model.skin(k).name.startswith(start):
                skins[k] = pair
    geoms = {model.geom(geom).name: geom for geom in range(model.ngeom)}
    hats = [
        (*pair, geoms[f"{start}hat"]) for pair, start in starts.items() if f"{start}hat" in geoms
    ]
    rows = [mocap_ids(model, prefix) for prefix in prefixes]
    return WorkerVisuals(
        np.array(rows, np.int64),
        skins,
        np.array(hats, np.int64).reshape(-1, 3),
        _prop_rows(model),
    )


def _prop_rows(model: mujoco.MjModel) -> Ints:
    """Return `WorkerVisuals.props` of a drawing model."""
    moved = np.flatnonzero(model.body_mocapid >= 0)
    names = [model.body(body).name.rpartition("/")[2] for body in moved]
    ids = [
        [model.body_mocapid[k] for k, other in zip(moved, names, strict=True) if other == name]
        for name in PROP_NAMES[1:]
    ]
    table = np.full((max(map(len, ids)), len(ids)), -1, np.int64)
    for column, copies in enumerate(ids):
        table[: len(copies), column] = copies
    return table


def show_bodies(model: mujoco.MjModel, visuals: WorkerVisuals, body: Ints | None) -> None:
    """Show one body of each worker, and hide all other bodies.

    Args:
        model: drawing model of the caller, which is changed.
        visuals: indices of skins and hats.
        body: (W,) index of each worker's body; None for the first.
    """
    if not len(visuals.skins):
        return
    chosen = np.zeros(visuals.skins[:, 0].max() + 1, np.int64) if body is None else body
    skins, hats = visuals.skins, visuals.hats
    model.skin_group[:] = np.where(chosen[skins[:, 0]] == skins[:, 1], SHOWN, HIDDEN)
    model.geom_group[hats[:, 2]] = np.where(chosen[hats[:, 0]] == hats[:, 1], SHOWN, HIDDEN)


def show_workers(
    model: mujoco.MjModel, data: mujoco.MjData, visuals: WorkerVisuals, motion: WorkerMotion
) -> None:
    """Pose the workers of one environment in their bodies, with the props that they hold.

    Args:
        model: drawing model of the caller, which is changed.
        data: state of the model, which is changed.
        visuals: indices of skins, hats and props.
        motion: poses of the workers, arrays (W, S, ...).
    """
    rows = visuals.segments
    if not rows.size:
        return
    data.mocap_pos[rows] = np.reshape(motion.position_world, (*rows.shape, 3))
    data.mocap_quat[rows] = np.reshape(motion.quaternion_wxyz, (*rows.shape, 4))
    show_props(model, data, visuals.props, motion.held)
    show_bodies(model, visuals, motion.body)


def show_props(model: mujoco.MjModel, data: mujoco.MjData, rows: Ints, held: Held | None) -> None:
    """Pose the props that are held or lie on the floor, and hide all others below the floor.

    Args:
        model: drawing model of the caller, which is changed.
        data: state of the model, which is changed.
        rows: `WorkerVisuals.props`.
        held: props that are held or lie on the floor, arrays (W + L, ...); None if there are none.
    """
    if not rows.size:
        return
    known = rows[rows >= 0]
    data.mocap_pos[known] = PARKED_M
    shown = assign_props(rows, held)
    if held is not None:
        data.mocap_pos[shown[shown >= 0]] = held.position_world[shown >= 0]
        data.mocap_quat[shown[shown >= 0]] = held.quaternion_wxyz[shown >= 0]
    geom_rows = model.body_mocapid[model.geom_bodyid]
    is_prop = geom_rows >= known.min()
    model.geom_group[is_prop] = np.where(np.isin(geom_rows[is_prop], shown), SHOWN, HIDDEN)


def assign_props(rows: Ints, held: Held | None) -> Ints:
    """Return mocap indices (W + L,) for the props that are held or lie on the floor; -1 if unused.

    Args:
        rows: `WorkerVisuals.props`.
        held: props that are held or lie on the floor, arrays (W + L, ...); None if there are none.
    """
    kind = np.zeros(0, np.int64) if held is None else held.kind
    shown = np.full(len(kind), -1)
    for prop in np.unique(kind[kind > 0]):
        same = np.flatnonzero(kind == prop)[: len(rows)]
        shown[same] = rows[: len(same), prop - 1]
    return shown


def _add_skin(spec: mujoco.MjSpec, skin: SkinMesh, body: Body, prefix: str) -> None:
    """Add a skin of a body, with its material, to the worker with a given prefix."""
    material = f"{body.names[0]}_{skin.name}"
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


def _add_cloth(spec: mujoco.MjSpec, skin: SkinMesh, name: str) -> None:
    """Add the material and the texture of a skin with a given name."""
    height, width = skin.texture.shape[:2]
    texture = spec.add_texture(
        name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=width, height=height, nchannel=3
    )
    texture.data = skin.texture.tobytes()
    material = spec.add_material(name=name, specular=SKIN_SPECULAR, shininess=SKIN_SHININESS)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name


def _add_hat(spec: mujoco.MjSpec, hat: HatMesh, body: Body, prefix: str) -> None:
    """Add the hat of a body to the head of the worker with a given prefix."""
    name = f"{body.names[0]}_hat"
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
    mesh = mujoco.mjtGeom.mjGEOM_MESH
    head = spec.body(prefix + "head")
    head.add_geom(name=prefix + name, type=mesh, meshname=name, material=name, **LOOKS_ONLY)
