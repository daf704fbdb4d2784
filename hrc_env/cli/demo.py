"""python -m hrc_env demo: a film of a robot that yields to a worker it sees."""

import time
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from hrc_env.cli.checks import at_least, writable_file
from hrc_env.cli.environment import EnvironmentArguments
from hrc_env.core.checkout import agents


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
        console, started_s = Console(), time.monotonic()
        console.print("Loading the simulator ...")
        from hrc_env.cli.film import film_episode, table  # here: --help imports no simulator
        from hrc_env.config import settle

        keywords = self.keywords()
        ctrl_dt = settle(**keywords).config.ctrl_dt
        at_least("--seconds", self.seconds, ctrl_dt)
        registry = agents("registry")
        n_steps = round(self.seconds / ctrl_dt)
        totals = film_episode(
            lambda env_info: registry.make_agent("scripted_slowed", env_info),
            self.out, self.seed, n_steps, **keywords,
        )  # fmt: skip
        totals["all in all [s]"] = time.monotonic() - started_s
        console.print(table(totals, "the worker is known through four cameras only"))
        console.print(f"Watch [bold]{self.out}[/] (still: {self.out.with_suffix('.png')})")
        return 0
