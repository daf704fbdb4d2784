"""Arrays that are recorded at each moment of an episode: selected infos, poses and keypoints."""

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
"""Name of the projection matrices, which are recorded with keypoints if the rig of cameras is
sampled in every episode."""
Moment = dict[str, NDArray[Any]]
"""Arrays (B, ...) by name; names from belief and truth begin with "belief/" and "truth/"."""


@dataclass(frozen=True, slots=True)
class MomentParts:
    """Selection of the parts of a moment to record."""

    infos: tuple[str, ...] = ()
    """Names of the infos to record."""
    poses: bool = False
    """Whether to record the workers' joints, estimated and true."""
    keypoints: bool = False
    """Whether to record the keypoints that the estimator receives."""

    def read(self, env: HRCVectorEnv, info: Mapping[str, Any]) -> Moment:
        """Return the arrays of the current moment of every environment.

        Args:
            env: the environments.
            info: the infos of the environments' last step or reset.
        """
        moment = {add_folder(name): np.array(info[name]) for name in self.infos}
        parts = [dict(self._read_part(part)) for part in env.shards.parts]
        for name in parts[0]:
            moment[name] = np.concatenate([part[name] for part in parts])
        return moment

    def _read_part(self, part: Simulation) -> Iterator[tuple[str, NDArray[Any]]]:
        if self.poses:
            yield from _read_poses(part)
        if self.keypoints:
            keypoints = part.pipeline.measurements
            for name in ("px", "confidence", "sigma_px", "time_s"):
                if (value := getattr(keypoints, name)) is not None:
                    yield f"keypoints/{name}", value.copy()
            if part.cameras.are_drawn:
                yield f"keypoints/{PROJECTIONS}", part.cameras.projections()


def add_folder(name: str) -> str:
    """Return the name of an info with the prefix "belief/" or "truth/"."""
    return f"{'belief' if is_of_belief(name) else 'truth'}/{name}"


def _read_poses(part: Simulation) -> Iterator[tuple[str, NDArray[Any]]]:
    estimate, present = part.estimate, part.present
    believed = {
        "joints_world": estimate.mean_world, "joints_cov_world": estimate.cov_world,
        "joints_velocity_world": estimate.velocity_world, "age_s": estimate.age_s,
        "tracked": estimate.tracked, "unknown": estimate.unknown,
    }  # fmt: skip
    for name, value in believed.items():
        yield f"belief/{name}", value.copy()
    workers = worker_truth(part.bodies, generator.current(part.motion, np.arange(part.batch)))
    joints = np.where(present[..., None, None], workers.joints_world, np.nan)
    yield "truth/joints_world", joints
    yield "truth/present", present.copy()
