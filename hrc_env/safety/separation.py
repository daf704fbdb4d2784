"""Speed and separation monitoring: how far apart robot and worker must be.

ISO/TS 15066:2016, 5.5.4 (now in ISO 10218-2:2025), as Marvel and Norcross 2017 (PMC5117641) and
Pupa et al. 2021 (arXiv:2103.01818) print it; the approach speed of ISO 13855:2010. Verify against
the standards before certification.

Speeds are *directed*: of the robot's nearest point towards the worker, and of the worker's towards
it. Numbers or arrays, which broadcast.
"""

from typing import Any

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Floats
from hrc_env.core.vacancy import WALKING_M_S


def protective_distance(
    robot_m_s: Any, human_m_s: Any = WALKING_M_S, *, reaction_s: Any, stopping_s: Any,
    intrusion_m: Any = 0.0, human_uncertainty_m: Any = 0.0, robot_uncertainty_m: Any = 0.0,
) -> Floats:  # fmt: skip
    """S_p = S_h + S_r + S_s + C + Z_d + Z_r [m]: nearer than this the robot must be stopping.

    Args:
        robot_m_s: v_r, its speed towards the worker [m/s]; away from them counts as 0.
        human_m_s: v_h, the worker's towards it [m/s]; likewise.
        reaction_s: T_r, from somebody's coming to the brakes [s], in which S_r = v_r T_r.
        stopping_s: T_s, from there to rest [s], at constant deceleration: S_s = v_r T_s / 2. The
            worker comes all the while: S_h = v_h (T_r + T_s).
        intrusion_m: C, by how much a part of the body can be past what is measured [m].
        human_uncertainty_m, robot_uncertainty_m: Z_d of the worker's place, Z_r of the robot's [m].

    Raises:
        ConfigError: a time or a distance that is negative, or no number.
    """
    reaction, stopping = _known("reaction_s", reaction_s), _known("stopping_s", stopping_s)
    robot = np.maximum(np.asarray(robot_m_s, float), 0.0)
    human = np.maximum(np.asarray(human_m_s, float), 0.0)
    margins = (
        _known("intrusion_m", intrusion_m)
        + _known("human_uncertainty_m", human_uncertainty_m)
        + _known("robot_uncertainty_m", robot_uncertainty_m)
    )
    return human * (reaction + stopping) + robot * (reaction + 0.5 * stopping) + margins


def _known(name: str, value: Any) -> Floats:
    values = np.asarray(value, float)
    if not (values >= 0.0).all():
        raise ConfigError(f"{name} must be a number that is not negative, got {value}.")
    return values
