"""Films of an agent: played, drawn and encoded; and which episode is worth one."""

import os
import time
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import imageio.v2 as imageio
import numpy as np
from rich.console import Console
from rich.table import Table

from hrc_env.agents_door import agents
from hrc_env.cli.frame import Diary, compose
from hrc_env.cli.progress import progress_bar
from hrc_env.env import HRCReachEnv
from hrc_env.typing import Image

STEPS_PER_FRAME = 2
"""A film shows every second step, in real time."""
CLOSE_M = 0.1
"""The still shows the closest moment that is not yet closer than this [m]."""
H264 = ("-preset", "veryfast", "-crf", "17")
"""A third of the usual preset's time; sharp."""
FRAMES_AHEAD = 8
"""So many frames may wait for the encoder."""

Make = Callable[[Any], Any]
"""Builds the agent for a `Situation`."""


def film_episode(
    make: Make, path: Path, seed: int = 0, n_steps: int = 250, **kwargs: Any
) -> dict[str, float]:
    """Film `n_steps` of an agent; returns what came of them, by name and [unit].

    Args:
        make: builds the agent for a `Situation`.
        path: an .mp4 file; a still of the closest moment that is no near miss yet (or of the
            first step) is written beside it as .png.
        seed: of the episode.
        n_steps: how many steps; every second one is a frame.
        kwargs: as of `HRCReachEnv`.

    Raises:
        RenderingError: this machine has no OpenGL.
    """
    console = Console()
    console.print(f"Making the environment: perception {kwargs.get('perception', 'pixels')} ...")
    env = HRCReachEnv(**kwargs)
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".draft.mp4")
    try:
        agent = make(agents("base").situation(env.simulation))
        console.print("First look at the scene, and drawing what stands still in it ...")
        observation, _ = env.reset(seed=seed)
        compose(env, Diary())
        with _Encoder(draft, 1 / env.config.ctrl_dt / STEPS_PER_FRAME) as encoder:
            still = path.with_suffix(".png")
            totals = _roll(env, agent, observation, n_steps, encoder, still, console)
    finally:
        env.close()
    os.replace(draft, path)
    return totals


def nearest_seed(make: Make, seeds: Iterable[int], n_steps: int = 250, **kwargs: Any) -> int:
    """Of some seeds the one whose episode comes closest to the worker without touching them.

    Nothing is drawn: "pixels" is played as "keypoints", and may come out otherwise in the film.

    Args:
        make: builds the agent for a `Situation`.
        seeds: of the episodes that are played.
        n_steps: their length.
        kwargs: as of `HRCReachEnv`.
    """
    if kwargs.get("perception", "pixels") == "pixels":
        kwargs = {**kwargs, "perception": "keypoints", "appearance": None}
    env, closest_m, tried = HRCReachEnv(**kwargs), {}, list(seeds)
    try:
        with progress_bar(Console(), "looking for an encounter") as advance:
            for seed in tried:
                closest_m[seed] = _closest_m(env, make, seed, n_steps)
                advance(1 / len(tried), "looking for an encounter")
    finally:
        env.close()
    return _encounter(closest_m)


def table(totals: dict[str, float], title: str = "") -> Table:
    """What `film_episode` has returned, each value with its unit."""
    rows = Table("", "", "unit", title=title or None)
    rows.columns[1].justify = "right"
    for name, value in totals.items():
        what, _, unit = name.partition(" [")
        places = {"count": 0, "m": 2}.get(unit.rstrip("]"), 1)
        rows.add_row(what, f"{value:.{places}f}", unit.rstrip("]"))
    return rows


def _encounter(closest_m: dict[int, float]) -> int:
    """The seed of the closest episode that is no near miss; else of the one least close."""
    apart = {seed: metres for seed, metres in closest_m.items() if metres > CLOSE_M}
    if apart:
        return min(apart, key=lambda seed: apart[seed])
    return max(closest_m, key=lambda seed: closest_m[seed])


def _closest_m(env: HRCReachEnv, make: Make, seed: int, n_steps: int) -> float:
    agent = make(agents("base").situation(env.simulation))
    observation, _ = env.reset(seed=seed)
    closest_m = np.inf
    for _ in range(n_steps):
        observation, _, terminated, _, info = env.step(agent.act(observation))
        closest_m = min(closest_m, float(info.get("safety/min_separation_m", np.inf)))
        if terminated:
            break
    return closest_m


def _roll(
    env: HRCReachEnv,
    agent: Any,
    observation: Any,
    n_steps: int,
    encoder: "_Encoder",
    still: Path,
    console: Console,
) -> dict[str, float]:
    """Play, draw every second step, and keep the stillest moment of truth: the closest one seen."""
    diary, errors_m, info = Diary(), [], {}
    closest_m, started_s = np.inf, time.monotonic()
    with progress_bar(console, "filming") as advance:
        for step in range(n_steps):
            observation, _, terminated, _, info = env.step(agent.act(observation))
            diary.note(info, float(env.simulation.believed.gap.distance_m.min(initial=np.inf)))
            errors_m.append(info.get("tracking/mpjpe_m", np.nan))
            if step % STEPS_PER_FRAME == 0:
                frame = compose(env, diary)
                encoder.add(frame)
                closer = CLOSE_M < diary.true_m[-1] < closest_m
                closest_m = diary.true_m[-1] if closer else closest_m
                if closer or step == 0:
                    kept = frame
            advance(1 / n_steps, "filming")
            if terminated:
                break
    imageio.imwrite(still, kept)
    seconds = time.monotonic() - started_s
    known = [error for error in errors_m if error == error]
    return {
        "median tracking error [mm]": 1e3 * float(np.median(known)) if known else np.nan,
        "lost steps [%]": 100 * (1 - len(known) / len(errors_m)),
        "minimum separation [m]": float(np.min(diary.true_m)),
        "goals reached [count]": info["task/goals_reached"],
        "goals missed [count]": info["task/goals_missed"],
        "cost [count]": info["episode_cost"],
        "steps played [steps/s]": len(errors_m) / seconds,
        "film drawn [frames/s]": len(range(0, len(errors_m), STEPS_PER_FRAME)) / seconds,
    }


class _Encoder:
    """Writes frames to a film in a thread; the encoder itself is ffmpeg's process."""

    def __init__(self, path: Path, fps: float) -> None:
        self._writer = imageio.get_writer(
            path, fps=fps, quality=None, macro_block_size=4, output_params=list(H264)
        )
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="hrc_env-film")
        self._waiting: deque[Future[None]] = deque()

    def add(self, frame: Image) -> None:
        """Take a frame, which is not to be changed any more."""
        self._waiting.append(self._thread.submit(self._writer.append_data, frame))
        while len(self._waiting) > FRAMES_AHEAD or (self._waiting and self._waiting[0].done()):
            self._waiting.popleft().result()

    def __enter__(self) -> "_Encoder":
        return self

    def __exit__(self, *_: object) -> None:
        try:
            for future in self._waiting:
                future.result()
        finally:
            self._thread.shutdown()
            self._writer.close()
