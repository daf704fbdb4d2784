"""Parts of every moment of recorded episodes: chosen infos, poses, keypoints."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.infos import is_of_belief
from hrc_env.motion import generator
from hrc_env.simulation import Simulation
from hrc_env.vector.env import HRCVectorEnv
from hrc_env.worker.body import worker_truth

PROJECTIONS = "P"
"""Name of the projections of cameras beside keypoints, where every episode's rig is drawn."""
Moment = dict[str, NDArray[Any]]
"""Arrays (B, ...) by name; belief and truth have names of their own, "belief/..." and so on."""


@dataclass(frozen=True, slots=True)
class Kept:
    """The parts of a moment that are kept."""

    infos: tuple[str, ...] = ()
    """Names of infos."""
    poses: bool = False
    """Whether the workers' joints are, as believed and as they are."""
    keypoints: bool = False
    """Whether the keypoints that the estimator was given are."""

    def of(self, env: HRCVectorEnv, info: Mapping[str, Any]) -> Moment:
        """Return the present moment of every environment, with the infos of its step or reset."""
        moment = {grouped(name): np.array(info[name]) for name in self.infos}
        parts = [dict(self._of_part(part)) for part in env.shards.parts]
        for name in parts[0]:
            moment[name] = np.concatenate([part[name] for part in parts])
        return moment

    def _of_part(self, part: Simulation) -> Iterator[tuple[str, NDArray[Any]]]:
        if self.poses:
            yield from _poses(part)
        if self.keypoints:
            found = part.pipeline.measurements
            for name in ("px", "confidence", "sigma_px", "time_s"):
                if (value := getattr(found, name)) is not None:
                    yield f"keypoints/{name}", value.copy()
            if part.cameras.are_drawn:
                yield f"keypoints/{PROJECTIONS}", part.cameras.projections()


def grouped(name: str) -> str:
    """Return the name of an info behind "belief/" or "truth/", by what it is of."""
    return f"{'belief' if is_of_belief(name) else 'truth'}/{name}"


def _poses(part: Simulation) -> Iterator[tuple[str, NDArray[Any]]]:
    now, present = part.estimate, part.present
    believed = {
        "joints_world": now.mean_world, "joints_cov_world": now.cov_world,
        "joints_velocity_world": now.velocity_world, "age_s": now.age_s,
        "tracked": now.tracked, "unknown": now.unknown,
    }  # fmt: skip
    for name, value in believed.items():
        yield f"belief/{name}", value.copy()
    workers = worker_truth(part.bodies, generator.current(part.motion, np.arange(part.batch)))
    joints = np.where(present[..., None, None], workers.joints_world, np.nan)
    yield "truth/joints_world", joints
    yield "truth/present", present.copy()
