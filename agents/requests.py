"""Requests for a training run, a recording and an export, which commands fill.

They can be read without simulator and learner.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrc_env.core.mapping import merge
from hrc_env.env_words import EnvironmentArguments


@dataclass(frozen=True, kw_only=True)
class TrainingRequest(EnvironmentArguments):
    """Request for a training run: task, learner, budget and evaluation."""

    out: Path = Path("runs/quick")
    """Folder for checkpoints, curves, TensorBoard logs and the film."""
    algorithm: str | None = None
    """Learner: ppo; ppo_lagrangian, with a cost limit; or sac, with hindsight (HER) if the task has
    separate goals. Defaults of this, control, demonstrations and timesteps are the task's
    (agents/recipes.py)."""
    cost_limit: float | None = None
    """With ppo_lagrangian: limit of the cost of an episode (info["cost"], computed from the truth)
    [control steps]."""
    her: bool | None = None
    """With sac: True or False, whether transitions are also relabelled with other goals (default:
    if the task has goals)."""
    demonstrations: int | None = None
    """Number of episodes of the scripted agent that the policy imitates before it is trained."""
    timesteps: int | None = None
    """Environment steps in total (with --resume: counted from the start); 0: imitation only."""
    num_envs: int = 64
    """Number of environments that step together; with --engine ray, in each worker."""
    engine: str = "sb3"
    """Library of the learner: sb3, Stable-Baselines3 on this machine; ray, RLlib's PPO with workers
    that step environments on the machines of a cluster (docs/many_machines.md). Policies are the
    same files."""
    workers: int | None = None
    """With --engine ray: number of processes that step environments (default: one per core)."""
    address: str | None = None
    """With --engine ray: the cluster, as auto, HOST:6379 or ray://HOST:10001 (default: one on this
    machine)."""
    seed: int = 0
    """Seed of the environments and of the learner."""
    perception: str = "keypoints"
    """Perception in the training: keypoints (camera emulator), truth or none; with --engine ray
    also pixels, which needs many machines."""
    proximity: float | None = None
    """Weight of proximity to the estimated body in the reward; 0 trains without it (default: 2, and
    0 with a cost limit)."""
    ramp: int = 400_000
    """Environment steps in which that weight grows from 0, and a cost limit narrows, so that the
    task is learnt first. 0: constant from the start; the policy learns several times slower, and is
    more careful in the end."""
    threads: int | None = None
    """Number of threads that step the environments (default: all cores)."""
    episodes: int = 128
    """Number of episodes of the evaluation at the end."""
    film: bool = True
    """Film the trained policy at the end (needs OpenGL)."""
    resume: Path | None = None
    """Folder of an earlier run to continue; its environment and seed do not change."""

    def keywords(self) -> dict[str, Any]:
        """Return the keyword arguments of the environment for training and evaluation."""
        given = super().keywords()
        safety = {} if self.proximity is None else {"reward": {"proximity": self.proximity}}
        config = merge(safety, given.get("config", {}))
        threads = {} if self.perception == "pixels" else {"num_threads": self.threads}
        return {**given, "config": config, **threads}

    def batched_keywords(self) -> dict[str, Any]:
        """Keyword arguments of a batch with the same spaces: level pixels has no batched form."""
        given = self.keywords()
        return {**given, "perception": "keypoints"} if self.perception == "pixels" else given


@dataclass(frozen=True, kw_only=True)
class RecordingRequest(EnvironmentArguments):
    """Request for a recording: agent, episodes, contents and place."""

    agent: str = "scripted"
    """Agent: random, scripted, scripted_slowed, hrc://ID/NAME; the path of a checkpoint of `train`
    or of Stable-Baselines3 (.zip) or of a policy of `export` (.safetensors); or MODULE:FUNCTION, a
    function that takes an EnvInfo and returns an object with act(observation)."""
    trust: bool = False
    """Load pickles in a checkpoint, which can run arbitrary code; see play."""
    episodes: int = 100
    """Number of episodes."""
    seed: int = 0
    """Seed of the first episode; later ones count up."""
    out: str | None = None
    """Name of a Minari data set, with a version: hrc/pick-place/scripted-v0. This or --folder."""
    folder: Path | None = None
    """A new folder for the data set."""
    infos: tuple[str, ...] = ("cost", "is_success")
    """Infos to record, by names or patterns: cost "safety/*" "reward/*"."""
    poses: bool = False
    """Record the workers' joints, estimated and true."""
    keypoints: bool = False
    """Record the keypoints that the estimator receives; with --perception keypoints."""
    perception: str = "keypoints"
    """Perception of the robot: keypoints (camera emulator), truth or none."""
    num_envs: int = 16
    """Number of environments that step together, and of episodes that are stored at once."""


@dataclass(frozen=True)
class ExportRequest:
    """Request for an export: run, name and evaluation of its policy."""

    run_folder: Path
    """Folder of a run of `train`."""
    name: str
    """Name of the policy: small letters, digits and _."""
    out: Path = Path("policies")
    """Folder for ID/NAME.safetensors and ID/NAME.json."""
    episodes: int = 256
    """Number of episodes of each evaluation."""
    shields: tuple[str, ...] = ()
    """Further shields for evaluations besides that of the training: none, or as --shield."""
