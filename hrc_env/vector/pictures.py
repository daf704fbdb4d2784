"""Pictures of many environments: of the present, or of every step since the last `render`."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.typing import Bools
from hrc_env.env import RENDER_MODES
from hrc_env.render.views import Views
from hrc_env.vector.shards import Shards

LISTS = tuple(f"{mode}_list" for mode in RENDER_MODES)
"""Render modes of every step's picture, which `gymnasium.make` adds to one environment."""


class Pictures:
    """Draws the environments of shards in a render mode, `size` (width, height) [px]."""

    def __init__(self, shards: Shards, render_mode: str | None, size: tuple[int, int]) -> None:
        self.render_mode, self.size, self.bounds = render_mode, size, shards.bounds
        self.views = [Views(part) for part in shards.parts]
        self._film: list[list[NDArray[Any]]] = [[] for _ in range(shards.bounds[-1])]
        """Pictures of every environment since its last `of`, in the modes `LISTS`."""

    def of(self, k: int) -> Any:
        """Return environment `k`'s picture, or its list of them, which begins anew; None without a
        mode."""
        if self.render_mode is None:
            return None
        if self.render_mode in LISTS:
            shown, self._film[k] = self._film[k], []
            return shown
        return self._drawn(k)

    def mosaic(self, k: int) -> NDArray[np.uint8]:
        """Return the cameras' pictures of environment `k`, as of `Views`."""
        view, b = self._where(k)
        return view.mosaic(b)

    def of_cameras(self, k: int, width: int, height: int) -> NDArray[np.uint8]:
        """Return what the cameras see of environment `k`, (C, height, width, 3)."""
        view, b = self._where(k)
        return view.of_cameras(width, height, b)

    def take(self, chosen: Bools, anew: Bools) -> None:
        """Keep pictures of the `chosen` environments (B,), and only these of those that start
        `anew`."""
        if self.render_mode not in LISTS:
            return
        for k in np.flatnonzero(chosen).tolist():
            kept = [] if anew[k] else self._film[k]
            self._film[k] = [*kept, self._drawn(k)]

    def close(self) -> None:
        """Release graphics contexts."""
        for view in self.views:
            view.close()

    def _drawn(self, k: int) -> NDArray[Any]:
        view, b = self._where(k)
        return view.picture(str(self.render_mode).startswith("depth"), b, self.size)

    def _where(self, k: int) -> tuple[Views, int]:
        """Return the views of environment `k`'s shard, and its number there."""
        shard = int(np.searchsorted(self.bounds, k, "right")) - 1
        return self.views[shard], k - self.bounds[shard]
