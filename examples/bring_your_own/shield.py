"""A shield of your own: slower with the estimated gap, less its uncertainty, and still below 10 cm.

python -m hrc_env --import examples/bring_your_own/shield.py play --perception keypoints \
    --shield slow_down
"""

import numpy as np

import hrc_env
from hrc_env import standard_deviation_m

STOP_M, FREE_M = 0.1, 0.6


def slow_down(now, velocities, dt_s):
    unsure_m = 2 * standard_deviation_m(now.estimate).max(-1)
    gap_m = (now.separation.distance_m - unsure_m).min(-1, initial=np.inf)
    share = np.clip((gap_m - STOP_M) / (FREE_M - STOP_M), 0.0, 1.0)
    return velocities * share[:, None], {"speed_share": share}


hrc_env.register_shield("slow_down", slow_down)
