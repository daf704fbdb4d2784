"""Robots that users bring are seen by cameras as distances count them, whoever made their MJCF."""

import warnings
from dataclasses import fields, replace

import mujoco
import numpy as np
import pytest

from hrc_env.core.errors import ConfigError
from hrc_env.env import HRCEnv
from hrc_env.scene.capsule_fit import fit_rods, outside_m, sample_rod
from hrc_env.scene.robot import ROBOTS, find_robot
from hrc_env.scene.robot_chain import parse_mjcf
from hrc_env.scene.robot_import import robot_from_mjcf
from hrc_env.scene.robot_looks import bare_capsules, compare_looks, warn_of_mismatch

SERVOED = """
<mujoco model="servoed">
  <worldbody><body name="foot">
    <geom type="cylinder" size=".09 .05" pos="0 0 .05"/>
    <body name="turret" pos="0 0 .1">
      <joint name="turn" axis="0 0 1" range="-170 170"/>
      <geom type="cylinder" size=".06 .12" pos="0 0 .12" mass="4" contype="0" conaffinity="0"/>
      <geom type="box" size=".3 .3 .3" pos="0 0 .12" mass="0"/>
      <body name="boom" pos="0 0 .25">
        <joint name="lift" axis="0 1 0" range="-100 100"/>
        <geom type="box" size=".04 .04 .22" pos="0 0 .22" mass="3" contype="0" conaffinity="0"/>
        <body name="jib" pos="0 0 .45">
          <joint name="bend" axis="0 1 0" range="-150 150"/>
          <geom type="capsule" size=".04" fromto="0 0 0 0 0 .35" mass="1"/>
          <site name="tip" pos="0 0 .4"/>
        </body>
      </body>
    </body>
  </body></worldbody>
  <actuator>
    <position joint="turn" kp="500"/> <position joint="lift" kp="500"/>
    <position joint="bend" kp="300" forcerange="-80 80"/>
  </actuator>
</mujoco>"""
"""An arm with position servos, looks of its own and a box round its turret that collides."""


@pytest.fixture(scope="module")
def servoed():
    return robot_from_mjcf(SERVOED, home_q=(0.0, 0.5, 1.0))


def moved_m(robot, n_steps=50):
    """How far the tool moves while it is to stand."""
    env = HRCEnv(robot=robot, perception="none", n_workers=0)
    observation, _ = env.reset(seed=0)
    at = [env.split_observation(observation)["tool_position"]]
    for _ in range(n_steps):
        observation = env.step(np.zeros(env.action_space.shape, np.float32))[0]
        at.append(env.split_observation(observation)["tool_position"])
    env.close()
    return float(np.linalg.norm(np.diff(at, axis=0), axis=-1).max())


def test_an_arm_with_position_servos_becomes_a_robot_that_stands_and_moves(servoed):
    assert servoed.joints == ("turn", "lift", "bend")
    assert servoed.tool_site == "tip"
    assert moved_m(servoed) < 1e-3
    env = HRCEnv(robot=servoed, perception="none", n_workers=0)
    env.reset(seed=0)
    before = env.simulation.physics.q.copy()
    for _ in range(25):
        env.step(np.full(3, 0.5, np.float32))
    turned = env.simulation.physics.q - before
    np.testing.assert_allclose(turned, turned[0, 0], atol=0.05)
    assert turned[0, 0] > 0.2
    env.close()


def test_capsules_are_fitted_to_what_is_drawn_not_to_what_collides(servoed):
    found = compare_looks(servoed, spacing_m=0.005)
    assert max(each.outside_m for each in found.values()) < 0.015
    assert max(each.bare_m for each in found.values()) < 0.03
    assert bare_capsules(servoed) == frozenset()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"mjcf": "<mujoco><worldbody/></mujoco>"}, "only hinges and slides"),
        ({"mjcf": SERVOED.replace('axis="0 0 1" range="-170 170"', 'type="ball"')}, "1 ball joint"),
        ({"mjcf": "no_such_file.xml"}, "must be an MJCF"),
        ({"mjcf": "<mujoco><nothing/></mujoco>"}, "must be an MJCF"),
        ({"mjcf": 3}, "mjcf must be a str or Path"),
        ({"tool_site": "tup"}, "Did you mean 'tip'"),
        ({"fastest_rad_s": (1.0, 1.0)}, "one for each of 3 joints"),
        ({"fastest_rad_s": 0.0}, "must be positive"),
    ],
)
def test_what_is_no_serial_arm_is_refused(changes, said):
    with pytest.raises(ConfigError, match=said):
        robot_from_mjcf(**{"mjcf": SERVOED, **changes})


def test_capsules_without_looks_are_drawn(brought):
    bare = ROBOTS["swing_arm"]
    assert bare_capsules(bare) == {"turret", "boom", "jib"}
    pictures = []
    for rgba in ("1 0 0 1", "0 0 1 1"):
        text = bare.mjcf.replace('<geom name="boom"', f'<geom name="boom" rgba="{rgba}"')
        env = HRCEnv(robot=replace(bare, name="tinted", mjcf=text), perception="pixels")
        env.reset(seed=0)
        pictures.append(np.asarray(env.mosaic(), float))
        env.close()
    tiles = [np.abs(a - b).max() for a, b in zip(*map(quarters, pictures), strict=True)]
    assert min(tiles) > 50  # every camera shows it


def quarters(picture):
    """The views of four cameras."""
    h, w = picture.shape[0] // 2, picture.shape[1] // 2
    return [picture[i * h : (i + 1) * h, j * w : (j + 1) * w] for i in (0, 1) for j in (0, 1)]


def test_a_robot_given_directly_is_checked_as_a_registered_one_is():
    arm = ROBOTS["ur10e_like"]
    for changes, said in (
        ({"home_q": (0.0, -1.9, 4.0, -1.8, -1.6, 0.0)}, "outside the joints' ranges"),
        ({"spread_rad": (30.0,) * 6}, "spread_rad must be from 0"),
        ({"watched_capsules": ("tail",)}, "watched"),
        ({"joints": "shoulder_pan"}, "must be a list"),
        ({"capsules": ()}, "must name at least one"),
        ({"mjcf": "<mujoco"}, "cannot be used"),
    ):
        with pytest.raises(ConfigError, match=said):
            find_robot({**{"name": "mine"}, **_fields(arm), **changes})


def _fields(robot):
    return {each.name: getattr(robot, each.name) for each in fields(robot) if each.name != "name"}


def test_rods_hold_the_points_they_are_fitted_to():
    rng = np.random.default_rng(0)
    for size in ((0.3, 0.04, 0.04), (0.1, 0.1, 0.1), (0.3, 0.2, 0.02)):
        points = rng.uniform(-1, 1, (20000, 3))
        points[np.arange(20000), rng.integers(0, 3, 20000)] = rng.choice([-1.0, 1.0], 20000)
        points *= size
        rods = fit_rods(points)
        assert np.min([outside_m(points, rod) for rod in rods], axis=0).max() < 0.02
        for rod in rods:
            np.testing.assert_allclose(outside_m(sample_rod(rod), rod), 0.0, atol=1e-9)


@pytest.mark.parametrize("sticks_out", [False, True])
def test_looks_that_no_capsule_holds_are_told(servoed, sticks_out):
    spec = parse_mjcf(servoed)
    if sticks_out:
        spec.body("jib").add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.05, 0, 0], pos=[0.2, 0, 0.2], mass=0.0
        )
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        warn_of_mismatch(replace(servoed, mjcf=spec.to_xml()))
    assert bool(told) == sticks_out
    assert all("beyond all capsules" in str(each.message) for each in told)
