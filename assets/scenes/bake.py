"""Write robots, scenes, tasks and props as MJCF and PNG: python -m assets.scenes.bake

The package reads these files only; run this after a change to one of the makers beside it.
"""

import sys
from functools import partial
from pathlib import Path

import mujoco

from assets.robots.hands import CUPS, GRIPPER, SCREWDRIVER
from assets.robots.mobile_base import add_mobile_base
from assets.robots.ur10e_like import add_arm
from assets.scenes import arena, prop_looks, site
from assets.scenes.mjcf import TEXTURES, write_mjcf
from assets.scenes.pedestal import add_pedestal
from assets.scenes.primitives import add_painted, paint_materials
from assets.tasks.drywall import add_drywall
from assets.tasks.handover import add_handover
from assets.tasks.pick_place import add_pick_place
from hrc_env.scene.worker_visuals import PARKED_M
from hrc_env.worker.props import PROP_NAMES

ASSETS = Path(__file__).resolve().parent.parent
ROBOTS = {
    "ur10e_like": partial(add_arm, hand=SCREWDRIVER),
    "ur10e_gripper": partial(add_arm, hand=GRIPPER),
    "ur10e_cups": partial(add_arm, hand=CUPS),
    "mobile_base": add_mobile_base,
}
TASKS = {"drywall": add_drywall, "handover": add_handover, "pick_place": add_pick_place}
MAKERS = {"lab": (arena.add_lab, arena.paint_lab), "site": (site.add_site, site.paint_site)}


def bake(assets: Path) -> None:
    """Write `robots/*.xml`, `tasks/*.xml` and `scenes/*.xml` with their pictures below a folder."""
    for name in ("robots", "scenes", "tasks"):
        (assets / name).mkdir(parents=True, exist_ok=True)
    for name, add in ROBOTS.items():
        robot = mujoco.MjSpec()
        add(robot)
        write_mjcf(robot, assets / "robots" / f"{name}.xml")
    for name, add in TASKS.items():
        things = mujoco.MjSpec()
        add(things)
        write_mjcf(things, assets / "tasks" / f"{name}.xml")
    for name in MAKERS:
        for clutter in (False, True):
            path = assets / "scenes" / f"{name}{'' if clutter else '_bare'}.xml"
            write_mjcf(scene(name, clutter), path, texturedir=TEXTURES)
    write_mjcf(props(), assets / "scenes" / "props.xml", texturedir=TEXTURES)


def scene(name: str, clutter: bool) -> mujoco.MjSpec:
    """A place with the robot's pedestal, with clutter or without."""
    spec, (add, paint) = mujoco.MjSpec(), MAKERS[name]
    add(spec, clutter)
    add_pedestal(spec)
    paint(spec)
    return spec


def props() -> mujoco.MjSpec:
    """A body for each thing that workers hold."""
    spec = mujoco.MjSpec()
    add_painted(spec, prop_looks.PAINTED)
    prop_looks.add_prop_meshes(spec)
    for name in PROP_NAMES[1:]:
        prop_looks.LOOKS[name](spec.worldbody.add_body(name=name, pos=PARKED_M, mocap=True))
    paint_materials(spec, prop_looks.PAINTED)
    return spec


if __name__ == "__main__":
    bake(Path(sys.argv[1]) if len(sys.argv) > 1 else ASSETS)
