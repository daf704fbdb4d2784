"""Speed limits due to undetected people: lost workers, hidden hands and unobserved floor."""

from dataclasses import dataclass, replace

import numpy as np

from hrc_env.belief import Belief, estimated_separation
from hrc_env.core.records import PoseEstimate
from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Bools, Floats
from hrc_env.core.vacancy import WALKING_M_S
from hrc_env.geometry.distances import least_separation
from hrc_env.safety.config import ShieldConfig

NEAR_M, FAR_M = 0.25, 1.0
"""Distances from a lost worker's last position below which a robot stops and slows down,
respectively [m]."""
UNLOCATED_M = 0.135
"""Standard deviation that a hidden wrist exceeds along two axes [m]; the growth by prediction is
added to it. A wrist that a single camera detects is uncertain only in depth, that is along one
axis."""
VAGUE_M = 0.25
"""Standard deviation of a shoulder above which the hands count as hidden as well, if it is exceeded
along any axis [m]; the growth by prediction is added to it."""
HAND_M = 0.6
"""Distance from unobserved floor within which the hands of people there may also be undetected
[m]."""
ARM_M = 0.75
"""Length of an outstretched arm, from the shoulder to the tip of the hand [m]."""
WRISTS, SHOULDERS = (
    [JOINT[f"{side}_{joint}"] for side in ("left", "right")] for joint in ("wrist", "shoulder")
)


@dataclass(frozen=True, slots=True, eq=False)
class Undetected:
    """Restrictions on the robots due to people that are not detected at present."""

    is_lost: Bools
    """Mask of the workers that were detected once, but not recently (B, W)."""
    speed_limit_m_s: Floats
    """Speed limit of every point of a robot (B,) [m/s]; infinite if there is no limit."""


def find_undetected(belief: Belief, config: ShieldConfig) -> Undetected:
    """Return the lost workers, and the speed limit due to people that are not detected."""
    estimate = belief.estimate
    lately = estimate.tracked & (estimate.unobserved_s <= config.stale_after_s)
    lost = ~lately & np.isfinite(estimate.seen_world[..., 0, 0])
    never_seen = estimate.unknown & ~lost
    limit = _limit_near_hidden_hands(belief, config)
    if lost.any():
        limit = np.minimum(limit, _limit_near_lost(belief, lost, config))
    if never_seen.any():
        limit = np.minimum(limit, _limit_near_floor(belief, never_seen, config))
    return Undetected(lost, limit)


def _limit_near_lost(belief: Belief, lost: Bools, config: ShieldConfig) -> Floats:
    """Return the speed limit (B,) near the last positions of lost workers [m/s]."""
    there = replace(belief.estimate, mean_world=belief.estimate.seen_world, tracked=lost)
    near_m = estimated_separation(belief.robot, there).distance_m.min(1)
    share = np.clip((near_m - NEAR_M) / (FAR_M - NEAR_M), 0.0, 1.0)
    return np.where(lost.any(1), config.unknown_speed_limit_m_s * share, np.inf)


def _limit_near_floor(belief: Belief, never_seen: Bools, config: ShieldConfig) -> Floats:
    """Return the speed limit (B,) near floor that one camera has observed to be empty [m/s].

    The limit is 0 before the first image. `constraints.add_floor_constraints` maintains the
    distance from floor that no camera has observed.
    """
    if belief.unseen is None:
        return np.where(never_seen.any(1), 0.0, np.inf)
    gap_m = belief.unseen.probable_m - WALKING_M_S * belief.unseen.age_s
    return np.maximum(_find_stoppable_speed(gap_m, config), config.unknown_speed_limit_m_s)


def _limit_near_hidden_hands(belief: Belief, config: ShieldConfig) -> Floats:
    """Return the speed limit (B,) due to hidden hands of tracked workers [m/s].

    A hidden hand is assumed to be anywhere within an arm's length of its shoulder.
    """
    estimate, limit = belief.estimate, np.full(len(belief.estimate.tracked), np.inf)
    cov = estimate.cov_world[:, :, WRISTS]
    most_m = UNLOCATED_M + config.prediction_growth_m_s * estimate.age_s[:, :, WRISTS]
    hidden = estimate.tracked[..., None] & (np.trace(cov, axis1=-2, axis2=-1) > 2 * most_m**2)
    hidden[hidden] = np.linalg.eigvalsh(cov[hidden])[:, 1] > most_m[hidden] ** 2
    hidden |= _is_vague(estimate, config)[..., None]
    if not hidden.any():
        return limit
    shoulders = estimate.mean_world[:, :, SHOULDERS]
    points = np.repeat(shoulders[..., None, None, :], 2, axis=-2)
    robot = belief.robot.capsules_world, belief.robot.capsule_radius_m
    away_m = least_separation(*robot, points, np.zeros(1)).distance_m
    variance = np.trace(estimate.cov_world[:, :, SHOULDERS], axis1=-2, axis2=-1) / 3
    gap_m = away_m - ARM_M - config.n_sigmas * np.sqrt(variance)
    return np.where(hidden, _find_stoppable_speed(gap_m, config), np.inf).min((1, 2))


def _is_vague(estimate: PoseEstimate, config: ShieldConfig) -> Bools:
    """Return a mask (B, W) of tracked workers with a shoulder that is uncertain along any axis."""
    cov = estimate.cov_world[:, :, SHOULDERS]
    most_m = VAGUE_M + config.prediction_growth_m_s * estimate.age_s[:, :, SHOULDERS]
    vague = estimate.tracked[..., None] & (np.trace(cov, axis1=-2, axis2=-1) > most_m**2)
    vague[vague] = np.linalg.eigvalsh(cov[vague])[:, 2] > most_m[vague] ** 2
    return np.asarray(vague.any(-1))


def _find_stoppable_speed(gap_m: Floats, config: ShieldConfig) -> Floats:
    """Return the speed from which a robot can stop before a walking person is `NEAR_M` away [m/s].

    This is `separation.protective_distance` solved for the robot's speed.

    Args:
        gap_m: distances from the person, of any shape [m].
        config: reaction time and deceleration.
    """
    brake, walking = config.deceleration_m_s2, WALKING_M_S
    reaction_s = config.reaction_s + config.latency_s
    left_m = np.maximum(gap_m - NEAR_M - walking * reaction_s, 0.0)
    per_m_s = reaction_s + walking / brake
    return brake * (np.sqrt(per_m_s**2 + 2.0 * left_m / brake) - per_m_s)
