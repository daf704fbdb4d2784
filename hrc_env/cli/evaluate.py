"""Evaluate an agent over many episodes, on one machine or on a cluster."""

import json
from dataclasses import asdict, dataclass, fields
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console

import hrc_env
from hrc_env.cli.checks import check_at_least, check_writable_file
from hrc_env.cli.engines import EngineArguments
from hrc_env.core.errors import ConfigError, check_names
from hrc_env.core.progress import Meter
from hrc_env.env_words import EnvironmentArguments
from hrc_env.tasks import DEFAULT


@dataclass(frozen=True, kw_only=True)
class Evaluate(EnvironmentArguments, EngineArguments):
    """Evaluate an agent over whole episodes with fixed seeds: goals, contacts and cost.

    Episodes are played on one machine or on a cluster. The seed of the first episode is --seed, and
    it increases by one with each further episode. The k-th episode is the same for every agent and
    engine. With --verify, an entry of the leaderboard is replayed instead.
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
    separate: bool = False
    """Let the agent act in a process of its own, which receives only observations and, on Linux,
    reads no other files than its own. The score is the same."""
    out: Path | None = None
    """JSON file to which the score, agent, seed and environment are also written."""
    verify: Path | None = None
    """Entry of the leaderboard (JSON) to replay: every number must be equal. The entry contains all
    settings; other options than those of the engine are not accepted."""

    def run(self) -> int:
        """Play the episodes and print the score; return the exit status."""
        if self.verify is not None:
            return self._verify(self.verify)
        check_names("environment", [self.task], hrc_env.IDS)
        check_at_least("--episodes", self.episodes, 1)
        check_at_least("--seed", self.seed, 0)
        if self.out is not None:
            check_writable_file(self.out, ".json")
        engine, console = self.choose_engine(), Console()
        from hrc_env.agents.registry import (
            check_agent,
            find_interface,
            make_agent,
        )  # no simulator for --help
        from hrc_env.core.results import provenance, write_whole
        from hrc_env.engines.files import carried
        from hrc_env.evaluation.episodes import describe_contradiction, evaluate
        from hrc_env.pipeline.ready import make_ready

        if self.separate:
            from hrc_env.agents.separate import SeparateProcess
            from hrc_env.agents.submission import read_submission

            submission = read_submission(self.agent)
            make = SeparateProcess(submission, self.trust)
            interface = submission.interface
        else:
            check_agent(self.agent)
            make = partial(make_agent, carried(self.agent), trust=self.trust)
            interface = find_interface(self.agent)
        make_ready(console, self.perception)
        keywords = interface.complete(self.keywords())
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

    def _verify(self, path: Path) -> int:
        """Replay an entry of the leaderboard; return the exit status.

        Raises:
            ConfigError: an option contradicts the entry, or the entry cannot be replayed.
            HRCError: a number of the replay differs.
        """
        usual = type(self)(verify=path, engine=self.engine, workers=self.workers,
                           address=self.address)  # fmt: skip
        differing = [each.name for each in fields(self)
                     if getattr(self, each.name) != getattr(usual, each.name)]  # fmt: skip
        if differing:
            raise ConfigError(
                f"--verify takes all settings from the entry: leave out {', '.join(differing)}."
            )
        engine = self.choose_engine()
        from hrc_env.cli.benchmark import SHOWN, play_plan
        from hrc_env.experiments import entries

        plan = entries.plan_replay(path)
        out = Path("out/verify") / f"{path.stem}-{plan.submission.sha256[:SHOWN]}"
        play_plan(plan, out, engine, overwrite=True, enter=None)
        n = entries.check_replay(path, entries.read_scores(out / "results.json"))
        print(f"Verified: {n} numbers of {path} are equal.")
        return 0
