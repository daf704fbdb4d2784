"""What happens while PPO learns: progress with the time left, curves, checkpoints."""

import json
import os
import time
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from stable_baselines3.common.callbacks import BaseCallback

from . import ppo
from .curriculum import Ramp
from .evaluate import summarise

RECENT_EPISODES = 64
"""Curves average over so many finished episodes."""


@dataclass(slots=True)
class Curve:
    """A learning curve: one entry a rollout."""

    points: list[dict[str, float]] = field(default_factory=list)

    def write(self, path: Path) -> None:
        """As JSON, whole or not at all."""
        draft = path.with_suffix(".draft")
        draft.write_text(json.dumps(self.points, indent=1))
        os.replace(draft, path)


class TrainingMonitor(BaseCallback):
    """Keeps the curve, shows the progress, saves a checkpoint every minute and at the end."""

    def __init__(
        self, folder: Path, total_timesteps: int, facts: dict[str, Any], curve: Curve, ramp: Ramp
    ) -> None:
        super().__init__()
        self.folder, self.total, self.facts, self.curve = folder, total_timesteps, facts, curve
        self.ramp = ramp
        self.recent: deque[dict[str, float]] = deque(maxlen=RECENT_EPISODES)
        self.before_s = curve.points[-1]["wall_s"] if curve.points else 0.0
        self.bar = Progress(
            TextColumn("training"), BarColumn(), MofNCompleteColumn(), TextColumn("steps"),
            TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(),
            TextColumn("{task.fields[note]}"),
        )  # fmt: skip

    @property
    def checkpoint(self) -> Path:
        """Where the newest policy lies."""
        return self.folder / "policy.zip"

    def _on_training_start(self) -> None:
        self.started_s = self.saved_s = time.monotonic()
        self.bar.start()
        self.task = self.bar.add_task("", total=self.total, completed=self.num_timesteps, note="")

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "episode" in info:
                self.recent.append(info["episode"])
        return True

    def _on_rollout_end(self) -> None:
        self._note()
        if time.monotonic() - self.saved_s > 60:
            self._save()

    def _on_training_end(self) -> None:
        self._note()
        self.bar.stop()
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
        self.bar.update(self.task, completed=self.num_timesteps, note=note)

    def _save(self) -> None:
        self.saved_s = time.monotonic()
        ppo.save(self.model, self.checkpoint, self.facts)  # type: ignore[arg-type]
        self.curve.write(self.folder / "curve.json")


def plot_curve(curve: Curve, path: Path, title: str) -> None:
    """Goals, contacts and cost over wall-clock time as a PNG."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    minutes = np.array([point["wall_s"] for point in curve.points]) / 60
    panels = (
        ("success_rate", "goals reached (share)", "tab:green"),
        ("goals_per_minute", "goals per minute", "tab:blue"),
        ("contacts_per_episode", "true contacts per episode", "tab:red"),
        ("close_steps_per_episode", "steps < 15 cm per episode", "tab:orange"),
    )
    figure, axes = plt.subplots(2, 2, figsize=(9, 6), sharex=True, layout="constrained")
    for axis, (name, label, colour) in zip(axes.ravel(), panels, strict=True):
        axis.plot(minutes, [point[name] for point in curve.points], color=colour)
        axis.set_ylabel(label)
        axis.set_ylim(bottom=0)
        axis.grid(alpha=0.3)
    share = np.array([point.get("safety_share", 1.0) for point in curve.points])
    growing = minutes[(share > 0) & (share < 1)]
    if len(growing):
        for axis in axes.ravel():
            axis.axvspan(growing[0], growing[-1], color="grey", alpha=0.15, linewidth=0)
        axes[1, 0].set_title("grey: the safety term grows", fontsize=9)
    axes[0, 0].axhline(0.8, color="grey", linestyle="--", linewidth=0.8)
    axes[0, 0].set_ylim(0, 1.05)
    for axis in axes[1]:
        axis.set_xlabel("wall-clock minutes")
    figure.suptitle(title)
    figure.savefig(path, dpi=120)
    plt.close(figure)
