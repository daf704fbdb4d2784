"""What workers look like and hold, in the drawing model; physics knows capsules only.

All of a worker's bodies hang on the same 22 mocap bodies, and a mocap body for each thing that can
be held follows them. What nobody has or holds is in a group that is not drawn.
"""

from dataclasses import dataclass
from typing import Any

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
HAT_SPECULAR, HAT_SHININESS = 0.45, 0.55
SHOWN, HIDDEN = DECORATION, WORKER_CAPSULES
"""Groups of skins, hats and task_scene."""
PARKED_M = (0.0, 0.0, -30.0)
"""Where things are that nobody holds [m]."""
LOAD = "load_"
"""With what the names of bodies begin that lie about."""


@dataclass(frozen=True, slots=True)
class WorkerVisuals:
    """Where the looks of W workers' N bodies, and what they can hold, are in a model."""

    segments: Ints
    """(W, S) mocap row of every body segment."""
    skins: Ints
    """(nskin, 2) whose each skin is, and of which body."""
    hats: Ints
    """(H, 3) whose each hat is, of which body, and its geom."""
    props: Ints
    """(N, len(PROPS) - 1) mocap rows of as many of each thing as are drawn at once, -1: there are
    fewer; they follow the workers' rows."""


def add_visuals(spec: Any, body: Body, looks: WorkerMesh, prefix: str) -> None:
    """Add the skins and the hat of a body to the worker whom `add_worker` has added with this
    prefix; workers who have the same body share its textures."""
    for skin in looks.skins:
        _add_skin(spec, skin, body, prefix)
    if looks.hat is not None:
        _add_hat(spec, looks.hat, body, prefix)


def add_props(spec: Any, prefixes: tuple[str, ...], loads: tuple[str, ...]) -> None:
    """Everything that can be held, once a worker, and loads (names of props) that lie about, all
    parked; call after the workers are added. Without workers there is nothing."""
    for prefix in prefixes:
        props = mujoco.MjSpec.from_file(str(assets_dir() / "scenes" / "props.xml"))
        spec.attach(props, prefix=prefix, frame=spec.worldbody.add_frame())
    for k, name in enumerate(loads if prefixes else ()):
        body = spec.worldbody.add_body(name=f"{LOAD}{k}/{name}", mocap=True, pos=PARKED_M)
        for geom in spec.body(prefixes[0] + name).geoms:
            body.add_geom(
                type=geom.type, size=geom.size, pos=geom.pos, quat=geom.quat,
                meshname=geom.meshname, material=geom.material, **LOOKS_ONLY,
            )  # fmt: skip


def visuals_of(
    model: mujoco.MjModel, prefixes: tuple[str, ...], bodies: tuple[str, ...]
) -> WorkerVisuals:
    """Those in a model of workers with these prefixes, each with the looks of all these bodies."""
    pairs = [(w, n) for w in range(len(prefixes)) for n in range(len(bodies))]
    of = {(w, n): f"{prefixes[w]}{bodies[n]}_" for w, n in pairs}
    skins = np.zeros((model.nskin, 2), np.int64)
    for pair, start in of.items():
        for k in range(model.nskin):
            if model.skin(k).name.startswith(start):
                skins[k] = pair
    known = {model.geom(geom).name: geom for geom in range(model.ngeom)}
    hats = [(*pair, known[f"{start}hat"]) for pair, start in of.items() if f"{start}hat" in known]
    rows = [mocap_ids(model, prefix) for prefix in prefixes]
    return WorkerVisuals(
        np.array(rows, np.int64),
        skins,
        np.array(hats, np.int64).reshape(-1, 3),
        _prop_rows(model),
    )


def _prop_rows(model: mujoco.MjModel) -> Ints:
    """`WorkerVisuals.props` of a model: a column for each thing, filled from above."""
    moved = np.flatnonzero(model.body_mocapid >= 0)
    names = [model.body(body).name.rpartition("/")[2] for body in moved]
    ids = [
        [model.body_mocapid[k] for k, found in zip(moved, names, strict=True) if found == name]
        for name in PROP_NAMES[1:]
    ]
    table = np.full((max(map(len, ids)), len(ids)), -1, np.int64)
    for column, own in enumerate(ids):
        table[: len(own), column] = own
    return table


def show_bodies(model: mujoco.MjModel, visuals: WorkerVisuals, body: Ints | None) -> None:
    """Show each worker in a body (W,), None: the first, in a drawing model of the caller's own."""
    if not len(visuals.skins):
        return
    chosen = np.zeros(visuals.skins[:, 0].max() + 1, np.int64) if body is None else body
    skins, hats = visuals.skins, visuals.hats
    model.skin_group[:] = np.where(chosen[skins[:, 0]] == skins[:, 1], SHOWN, HIDDEN)
    model.geom_group[hats[:, 2]] = np.where(chosen[hats[:, 0]] == hats[:, 1], SHOWN, HIDDEN)


def show_workers(
    model: mujoco.MjModel, data: mujoco.MjData, visuals: WorkerVisuals, motion: WorkerMotion
) -> None:
    """Pose the workers of one environment (W, S, ...), in their bodies and with what they hold, in
    a drawing model of the caller's own and its state."""
    rows = visuals.segments
    if not rows.size:
        return
    data.mocap_pos[rows] = np.reshape(motion.position_world, (*rows.shape, 3))
    data.mocap_quat[rows] = np.reshape(motion.quaternion_wxyz, (*rows.shape, 4))
    show_props(model, data, visuals.props, motion.held)
    show_bodies(model, visuals, motion.body)


def show_props(model: mujoco.MjModel, data: mujoco.MjData, rows: Ints, held: Held | None) -> None:
    """Put what is held or lies about (W + L, ...) to where it is, all else under the floor, where
    no camera draws it; rows: `WorkerVisuals.props`."""
    if not rows.size:
        return
    known = rows[rows >= 0]
    data.mocap_pos[known] = PARKED_M
    shown = rows_shown(rows, held)
    if held is not None:
        data.mocap_pos[shown[shown >= 0]] = held.position_world[shown >= 0]
        data.mocap_quat[shown[shown >= 0]] = held.quaternion_wxyz[shown >= 0]
    of_geom = model.body_mocapid[model.geom_bodyid]
    things = of_geom >= known.min()
    model.geom_group[things] = np.where(np.isin(of_geom[things], shown), SHOWN, HIDDEN)


def rows_shown(rows: Ints, held: Held | None) -> Ints:
    """Return (W + L,) the mocap row that shows each thing that is held or lies about, -1 of none;
    rows: `WorkerVisuals.props`."""
    kind = np.zeros(0, np.int64) if held is None else held.kind
    shown = np.full(len(kind), -1)
    for prop in np.unique(kind[kind > 0]):
        of_kind = np.flatnonzero(kind == prop)[: len(rows)]
        shown[of_kind] = rows[: len(of_kind), prop - 1]
    return shown


def _add_skin(spec: Any, skin: SkinMesh, body: Body, prefix: str) -> None:
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
