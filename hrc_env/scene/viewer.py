"""MuJoCo's interactive window, for machines with a display."""

import copy
from typing import Any

import mujoco

from hrc_env.core.errors import RenderingError
from hrc_env.core.records import WorkerMotion
from hrc_env.core.typing import JointAngles
from hrc_env.scene import gl
from hrc_env.scene.build import Scene, drawing_model, visuals
from hrc_env.scene.worker_visuals import show_workers


class Viewer:
    """A window that shows one environment; drag to look round, close it to go on without."""

    def __init__(self, scene: Scene) -> None:
        """Open the window. Raises `RenderingError` where there is no display."""
        self._model = copy.copy(drawing_model(scene))
        self._data = mujoco.MjData(self._model)
        self._visuals = visuals(scene)
        try:
            gl.require_display()  # without one launch_passive would wait for ever
            gl.load_triton_first()
            from mujoco import viewer

            self._window: Any = viewer.launch_passive(self._model, self._data)
        except Exception as error:
            raise RenderingError(
                f"MuJoCo's viewer could not be opened: {error}. It needs a display; without "
                "one, film the episode instead: python -m hrc_env play --video out/play.mp4"
            ) from error

    def show(self, q: JointAngles, motion: WorkerMotion) -> None:
        """Pose the scene: arm q (N,) and the workers of one environment (W, S, ...)."""
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
