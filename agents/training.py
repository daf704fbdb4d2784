"""A training run: learn, evaluate on fixed seeds, draw the curve, film; go on where it stopped."""

import json
import shlex
import time
import warnings
from contextlib import closing
from dataclasses import asdict, fields, replace
from functools import partial
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
from rich.console import Console

from hrc_env.core.errors import CheckpointError, RenderingError, learner
from hrc_env.core.mapping import restored
from hrc_env.core.progress import Meter, progress_bar
from hrc_env.core.results import provenance, write_whole
from hrc_env.evaluation.episodes import Score, contradiction, evaluate
from hrc_env.pipeline.ready import make_ready
from hrc_env.sb3 import HRCVecEnv
from hrc_env.settings import settle

from . import checkpoints, ppo, sac
from .callbacks import (
    Curriculum,
    Curve,
    Interrupt,
    Ramp,
    TrainingLog,
    TrainingMonitor,
    plot_curve,
)
from .cloning import CloningSettings, clone
from .env_info import EnvInfo
from .learner_settings import IMITATOR, PPOSettings, SACSettings
from .ppo_lagrangian import PPOLagrangian
from .recipes import Run, filled
from .requests import TrainingRequest

with learner():
    import torch
    from stable_baselines3 import PPO, SAC

SETTINGS: dict[str, tuple[Any, Any]] = {
    "ppo": (PPOSettings(), IMITATOR),
    "ppo_lagrangian": (PPOSettings(), IMITATOR),
    "sac": (SACSettings(), SACSettings(hidden=(256, 256))),
}
"""By algorithm: of who begins with nothing, and of who begins with what an expert does."""
DEMONSTRATION_SEED = 2_000_000
"""First seed of what is shown, far from those of learning and of evaluations."""
ONLY_OF_A_RUN = (
    "out", "timesteps", "threads", "episodes", "film", "resume", "engine", "workers", "address",
)  # fmt: skip
"""Arguments that a resumed run does not take from the run that it goes on with."""
SHARES = {"success_rate": ", of attempts", "is_success": ", of episodes"}
"""The whole of which two numbers of a score are shares."""
FILM_SEEDS = 8
"""Number of episodes of which the film shows the one that comes closest to the worker."""
STOPPED = 130
"""Exit status of a run that Ctrl-C stopped."""


def run(arguments: TrainingRequest) -> int:
    """Train, evaluate, draw, film; returns the exit status.

    Raises:
        CheckpointError: a run cannot be resumed.
        ConfigError: an environment that cannot be.
    """
    torch.set_num_threads(1)  # two are slower in networks as small as these
    console = Console()
    folder = arguments.resume or unused(arguments.out)
    if arguments.resume is not None:
        arguments = as_before(arguments, folder)
    mine = filled(arguments)
    make_ready(console, mine.perception)
    curve, took = train(mine, folder, console)
    if took is None:
        return STOPPED
    score = judge(mine, folder, console)
    _write(folder / "score.json", {**asdict(score), **took})
    config = settle(task=mine.task, config=mine.keywords()["config"]).config
    title = f"{mine.algorithm.upper()}, {mine.perception}"
    title += f", {weight_reached(curve, config.reward.proximity)}"
    title += f", shield {mine.shield}" if mine.shield else ""
    written = ["policy.zip", "score.json"]
    if curve:
        plot_curve(curve, folder / "curve.png", title)
        written.append("curve.png")
    limit, cost = mine.cost_limit, score.cost_per_episode
    if limit is not None and cost > 1.1 * limit:
        said = f"The limit of {limit:g} is not kept: these episodes cost {cost:.1f} each. Learn on "
        console.print(said + "with --resume and more --timesteps, or ask for less.")
    if mine.film and film(folder, mine, console):
        written.append("policy.mp4")
    console.print(f"In {folder}/: {', '.join(written)}", highlight=False, soft_wrap=True)
    return 0


def judge(arguments: TrainingRequest, folder: Path, console: Console) -> Score:
    """What the policy is worth, also printed."""
    checkpoint = folder / "policy.zip"
    console.print(f"Evaluating {arguments.episodes} episodes on fixed seeds ...")
    score = evaluate(
        partial(checkpoints.load, checkpoint), arguments.episodes, **arguments.keywords()
    )
    for name, value in asdict(score).items():
        console.print(f"  {name + SHARES.get(name, ''):28s} {value:.3f}", highlight=False)
    if said := contradiction(score):
        console.print(said, highlight=False, soft_wrap=True)
    return score


def weight_reached(curve: Curve, whole: float) -> str:
    """Return the proximity term's weight in words: that of the last rollout, and the whole one
    where the ramp was not over."""
    reached = curve[-1].get("proximity", whole) if curve else whole
    of_whole = "" if reached == whole else f" of {whole:g}: the ramp was not over"
    return f"proximity weight {reached:g}{of_whole}"


def unused(folder: Path) -> Path:
    """The folder, or the next of folder-2, folder-3, ... in which nobody has learnt."""
    candidate, number = folder, 1
    while (candidate / "policy.zip").exists():
        number += 1
        candidate = folder.with_name(f"{folder.name}-{number}")
    return candidate


def as_before(arguments: TrainingRequest, folder: Path) -> TrainingRequest:
    """The arguments of a resumed run: the environment and the seed are those of its beginning.

    Raises:
        CheckpointError: the folder holds no run, or one that has learnt all that is asked.
    """
    before = asked_of(folder)
    total = arguments.timesteps or before.timesteps or 0
    learnt = checkpoints.describe(folder / "policy.zip")["num_timesteps"]
    if learnt >= total:
        raise CheckpointError(
            f"{folder} has learnt {learnt} steps already; ask for more than that with --timesteps."
        )
    own = {name: getattr(arguments, name) for name in ONLY_OF_A_RUN}
    return replace(before, **{**own, "timesteps": total})


def asked_of(folder: Path) -> TrainingRequest:
    """Return the arguments of a run; of those in `ONLY_OF_A_RUN`, only the steps.

    Raises:
        CheckpointError: the folder holds no run.
    """
    record = folder / "run.json"
    if not record.exists():
        raise CheckpointError(f"{folder} holds no run: {record} is missing.")
    said = json.loads(record.read_text())["arguments"]
    if said.get("n_workers") is not None:  # earlier runs hold numbers, not words
        said["n_workers"] = [str(n) for n in np.atleast_1d(said["n_workers"])]
    said = {name: value for name, value in said.items() if value is not None}
    left = {*ONLY_OF_A_RUN} - {"timesteps"}
    known, hints = {each.name for each in fields(TrainingRequest)}, get_type_hints(TrainingRequest)
    names = [name for name in said if name in known - left]
    return TrainingRequest(**{name: restored(hints[name], said[name], name) for name in names})


def train(arguments: Run, folder: Path, console: Console) -> tuple[Curve, dict[str, float] | None]:
    """Learn; returns the curve and what it took: "training_s" by the clock and "processor_s" of
    all threads; None if it was stopped before the end.

    Progress survives a kill.
    """
    kwargs = arguments.keywords()
    settings = SETTINGS[arguments.algorithm][arguments.demonstrations > 0]
    with closing(_vector(arguments)) as env, Interrupt() as interrupt:
        config = asdict(env.env.config)
        record = {"arguments": asdict(arguments), "config": config, **provenance()}
        _write(folder / "run.json", record)
        started_s, busy_s = time.monotonic(), time.process_time()
        learner, curve = _learner(arguments, folder, env, settings, console)
        if arguments.resume is None and arguments.demonstrations:
            _clone(learner, arguments, env, console)
        facts = {"environment": kwargs, "settings": asdict(settings)}
        total = arguments.timesteps
        with Meter(console, "training", total, "steps", learner.num_timesteps) as meter:
            log = TrainingLog(learner, folder, facts, curve, meter)
            if arguments.engine == "ray":
                from .rllib import training as rllib  # here: Ray is an extra

                whole = env.env.config.reward.proximity
                rllib.learn(arguments, settings, whole, log, interrupt, console)
            else:
                _learn(arguments, env, log, interrupt)
    if not interrupt.asked:
        passed_s, worked_s = time.monotonic() - started_s, time.process_time() - busy_s
        return curve, {"training_s": passed_s, "processor_s": worked_s}
    words = ["python", "-m", "hrc_env", "train", "--resume", str(folder)]
    words += ["--timesteps", str(total)]
    said = f"Stopped at {learner.num_timesteps:,} steps, which are saved. Go on with: "
    console.print(said + shlex.join(words), markup=False, highlight=False, soft_wrap=True)
    return curve, None


def _vector(arguments: Run) -> HRCVecEnv:
    """The environments of this process: those that are learnt in, or with another engine, whose
    workers have their own, those in which the agent that is imitated is seen."""
    n = 1 if arguments.engine == "ray" and not arguments.demonstrations else arguments.num_envs
    return HRCVecEnv(n, stagger=True, seed=arguments.seed, **arguments.batched_keywords())


def _learn(arguments: Run, env: HRCVecEnv, log: TrainingLog, interrupt: Interrupt) -> None:
    """Learn by Stable-Baselines3, on what was learnt before."""
    learner, care = log.learner, Curriculum(Ramp(arguments.ramp), env)
    learner.learn(
        arguments.timesteps - learner.num_timesteps,
        callback=[care, TrainingMonitor(log, care, interrupt)],
        reset_num_timesteps=arguments.resume is None,
        tb_log_name=arguments.algorithm,
    )


def _learner(
    arguments: Run, folder: Path, env: HRCVecEnv, settings: Any, console: Console
) -> tuple[Any, Curve]:
    """A learner and its curve: new ones, or those of the run that is resumed."""
    seed, log = arguments.seed, folder / "tensorboard"
    if arguments.resume is None and arguments.algorithm == "sac":
        return sac.make_learner(env, settings, seed, log, arguments.her), []
    if arguments.resume is None:
        kind, limit = PPO, arguments.cost_limit
        if limit is not None:
            length = env.env.max_episode_steps
            kind = partial(PPOLagrangian, limit=limit, episode_steps=length)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", ".*mini-batch size")  # of workers' rollouts
            return ppo.make_learner(env, settings, seed, log, kind), []
    learner = checkpoints.resume(folder / "policy.zip", env, folder / "tensorboard")
    env.seed(arguments.seed + learner.num_timesteps)  # other episodes than the first ones
    if isinstance(learner, SAC):
        anew = learner.learning_starts - learner.num_timesteps
        console.print(
            "Checkpoints keep no replay buffer: it fills anew with what the policy does, and "
            f"learning goes on after {anew:,} steps.", highlight=False, soft_wrap=True,
        )  # fmt: skip
    path = folder / "curve.json"
    return learner, json.loads(path.read_text()) if path.exists() else []


def _clone(learner: Any, arguments: Run, env: HRCVecEnv, console: Console) -> None:
    """Show the policy what the scripted agent does; then the environments begin as they would."""
    n, settings = arguments.demonstrations, CloningSettings()
    with progress_bar(console, "cloning") as say:
        clone(learner.policy, env, n, settings, DEMONSTRATION_SEED, lambda share: say(share, ""))
    env.seed(arguments.seed)


def film(folder: Path, arguments: TrainingRequest, console: Console) -> bool:
    """Film the policy's closest encounter with the worker; whether this machine can draw."""
    from hrc_env.evaluation.film import film_episode, nearest_seed

    def make(env_info: EnvInfo) -> checkpoints.TrainedAgent:
        return checkpoints.load(folder / "policy.zip", env_info)

    kwargs = arguments.keywords()
    kwargs.pop("num_threads", None)
    try:
        seeds = range(arguments.seed, arguments.seed + FILM_SEEDS)
        seed = nearest_seed(make, seeds, **kwargs)
        film_episode(make, folder / "policy.mp4", seed, **kwargs)
    except RenderingError as error:
        console.print(f"No film: {error}", markup=False)
        return False
    return True


def _write(path: Path, content: dict[str, Any]) -> None:
    write_whole(path, json.dumps(content, indent=1, default=str))
