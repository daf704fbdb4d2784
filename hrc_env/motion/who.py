"""A worker who decides: their rows of the state, and the draws that decide what."""

from dataclasses import dataclass

import numpy as np

from hrc_env.core.records import WORKPLACE_KINDS
from hrc_env.core.typing import Floats
from hrc_env.motion import controls as c
from hrc_env.motion import plans as pl
from hrc_env.motion.activities.worker import N_START, Worker
from hrc_env.motion.errands import Task
from hrc_env.motion.kinematics import N_FRAMES, N_POINTS
from hrc_env.motion.state import AT, GOING, NOWHERE, SPOT_SINCE, TASK, WAITING, MotionState

NEXT, BOW, LASTS, DELAY, REACTION, REACTION_S, EVENT, DWELL = range(N_START, N_START + 8)
"""Which draw decides what; the first N_START are the activity's own."""
PLACES, N_TRIED = N_START + 8, 5
"""First of the draws for places, three a place, and how many are tried."""
N_DRAWS = PLACES + 3 * N_TRIED
"""Uniform numbers of one decision."""


@dataclass(slots=True)
class Who:
    """A worker who decides."""

    state: MotionState
    b: int
    w: int
    me: Worker
    draws: Floats
    """(N_DRAWS,)."""
    now: float
    """Clock [s]."""
    load: float
    """What they hold when they decide (`plans.LOAD_PROP`)."""

    @property
    def body(self) -> int:
        """Row of `MotionState.anatomy`."""
        return self.state.body.item(self.b, self.w)

    @property
    def spot(self) -> Floats:
        """(N_SPOT,) row of `MotionState.spots`."""
        return self.state.spots[self.b, self.w]

    @property
    def alert(self) -> Floats:
        """(N_ALERT,) row of `MotionState.alert`."""
        return self.state.alert[self.b, self.w]

    @property
    def going(self) -> int:
        """`THERE`, `UNDER_WAY` or `WAITING`."""
        return int(self.state.errand[self.b, self.w, GOING])

    @going.setter
    def going(self, value: int) -> None:
        self.state.errand[self.b, self.w, GOING] = value
        if value != WAITING:
            self.spot[SPOT_SINCE] = 0.0

    @property
    def kind_here(self) -> str:
        """Kind of the place where they are and have something to do; else nothing."""
        at = self.state.errand.item(self.b, self.w, AT)
        return "" if at == NOWHERE else WORKPLACE_KINDS[at]

    @property
    def task(self) -> Task:
        """What they do or want to do."""
        return self.state.mind.errands.tasks[self.state.errand[self.b, self.w, TASK]]

    @property
    def loaded(self) -> bool:
        """Whether they hold something."""
        return bool(self.me.plan[pl.LOAD_PROP] > 0.0)

    def draw(self, index: int, limits: tuple[float, float]) -> float:
        """A draw stretched to (low, high)."""
        return limits[0] + self.draws.item(index) * (limits[1] - limits[0])


def who_is(state: MotionState, b: int, w: int, draws: Floats, now: float) -> Who:
    bones, k = state.anatomy, state.body.item(b, w)
    me = Worker(
        state.traits[b, w], state.plan[b, w], state.prints[b, w], state.stance[b, w],
        bones.offset[k], bones.frame[k], bones.size[k],
        np.empty(c.N_CONTROLS), np.zeros((N_POINTS, 3)), np.zeros((N_FRAMES, 3, 3)),
    )  # fmt: skip
    return Who(state, b, w, me, draws, now, me.plan.item(pl.LOAD_PROP))
