"""Who takes part in what a robot does with its hand, told from estimated bodies."""

import numpy as np

from hrc_env.core.records import PoseEstimate
from hrc_env.core.skeleton import HAND_SEGMENTS, TORSO
from hrc_env.core.typing import Bools, Capsules
from hrc_env.geometry.distances import least_separation, segments
from hrc_env.world import FOOT_WORLD

ARMS = ((6, 14), (7, 15))
"""Forearm and hand of either side, among `geometry.distances.segments`."""
STANDS_M = 0.6
"""Whose trunk is so near to above where a task has its worker stand takes part [m]."""


def partners_arms(
    estimate: PoseEstimate, stands_m: tuple[float, float], place_world: Capsules, within_m: float
) -> Bools:
    """(B, W, S) of each environment's partner, forearms and hands whose hand is near a place.

    A partner is the tracked worker who stands where the task has them, and of several the one whose
    hand is nearest to the place.

    Args:
        estimate: of the workers.
        stands_m: where the task has them stand, from the robot's foot, x and y [m].
        place_world: (B, 2, 3) the ends of where they work [m].
        within_m: how near a hand is that takes part [m].
    """
    bodies, trunk = segments(estimate.mean_world), estimate.mean_world[:, :, TORSO, :2].mean(2)
    off_m = np.linalg.norm(trunk - (FOOT_WORLD[:2] + stands_m), axis=-1)
    hands = bodies[:, :, -len(HAND_SEGMENTS) :, None]
    away_m = least_separation(place_world[:, None], np.zeros(1), hands, np.zeros(1)).distance_m
    may = estimate.tracked & (off_m < STANDS_M)
    away_m = np.where(may[..., None], away_m, np.inf)
    nearest = away_m.min(axis=(1, 2), initial=np.inf)[:, None]
    near = (away_m < within_m) & (away_m.min(axis=2) == nearest)[..., None]
    welcome = np.zeros(bodies.shape[:3], bool)
    for side, arm in enumerate(ARMS):
        welcome[..., arm] = near[..., side, None]
    return welcome
