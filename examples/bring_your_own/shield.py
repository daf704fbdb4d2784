"""A shield of your own: the arm slows down as the estimated gap to a person closes.

python -m hrc_env --import examples/bring_your_own/shield.py play --perception keypoints \
    --shield slow_down
"""

import numpy as np

import hrc_env
from hrc_env import standard_deviation_m

STOP_M, FREE_M = 0.1, 0.6


def slow_down(belief, velocities, dt_s):
    margin_m = 2 * standard_deviation_m(belief.estimate).max(-1)
    gap_m = (belief.separation.distance_m - margin_m).min(-1, initial=np.inf)
    share = np.clip((gap_m - STOP_M) / (FREE_M - STOP_M), 0.0, 1.0)
    return velocities * share[:, None], {"speed_share": share}


hrc_env.register_shield("slow_down", slow_down)
