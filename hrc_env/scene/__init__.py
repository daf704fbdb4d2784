"""The simulated world, the only subpackage that imports MuJoCo."""

from hrc_env.scene import gl

gl.import_mujoco()  # choose the OpenGL backend before mujoco reads it
