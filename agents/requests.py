"""Arguments of the commands that train, record and export.

This module needs neither the simulator nor a learner.
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
    separate goals. By default, the task's recipe (agents/recipes.py) sets this, control,
    demonstrations and timesteps."""
    cost_limit: float | None = None
    """With ppo_lagrangian: limit of the cost of an episode (info["cost"], computed from the truth)
    [control steps]."""
    her: bool | None = None
    """With sac: whether transitions are also relabelled with other goals, True or False (default:
    True if the task has goals)."""
    demonstrations: int | None = None
    """Number of episodes of the scripted agent that the policy imitates before it is trained."""
    timesteps: int | None = None
    """Environment steps in total (with --resume: counted from the start); 0: imitation only."""
    num_envs: int = 64
    """Number of environments that step together; with --engine ray, in each worker."""
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
    """Perception during training: keypoints (camera emulator), truth or none; with --engine ray
    also pixels, which needs many machines."""
    proximity: float | None = None
    """Weight of proximity to the estimated body in the reward; 0 trains without it (default: 2, and
    0 with a cost limit)."""
    ramp: int = 400_000
    """Environment steps over which the proximity weight grows from 0, or a cost limit tightens, to
    learn the task first. With 0, both are constant: the policy learns several times slower and is
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
        """Return the arguments of batched environments: keypoints in place of pixels.

        Level `pixels` has no batched form; the spaces are the same.
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
    """Load pickles in a checkpoint, which can run arbitrary code; see play."""
    episodes: int = 100
    """Number of episodes."""
    seed: int = 0
    """Seed of the first episode; it increases by one with each further episode."""
    out: str | None = None
    """Name of a Minari data set with version, e.g. hrc/pick-place/scripted-v0; or use --folder."""
    folder: Path | None = None
    """New folder for the data set; or use --out."""
    infos: tuple[str, ...] = ("cost", "is_success")
    """Infos to record, as names or patterns, e.g. cost "safety/*" "reward/*"."""
    poses: bool = False
    """Record the estimated and true joints of workers."""
    keypoints: bool = False
    """Record the keypoints that the estimator receives (needs --perception keypoints)."""
    perception: str = "keypoints"
    """Perception of the robot: keypoints (camera emulator), truth or none."""
    num_envs: int = 16
    """Number of environments that step together, and of episodes that are written together."""


@dataclass(frozen=True)
class ExportRequest:
    """Arguments of an export: run, name of the policy, and evaluation."""

    run_folder: Path
    """Folder of a run of `train`."""
    name: str
    """Name of the policy, of lowercase letters, digits and _."""
    out: Path = Path("policies")
    """Folder for ID/NAME.safetensors and ID/NAME.json."""
    episodes: int = 256
    """Number of episodes of each evaluation."""
    shields: tuple[str, ...] = ()
    """Shields for further evaluations besides that of the training: none, or values of --shield."""
