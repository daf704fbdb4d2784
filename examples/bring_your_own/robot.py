"""A robot of your own: three joints, a torch at the tip. Its file could be a path as well.

python -m hrc_env --import examples/bring_your_own/robot.py play --perception keypoints \
    --robot swing_arm --agent random
"""

import hrc_env
from hrc_env import Robot

LINK = '<inertial pos="0 0 .2" mass="4" diaginertia=".06 .06 .01"/>'
HINGE = 'armature=".5" actuatorfrcrange="-150 150"'
MJCF = f"""
<mujoco model="swing_arm">
  <compiler angle="radian"/>
  <worldbody>
    <body name="foot">
      <geom type="cylinder" size=".1 .05" pos="0 0 .05"/>
      <body name="turret" pos="0 0 .1" gravcomp="1">{LINK}
        <joint name="turn" axis="0 0 1" range="-2.8 2.8" {HINGE}/>
        <geom name="turret" type="capsule" size=".07" fromto="0 0 .1 0 0 .25"/>
        <body name="boom" pos="0 0 .25" gravcomp="1">{LINK}
          <joint name="lift" axis="0 1 0" range="-1 2.2" {HINGE}/>
          <geom name="boom" type="capsule" size=".06" fromto="0 0 0 0 0 .5"/>
          <body name="jib" pos="0 0 .5" gravcomp="1">{LINK}
            <joint name="bend" axis="0 1 0" range="-2.5 2.5" {HINGE}/>
            <geom name="jib" type="capsule" size=".05" fromto="0 0 0 0 0 .45"/>
            <geom type="sphere" size=".03" pos="0 0 .5" rgba="1 .8 .1 1"/>
            <site name="tip" pos="0 0 .5"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <contact><pair geom1="turret" geom2="jib"/></contact>
  <actuator>
    <intvelocity joint="turn" kp="6000" actrange="-2.8 2.8" ctrlrange="-2 2"/>
    <intvelocity joint="lift" kp="6000" actrange="-1 2.2" ctrlrange="-2 2"/>
    <intvelocity joint="bend" kp="6000" actrange="-2.5 2.5" ctrlrange="-3 3"/>
    <velocity joint="turn" kv="400" ctrlrange="-2 2"/>
    <velocity joint="lift" kv="400" ctrlrange="-2 2"/>
    <velocity joint="bend" kv="400" ctrlrange="-3 3"/>
  </actuator>
</mujoco>"""

SWING_ARM = Robot(
    name="swing_arm",
    mjcf=MJCF,
    joints=("turn", "lift", "bend"),
    capsules=("turret", "boom", "jib"),
    watched_capsules=("boom", "jib"),
    tool_site="tip",
    home_q=(0.0, 0.6, 1.2),
    spread_rad=(1.0, 0.2, 0.2),
)
hrc_env.register_robot(SWING_ARM)
