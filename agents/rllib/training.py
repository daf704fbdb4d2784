"""A training run by RLlib: as by Stable-Baselines3, with workers on the machines of a cluster."""

from collections.abc import Iterator
from contextlib import closing
from functools import partial

from rich.console import Console
from stable_baselines3.common.utils import configure_logger

from hrc_env.core.errors import HRCError
from hrc_env.engines import cluster  # first: it says how Ray is installed where it is missing
from hrc_env.engines.registrations import pack

from ..callbacks import Interrupt, Ramp, TrainingLog
from ..learner_settings import PPOSettings
from ..recipes import Run
from .learner import RLlibPPO, RunnerSettings, Sampled
from .runner_env import try_environment
from .watch import Watch

WITHOUT_STEPS = 5
"""Updates that may come without a step, of workers that die, before it is given up."""


def learn(
    run: Run,
    settings: PPOSettings,
    whole: float,
    log: TrainingLog,
    interrupt: Interrupt,
    console: Console,
) -> None:
    """Learn on from the policy of a run, up to its steps or an interrupt.

    Args:
        run: task, budget and workers.
        settings: of PPO; of every worker's environments a rollout has `n_steps`.
        whole: weight of the proximity term when the ramp is over.
        log: of a PPO of Stable-Baselines3, which has the network, Adam's moments and the scale of
            rewards, and is saved.
        interrupt: asked before every update.
        console: shows notes on the cluster.

    Raises:
        ConfigError: no such cluster, or a machine that cannot work.
        HRCError: workers die again and again.
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
    """Update the policy until all steps are done; yield the share of the proximity term that was
    in force, and what was learnt from."""
    learner, ramp, without, n_restarts = log.learner, Ramp(run.ramp), 0, 0
    while learner.num_timesteps < run.timesteps and not interrupt.asked:
        share = ramp.at(learner.num_timesteps)
        sampled = rllib.update(share * whole)
        without = 0 if sampled.n_steps else without + 1
        if without == WITHOUT_STEPS:
            rllib.pull()
            log.save()
            raise HRCError(
                f"No worker has stepped in {without} updates: they die again and again. The last "
                f"error: {rllib.last_error()}. What was learnt is in {log.folder}/."
            )
        if sampled.n_restarts > n_restarts:
            n_restarts = sampled.n_restarts
            log.meter.say(f"A worker died and was started anew ({n_restarts} so far).")
        learner.num_timesteps += sampled.n_steps
        log.recent.extend(sampled.episodes)
        for name, value in sampled.facts().items():
            learner.logger.record(f"ray/{name}", value)
        yield share, sampled
        if log.is_due:
            rllib.pull()
            log.save()
    rllib.pull()
