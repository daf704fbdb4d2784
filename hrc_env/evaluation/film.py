"""Films of an agent's episodes, and the search for an episode with a close encounter."""

import os
import time
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

import imageio.v2 as imageio
import numpy as np
from rich.console import Console

from hrc_env.agents.env_info import AgentFactory, env_info
from hrc_env.core.progress import track
from hrc_env.core.typing import Image
from hrc_env.env import HRCEnv
from hrc_env.evaluation.episodes import to_batch
from hrc_env.evaluation.rollout import Transition, rollout
from hrc_env.evaluation.sums import ABOVE, INTERVENTIONS, EpisodeSums
from hrc_env.pipeline.ready import make_ready
from hrc_env.render.frame import MOMENT, Diary, compose
from hrc_env.safety.incidents import KINDS

STEPS_PER_FRAME = 2
"""Number of control steps per film frame; the film runs in real time."""
CLOSE_M = 0.1
"""Distance up to which an approach counts as a near miss [m]. The still shows the closest moment
that is not a near miss."""
H264 = ("-preset", "superfast", "-crf", "18")
"""Encoder options for sharp images; encoding takes a fifth of the time of the default preset."""
FRAMES_BEHIND = 2
"""Maximum number of frames that are queued for rendering."""


class FilmResult(NamedTuple):
    """Totals and still image of a filmed episode."""

    totals: dict[str, float]
    """Totals of the episode by name and unit, as "name [unit]"."""
    still: Image
    """The frame of the closest moment that is not a near miss, or the first frame."""


def film_episode(
    make: AgentFactory, path: Path, seed: int = 0, n_steps: int | None = None, **kwargs: Any
) -> dict[str, float]:
    """Film one episode of an agent and return its totals by name and unit, as "name [unit]".

    The film ends with the episode, or after `n_steps` (default: the task's time limit). A still
    (.png) of the closest moment that is not a near miss, or of the first moment, is written to the
    same folder.

    Args:
        make: function that makes the agent for an `EnvInfo`.
        path: the .mp4 file to write.
        seed: seed of the episode.
        n_steps: maximum number of control steps.
        kwargs: arguments of `HRCEnv`.
    """
    level = kwargs.get("perception", "pixels")
    make_ready(Console(), level, draws=True)
    Console().print(f"Creating the environment: perception {level} ...")
    env = HRCEnv(**kwargs)
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".draft.mp4")
    try:
        result = _film(env, make, draft, seed, n_steps or _get_time_limit(env))
        imageio.imwrite(path.with_suffix(".png"), result.still)
        os.replace(draft, path)
    finally:
        env.close()
        draft.unlink(missing_ok=True)
    return result.totals


def find_nearest_seed(
    make: AgentFactory, seeds: Iterable[int], n_steps: int | None = None, **kwargs: Any
) -> int:
    """Return the seed of the episode in which the robot comes closest without a near miss.

    No images are rendered: the level "pixels" is replaced by "keypoints". The episode in the film
    may therefore differ.
    """
    if kwargs.get("perception", "pixels") == "pixels":
        kwargs = {**kwargs, "perception": "keypoints", "appearance": None}
    with closing(HRCEnv(**kwargs)) as env:
        limit = n_steps or _get_time_limit(env)
        tried = track(list(seeds), "searching for an encounter")
        closest_m = {seed: _find_closest_m(env, make, seed, limit) for seed in tried}
    free = [seed for seed, distance_m in closest_m.items() if distance_m > CLOSE_M]
    if free:
        return min(free, key=closest_m.__getitem__)
    return max(closest_m, key=closest_m.__getitem__)  # all are near misses: the most distant


def begin_episode(env: Any, make: AgentFactory, seed: int, n_steps: int) -> Iterator[Transition]:
    """Reset an environment, make its agent, and return the steps of the episode."""
    agent = make(env_info(env.unwrapped.simulation))
    return rollout(env, agent, env.reset(seed=seed)[0], n_steps)


def _get_time_limit(env: HRCEnv) -> int:
    return env.simulation.task.max_episode_steps


def _find_closest_m(env: HRCEnv, make: AgentFactory, seed: int, n_steps: int) -> float:
    steps = begin_episode(env, make, seed, n_steps)
    return min(float(step.info["safety/min_separation_m"]) for step in steps)


def _film(env: HRCEnv, make: AgentFactory, path: Path, seed: int, n_steps: int) -> FilmResult:
    """Film an episode; a thread draws and encodes every second step."""
    steps, waiting = begin_episode(env, make, seed, n_steps), deque[Future[Image]]()
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
    step, counts, info, sums = 0, {}, {}, EpisodeSums(1)
    with closing(writer), ThreadPoolExecutor(1, "hrc_env-film") as thread:
        for step, transition in enumerate(track(steps, "filming", n_steps)):
            info = transition.info
            believed = env.simulation.belief.separation.distance_m
            true_m = info["safety/min_separation_m"]
            error_m = info["tracking/mpjpe_m"] if info["tracking/mpjpe_measured"] else np.nan
            diary[step] = true_m, believed.min(initial=np.inf), error_m, info["cost"]
            counts = env.simulation.task.counts(info)
            sums.add(np.array([transition.reward]), to_batch(transition))
            if step % STEPS_PER_FRAME == 0:
                glance = env.views.glance()
                waiting.append(thread.submit(draw, diary[: step + 1], counts, glance))
                closer = CLOSE_M < true_m < closest_m
                closest_m = true_m if closer else closest_m
                still = waiting[-1] if closer or step == 0 else still
                if len(waiting) > FRAMES_BEHIND:
                    waiting.popleft().result()
        for frame in waiting:
            frame.result()
        seconds = time.monotonic() - started_s
    episode = sums.summarize(0, info, env.simulation.task, env.config.ctrl_dt)
    return FilmResult(_sum_up(diary[: step + 1], counts, episode, seconds), still.result())


def _sum_up(
    diary: Diary, counts: Mapping[str, float], episode: Mapping[str, float], seconds: float
) -> dict[str, float]:
    """Return the totals of a film by name and unit.

    Args:
        diary: moments of the film.
        counts: counts of the task.
        episode: statistics of the episode (`EpisodeSums.summarize`).
        seconds: time that the film took [s].
    """
    errors_m = diary["error_m"][np.isfinite(diary["error_m"])]
    return {
        "median tracking error [mm]": 1e3 * float(np.median(errors_m)) if len(errors_m) else np.nan,
        "lost steps [%]": 100 * (1 - len(errors_m) / len(diary)),
        "minimum separation [m]": float(diary["true_m"].min()),
        **{f"{name} [count]": n for name, n in counts.items()},
        **{f"contacts {kind} [count]": episode[f"contacts_{kind}"] for kind in KINDS},
        "contacts above the force limit [count]": episode[ABOVE],
        "interventions of the shield [count]": episode[INTERVENTIONS],
        "cost [control steps]": float(diary["cost"].sum()),
        "film drawn [frames/s]": len(diary) / STEPS_PER_FRAME / seconds,
    }
