"""Import of a `Robot` from the MJCF of any arm, with any servos, visual and collision geoms.

robot = robot_from_mjcf("ur5e/robot.xml", home_q=(0, -1.6, 1.9, -1.9, -1.6, 0))
env = gymnasium.make("HRCReach-v0", robot=robot)

The actuators are replaced by two servos per joint with a common velocity command (`scene.robot`),
and with gains proportional to the inertia that the joint moves; gravity is compensated, as by robot
controllers. Visual geoms are kept, collision geoms are removed from links that have visual ones,
and capsules are fitted to the remaining geoms of each link.
"""

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from hrc_env.core.brought import check_kind, positive
from hrc_env.core.errors import ConfigError, make_unknown_name_error
from hrc_env.core.typing import Floats
from hrc_env.scene.capsule_fit import CELL_M, Rod, fit_rods
from hrc_env.scene.primitives import add_capsule
from hrc_env.scene.robot import Robot
from hrc_env.scene.robot_looks import sample_surface

DAMPING_1_S = 100.0
"""Damping of the rate servos per unit of inertia [1/s]."""
STIFFNESS_1_S2 = 1600.0
"""Stiffness of the holding servos per unit of inertia [1/s^2], for an overdamped natural frequency
of 40 rad/s."""
POSES = 64
"""Number of random poses over which the maximum inertia of each joint is determined."""
LEAST_ARMATURE = 0.1
"""Minimum armature of a joint as a fraction of its maximum inertia, for the stability of light
joints."""
TURN = 2 * np.pi
"""Range in both directions of a joint without limits [rad]."""
HINGE, SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
FREE, BALL = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_BALL)
"""MuJoCo's codes of the types of joints."""


class Chain(NamedTuple):
    """Names of the joints and links of a serial chain in an MJCF."""

    joints: list[str]
    """Names of the joints."""
    links: list[str]
    """Names of the bodies that the joints move."""


def robot_from_mjcf(
    mjcf: str | Path,
    name: str = "",
    *,
    home_q: Sequence[float] = (),
    spread_rad: Sequence[float] | float = 0.3,
    fastest_rad_s: Sequence[float] | float = 2.0,
    tool_site: str = "",
) -> Robot:
    """Make a robot from the MJCF of an arm.

    Args:
        mjcf: path of the file, or its text.
        name: name of the robot in `robot=`; "" for the name of the model.
        home_q: home pose, with one angle for each joint [rad]; () for the first keyframe or, if
            there is none, the centres of the joints' ranges.
        spread_rad: largest deviation of each joint from `home_q` at a reset [rad].
        fastest_rad_s: maximum speed of each joint [rad/s], or [m/s] for slides.
        tool_site: site at the tool point; "" for the last site on the last link or, if there is
            none, the link's origin.

    Raises:
        ConfigError: the MJCF cannot be read, or does not describe a single serial arm of hinges and
            slides.
    """
    check_kind("mjcf", mjcf, str, Path)
    spec = _read(mjcf)
    model = _compile(spec)
    name = name or spec.modelname or "imported"
    joints, links = _find_chain(model, name)
    n = len(joints)
    fastest = _one_a_joint("fastest_rad_s", fastest_rad_s, n)
    for each in fastest:
        positive("fastest_rad_s", each, "rad/s")
    home = tuple(home_q) or _find_home(model, n)
    _keep_files(spec)
    _keep_inertia(spec, model)
    _drop_colliding(spec)
    _replace_servos(spec, model, joints, fastest)
    site = _find_tool(spec, model, links[-1], tool_site)
    capsules = _add_capsules(spec, links)
    names = [each for link in links for each in capsules[link]]
    watched = [each for link in links[n // 2 :] for each in capsules[link]]
    return Robot(
        name=name,
        mjcf=spec.to_xml(),
        joints=tuple(joints),
        capsules=tuple(names),
        watched_capsules=tuple(watched or names),
        tool_site=site,
        home_q=home,
        spread_rad=_limit_spread(_one_a_joint("spread_rad", spread_rad, n), spec, joints),
    )


def _read(mjcf: str | Path) -> mujoco.MjSpec:
    """Read an MJCF as a specification, or raise `ConfigError` if this fails."""
    is_text = isinstance(mjcf, str) and mjcf.lstrip().startswith("<")
    try:
        if is_text:
            return mujoco.MjSpec.from_string(str(mjcf))
        return mujoco.MjSpec.from_file(str(mjcf))
    except ValueError as error:
        source = "This text" if is_text else f"The file {mjcf}"
        raise ConfigError(f"{source} must be an MJCF that MuJoCo can load: {error}") from error


def _compile(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile a specification, or raise `ConfigError` if this fails."""
    try:
        return spec.compile()
    except ValueError as error:
        raise ConfigError(f"The MJCF must compile: {error}") from error


def _describe_joints(model: mujoco.MjModel) -> str:
    """Return the number of joints of each type as text, such as "6 hinge joints"."""
    names = {FREE: "free", BALL: "ball", HINGE: "hinge", SLIDE: "slide"}
    counts = Counter(names[int(kind)] for kind in model.jnt_type)
    return ", ".join(f"{n} {name} joint{'s' * (n > 1)}" for name, n in counts.items()) or "no joint"


def _find_chain(model: mujoco.MjModel, name: str) -> Chain:
    """Return the names of the serial chain, or raise `ConfigError` if the joints form none."""
    kinds = {int(kind) for kind in model.jnt_type}
    if not model.njnt or not kinds <= {HINGE, SLIDE}:
        raise ConfigError(
            f"{name}: an arm must have only hinges and slides and a fixed base; this MJCF has "
            f"{_describe_joints(model)}. Remove free joints, grippers and further arms."
        )
    bodies = model.jnt_bodyid.tolist()
    for before, body in pairwise(bodies):
        up = int(model.body_parentid[body])
        while up and up not in bodies:
            up = int(model.body_parentid[up])
        if up != before or body == before:
            raise ConfigError(
                f"{name}: the joints must be a single chain with one joint per body; "
                f"{model.joint(bodies.index(body)).name!r} does not follow the joint before it. "
                "Remove grippers and further arms from the MJCF."
            )
    names = [model.joint(k).name for k in range(model.njnt)]
    links = [model.body(body).name for body in bodies]
    if not all(names) or not all(links):
        raise ConfigError(f"{name}: joints and the bodies that they move need names.")
    return Chain(names, links)


def _one_a_joint(name: str, value: Sequence[float] | float, n: int) -> tuple[float, ...]:
    """Return an argument as one value per joint, or raise `ConfigError` for a wrong number."""
    values = (float(value),) * n if isinstance(value, int | float) else tuple(value)
    if len(values) != n:
        raise ConfigError(f"{name} must be one number, or one for each of {n} joints, got {value}.")
    return values


def _find_home(model: mujoco.MjModel, n: int) -> tuple[float, ...]:
    """Return the first keyframe of n joints or, if there is none, the centres of their ranges."""
    if model.nkey:
        return tuple(model.key_qpos[0, :n].tolist())
    limited = model.jnt_limited[:n].astype(bool)
    return tuple(np.where(limited, model.jnt_range[:n].mean(-1), 0.0).tolist())


def _limit_spread(
    spread: tuple[float, ...], spec: mujoco.MjSpec, joints: list[str]
) -> tuple[float, ...]:
    """Return the spread of each joint, limited to the width of its range."""
    widths = (float(np.ptp(spec.joint(each).range)) for each in joints)
    return tuple(min(each, width) for each, width in zip(spread, widths, strict=True))


def _keep_files(spec: mujoco.MjSpec) -> None:
    """Make the paths of meshes and textures absolute, because an MJCF text has no location."""
    folder = Path(spec.modelfiledir or ".")
    for parts, subfolder in ((spec.meshes, spec.meshdir), (spec.textures, spec.texturedir)):
        for part in parts:
            if part.file:
                part.file = str((folder / subfolder / part.file).resolve())
    spec.meshdir = spec.texturedir = ""


def _keep_inertia(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Make the inertia of links explicit; the geoms that determine it may be removed later."""
    for body in spec.bodies[1:]:
        k = model.body(body.name).id if body.name else body.id
        body.mass = float(model.body_mass[k])
        body.ipos, body.iquat = model.body_ipos[k], model.body_iquat[k]
        body.inertia, body.explicitinertial, body.gravcomp = model.body_inertia[k], True, 1.0


def _drop_colliding(spec: mujoco.MjSpec) -> None:
    """Delete the collision geoms of bodies that have visual ones; all other geoms become visual."""
    for body in spec.bodies:
        geoms = list(body.geoms)
        visual = [geom for geom in geoms if not (geom.contype or geom.conaffinity)]
        for geom in geoms:
            if visual and geom not in visual:
                spec.delete(geom)
            else:
                geom.mass = 0.0


def _replace_servos(
    spec: mujoco.MjSpec, model: mujoco.MjModel, joints: list[str], fastest: tuple[float, ...]
) -> None:
    """Replace all actuators by the two servos of each joint.

    Args:
        spec: the specification, which is changed.
        model: compiled model of the specification.
        joints: names of the joints.
        fastest: maximum speed of each joint [rad/s].
    """
    most_n = _forces(model)
    inertia = _inertia(model)
    for each in [*spec.actuators, *spec.sensors, *spec.keys, *spec.tendons]:
        spec.delete(each)
    for k, name in enumerate(joints):
        joint = spec.joint(name)
        if not model.jnt_limited[k]:
            joint.range = [-TURN, TURN]
        joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        joint.armature = max(float(model.dof_armature[k]), LEAST_ARMATURE * inertia[k])
        if np.isfinite(most_n[k]):
            joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_TRUE
            joint.actfrcrange = [-most_n[k], most_n[k]]
    for kind in ("hold", "rate"):
        for k, name in enumerate(joints):
            servo = spec.add_actuator(name=f"{name}_{kind}", target=name)
            servo.trntype = mujoco.mjtTrn.mjTRN_JOINT
            if kind == "hold":
                servo.set_to_intvelocity(kp=STIFFNESS_1_S2 * inertia[k])
                servo.actrange = spec.joint(name).range
                servo.actlimited = mujoco.mjtLimited.mjLIMITED_TRUE
            else:
                servo.set_to_velocity(kv=DAMPING_1_S * inertia[k])
            servo.ctrlrange = [-fastest[k], fastest[k]]
            servo.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE


def _inertia(model: mujoco.MjModel) -> Floats:
    """Return the maximum inertia (N,) that each joint moves, over seeded random poses."""
    rng, data = np.random.default_rng(0), mujoco.MjData(model)
    limited = model.jnt_limited.astype(bool)[:, None]
    low, high = np.where(limited, model.jnt_range, [-TURN, TURN]).T
    most, whole = np.zeros(model.nv), np.zeros((model.nv, model.nv))
    for _ in range(POSES):
        data.qpos[:] = rng.uniform(low, high)
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, whole)
        most = np.maximum(most, np.diag(whole))
    return most


def _forces(model: mujoco.MjModel) -> Floats:
    """Return the maximum torque or force (N,) of each joint [N m, N]; infinite if unspecified."""
    most = np.full(model.njnt, np.inf)
    for k in range(model.nu):
        joint = int(model.actuator_trnid[k, 0])
        if model.actuator_forcelimited[k]:
            most[joint] = model.actuator_forcerange[k, 1]
        elif model.actuator_biastype[k] == 0 and model.actuator_ctrllimited[k]:  # a motor
            most[joint] = model.actuator_ctrlrange[k, 1] * model.actuator_gear[k, 0]
    limited = model.jnt_actfrclimited.astype(bool)
    return np.where(limited, np.minimum(most, model.jnt_actfrcrange[:, 1]), most)


def _find_tool(spec: mujoco.MjSpec, model: mujoco.MjModel, last: str, wanted: str) -> str:
    """Return the name of the site at the tool point, which is added if there is none.

    Args:
        spec: the specification.
        model: compiled model of the specification.
        last: name of the last link.
        wanted: name of the site; "" for the last site on the last link.
    """
    names = [site.name for site in spec.sites if site.name]
    if wanted and wanted not in names:
        raise make_unknown_name_error("tool_site", wanted, names)
    if wanted:
        return wanted
    link = model.body(last).id
    carried = [
        model.site(k).name
        for k in range(model.nsite)
        if model.body_rootid[model.site_bodyid[k]] == model.body_rootid[link]
        and _is_on(model, int(model.site_bodyid[k]), link)
    ]
    if carried and carried[-1]:
        return carried[-1]
    spec.body(last).add_site(name="tool", pos=[0, 0, 0])
    return "tool"


def _is_on(model: mujoco.MjModel, body: int, link: int) -> bool:
    """Return whether a body is a given link or is attached to it."""
    while body and body != link:
        body = int(model.body_parentid[body])
    return body == link


def _add_capsules(spec: mujoco.MjSpec, links: list[str]) -> dict[str, list[str]]:
    """Fit capsules to the geoms of each link, add them, and return their names by link."""
    model = _compile(spec)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    bodies = [model.body(link).id for link in links]
    added: dict[str, list[str]] = {}
    for k, (link, body) in enumerate(zip(links, bodies, strict=True)):
        after = bodies[k + 1 :]
        geoms = [
            geom
            for geom in range(model.ngeom)
            if _is_on(model, int(model.geom_bodyid[geom]), body)
            and not any(_is_on(model, int(model.geom_bodyid[geom]), each) for each in after)
        ]
        points = [sample_surface(model, data, geom, CELL_M / 2) for geom in geoms]
        if not points or not sum(map(len, points)):
            added[link] = []
            continue
        world = np.concatenate(points) - data.xpos[body]
        rods: list[Rod] = fit_rods(world @ data.xmat[body].reshape(3, 3))
        added[link] = [f"{link}_capsule_{i}" for i in range(len(rods))]
        for name, rod in zip(added[link], rods, strict=True):
            add_capsule(spec.body(link), rod.start_m, rod.end_m, rod.radius_m, name=name, mass=0.0)
    return added
