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

from hrc_env.cli.frame import Diary, compose
from hrc_env.cli.kernels import compile_kernels
from hrc_env.cli.progress import progress_bar
from hrc_env.core.checkout import agents
from hrc_env.core.typing import Image
from hrc_env.env import HRCEnv
from hrc_env.render.views import Glance

STEPS_PER_FRAME = 2
"""A film shows every second step, in real time."""
CLOSE_M = 0.1
"""The still shows the closest moment that is not yet closer than this [m]."""
H264 = ("-preset", "superfast", "-crf", "18")
"""A fifth of the usual preset's time; sharp."""
FRAMES_BEHIND = 2
"""So many frames may wait to be drawn."""

Make = Callable[[Any], Any]
"""Builds the agent for an `EnvInfo`."""


def film_episode(
    make: Make, path: Path, seed: int = 0, n_steps: int = 250, **kwargs: Any
) -> dict[str, float]:
    """Film `n_steps` of an agent; returns what came of them, by name and [unit].

    Args:
        make: builds the agent for an `EnvInfo`.
        path: an .mp4 file; a still of the closest moment that is no near miss yet (or of the
            first step) is written beside it as .png.
        seed: of the episode.
        n_steps: how many steps; every second one is a frame.
        kwargs: as of `HRCEnv`.

    Raises:
        RenderingError: this machine has no OpenGL.
    """
    console = Console()
    compile_kernels(console, kwargs.get("perception", "pixels"))
    console.print(f"Making the environment: perception {kwargs.get('perception', 'pixels')} ...")
    env = HRCEnv(**kwargs)
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".draft.mp4")
    try:
        agent = make(agents("env_info").env_info(env.simulation))
        console.print("First look at the scene ...")
        observation, _ = env.reset(seed=seed)
        console.print("Drawing what stands still in it ...")
        with _Studio(env, draft) as studio:
            totals = _roll(env, agent, observation, n_steps, studio, console)
        imageio.imwrite(path.with_suffix(".png"), studio.still)
        os.replace(draft, path)
    finally:
        env.close()
        draft.unlink(missing_ok=True)
    return totals


def nearest_seed(make: Make, seeds: Iterable[int], n_steps: int = 250, **kwargs: Any) -> int:
    """Of some seeds the one whose episode comes closest to the worker without touching them.

    Nothing is drawn: "pixels" is played as "keypoints", and may come out otherwise in the film.

    Args:
        make: builds the agent for an `EnvInfo`.
        seeds: of the episodes that are played.
        n_steps: their length.
        kwargs: as of `HRCEnv`.
    """
    if kwargs.get("perception", "pixels") == "pixels":
        kwargs = {**kwargs, "perception": "keypoints", "appearance": None}
    env, closest_m, tried = HRCEnv(**kwargs), {}, list(seeds)
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


def _closest_m(env: HRCEnv, make: Make, seed: int, n_steps: int) -> float:
    agent = make(agents("env_info").env_info(env.simulation))
    observation, _ = env.reset(seed=seed)
    closest_m = np.inf
    for _ in range(n_steps):
        observation, _, terminated, _, info = env.step(agent.act(observation))
        closest_m = min(closest_m, float(info.get("safety/min_separation_m", np.inf)))
        if terminated:
            break
    return closest_m


def _roll(
    env: HRCEnv,
    agent: Any,
    observation: Any,
    n_steps: int,
    studio: "_Studio",
    console: Console,
) -> dict[str, float]:
    """Play and have every second step drawn; the still is the closest moment yet to come."""
    diary, errors_m, info = Diary(), [], {}
    closest_m, started_s = np.inf, time.monotonic()
    with progress_bar(console, "filming") as advance:
        for step in range(n_steps):
            observation, _, terminated, _, info = env.step(agent.act(observation))
            gap_m = float(env.simulation.believed.separation.distance_m.min(initial=np.inf))
            diary.note(info, gap_m, env.simulation.task.counts(info))
            errors_m.append(info.get("tracking/mpjpe_m", np.nan))
            if step % STEPS_PER_FRAME == 0:
                closer = CLOSE_M < diary.true_m[-1] < closest_m
                closest_m = diary.true_m[-1] if closer else closest_m
                studio.add(diary, closer or step == 0)
            advance(1 / n_steps, "filming")
            if terminated:
                break
        studio.finish()
    seconds = time.monotonic() - started_s
    known = [error for error in errors_m if error == error]
    return {
        "median tracking error [mm]": 1e3 * float(np.median(known)) if known else np.nan,
        "lost steps [%]": 100 * (1 - len(known) / len(errors_m)),
        "minimum separation [m]": float(np.min(diary.true_m)),
        **{f"{name} [count]": n for name, n in env.simulation.task.counts(info).items()},
        "cost [count]": info["episode_cost"],
        "steps played [steps/s]": len(errors_m) / seconds,
        "film drawn [frames/s]": len(range(0, len(errors_m), STEPS_PER_FRAME)) / seconds,
    }


class _Studio:
    """Draws frames and hands them to ffmpeg in a thread, while the environment goes on."""

    def __init__(self, env: HRCEnv, path: Path) -> None:
        self.still: Image = np.zeros((1, 1, 3), np.uint8)
        """The last frame that was asked to be one."""
        self._env = env
        self._writer = imageio.get_writer(
            path, fps=1 / env.config.ctrl_dt / STEPS_PER_FRAME, quality=None,
            macro_block_size=4, output_params=list(H264),
        )  # fmt: skip
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="hrc_env-film")
        self._waiting: deque[Future[None]] = deque()

    def add(self, diary: Diary, is_still: bool) -> None:
        """Draw this moment some time."""
        seen = self._env.views.glance()
        self._waiting.append(self._thread.submit(self._draw, diary.copy(), seen, is_still))
        while len(self._waiting) > FRAMES_BEHIND:
            self._waiting.popleft().result()

    def finish(self) -> None:
        """Wait for what is not drawn yet."""
        while self._waiting:
            self._waiting.popleft().result()

    def _draw(self, diary: Diary, seen: Glance, is_still: bool) -> None:
        frame = compose(self._env, diary, seen)
        self.still = frame if is_still else self.still
        self._writer.append_data(frame)

    def __enter__(self) -> "_Studio":
        return self

    def __exit__(self, *_: object) -> None:
        """Free what was made in the thread, there."""
        self._waiting.clear()
        self._thread.submit(self._env.views.close).result()
        self._thread.shutdown()
        self._writer.close()
