"""Errors of estimated bodies along the lines to a robot, from episodes with known truth."""

import math
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.progress import Progress, TimeElapsedColumn

from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import make_agent
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Bools, Capsules, Floats, Ints
from hrc_env.env import HRCEnv
from hrc_env.evaluation.rollout import rollout
from hrc_env.experiments.rigs import Turn
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.geometry.distances import closest_parameters
from hrc_env.geometry.enclosure import N_CAPSULES
from hrc_env.motion import generator
from hrc_env.safety.built_in import describe_bodies, describe_pose
from hrc_env.safety.config import ShieldConfig, ShieldParams
from hrc_env.safety.constraints import (
    ABSENT_M,
    Bodies,
    find_margin,
    find_nearest,
    project_motion,
    select_segment,
)
from hrc_env.safety.error_bounds import find_joints_that_count, make_no_bounds
from hrc_env.simulation import Simulation
from hrc_env.vector.env import HRCVectorEnv
from hrc_env.worker.body import worker_truth

NEAR_M = 0.5
"""Estimated gap to a robot's capsule beyond which errors are not used [m]."""
TOGETHER = 64
"""Number of episodes that are played as one batch."""
RECENT_S = 0.25
"""Time since the last detection after which a worker counts as lost and has no bounds [s]."""


PAIR = ("error_m", "gap_m", "std_m", "constant_m")
"""Fields of `Errors` that depend on the robot's capsule."""
CONSTANT = ShieldConfig("qp", margin="constant")
"""Shield with constant margins."""


@dataclass(frozen=True, slots=True)
class Drive:
    """Control of the robot and behaviour of the cameras in the episodes of a sample."""

    name: str
    """Description in tables."""
    agent: str = "scripted"
    """Name of the agent."""
    shield: str | ShieldConfig | None = None
    """The shield."""
    setup: PerceptionSetup = field(default_factory=PerceptionSetup)
    """Level of perception, cameras and their delay; batches of episodes use its turns in turn."""
    task: str = "HRCReach-v0"
    """Id of the environment."""

    @property
    def n_together(self) -> int:
        """Number of episodes that are played as one batch; rendered ones are played singly."""
        return 1 if self.setup.level == "pixels" else TOGETHER


class Errors(NamedTuple):
    """Errors of one part of the body in N steps in which a robot is near.

    For each step and side of the body, this is the largest error over the robot's near capsules.
    """

    error_m: Floats
    """Estimated minus true gap (N,) [m]."""
    gap_m: Floats
    """Estimated gap (N,) [m]."""
    std_m: Floats
    """Standard deviation of the estimate along the line to the robot (N,) [m]."""
    constant_m: Floats
    """Constant margin of the shield (N,) [m]."""
    n_views: Ints
    """Least number of views of the part's joints (N,)."""
    misfit: Floats
    """Largest misfit of the part's joints (N,)."""
    age_s: Floats
    """Greatest age of the part's joints (N,) [s]."""
    episode: Ints
    """Seed of the episode (N,)."""


SEEDS_APART = 100_000
"""Difference between the first seeds of successive drives."""


def collect_all(
    drives: Sequence[Drive], seed: int, n_episodes: int, words: str, console: Console
) -> list[list[Errors]]:
    """Return the errors of each drive and capsule, and show the progress.

    Args:
        drives: robots and cameras.
        seed: seed of the first episode of the first drive; drive k begins at seed + k times
            `SEEDS_APART`.
        n_episodes: number of episodes of each drive.
        words: description of the progress.
        console: console to write to.
    """
    with Progress(*Progress.get_default_columns(), TimeElapsedColumn(), console=console) as shown:
        task = shown.add_task(
            words, total=sum(math.ceil(n_episodes / drive.n_together) for drive in drives)
        )
        return [
            collect_errors(drive, seed + SEEDS_APART * k, n_episodes, lambda: shown.advance(task))
            for k, drive in enumerate(drives)
        ]


def collect_errors(
    drive: Drive,
    seed: int,
    n_episodes: int,
    tick: Callable[[], None] = lambda: None,
) -> list[Errors]:
    """Play episodes, and return the errors of each capsule (S,).

    Args:
        drive: robot and cameras.
        seed: seed of the first episode; episode k has `seed` + k.
        n_episodes: number of episodes.
        tick: function that is called after each batch of episodes.
    """
    samples: list[list[Errors]] = [[] for _ in range(N_CAPSULES)]
    turns, at_once = drive.setup.turns, drive.n_together
    for k, first in enumerate(range(seed, seed + n_episodes, at_once)):
        seeds = np.arange(first, min(first + at_once, seed + n_episodes))
        for at_step in _play(drive, turns[k % len(turns)], seeds):
            for s, errors in enumerate(at_step):
                samples[s].append(errors)
        tick()
    return [Errors(*(np.concatenate(each) for each in zip(*part, strict=True))) for part in samples]


def _play(drive: Drive, turn: Turn, seeds: Ints) -> list[list[Errors]]:
    """Play one batch of episodes, and return the errors of each capsule in each step."""
    arguments: dict[str, Any] = {
        "task": drive.task, "perception": drive.setup.level, "shield": drive.shield,
        "cameras": turn.cameras, "faults": turn.faults, "config": {"worker": "any"},
    }  # fmt: skip
    if len(seeds) == 1:
        env: HRCEnv | HRCVectorEnv = HRCEnv(**arguments)
        simulation = env.simulation
        observation, _ = env.reset(seed=int(seeds[0]))
    else:
        env = HRCVectorEnv(len(seeds), num_threads=1, **arguments)
        simulation = env.simulation
        observation, _ = env.reset(seed=seeds.tolist())
    with closing(env):
        return [
            _measure_errors(simulation, seeds, np.atleast_1d(each.is_playing & ~each.ends))
            for each in rollout(env, make_agent(drive.agent, env_info(env)), observation)
        ]


def _measure_errors(simulation: Simulation, seeds: Ints, is_playing: Bools) -> list[Errors]:
    """Return the errors of each capsule (S,) of the workers in environments that are playing."""
    belief = simulation.belief
    estimate, robot, lost = belief.estimate, belief.robot, np.zeros(belief.estimate.tracked.shape)
    lately = estimate.tracked & (estimate.unobserved_s <= RECENT_S) & is_playing[:, None]
    truth = worker_truth(simulation.bodies, generator.current(simulation.motion))
    pairs = np.full((*lately.shape, N_CAPSULES, len(PAIR)), np.nan)
    _measure_pairs(
        robot.capsules_world, robot.capsule_radius_m,
        describe_bodies(belief, describe_pose(belief), lost > 0, CONSTANT, make_no_bounds()),
        truth.capsules_world, truth.capsule_radius_m, CONSTANT.make_params(), pairs,
    )  # fmt: skip
    counts, of_slot = find_joints_that_count(), np.broadcast_to(seeds[:, None], lately.shape)
    errors: list[Errors] = []
    for s in range(N_CAPSULES):
        is_near = lately & ~np.isnan(pairs[:, :, s, 0])
        error_m, gap_m, std_m, constant_m = pairs[is_near][:, s].T
        errors.append(Errors(
            error_m, gap_m, std_m, constant_m,
            n_views=estimate.n_views[is_near][:, counts[s]].min(-1),
            misfit=estimate.misfit[is_near][:, counts[s]].max(-1),
            age_s=estimate.age_s[is_near][:, counts[s]].max(-1),
            episode=of_slot[is_near],
        ))  # fmt: skip
    return errors


@kernel(makes_arrays=True)
def _measure_pairs(
    robot: Capsules,
    radius_m: Floats,
    bodies: Bodies,
    true: Capsules,
    true_radius_m: Floats,
    params: ShieldParams,
    pairs: Floats,
) -> None:
    """Find the pair of each body's capsule and a robot's near capsule with the largest error.

    Args:
        robot: (B, K, 2, 3) capsules of the robots [m].
        radius_m: (K,) their radii [m].
        bodies: the estimated bodies (B, W), as the shield uses them.
        true: (B, W, S, 2, 3) capsules of the true bodies [m].
        true_radius_m: (B, W, S) their radii [m].
        params: settings of the shield with constant margins.
        pairs: (B, W, S, 4) receives the fields `PAIR` of `Errors`; rows of capsules without a near
            pair are left unchanged.
    """
    normal, point = np.empty(3), np.empty(3)
    for b, w, s in np.ndindex(pairs.shape[:3]):
        actual, row = true[b, w, s], pairs[b, w, s]
        for c in range(robot.shape[1]):
            if abs(robot[b, c, 0, 0]) > ABSENT_M:
                continue
            segment = select_segment(bodies, b, w, s)
            nearest = find_nearest(robot[b, c], segment.ends, point, normal)
            gap_m = nearest.distance_m - radius_m[c] - segment.radius_m
            if gap_m > NEAR_M:
                continue
            at = closest_parameters(robot[b, c, 0], robot[b, c, 1], actual[0], actual[1])
            true_gap_m = math.sqrt(at.squared_distance) - radius_m[c] - true_radius_m[b, w, s]
            if gap_m - true_gap_m <= row[0]:
                continue
            std_m = project_motion(segment, nearest.along, normal).std_m
            row[0], row[1], row[2] = gap_m - true_gap_m, gap_m, std_m
            row[3] = find_margin(segment, std_m, params)
