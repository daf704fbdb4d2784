"""A task of your own: to and fro between two stations.

python -m hrc_env --import examples/bring_your_own/task.py play HRCTend-v0 --agent random
"""

from dataclasses import dataclass

import numpy as np

import hrc_env
from hrc_env.observations import ObservationTerm
from hrc_env.rewards import RewardTerm
from hrc_env.tasks.task import Task


@dataclass(frozen=True)
class TendConfig:
    stations_world: tuple[tuple[float, ...], ...] = ((-0.1, -0.6, 1.0), (-0.1, 0.6, 1.0))
    radius_m: float = 0.08
    visit_bonus: float = 5.0


@dataclass
class TendState:
    next_station: np.ndarray
    n_visits: np.ndarray


def station(state, config):
    return np.array(config.stations_world)[state.next_station]


def reset(state, ids, rngs, world, config):
    state.n_visits[ids] = 0
    state.next_station[ids] = [rngs[b].integers(len(config.stations_world)) for b in ids]


def advance(state, rngs, world, dt_s, config):
    away = station(state, config) - world.robot.tool_world
    arrived = np.linalg.norm(away, axis=1) < config.radius_m
    state.n_visits += arrived
    state.next_station = (state.next_station + arrived) % len(config.stations_world)
    return arrived


def info(state):
    visits = 1.0 * state.n_visits
    return {"task/visits": visits, "task/drops": 0.0 * visits, "is_success": 1.0 * (visits > 1)}


hrc_env.register_task(Task(
    "HRCTend-v0", "Go to and fro between two stations.", TendConfig,
    lambda batch: TendState(np.zeros(batch, int), np.zeros(batch, int)), reset, advance,
    lambda state, ids, config: station(state, config)[ids],
    (ObservationTerm("station", lambda of: 3, "m", "world", 3.0, 0.5, "From tool to station.",
                     lambda now: now.task - now.robot.tool_world),),
    (RewardTerm("visit", "`task.visit_bonus` at a station.",
                lambda now, step, previous, config: config.visit_bonus * step),),
    info, "task/visits", "task/drops", lambda view: view[:, None],
))  # fmt: skip
