"""PPO that reaches from camera images: python examples/ppo_from_images.py

A convolutional policy of Stable-Baselines3 moves the tool to goals one after another. What it is
given is `--sees`:

    pixels   two camera images and the place of the goal, nothing of the robot itself
    both     the same images beside the whole belief, as `observe_images` gives it
    belief   the belief alone: the same recipe without images, to compare with

The curve is written to OUT/curve.png and OUT/curve.json, the policy to OUT/policy.zip.
"""

import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
import tyro
from gymnasium.spaces import Box, Dict
from matplotlib.figure import Figure
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnvWrapper, VecNormalize

from hrc_env import CameraConfig, HRCVecEnv

CAMERAS = (
    CameraConfig("front", (1.5, -0.5, 1.5), (-0.1, 0.0, 1.1), 42.0, width_px=720, height_px=720),
    CameraConfig("side", (-0.1, -2.0, 1.7), (-0.1, 0.0, 1.1), 42.0, width_px=720, height_px=720),
)
"""Near enough that a goal's radius is several pixels."""
GOALS = {"azimuth_rad": (-0.7, 0.7), "height_m": (0.85, 1.35), "radius_m": 0.08}
RECENT = 64
"""Episodes of which the curve shows the mean."""


@dataclass(frozen=True)
class Arguments:
    """Learn to reach from images."""

    sees: Literal["pixels", "both", "belief"] = "pixels"
    """What the policy is given."""
    timesteps: int = 200_000
    """Environment steps in all."""
    out: Path = Path("runs/images")
    """Folder for the curve and the policy."""
    size: int = 64
    """Sides of the images [px]; SB3's convolutions need 36 or more."""
    pretrain: int = 0
    """Images from which the convolutions first learn where the tool is, before PPO begins."""
    num_envs: int = 32
    """Environments that step together."""
    seed: int = 0
    """Seed of environments and learner."""


class Seen(VecEnvWrapper):
    """What the policy is given of an observation: images as channels of one, and numbers."""

    def __init__(self, venv: HRCVecEnv, sees: str) -> None:
        super().__init__(venv)
        spaces = dict(venv.observation_space.spaces) if sees != "belief" else {}
        self.images = [name for name in spaces if name.startswith("image_")]
        self.sees = sees
        if sees == "belief":
            return
        shape = spaces[self.images[0]].shape
        image = Box(0, 255, (*shape[:2], 3 * len(self.images)), np.uint8)
        numbers = (
            Box(-np.inf, np.inf, (3,), np.float32) if sees == "pixels" else spaces["observation"]
        )
        self.observation_space = Dict({"image": image, "numbers": numbers})

    def part(self, observation: Any) -> Any:
        """Of observations (B, ...) or of one."""
        if self.sees == "belief":
            return observation
        numbers = observation["observation"]
        if self.sees == "pixels":
            terms = self.venv.env_method("split_observation", observation, indices=[0])[0]
            goal_world = terms["tool_position"] + terms["goal_from_tool"]
            numbers = (2.0 * (goal_world - (-0.1, 0.0, 1.1))).astype(np.float32)
        image = np.concatenate([observation[name] for name in self.images], axis=-1)
        return {"image": image, "numbers": numbers}

    def reset(self) -> Any:
        """Start every environment."""
        return self.part(self.venv.reset())

    def step_wait(self) -> Any:
        """Step them."""
        observation, reward, done, infos = self.venv.step_wait()
        for info in infos:
            if "terminal_observation" in info:
                info["terminal_observation"] = self.part(info["terminal_observation"])
        return self.part(observation), reward, done, infos


def pretrain(learner: PPO, env: Seen, n_images: int, n_epochs: int = 12) -> float:
    """Teach the convolutions of a policy where the tool is, as the encoders have it.

    Returns:
        The error of new images in the end, a mean [m].
    """
    rng, images, places, observation = np.random.default_rng(0), [], [], env.venv.reset()
    for _ in range(-(-n_images // env.num_envs)):
        terms = env.venv.env_method("split_observation", observation, indices=[0])[0]
        images.append(env.part(observation)["image"].transpose(0, 3, 1, 2))
        places.append(terms["tool_position"])
        wander = 6 * terms["goal_from_tool"] + rng.normal(0, 1, (env.num_envs, 3))
        observation = env.venv.step(np.clip(wander, -1, 1).astype(np.float32))[0]
    seen, told = (
        np.concatenate(images),
        torch.as_tensor(np.concatenate(places), dtype=torch.float32),
    )
    network = learner.policy.features_extractor.extractors["image"]
    head = torch.nn.Linear(network.features_dim, 3)
    optimiser = torch.optim.Adam([*network.parameters(), *head.parameters()], 1e-3)
    n_train = int(0.9 * len(seen))
    for epoch in range(n_epochs):
        for group in optimiser.param_groups:
            group["lr"] = 1e-3 * (1 - epoch / n_epochs)
        for batch in np.array_split(rng.permutation(n_train), n_train // 128):
            off = head(network(torch.as_tensor(seen[batch]) / 255.0)) - told[batch]
            optimiser.zero_grad()
            (100 * off.square().mean()).backward()
            optimiser.step()
    with torch.no_grad():
        off = head(network(torch.as_tensor(seen[n_train:]) / 255.0)) - told[n_train:]
    return float(off.norm(dim=1).mean())


class Curve(BaseCallback):
    """Goals that episodes reached while it learnt, and a checkpoint every minute."""

    def __init__(self, arguments: Arguments) -> None:
        super().__init__()
        self.arguments, self.started_s, self.points = arguments, time.monotonic(), []
        self.ended: list[tuple[float, float]] = []

    def _on_step(self) -> bool:
        ended = [info["episode"] for info in self.locals["infos"] if "episode" in info]
        self.ended += [(each["goals_reached"], each["seconds"] / 60) for each in ended]
        return True

    def _on_rollout_end(self) -> None:
        minutes = (time.monotonic() - self.started_s) / 60
        if self.ended:
            goals, played_min = np.sum(self.ended[-RECENT:], axis=0).tolist()
            self.points.append([self.num_timesteps, minutes, goals / played_min])
            said = f"{minutes:6.1f} min  {goals / played_min:5.1f} goals a minute"
            print(f"{self.num_timesteps:8d} steps {said}", flush=True)
            self.write()

    def write(self) -> None:
        """Write curve and policy."""
        out = self.arguments.out
        out.mkdir(parents=True, exist_ok=True)
        content = {
            "arguments": asdict(self.arguments),
            "steps, minutes, goals a minute": self.points,
        }
        (out / "curve.json").write_text(json.dumps(content, default=str))
        self.model.save(out / "policy.zip")
        axis = (figure := Figure((6, 4))).subplots()
        axis.plot(*np.array(self.points)[:, [0, 2]].T)
        axis.set(xlabel="environment steps", ylabel="goals reached a minute", ylim=(0, None))
        axis.set_title(f"PPO, {self.arguments.sees}")
        figure.savefig(out / "curve.png", dpi=120, bbox_inches="tight")


def make(arguments: Arguments) -> Seen:
    """Return the environments, without people: the arm and its goals are learnt first."""
    images = None if arguments.sees == "belief" else (arguments.size, arguments.size)
    venv = HRCVecEnv(
        arguments.num_envs, task="HRCReach-v0", perception="none", n_workers=0, control="tool",
        cameras=CAMERAS, observe_images=images, config={"task": GOALS}, stagger=True,
        seed=arguments.seed, num_threads=1,
    )  # fmt: skip
    return Seen(venv, arguments.sees)


def main(arguments: Arguments) -> None:
    """Learn, drawing the curve as it goes."""
    torch.set_num_threads(1)
    env = make(arguments)
    policy = "MlpPolicy" if arguments.sees == "belief" else "MultiInputPolicy"
    kind = (
        {} if arguments.sees == "belief" else {"features_extractor_kwargs": {"cnn_output_dim": 128}}
    )
    learner = PPO(
        policy, VecNormalize(env, norm_obs=False, gamma=0.95), n_steps=64, batch_size=256, n_epochs=4, learning_rate=5e-4, gamma=0.95,
        seed=arguments.seed, device="cpu", policy_kwargs={"log_std_init": -0.7, "net_arch": [128, 128], **kind},
    )  # fmt: skip
    curve = Curve(arguments)
    if arguments.pretrain:
        error_m = pretrain(learner, env, arguments.pretrain)
        minutes = (time.monotonic() - curve.started_s) / 60
        print(f"{minutes:.1f} min", end=": ")
        print(f"the convolutions find the tool to {100 * error_m:.1f} cm")
    learner.learn(arguments.timesteps, callback=curve)
    env.close()


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
