"""Speed of training with workers of RLlib: python -m benchmarks.cluster [--quick] [--out DIR].

One worker, two workers, and Stable-Baselines3 without workers are measured in turn on this machine.
The benchmark measures the duration of a rollout, with 64 steps of the 64 environments of each
worker, and of PPO's learning from it. The times of one worker are the parameters of a model: all
workers step in parallel, and one core learns from their data. An update with n workers takes the
time of one rollout plus n times the time of learning from it. The model is compared with the
measurement of two workers and extrapolated to more.
"""

import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple
from urllib.request import urlopen

import cloudpickle
import numpy as np

from benchmarks.command import Arguments
from hrc_env.core.errors import ConfigError
from hrc_env.core.machine import n_cores
from hrc_env.core.results import Metric, over
from hrc_env.experiments.cache import PartCache, PartProgress
from hrc_env.experiments.columns import Column
from hrc_env.experiments.plots import label_axes, make_figure, save
from hrc_env.experiments.report import Metrics, Report, Table, format_picture
from hrc_env.experiments.runner import run_experiment

KEYWORDS: Mapping[str, Any] = {"task": "HRCReach-v0", "perception": "keypoints"}
NUM_ENVS = 64
MEASURED = (1, 2)
MODELLED = (10, 100, 1000)
"""Numbers of workers to which the model is extrapolated."""
GBIT_BYTES_S = 125e6
"""Capacity of a network of 1 Gbit/s [bytes/s]."""
PREFIX = "ray_hrc_env_"
SHOWN = {
    f"{PREFIX}steps_per_s": "steps/s",
    f"{PREFIX}episodes_total": "episodes",
    f"{PREFIX}goals_total": "goals",
    f"{PREFIX}contacts_total": "contacts",
}
"""Axis labels in the figure of Ray's metrics, by the name of the metric."""
Played = Mapping[str, list[float]]

TABLE = Table(
    name="cluster",
    title="Training speed by number of rollout workers, one core each",
    rows={
        "sb3": ("none", "Stable-Baselines3, measured"),
        "1": ("1", "measured"),
        "2": ("2", "measured"),
        "2_predicted": ("2", "predicted from one"),
        **{str(n): (f"{n:,}", "model") for n in MODELLED},
    },
    heads=("workers", "source"),
    columns=(
        Column("sampling_s.{}", "sampling [s]", digits=2),
        Column("learning_s.{}", "learning [s]", digits=2),
        Column("steps_per_s.{}", "steps/s", digits=0),
        Column("speedup.{}", "speedup over one worker", digits=2),
    ),
    note="Every worker collects 64 steps of 64 environments per update; {n[update_s.1]} updates, "
    "in turns. Stable-Baselines3 steps its environments on all cores. The model assumes parallel "
    "sampling and serial learning. One step of 64 environments on one thread takes {step_ms} "
    "ms. One environment step is {bytes} bytes, so that a network of 1 Gbit/s carries the steps of "
    "{carried} workers.",
    numbers={
        "step_ms": Column("step_s", digits=1, scale=1e3, plain=True),
        "bytes": Column("bytes_per_step", digits=0, plain=True),
        "carried": Column("workers_per_gbit", digits=0, plain=True),
        "most": Column("steps_per_s.most", digits=0, plain=True),
        "half": Column("workers_of_half", digits=0, plain=True),
        "two": Column("speedup.2", digits=2),
        "predicted": Column("speedup.2_predicted", digits=2),
    },
)


@dataclass(frozen=True, slots=True)
class ClusterBench:
    """Benchmark of the training speed with RLlib's workers."""

    name = "cluster"
    depends = ("env", "tracker", "emulator", "motion", "agents")
    n_rounds: int = 12
    """Number of rounds, in each of which every contender is measured once."""
    n_watched: int = 60
    """Number of updates with two workers; the metrics of Ray are read after each one."""

    @property
    def seeds(self) -> Sequence[int]:
        """Seeds of the workers."""
        return (0,)

    @property
    def n_parts(self) -> int:
        """Number of parts of the benchmark: the times, and the metrics of Ray."""
        return 2

    @property
    def quick_note(self) -> str:
        """Warning for the table of a short run, or "" if the run is long enough."""
        is_short = self.n_rounds < ClusterBench().n_rounds
        return f"Quick run, {self.n_rounds} rounds: too few for a comparison." if is_short else ""

    def settings(self) -> dict[str, Any]:
        """Return the settings on which the metrics depend."""
        return {**asdict(self), "environment": dict(KEYWORDS), "num_envs": NUM_ENVS}

    def play(self, cache: PartCache) -> Played:
        """Measure the times of all rounds, and the metrics that Ray exports during a run."""
        times = cache.make_part("times", self._times)
        return times | cache.make_part("watched", self._watched)

    def _times(self, tick: PartProgress) -> dict[str, Any]:
        with _workers() as learners, _alone() as alone:
            found: dict[str, list[float]] = {}
            for k in range(-1, self.n_rounds):  # the first update is a warm-up
                for n, learner in learners.items():
                    turn = _measure_turn(learner)
                    if k >= 0:
                        found.setdefault(f"sample_s.{n}", []).append(turn.sampled_s)
                        found.setdefault(f"update_s.{n}", []).append(turn.updated_s)
                        found.setdefault(f"steps.{n}", []).append(turn.n_steps)
                        share = turn.n_bytes / turn.n_steps
                        found.setdefault("bytes_per_step", []).append(share)
                if k >= 0:
                    found.setdefault("sb3_steps_per_s", []).append(alone())
                found.setdefault("step_s", []).append(_step_s())
                tick(1 / (self.n_rounds + 1))
        return found

    def _watched(self, tick: PartProgress) -> dict[str, Any]:
        from hrc_env.agents.rllib.watch import Watch

        with _workers((2,)) as learners:
            watch, found, began_s = Watch(str(KEYWORDS["task"])), {}, time.monotonic()
            for k in range(self.n_watched):
                watch.show(learners[2].update(2.0 * k / self.n_watched))
                shown = _exported()
                for name in SHOWN:
                    found.setdefault(name, []).append(shown.get(name, 0.0))
                found.setdefault("watched_s", []).append(time.monotonic() - began_s)
                tick(1 / self.n_watched)
        return found

    def metrics(self, played: Played) -> dict[str, Metric]:
        """Return all metrics of the results, by name."""
        return metrics_of(played)

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the table that this benchmark fills in the documentation."""
        return (TABLE,)

    def report(self, played: Played, metrics: Metrics, figures: Path) -> Report:
        """Plot the metrics of Ray, and return the report with the table."""
        drawn = _draw(played, figures / "metrics.png")
        about = (__doc__ or "").partition("\n")[2].strip()
        parts = [
            TABLE.to_markdown(metrics),
            format_picture(drawn, "A run with two workers, exported by Ray"),
        ]
        return Report("Workers of RLlib", about, parts, "smallest and largest rounds")


@contextmanager
def _workers(numbers: Sequence[int] = MEASURED) -> Iterator[dict[int, Any]]:
    """Yield a learner for each number of workers; idle learners wait."""
    from hrc_env.agents import ppo  # here and below: importing learner and Ray takes seconds
    from hrc_env.agents.learner_settings import PPOSettings
    from hrc_env.agents.rllib.learner import RLlibPPO, RunnerSettings
    from hrc_env.engines import cluster
    from hrc_env.engines.registrations import pack
    from hrc_env.sb3 import HRCVecEnv

    if n_cores() < max(MEASURED):
        raise ConfigError(f"Two workers need two cores, but this machine has {n_cores()}.")
    with cluster.connected(None):
        made: dict[int, Any] = {}
        try:
            for n in numbers:
                policy = ppo.make_learner(HRCVecEnv(1, **KEYWORDS), PPOSettings(), 0)
                share = 1 / len(numbers)  # all learners exist at once, and one of them is active
                runners = RunnerSettings(KEYWORDS, n, NUM_ENVS, 0, share, pack())
                made[n] = RLlibPPO(policy, PPOSettings(), runners)
            yield made
        finally:
            for each in made.values():
                each.close()


@contextmanager
def _alone() -> Iterator[Callable[[], float]]:
    """Yield a function that trains Stable-Baselines3 for one rollout and returns steps per second.

    The number of environments is that of one worker; all cores step them.
    """
    import torch

    from hrc_env.agents import ppo
    from hrc_env.agents.learner_settings import PPOSettings
    from hrc_env.sb3 import HRCVecEnv

    torch.set_num_threads(1)  # as in `train`
    with closing(HRCVecEnv(NUM_ENVS, stagger=True, **KEYWORDS)) as env:
        learner, n_steps = ppo.make_learner(env, PPOSettings(), 0), NUM_ENVS * PPOSettings().n_steps
        learner.learn(n_steps)

        def turn() -> float:
            started_s = time.monotonic()
            learner.learn(n_steps, reset_num_timesteps=False)
            return n_steps / (time.monotonic() - started_s)

        yield turn


class _Turn(NamedTuple):
    """Duration and size of a rollout of all workers."""

    sampled_s: float
    """Duration of a rollout without learning [s]."""
    updated_s: float
    """Duration of another rollout, including learning from it [s]."""
    n_steps: int
    """Number of steps of the rollout."""
    n_bytes: int
    """Size of the serialized rollout [bytes]."""


def _measure_turn(learner: Any) -> _Turn:
    """Measure the duration of a rollout without learning, and of another one with learning."""
    group = learner.algorithm.env_runner_group
    started_s = time.monotonic()
    samples = group.foreach_env_runner(lambda runner: runner.sample(), local_env_runner=False)
    sampled_s = time.monotonic() - started_s
    n_bytes = len(cloudpickle.dumps(samples))
    n_steps = sum(len(episode) for episodes in samples for episode in episodes)
    started_s = time.monotonic()
    learner.update(1.0)
    return _Turn(sampled_s, time.monotonic() - started_s, n_steps, n_bytes)


def _exported() -> dict[str, float]:
    """Return the current values of the metrics of this package that Ray exports, by name."""
    import ray

    (node,) = ray.nodes()
    url = f"http://{node['NodeManagerAddress']}:{node['MetricsExportPort']}/metrics"
    with urlopen(url, timeout=20) as page:
        lines = page.read().decode().splitlines()
    ours = [line for line in lines if line.startswith(PREFIX)]
    return {line.partition("{")[0]: float(line.rpartition(" ")[2]) for line in ours}


def _draw(played: Played, path: Path) -> Path:
    """Plot the metrics of Ray over the time of the run, and return the path of the figure."""
    figure = make_figure(9, 6)
    panels = figure.subplots(2, 2, sharex=True).ravel()
    for axis, (name, words) in zip(panels, SHOWN.items(), strict=True):
        axis.plot(played["watched_s"], played[name], drawstyle="steps-post")
        label_axes(axis, "time [s]", words)
        axis.set_ylim(bottom=0)
    save(figure, path)
    return path


def _step_s(n_steps: int = 50) -> float:
    """Measure the time of a step of all environments in one thread, without a learner [s]."""
    from hrc_env.agents.rllib.runner_env import make_envs

    with closing(make_envs(NUM_ENVS, KEYWORDS)) as env:
        env.reset(seed=0)
        action = np.zeros(env.action_space.shape, np.float32)  # type: ignore[arg-type]
        started_s = time.monotonic()
        for _ in range(n_steps):
            env.step(action)
        return (time.monotonic() - started_s) / n_steps


def metrics_of(played: Played) -> dict[str, Metric]:
    """Compute all metrics from the measured times and the model."""
    found = {name: over(played[name], "s") for name in ("step_s", "update_s.1", "update_s.2")}
    found["bytes_per_step"] = over(played["bytes_per_step"], "byte")
    times = {name: np.array(values) for name, values in played.items()}
    rate = {n: times[f"steps.{n}"] / times[f"update_s.{n}"] for n in MEASURED}
    for n in MEASURED:
        learning_s = times[f"update_s.{n}"] - times[f"sample_s.{n}"]
        found[f"sampling_s.{n}"] = over(times[f"sample_s.{n}"].tolist(), "s")
        found[f"learning_s.{n}"] = over(learning_s.tolist(), "s")
        found[f"steps_per_s.{n}"] = over(rate[n].tolist(), "1/s")
        found[f"speedup.{n}"] = over((rate[n] / rate[1]).tolist(), "ratio")
    found["steps_per_s.sb3"] = over(played["sb3_steps_per_s"], "1/s")
    found["speedup.sb3"] = over((times["sb3_steps_per_s"] / rate[1]).tolist(), "ratio")
    n_steps = float(np.median(times["steps.1"]))
    sampling_s, learning_s = found["sampling_s.1"].value, found["learning_s.1"].value
    own = n_steps / (sampling_s + learning_s)
    for name, n in {"2_predicted": 2, **{str(n): n for n in MODELLED}}.items():
        modelled = n * n_steps / (sampling_s + n * learning_s)
        found[f"sampling_s.{name}"] = _exact(sampling_s, "s")
        found[f"learning_s.{name}"] = _exact(n * learning_s, "s")
        found[f"steps_per_s.{name}"] = _exact(modelled, "1/s")
        found[f"speedup.{name}"] = _exact(modelled / own, "ratio")
    found["steps_per_s.most"] = _exact(n_steps / learning_s, "1/s")
    found["workers_of_half"] = _exact(sampling_s / learning_s, "1")
    sent = found["bytes_per_step"].value * own
    found["workers_per_gbit"] = _exact(GBIT_BYTES_S / sent, "1")
    return found


def _exact(value: float, unit: str) -> Metric:
    """Return a metric without a confidence interval, for a value of the model."""
    return Metric(value, value, value, unit, 1)


def make_study(quick: bool = False) -> ClusterBench:
    """Return the benchmark, with fewer rounds if `quick`."""
    return ClusterBench(2, 6) if quick else ClusterBench()


def main() -> int:
    """Run the benchmark with the arguments of the process; return the exit status."""
    import tyro

    from hrc_env.cli.entry import show_errors
    from hrc_env.cli.options import normalize_words
    from hrc_env.cli.show import show

    def run_asked() -> int:
        words = normalize_words(Arguments, sys.argv[1:], "python -m benchmarks.cluster")
        asked = tyro.cli(
            Arguments, args=words, default=Arguments(Path("out/cluster")), description=__doc__
        )
        return show(partial(run_experiment, make_study(asked.quick)), asked.out, "cluster")

    return show_errors(run_asked)


if __name__ == "__main__":
    sys.exit(main())
