"""Camera images beside the belief: what the policy is given, alone, in a batch, for SB3."""

import gymnasium
import numpy as np
from stable_baselines3.common.env_checker import check_env

import hrc_env

ONE = {"height": 48, "width": 64, "cameras": ["camera_2"]}


def same(a, b):
    return a.keys() == b.keys() and all(np.array_equal(a[name], b[name]) for name in a)


# All cameras of the rig, 84 x 84, beside the flat belief.
env = gymnasium.make("HRCReach-v0", perception="keypoints", observe_images=(84, 84))
observation, info = env.reset(seed=0)
names = [f"image_camera_{k}" for k in (1, 2, 3, 4)]
assert sorted(observation) == [*names, "observation"]
assert env.observation_space["image_camera_1"] == gymnasium.spaces.Box(
    0, 255, (84, 84, 3), np.uint8
)
terms = env.unwrapped.split_observation(observation)
assert terms["image_camera_1"].shape == (84, 84, 3)
assert terms["goal_from_tool"].shape == (3,)

# One camera; the estimate may come from keypoints, from truth or from nowhere.
for level in ("keypoints", "truth", "none"):
    one = gymnasium.make("HRCReach-v0", perception=level, observe_images=ONE)
    check_env(one.unwrapped)
    one.close()

# A batch sees what single environments see, to the bit.
batch = gymnasium.make_vec("HRCReach-v0", num_envs=2, perception="keypoints", observe_images=ONE)
single = gymnasium.make("HRCReach-v0", perception="keypoints", observe_images=ONE)
seen, _ = batch.reset(seed=3)
alone, _ = single.reset(seed=4)
for _ in range(10):
    assert same({name: part[1] for name, part in seen.items()}, alone)
    action = np.tile(single.action_space.sample(), (2, 1))
    seen, alone = batch.step(action)[0], single.step(action[1])[0]

# What cannot be is said before an episode starts.
for wrong in ((0, 84), (84, 10_000), {"cameras": ["camera_9"]}, {"widht": 84}, "pixels"):
    try:
        gymnasium.make("HRCReach-v0", perception="none", observe_images=wrong)
    except hrc_env.ConfigError as error:
        print(error)
    else:
        raise AssertionError(wrong)
for each in (env, batch, single):
    each.close()
