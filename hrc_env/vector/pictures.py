"""Pictures of many environments, of the current step or of all steps since the last `render`."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Bools
from hrc_env.env import RENDER_MODES
from hrc_env.render.views import CameraChoice, Views
from hrc_env.vector.shards import Shards

LISTS = tuple(f"{mode}_list" for mode in RENDER_MODES)
"""Render modes that return a picture of every step, as `gymnasium.make` offers them."""


class LocatedView(NamedTuple):
    """The views of the shard that contains an environment, and its index in the shard."""

    view: Views
    """Views of the shard."""
    b: int
    """Index of the environment in the shard."""


class Pictures:
    """Renderer of pictures of the environments in shards.

    Args:
        shards: simulations of the environments.
        render_mode: form of the pictures; None if no pictures are rendered.
        size: width and height of the pictures [px].
        shown: the arguments `markers` and `capsules` of `Views.picture`, by name.
    """

    def __init__(
        self,
        shards: Shards,
        render_mode: str | None,
        size: tuple[int, int],
        shown: Mapping[str, bool],
    ) -> None:
        self.render_mode, self.size, self.bounds = render_mode, size, shards.bounds
        self.shown = dict(shown)
        self.views = [Views(part) for part in shards.parts]
        self._film: list[list[NDArray[Any]]] = [[] for _ in range(shards.bounds[-1])]
        """Pictures of each environment since the last call of `of`, in the modes `LISTS`."""

    def of(self, k: int, camera: CameraChoice = None) -> Any:
        """Return the picture of environment `k`, or its list of pictures, which is then cleared.

        Args:
            k: index of the environment.
            camera: camera of the picture, as for `Views.picture`; must be None for lists.

        Returns:
            The picture or the list; None without a render mode.

        Raises:
            ConfigError: the camera does not exist, or a camera was given for a list.
        """
        if self.render_mode is None:
            return None
        if self.render_mode in LISTS:
            if camera is not None:
                raise ConfigError(
                    f"render_mode={self.render_mode!r} records pictures from the default "
                    f"viewpoint: leave out camera={camera!r}, or use one of "
                    f"{', '.join(RENDER_MODES)}."
                )
            shown, self._film[k] = self._film[k], []
            return shown
        return self._draw(k, camera)

    def mosaic(self, k: int) -> NDArray[np.uint8]:
        """Return a mosaic of the cameras' images of environment `k` with crops and skeletons."""
        view, b = self._locate(k)
        return view.mosaic(b)

    def take(self, mask: Bools, is_first: Bools) -> None:
        """Add a picture of the current step to the lists, in the modes `LISTS`.

        Args:
            mask: (B,) mask of the environments for which a picture is added.
            is_first: (B,) whether the step is the first of an episode, which clears the list.
        """
        if self.render_mode not in LISTS:
            return
        for k in np.flatnonzero(mask).tolist():
            kept = [] if is_first[k] else self._film[k]
            self._film[k] = [*kept, self._draw(k)]

    def close(self) -> None:
        """Free the graphics contexts."""
        for view in self.views:
            view.close()

    def _draw(self, k: int, camera: CameraChoice = None) -> NDArray[Any]:
        """Return a picture of environment `k`."""
        view, b = self._locate(k)
        is_depth = str(self.render_mode).startswith("depth")
        return view.picture(is_depth, b, self.size, camera=camera, **self.shown)

    def _locate(self, k: int) -> LocatedView:
        """Return the views of the shard with environment `k`, and the environment's index in it."""
        shard = int(np.searchsorted(self.bounds, k, "right")) - 1
        return LocatedView(self.views[shard], k - self.bounds[shard])
