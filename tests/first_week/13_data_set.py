"""A data set: chosen infos, belief and truth apart, keypoints and images; read and learnt from."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import torch

import hrc_env

words = ["record", "HRCReach-v0", "--agent", "scripted", "--episodes", "2", "--num-envs", "2",
         "--cameras", "0", "1", "--infos", "safety/*", "reward/*", "--poses", "--keypoints",
         "--observe-images", "32", "32", "--folder", "sets/reach"]  # fmt: skip
subprocess.run([sys.executable, "-m", "hrc_env", *words], check=True)

episodes = hrc_env.load_episodes("sets/reach")  # one line
about = episodes.metadata
assert about["command"].startswith("python -m hrc_env record HRCReach-v0")
assert about["versions"]["mujoco"]
assert about["hrc_env"] == hrc_env.__version__

episode = episodes[0]
n_steps = len(episode)
seen = episode.observations
assert len(seen["observation"]) == n_steps + 1 == len(episode.truth["cost"])
assert seen["image_camera_1"].shape == (n_steps + 1, 32, 32, 3)
assert episode.keypoints.px.shape == (n_steps + 1, 2, 1, 15, 2)
error_m = np.linalg.norm(episode.belief["joints_world"] - episode.truth["joints_world"], axis=-1)
print("median error of a joint [m]:", np.median(error_m))
assert np.median(error_m) < 0.2
assert "reward/proximity" in episode.belief
assert "safety/min_separation_m" in episode.truth

# Cloning: a linear policy that imitates what was recorded.
seen = torch.tensor(np.concatenate([each.observations["observation"][:-1] for each in episodes]))
actions = torch.tensor(np.concatenate([each.actions for each in episodes]))
policy = torch.nn.Linear(seen.shape[1], actions.shape[1])
optimiser, losses = torch.optim.Adam(policy.parameters(), 1e-2), []
for _ in range(100):
    loss = ((policy(seen) - actions) ** 2).mean()
    optimiser.zero_grad()
    loss.backward()
    optimiser.step()
    losses.append(loss.item())
assert losses[-1] < 0.7 * losses[0]

# What is there stays as it is, and what cannot be is said before an episode is played.
for more in (words, [*words[:-1], "new", "--infos", "safty/*"], [*words[:-1], "new",
             "--observe-images", "0", "32"]):  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-m", "hrc_env", *more], capture_output=True, check=False
    )
    assert done.returncode == 2
assert not Path("new").exists()
