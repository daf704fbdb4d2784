"""What happens while PPO learns: progress with the time left, curves, checkpoints."""

import json
import time
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from hrc_env.cli.progress import Meter
from hrc_env.core.results import write_whole

from . import ppo
from .curriculum import Ramp
from .evaluate import summarise
from .interrupt import Interrupt

RECENT_EPISODES = 64
"""Curves average over so many finished episodes."""


@dataclass(slots=True)
class Curve:
    """A learning curve: one entry a rollout."""

    points: list[dict[str, float]] = field(default_factory=list)

    def write(self, path: Path) -> None:
        """As JSON, whole or not at all."""
        write_whole(path, json.dumps(self.points, indent=1))


class TrainingMonitor(BaseCallback):
    """Keeps the curve, shows the progress, saves a checkpoint every minute and at the end.

    Where it is interrupted it ends the training at the next step, as if that had been the last.
    """

    def __init__(
        self,
        folder: Path,
        facts: dict[str, Any],
        curve: Curve,
        ramp: Ramp,
        interrupt: Interrupt,
        meter: Meter,
    ) -> None:
        super().__init__()
        self.folder, self.facts, self.curve, self.ramp = folder, facts, curve, ramp
        self.interrupt, self.meter = interrupt, meter
        self.recent: deque[dict[str, float]] = deque(maxlen=RECENT_EPISODES)
        self.before_s = curve.points[-1]["wall_s"] if curve.points else 0.0

    @property
    def checkpoint(self) -> Path:
        """Where the newest policy lies."""
        return self.folder / "policy.zip"

    def _on_training_start(self) -> None:
        self.started_s = self.saved_s = time.monotonic()
        self.interrupt.listen()

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "episode" in info:
                self.recent.append(info["episode"])
        return not self.interrupt.asked

    def _on_rollout_end(self) -> None:
        self._note()
        if time.monotonic() - self.saved_s > 60:
            self._save()

    def _on_training_end(self) -> None:
        self._note()
        self._save()

    def _note(self) -> None:
        note = ""
        if self.recent:
            score = summarise(list(self.recent))
            wall_s = self.before_s + time.monotonic() - self.started_s
            point = {
                "steps": float(self.num_timesteps),
                "wall_s": wall_s,
                "safety_share": self.ramp.at(self.num_timesteps),
                **score.as_dict(),
            }
            self.curve.points.append(point)
            for name, value in score.as_dict().items():
                self.logger.record(f"episode/{name}", value)
            note = f"goals {score.success_rate:.0%}, contacts {score.contacts_per_episode:.2f}"
        self.meter.show(self.num_timesteps, note=note)

    def _save(self) -> None:
        self.saved_s = time.monotonic()
        ppo.save(self.model, self.checkpoint, self.facts)  # type: ignore[arg-type]
        self.curve.write(self.folder / "curve.json")


def plot_curve(curve: Curve, path: Path, title: str) -> None:
    """Goals, contacts and cost over environment steps as a PNG."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.ticker import EngFormatter

    steps = np.array([point["steps"] for point in curve.points])
    panels = (
        ("success_rate", "goals reached (share)", "tab:green"),
        ("goals_per_minute", "goals per minute", "tab:blue"),
        ("contacts_per_episode", "true contacts per episode", "tab:red"),
        ("close_steps_per_episode", "steps < 15 cm per episode", "tab:orange"),
    )
    figure, axes = plt.subplots(2, 2, figsize=(9, 6), sharex=True, layout="constrained")
    for axis, (name, label, colour) in zip(axes.ravel(), panels, strict=True):
        axis.plot(steps, [point[name] for point in curve.points], color=colour)
        axis.set_ylabel(label)
        axis.set_ylim(bottom=0)
        axis.grid(alpha=0.3)
    share = np.array([point.get("safety_share", 1.0) for point in curve.points])
    growing = steps[(share > 0) & (share < 1)]
    if len(growing):
        for axis in axes.ravel():
            axis.axvspan(growing[0], growing[-1], color="grey", alpha=0.15, linewidth=0)
        axes[1, 0].set_title("grey: the safety term grows", fontsize=9)
    axes[0, 0].axhline(0.8, color="grey", linestyle="--", linewidth=0.8)
    axes[0, 0].set_ylim(0, 1.05)
    for axis in axes[1]:
        axis.set_xlabel("environment steps")
        axis.xaxis.set_major_formatter(EngFormatter(sep=" "))
    figure.suptitle(title)
    figure.savefig(path, dpi=120)
    plt.close(figure)
