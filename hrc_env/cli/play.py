"""python -m hrc_env play, demo: let an agent loose, in the terminal, a film or a window."""

import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.table import Table

import hrc_env
from hrc_env.cli.checks import at_least, writable_file
from hrc_env.core.errors import check_names
from hrc_env.core.progress import track
from hrc_env.env_words import EnvironmentArguments
from hrc_env.pipeline.ready import make_ready
from hrc_env.tasks import DEFAULT


@dataclass(frozen=True, kw_only=True)
class Play(EnvironmentArguments):
    """Play episodes of an environment with an agent; say how they went."""

    task: Annotated[str, tyro.conf.Positional] = DEFAULT
    """Which environment, by its id."""
    agent: str = "scripted_slowed"
    """Agent: random, scripted, scripted_slowed, hrc://ID/NAME (python -m hrc_env list); the path of
    a checkpoint of `train` or of Stable-Baselines3 (.zip) or of a policy of `export`
    (.safetensors); or MODULE:FUNCTION, a function that is given an EnvInfo and returns an
    object with act(observation). Files of this package know --control."""
    trust: bool = False
    """Read pickles in a checkpoint of Stable-Baselines3, which run code of whoever made it: for
    policy or network classes of its author's own, and for statistics of VecNormalize."""
    episodes: int = 1
    """How many episodes to play."""
    seed: int = 0
    """Seed of the first episode; the next ones count up."""
    video: Path | None = None
    """Film the first episode, and play no other, into this .mp4 file."""
    viewer: bool = False
    """Show the scene in MuJoCo's interactive viewer (needs a display)."""

    def run(self) -> int:
        """Play."""
        check_names("environment", [self.task], hrc_env.IDS)
        at_least("--episodes", self.episodes, 1)
        at_least("--seed", self.seed, 0)
        from hrc_env.agents.registry import control_of  # here: --help imports no simulator

        asked = replace(self, control=self.control or control_of(self.agent))
        if self.video is not None:
            writable_file(self.video, ".mp4", "--video")
            filmed(asked, self.agent, self.video, trust=self.trust)
            return 0
        import gymnasium

        make_ready(Console(), self.perception)
        with closing(gymnasium.make(self.task, **asked.keywords())) as env:
            for episode in range(self.episodes):
                self._play(env, self.seed + episode)
        return 0

    def _play(self, env: Any, seed: int) -> None:
        from hrc_env.evaluation import film
        from hrc_env.scene.viewer import Viewer

        inner = env.unwrapped
        window = Viewer(inner.simulation.scene) if self.viewer else None
        limit = env.spec.max_episode_steps
        played = film.begin(env, named(self.agent, seed, self.trust), seed, limit)
        started_s, total, step, info = time.monotonic(), 0.0, 0, {}
        for step, made in enumerate(track(played, f"episode {seed}", limit), 1):
            total, info = total + float(made.reward), made.info
            if window is not None:
                window.show(*inner.views.pose())
                due_s = started_s + step * inner.config.ctrl_dt
                time.sleep(max(0.0, due_s - time.monotonic()))
        if window is not None:
            window.close()
        counts = inner.simulation.task.counts(info).items()
        said = [f"return {total:.1f}", *(f"{name} {n:.0f}" for name, n in counts)]
        pace = step / (time.monotonic() - started_s)
        said += [f"cost {info['episode_cost']:.0f}", f"{pace:.0f} steps/s"]
        Console().print(f"seed {seed}: {', '.join(said)}")


@dataclass(frozen=True, kw_only=True)
class Demo(EnvironmentArguments):
    """Film the scripted reacher, slowed by the separation that it estimates from pixels."""

    out: Path = Path("out/demo.mp4")
    """The film; a still PNG is written beside it."""
    seed: int = 7
    """Seed of the episode."""
    seconds: float = 10.0
    """Length of the film."""

    def run(self) -> int:
        """Film and tell."""
        at_least("--seed", self.seed, 0)
        writable_file(self.out, ".mp4")
        Console().print("Loading the simulator ...")
        from hrc_env.settings import settle  # here: --help imports no simulator

        ctrl_dt = settle(**self.keywords()).config.ctrl_dt
        at_least("--seconds", self.seconds, ctrl_dt)
        make_ready(Console(), self.perception, draws=True, installs=True)
        title = "the worker is known through four cameras only"
        filmed(self, "scripted_slowed", self.out, round(self.seconds / ctrl_dt), title)
        Console().print(f"Watch [bold]{self.out}[/] (still: {self.out.with_suffix('.png')})")
        return 0


def filmed(
    asked: Play | Demo,
    agent: str,
    path: Path,
    n_steps: int | None = None,
    title: str = "",
    trust: bool = False,
) -> None:
    """Film an episode of an agent by its name, up to its end; show what came of it."""
    from hrc_env.evaluation import film

    make, keywords = named(agent, asked.seed, trust), asked.keywords()
    totals = film.film_episode(make, path, asked.seed, n_steps=n_steps, **keywords)
    Console().print(table(totals, title))


def named(agent: str, seed: int, trust: bool) -> Callable[[Any], Any]:
    """What makes an agent, by its name, for an `EnvInfo`."""
    from hrc_env.agents.registry import make_agent

    return lambda env_info: make_agent(agent, env_info, seed, trust)


def table(totals: dict[str, float], title: str = "") -> Table:
    """Return what `film_episode` has measured as a table, each value with its unit."""
    rows = Table("", "", "unit", title=title or None)
    rows.columns[1].justify = "right"
    for name, value in totals.items():
        what, _, unit = name.removesuffix("]").partition(" [")
        rows.add_row(what, f"{value:.{({'count': 0, 'm': 2}).get(unit, 1)}f}", unit)
    return rows
