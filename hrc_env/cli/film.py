"""Films: the room beside the four cameras, with a strip that tells distance and cost."""

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import imageio.v2 as imageio
import numpy as np
from numpy.typing import NDArray

from hrc_env import pictures
from hrc_env.agents_door import agents
from hrc_env.cli.progress import track
from hrc_env.env import HRCReachEnv
from hrc_env.typing import Image

WIDTH, HEIGHT = 1600, 900
ROOM = (792, 716)
TILE = (400, 225)
CROP = 196
STRIP_HEIGHT = 180
STEPS_PER_FRAME = 2
"""A film shows every second step, in real time."""
CLOSE_M = 0.1
"""The still shows the closest moment that is not yet closer than this [m]."""
STRIP_S = 10.0
"""Seconds that the strip below shows."""
FAR_M = 1.5
"""Distances are drawn up to this [m]."""


@dataclass(slots=True)
class Diary:
    """What the strip shows: one entry a step."""

    true_m: list[float] = field(default_factory=list)
    estimated_m: list[float] = field(default_factory=list)
    cost: list[float] = field(default_factory=list)

    def note(self, info: dict[str, Any], estimated_m: float) -> None:
        """Add a step."""
        self.true_m.append(info.get("safety/min_separation_m", np.inf))
        self.estimated_m.append(estimated_m)
        self.cost.append(info["cost"])


def film_episode(
    make: Callable[[Any], Any], path: Path, seed: int = 0, n_steps: int = 250, **kwargs: Any
) -> dict[str, float]:
    """Film `n_steps` of an agent; returns what came of them.

    Args:
        make: builds the agent for a `Situation`.
        path: an .mp4 file; a still of the closest moment that is no near miss yet (or of the
            first step) is written beside it as .png.
        kwargs: as of `HRCReachEnv`.

    Raises:
        RenderingError: this machine has no OpenGL.
    """
    env = HRCReachEnv(**kwargs)
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".draft.mp4")
    fps = 1 / env.config.ctrl_dt / STEPS_PER_FRAME
    try:
        with imageio.get_writer(draft, fps=fps, quality=8, macro_block_size=4) as writer:
            totals = _roll(env, make, seed, n_steps, writer, path.with_suffix(".png"))
    finally:
        env.close()
    os.replace(draft, path)
    return totals


def _roll(
    env: HRCReachEnv, make: Callable[[Any], Any], seed: int, n_steps: int, writer: Any, still: Path
) -> dict[str, float]:
    """Play, draw every step, and keep the stillest moment of truth: the closest one seen."""
    agent = make(agents("base").situation(env.simulation))
    observation, _ = env.reset(seed=seed)
    diary, errors_m, infos = Diary(), [], []
    closest_m = np.inf
    for step in track(range(n_steps), description="filming"):
        observation, _, terminated, _, info = env.step(agent.act(observation))
        infos.append(info)
        diary.note(info, float(env.simulation.believed.gap.distance_m.min(initial=np.inf)))
        errors_m.append(info.get("tracking/mpjpe_m", np.nan))
        if step % STEPS_PER_FRAME == 0:
            frame = compose(env, diary)
            writer.append_data(frame)
            closer = CLOSE_M < diary.true_m[-1] < closest_m
            closest_m = diary.true_m[-1] if closer else closest_m
            if closer or step == 0:
                imageio.imwrite(still, frame)
        if terminated:
            break
    known = [error for error in errors_m if error == error]
    return {
        "median tracking error [mm]": 1e3 * float(np.median(known)) if known else np.nan,
        "lost steps [%]": 100 * (1 - len(known) / len(errors_m)),
        "minimum separation [m]": float(np.min(diary.true_m)),
        "goals reached": infos[-1]["task/goals_reached"],
        "goals missed": infos[-1]["task/goals_missed"],
        "cost": infos[-1]["episode_cost"],
    }


def compose(env: HRCReachEnv, diary: Diary) -> Image:
    """One frame: room, cameras, crops, strip."""
    frame = np.empty((HEIGHT, WIDTH, 3), np.uint8)
    frame[:] = pictures.PANEL
    room = env.views.room(*ROOM)
    pictures.label(room, "what happens", (10, 10), 18)
    _paste(frame, room, (0, 0))
    views = env.views.cameras(*TILE)
    _paste(frame, pictures.tile(views, 2), (WIDTH - 2 * TILE[0] - 4, 0))
    crops = env.views.crops(CROP)
    for k, crop in enumerate(crops[:4]):
        _paste(frame, crop, (WIDTH - 2 * TILE[0] - 4 + k * (CROP + 4), 2 * TILE[1] + 52))
    title = "what the pose network is given: crops round the predicted worker"
    if not crops:
        title = f"perception level {env.simulation.perception}: nobody looked at these pictures"
    pictures.write(frame, title, (WIDTH - 2 * TILE[0], 2 * TILE[1] + 22), 16)
    _paste(frame, strip(diary, env.config.ctrl_dt, env.config.cost.proximity_m), (0, 720))
    return frame


def strip(diary: Diary, dt_s: float, limit_m: float) -> Image:
    """True and estimated separation over the last seconds; red where a step cost."""
    image = np.empty((STRIP_HEIGHT, WIDTH, 3), np.uint8)
    image[:] = pictures.PANEL
    n_shown = round(STRIP_S / dt_s)
    left, right, top, bottom = 230, WIDTH - 20, 14, STRIP_HEIGHT - 14

    def y_of(metres: float) -> int:
        return round(bottom - (bottom - top) * float(np.clip(metres, 0, FAR_M)) / FAR_M)

    first = max(0, len(diary.cost) - n_shown)
    for k, value in enumerate(diary.cost[first:]):
        if value > 0:
            x = round(left + (right - left) * k / n_shown)
            colour = (150, 30, 40) if value < 2 else (255, 40, 60)
            cv2.rectangle(image, (x, top), (x + 6, bottom), colour, -1)
    for metres in (0.0, 0.5, 1.0, 1.5):
        cv2.line(image, (left, y_of(metres)), (right, y_of(metres)), (60, 66, 74), 1)
        pictures.write(image, f"{metres:.1f} m", (left - 52, y_of(metres) - 9), 14)
    cv2.line(image, (left, y_of(limit_m)), (right, y_of(limit_m)), (190, 70, 80), 1)
    for series, colour in ((diary.true_m, pictures.INK), (diary.estimated_m, (90, 230, 160))):
        shown = series[first:]
        points = [
            (round(left + (right - left) * k / n_shown), y_of(value))
            for k, value in enumerate(shown)
        ]
        cv2.polylines(image, [np.array(points, np.int32)], False, colour, 2, cv2.LINE_AA)
    pictures.write(image, "separation", (14, 14), 18)
    pictures.write(image, "true", (14, 44), 15)
    pictures.write(image, "as the robot believes", (14, 66), 15, (90, 230, 160))
    pictures.write(image, f"cost {sum(diary.cost):.0f}", (14, 100), 18, (255, 110, 120))
    pictures.write(image, f"{len(diary.cost) * dt_s:.1f} s", (14, 130), 18)
    return image


def _paste(frame: Image, picture: NDArray[np.uint8], at: tuple[int, int]) -> None:
    x, y = at
    frame[y : y + picture.shape[0], x : x + picture.shape[1]] = picture
