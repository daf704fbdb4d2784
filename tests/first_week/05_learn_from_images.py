"""A convolutional policy of Stable-Baselines3 takes gradient steps on camera images."""

import torch
from stable_baselines3 import PPO

import hrc_env

torch.set_num_threads(1)
env = hrc_env.HRCVecEnv(
    4, perception="none", n_workers=0, observe_images={"height": 48, "width": 48, "cameras": [1]}
)
learner = PPO("MultiInputPolicy", env, n_steps=32, batch_size=64, n_epochs=2, seed=0, device="cpu")
convolutions = learner.policy.features_extractor.extractors["image_camera_2"]
assert "Conv2d" in str(convolutions)
before = [each.detach().clone() for each in convolutions.parameters()]
learner.learn(256)
after = list(convolutions.parameters())
assert all(torch.isfinite(each).all() for each in after)
assert any(not torch.equal(old, new) for old, new in zip(before, after, strict=True))

# What it does depends on what it sees.
observation = env.reset()
seen = learner.predict(observation, deterministic=True)[0]
dark = {name: 0 * part if name.startswith("image") else part for name, part in observation.items()}
blind = learner.predict(dark, deterministic=True)[0]
assert abs(seen - blind).max() > 1e-4
print(f"{learner.num_timesteps} steps; in the dark actions differ by {abs(seen - blind).max():.3f}")
env.close()
