"""Identification of the worker that takes part in a task, among the estimated bodies."""

import numpy as np

from hrc_env.core.records import PoseEstimate
from hrc_env.core.skeleton import TORSO
from hrc_env.core.typing import Bools, Capsules
from hrc_env.geometry.distances import least_separation
from hrc_env.geometry.enclosure import CAPSULE, enclose
from hrc_env.world import FOOT_WORLD

ARMS = tuple((CAPSULE[f"{side}_forearm"], CAPSULE[f"{side}_hand"]) for side in ("left", "right"))
"""Indices of forearm and hand of each side among the capsules of an estimated body."""
PARTNER_RADIUS_M = 0.6
"""Maximum horizontal distance between workplace and trunk for a worker to count as the partner
[m]."""


def find_partner_arms(
    estimate: PoseEstimate, stand_xy_m: tuple[float, float], place_world: Capsules, within_m: float
) -> Bools:
    """Return a mask (B, W, S) of the partner's forearms and hands that are near a line segment.

    The partner is the tracked worker at the task's workplace; if there are several, it is the one
    with the hand nearest to the segment.

    Args:
        estimate: estimate of the workers.
        stand_xy_m: position of the task's workplace relative to the robot's base, x and y [m].
        place_world: (B, 2, 3) end points of the line segment where hands work [m].
        within_m: maximum distance of the hand from the line segment for an arm to be included [m].
    """
    bodies = enclose(estimate.mean_world).ends_world
    trunk = estimate.mean_world[:, :, TORSO, :2].mean(2)
    off_m = np.linalg.norm(trunk - (FOOT_WORLD[:2] + stand_xy_m), axis=-1)
    hands = bodies[:, :, [hand for _, hand in ARMS], None]
    away_m = least_separation(place_world[:, None], np.zeros(1), hands, np.zeros(1)).distance_m
    is_candidate = estimate.tracked & (off_m < PARTNER_RADIUS_M)
    away_m = np.where(is_candidate[..., None], away_m, np.inf)
    nearest = away_m.min(axis=(1, 2), initial=np.inf)[:, None]
    near = (away_m < within_m) & (away_m.min(axis=2) == nearest)[..., None]
    arms = np.zeros(bodies.shape[:3], bool)
    for side, capsules_of_arm in enumerate(ARMS):
        arms[..., capsules_of_arm] = near[..., side, None]
    return arms
