"""Evaluate an agent over many episodes, on one machine or on a cluster."""

import json
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console

import hrc_env
from hrc_env.cli.checks import check_at_least, check_writable_file
from hrc_env.cli.engines import EngineArguments
from hrc_env.core.errors import check_names
from hrc_env.core.progress import Meter
from hrc_env.env_words import EnvironmentArguments
from hrc_env.tasks import DEFAULT


@dataclass(frozen=True, kw_only=True)
class Evaluate(EnvironmentArguments, EngineArguments):
    """Evaluate an agent over whole episodes with fixed seeds: goals, contacts and cost.

    Episodes are played on one machine or on a cluster. The seed of the first episode is --seed, and
    it increases by one with each further episode. The k-th episode is the same for every agent and
    engine.
    """

    task: Annotated[str, tyro.conf.Positional] = DEFAULT
    """Id of the environment."""
    agent: str = "scripted"
    """Agent: a name (random, scripted, scripted_slowed, hrc://ID/NAME); a file (a checkpoint of
    `train` or Stable-Baselines3, .zip, or a policy of `export`, .safetensors); or MODULE:FUNCTION,
    a function that takes an EnvInfo and returns an object with act(observation)."""
    trust: bool = False
    """Allow pickles in a checkpoint, which can run arbitrary code, to be loaded (see the command
    play)."""
    episodes: int = 64
    """Number of episodes."""
    seed: int = 1_000_000
    """Seed of the first episode."""
    perception: str = "keypoints"
    """Perception level: keypoints (camera emulator), pixels, truth or none."""
    out: Path | None = None
    """JSON file to which the score, agent, seed and environment are also written."""

    def run(self) -> int:
        """Play the episodes and print the score; return the exit status."""
        check_names("environment", [self.task], hrc_env.IDS)
        check_at_least("--episodes", self.episodes, 1)
        check_at_least("--seed", self.seed, 0)
        if self.out is not None:
            check_writable_file(self.out, ".json")
        engine, console = self.choose_engine(), Console()
        from hrc_env.agents.registry import (
            check_agent,
            find_control,
            make_agent,
        )  # no simulator for --help
        from hrc_env.core.results import provenance, write_whole
        from hrc_env.engines.files import carried
        from hrc_env.evaluation.episodes import describe_contradiction, evaluate
        from hrc_env.pipeline.ready import make_ready

        check_agent(self.agent)
        make = partial(make_agent, carried(self.agent), trust=self.trust)
        make_ready(console, self.perception)
        keywords = replace(self, control=self.control or find_control(self.agent)).keywords()
        with Meter(console, "episodes", self.episodes, "episodes") as meter:

            def tick(share: float) -> None:
                meter.show(meter.done + share * self.episodes)

            score = evaluate(make, self.episodes, self.seed, engine=engine, tick=tick, **keywords)
        scores: dict[str, Any] = asdict(score)
        for name, text in score.describe().items():
            console.print(f"{name:28s} {text}", highlight=False, soft_wrap=True)
        if warning := describe_contradiction(score):
            console.print(warning, highlight=False, soft_wrap=True)
        if self.out is not None:
            setup = {"agent": self.agent, "seed": self.seed, "environment": keywords}
            content = {"score": scores, **setup, **provenance()}
            write_whole(self.out, json.dumps(content, indent=1))
            console.print(f"In {self.out}", highlight=False, soft_wrap=True)
        return 0
