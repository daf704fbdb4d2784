"""python -m hrc_env benchmark: what a policy is worth, and how safe it is."""

from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path

from hrc_env.cli.checks import at_least, writable_file
from hrc_env.cli.engines import EngineArguments
from hrc_env.cli.show import show
from hrc_env.core.errors import check_names
from hrc_env.tasks import BUILT_IN


@dataclass(frozen=True, kw_only=True)
class Benchmark(EngineArguments):
    """Judge a policy on fixed seeds: beside unaware, hurried and attentive people, with four
    cameras, late ones, one, and the truth, without and with a shield.

    Goals a minute, contacts by kind, and cost. What is finished stays in the folder: a run that was
    stopped goes on there.
    """

    policy: str
    """Agent: random, scripted, scripted_slowed, hrc://ID/NAME; the path of a checkpoint of `train`
    or of Stable-Baselines3 (.zip) or of a policy of `export` (.safetensors); or
    MODULE:FUNCTION, a function that is given an EnvInfo and returns an object with
    act(observation)."""
    trust: bool = False
    """Read pickles in a checkpoint, which run code of whoever made it; see play."""
    ids: tuple[str, ...] = tuple(BUILT_IN)
    """Which environments, your own (--import) among them; a learnt policy is for one."""
    control: str | None = None
    """What its actions are: joint, if not given, tool or twist; checkpoints know it."""
    out: Path | None = None
    """Folder for report.html and results.json; out/benchmark/POLICY if not given."""
    seeds: int = 64
    """Episodes of every row."""
    enter: Path | None = None
    """Write the numbers as an entry of the leaderboard, a JSON file of this name: in a clone
    docs/results/leaderboard/NAME.json."""
    overwrite: bool = False
    """Delete the results of something else, or with other settings, in the folder."""

    def run(self) -> int:
        """Judge it."""
        at_least("--seeds", self.seeds, 1)
        if self.enter is not None:
            writable_file(self.enter, ".json", "--enter")
            check_names("environment of the leaderboard", self.ids, BUILT_IN)
        engine = self.chosen()
        leaderboard = import_module("hrc_env.experiments.leaderboard")
        runner = import_module("hrc_env.experiments.runner")
        study = leaderboard.make_study(self.policy, self.ids, self.control, self.seeds, self.trust)
        words = self.policy.removeprefix("hrc://").replace("/", "-").replace(":", "-")
        out = self.out or Path("out/benchmark") / words
        run = partial(runner.run_experiment, study, overwrite=self.overwrite, engine=engine)
        status = show(run, out, "benchmark")
        if self.enter is not None:
            leaderboard.enter(self.enter, self.policy, out / "results.json")
            print(f"Entered: {self.enter}")
        return status
