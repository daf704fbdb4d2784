"""Training callbacks: safety ramp, progress display, learning curves, checkpoints and Ctrl-C."""

import json
import math
import signal
import textwrap
import threading
import time
from collections import deque
from dataclasses import dataclass, replace
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple, Self

import numpy as np
from matplotlib.ticker import EngFormatter
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env import VecEnvWrapper

from hrc_env.core.errors import ConfigError
from hrc_env.core.progress import Meter
from hrc_env.core.results import write_whole
from hrc_env.evaluation.episodes import summarize
from hrc_env.experiments.plots import label_axes, make_figure, save
from hrc_env.sb3 import HRCVecEnv

from . import checkpoints
from .ppo_lagrangian import PPOLagrangian

RECENT_EPISODES = 64
"""Number of most recent finished episodes over which learning curves are averaged."""
SAVE_EVERY_S = 60.0
"""Time between checkpoints [s]."""


@dataclass(frozen=True, slots=True)
class Ramp:
    """A factor that grows linearly from 0 to 1 over the training."""

    n_steps: int
    """Number of environment steps until the factor is 1; with 0, it is 1 from the start."""

    def __post_init__(self) -> None:
        if self.n_steps < 0:
            raise ConfigError(
                f"The length of a ramp must be 0 or more environment steps, got {self.n_steps}."
            )

    def at(self, n_steps: int) -> float:
        """Return the factor in [0, 1] after a number of environment steps."""
        return 1.0 if n_steps >= self.n_steps else n_steps / self.n_steps


class Curriculum(BaseCallback):
    """Sets the weight of the proximity term, and the current cost limit, before every rollout.

    A resumed run continues the ramp where it stopped. With the full weight from the start, a
    learner first learns to stay away from people and needs about nine times as long to find its
    goals; its final policy is more careful.
    """

    def __init__(self, ramp: Ramp, env: HRCVecEnv) -> None:
        super().__init__()
        self.ramp, self.env = ramp, env
        self.whole = env.env.config.reward
        self.share = ramp.at(0)

    @property
    def weight(self) -> float:
        """Weight of the proximity term in the last rollout."""
        return self.share * self.whole.proximity

    def _on_rollout_start(self) -> None:
        self.share = share = self.ramp.at(self.num_timesteps)
        self.env.set_reward(replace(self.whole, proximity=self.weight))
        if isinstance(self.model, PPOLagrangian):
            self.model.share = share

    def _on_step(self) -> bool:
        return True


class ProximityRamp(Curriculum):
    """Increases the proximity term's weight from 0, for a learner of Stable-Baselines3.

        env = VecNormalize(HRCVecEnv(64, stagger=True), norm_obs=False, gamma=0.98)
        model = PPO("MlpPolicy", env, **PPOSettings().keywords())
        model.learn(1_000_000, callback=ProximityRamp(400_000))

    Args:
        n_steps: environment steps until the weight reaches that of the environment's
            `RewardConfig`; the option `--ramp` of `train`.

    Raises:
        ConfigError: `n_steps` is negative or, at the start of the training, the environment is not
            an `HRCVecEnv`.
    """

    def __init__(self, n_steps: int = 400_000) -> None:
        BaseCallback.__init__(self)
        self.ramp, self.share = Ramp(n_steps), 0.0

    def _init_callback(self) -> None:
        env: Any = self.training_env
        while isinstance(env, VecEnvWrapper):
            env = env.venv
        if not isinstance(env, HRCVecEnv):
            raise ConfigError(f"ProximityRamp needs an HRCVecEnv, got {type(env).__name__}.")
        self.env, self.whole = env, env.env.config.reward


class Interrupt:
    """Handler of Ctrl-C, active after `listen`.

    The first Ctrl-C sets `asked`, and the second one raises `KeyboardInterrupt`.
    """

    def __init__(self) -> None:
        self.asked = False
        self._before: Any = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: Any) -> None:
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def listen(self) -> None:
        """Install the handler for Ctrl-C (SIGINT)."""
        if threading.current_thread() is threading.main_thread():  # only there
            self._before = signal.signal(signal.SIGINT, self._answer)

    def _answer(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True


Curve = list[dict[str, float]]
"""A learning curve, with one entry per rollout.

For SAC, where a rollout is a single step, it has one entry per `LEAST_STEPS` environment steps.
"""
LEAST_STEPS = 2048
"""Environment steps between entries of SAC's curve."""


class TrainingLog:
    """The learning curve, checkpoints and progress display of a training run.

    Args:
        learner: learner of Stable-Baselines3, whose logger writes to TensorBoard.
        folder: folder of the run.
        facts: description to store in the checkpoint.
        curve: learning curve of the earlier part of the run, to which entries are appended.
        meter: progress display.
    """

    def __init__(
        self, learner: Any, folder: Path, facts: dict[str, Any], curve: Curve, meter: Meter
    ) -> None:
        self.learner, self.folder, self.facts = learner, folder, facts
        self.curve, self.meter = curve, meter
        self.recent: deque[dict[str, float]] = deque(maxlen=RECENT_EPISODES)
        self.before_s = curve[-1]["wall_s"] if curve else 0.0
        self.begin()

    def begin(self) -> None:
        """Start the timer of the learning curve and of the checkpoints."""
        self.started_s = self.saved_s = time.monotonic()

    def note(self, weights: dict[str, float]) -> None:
        """Add a point to the learning curve if an episode has ended, and show the progress.

        Args:
            weights: weights of reward and cost terms in the last rollout, by their name in the
                curve.
        """
        n_steps, note = self.learner.num_timesteps, ""
        if self.recent:
            numbers = summarize(list(self.recent)).numbers()
            score = {name: value for name, value in numbers.items() if not math.isnan(value)}
            wall_s = self.before_s + time.monotonic() - self.started_s
            self.curve.append({"steps": float(n_steps), "wall_s": wall_s, **weights, **score})
            for name, value in score.items():
                self.learner.logger.record(f"episode/{name}", value)
            contacts = score["contacts_per_episode"]
            note = f"attempts {score['success_rate']:.0%}, is_success {score['is_success']:.0%}"
            note += f", contacts {contacts:.2f}"
        self.meter.show(n_steps, note=note)

    @property
    def is_due(self) -> bool:
        """Whether the last checkpoint is older than `SAVE_EVERY_S`."""
        return time.monotonic() - self.saved_s > SAVE_EVERY_S

    def save(self) -> None:
        """Write the checkpoint and the learning curve."""
        self.saved_s = time.monotonic()
        checkpoints.save(self.learner, self.folder / "policy.zip", self.facts)
        write_whole(self.folder / "curve.json", json.dumps(self.curve, indent=1))


class TrainingMonitor(BaseCallback):
    """Callback that logs a training run and saves a checkpoint every minute and at the end.

    Ctrl-C ends the training after the current step.
    """

    def __init__(self, log: TrainingLog, curriculum: Curriculum, interrupt: Interrupt) -> None:
        super().__init__()
        self.log, self.curriculum, self.interrupt = log, curriculum, interrupt

    def _on_training_start(self) -> None:
        self.log.begin()
        self.interrupt.listen()

    def _on_step(self) -> bool:
        ended = (each["episode"] for each in self.locals["infos"] if "episode" in each)
        self.log.recent.extend(ended)
        return not self.interrupt.asked

    def _on_rollout_end(self) -> None:
        if isinstance(self.model, OffPolicyAlgorithm):
            last = self.log.curve[-1]["steps"] if self.log.curve else 0
            if self.num_timesteps - last < LEAST_STEPS:
                return
        self._add_point()
        if self.log.is_due:
            self.log.save()

    def _on_training_end(self) -> None:
        self._add_point()
        self.log.save()

    def _add_point(self) -> None:
        weights = {
            "safety_share": self.curriculum.ramp.at(self.num_timesteps),
            "proximity": self.curriculum.weight,
        }
        if isinstance(self.model, PPOLagrangian):
            limited = self.model.multiplier
            weights |= {"cost": limited.cost, "limit": limited.limit, "multiplier": limited.value}
        self.log.note(weights)


Y_WIDTH = 20
"""Maximum number of characters in a line of a y-axis label."""


class Panel(NamedTuple):
    """Label and colour of a panel in the plot of a learning curve."""

    label: str
    colour: str


PANELS = {
    "success_rate": Panel("attempts achieved (dashed: episodes with is_success)", "tab:green"),
    "goals_per_minute": Panel("goals per minute", "tab:blue"),
    "contacts_per_episode": Panel("contacts with the true worker per episode", "tab:red"),
    "close_steps_per_episode": Panel("steps < 15 cm per episode", "tab:orange"),
}
"""Panels in the plot of a learning curve, by metric."""
LIMITED = {
    "cost": Panel("cost per episode, smoothed (dashed: the limit)", "tab:brown"),
    "multiplier": Panel("multiplier", "tab:purple"),
}
"""Additional panels for a run with a cost limit, by metric."""


def plot_curve(curve: Curve, path: Path, title: str) -> None:
    """Plot goals, contacts and cost over environment steps, and save the figure as PNG."""
    steps = np.array([point["steps"] for point in curve])
    share = np.array([point.get("safety_share", 1.0) for point in curve])
    growing = steps[(share > 0) & (share < 1)]
    limited = bool(curve) and "limit" in curve[-1]
    panels = PANELS | (LIMITED if limited else {})
    figure = make_figure(9, 9 if limited else 6)
    axes = figure.subplots(len(panels) // 2, 2, sharex=True)
    for axis, (name, (words, colour)) in zip(axes.ravel(), panels.items(), strict=True):
        axis.plot(steps, [point[name] for point in curve], color=colour)
        if name == "success_rate" and all("is_success" in point for point in curve):
            succeeded = [point["is_success"] for point in curve]
            axis.plot(steps, succeeded, color=colour, linestyle="--")
        if name == "cost":
            axis.axhline(curve[-1]["limit"], color="grey", linestyle="--")
        label_axes(axis, "environment steps", textwrap.fill(words, Y_WIDTH))
        axis.set_ylim(bottom=0)
        axis.xaxis.set_major_formatter(EngFormatter(sep=" "))
        if len(growing):
            axis.axvspan(growing[0], growing[-1], color="grey", alpha=0.15, linewidth=0)
    if len(growing):
        axes[1, 0].set_title("grey: the safety term grows", fontsize=9)
    axes[0, 0].set_ylim(0, 1.05)
    figure.suptitle(title)
    save(figure, path, dpi=120)
