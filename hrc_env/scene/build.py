"""From settings to a compiled scene: room, arm, workers, cameras."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import mujoco
import numpy as np

from hrc_env.core.errors import check_fields, check_names
from hrc_env.core.records import Held
from hrc_env.core.typing import Floats, Ints, JointAngles
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.geometry.chains import SerialChain, capsules
from hrc_env.geometry.shapes import WIDTH
from hrc_env.geometry.sight import Surroundings
from hrc_env.scene import objects
from hrc_env.scene.cups import Cups, cups_of
from hrc_env.scene.objects import Objects, objects_of, surfaces
from hrc_env.scene.places import SCENES, obstacles, to_drive_in
from hrc_env.scene.primitives import OBJECT_BIT, PAD_BIT, ROBOT_BIT, SCENE_BIT, SOLID
from hrc_env.scene.rig import CameraConfig, add_cameras, make_cameras, select
from hrc_env.scene.robot import (
    DEFAULT,
    PREFIX,
    Grip,
    Robot,
    add_robot,
    chain_of,
    grip_of,
    robot_called,
    servo_lead_s,
)
from hrc_env.scene.robot_chain import reach_m
from hrc_env.scene.worker import add_worker, capsule_geom_ids, mocap_ids
from hrc_env.scene.worker_visuals import WorkerVisuals, add_props, add_visuals, visuals_of
from hrc_env.worker.body import assets_dir, load_body, select_bodies
from hrc_env.worker.mesh import load_mesh
from hrc_env.worker.props import held_shapes
from hrc_env.world import NOTHING, Grounds, TaskScene

ARENA_BYTES = 2**20
"""Memory of one simulation for contacts; the arm in a pile of them takes a tenth."""
PAIR_BYTES = 1280
"""And for who may touch whom: MuJoCo takes about 990 times the square of the number of workers."""


HARD = {"solimp": [0.95, 0.99, 0.001, 0.5, 2.0]}
"""MuJoCo's contacts are the softer the lighter things are: with its default an arm presses wood a
centimetre into the floor."""
GRIPPING = {"condim": 4, "friction": [1, 1, 0.02, 0.0005, 0.0005], "solref": [0.008, 1.0], **HARD}
LYING = {"condim": 3, "friction": [0.6, 0.6, 0.005, 0.0001, 0.0001], "solref": [0.01, 1.0], **HARD}
"""Contacts of rubber pads, and of wood with whatever it lies on or is pushed by."""
THROWN_M = 1.5
"""What is loose touches what stands still so far beyond the robot's reach [m]."""


@dataclass(frozen=True, slots=True)
class SceneConfig:
    """What stands in the room and how finely time is cut."""

    clutter: bool = True
    """Whether furniture and building material stand in the room."""
    sim_dt: float = 0.008
    """Length of a physics substep [s]: the coarsest tried that keeps the tool within 1 mm (95 %) of
    the integral of smooth commands, and contacts shallow and calm (`tests/properties/`)."""
    slew_rad_s2: float = 8.0
    """Fastest change of a commanded joint velocity [rad/s^2]; keeps the overshoot below 5 %."""
    integrator_clamp_rad: float = 0.05
    """How far the holding servo's angle may be ahead of a blocked joint [rad]."""
    cameras: tuple[CameraConfig, ...] = ()
    """All that hang in the scene, of which `build` switches some on; none: the scene's own four."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "sim_dt", "slew_rad_s2", "integrator_clamp_rad")


class Recipe(NamedTuple):
    """What `build` makes a scene from, in the order of its arguments."""

    config: SceneConfig
    name: str
    n_workers: int
    bodies: tuple[str, ...]
    cameras: tuple[str, ...]
    robot: Robot
    task_scene: TaskScene


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A scene ready for physics: one model that every environment of a batch shares."""

    config: SceneConfig
    name: str
    n_workers: int
    robot: Robot
    bodies: tuple[str, ...]
    """Baked bodies that the workers can have; their capsules in `model` are the first one's."""
    model: mujoco.MjModel
    """What moves, touches and hides; `drawing_model` has the looks."""
    chain: SerialChain
    cameras: tuple[PinholeCamera, ...]
    home_q: JointAngles
    """(N,) the arm's pose at rest [rad]."""
    servo_lead_s: Floats
    """(N,) inertia at rest over damping, joint by joint: the rate servos' lead [s]."""
    watched: Ints
    """Which of the chain's capsules workers keep an eye on."""
    worker_mocap: Ints
    """(W, S) mocap row of every body segment of every worker."""
    worker_capsules: Ints
    """(W, K) geom of every capsule of every worker."""
    obstacles: Floats
    """(G, `shapes.WIDTH`) what stands still and blocks sight."""
    grounds: Grounds
    """Where people can stand, walk and work."""
    map: Grounds
    """The same with the pedestal and loads' places among what is blocked, for robots that drive:
    what they know of the place."""
    objects: Objects
    """What is loose."""
    grip: Grip | None
    """The robot's fingers; None: it has none."""
    cups: Cups | None
    """Its cups; likewise."""
    object_bodies: Ints
    """(O,) the loose objects' bodies in the model."""
    task_scene: TaskScene
    """What a task puts there, loose and fixed."""

    @property
    def rig(self) -> tuple[CameraConfig, ...]:
        """The settings of `cameras`."""
        return select(self.config.cameras, tuple(camera.name for camera in self.cameras))

    def surroundings(self, qpos: Floats, held: Held | None = None) -> Surroundings:
        """What can stand before cameras: the arm, at the first N of qpos (B, nq) [rad], and what is
        loose, at the others; what is fixed; what workers hold."""
        chain = self.chain
        moving = np.zeros((len(qpos), 0, WIDTH)) if held is None else held_shapes(held)
        if self.objects.names:
            moving = np.concatenate([moving, surfaces(self.objects, qpos)], axis=1)
        arm = capsules(chain, qpos[:, : chain.n_joints])
        return Surroundings(self.obstacles, moving, arm, chain.capsule_radius_m)

    @property
    def recipe(self) -> Recipe:
        """What `build` makes it from."""
        use = tuple(camera.name for camera in self.cameras)
        return Recipe(
            self.config, self.name, self.n_workers, self.bodies, use, self.robot, self.task_scene
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return build, tuple(self.recipe)


def build(
    config: SceneConfig | None = None,
    name: str = "lab",
    n_workers: int = 0,
    bodies: str | tuple[str, ...] = "worker_1",
    cameras: Sequence[int | str] | None = None,
    robot: str | Robot = DEFAULT,
    task_scene: TaskScene = NOTHING,
) -> Scene:
    """The scene of these settings, compiled once and kept.

    Args:
        config: settings; None: the defaults.
        name: which scene, a key of `SCENES`.
        n_workers: how many workers it has room for, 0 or more.
        bodies: the baked body of all of them, or those that they can have; "any": all.
        cameras: names or indices of the cameras that are used; None: all.
        robot: a name or itself.
        task_scene: what a task adds.

    Raises:
        ConfigError: an unknown scene, body, camera or robot.
    """
    check_names("scene", [name], SCENES)
    config = config or SceneConfig()
    if not config.cameras:
        config = replace(config, cameras=SCENES[name].cameras)
    use = tuple(camera.name for camera in select(config.cameras, cameras))
    robot = robot_called(robot)
    return _build(Recipe(config, name, n_workers, select_bodies(bodies), use, robot, task_scene))


def all_grounds(config: SceneConfig | None = None) -> dict[str, Grounds]:
    """Return where people can walk in each scene, by its name."""
    return {name: build(config, name).grounds for name in SCENES}


@lru_cache(maxsize=8)
def _build(recipe: Recipe) -> Scene:
    config, name, n_workers, bodies, use, robot, task_scene = recipe
    room = SCENES[name]
    chain = chain_of(robot, _foot_world(robot, name))
    spec = _spec(recipe)
    _strip(spec, robot.drives)
    n_joints = len(robot.joints) + (len(robot.hand.joints) if robot.hand else 0)
    loose = objects_of(spec, n_joints)
    _pair(spec, robot, chain)
    model = spec.compile()
    prefixes, body = _prefixes(n_workers), load_body(bodies[0])
    rows = [mocap_ids(model, prefix) for prefix in prefixes]
    touched = [capsule_geom_ids(model, body, prefix) for prefix in prefixes]
    still = obstacles(model)
    grounds = room.grounds(still, config.clutter, task_scene.places)
    return Scene(
        config=config,
        name=name,
        n_workers=n_workers,
        robot=robot,
        bodies=bodies,
        model=model,
        chain=chain,
        cameras=make_cameras(select(config.cameras, use)),
        home_q=np.array(robot.home_q),
        servo_lead_s=servo_lead_s(robot, model),
        watched=np.array([robot.capsules.index(name) for name in robot.watched]),
        worker_mocap=np.stack(rows) if rows else np.zeros((0, 0), np.int64),
        worker_capsules=np.array(touched, np.int64).reshape(n_workers, len(body.capsule_names)),
        obstacles=still,
        grounds=grounds,
        map=to_drive_in(grounds, still) if robot.drives else grounds,
        objects=loose,
        grip=grip_of(robot, model),
        cups=cups_of(robot, model, loose, PREFIX),
        object_bodies=np.array([model.body(objects.PREFIX + name).id for name in loose.names], int),
        task_scene=task_scene,
    )


def with_rig(scene: Scene, rig: tuple[CameraConfig, ...]) -> Scene:
    """The same scene with other cameras, all of them in use: its physics knows none."""
    config = replace(scene.config, cameras=rig)
    return replace(scene, config=config, cameras=make_cameras(select(rig)))


def without_workers(scene: Scene) -> Scene:
    """The same scene with nobody in it."""
    return _build(scene.recipe._replace(n_workers=0))


@lru_cache(maxsize=4)
def drawing_model(scene: Scene) -> mujoco.MjModel:
    """The scene with everything that only the eye needs: looks, and what workers hold. The physics'
    joints and mocap rows come first, in the same order: its state fits."""
    prefixes, spec = _prefixes(scene.n_workers), _spec(scene.recipe)
    for prefix in prefixes:
        for name in scene.bodies:
            add_visuals(spec, load_body(name), load_mesh(name), prefix)
    loads = tuple(name for place in scene.grounds.places for name in place.loads)
    add_props(spec, prefixes, loads)
    return spec.compile()


def visuals(scene: Scene) -> WorkerVisuals:
    """Where the workers' looks, and what they can hold, are in the drawing model."""
    return visuals_of(drawing_model(scene), _prefixes(scene.n_workers), scene.bodies)


def _spec(recipe: Recipe) -> mujoco.MjSpec:
    """Everything but the workers' looks and what they hold."""
    config, name, n_workers, bodies, use, robot, task_scene = recipe
    path = assets_dir() / "scenes" / f"{name}{'' if config.clutter else '_bare'}.xml"
    spec = mujoco.MjSpec.from_file(str(path))
    spec.option.timestep = config.sim_dt
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.memory = ARENA_BYTES + PAIR_BYTES * n_workers**2
    # The velocity command in force, which body each worker has, and the hand's command or load.
    spec.nuserdata = len(robot.joints) + n_workers + robot.grips
    foot_world = _foot_world(robot, name)
    add_robot(spec, robot, foot_world)
    objects.add_task_scene(spec, task_scene, foot_world)
    add_cameras(spec, make_cameras(select(config.cameras, use)))
    for prefix in _prefixes(n_workers):
        add_worker(spec, load_body(bodies[0]), prefix)
    objects.add_welds(spec, task_scene)
    return spec


def _foot_world(robot: Robot, name: str) -> tuple[float, float, float]:
    """Where a robot's foot is in a scene [m]."""
    return (0.0, 0.0, 0.0) if robot.drives else SCENES[name].mount_world


def _strip(spec: mujoco.MjSpec, drives: bool) -> None:
    """Take away what only the eye needs: the physics is then twice as fast. What hides and is out
    of an arm's reach touches only robots that drive."""
    hiding = [geom for geom in spec.geoms if geom.group == SOLID and not geom.contype]
    for geom in hiding:
        geom.contype = SCENE_BIT  # else the compiler would discard these as well
    spec.compiler.discardvisual = True
    spec.compile()
    spec.compiler.discardvisual = False
    for geom in hiding:
        geom.contype = SCENE_BIT if drives else 0
    empty = [b for b in spec.worldbody.bodies if not (b.mocap or b.geoms or b.bodies)]
    for unseen in (*empty, *spec.lights, *spec.cameras):
        spec.delete(unseen)


def _pair(spec: mujoco.MjSpec, robot: Robot, chain: SerialChain) -> None:
    """Say pair by pair what may touch the robot and what is loose, which is quicker than to look
    for it in every substep; what stands still out of reach cannot."""
    reach = dict(zip(robot.capsules, reach_m(chain).tolist(), strict=True))
    farthest = max(reach.values())
    foot_world = chain.T_world_from_base[:3, 3]
    own = ROBOT_BIT | PAD_BIT
    parts = [geom for geom in spec.geoms if geom.contype & own]
    others = [geom for geom in spec.geoms if geom.contype & ~own]
    for row, other in enumerate(others):
        other.name = other.name or f"solid_{row}"
    loose = [geom for geom in others if geom.contype & OBJECT_BIT]
    for part in parts:
        name = part.name.removeprefix(PREFIX)
        for other in others:
            meets = part.conaffinity & other.contype
            if not meets or (name, other.name) in robot.never_touch:
                continue
            if _nearest_m(other, foot_world) <= reach.get(name, farthest):
                how = GRIPPING if part.contype & PAD_BIT else LYING if other in loose else {}
                spec.add_pair(geomname1=part.name, geomname2=other.name, **how)
    for k, thing in enumerate(loose):
        others_loose = [each for each in loose[k + 1 :] if each.parent.name != thing.parent.name]
        still = [geom for geom in others if geom.contype & thing.conaffinity & SCENE_BIT]
        near = [geom for geom in still if _nearest_m(geom, foot_world) <= farthest + THROWN_M]
        for other in (*others_loose, *near):
            spec.add_pair(geomname1=thing.name, geomname2=other.name, **LYING)
    for geom in (*parts, *others):
        geom.contype = geom.conaffinity = 0


def _nearest_m(geom: Any, foot_world: Floats) -> float:
    """How near a geom can come to the robot's foot at least [m]; 0 for what moves."""
    if geom.parent.name != "world":
        return 0.0
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, geom.quat)
    foot = np.abs(turn.reshape(3, 3).T @ (foot_world - geom.pos))
    half = geom.size.copy()
    if geom.type == mujoco.mjtGeom.mjGEOM_PLANE:
        half[2] = 0.0
    elif geom.type == mujoco.mjtGeom.mjGEOM_CYLINDER:
        half = half[[0, 0, 1]]
    elif geom.type != mujoco.mjtGeom.mjGEOM_BOX:
        return 0.0
    return float(np.linalg.norm(np.maximum(foot - half, 0.0)))


def _prefixes(n_workers: int) -> tuple[str, ...]:
    """What the names of the workers' bodies start with."""
    return tuple(f"worker_{worker + 1}/" for worker in range(n_workers))
