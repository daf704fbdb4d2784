"""python -m hrc_env demo: a film of a robot that yields to a worker it sees."""

import time
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console


@dataclass(frozen=True)
class Demo:
    """Film the scripted reacher, slowed by the separation that it estimates from pixels."""

    out: Path = Path("out/demo.mp4")
    """The film; a still PNG is written beside it."""
    seed: int = 7
    """Seed of the episode."""
    seconds: float = 10.0
    """Length of the film."""
    perception: str = "pixels"
    """pixels, keypoints, truth or none."""

    def run(self) -> int:
        """Film and tell."""
        console, started_s = Console(), time.monotonic()
        console.print("Loading the simulator ...")
        from hrc_env.agents_door import agents
        from hrc_env.cli.film import film_episode, table
        from hrc_env.config import HRCConfig

        base = agents("base")
        n_steps = round(self.seconds / HRCConfig().ctrl_dt)
        totals = film_episode(
            lambda here: base.make_agent("scripted_slowed", here),
            self.out, self.seed, n_steps, perception=self.perception,
        )  # fmt: skip
        totals["all in all [s]"] = time.monotonic() - started_s
        console.print(table(totals, "the worker is known through four cameras only"))
        console.print(f"Watch [bold]{self.out}[/] (still: {self.out.with_suffix('.png')})")
        return 0
