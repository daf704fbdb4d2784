"""Fix what an episode has: its goal, who is there and does what, where the robot starts."""

import gymnasium
import numpy as np

import hrc_env

env = gymnasium.make(
    "HRCReach-v0", perception="keypoints", n_workers=(0, 2), config={"worker": "any"}
)
base = env.unwrapped
fixed = {
    "goal": (0.5, 0.3, 1.1),  # [m, world]
    "n_workers": 2,
    "bodies": ["worker_5", "worker_1"],
    "activity": ["hammer", "kneel"],
    "people": "unaware",
}
observation, info = env.reset(seed=0, options=fixed)
words = base.words(info)
assert words["worker/activity"] == ("hammer", "kneel")
assert words["worker/body"] == ("worker_5", "worker_1")

# The robot starts where it is told to, with the goal at the same place.
q = np.array([0.3, -1.4, 1.8, -1.9, -1.5, 0.0])
first, _ = env.reset(seed=0, options={**fixed, "start_q": q})
terms = base.split_observation(first)
second, _ = env.reset(seed=1, options={**fixed, "start_q": q})
again = base.split_observation(second)
np.testing.assert_allclose(terms["goal_from_tool"], again["goal_from_tool"], atol=1e-6)

# What is not fixed is drawn as without options: the same seed, the same start of the robot.
free, _ = env.reset(seed=4)
given, _ = env.reset(seed=4, options={"goal": fixed["goal"]})
free_terms, given_terms = base.split_observation(free), base.split_observation(given)
for name, value in free_terms.items():
    if not name.startswith("goal"):
        np.testing.assert_array_equal(value, given_terms[name])

# A vector environment: one value for all, a row for each, or anything for "each".
envs = gymnasium.make_vec("HRCReach-v0", num_envs=2, perception="keypoints", n_workers=(0, 2))
each = [{"activity": "saw", "n_workers": 1}, {"n_workers": 0}]
observations, infos = envs.reset(seed=0, options={"goal": fixed["goal"], "each": each})
assert envs.words(infos)["worker/activity"].tolist() == [("saw", "absent"), ("absent", "absent")]

for wrong in ({"gaol": (0.5, 0.3, 1.1)}, {"goal": (3, 3, 3)}, {"activity": "hamer"}):
    try:
        env.reset(options=wrong)
    except hrc_env.ConfigError as error:
        print(error)
    else:
        raise AssertionError(f"{wrong} was taken")
