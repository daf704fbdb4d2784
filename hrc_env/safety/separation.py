"""Speed and separation monitoring: the required distance between robot and worker.

The method is that of ISO/TS 15066:2016, 5.5.4 (now in ISO 10218-2:2025), as cited by Marvel and
Norcross 2017 (PMC5117641) and Pupa et al. 2021 (arXiv:2103.01818); the approach speed is that of
ISO 13855:2010. Verify both against the standards before certification.

Speeds are *directed*: they are the speed of the robot's nearest point towards the worker, and the
speed of the worker's nearest point towards the robot.
"""

import numpy as np
from numpy.typing import ArrayLike

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Floats
from hrc_env.core.vacancy import WALKING_M_S


def protective_distance(
    robot_m_s: ArrayLike,
    human_m_s: ArrayLike = WALKING_M_S,
    *,
    reaction_s: ArrayLike,
    stopping_s: ArrayLike,
    intrusion_m: ArrayLike = 0.0,
    human_uncertainty_m: ArrayLike = 0.0,
    robot_uncertainty_m: ArrayLike = 0.0,
) -> Floats:
    """Return the protective distance S_p, below which the robot must be stopping [m].

    S_p = S_h + S_r + S_s + C + Z_d + Z_r. All arguments are numbers or arrays, which are broadcast.

    Args:
        robot_m_s: v_r, speed of the robot towards the worker [m/s]; a negative one counts as 0.
        human_m_s: v_h, speed of the worker towards the robot [m/s]; a negative one counts as 0.
        reaction_s: T_r, time until the brakes act [s], in which S_r = v_r T_r.
        stopping_s: T_s, time from braking to rest [s], at constant deceleration:
            S_s = v_r T_s / 2. The worker approaches in both times: S_h = v_h (T_r + T_s).
        intrusion_m: C, distance by which a part of the body can extend beyond the measured position
            [m].
        human_uncertainty_m: Z_d, uncertainty of the worker's position [m].
        robot_uncertainty_m: Z_r, uncertainty of the robot's position [m].

    Raises:
        ConfigError: a time or a distance is negative or not a number.
    """
    reaction, stopping = (
        _check_not_negative("reaction_s", reaction_s),
        _check_not_negative("stopping_s", stopping_s),
    )
    robot = np.maximum(np.asarray(robot_m_s, float), 0.0)
    human = np.maximum(np.asarray(human_m_s, float), 0.0)
    margins = (
        _check_not_negative("intrusion_m", intrusion_m)
        + _check_not_negative("human_uncertainty_m", human_uncertainty_m)
        + _check_not_negative("robot_uncertainty_m", robot_uncertainty_m)
    )
    return human * (reaction + stopping) + robot * (reaction + 0.5 * stopping) + margins


def _check_not_negative(name: str, value: ArrayLike) -> Floats:
    """Return a value as an array, or raise `ConfigError` if it is negative or not a number."""
    values = np.asarray(value, float)
    if not (values >= 0.0).all():
        raise ConfigError(f"{name} must be a number that is not negative, got {value}.")
    return values
