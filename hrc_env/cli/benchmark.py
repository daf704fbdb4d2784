"""Score a policy with the benchmark, or judge an entry of the leaderboard on fresh seeds."""

from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from hrc_env.cli.checks import check_at_least, check_writable_file
from hrc_env.cli.engines import EngineArguments
from hrc_env.cli.show import show
from hrc_env.core.errors import check_names
from hrc_env.tasks import BUILT_IN

if TYPE_CHECKING:  # --help imports no simulator
    from hrc_env.engines.engine import Engine
    from hrc_env.experiments.leaderboard import Plan

SHOWN = 8
"""Number of characters of a salt in the name of a folder."""


@dataclass(frozen=True, kw_only=True)
class Benchmark(EngineArguments):
    """Evaluate a policy on fixed seeds in the setups of the benchmark.

    The setups differ in the workers (unaware, hurried or attentive), the perception (four cameras,
    delayed frames, one camera or the true poses) and the shield (without or with one). The report
    contains goals per minute, contacts by kind, and cost. The results of completed parts are cached
    in the folder, from which a stopped run resumes. The policy acts in a process of its own, which
    receives only observations and, on Linux, reads no other files than its own.
    """

    policy: str
    """Agent: a name (random, scripted, scripted_slowed, hrc://ID/NAME); a file (a checkpoint of
    `train` or Stable-Baselines3, .zip, or a policy of `export`, .safetensors); or MODULE:FUNCTION,
    a function that takes an EnvInfo and returns an object with act(observation)."""
    trust: bool = False
    """Allow pickles in a checkpoint, which can run arbitrary code, to be loaded (see the command
    play)."""
    ids: tuple[str, ...] = tuple(BUILT_IN)
    """Ids of the environments, including those registered by --import. A learnt policy fits only
    one environment."""
    control: str | None = None
    """Control mode of the policy's actions: joint (default), tool or twist. A checkpoint contains
    the control mode of its policy."""
    out: Path | None = None
    """Folder for report.html and results.json (default: out/benchmark/POLICY)."""
    seeds: int = 64
    """Number of episodes in each setup."""
    enter: Path | None = None
    """JSON file to which an entry for the leaderboard is also written; in a clone of the
    repository, docs/results/leaderboard/NAME.json."""
    overwrite: bool = False
    """Delete results in the folder that belong to another run or to other settings."""

    def run(self) -> int:
        """Run the benchmark and print its report; return the exit status."""
        check_at_least("--seeds", self.seeds, 1)
        if self.enter is not None:
            check_writable_file(self.enter, ".json", "--enter")
            check_names("environment of the leaderboard", self.ids, BUILT_IN)
        engine = self.choose_engine()
        leaderboard = import_module("hrc_env.experiments.leaderboard")
        plan = leaderboard.make_plan(self.policy, self.ids, self.control, self.seeds, self.trust)
        words = self.policy.removeprefix("hrc://").replace("/", "-").replace(":", "-")
        out = self.out or Path("out/benchmark") / words
        return play_plan(plan, out, engine, self.overwrite, self.enter)


@dataclass(frozen=True, kw_only=True)
class Judge(EngineArguments):
    """Judge an entry of the leaderboard on fresh seeds.

    The seeds follow from the SHA-256 digest in the entry and from a salt that is drawn now; they
    were unknown when the policy was submitted. The policy's files must have this digest, and lie
    at their path in the entry or beside it. A stopped run resumes with the printed salt.
    """

    entry: Annotated[Path, tyro.conf.Positional]
    """JSON file that `benchmark --enter` wrote."""
    salt: str | None = None
    """Salt of the seeds (default: drawn at random). The judged entry contains it."""
    seeds: int = 1000
    """Number of episodes in each setup."""
    out: Path | None = None
    """Folder for report.html and results.json (default: out/judge/ENTRY-SALT)."""
    enter: Path | None = None
    """JSON file for the judged entry (default: that of the entry, which is replaced)."""
    overwrite: bool = False
    """Delete results in the folder that belong to another run or to other settings."""

    def run(self) -> int:
        """Judge the entry and print its report; return the exit status."""
        check_at_least("--seeds", self.seeds, 1)
        enter = self.enter or self.entry
        check_writable_file(enter, ".json", "--enter")
        engine = self.choose_engine()
        entries = import_module("hrc_env.experiments.entries")
        plan = entries.plan_judging(self.entry, self.seeds, self.salt)
        print(f"Salt: {plan.salt}. A stopped run resumes with --salt {plan.salt}")
        out = self.out or Path("out/judge") / f"{self.entry.stem}-{plan.salt[:SHOWN]}"
        return play_plan(plan, out, engine, self.overwrite, enter)


def play_plan(
    plan: "Plan", out: Path, engine: "Engine | None", overwrite: bool, enter: Path | None
) -> int:
    """Play a run of the benchmark, print its report and return the exit status.

    Args:
        plan: the run.
        out: folder of the results.
        engine: engine that plays the parts; None: the fastest on this machine.
        overwrite: whether to delete results of other runs in the folder.
        enter: file to which an entry of the leaderboard is written; None for no entry.
    """
    entries = import_module("hrc_env.experiments.entries")
    runner = import_module("hrc_env.experiments.runner")
    run = partial(runner.run_experiment, plan.make_study(), overwrite=overwrite, engine=engine)
    status = show(run, out, "benchmark")
    if enter is not None:
        scores = entries.read_scores(out / "results.json")
        entries.write_entry(enter, entries.make_entry(plan, scores))
        print(f"Entered: {enter}")
    return status
