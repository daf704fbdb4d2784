"""A model that is being built (an MjSpec) as MJCF text: every number with all of its digits.

Writes what the builders here use, and leaves out what has MuJoCo's default value.
"""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
from PIL import Image

GEOM_FIELDS = (
    "pos", "quat", "contype", "conaffinity", "condim", "priority", "group", "density", "friction",
    "solref", "solimp", "rgba",
)  # fmt: skip
KINDS = {
    getattr(mujoco.mjtGeom, f"mjGEOM_{name.upper()}"): (name, n_sizes)
    for name, n_sizes in (
        ("plane", 3), ("box", 3), ("ellipsoid", 3), ("sphere", 1), ("capsule", 2), ("cylinder", 2),
        ("mesh", 0),
    )
}  # fmt: skip
"""Name and number of sizes."""
TEXTURES = "textures"


def write_mjcf(spec: Any, path: Path, **compiler: str) -> None:
    """Write a model to `path`, and its pictures beside it to `textures/`."""
    root = ElementTree.Element("mujoco", model=path.stem)
    ElementTree.SubElement(root, "compiler", angle="radian", **compiler)
    _add_visual(root, spec)
    assets = ElementTree.SubElement(root, "asset")
    for texture in spec.textures:
        _add_texture(assets, texture, path.parent / TEXTURES)
    for material in spec.materials:
        _add_material(assets, material)
    for mesh in spec.meshes:
        ElementTree.SubElement(
            assets, "mesh", name=mesh.name, inertia="shell",
            vertex=_text(mesh.uservert), face=_text(mesh.userface),
        )  # fmt: skip
    world = ElementTree.SubElement(root, "worldbody")
    for light in spec.worldbody.lights:
        _add_light(world, light)
    _add_content(world, spec.worldbody)
    _add_contacts(root, spec)
    _add_couplings(root, spec)
    _add_actuators(root, spec)
    for sensor in spec.sensors:
        gauges = ElementTree.SubElement(root, "sensor")
        ElementTree.SubElement(gauges, "force", name=sensor.name, site=sensor.objname)
    ElementTree.indent(root)
    path.write_text(ElementTree.tostring(root, encoding="unicode") + "\n")


def _add_visual(root: ElementTree.Element, spec: Any) -> None:
    """Extent and light; only of scenes, which have lights."""
    if not spec.worldbody.lights:
        return
    ElementTree.SubElement(
        root, "statistic", extent=_text(spec.stat.extent), center=_text(spec.stat.center)
    )
    visual, head, clip = ElementTree.SubElement(root, "visual"), spec.visual.headlight, {}
    for name in ("ambient", "diffuse", "specular"):
        clip[name] = _text(getattr(head, name))
    ElementTree.SubElement(visual, "headlight", clip)
    names = ("znear", "zfar", "shadowscale", "shadowclip")
    planes = {name: _text(getattr(spec.visual.map, name)) for name in names}
    ElementTree.SubElement(visual, "map", planes)


def _add_texture(assets: ElementTree.Element, texture: Any, folder: Path) -> None:
    skybox = texture.type == mujoco.mjtTexture.mjTEXTURE_SKYBOX
    if texture.builtin != mujoco.mjtBuiltin.mjBUILTIN_NONE:
        ElementTree.SubElement(
            assets, "texture", name=texture.name, type="skybox", builtin="gradient",
            rgb1=_text(texture.rgb1), rgb2=_text(texture.rgb2),
            width=str(texture.width), height=str(texture.height),
        )  # fmt: skip
        return
    file = f"{texture.name}.png"
    given = {"name": texture.name, "type": "skybox" if skybox else "2d", "file": file}
    if skybox:
        given |= {"gridsize": "6 1", "gridlayout": "RLUDFB"}
    ElementTree.SubElement(assets, "texture", given)
    pixels = np.frombuffer(bytes(texture.data), np.uint8)
    write_png(folder / file, pixels.reshape(texture.height, texture.width, 3))


def write_png(path: Path, pixels: np.ndarray) -> None:
    """Write (H, W, 3) as small as PNG has it without a change: grey, by a palette or in full."""
    path.parent.mkdir(exist_ok=True)
    image = Image.fromarray(pixels)
    colours, index = np.unique(pixels.reshape(-1, 3), axis=0, return_inverse=True)
    if (colours == colours[:, :1]).all():
        image = Image.fromarray(np.ascontiguousarray(pixels[..., 0]))
    elif len(colours) <= 256:
        image = Image.fromarray(index.reshape(pixels.shape[:2]).astype(np.uint8), "P")
        image.putpalette(colours.ravel().tolist())
    image.save(path, optimize=True)


def _add_material(assets: ElementTree.Element, material: Any) -> None:
    given = {"name": material.name}
    picture = material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB]
    if picture:
        given["texture"] = picture
    empty = mujoco.MjSpec()  # its parts do not keep it
    default = empty.add_material()
    given |= _changed(material, default, ("rgba", "specular", "shininess", "emission"))
    ElementTree.SubElement(assets, "material", given)


def _add_light(world: ElementTree.Element, light: Any) -> None:
    names = ("pos", "dir", "diffuse", "specular", "ambient")
    ElementTree.SubElement(
        world, "light", name=light.name, type="directional",
        castshadow=str(bool(light.castshadow)).lower(),
        **{name: _text(getattr(light, name)) for name in names},
    )  # fmt: skip


def _add_content(parent: ElementTree.Element, body: Any) -> None:
    """Geoms, sites and bodies in a body."""
    for joint in body.joints:
        _add_joint(parent, joint)
    for geom in body.geoms:
        _add_geom(parent, geom)
    empty = mujoco.MjSpec()  # its parts do not keep it
    plain = empty.worldbody.add_site()
    for site in body.sites:
        ElementTree.SubElement(
            parent, "site", name=site.name, pos=_text(site.pos), size=_text(site.size[0]),
            group=str(site.group), **_changed(site, plain, ("quat",)),
        )  # fmt: skip
    for child in body.bodies:
        _add_body(parent, child)


def _add_joint(parent: ElementTree.Element, joint: Any) -> None:
    """One that is free, a hinge or a slide with a range."""
    if joint.type == mujoco.mjtJoint.mjJNT_FREE:
        ElementTree.SubElement(parent, "freejoint", name=joint.name)
        return
    given = {"name": joint.name, "axis": _text(joint.axis), "range": _text(joint.range)}
    given["armature"] = _text(joint.armature)
    if joint.type == mujoco.mjtJoint.mjJNT_SLIDE:
        given |= {"type": "slide", "damping": _text(joint.damping[0])}
    if joint.actfrclimited == 1:
        given["actuatorfrcrange"] = _text(joint.actfrcrange)
    ElementTree.SubElement(parent, "joint", given)


def _add_body(parent: ElementTree.Element, body: Any) -> None:
    empty = mujoco.MjSpec()  # its parts do not keep it
    default = empty.worldbody.add_body()
    given = {"name": body.name} if body.name else {}
    if body.mocap:
        given["mocap"] = "true"
    element = ElementTree.SubElement(
        parent, "body", given | _changed(body, default, ("pos", "quat", "gravcomp"))
    )
    if body.explicitinertial:
        ElementTree.SubElement(
            element, "inertial", mass=_text(body.mass), pos=_text(body.ipos),
            quat=_text(body.iquat), diaginertia=_text(body.inertia),
        )  # fmt: skip
    _add_content(element, body)


def _add_geom(parent: ElementTree.Element, geom: Any) -> None:
    empty = mujoco.MjSpec()  # its parts do not keep it
    default = empty.worldbody.add_geom()
    kind, n_sizes = KINDS[geom.type]
    given = {"name": geom.name} if geom.name else {}
    given["type"] = kind
    if n_sizes:
        given["size"] = _text(geom.size[:n_sizes])
    if geom.meshname:
        given["mesh"] = geom.meshname
    if geom.material:
        given["material"] = geom.material
    given |= _changed(geom, default, GEOM_FIELDS)
    if np.isfinite(geom.mass):
        given["mass"] = _text(geom.mass)
    if not geom.castshadow:
        given["castshadow"] = "false"
    ElementTree.SubElement(parent, "geom", given)


def _add_contacts(root: ElementTree.Element, spec: Any) -> None:
    if not spec.pairs:
        return
    contacts = ElementTree.SubElement(root, "contact")
    for pair in spec.pairs:
        ElementTree.SubElement(contacts, "pair", geom1=pair.geomname1, geom2=pair.geomname2)


def _add_couplings(root: ElementTree.Element, spec: Any) -> None:
    """Joints that move together, and tendons that are means of joints."""
    for tendon in spec.tendons:
        element = ElementTree.SubElement(ElementTree.SubElement(root, "tendon"), "fixed")
        element.set("name", tendon.name)
        for wrap in tendon.path:
            ElementTree.SubElement(element, "joint", joint=wrap.target.name, coef=_text(wrap.coef))
    for each in spec.equalities:
        ElementTree.SubElement(
            ElementTree.SubElement(root, "equality"), "joint", name=each.name, joint1=each.name1,
            joint2=each.name2, polycoef=_text(each.data[:5]), solref=_text(each.solref),
        )  # fmt: skip


def _add_actuators(root: ElementTree.Element, spec: Any) -> None:
    """Those that integrate their command, those that follow it, and those that hold a position."""
    if not spec.actuators:
        return
    actuators = ElementTree.SubElement(root, "actuator")
    for servo in spec.actuators:
        is_tendon = servo.trntype == mujoco.mjtTrn.mjTRN_TENDON
        given = {"name": servo.name, "tendon" if is_tendon else "joint": servo.target}
        given["ctrlrange"] = _text(servo.ctrlrange)
        if servo.biastype == mujoco.mjtBias.mjBIAS_AFFINE and is_tendon:
            given |= {"kp": _text(servo.gainprm[0]), "kv": _text(-servo.biasprm[2])}
            given["forcerange"] = _text(servo.forcerange)
            ElementTree.SubElement(actuators, "position", given)
        elif servo.dyntype == mujoco.mjtDyn.mjDYN_INTEGRATOR:
            given |= {"kp": _text(servo.gainprm[0]), "actrange": _text(servo.actrange)}
            ElementTree.SubElement(actuators, "intvelocity", given)
        else:
            ElementTree.SubElement(actuators, "velocity", given | {"kv": _text(servo.gainprm[0])})


def _changed(thing: Any, default: Any, names: tuple[str, ...]) -> dict[str, str]:
    """The fields that have another value than MuJoCo's default."""
    return {
        name: _text(getattr(thing, name))
        for name in names
        if not np.array_equal(getattr(thing, name), getattr(default, name))
    }


def _text(values: Any) -> str:
    """Numbers as they are read again to the bit."""
    flat = np.asarray(values).ravel().tolist()
    return " ".join(str(int(x)) if float(x).is_integer() else repr(x) for x in flat)
