"""Training runs: training or resuming, evaluation on fixed seeds, learning curve and film."""

import json
import shlex
import time
import warnings
from contextlib import ExitStack, closing
from dataclasses import asdict, fields, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, get_type_hints

import numpy as np
from rich.console import Console

from hrc_env.core.errors import CheckpointError, RenderingError, learner
from hrc_env.core.mapping import convert_to_hint
from hrc_env.core.progress import Meter, progress_bar
from hrc_env.core.results import provenance, write_whole
from hrc_env.evaluation.episodes import Score, describe_contradiction, evaluate
from hrc_env.pipeline.ready import make_ready
from hrc_env.sb3 import HRCVecEnv
from hrc_env.settings import resolve_settings

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
from .recipes import Run, fill_in
from .requests import TrainingRequest

with learner():
    import torch
    from stable_baselines3 import PPO, SAC


class SettingsPair(NamedTuple):
    """Settings of a learner for training without and with demonstrations."""

    alone: Any
    """Settings for training without demonstrations."""
    imitating: Any
    """Settings for training after the imitation of demonstrations."""


SETTINGS = {
    "ppo": SettingsPair(PPOSettings(), IMITATOR),
    "ppo_lagrangian": SettingsPair(PPOSettings(), IMITATOR),
    "sac": SettingsPair(SACSettings(), SACSettings(hidden=(256, 256))),
}
"""Settings of the learners, by the name of the algorithm."""
DEMONSTRATION_SEED = 2_000_000
"""Seed of the first demonstration; the seeds of training and evaluation are in other ranges."""
WATCHED_SEED, WATCHED_PART = 500_000_000, 4
"""Seed of the environments in which mean actions are watched, far from all others; and number of
environments of the training for each of them."""
ONLY_OF_A_RUN = (
    "out", "timesteps", "threads", "episodes", "film", "resume", "engine", "workers", "address",
)  # fmt: skip
"""Names of the arguments that a resumed run does not take from the run that it continues."""
SHARES = {"success_rate": ", of attempts", "is_success": ", of episodes"}
"""Denominators of the two rates in a score, printed after the names of the rates."""
FILM_SEEDS = 8
"""Number of episodes, of which the one with the closest encounter is filmed."""
STOPPED = 130
"""Exit status of a run that was stopped by Ctrl-C."""


class TrainingResult(NamedTuple):
    """The result of a training run."""

    curve: Curve
    times: dict[str, float] | None
    """Wall-clock time "training_s" and total processor time of all threads "processor_s" [s].

    None if the training was stopped.
    """


class StartedLearner(NamedTuple):
    """A learner at the start of a run."""

    learner: Any
    curve: Curve
    """Learning curve of the earlier part of a resumed run, otherwise empty."""


def run(arguments: TrainingRequest) -> int:
    """Train and evaluate a policy, plot its learning curve, and film it; return the exit status.

    Raises:
        CheckpointError: the run cannot be resumed.
        ConfigError: the environment cannot be created.
    """
    torch.set_num_threads(1)  # two threads are slower for such small networks
    console = Console()
    folder = arguments.resume or find_unused(arguments.out)
    if arguments.resume is not None:
        arguments = restore_arguments(arguments, folder)
    mine = fill_in(arguments)
    make_ready(console, mine.perception)
    curve, times = train(mine, folder, console)
    if times is None:
        return STOPPED
    score = judge(mine, folder, console)
    _write(folder / "score.json", {**asdict(score), **times})
    config = resolve_settings(task=mine.task, config=mine.keywords()["config"]).config
    title = f"{mine.algorithm.upper()}, {mine.perception}"
    title += f", {describe_weight(curve, config.reward.proximity)}"
    title += f", shield {mine.shield}" if mine.shield else ""
    written = ["policy.zip", "score.json"]
    if curve:
        plot_curve(curve, folder / "curve.png", title)
        written.append("curve.png")
    limit, cost = mine.cost_limit, score.cost_per_episode
    if limit is not None and cost > 1.1 * limit:
        text = (
            f"The limit of {limit:g} is exceeded: the mean cost of these episodes is "
            f"{cost:.1f}. Train "
        )
        console.print(text + "longer with --resume and more --timesteps, or set a higher limit.")
    if mine.film and film(folder, mine, console):
        written.append("policy.mp4")
    console.print(f"In {folder}/: {', '.join(written)}", highlight=False, soft_wrap=True)
    return 0


def judge(arguments: TrainingRequest, folder: Path, console: Console) -> Score:
    """Evaluate the policy of a run, print its score and return it."""
    checkpoint = folder / "policy.zip"
    console.print(f"Evaluating {arguments.episodes} episodes on fixed seeds ...")
    score = evaluate(
        partial(checkpoints.load, checkpoint), arguments.episodes, **arguments.keywords()
    )
    for name, text in score.describe().items():
        console.print(
            f"  {name + SHARES.get(name, ''):28s} {text}", highlight=False, soft_wrap=True
        )
    if warning := describe_contradiction(score):
        console.print(warning, highlight=False, soft_wrap=True)
    return score


def describe_weight(curve: Curve, whole: float) -> str:
    """Format the last weight of the proximity term, and the full weight if it differs."""
    reached = curve[-1].get("proximity", whole) if curve else whole
    of_whole = "" if reached == whole else f" of {whole:g}: the ramp was not finished"
    return f"proximity weight {reached:g}{of_whole}"


def find_unused(folder: Path) -> Path:
    """Return the first of `folder`, `folder`-2, `folder`-3, ... that contains no policy."""
    candidate, number = folder, 1
    while (candidate / "policy.zip").exists():
        number += 1
        candidate = folder.with_name(f"{folder.name}-{number}")
    return candidate


def restore_arguments(arguments: TrainingRequest, folder: Path) -> TrainingRequest:
    """Return the arguments of a resumed run, with the environment and the seed of its start.

    Raises:
        CheckpointError: the folder holds no run, or its run has completed all requested steps.
    """
    before = read_arguments(folder)
    total = arguments.timesteps or before.timesteps or 0
    learnt = checkpoints.describe(folder / "policy.zip")["num_timesteps"]
    if learnt >= total:
        raise CheckpointError(
            f"{folder} was already trained for {learnt} steps; set --timesteps to a larger number."
        )
    own = {name: getattr(arguments, name) for name in ONLY_OF_A_RUN}
    return replace(before, **{**own, "timesteps": total})


def read_arguments(folder: Path) -> TrainingRequest:
    """Read the arguments of a run; of those in `ONLY_OF_A_RUN`, only `timesteps` is included.

    Raises:
        CheckpointError: the folder holds no run.
    """
    record = folder / "run.json"
    if not record.exists():
        raise CheckpointError(f"{folder} contains no training run: {record} is missing.")
    saved = json.loads(record.read_text())["arguments"]
    if saved.get("n_workers") is not None:  # earlier versions stored numbers, not words
        saved["n_workers"] = [str(n) for n in np.atleast_1d(saved["n_workers"])]
    saved = {name: value for name, value in saved.items() if value is not None}
    left = {*ONLY_OF_A_RUN} - {"timesteps"}
    known, hints = {each.name for each in fields(TrainingRequest)}, get_type_hints(TrainingRequest)
    names = [name for name in saved if name in known - left]
    return TrainingRequest(
        **{name: convert_to_hint(hints[name], saved[name], name) for name in names}
    )


def train(arguments: Run, folder: Path, console: Console) -> TrainingResult:
    """Train a policy and return the result.

    Checkpoints are kept if the process is killed.
    """
    kwargs = arguments.keywords()
    pair = SETTINGS[arguments.algorithm]
    settings = pair.imitating if arguments.demonstrations else pair.alone
    with closing(_make_envs(arguments)) as env, Interrupt() as interrupt:
        config = asdict(env.env.config)
        record = {"arguments": asdict(arguments), "config": config, **provenance()}
        _write(folder / "run.json", record)
        started_s, busy_s = time.monotonic(), time.process_time()
        learner, curve = _make_learner(arguments, folder, env, settings, console)
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
        return TrainingResult(curve, {"training_s": passed_s, "processor_s": worked_s})
    words = ["python", "-m", "hrc_env", "train", "--resume", str(folder)]
    words += ["--timesteps", str(total)]
    text = f"Stopped at {learner.num_timesteps:,} steps; the state is saved. To continue: "
    console.print(text + shlex.join(words), markup=False, highlight=False, soft_wrap=True)
    return TrainingResult(curve, None)


def _make_envs(arguments: Run) -> HRCVecEnv:
    """Return the environments of this process, for training or demonstrations.

    The workers of another engine have their own environments for training.
    """
    n = 1 if arguments.engine == "ray" and not arguments.demonstrations else arguments.num_envs
    return HRCVecEnv(n, stagger=True, seed=arguments.seed, **arguments.batched_keywords())


def _learn(arguments: Run, env: HRCVecEnv, log: TrainingLog, interrupt: Interrupt) -> None:
    """Train with Stable-Baselines3, starting from the current state of the learner."""
    learner, curriculum = log.learner, Curriculum(Ramp(arguments.ramp), env)
    with ExitStack() as stack:
        if isinstance(learner, PPOLagrangian):
            watched = stack.enter_context(closing(_make_watched_envs(arguments, learner)))
            learner.watch_mean_actions(watched)
        learner.learn(
            arguments.timesteps - learner.num_timesteps,
            callback=[curriculum, TrainingMonitor(log, curriculum, interrupt)],
            reset_num_timesteps=arguments.resume is None,
            tb_log_name=arguments.algorithm,
        )


def _make_watched_envs(arguments: Run, learner: PPOLagrangian) -> HRCVecEnv:
    """Return the environments in which PPO-Lagrangian measures the cost of mean actions."""
    n, seed = max(arguments.num_envs // WATCHED_PART, 1), WATCHED_SEED + arguments.seed
    seed += learner.num_timesteps  # other episodes than those of the first part of a resumed run
    return HRCVecEnv(n, stagger=True, seed=seed, **arguments.batched_keywords())


def _make_learner(
    arguments: Run, folder: Path, env: HRCVecEnv, settings: Any, console: Console
) -> StartedLearner:
    """Create a new learner, or load the learner of the run that is resumed."""
    seed, log = arguments.seed, folder / "tensorboard"
    if arguments.resume is None and arguments.algorithm == "sac":
        return StartedLearner(sac.make_learner(env, settings, seed, log, arguments.her), [])
    if arguments.resume is None:
        kind, limit = PPO, arguments.cost_limit
        if limit is not None:
            length = env.env.max_episode_steps
            kind = partial(PPOLagrangian, limit=limit, episode_steps=length)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", ".*mini-batch size")  # of workers' rollouts
            return StartedLearner(ppo.make_learner(env, settings, seed, log, kind), [])
    learner = checkpoints.resume(folder / "policy.zip", env, folder / "tensorboard")
    env.seed(arguments.seed + learner.num_timesteps)  # other episodes than those of the first part
    if isinstance(learner, SAC):
        refill = learner.learning_starts - learner.num_timesteps
        console.print(
            "Checkpoints contain no replay buffer: it is filled again by the policy, and training "
            f"continues after {refill:,} steps.", highlight=False, soft_wrap=True,
        )  # fmt: skip
    path = folder / "curve.json"
    curve = json.loads(path.read_text()) if path.exists() else []
    return StartedLearner(learner, curve)


def _clone(learner: Any, arguments: Run, env: HRCVecEnv, console: Console) -> None:
    """Train the policy to imitate the scripted agent, and reseed the environments."""
    n, settings = arguments.demonstrations, CloningSettings()
    with progress_bar(console, "cloning") as say:
        clone(learner.policy, env, n, settings, DEMONSTRATION_SEED, lambda share: say(share, ""))
    env.seed(arguments.seed)


def film(folder: Path, arguments: TrainingRequest, console: Console) -> bool:
    """Film the policy's closest encounter with a worker; return whether rendering succeeds."""
    from hrc_env.evaluation.film import film_episode, find_nearest_seed

    def make(env_info: EnvInfo) -> checkpoints.TrainedAgent:
        return checkpoints.load(folder / "policy.zip", env_info)

    kwargs = arguments.keywords()
    kwargs.pop("num_threads", None)
    try:
        seeds = range(arguments.seed, arguments.seed + FILM_SEEDS)
        seed = find_nearest_seed(make, seeds, **kwargs)
        film_episode(make, folder / "policy.mp4", seed, **kwargs)
    except RenderingError as error:
        console.print(f"No video was recorded: {error}", markup=False)
        return False
    return True


def _write(path: Path, content: dict[str, Any]) -> None:
    write_whole(path, json.dumps(content, indent=1, default=str))
