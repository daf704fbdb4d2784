"""Interactive window of MuJoCo, for machines with a display."""

import copy
from typing import Any

import mujoco

from hrc_env.core.errors import RenderingError
from hrc_env.core.records import WorkerMotion
from hrc_env.core.typing import JointAngles
from hrc_env.scene import gl
from hrc_env.scene.build import Scene, drawing_model, find_visuals
from hrc_env.scene.worker_visuals import show_workers


class Viewer:
    """Interactive window that shows one environment.

    Drag the mouse to rotate the view. The environment continues to run after the window is closed.

    Args:
        scene: the scene.
    """

    def __init__(self, scene: Scene) -> None:
        """Open the window.

        Raises:
            RenderingError: no display is available.
        """
        self._model = copy.copy(drawing_model(scene))
        self._data = mujoco.MjData(self._model)
        self._visuals = find_visuals(scene)
        try:
            gl.require_display()  # without a display, launch_passive never returns
            gl.load_triton_first()
            from mujoco import viewer

            self._window: Any = viewer.launch_passive(self._model, self._data)
        except Exception as error:
            raise RenderingError(
                f"MuJoCo's viewer could not be opened: {error}. It needs a display; without one, "
                "record a video instead: python -m hrc_env play --video out/play.mp4"
            ) from error

    def show(self, q: JointAngles, motion: WorkerMotion) -> None:
        """Update the poses of robot and workers in the window.

        Args:
            q: (N,) joint angles of the robot [rad].
            motion: poses of the workers of one environment, arrays (W, S, ...).
        """
        if not self._window.is_running():
            return
        with self._window.lock():
            self._data.qpos[: len(q)] = q
            show_workers(self._model, self._data, self._visuals, motion)
            mujoco.mj_forward(self._model, self._data)
        self._window.sync()

    def close(self) -> None:
        """Close the window."""
        self._window.close()
