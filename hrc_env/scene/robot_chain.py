"""Reading of a robot's links, joints, servos and capsules from its MJCF."""

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import mujoco
import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Floats, Ints, Transforms
from hrc_env.geometry.chains import SerialChain

if TYPE_CHECKING:
    from hrc_env.scene.robot import Hand, Robot


@lru_cache(maxsize=8)
def make_chain(robot: "Robot", mount_world: tuple[float, float, float]) -> SerialChain:
    """Return the kinematic chain of a robot.

    Args:
        robot: the robot.
        mount_world: position of the robot's base [m].

    Raises:
        ConfigError: an element that `Robot` names is missing in the MJCF or has a wrong type.
    """
    try:
        return _read_chain(robot, mount_world)
    except ConfigError as error:
        raise ConfigError(f"{robot.name}: {error}") from error
    except ValueError as error:
        raise ConfigError(f"{robot.name}: its MJCF cannot be used: {error}") from error


def capsule_reach_m(chain: SerialChain) -> Floats:
    """Return upper bounds (K,) on the distances of the capsules from the robot's base [m]."""
    strokes = np.where(chain.slides, np.abs(chain.range_rad).max(-1), 0.0)
    to_link = np.cumsum(np.linalg.norm(chain.parent_from_joint[:, :3, 3], axis=-1) + strokes)
    on_link = np.linalg.norm(chain.capsule_ends, axis=-1).max(-1)
    return to_link[chain.capsule_link] + on_link + chain.capsule_radius_m


class LinkCapsules(NamedTuple):
    """The K capsules of a robot."""

    link: Ints
    """(K,) index of the link that carries each capsule."""
    ends: Floats
    """(K, 2, 3) end points of each capsule's axis in the frame of its link [m]."""
    radius_m: Floats
    """(K,) radius of each capsule [m]."""


def parse_mjcf(robot: "Robot") -> mujoco.MjSpec:
    """Return the MJCF of a robot as a specification that can be edited."""
    text = str(robot.mjcf)
    read = mujoco.MjSpec.from_string if text.lstrip().startswith("<") else mujoco.MjSpec.from_file
    return read(text)


def _read_chain(robot: "Robot", mount_world: tuple[float, float, float]) -> SerialChain:
    """Return the kinematic chain of a robot; its errors do not name the robot."""
    model, n = parse_mjcf(robot).compile(), len(robot.joints)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)  # all joints at 0
    joints = [find_id(model, "joint", name) for name in robot.joints]
    _check_servos(model, joints, robot.hand)
    bodies = model.jnt_bodyid[joints].tolist()
    parents = model.body_parentid[bodies].tolist()
    if [find_link(model, bodies, parent) for parent in parents] != list(range(-1, n - 1)):
        raise ConfigError("its joints must be a single chain.")
    site = find_id(model, "site", robot.tool_site)
    if find_link(model, bodies, model.site_bodyid[site]) != n - 1:
        raise ConfigError(f"site {robot.tool_site!r} must be on the last link.")
    foot = _pose(data.xpos[parents[0]], data.xmat[parents[0]])
    links = np.stack([_joint_frame(model, data, joint) for joint in joints])
    capsules = _read_capsules(model, data, bodies, links, robot)
    return SerialChain(
        T_world_from_base=_pose(mount_world, np.eye(3)) @ foot,
        parent_from_joint=np.linalg.inv([foot, *links[:-1]]) @ links,
        link_from_tool=np.linalg.inv(links[-1]) @ _pose(data.site_xpos[site], data.site_xmat[site]),
        range_rad=model.jnt_range[joints],
        velocity_limit_rad_s=model.actuator_ctrlrange[n : 2 * n, 1].copy(),
        slides=model.jnt_type[joints] == mujoco.mjtJoint.mjJNT_SLIDE,
        capsule_link=capsules.link,
        capsule_ends=capsules.ends,
        capsule_radius_m=capsules.radius_m,
    )


def find_id(model: mujoco.MjModel, kind: str, name: str) -> int:
    """Return the ID of a named element of a type, or raise `ConfigError` if it is missing."""
    number = mujoco.mj_name2id(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), name)
    if number < 0:
        raise ConfigError(f"its MJCF has no {kind} {name!r}.")
    return number


def _check_servos(model: mujoco.MjModel, joints: list[int], hand: "Hand | None") -> None:
    """Raise `ConfigError` if joints and servos do not have the required types and order.

    The joints must be hinges and slides with ranges, followed by the hand's slides; the actuators
    must be the joints' servos, followed by the hand's motor.

    Args:
        model: the compiled MJCF.
        joints: IDs of the robot's joints.
        hand: the robot's hand; None if the robot has none.
    """
    n, fingers = (
        len(joints),
        [find_id(model, "joint", each) for each in hand.joints] if hand else [],
    )
    kinds = {mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE}
    has_joints = kinds.issuperset(model.jnt_type[:n].tolist()) and model.jnt_limited.all()
    has_fingers = (model.jnt_type[n:] == mujoco.mjtJoint.mjJNT_SLIDE).all()
    if joints + fingers != list(range(model.njnt)) or not (has_joints and has_fingers):
        raise ConfigError(
            "joints must be all joints of its MJCF, in the same order: hinges and slides with a "
            "range, then those of its hand: slides with a range."
        )
    motors = [find_id(model, "actuator", hand.motor)] if hand else []
    integrates = model.actuator_dyntype == mujoco.mjtDyn.mjDYN_INTEGRATOR
    if not (
        model.actuator_trnid[: 2 * n, 0].tolist() == 2 * joints
        and integrates.tolist() == [True] * n + [False] * (n + len(motors))
        and motors == list(range(2 * n, model.nu))
        and model.actuator_ctrllimited.all()
    ):
        raise ConfigError(
            "needs an <intvelocity> for every joint in order, then a <velocity> for every joint, "
            "each with a ctrlrange [rad/s, for slides m/s]; then the <position> of its hand with a "
            "ctrlrange [m]."
        )


def find_link(model: mujoco.MjModel, bodies: list[int], body: int) -> int:
    """Return the index in `bodies` of the link that carries a body; -1 if there is none."""
    while body and body not in bodies:
        body = model.body_parentid[body]
    return bodies.index(body) if body in bodies else -1


def _pose(pos: Sequence[float] | Floats, rotation: Floats) -> Transforms:
    """Return the transform (4, 4) for a position (3,) and a rotation matrix of 9 entries."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation.reshape(3, 3), pos
    return T


def _joint_frame(model: mujoco.MjModel, data: mujoco.MjData, joint: int) -> Transforms:
    """Return the frame (4, 4) of a joint in the world, with the joint's axis along z."""
    quaternion, turn = np.zeros(4), np.zeros(9)
    mujoco.mju_quatZ2Vec(quaternion, model.jnt_axis[joint])
    mujoco.mju_quat2Mat(turn, quaternion)
    body = data.xmat[model.jnt_bodyid[joint]].reshape(3, 3)
    return _pose(data.xanchor[joint], body @ turn.reshape(3, 3))


def _read_capsules(
    model: mujoco.MjModel, data: mujoco.MjData, bodies: list[int], links: Transforms, robot: "Robot"
) -> LinkCapsules:
    """Return the capsules of a robot.

    Args:
        model: the compiled MJCF.
        data: state of the model with all joints at 0.
        bodies: bodies of the links.
        links: (N, 4, 4) frames of the links in the world.
        robot: the robot.
    """
    geoms = [find_id(model, "geom", name) for name in robot.capsules]
    carriers = [find_link(model, bodies, model.geom_bodyid[geom]) for geom in geoms]
    ends = np.empty((len(geoms), 2, 3))
    for k, (name, geom, link) in enumerate(zip(robot.capsules, geoms, carriers, strict=True)):
        if model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_CAPSULE:
            raise ConfigError(f"geom {name!r} must be a capsule.")
        if link < 0:
            raise ConfigError(f"geom {name!r} is not part of a link.")
        T = np.linalg.inv(links[link]) @ _pose(data.geom_xpos[geom], data.geom_xmat[geom])
        along = T[:3, 2] * model.geom_size[geom, 1]
        ends[k] = T[:3, 3] - along, T[:3, 3] + along
    # The MJCF's quaternions are rounded.
    return LinkCapsules(np.array(carriers), np.round(ends, 12), model.geom_size[geoms, 0].copy())
