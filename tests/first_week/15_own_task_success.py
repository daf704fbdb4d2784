"""A built-in task with another notion of success, by a subclass; judged by what it says."""

from dataclasses import dataclass

import gymnasium
import numpy as np

import hrc_env

Reach = hrc_env.find_task("HRCReach-v0")


@dataclass(frozen=True)
class TwiceConfig(Reach.config_type):
    wanted: int = 2


class ReachTwice(Reach):
    """Touch at least some goals in an episode, whatever is missed."""

    id = "ReachTwice-v0"
    config_type = TwiceConfig
    ends = "When enough goals were reached, which is the success."

    def info(self, state):
        success = state["n_reached"] >= self.config.wanted
        return {**super().info(state), "is_success": success.astype(float)}


hrc_env.register_task(ReachTwice)

env = gymnasium.make("ReachTwice-v0", perception="truth", config={"task": {"wanted": 3}})
env.reset(seed=0)
*_, info = env.step(env.action_space.sample())
assert info["is_success"] == 0.0


class Direct:
    """Moves the tool towards the goal: `control="tool"`."""

    def __init__(self, info):
        self.goal = info.layout.slices["goal_from_tool"]

    def act(self, observation):
        return np.clip(8 * observation[..., self.goal], -1, 1)


shared = {"perception": "truth", "control": "tool", "n_workers": 0}
score = hrc_env.evaluate(Direct, 8, task="ReachTwice-v0", **shared)
print(score)
assert score.goals_per_minute > 20

# The episode's info says whether it was one.
envs = gymnasium.make_vec("ReachTwice-v0", num_envs=8, **shared)
seen, _ = envs.reset(seed=0)
agent, won = Direct(hrc_env.env_info(envs)), np.zeros(8)
for step in hrc_env.rollout(envs, agent, seen):
    won = np.where(step.ends, step.info["is_success"], won)
assert won.mean() > 0.5
