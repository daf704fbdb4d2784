"""Compilation of a scene with room, robot, workers and cameras from its settings."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import mujoco
import numpy as np

from hrc_env.core.errors import check_fields, check_names
from hrc_env.core.records import Held
from hrc_env.core.typing import Floats, Ints, JointAngles, Vector3
from hrc_env.geometry.cameras import PinholeCamera
from hrc_env.geometry.chains import SerialChain, capsules
from hrc_env.geometry.shapes import WIDTH
from hrc_env.geometry.sight import Surroundings
from hrc_env.scene import objects
from hrc_env.scene.cups import Cups, find_cups
from hrc_env.scene.objects import Objects, find_objects, place_parts
from hrc_env.scene.places import SCENES, block_loads, find_obstacles
from hrc_env.scene.primitives import OBJECT_BIT, PAD_BIT, ROBOT_BIT, SCENE_BIT, SOLID
from hrc_env.scene.rig import CameraConfig, add_cameras, make_cameras, select
from hrc_env.scene.robot import (
    DEFAULT,
    PREFIX,
    Grip,
    Robot,
    add_robot,
    find_grip,
    find_robot,
    make_chain,
    servo_lead_s,
)
from hrc_env.scene.robot_chain import capsule_reach_m
from hrc_env.scene.worker import add_worker, capsule_geom_ids, mocap_ids
from hrc_env.scene.worker_visuals import WorkerVisuals, add_props, add_visuals, index_visuals
from hrc_env.worker.body import assets_dir, load_body, select_bodies
from hrc_env.worker.mesh import load_mesh
from hrc_env.worker.props import held_shapes
from hrc_env.world import NOTHING, Grounds, TaskScene

ARENA_BYTES = 2**20
"""Memory for the contacts of one simulation [bytes]: ten times the memory for an arm in contact
with many overlapping workers."""
PAIR_BYTES = 1280
"""Memory per squared number of workers [bytes], of which MuJoCo needs about 990."""
HARD = {"solimp": [0.95, 0.99, 0.001, 0.5, 2.0]}
"""Impedance of contacts with light objects. MuJoCo's contacts are softer for lighter bodies; with
the default, an arm presses wood a centimetre into the floor."""
GRIPPING = {"condim": 4, "friction": [1, 1, 0.02, 0.0005, 0.0005], "solref": [0.008, 1.0], **HARD}
"""Contact parameters of rubber pads."""
LYING = {"condim": 3, "friction": [0.6, 0.6, 0.005, 0.0001, 0.0001], "solref": [0.01, 1.0], **HARD}
"""Contact parameters of wood."""
THROWN_M = 1.5
"""Distance beyond the robot's reach up to which contacts between loose and fixed objects are
computed [m]."""


@dataclass(frozen=True, slots=True)
class SceneConfig:
    """Contents of the scene, and the time step and limits of its physics."""

    clutter: bool = True
    """Whether the room contains furniture and building material."""
    sim_dt: float = 0.008
    """Duration of a physics substep [s]. The default is the longest tested one for which the tool
    stays within 1 mm (95 %) of the integral of smooth commands, and contacts are shallow and
    stable."""
    slew_rad_s2: float = 8.0
    """Limit on the rate of change of a commanded joint velocity [rad/s^2]; the default keeps the
    overshoot below 5 %."""
    integrator_clamp_rad: float = 0.05
    """Limit on the difference between the target angle of the holding servo and the angle of a
    blocked joint [rad]."""
    cameras: tuple[CameraConfig, ...] = ()
    """All cameras of the scene, from which `build` may select some; empty for the four default
    cameras of the scene."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "sim_dt", "slew_rad_s2", "integrator_clamp_rad")


class Recipe(NamedTuple):
    """Arguments of `build` for a scene, in the order of its parameters."""

    config: SceneConfig
    """Settings of the scene."""
    name: str
    """Name of the scene, a key of `SCENES`."""
    n_workers: int
    """Number of workers."""
    bodies: tuple[str, ...]
    """Names of the bodies that the workers can have."""
    cameras: tuple[str, ...]
    """Names of the cameras in use."""
    robot: Robot
    """Robot in the scene."""
    task_scene: TaskScene
    """The task's part of the scene."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A compiled scene with a model that all environments of a batch share."""

    config: SceneConfig
    """Settings of the scene, including all of its cameras."""
    name: str
    """Name of the scene, a key of `SCENES`."""
    n_workers: int
    """Number of workers in the model, W."""
    robot: Robot
    """Robot in the scene."""
    bodies: tuple[str, ...]
    """Names of the bodies that the workers can have; `model` contains the capsules of the first
    body."""
    model: mujoco.MjModel
    """MuJoCo model for the physics, with moving, colliding and occluding geoms; `drawing_model`
    also contains visual geoms."""
    chain: SerialChain
    """Kinematics and capsules of the robot."""
    cameras: tuple[PinholeCamera, ...]
    """Pinhole cameras in use."""
    home_q: JointAngles
    """(N,) home pose of the robot [rad]."""
    servo_lead_s: Floats
    """(N,) lead time of the rate servos [s]: each joint's inertia at the home pose divided by the
    damping."""
    watched_capsules: Ints
    """Indices of the robot's capsules that workers watch."""
    worker_mocap: Ints
    """(W, S) mocap index of each body segment of each worker."""
    worker_capsules: Ints
    """(W, K) geom index of each capsule of each worker."""
    obstacles: Floats
    """(G, `shapes.WIDTH`) fixed shapes that occlude."""
    grounds: Grounds
    """Floor plan for the workers."""
    map: Grounds
    """Floor plan that mobile bases know, in which the pedestal and the loads are also obstacles."""
    objects: Objects
    """Loose objects of the task."""
    grip: Grip | None
    """The robot's fingers; None for a robot without fingers."""
    cups: Cups | None
    """The robot's suction cups; None for a robot without suction cups."""
    object_bodies: Ints
    """(O,) indices of the loose objects' bodies in the model."""
    task_scene: TaskScene
    """The task's part of the scene, with loose and fixed objects."""

    @property
    def rig(self) -> tuple[CameraConfig, ...]:
        """Settings of the cameras in use."""
        return select(self.config.cameras, tuple(camera.name for camera in self.cameras))

    def surroundings(self, qpos: Floats, held: Held | None = None) -> Surroundings:
        """Return the shapes that can occlude the view of cameras.

        Args:
            qpos: (B, nq) angles of the robot's N joints [rad], followed by poses of loose objects.
            held: objects in the hands of workers; None if there are none.
        """
        chain = self.chain
        moving = np.zeros((len(qpos), 0, WIDTH)) if held is None else held_shapes(held)
        if self.objects.names:
            moving = np.concatenate([moving, place_parts(self.objects, qpos)], axis=1)
        arm = capsules(chain, qpos[:, : chain.n_joints])
        return Surroundings(self.obstacles, moving, arm, chain.capsule_radius_m)

    @property
    def recipe(self) -> Recipe:
        """Arguments of `build` from which the scene is made."""
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
    """Return the compiled scene for these settings, which is cached.

    Args:
        config: settings; None for the defaults.
        name: name of the scene, a key of `SCENES`.
        n_workers: number of workers in the scene, at least 0.
        bodies: body of all workers, or the bodies that they can have; "any" for all bodies.
        cameras: names or indices of the cameras in use; None for all.
        robot: name or record of the robot.
        task_scene: the task's part of the scene.

    Raises:
        ConfigError: the scene, a body, a camera or the robot is unknown.
    """
    check_names("scene", [name], SCENES)
    config = config or SceneConfig()
    if not config.cameras:
        config = replace(config, cameras=SCENES[name].cameras)
    use = tuple(camera.name for camera in select(config.cameras, cameras))
    recipe = Recipe(
        config, name, n_workers, select_bodies(bodies), use, find_robot(robot), task_scene
    )
    return _build(recipe)


def all_grounds(config: SceneConfig | None = None) -> dict[str, Grounds]:
    """Return the floor plan of each scene by its name."""
    return {name: build(config, name).grounds for name in SCENES}


@lru_cache(maxsize=8)
def _build(recipe: Recipe) -> Scene:
    """Compile the scene that a recipe describes."""
    robot, n_workers = recipe.robot, recipe.n_workers
    chain = make_chain(robot, _foot_world(robot, recipe.name))
    spec = _make_spec(recipe)
    _remove_visuals(spec, robot.drives)
    n_joints = len(robot.joints) + (len(robot.hand.joints) if robot.hand else 0)
    loose = find_objects(spec, n_joints)
    _add_contact_pairs(spec, robot, chain)
    model = spec.compile()
    prefixes, body = _prefixes(n_workers), load_body(recipe.bodies[0])
    rows = [mocap_ids(model, prefix) for prefix in prefixes]
    geoms = [capsule_geom_ids(model, body, prefix) for prefix in prefixes]
    still = find_obstacles(model)
    room, clutter = SCENES[recipe.name], recipe.config.clutter
    grounds = room.grounds(still, clutter, recipe.task_scene.places)
    return Scene(
        config=recipe.config,
        name=recipe.name,
        n_workers=n_workers,
        robot=robot,
        bodies=recipe.bodies,
        model=model,
        chain=chain,
        cameras=make_cameras(select(recipe.config.cameras, recipe.cameras)),
        home_q=np.array(robot.home_q),
        servo_lead_s=servo_lead_s(robot, model),
        watched_capsules=np.array([robot.capsules.index(name) for name in robot.watched_capsules]),
        worker_mocap=np.stack(rows) if rows else np.zeros((0, 0), np.int64),
        worker_capsules=np.array(geoms, np.int64).reshape(n_workers, len(body.capsule_names)),
        obstacles=still,
        grounds=grounds,
        map=block_loads(grounds, still) if robot.drives else grounds,
        objects=loose,
        grip=find_grip(robot, model),
        cups=find_cups(robot, model, loose, PREFIX),
        object_bodies=np.array([model.body(objects.PREFIX + name).id for name in loose.names], int),
        task_scene=recipe.task_scene,
    )


def with_rig(scene: Scene, rig: tuple[CameraConfig, ...]) -> Scene:
    """Return a scene with another rig, with all of its cameras in use; the physics is shared."""
    config = replace(scene.config, cameras=rig)
    return replace(scene, config=config, cameras=make_cameras(select(rig)))


def without_workers(scene: Scene) -> Scene:
    """Return a scene without its workers."""
    return _build(scene.recipe._replace(n_workers=0))


@lru_cache(maxsize=4)
def drawing_model(scene: Scene) -> mujoco.MjModel:
    """Return the model of a scene with all visual geoms and with objects that workers can hold.

    The joints and mocap bodies of the physics model come first, in the same order; its state is
    therefore valid for the drawing model.
    """
    prefixes, spec = _prefixes(scene.n_workers), _make_spec(scene.recipe)
    for prefix in prefixes:
        for name in scene.bodies:
            add_visuals(spec, load_body(name), load_mesh(name), prefix)
    loads = tuple(name for place in scene.grounds.places for name in place.loads)
    add_props(spec, prefixes, loads)
    return spec.compile()


def find_visuals(scene: Scene) -> WorkerVisuals:
    """Return the indices of the workers' skins, hats and props in the drawing model."""
    return index_visuals(drawing_model(scene), _prefixes(scene.n_workers), scene.bodies)


def _make_spec(recipe: Recipe) -> mujoco.MjSpec:
    """Return the MuJoCo specification of a scene without visual geoms and props of workers."""
    config, robot, n_workers = recipe.config, recipe.robot, recipe.n_workers
    path = assets_dir() / "scenes" / f"{recipe.name}{'' if config.clutter else '_bare'}.xml"
    spec = mujoco.MjSpec.from_file(str(path))
    spec.option.timestep = config.sim_dt
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.memory = ARENA_BYTES + PAIR_BYTES * n_workers**2
    # The present velocity command, the body of each worker, and the hand's command or load.
    spec.nuserdata = len(robot.joints) + n_workers + robot.grips
    foot_world = _foot_world(robot, recipe.name)
    add_robot(spec, robot, foot_world)
    objects.add_task_scene(spec, recipe.task_scene, foot_world)
    add_cameras(spec, make_cameras(select(config.cameras, recipe.cameras)))
    for prefix in _prefixes(n_workers):
        add_worker(spec, load_body(recipe.bodies[0]), prefix)
    objects.add_welds(spec, recipe.task_scene)
    return spec


def _foot_world(robot: Robot, name: str) -> Vector3:
    """Return the position of a robot's base in a scene [m]."""
    return Vector3(0.0, 0.0, 0.0) if robot.drives else Vector3(*SCENES[name].mount_world)


def _remove_visuals(spec: mujoco.MjSpec, drives: bool) -> None:
    """Remove all visual geoms, lights and cameras, which makes the physics twice as fast.

    Occluding geoms out of the reach of arms collide only with mobile robots.
    """
    hiding = [geom for geom in spec.geoms if geom.group == SOLID and not geom.contype]
    for geom in hiding:
        geom.contype = SCENE_BIT  # so that the compiler does not discard these
    spec.compiler.discardvisual = True
    spec.compile()
    spec.compiler.discardvisual = False
    for geom in hiding:
        geom.contype = SCENE_BIT if drives else 0
    empty = [b for b in spec.worldbody.bodies if not (b.mocap or b.geoms or b.bodies)]
    for unseen in (*empty, *spec.lights, *spec.cameras):
        spec.delete(unseen)


def _add_contact_pairs(spec: mujoco.MjSpec, robot: Robot, chain: SerialChain) -> None:
    """Declare the pairs of geoms that can touch the robot or a loose object.

    Explicit pairs are faster than MuJoCo's collision search in every substep, and exclude fixed
    geoms out of the robot's reach.

    Args:
        spec: specification of the scene; its geoms lose their collision bits.
        robot: the robot.
        chain: kinematics of the robot.
    """
    reach = dict(zip(robot.capsules, capsule_reach_m(chain).tolist(), strict=True))
    farthest = max(reach.values())
    foot_world = chain.T_world_from_base[:3, 3]
    robot_bits = ROBOT_BIT | PAD_BIT
    parts = [geom for geom in spec.geoms if geom.contype & robot_bits]
    others = [geom for geom in spec.geoms if geom.contype & ~robot_bits]
    for row, other in enumerate(others):
        other.name = other.name or f"solid_{row}"
    loose = [geom for geom in others if geom.contype & OBJECT_BIT]
    for part in parts:
        name = part.name.removeprefix(PREFIX)
        for other in others:
            can_touch = part.conaffinity & other.contype
            if not can_touch or (name, other.name) in robot.never_touch:
                continue
            if _nearest_m(other, foot_world) <= reach.get(name, farthest):
                contact = GRIPPING if part.contype & PAD_BIT else LYING if other in loose else {}
                spec.add_pair(geomname1=part.name, geomname2=other.name, **contact)
    for k, geom in enumerate(loose):
        others_loose = [each for each in loose[k + 1 :] if each.parent.name != geom.parent.name]
        still = [each for each in others if each.contype & geom.conaffinity & SCENE_BIT]
        near = [each for each in still if _nearest_m(each, foot_world) <= farthest + THROWN_M]
        for other in (*others_loose, *near):
            spec.add_pair(geomname1=geom.name, geomname2=other.name, **LYING)
    for geom in (*parts, *others):
        geom.contype = geom.conaffinity = 0


def _nearest_m(geom: mujoco.MjsGeom, foot_world: Floats) -> float:
    """Return a lower bound on the distance of a geom from the robot's base [m].

    For a geom that moves, it is 0.
    """
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
    """Return the prefixes of the names of each worker's bodies."""
    return tuple(f"worker_{worker + 1}/" for worker in range(n_workers))
