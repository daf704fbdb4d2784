"""Films of an agent: played, drawn and encoded; and which episode is worth one."""

import os
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any

import imageio.v2 as imageio
import numpy as np
from rich.console import Console

from hrc_env.agents.env_info import env_info
from hrc_env.core.progress import track
from hrc_env.core.typing import Image
from hrc_env.env import HRCEnv
from hrc_env.evaluation.rollout import Transition, rollout
from hrc_env.pipeline.ready import make_ready
from hrc_env.render.frame import MOMENT, Diary, compose

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
    make: Make, path: Path, seed: int = 0, n_steps: int | None = None, **kwargs: Any
) -> dict[str, float]:
    """Film an agent in the `HRCEnv` of `kwargs` into an .mp4 file; what came of it, by name [unit].

    The film ends with the episode, or after `n_steps` (None: the task's time limit). A still of the
    closest moment that is no near miss yet, or of the first, is written beside it.
    """
    level = kwargs.get("perception", "pixels")
    make_ready(Console(), level, draws=True)
    Console().print(f"Making the environment: perception {level} ...")
    env = HRCEnv(**kwargs)
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".draft.mp4")
    try:
        totals, still = _filmed(env, make, draft, seed, n_steps or _limit(env))
        imageio.imwrite(path.with_suffix(".png"), still)
        os.replace(draft, path)
    finally:
        env.close()
        draft.unlink(missing_ok=True)
    return totals


def nearest_seed(
    make: Make, seeds: Iterable[int], n_steps: int | None = None, **kwargs: Any
) -> int:
    """Of some seeds the one whose episode comes closest to the worker without touching them.

    Nothing is drawn: "pixels" is played as "keypoints", and may come out otherwise in the film.
    """
    if kwargs.get("perception", "pixels") == "pixels":
        kwargs = {**kwargs, "perception": "keypoints", "appearance": None}
    with closing(HRCEnv(**kwargs)) as env:
        tried = track(list(seeds), "looking for an encounter")
        closest_m = {seed: _closest_m(env, make, seed, n_steps or _limit(env)) for seed in tried}
    free = [seed for seed, metres in closest_m.items() if metres > CLOSE_M]
    if free:
        return min(free, key=closest_m.__getitem__)
    return max(closest_m, key=closest_m.__getitem__)  # all are near misses: the least one


def begin(env: Any, make: Make, seed: int, n_steps: int) -> Iterator[Transition]:
    """Begin an episode of the agent that is made; return its steps up to its end."""
    agent = make(env_info(env.unwrapped.simulation))
    return rollout(env, agent, env.reset(seed=seed)[0], n_steps)


def _limit(env: HRCEnv) -> int:
    return env.simulation.task.max_episode_steps


def _closest_m(env: HRCEnv, make: Make, seed: int, n_steps: int) -> float:
    played = begin(env, make, seed, n_steps)
    return min(float(step.info["safety/min_separation_m"]) for step in played)


def _filmed(
    env: HRCEnv, make: Make, path: Path, seed: int, n_steps: int
) -> tuple[dict[str, float], Image]:
    """Play, while a thread draws and encodes every second step; what came of it, and the still."""
    played, waiting = begin(env, make, seed, n_steps), deque[Future[Image]]()
    writer: Any = imageio.get_writer(
        path, fps=1 / env.config.ctrl_dt / STEPS_PER_FRAME,
        quality=None, macro_block_size=4, output_params=list(H264),
    )  # fmt: skip

    def draw(*moment: Any) -> Image:
        frame = compose(env.views, *moment)
        writer.append_data(frame)
        return frame

    still: Future[Image] = Future()
    diary, closest_m, started_s = np.zeros(n_steps, MOMENT), np.inf, time.monotonic()
    step, counts = 0, {}
    with closing(writer), ThreadPoolExecutor(1, "hrc_env-film") as thread:
        for step, made in enumerate(track(played, "filming", n_steps)):
            info = made.info
            believed = env.simulation.belief.separation.distance_m
            true_m = info["safety/min_separation_m"]
            error_m = info["tracking/mpjpe_m"] if info["tracking/mpjpe_measured"] else np.nan
            diary[step] = true_m, believed.min(initial=np.inf), error_m, info["cost"]
            counts = env.simulation.task.counts(info)
            if step % STEPS_PER_FRAME == 0:
                glance = env.views.glance()
                waiting.append(thread.submit(draw, diary[: step + 1], counts, glance))
                closer = CLOSE_M < true_m < closest_m
                closest_m = true_m if closer else closest_m
                still = waiting[-1] if closer or step == 0 else still
                if len(waiting) > FRAMES_BEHIND:
                    waiting.popleft().result()
        for drawn in waiting:
            drawn.result()
        seconds = time.monotonic() - started_s
    return _totals(diary[: step + 1], counts, seconds), still.result()


def _totals(diary: Diary, counts: Mapping[str, float], seconds: float) -> dict[str, float]:
    known = diary["error_m"][np.isfinite(diary["error_m"])]
    return {
        "median tracking error [mm]": 1e3 * float(np.median(known)) if len(known) else np.nan,
        "lost steps [%]": 100 * (1 - len(known) / len(diary)),
        "minimum separation [m]": float(diary["true_m"].min()),
        **{f"{name} [count]": n for name, n in counts.items()},
        "cost [control steps]": float(diary["cost"].sum()),
        "film drawn [frames/s]": len(diary) / STEPS_PER_FRAME / seconds,
    }
