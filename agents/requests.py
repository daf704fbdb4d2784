"""Arguments of the commands `train`, `record` and `export`.

This module imports neither the simulator nor a learner.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrc_env.core.mapping import merge
from hrc_env.env_words import EnvironmentArguments


@dataclass(frozen=True, kw_only=True)
class TrainingRequest(EnvironmentArguments):
    """Arguments of a training run: task, learner, budget and evaluation."""

    out: Path = Path("runs/quick")
    """Folder for checkpoints, curves, TensorBoard logs and the film."""
    algorithm: str | None = None
    """Learner: ppo; ppo_lagrangian, with a cost limit; or sac, with hindsight (HER) if the task has
    separate goals. By default, the task's recipe (agents/learner_settings.py) sets algorithm,
    control, demonstrations and timesteps.
    """
    cost_limit: float | None = None
    """With ppo_lagrangian: maximum mean cost of an episode with the mean actions of the delivered
    policy (info["cost"], computed from the true state) [control steps] (default: the budget of the
    task, docs/safe_rl.md).
    """
    her: bool | None = None
    """With sac: whether transitions are also relabelled with other goals, True or False (default:
    True if the task has goals)."""
    demonstrations: int | None = None
    """Number of episodes of the scripted agent that the policy imitates before it is trained."""
    timesteps: int | None = None
    """Total number of environment steps (with --resume: from the start); 0: imitation only."""
    num_envs: int = 64
    """Number of parallel environments; with --engine ray, in each worker."""
    engine: str = "sb3"
    """Library of the learner: sb3, Stable-Baselines3 on this machine; ray, RLlib's PPO with workers
    that step environments on the machines of a cluster (docs/many_machines.md). Both write the
    same kind of policy files."""
    workers: int | None = None
    """With --engine ray: number of processes that step environments (default: one per core)."""
    address: str | None = None
    """With --engine ray: address of the cluster, e.g. auto, HOST:6379 or ray://HOST:10001 (default:
    start one on this machine)."""
    seed: int = 0
    """Seed of the environments and of the learner."""
    perception: str = "keypoints"
    """Perception level during training: keypoints (camera emulator), truth or none; with --engine
    ray also pixels, which needs many machines.
    """
    proximity: float | None = None
    """Weight of the reward's penalty for proximity to estimated workers; 0 disables it (default: 2,
    or 0 with a cost limit).
    """
    observe_shield: bool = False
    """Observe the change of the last command by the shield; needs --shield."""
    forecast_s: tuple[float, ...] = ()
    """Observe forecasts of the workers' joints at these horizons, each in (0, 1] [s], e.g. 0.2 0.4.
    """
    shield_change: float | None = None
    """Weight of the reward's penalty on the change of the command by the shield: its mean square,
    relative to the fastest joint velocities (default: 0); needs --shield.
    """
    ramp: int = 400_000
    """Environment steps over which the proximity weight grows from 0, or the cost limit tightens,
    to learn the task first. With 0, both are constant: the policy learns several times slower, but
    is more careful in the end.
    """
    threads: int | None = None
    """Number of threads that step the environments (default: all cores)."""
    episodes: int = 128
    """Number of episodes of the evaluation at the end."""
    film: bool = True
    """Film the trained policy at the end (needs OpenGL)."""
    resume: Path | None = None
    """Folder of an earlier run to continue; its environment and seed do not change."""

    def keywords(self) -> dict[str, Any]:
        """Return the environment's keyword arguments for training and evaluation."""
        given = super().keywords()
        weights = {"proximity": self.proximity, "shield_change": self.shield_change}
        reward = {name: each for name, each in weights.items() if each is not None}
        asked: dict[str, Any] = {"reward": reward} if reward else {}
        if self.observe_shield:
            asked["observe_shield"] = True
        if self.forecast_s:
            asked["forecast_s"] = self.forecast_s
        config = merge(asked, given.get("config", {}))
        threads = {} if self.perception == "pixels" else {"num_threads": self.threads}
        return {**given, "config": config, **threads}

    def batched_keywords(self) -> dict[str, Any]:
        """Return the keyword arguments of batched environments, with keypoints in place of pixels.

        The perception level `pixels` cannot be batched; its spaces are those of `keypoints`.
        """
        given = self.keywords()
        return {**given, "perception": "keypoints"} if self.perception == "pixels" else given


@dataclass(frozen=True, kw_only=True)
class RecordingRequest(EnvironmentArguments):
    """Arguments of a recording: agent, episodes, contents and destination."""

    agent: str = "scripted"
    """Agent: random, scripted, scripted_slowed, hrc://ID/NAME; the path of a checkpoint of `train`
    or of Stable-Baselines3 (.zip) or of a policy of `export` (.safetensors); or MODULE:FUNCTION, a
    function that takes an EnvInfo and returns an object with act(observation)."""
    trust: bool = False
    """Load pickles in a checkpoint; they can run arbitrary code (see the command play)."""
    episodes: int = 100
    """Number of episodes."""
    seed: int = 0
    """Seed of the first episode; it increases by one with each further episode."""
    out: str | None = None
    """Name of a new Minari data set with its version, e.g. hrc/pick-place/scripted-v0; or use
    --folder.
    """
    folder: Path | None = None
    """New folder for the data set; or use --out."""
    infos: tuple[str, ...] = ("cost", "is_success")
    """Infos to record, as names or patterns, e.g. cost "safety/*" "reward/*"."""
    poses: bool = False
    """Record the estimated and true joints of workers."""
    keypoints: bool = False
    """Record the keypoints that the estimator receives (needs --perception keypoints)."""
    perception: str = "keypoints"
    """Perception level: keypoints (camera emulator), truth or none."""
    num_envs: int = 16
    """Number of parallel environments, and of episodes that are written together."""

    def keywords(self) -> dict[str, Any]:
        """Return the environment's keyword arguments, completed by those that the agent needs."""
        from .registry import find_interface  # here: it imports the simulator

        return find_interface(self.agent).complete(super().keywords())


@dataclass(frozen=True)
class ExportRequest:
    """Arguments of an export: training run, name of the policy, and evaluation."""

    run_folder: Path
    """Folder of a training run."""
    name: str
    """Name of the policy, consisting of lowercase letters, digits and _."""
    out: Path = Path("policies")
    """Folder in which ID/NAME.safetensors and ID/NAME.json are written."""
    episodes: int = 256
    """Number of episodes of each evaluation."""
    shields: tuple[str, ...] = ()
    """Shields for evaluations in addition to that of the training: none, or values of --shield."""
