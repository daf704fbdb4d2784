"""What stands, lies, shines or looks on in a scene and is wrong in one thing only is refused."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.scene.build import build
from hrc_env.scene.domain_randomization import MOST_LITTER, AppearanceConfig
from hrc_env.scene.objects import find_objects
from hrc_env.scene.physics import Physics, make_empty_path
from hrc_env.scene.places import find_obstacles
from hrc_env.scene.primitives import DECORATION, SOLID
from hrc_env.scene.rig import select

CAMERAS = tuple(CameraConfig(f"c{k}", (float(k), 1.0, 2.0)) for k in range(17))
TWO = CAMERAS[:2]


@pytest.mark.parametrize(
    ("use", "chosen"),
    [(None, (0, 1)), ((1, 0), (1, 0)), (["c1"], (1,)), (("c0", 1), (0, 1)), (range(2), (0, 1))],
)
def test_cameras_are_chosen_by_name_or_index(use, chosen):
    assert select(TWO, use) == tuple(TWO[k] for k in chosen)


@pytest.mark.parametrize(
    ("cameras", "use", "said"),
    [
        ((*TWO, replace(CAMERAS[5], name="c0")), None, "must be unique, got 'c0'"),
        ((*TWO, replace(CAMERAS[5], name="c0")), (1,), "must be unique, got 'c0'"),
        (TWO, "c0", "must be a list of names or indices, got 'c0'"),
        (TWO, 0, "must be a list of names or indices, got 0"),
        (TWO, (), "needs at least one camera"),
        ((), None, "needs at least one camera"),
        (TWO, (2,), "from 0 to 1"),
        (TWO, (-1,), "from 0 to 1"),
        (TWO, (True,), "from 0 to 1"),
        (TWO, ("c2",), "Unknown camera 'c2'"),
        (TWO, (0, "c0"), "'c0' is chosen more than once"),
        (TWO, (1, 0, 1), "'c1' is chosen more than once"),
        (CAMERAS, None, "1 to 16 cameras, got 17"),
    ],
)
def test_a_choice_of_cameras_in_which_one_thing_is_wrong_is_refused(cameras, use, said):
    with pytest.raises(ConfigError, match=said):
        select(cameras, use)


def test_a_rig_has_as_many_as_16_cameras():
    assert select(CAMERAS[:16]) == CAMERAS[:16]
    assert len(select(CAMERAS, range(1, 17))) == 16


BOX = '<geom type="box" size=".1 .2 .3" contype="16"/>'
ABOVE, BELOW = (f'<geom type="box" size=".1 .1 .1" contype="16" pos="{z}"/>'
                for z in ("0 0 .2", "0 0 -.2"))  # fmt: skip
BALL = '<geom type="sphere" size=".1" contype="{bit}" conaffinity="0" pos="{at}"/>'


def body_of(*geoms: str) -> mujoco.MjSpec:
    """Return what a task adds: one loose body of these geoms."""
    body = f'<body name="it"><freejoint/>{"".join(geoms)}</body>'
    return mujoco.MjSpec.from_string(f"<mujoco><worldbody>{body}</worldbody></mujoco>")


@pytest.mark.parametrize(
    "geoms",
    [(BOX,), (ABOVE, BELOW), (BOX, BALL.format(bit=0, at="0 0 3")),
     (BOX.replace("/>", ' pos="0 0 4e-7"/>'),)],
)  # fmt: skip
def test_an_object_of_boxes_round_its_origin_is_taken(geoms):
    assert find_objects(body_of(*geoms), 0).names == ("it",)


@pytest.mark.parametrize(
    ("geoms", "said"),
    [
        ((), "must be of boxes"),
        ((BOX.replace("16", "1"),), "must be of boxes"),
        ((BALL.format(bit=16, at="0 0 0"),), "must be of boxes"),
        ((BOX, BALL.format(bit=16, at="0 0 0")), "must be of boxes"),
        ((BALL.format(bit=16, at="0 0 0"), BOX), "must be of boxes"),
        ((ABOVE,), "must have its center at its origin"),
        ((BELOW,), "must have its center at its origin"),
        ((BOX.replace("/>", ' pos="6e-7 0 0"/>'),), "must have its center at its origin"),
        ((BOX, BOX.replace("/>", ' pos="0 0 .05"/>')), "must have its center at its origin"),
    ],
)
def test_an_object_in_which_one_thing_is_wrong_is_refused(geoms, said):
    geoms = geoms or ('<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>',)
    with pytest.raises(ConfigError, match=rf"'it' {said}"):
        find_objects(body_of(*geoms), 0)


def standing(kind: str, parent: str = '<body name="foot">', group: int = SOLID) -> mujoco.MjModel:
    """Return a scene in which one thing of a kind stands on a body."""
    geom = f'<geom name="it" type="{kind}" size=".1 .1 .1" group="{group}"/>'
    return mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody>{parent}{geom}</body></worldbody></mujoco>"
    )


MOVING = '<body name="foot"><joint type="slide" axis="1 0 0"/>'


@pytest.mark.parametrize("kind", ["box", "sphere", "capsule", "cylinder"])
def test_what_stands_still_blocks_sight(kind):
    assert len(find_obstacles(standing(kind))) == 1
    assert len(find_obstacles(standing(kind, MOVING, DECORATION))) == 0


@pytest.mark.parametrize(
    ("kind", "parent"), [("ellipsoid", '<body name="foot">'), ("box", MOVING), ("sphere", MOVING)]
)
def test_what_moves_or_is_of_another_kind_does_not_block_sight(kind, parent):
    with pytest.raises(HRCError, match="'it' cannot block lines of sight"):
        find_obstacles(standing(kind, parent))


SHARES = ("warmth", "untextured", "tint", "clothing", "skin", "hat")
LOOKS = [
    ("light", (0.05, 0.05), (0.0499, 1.0)),
    ("light", (3.0, 3.0), (1.0, 3.0001)),
    ("light", (0.05, 3.0), (1.0001, 1.0)),
    ("light_turn_deg", 180.0, 180.0001),
    ("light_tilt_deg", 60.0, 60.0001),
    ("litter", MOST_LITTER, MOST_LITTER + 1),
    ("litter", 0, -1),
    *((name, 1.0, 1.0001) for name in SHARES),
    *((name, 0.0, -1e-9) for name in (*SHARES, "light_turn_deg", "light_tilt_deg")),
]


@pytest.mark.parametrize(("name", "taken", "refused"), LOOKS)
def test_looks_end_where_they_say(name, taken, refused):
    assert getattr(AppearanceConfig(**{name: taken}), name) == taken
    with pytest.raises(ConfigError, match=name):
        AppearanceConfig(**{name: refused})


def test_physics_are_of_one_environment_or_more():
    scene = build()
    assert Physics(scene, 1).batch == 1
    for batch in (0, -1):
        with pytest.raises(ConfigError, match=f"at least one environment, got {batch}"):
            Physics(scene, batch)


@pytest.mark.parametrize("alone", [False, True])
def test_physics_that_break_down_are_told_of_beside_workers_and_without(alone):
    """Whichever simulation of an environment went on: both are looked at."""
    physics = Physics(build(), 2)
    state = physics.get_state()
    state[1] = 1e12
    physics.set_state(state)
    away = np.full(2, alone)
    with pytest.raises(HRCError, match="physics of environment 1 became unstable"):
        physics.step(np.zeros((2, 6)), make_empty_path(2, 5), out_of_reach=away)
