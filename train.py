"""Train a policy with PPO, evaluate it on fixed seeds, draw its learning curve and film it.

    python train.py                                           # minutes on two cores
    python train.py --resume runs/quick --timesteps 2000000   # go on where it stopped
    python train.py --proximity 0 --out runs/reckless         # without the safety term
    tensorboard --logdir runs

What lies in a folder is never overwritten: a second run into runs/quick goes to runs/quick-2.
"""

import json
import sys
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import torch
import tyro

from agents import ppo
from agents.base import Situation
from agents.curriculum import ProximityCurriculum, Ramp
from agents.evaluate import evaluate
from agents.monitor import Curve, TrainingMonitor, plot_curve
from hrc_env.config import resolve
from hrc_env.errors import CheckpointError, HRCError, RenderingError
from hrc_env.provenance import provenance
from hrc_env.sb3 import HRCVecEnv


@dataclass(frozen=True)
class Arguments:
    """Train PPO on HRCReach-v0."""

    out: Path = Path("runs/quick")
    """Folder for checkpoints, curves, TensorBoard logs and the film."""
    timesteps: int = 1_000_000
    """Environment steps in all (with --resume: counted from the very start)."""
    num_envs: int = 64
    """Environments that step together."""
    seed: int = 0
    """Seed of the environments and of the learner."""
    perception: str = "keypoints"
    """What the robot learns on: keypoints (camera emulator), truth or none."""
    estimator: str = "particle"
    """particle, kalman, paper or triangulation."""
    control: str = "joint"
    """joint or tool."""
    proximity: float = 2.0
    """Weight of closeness to the estimated body in the reward; 0 trains without it."""
    ramp: int = 400_000
    """Environment steps in which that weight grows from 0: the task first, then care. 0: all of
    it from the start; the policy learns several times slower, and is more careful in the end."""
    threads: int | None = None
    """How many ranges the environments are stepped in at once; all cores by default."""
    backend: str = "threads"
    """Where those beside the first live: threads, or processes of their own. The policy is the
    same."""
    episodes: int = 128
    """Episodes of the evaluation at the end."""
    film: bool = True
    """Film the trained policy at the end (needs OpenGL)."""
    resume: Path | None = None
    """A folder of an earlier run to go on with; its environment and seed stay what they were."""


FILM_SEEDS = 8
"""The film shows that of so many episodes which comes closest to the worker."""
LEARNT_WITH = ("num_envs", "seed", "perception", "estimator", "control", "proximity", "ramp")
"""Arguments that a resumed run takes from the run that it goes on with."""


def main(arguments: Arguments) -> None:
    """Train, evaluate, draw, film."""
    torch.set_num_threads(1)  # two are slower in networks as small as these
    folder = arguments.resume or unused(arguments.out)
    if arguments.resume is not None:
        arguments = as_before(arguments, folder)
    folder.mkdir(parents=True, exist_ok=True)
    kwargs = environment_arguments(arguments)
    config = asdict(resolve(kwargs["config"]))
    _write(folder / "run.json", {"arguments": _plain(arguments), "config": config, **provenance()})
    curve, seconds = train(arguments, folder, kwargs)
    print(f"Evaluating {arguments.episodes} episodes on fixed seeds ...")
    checkpoint = folder / "policy.zip"
    score = evaluate(lambda here: ppo.load(checkpoint, here), arguments.episodes, **kwargs)
    _write(folder / "score.json", {**score.as_dict(), "training_s": seconds})
    title = f"PPO, {arguments.perception}, proximity weight {arguments.proximity:g}"
    plot_curve(curve, folder / "curve.png", title)
    for name, value in score.as_dict().items():
        print(f"  {name:28s} {value:.3f}")
    if arguments.film:
        film(checkpoint, folder / "policy.mp4", arguments, kwargs)
    print(f"Policy, curve and film are in {folder}/")


def unused(folder: Path) -> Path:
    """The folder, or the next of folder-2, folder-3, ... in which nobody has learnt."""
    candidate, number = folder, 1
    while (candidate / "policy.zip").exists():
        number += 1
        candidate = folder.with_name(f"{folder.name}-{number}")
    return candidate


def as_before(arguments: Arguments, folder: Path) -> Arguments:
    """The arguments of a resumed run.

    Raises:
        CheckpointError: the folder holds no run.
    """
    record = folder / "run.json"
    if not record.exists():
        raise CheckpointError(f"{folder} holds no run to resume: {record} is missing.")
    before = json.loads(record.read_text())["arguments"]
    return replace(arguments, **{name: before[name] for name in LEARNT_WITH})


def environment_arguments(arguments: Arguments) -> dict[str, Any]:
    """Keyword arguments of the environment that a run learns and is judged in."""
    return {
        "perception": arguments.perception,
        "estimator": arguments.estimator,
        "control": arguments.control,
        "config": {"reward": {"proximity": arguments.proximity}},
        "num_threads": arguments.threads,
    }


def train(arguments: Arguments, folder: Path, kwargs: dict[str, Any]) -> tuple[Curve, float]:
    """Learn; returns the curve and the seconds it took. Progress survives a kill."""
    settings = ppo.PPOSettings()
    env = HRCVecEnv(arguments.num_envs, seed=arguments.seed, backend=arguments.backend, **kwargs)
    curve = Curve()
    if arguments.resume is not None:
        learner = ppo.resume(folder / "policy.zip", env, folder / "tensorboard")
        if (folder / "curve.json").exists():
            curve = Curve(json.loads((folder / "curve.json").read_text()))
        env.seed(arguments.seed + learner.num_timesteps)  # other episodes than the first ones
        if learner.num_timesteps >= arguments.timesteps:
            raise CheckpointError(
                f"{folder} has learnt {learner.num_timesteps} steps already; "
                f"ask for more than that with --timesteps."
            )
    else:
        learner = ppo.make_learner(env, settings, arguments.seed, folder / "tensorboard")
    facts = {"environment": kwargs, "settings": ppo.settings_as_dict(settings)}
    ramp = Ramp(arguments.ramp)
    care = ProximityCurriculum(ramp, env)
    monitor = TrainingMonitor(folder, arguments.timesteps, facts, curve, ramp)
    started_s = time.monotonic()
    learner.learn(
        arguments.timesteps - learner.num_timesteps,
        callback=[care, monitor],
        reset_num_timesteps=arguments.resume is None,
        tb_log_name="ppo",
    )
    env.close()
    return curve, time.monotonic() - started_s


def film(checkpoint: Path, path: Path, arguments: Arguments, kwargs: dict[str, Any]) -> None:
    """Film the episode with the closest encounter, if this machine can draw."""
    from hrc_env.cli.film import film_episode, nearest_seed

    def make(here: Situation) -> ppo.TrainedAgent:
        return ppo.load(checkpoint, here)

    settings = {name: value for name, value in kwargs.items() if name != "num_threads"}
    try:
        seeds = range(arguments.seed, arguments.seed + FILM_SEEDS)
        film_episode(make, path, seed=nearest_seed(make, seeds, **settings), **settings)
    except RenderingError as error:
        print(f"No film: {error}")


def _plain(arguments: Arguments) -> dict[str, Any]:
    return {
        name: str(value) if isinstance(value, Path) else value
        for name, value in asdict(arguments).items()
    }


def _write(path: Path, content: dict[str, Any]) -> None:
    draft = path.with_suffix(".draft")
    draft.write_text(json.dumps(content, indent=1))
    draft.replace(path)


if __name__ == "__main__":
    try:
        main(tyro.cli(Arguments, description=__doc__))
    except HRCError as error:
        sys.exit(f"{type(error).__name__}: {error}")
