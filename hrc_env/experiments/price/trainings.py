"""Trainings of PPO that differ in what closeness is rewarded by and in how many cameras there are,
and what is measured of the robot while it learns."""

import warnings
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from gymnasium.utils import seeding

from hrc_env.config import settle
from hrc_env.control import checked_action
from hrc_env.core.machine import n_cores
from hrc_env.core.typing import Floats
from hrc_env.experiments.cache import PartProgress
from hrc_env.experiments.impact.episodes import PEOPLE, SLOW_M
from hrc_env.experiments.impact.policies import N_ENVS, PROXIMITY, taught
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.motion import generator
from hrc_env.observations import FAR_SEPARATION_M
from hrc_env.perception.emulator import lines_of_sight
from hrc_env.perception.sightlines import HIDDEN, SEEN
from hrc_env.rewards import closeness
from hrc_env.simulation import Simulation
from hrc_env.vector.shards import Shards
from hrc_env.worker.body import worker_truth

BELIEF, TRUE, CAREFUL = "belief", "truth", "careful"
REWARDS: dict[str, dict[str, Any]] = {
    BELIEF: {"reward": {"unknown": 0.0}},
    TRUE: {"reward": {"unknown": 0.0}},
    CAREFUL: {"uncertainty": ["towards_robot"]},
}
"""Settings by what closeness is rewarded by: the estimate, where who is lost is far away; the true
separation; the estimate where who is lost is near, of which the covariance is observed, too."""
FIRST_SEED = 6_000_000
"""Of the episodes in which robots are watched, far from those that they learn in."""


@dataclass(frozen=True, slots=True)
class Training:
    """One learner."""

    reward: str
    """One of `REWARDS`."""
    n_cameras: int
    seed: int
    n_steps: int
    """Environment steps."""
    n_points: int
    """How often it is watched while it learns, and once before."""
    n_watched: int
    """Episodes each time."""

    @property
    def name(self) -> str:
        """As parts are called."""
        return f"{self.reward}_{self.n_cameras}cam_seed{self.seed}"

    def arguments(self) -> dict[str, Any]:
        """Of its environments; seeds take turns in which cameras there are, from the start."""
        turns = PerceptionSetup(n_cameras=self.n_cameras, is_alone=True).turns
        config = {**REWARDS[self.reward]}
        config["reward"] = {"proximity": PROXIMITY, **config.get("reward", {})}
        return {
            "perception": "keypoints", "people": PEOPLE, "config": config,
            "cameras": list(turns[self.seed % len(turns)].cameras),
        }  # fmt: skip


class TrueProximity:
    """Environments that reward closeness by the true separation; all else reads the estimate. Only
    for this question: no reward of the library knows the truth."""

    def __init__(self, env: Any) -> None:
        self.env = env

    def __getattr__(self, name: str) -> Any:
        return getattr(self.env, name)

    def step(self, actions: Any) -> Any:
        """A step of every environment."""
        from hrc_env.evaluation.sums import value_of_step

        observation, reward, *ends, infos = self.env.step(actions)
        weights, n = self.env.shards.first.reward_weights, self.env.num_envs
        true_m = value_of_step(infos, "safety/min_separation_m", n)
        believed = value_of_step(infos, "reward/proximity", n)
        truly = -weights.proximity * closeness(true_m, weights.proximity_reach_m)
        return observation, reward - believed + truly, *ends, infos


def learn(training: Training, tick: PartProgress) -> dict[str, list[float]]:
    """What was measured before, while and after it learnt: a list over the points in time."""
    from hrc_env.sb3 import HRCVecEnv

    arguments, found = training.arguments(), dict[str, list[float]]()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that one camera is a poor rig is what we ask about
        env = HRCVecEnv(
            N_ENVS, stagger=True, seed=training.seed, num_threads=n_cores(), **arguments
        )
    if training.reward == TRUE:
        env.env = TrueProximity(env.env)  # type: ignore[assignment]
    every = training.n_steps / training.n_points

    def note(learner: Any) -> None:
        tick(N_ENVS / training.n_steps)
        if learner.num_timesteps >= len(found.get("steps", ())) * every:
            watched = watch(partial(learner.predict, deterministic=True), training)
            for name, value in ({"steps": learner.num_timesteps} | watched).items():
                found.setdefault(name, []).append(float(value))

    taught(env, training.n_steps, training.seed, note)
    return found


def watch(act: Any, training: Training) -> dict[str, float]:
    """What a policy comes to in some episodes, always of the same seeds:

    - "optimism_m": believed less true separation, both at most 1 m, as the observation has them, in
      steps in which the worker is truly nearer than 0.6 m;
    - "lost": share of these without a track;
    - "hidden": share of lines of sight from cameras to joints that only the robot cuts;
    - "unseen": share of joints that no camera sees and one would, if the robot were not there;
    - "goals_per_min", "contacts" and "near" (steps truly nearer than 0.6 m), an episode.
    """
    settings, n = settle(**training.arguments()), training.n_watched
    make = partial(Simulation, settings=settings)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        shards = Shards(n, min(n_cores(), n), make)
    with closing(shards) as env:
        seeds = [FIRST_SEED + k for k in range(n)]
        result = env.reset(np.arange(n), [seeding.np_random(seed)[0] for seed in seeds])
        n_steps, steps, touching = settings.task.max_episode_steps, [], []
        for _ in range(n_steps):
            action = np.clip(act(result.observation)[0], -1.0, 1.0)
            result = env.step(checked_action(action, (n, env.first.n_actions)))
            parts = [seen_in(part) for part in env.parts]
            steps.append({k: np.concatenate([each[k] for each in parts]) for k in parts[0]})
            steps[-1]["true_m"] = result.info["safety/min_separation_m"]
            touching.append(result.info["cost_contact"] > 0)
        minutes = n_steps * settings.config.ctrl_dt / 60
        goals = result.info[settings.task.achieved].mean() / minutes
    begins = np.diff(np.stack(touching).astype(int), axis=0, prepend=0) > 0
    return {**_summed(steps), "goals_per_min": goals, "contacts": begins.sum() / n}


def seen_in(part: Simulation) -> dict[str, Floats]:
    """(B,) in a step of a simulation with one worker: the believed separation [m], whether there is
    a track, shares of lines of sight and of joints that the robot alone hides."""
    motion = generator.current(part.motion)
    truth = worker_truth(part.bodies, motion)
    around = part.scene.surroundings(part.physics.qpos, motion.held)
    gone = replace(
        around, capsules_world=around.capsules_world[:, :0], capsule_radius_m=np.zeros(0)
    )
    sight, free = (lines_of_sight(truth, each, part.scene.cameras)[0] for each in (around, gone))
    seen, seeable = sight == SEEN, free == SEEN
    return {
        "believed_m": part.belief.separation.distance_m[:, 0],
        "tracked": part.estimate.tracked[:, 0].astype(float),
        "hidden": ((sight == HIDDEN) & seeable).mean((1, 2, 3)),
        "unseen": (seeable.any(1) & ~seen.any(1)).mean((1, 2)),
    }


def _summed(steps: Sequence[dict[str, Floats]]) -> dict[str, float]:
    stacked = {name: np.stack([step[name] for step in steps]) for name in steps[0]}
    near = stacked["true_m"] < SLOW_M
    believed_m = np.minimum(stacked["believed_m"], FAR_SEPARATION_M)
    optimism_m = believed_m - np.minimum(stacked["true_m"], FAR_SEPARATION_M)
    lost = 1.0 - stacked["tracked"]
    return {
        "optimism_m": float(optimism_m[near].mean()) if near.any() else 0.0,
        "lost": float(lost[near].mean()) if near.any() else 0.0,
        "hidden": float(stacked["hidden"].mean()),
        "unseen": float(stacked["unseen"].mean()),
        "near": float(near.sum(0).mean()),
    }
