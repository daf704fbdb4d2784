"""Films of an agent: played, drawn and encoded; and which episode is worth one."""

import copy
import os
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any

import imageio.v2 as imageio
import numpy as np
from rich.console import Console
from rich.table import Table

from hrc_env.cli.frame import Diary, compose
from hrc_env.cli.progress import compile_kernels, track
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
    """Film `n_steps` of an agent, every second one, into an .mp4 file; returns what came of them,
    by name and [unit].

    A still of the closest moment that is no near miss yet (or of the first step) is written beside
    it as .png. `kwargs` are those of `HRCEnv`.
    """
    level = kwargs.get("perception", "pixels")
    compile_kernels(Console(), level)
    Console().print(f"Making the environment: perception {level} ...")
    env = HRCEnv(**kwargs)
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".draft.mp4")
    try:
        totals, still = _filmed(env, make, draft, seed, n_steps)
        imageio.imwrite(path.with_suffix(".png"), still)
        os.replace(draft, path)
    finally:
        env.close()
        draft.unlink(missing_ok=True)
    return totals


def nearest_seed(make: Make, seeds: Iterable[int], n_steps: int = 250, **kwargs: Any) -> int:
    """Of some seeds the one whose episode comes closest to the worker without touching them.

    Nothing is drawn: "pixels" is played as "keypoints", and may come out otherwise in the film.
    """
    if kwargs.get("perception", "pixels") == "pixels":
        kwargs = {**kwargs, "perception": "keypoints", "appearance": None}
    with closing(HRCEnv(**kwargs)) as env:
        tried = track(list(seeds), "looking for an encounter")
        closest_m = {seed: _closest_m(env, make, seed, n_steps) for seed in tried}
    free = [seed for seed, metres in closest_m.items() if metres > CLOSE_M]
    if free:
        return min(free, key=closest_m.__getitem__)
    return max(closest_m, key=closest_m.__getitem__)  # all are near misses: the least one


def begun(env: Any, make: Make, seed: int, n_steps: int) -> Iterator[tuple[float, dict[str, Any]]]:
    """An agent's episode, which has begun: reward and info of each step up to its end."""
    agent = make(agents("env_info").env_info(env.unwrapped.simulation))
    return _steps(env, agent, env.reset(seed=seed)[0], n_steps)


def _steps(
    env: Any, agent: Any, observation: Any, n_steps: int
) -> Iterator[tuple[float, dict[str, Any]]]:
    for _ in range(n_steps):
        observation, reward, terminated, truncated, info = env.step(agent.act(observation))
        yield float(reward), info
        if terminated or truncated:
            break


def table(totals: dict[str, float], title: str = "") -> Table:
    """What `film_episode` has returned, each value with its unit."""
    rows = Table("", "", "unit", title=title or None)
    rows.columns[1].justify = "right"
    for name, value in totals.items():
        what, _, unit = name.removesuffix("]").partition(" [")
        rows.add_row(what, f"{value:.{({'count': 0, 'm': 2}).get(unit, 1)}f}", unit)
    return rows


def _closest_m(env: HRCEnv, make: Make, seed: int, n_steps: int) -> float:
    played = begun(env, make, seed, n_steps)
    return min(float(info.get("safety/min_separation_m", np.inf)) for _, info in played)


def _filmed(
    env: HRCEnv, make: Make, path: Path, seed: int, n_steps: int
) -> tuple[dict[str, float], Image]:
    """Play, have every second step drawn; what came of it, and the still."""
    played = begun(env, make, seed, n_steps)
    diary, closest_m, started_s = Diary(), np.inf, time.monotonic()
    with _Studio(env, path) as studio:
        for step, (_, info) in enumerate(track(played, "filming", n_steps)):
            believed = env.simulation.belief.separation.distance_m
            diary.note(info, float(believed.min(initial=np.inf)), env.simulation.task.counts(info))
            if step % STEPS_PER_FRAME == 0:
                closer = CLOSE_M < diary.true_m[-1] < closest_m
                closest_m = diary.true_m[-1] if closer else closest_m
                studio.add(diary, is_still=closer or step == 0)
        studio.finish()
        seconds = time.monotonic() - started_s
    return _totals(diary, seconds), studio.still


class _Studio:
    """Draws frames and hands them to ffmpeg in a thread, while the environment goes on."""

    def __init__(self, env: HRCEnv, path: Path) -> None:
        self.still: Image = np.zeros((1, 1, 3), np.uint8)
        """The last frame that was asked to be one."""
        self._env, fps = env, 1 / env.config.ctrl_dt / STEPS_PER_FRAME
        self._writer: Any = imageio.get_writer(
            path, fps=fps, quality=None, macro_block_size=4, output_params=list(H264)
        )
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="hrc_env-film")
        self._waiting: deque[Future[None]] = deque()

    def add(self, diary: Diary, is_still: bool) -> None:
        """Draw this moment some time."""
        moment = copy.deepcopy(diary), self._env.views.glance(), is_still
        self._waiting.append(self._thread.submit(self._draw, *moment))
        self.finish(FRAMES_BEHIND)

    def finish(self, n_behind: int = 0) -> None:
        """Wait until no more than so many frames wait."""
        while len(self._waiting) > n_behind:
            self._waiting.popleft().result()

    def _draw(self, diary: Diary, seen: Glance, is_still: bool) -> None:
        frame = compose(self._env, diary, seen)
        self.still = frame if is_still else self.still
        self._writer.append_data(frame)

    def __enter__(self) -> "_Studio":
        return self

    def __exit__(self, *_: object) -> None:
        """Free what was made in the thread, there."""
        self._thread.submit(self._env.views.close).result()
        self._thread.shutdown()
        self._writer.close()


def _totals(diary: Diary, seconds: float) -> dict[str, float]:
    errors_m = np.array(diary.error_m)
    known = errors_m[np.isfinite(errors_m)]
    return {
        "median tracking error [mm]": 1e3 * float(np.median(known)) if len(known) else np.nan,
        "lost steps [%]": 100 * (1 - len(known) / len(errors_m)),
        "minimum separation [m]": min(diary.true_m),
        **{f"{name} [count]": n for name, n in diary.counts.items()},
        "cost [count]": sum(diary.cost),
        "film drawn [frames/s]": len(errors_m) / STEPS_PER_FRAME / seconds,
    }
