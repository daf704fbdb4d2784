"""The simulated world: the only room that imports mujoco."""

from hrc_env.scene import gl

gl.import_mujoco()  # chooses its OpenGL, which it reads at its first import
