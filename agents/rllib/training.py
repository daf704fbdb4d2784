"""Training by RLlib with workers on a cluster, equivalent to that by Stable-Baselines3."""

from collections.abc import Iterator
from contextlib import closing
from functools import partial

from rich.console import Console
from stable_baselines3.common.utils import configure_logger

from hrc_env.core.errors import HRCError
from hrc_env.engines import cluster  # first: its error explains how to install Ray
from hrc_env.engines.registrations import pack

from ..callbacks import Interrupt, Ramp, TrainingLog
from ..learner_settings import PPOSettings
from ..recipes import Run
from .learner import RLlibPPO, RunnerSettings, Sampled
from .runner_env import try_environment
from .watch import Watch

WITHOUT_STEPS = 5
"""Number of successive updates without environment steps (since all workers failed) after which
training stops.
"""


def learn(
    run: Run,
    settings: PPOSettings,
    whole: float,
    log: TrainingLog,
    interrupt: Interrupt,
    console: Console,
) -> None:
    """Continue the training of a policy until its number of steps or an interrupt.

    Args:
        run: training arguments with task, budget and number of workers.
        settings: settings of PPO; a rollout has `n_steps` steps of each environment of each worker.
        whole: weight of the proximity term after the ramp.
        log: log of a PPO learner of Stable-Baselines3. This learner holds the network, Adam's
            moments and the reward-normalization statistics, and is saved in checkpoints.
        interrupt: handler of Ctrl-C, which is checked before each update.
        console: console for messages about the cluster.

    Raises:
        ConfigError: the cluster does not exist, or a machine cannot run the environment.
        HRCError: workers fail repeatedly.
    """
    learner, folder = log.learner, log.folder / "tensorboard"
    learner.set_logger(configure_logger(0, str(folder), run.algorithm, run.resume is None))
    keywords = run.keywords()
    note = partial(console.print, markup=False, highlight=False, soft_wrap=True)
    with cluster.connected(run.address, note, dashboard=True) as machines:
        cluster.check_machines(machines, partial(try_environment, keywords), note)
        n = run.workers or max(int(sum(each.n_cores for each in machines)), 1)
        log.facts["workers"] = n
        runners = RunnerSettings(
            keywords, n, run.num_envs, run.seed, cluster.share_of(n, machines, note), pack()
        )
        watch = Watch(str(run.task))
        with closing(RLlibPPO(learner, settings, runners)) as rllib:
            log.begin()
            interrupt.listen()
            for share, sampled in _updates(rllib, run, log, interrupt, whole):
                watch.show(sampled)
                log.note({"safety_share": share, "proximity": share * whole})
                learner.logger.dump(learner.num_timesteps)
    log.save()


def _updates(
    rllib: RLlibPPO, run: Run, log: TrainingLog, interrupt: Interrupt, whole: float
) -> Iterator[tuple[float, Sampled]]:
    """Update the policy until all steps are done.

    Yields the factor on the proximity term's weight and the data of each update.
    """
    learner, ramp, without, n_restarts = log.learner, Ramp(run.ramp), 0, 0
    while learner.num_timesteps < run.timesteps and not interrupt.asked:
        share = ramp.at(learner.num_timesteps)
        sampled = rllib.update(share * whole)
        without = 0 if sampled.n_steps else without + 1
        if without == WITHOUT_STEPS:
            rllib.pull()
            log.save()
            raise HRCError(
                f"No worker completed a step in {without} updates: they die repeatedly. The last "
                f"error: {rllib.last_error()}. The current policy is saved in {log.folder}/."
            )
        if sampled.n_restarts > n_restarts:
            n_restarts = sampled.n_restarts
            log.meter.say(f"A worker died and was restarted ({n_restarts} so far).")
        learner.num_timesteps += sampled.n_steps
        log.recent.extend(sampled.episodes)
        for name, value in sampled.facts().items():
            learner.logger.record(f"ray/{name}", value)
        yield share, sampled
        if log.is_due:
            rllib.pull()
            log.save()
    rllib.pull()
