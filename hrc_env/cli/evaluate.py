"""Score agents over many episodes, on one machine or many: python -m hrc_env evaluate."""

import json
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console

import hrc_env
from hrc_env.cli.checks import at_least, writable_file
from hrc_env.cli.engines import EngineArguments
from hrc_env.core.errors import check_names
from hrc_env.core.progress import Meter
from hrc_env.env_words import EnvironmentArguments
from hrc_env.tasks import DEFAULT


@dataclass(frozen=True, kw_only=True)
class Evaluate(EnvironmentArguments, EngineArguments):
    """Score an agent over whole episodes with fixed seeds: goals, contacts, cost, on one machine or
    on a cluster.

    Seeds count up from --seed; the k-th episode is the same for every agent and engine.
    """

    task: Annotated[str, tyro.conf.Positional] = DEFAULT
    """Which environment, by its id."""
    agent: str = "scripted"
    """Agent: random, scripted, scripted_slowed, hrc://ID/NAME; the path of a checkpoint of `train`
    or of Stable-Baselines3 (.zip) or of a policy of `export` (.safetensors); or
    MODULE:FUNCTION, a function that is given an EnvInfo and returns an object with
    act(observation)."""
    trust: bool = False
    """Read pickles in a checkpoint, which run code of whoever made it; see play."""
    episodes: int = 64
    """How many episodes."""
    seed: int = 1_000_000
    """Seed of the first episode."""
    perception: str = "keypoints"
    """What the robot sees with: keypoints (camera emulator), pixels, truth or none."""
    out: Path | None = None
    """Write the score and what it was made with, too: a JSON file."""

    def run(self) -> int:
        """Play and tell."""
        check_names("environment", [self.task], hrc_env.IDS)
        at_least("--episodes", self.episodes, 1)
        at_least("--seed", self.seed, 0)
        if self.out is not None:
            writable_file(self.out, ".json")
        engine, console = self.chosen(), Console()
        from hrc_env.agents.registry import (
            check_agent,
            control_of,
            make_agent,
        )  # no simulator for --help
        from hrc_env.core.results import provenance, write_whole
        from hrc_env.engines.files import carried
        from hrc_env.evaluation.episodes import contradiction, evaluate
        from hrc_env.pipeline.ready import make_ready

        check_agent(self.agent)
        make = partial(make_agent, carried(self.agent), trust=self.trust)
        make_ready(console, self.perception)
        keywords = replace(self, control=self.control or control_of(self.agent)).keywords()
        with Meter(console, "episodes", self.episodes, "episodes") as meter:

            def tick(share: float) -> None:
                meter.show(meter.done + share * self.episodes)

            score = evaluate(make, self.episodes, self.seed, engine=engine, tick=tick, **keywords)
        found: dict[str, Any] = asdict(score)
        for name, value in found.items():
            console.print(f"{name:28s} {value:.3f}", highlight=False)
        if said := contradiction(score):
            console.print(said, highlight=False, soft_wrap=True)
        if self.out is not None:
            asked = {"agent": self.agent, "seed": self.seed, "environment": keywords}
            content = {"score": found, **asked, **provenance()}
            write_whole(self.out, json.dumps(content, indent=1))
            console.print(f"In {self.out}", highlight=False, soft_wrap=True)
        return 0
