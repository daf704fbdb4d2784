"""The simulated world: the only room that imports mujoco."""

from hrc_env.scene import gl

gl.choose_backend()  # before mujoco's first import, which reads MUJOCO_GL
