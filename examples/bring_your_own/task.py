"""A task of your own: the tool goes back and forth between two stations.

python -m hrc_env --import examples/bring_your_own/task.py play HRCTend-v0 --agent random
"""

from dataclasses import dataclass

import numpy as np

import hrc_env
from hrc_env import ObservationTerm, RewardTerm, Task

STATE = np.dtype([("next_station", "i8"), ("n_visits", "i8")])


@dataclass(frozen=True)
class TendConfig:
    stations_world: tuple[tuple[float, ...], ...] = ((-0.1, -0.6, 1.0), (-0.1, 0.6, 1.0))
    radius_m: float = 0.08
    visit_bonus: float = 5.0


class Tend(Task):
    """Go back and forth between two stations."""

    id = "HRCTend-v0"
    config_type = TendConfig
    observations = (
        ObservationTerm(
            name="station", size=3, unit="m", frame="world", bound=3.0, scale=0.5,
            doc="Position of the next station, relative to the tool.",
            function=lambda belief: belief.task - belief.robot.tool_world,
        ),
    )  # fmt: skip
    rewards = (
        RewardTerm(
            name="visit",
            doc="`task.visit_bonus` for every arrival at a station.",
            function=lambda belief, arrived, last_action, config: config.visit_bonus * arrived,
        ),
    )
    achieved, failed = "task/visits", "task/missing_visits"

    def make_state(self, batch):
        return np.zeros(batch, STATE)

    def reset(self, state, ids, rngs, world):
        for b in ids:
            state[b] = rngs[b].integers(len(self.config.stations_world)), 0

    def advance(self, state, rngs, world, dt_s):
        away = self.view(state, slice(None)) - world.robot.tool_world
        arrived = np.linalg.norm(away, axis=1) < self.config.radius_m
        state["n_visits"] += arrived
        state["next_station"] += arrived
        state["next_station"] %= len(self.config.stations_world)
        return arrived

    def view(self, state, ids):
        """The robot knows where its next station is, (B, 3) [m]."""
        return np.array(self.config.stations_world)[state["next_station"][ids]]

    def info(self, state):
        visits, missing = 1.0 * state["n_visits"], np.maximum(2.0 - state["n_visits"], 0.0)
        success = 1.0 * (missing == 0)
        return {"task/visits": visits, "task/missing_visits": missing, "is_success": success}

    def markers(self, view):
        return view[:, None]


hrc_env.register_task(Tend)
