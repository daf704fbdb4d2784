"""Requests for a training run, a recording and an export; commands fill these records.

They need neither the simulator nor the learner to be read.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrc_env.core.mapping import merge
from hrc_env.env_words import EnvironmentArguments


@dataclass(frozen=True, kw_only=True)
class TrainingRequest(EnvironmentArguments):
    """A training run: task, learner, budget and evaluation."""

    out: Path = Path("runs/quick")
    """Folder for checkpoints, curves, TensorBoard logs and the film."""
    algorithm: str | None = None
    """Learner: ppo; ppo_lagrangian, which keeps a limit of cost; or sac, which learns with
    hindsight (HER) where the task has goals apart. This, control, demonstrations and timesteps are
    the task's own if not given (agents/recipes.py)."""
    cost_limit: float | None = None
    """With ppo_lagrangian: what an episode may cost (info["cost"], counted on the truth) [control
    steps]."""
    her: bool | None = None
    """With sac: True or False, whether transitions are judged by other goals, too; by default where
    there are goals."""
    demonstrations: int | None = None
    """Episodes of the scripted agent that the policy learns to imitate before it learns itself."""
    timesteps: int | None = None
    """Environment steps in all (with --resume: counted from the start); 0: it only imitates."""
    num_envs: int = 64
    """Environments that step together; with --engine ray, in each worker."""
    engine: str = "sb3"
    """Learner's library: sb3, Stable-Baselines3 on this machine; ray, RLlib's PPO, whose workers
    step environments on the machines of a cluster (docs/many_machines.md). Its policies are the
    same files."""
    workers: int | None = None
    """With --engine ray: processes that step environments; one for each core if not given."""
    address: str | None = None
    """With --engine ray: the cluster, as auto, HOST:6379 or ray://HOST:10001; one on this machine
    if not given."""
    seed: int = 0
    """Seed of the environments and of the learner."""
    perception: str = "keypoints"
    """What the robot learns on: keypoints (camera emulator), truth or none; with --engine ray also
    pixels, which wants many machines."""
    proximity: float | None = None
    """Weight of closeness to the estimated body in the reward; 0 trains without it. 2 if not given,
    but 0 with a limit, which then is all that keeps the robot away."""
    ramp: int = 400_000
    """Environment steps in which that weight grows from 0, and a limit narrows: the task first,
    then care. 0: all of it from the start; the policy learns several times slower, and is more
    careful in the end."""
    threads: int | None = None
    """How many ranges the environments are stepped in at once; all cores by default."""
    episodes: int = 128
    """Episodes of the evaluation at the end."""
    film: bool = True
    """Film the trained policy at the end (needs OpenGL)."""
    resume: Path | None = None
    """A folder of an earlier run to go on with; its environment and seed stay what they were."""

    def keywords(self) -> dict[str, Any]:
        """Keyword arguments of the environment that a run learns and is judged in."""
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
    """A recording: agent, episodes, their contents and their place."""

    agent: str = "scripted"
    """Agent: random, scripted, scripted_slowed, hrc://ID/NAME; the path of a checkpoint of `train`
    or of Stable-Baselines3 (.zip) or of a policy of `export` (.safetensors); or MODULE:FUNCTION, a
    function that is given an EnvInfo and returns an object with act(observation)."""
    trust: bool = False
    """Read pickles in a checkpoint, which run code of whoever made it; see play."""
    episodes: int = 100
    """How many episodes."""
    seed: int = 0
    """Seed of the first episode; the next ones count up."""
    out: str | None = None
    """Name of a Minari data set, with a version: hrc/pick-place/scripted-v0. This or --folder."""
    folder: Path | None = None
    """A folder for the data set, which must not be there yet."""
    infos: tuple[str, ...] = ("cost", "is_success")
    """Which infos are kept, by names or patterns: cost "safety/*" "reward/*"."""
    poses: bool = False
    """Keep the workers' joints, as believed and as they are."""
    keypoints: bool = False
    """Keep the keypoints that the estimator was given; at --perception keypoints."""
    perception: str = "keypoints"
    """What the robot sees with: keypoints (camera emulator), truth or none."""
    num_envs: int = 16
    """Environments that step together, and episodes that are kept at once."""


@dataclass(frozen=True)
class ExportRequest:
    """An export: run, name and evaluation of its policy."""

    run_folder: Path
    """The folder of a run of `train`."""
    name: str
    """What it is to be called: small letters, digits and _."""
    out: Path = Path("policies")
    """Folder for ID/NAME.safetensors and ID/NAME.json."""
    episodes: int = 256
    """Episodes of each evaluation."""
    shields: tuple[str, ...] = ()
    """It is judged as it learnt, and under these shields, too: none, or as of --shield."""
