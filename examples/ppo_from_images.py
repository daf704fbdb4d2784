"""PPO that reaches from camera images: python examples/ppo_from_images.py

A policy of Stable-Baselines3 with convolutions moves the tool to goals one after another. It is
given two camera images and the place of the goal, and nothing of the robot itself.

    --sees pixels --pretrain 0       everything is learnt from the reward
    --sees pixels                    the convolutions first learn where the tool is, from images and
                                     what the encoders say at the same time; then PPO learns to act
    --sees belief                    the same recipe without images, to compare with

OUT/curve.png and OUT/curve.json have the goals reached, OUT/policy.zip is the policy. After 120,000
steps mean actions reached, in 32 new episodes, 95 goals a minute from the belief, 79 from images
after teaching, and 17 from images by reward alone (`examples/ppo_from_images.png` has the curves).
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
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor, NatureCNN
from stable_baselines3.common.vec_env import VecEnvWrapper, VecNormalize
from torch import Tensor, nn

from hrc_env import CameraConfig, HRCVecEnv

MIDDLE_M = np.array((-0.1, 0.0, 1.1))
"""Middle of the goals' positions, in the world frame [m]."""
CAMERAS = tuple(
    CameraConfig(name, eye_world, tuple(MIDDLE_M), 42.0, width_px=720, height_px=720)
    for name, eye_world in (("front", (1.5, -0.5, 1.5)), ("side", (-0.1, -2.0, 1.7)))
)
"""Near enough that a goal's radius is several pixels."""
GOALS = {"azimuth_rad": (-0.7, 0.7), "height_m": (0.85, 1.35), "radius_m": 0.08}
GOAL_SCALE = 2.0
"""Unit in which goals are observed: half a metre."""
GAMMA = 0.95
POINTS = "steps, minutes, goals a minute"
RECENT = 64
"""Number of episodes whose mean the curve shows."""


@dataclass(frozen=True)
class Arguments:
    """Learn to reach from images."""

    sees: Literal["pixels", "belief"] = "pixels"
    """Input of the policy."""
    pretrain: int = 16_000
    """Images from which the convolutions first learn the position of the tool; 0: no such
    training."""
    timesteps: int = 120_000
    """Environment steps of PPO."""
    out: Path = Path("runs/images")
    """Folder for the curve and the policy."""
    beside: tuple[Path, ...] = ()
    """Folders of other runs, whose curves are added to the plot."""
    size: int = 64
    """Sides of the images [px]; SB3's convolutions need 36 or more."""
    num_envs: int = 32
    """Environments that step together."""
    seed: int = 0
    """Seed of environments and learner."""


class Seen(VecEnvWrapper):
    """Replaces the belief by both images as channels of one, and the position of the goal."""

    def __init__(self, venv: HRCVecEnv, size: int) -> None:
        image = Box(0, 255, (size, size, 3 * len(CAMERAS)), np.uint8)
        goal = Box(-np.inf, np.inf, (3,), np.float32)
        super().__init__(venv, observation_space=Dict({"image": image, "goal": goal}))
        self.tool: Any = None
        """Tool positions by the encoders relative to `MIDDLE_M`, (num_envs, 3) [m]."""

    def seen(self, observation: Any) -> dict[str, Any]:
        """Return the policy's input from observations (B, ...) or from one."""
        terms = self.venv.env_method("split_observation", observation, indices=[0])[0]
        self.tool = terms["tool_position"] - MIDDLE_M
        goal = (GOAL_SCALE * (self.tool + terms["goal_from_tool"])).astype(np.float32)
        images = [observation[f"image_{camera.name}"] for camera in CAMERAS]
        return {"image": np.concatenate(images, axis=-1), "goal": goal}

    def reset(self) -> Any:
        """Start every environment."""
        return self.seen(self.venv.reset())

    def step_wait(self) -> Any:
        """Step all environments; the last observations of episodes are in infos."""
        observation, reward, done, infos = self.venv.step_wait()
        for info in infos:
            if "terminal_observation" in info:
                info["terminal_observation"] = self.seen(info["terminal_observation"])
        return self.seen(observation), reward, done, infos


class Locating(BaseFeaturesExtractor):
    """Position of the tool estimated from the images, beside the goal; trained beforehand and then
    frozen."""

    def __init__(self, observation_space: Dict) -> None:
        super().__init__(observation_space, features_dim=6)
        self.convolutions = NatureCNN(observation_space["image"], 256)
        self.place = nn.Linear(256, 3)

    def locate(self, image: Tensor) -> Tensor:
        """Estimate the tool's position relative to `MIDDLE_M`, (B, 3) [m], from images (B, C, H, W)
        in [0, 1]."""
        return self.place(self.convolutions(image))

    def forward(self, observations: dict[str, Tensor]) -> Tensor:
        """Return tool and goal relative to `MIDDLE_M`, (B, 6), in quarters of a metre."""
        with torch.no_grad():
            tool = self.locate(observations["image"])
        return torch.cat([4 * tool, 4 / GOAL_SCALE * observations["goal"]], dim=1)


def pretrain(locating: Locating, env: Seen, n_images: int, n_epochs: int = 12) -> float:
    """Train the position of the tool while it wanders about its goals; return the mean error on new
    images [m]."""
    rng, images, places, seen = np.random.default_rng(0), [], [], env.reset()
    for _ in range(-(-n_images // env.num_envs)):
        images.append(seen["image"].transpose(0, 3, 1, 2))
        places.append(env.tool)
        action = 6 * (seen["goal"] / GOAL_SCALE - env.tool) + rng.normal(0, 1, env.tool.shape)
        seen = env.step(np.clip(action, -1, 1).astype(np.float32))[0]
    image = torch.as_tensor(np.concatenate(images))
    place = torch.as_tensor(np.concatenate(places), dtype=torch.float32)
    n_train = int(0.9 * len(image))
    optimiser = torch.optim.Adam(locating.parameters(), 1e-3)
    for epoch in range(n_epochs):
        optimiser.param_groups[0]["lr"] = 1e-3 * (1 - epoch / n_epochs)
        for batch in np.array_split(rng.permutation(n_train), n_train // 128):
            off = locating.locate(image[batch] / 255.0) - place[batch]
            optimiser.zero_grad()
            (100 * off.square().mean()).backward()
            optimiser.step()
    with torch.no_grad():
        errors = [
            (locating.locate(some / 255.0) - there).norm(dim=1)
            for some, there in zip(
                image[n_train:].split(256), place[n_train:].split(256), strict=True
            )
        ]
    return float(torch.cat(errors).mean())


class Curve(BaseCallback):
    """Goals reached during training, as numbers and as a plot."""

    def __init__(self, arguments: Arguments) -> None:
        super().__init__()
        self.arguments, self.started_s = arguments, time.monotonic()
        self.points: list[tuple[int, float, float]] = []
        """Steps, minutes, goals a minute."""
        self.ended: list[tuple[float, float]] = []

    @property
    def minutes(self) -> float:
        """Time since the start [min]."""
        return (time.monotonic() - self.started_s) / 60

    def _on_step(self) -> bool:
        ended = [info["episode"] for info in self.locals["infos"] if "episode" in info]
        self.ended += [(each["goals_reached"], each["seconds"] / 60) for each in ended]
        return True

    def _on_rollout_end(self) -> None:
        if not self.ended:
            return
        goals, played_min = np.sum(self.ended[-RECENT:], axis=0).tolist()
        self.points.append((self.num_timesteps, self.minutes, goals / played_min))
        said = f"{self.minutes:6.1f} min {goals / played_min:5.1f} goals a minute"
        print(f"{self.num_timesteps:8d} steps {said}", flush=True)
        self._write(self.arguments.out)

    def _write(self, out: Path) -> None:
        out.mkdir(parents=True, exist_ok=True)
        content = {**asdict(self.arguments), POINTS: self.points}
        (out / "curve.json").write_text(json.dumps(content, default=str))
        self.model.save(out / "policy.zip")
        draw([out, *self.arguments.beside], out / "curve.png")


def draw(runs: list[Path], path: Path) -> None:
    """Draw the curves of runs, by the names of their folders."""
    axis = (figure := Figure((6, 4))).subplots()
    for run in runs:
        steps, _, goals = np.array(json.loads((run / "curve.json").read_text())[POINTS]).T
        axis.plot(steps, goals, label=run.name.replace("_", " "))
    axis.set(xlabel="environment steps of PPO", ylabel="goals a minute", ylim=(0, None))
    axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)
    figure.savefig(path, dpi=120, bbox_inches="tight")


def make_env(arguments: Arguments) -> Any:
    """Return environments without people, because reaching is learned first."""
    looks = arguments.sees == "pixels"
    venv = HRCVecEnv(
        arguments.num_envs, task="HRCReach-v0", perception="none", n_workers=0, control="tool",
        cameras=CAMERAS, observe_images=(arguments.size, arguments.size) if looks else None,
        config={"task": GOALS}, stagger=True, seed=arguments.seed, num_threads=1,
    )  # fmt: skip
    return Seen(venv, arguments.size) if looks else venv


def make_learner(arguments: Arguments, env: Any) -> PPO:
    """Return a fresh PPO on the environments."""
    policy: dict[str, Any] = {"log_std_init": -0.7, "net_arch": [128, 128]}
    if arguments.sees == "pixels" and arguments.pretrain:
        policy["features_extractor_class"] = Locating
    elif arguments.sees == "pixels":
        policy["features_extractor_kwargs"] = {"cnn_output_dim": 128}
    return PPO(
        "MlpPolicy" if arguments.sees == "belief" else "MultiInputPolicy",
        VecNormalize(env, norm_obs=False, gamma=GAMMA), n_steps=64, batch_size=256, n_epochs=4,
        learning_rate=5e-4, gamma=GAMMA, seed=arguments.seed, device="cpu", policy_kwargs=policy,
    )  # fmt: skip


def main(arguments: Arguments) -> None:
    """Train the policy, and draw the curve during training."""
    torch.set_num_threads(1)
    env = make_env(arguments)
    learner, curve = make_learner(arguments, env), Curve(arguments)
    if arguments.sees == "pixels" and arguments.pretrain:
        error_m = pretrain(learner.policy.features_extractor, env, arguments.pretrain)
        said = f"the convolutions find the tool to {100 * error_m:.1f} cm"
        print(f"{curve.minutes:6.1f} min {said}", flush=True)
        env.venv.seed(arguments.seed)  # PPO begins at random phases of episodes
    learner.learn(arguments.timesteps, callback=curve)
    env.close()


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
