"""Play episodes with an agent: in the terminal, in a film or in a window."""

import math
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

import hrc_env
from hrc_env.cli.checks import check_at_least, check_writable_file
from hrc_env.core.errors import check_names
from hrc_env.core.progress import track
from hrc_env.env_words import EnvironmentArguments
from hrc_env.pipeline.ready import make_ready
from hrc_env.tasks import DEFAULT

if TYPE_CHECKING:  # --help imports no simulator
    from hrc_env.agents.env_info import Agent, EnvInfo


@dataclass(frozen=True, kw_only=True)
class Play(EnvironmentArguments):
    """Play episodes of an environment with an agent and print their scores."""

    task: Annotated[str, tyro.conf.Positional] = DEFAULT
    """Id of the environment."""
    agent: str = "scripted_slowed"
    """Agent: a name (random, scripted, scripted_slowed, hrc://ID/NAME; see python -m hrc_env list);
    a file (a checkpoint of `train` or Stable-Baselines3, .zip, or a policy of `export`,
    .safetensors); or MODULE:FUNCTION, a function that takes an EnvInfo and returns an object with
    act(observation). Files written by this package contain the control mode."""
    trust: bool = False
    """Allow pickles in a checkpoint of Stable-Baselines3, which can run arbitrary code, to be
    loaded: needed for custom policy or network classes, and for statistics of VecNormalize."""
    episodes: int = 1
    """Number of episodes to play."""
    seed: int = 0
    """Seed of the first episode; it increases by one with each further episode."""
    video: Path | None = None
    """File (.mp4) to which a film of the first episode is written; no further episodes are
    played."""
    viewer: bool = False
    """Show the scene in MuJoCo's interactive viewer (needs a display)."""

    def keywords(self) -> dict[str, Any]:
        """Return the environment's keyword arguments, completed by those that the agent needs."""
        from hrc_env.agents.registry import find_interface  # here: --help imports no simulator

        return find_interface(self.agent).complete(super().keywords())

    def run(self) -> int:
        """Play the episodes; return the exit status."""
        check_names("environment", [self.task], hrc_env.IDS)
        check_at_least("--episodes", self.episodes, 1)
        check_at_least("--seed", self.seed, 0)
        if self.video is not None:
            check_writable_file(self.video, ".mp4", "--video")
            film_agent(self, self.agent, self.video, trust=self.trust)
            return 0
        import gymnasium

        from hrc_env.core.results import describe_metric
        from hrc_env.evaluation.episodes import summarize

        make_ready(Console(), self.perception)
        with closing(gymnasium.make(self.task, **self.keywords())) as env:
            seeds = range(self.seed, self.seed + self.episodes)
            episodes = [self._play(env, seed) for seed in seeds]
        for name, metric in summarize(episodes).metrics().items():
            Console().print(f"{name:28s} {describe_metric(metric)}", highlight=False)
        return 0

    def _play(self, env: Any, seed: int) -> dict[str, float]:
        """Play an episode, print its score, and return its statistics (`EpisodeSums`)."""
        from hrc_env.evaluation import film
        from hrc_env.evaluation.episodes import to_batch
        from hrc_env.evaluation.sums import EpisodeSums
        from hrc_env.scene.viewer import Viewer

        inner = env.unwrapped
        window = Viewer(inner.simulation.scene) if self.viewer else None
        limit = env.spec.max_episode_steps
        make = make_agent_factory(self.agent, seed, self.trust)
        steps = film.begin_episode(env, make, seed, limit)
        started_s, total, step, info, sums = time.monotonic(), 0.0, 0, {}, EpisodeSums(1)
        for step, made in enumerate(track(steps, f"episode {seed}", limit), 1):
            total, info = total + float(made.reward), made.info
            sums.add(np.array([made.reward]), to_batch(made))
            if window is not None:
                window.show(*inner.views.pose())
                due_s = started_s + step * inner.config.ctrl_dt
                time.sleep(max(0.0, due_s - time.monotonic()))
        if window is not None:
            window.close()
        counts = inner.simulation.task.counts(info).items()
        parts = [f"return {total:.1f}", *(f"{name} {n:.0f}" for name, n in counts)]
        pace = step / (time.monotonic() - started_s)
        parts += [f"cost {info['episode_cost']:.0f}", f"{pace:.0f} steps/s"]
        Console().print(f"seed {seed}: {', '.join(parts)}")
        return sums.summarize(0, info, inner.simulation.task, inner.config.ctrl_dt)


@dataclass(frozen=True, kw_only=True)
class Demo(EnvironmentArguments):
    """Film a scripted robot that detects a person in rendered images and slows down near them."""

    out: Path = Path("out/demo.mp4")
    """File (.mp4) to which the film is written; a still image (.png) is written to the same
    folder."""
    seed: int = 7
    """Seed of the episode."""
    seconds: float = 10.0
    """Duration of the film [s]."""

    def run(self) -> int:
        """Write the film and print its scores; return the exit status."""
        check_at_least("--seed", self.seed, 0)
        check_writable_file(self.out, ".mp4")
        Console().print("Loading the simulator ...")
        from hrc_env.settings import resolve_settings  # here: --help imports no simulator

        ctrl_dt = resolve_settings(**self.keywords()).config.ctrl_dt
        check_at_least("--seconds", self.seconds, ctrl_dt)
        make_ready(Console(), self.perception, draws=True, installs=True)
        title = "the robot perceives the worker only through four cameras"
        film_agent(self, "scripted_slowed", self.out, round(self.seconds / ctrl_dt), title)
        Console().print(f"Watch [bold]{self.out}[/] (still: {self.out.with_suffix('.png')})")
        return 0


def film_agent(
    arguments: Play | Demo,
    agent: str,
    path: Path,
    n_steps: int | None = None,
    title: str = "",
    trust: bool = False,
) -> None:
    """Film one episode of an agent and print its totals.

    Args:
        arguments: the command, with the environment and the seed.
        agent: name of the agent.
        path: the .mp4 file to write.
        n_steps: duration of the film in control steps (default: the whole episode).
        title: title of the printed table.
        trust: whether pickles in a checkpoint may be loaded.
    """
    from hrc_env.evaluation import film

    make, keywords = make_agent_factory(agent, arguments.seed, trust), arguments.keywords()
    totals = film.film_episode(make, path, arguments.seed, n_steps=n_steps, **keywords)
    Console().print(make_table(totals, title))


def make_agent_factory(agent: str, seed: int, trust: bool) -> "Callable[[EnvInfo], Agent]":
    """Return a function that makes the named agent for an `EnvInfo`."""
    from hrc_env.agents.registry import make_agent

    return lambda env_info: make_agent(agent, env_info, seed, trust)


def make_table(totals: dict[str, float], title: str = "") -> Table:
    """Return the totals of `film_episode` as a table, each value with its unit."""
    rows = Table("", "", "unit", title=title or None)
    rows.columns[1].justify = "right"
    for name, value in totals.items():
        quantity, _, unit = name.removesuffix("]").partition(" [")
        text = f"{value:.{({'count': 0, 'm': 2}).get(unit, 1)}f}"
        rows.add_row(quantity, "-" if math.isnan(value) else text, unit)
    return rows
