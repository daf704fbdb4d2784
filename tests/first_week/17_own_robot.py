"""A robot of one's own from its MJCF, in a built-in task, single and in batches."""

import gymnasium
import numpy as np

import hrc_env

LINK = '<inertial pos="0 0 .2" mass="4" diaginertia=".06 .06 .01"/>'
MJCF = f"""
<mujoco model="post_arm">
  <compiler angle="radian"/>
  <worldbody>
    <body name="foot">
      <geom type="cylinder" size=".1 .05" pos="0 0 .05"/>
      <body name="turret" pos="0 0 .1" gravcomp="1">{LINK}
        <joint name="turn" axis="0 0 1" range="-2.8 2.8" armature=".5"/>
        <geom type="capsule" size=".07" fromto="0 0 .1 0 0 .25"/>
        <body name="boom" pos="0 0 .25" gravcomp="1">{LINK}
          <joint name="lift" axis="0 1 0" range="-1 2.2" armature=".5"/>
          <geom type="capsule" size=".06" fromto="0 0 0 0 0 .5"/>
          <body name="jib" pos="0 0 .5" gravcomp="1">{LINK}
            <joint name="bend" axis="0 1 0" range="-2.5 2.5" armature=".5"/>
            <geom type="capsule" size=".05" fromto="0 0 0 0 0 .45"/>
            <site name="tip" pos="0 0 .5"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="turn" kp="600" forcerange="-150 150"/>
    <position joint="lift" kp="600" forcerange="-150 150"/>
    <position joint="bend" kp="600" forcerange="-150 150"/>
  </actuator>
</mujoco>"""
robot = hrc_env.robot_from_mjcf(MJCF, home_q=(0.0, 0.6, 1.2))
hrc_env.register_robot(robot)

arguments = {"perception": "keypoints", "robot": "post_arm"}
one = gymnasium.make("HRCReach-v0", **arguments)
many = gymnasium.make_vec("HRCReach-v0", num_envs=2, **arguments)
assert one.action_space.shape == (3,)
seen, _ = many.reset(seed=[3, 4])
np.testing.assert_array_equal(seen[1], one.reset(seed=4)[0])
for _ in range(20):
    action = many.action_space.sample()
    seen, *_ = many.step(action)
    np.testing.assert_array_equal(seen[1], one.step(action[1])[0])

for wrong, words in (({"robot": "post_am"}, "post_arm"), ({"robot": 3}, "robot")):
    try:
        gymnasium.make("HRCReach-v0", perception="truth", **wrong)
    except hrc_env.ConfigError as error:
        if words not in str(error):
            raise
