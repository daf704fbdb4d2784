"""Score a policy with the benchmark: goals, contacts and cost on fixed seeds."""

from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path

from hrc_env.cli.checks import check_at_least, check_writable_file
from hrc_env.cli.engines import EngineArguments
from hrc_env.cli.show import show
from hrc_env.core.errors import check_names
from hrc_env.tasks import BUILT_IN


@dataclass(frozen=True, kw_only=True)
class Benchmark(EngineArguments):
    """Evaluate a policy on fixed seeds in the setups of the benchmark.

    The setups differ in the workers (unaware, hurried or attentive), the perception (four cameras,
    delayed frames, one camera or the true poses) and the shield (without or with one). The report
    contains goals per minute, contacts by kind, and cost. The results of completed parts are cached
    in the folder, from which a stopped run resumes.
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
        runner = import_module("hrc_env.experiments.runner")
        study = leaderboard.make_study(self.policy, self.ids, self.control, self.seeds, self.trust)
        words = self.policy.removeprefix("hrc://").replace("/", "-").replace(":", "-")
        out = self.out or Path("out/benchmark") / words
        run = partial(runner.run_experiment, study, overwrite=self.overwrite, engine=engine)
        status = show(run, out, "benchmark")
        if self.enter is not None:
            leaderboard.add_entry(self.enter, self.policy, out / "results.json")
            print(f"Entered: {self.enter}")
        return status
