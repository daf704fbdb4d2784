"""Sawing by hand: long strokes along the blade, the other hand holds the board down.

Wrists at 1.25 to 2.0 m/s (95th percentile) in the recordings.
"""

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.motion.activities.planning import (
    CALM_M_S,
    between,
    blank,
    dominant,
    look_to,
    put_other,
    put_tool,
    step_ahead,
    strokes,
)
from hrc_env.motion.activities.strokes import SAW
from hrc_env.motion.activities.worker import Place, Worker
from hrc_env.worker.props import prop_index

HAND_SAW = prop_index("saw")
CUT_RAD = 0.6
"""How steeply the blade goes into the board [rad]; 45 to 60 degrees to it is usual, judgement."""


@kernel
def plan_saw(draws: Floats, place: Place, me: Worker) -> float:
    """Plan to saw a board at the place's height; returns how fast hands may go to it [m/s]."""
    blank(me)
    side = dominant(draws[0], me)
    sign = 1.0 - 2.0 * side
    z = place[3] if place[3] > 0.0 else between(draws[1], 0.75, 0.95)
    step_ahead(1 - side, 0.26, me)
    put_tool(HAND_SAW, side, (0.52, 0.17 * sign, z + 0.17), (0.0, CUT_RAD, 0.0), me)
    put_other((0.58, -0.12 * sign, z + 0.03), me)
    look_to((0.74, 0.1 * sign, z), me)
    strokes(SAW, between(draws[2], 0.13, 0.15), between(draws[3], 1.55, 1.75),
            between(draws[4], 3.0, 5.0), 1 + int(3.0 * draws[5]), me)  # fmt: skip
    return CALM_M_S
