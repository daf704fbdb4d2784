"""Train a first policy, and compare it with a scripted agent: python examples/first_policy.py

PPO of Stable-Baselines3 learns to reach for goals beside a worker, in minutes on two cores. The
policy is then evaluated on episodes that it has not seen: alone, under a shield, and beside the
scripted agent, on the same seeds. Everything is written into the folder `--out`.
"""

from dataclasses import dataclass
from pathlib import Path

import torch
import tyro
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

import hrc_env

Episodes = list[dict[str, float]]


@dataclass(frozen=True)
class Arguments:
    """Train a first policy on HRCReach-v0."""

    timesteps: int = 500_000
    """Environment steps of the training, in total."""
    num_envs: int = 64
    """Environments that step together."""
    episodes: int = 64
    """Episodes of each evaluation."""
    ramp: int = 400_000
    """Environment steps in which the penalty on closeness grows to its full weight."""
    perception: str = "keypoints"
    """Perception level in training and evaluation."""
    out: Path = Path("runs/first")
    """Folder for the policy."""


def train(arguments: Arguments) -> Path:
    """Train a policy, and return the path of its checkpoint."""
    torch.set_num_threads(1)  # the network is too small for several
    envs = hrc_env.HRCVecEnv(arguments.num_envs, perception=arguments.perception, stagger=True)
    scaled = VecNormalize(envs, norm_obs=False, gamma=0.98)  # rewards only
    model = PPO("MlpPolicy", scaled, **hrc_env.PPOSettings().keywords(), seed=0, verbose=1)
    ramp = hrc_env.ProximityRamp(arguments.ramp)  # the penalty on closeness grows slowly
    model.learn(arguments.timesteps, callback=ramp, log_interval=10)
    path = arguments.out / "policy.zip"
    path.parent.mkdir(parents=True, exist_ok=True)
    model.save(path)
    print(f"The policy is in {path}.")
    envs.close()
    return path


def report(name: str, episodes: Episodes) -> None:
    """Print goals, contacts and cost of an agent with their 95 % intervals."""
    goals = [60 * each["goals_reached"] / each["seconds"] for each in episodes]
    metrics = (
        hrc_env.estimate_mean(goals, "1/min"),
        hrc_env.estimate_rate([each["contacts"] for each in episodes], len(episodes)),
        hrc_env.estimate_mean([each["cost"] for each in episodes], "control steps"),
    )
    cells = (f"{m.value:.2f} ({m.low:.2f} to {m.high:.2f})" for m in metrics)
    print(f"{name:18s}" + "".join(f"{cell:>24s}" for cell in cells))


def compare(ours: str, theirs: str, played: dict[str, Episodes]) -> None:
    """Print the difference in cost between two agents on the same seeds."""
    ours_cost, theirs_cost = ([each["cost"] for each in played[name]] for name in (ours, theirs))
    difference = hrc_env.compare_means(ours_cost, theirs_cost, "control steps").difference
    text = f"{difference.value:.2f} ({difference.low:.2f} to {difference.high:.2f})"
    print(f"cost of ({ours}) minus ({theirs}): {text}")


def main(arguments: Arguments) -> None:
    """Train, evaluate and compare."""
    policy = str(train(arguments))
    agents = {
        "scripted": ("scripted", None),
        "policy": (policy, None),
        "policy, shield qp": (policy, "qp"),
    }
    print(f"{'':18s}{'goals [1/min]':>24s}{'contacts':>24s}{'cost [steps]':>24s}")
    played: dict[str, Episodes] = {}
    for name, (agent, shield) in agents.items():
        played[name] = hrc_env.evaluate_episodes(
            agent, arguments.episodes, perception=arguments.perception, shield=shield
        )
        report(name, played[name])
    compare("policy", "scripted", played)
    compare("policy, shield qp", "policy", played)


if __name__ == "__main__":
    main(tyro.cli(Arguments))
