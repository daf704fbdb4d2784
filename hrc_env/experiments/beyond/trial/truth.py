"""What is true of the workers: whose track is whose, and how many cameras see them."""

from itertools import permutations

import numpy as np

from hrc_env.core.typing import Bools, Ints, Points3
from hrc_env.experiments.beyond.trial.setting import Turn
from hrc_env.perception.emulator import lines_of_sight
from hrc_env.perception.sightlines import SEEN
from hrc_env.pipeline.sensor_input import TrueSensorInput
from hrc_env.scene.build import Scene


def matched(mean_world: Points3, tracked: Bools, joints_world: Points3) -> Ints:
    """(B, W) the track of each worker: those that fit best together, no track twice.

    Args:
        mean_world: (B, W, J, 3) tracks [m].
        tracked: (B, W) whether they follow anybody; those that do choose first.
        joints_world: (B, W, J, 3) workers [m].
    """
    n_workers = tracked.shape[1]
    off = np.linalg.norm(mean_world[:, None] - joints_world[:, :, None], axis=-1).mean(-1)
    cost = np.where(tracked[:, None], off, 0.0)  # (B, worker, track)
    orders = np.array(list(permutations(range(n_workers))))
    totals = cost[:, np.arange(n_workers), orders].sum(-1)
    return orders[totals.argmin(1)]


def n_seeing(now: TrueSensorInput, scene: Scene, turn: Turn) -> Ints:
    """(B, W, J) cameras that have a free line of sight to each joint and are not lost for good."""
    surroundings = scene.surroundings(now.q, now.motion.held)
    sight, _ = lines_of_sight(now.truth, surroundings, scene.cameras)
    gone = {name for fault in turn.faults if fault.kind == "lost" for name in fault.cameras}
    left = np.array([camera.name not in gone for camera in scene.cameras])
    return (sight[:, left] == SEEN).sum(1)
