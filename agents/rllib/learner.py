"""RLlib's PPO with the network of Stable-Baselines3."""

import logging
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import ray
import torch
from gymnasium.wrappers.utils import RunningMeanStd
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.callbacks.callbacks import RLlibCallback
from ray.rllib.core import DEFAULT_MODULE_ID
from ray.rllib.core.rl_module.rl_module import RLModuleSpec
from ray.rllib.env.env_runner import EnvRunner
from ray.tune import register_env
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from hrc_env.core.errors import HRCError
from hrc_env.engines import cluster
from hrc_env.engines.registrations import Registrations

from ..learner_settings import PPOSettings
from .policy_module import PolicyModule
from .runner_env import RunnerEnv, make_envs, reported_errors

ENVIRONMENT = "hrc_env"
"""Name under which the environments are registered in RLlib."""
_LOGGER = logging.getLogger("ray.rllib")
"""RLlib's logger of failing workers, the lines of which would interrupt the progress display."""
SEEDS_OF_RUN = 100_000
"""Difference between the seeds of successive runs, which must exceed the number of runners."""


@dataclass(frozen=True, slots=True)
class RunnerSettings:
    """Settings of the runners, which are the processes that step environments."""

    keywords: Mapping[str, Any]
    """Keyword arguments of `gymnasium.make`, with the task under the key "task"."""
    n: int
    """Number of runners."""
    num_envs: int
    """Number of environments in each runner."""
    seed: int
    """Seed of environments and of exploration."""
    share: float
    """Fraction of a core that a runner reserves; below 1 if there are fewer cores than runners."""
    registrations: Registrations
    """Registrations of tasks and components in this process, which are repeated in the runners."""


@dataclass(frozen=True, slots=True)
class Sampled:
    """Statistics of the data that were sampled for an update."""

    n_steps: int
    """Number of environment steps."""
    episodes: list[dict[str, float]]
    """Statistics of the episodes that ended."""
    n_runners: int
    """Number of runners that are alive."""
    n_restarts: int
    """Number of restarts of runners since the start of the run."""
    seconds: float
    """Duration of sampling and learning [s]."""

    def facts(self) -> dict[str, float]:
        """Return rates and counts for TensorBoard and Ray's metrics, by name."""
        return {
            "steps_per_s": self.n_steps / self.seconds,
            "workers": self.n_runners,
            "restarts": self.n_restarts,
        }


class RLlibPPO:
    """RLlib's PPO, with several runners that step environments and a learner on this machine.

    Args:
        policy: learner of Stable-Baselines3 with the policy to train, which does not change until
            `pull`.
        settings: settings of PPO; a rollout has `n_steps` steps of each environment of each runner.
        runners: settings of the processes that step environments.
    """

    def __init__(self, policy: PPO, settings: PPOSettings, runners: RunnerSettings) -> None:
        self.policy, self.runners = policy, runners
        self._log = LastError()
        self._errors: Any = ray.remote(WorkerErrors).options(num_cpus=0).remote()
        self._handlers = _LOGGER.handlers
        _LOGGER.handlers = [self._log]
        n, num_envs = runners.n, runners.num_envs
        register_env(ENVIRONMENT, make_runner_env)
        made = settings.keywords()
        config = (
            PPOConfig()
            .environment(
                ENVIRONMENT,
                env_config={
                    "keywords": dict(runners.keywords),
                    "gamma": settings.gamma,
                    "registrations": runners.registrations,
                    "errors": self._errors,
                },
            )
            .env_runners(
                num_env_runners=n,
                num_envs_per_env_runner=num_envs,
                num_cpus_per_env_runner=runners.share,  # type: ignore[arg-type]  # fractions are allowed
                gym_env_vectorize_mode="vector_entry_point",
                rollout_fragment_length=settings.n_steps,
                create_env_on_local_worker=False,
            )
            .learners(num_learners=0)
            .training(
                train_batch_size_per_learner=n * num_envs * settings.n_steps,
                minibatch_size=min(settings.batch_size, n * num_envs * settings.n_steps),
                num_epochs=settings.n_epochs,
                lr=settings.learning_rate,
                gamma=settings.gamma,
                lambda_=settings.gae_lambda,
                clip_param=settings.clip_range,
                vf_clip_param=float("inf"),
                vf_loss_coeff=policy.vf_coef,
                entropy_coeff=policy.ent_coef,
                use_kl_loss=False,
                grad_clip=policy.max_grad_norm,
                grad_clip_by="global_norm",
            )
            .rl_module(
                rl_module_spec=RLModuleSpec(
                    PolicyModule, model_config={"policy": made["policy_kwargs"]}
                )
            )
            .fault_tolerance(
                restart_failed_env_runners=True, delay_between_env_runner_restarts_s=1.0
            )
            .callbacks(GoOn)
            .debugging(seed=runners.seed * SEEDS_OF_RUN, log_level="ERROR")
            .reporting(min_time_s_per_iteration=None)
        )
        # RLlib learns from actions as they are sent to the environment, before they are clipped.
        config.normalize_actions, config.clip_actions = False, True
        self.algorithm = self._build(config)
        self.push()

    def _build(self, config: PPOConfig) -> Any:
        """Start the runners; raise `HRCError` if none can create its environments."""
        try:
            return config.build_algo()
        except Exception as error:  # raised by RLlib if no runner knows the spaces
            _LOGGER.handlers = self._handlers
            if reason := self._reason():
                raise HRCError(f"No worker could create its environments: {reason}") from error
            raise

    def push(self) -> None:
        """Copy the network, Adam's moments and the reward-normalization statistics to RLlib.

        The learner receives the moments, the runners receive the statistics, and both receive the
        network.
        """
        known = self.policy.policy
        weights, moments = known.state_dict(), known.optimizer.state_dict()

        def take(learner: Any) -> None:
            learner.module[DEFAULT_MODULE_ID].policy.load_state_dict(weights)
            if moments["state"]:
                learner.get_optimizer(DEFAULT_MODULE_ID).load_state_dict(moments)

        self.algorithm.learner_group.foreach_learner(take)
        self.algorithm.env_runner_group.foreach_env_runner(
            lambda runner: runner.module.policy.load_state_dict(weights), local_env_runner=False
        )  # RLlib's own `sync_weights` does nothing before the first update
        ours, scale = self._normalised.ret_rms, RunningMeanStd()
        scale.mean, scale.var, scale.count = ours.mean, ours.var, ours.count
        self._each(lambda envs: envs.take_rewards_state(scale))

    def pull(self) -> None:
        """Copy network, Adam's moments and reward-normalization statistics to the policy."""

        def give(learner: Any) -> Any:
            module = learner.module[DEFAULT_MODULE_ID].policy
            return module.state_dict(), learner.get_optimizer(DEFAULT_MODULE_ID).state_dict()

        weights, moments = next(iter(self.algorithm.learner_group.foreach_learner(give))).get()
        self.policy.policy.load_state_dict(weights)
        self.policy.policy.optimizer.load_state_dict(moments)
        for scale, _ in self._each(lambda envs: envs.rewards_state())[:1]:
            ours = self._normalised.ret_rms  # each runner has its own statistics, of as many steps
            ours.mean, ours.var, ours.count = scale.mean, scale.var, scale.count

    @property
    def _normalised(self) -> VecNormalize:
        found = self.policy.get_vec_normalize_env()
        assert found is not None  # as in `ppo.make_learner`
        return found

    def _each(self, do: Callable[[RunnerEnv], Any]) -> list[Any]:
        """Call a function with the environments of each running runner; return the results."""
        return self.algorithm.env_runner_group.foreach_env_runner(
            lambda runner: do(envs_of(runner)), local_env_runner=False
        )

    def update(self, proximity: float) -> Sampled:
        """Step all environments `n_steps` times and update the policy with the data.

        Args:
            proximity: weight of the reward's proximity term.
        """
        self._each(lambda envs: envs.weigh_proximity(proximity))
        began_s = time.monotonic()
        result = self.algorithm.train()
        finished = self._each(lambda envs: envs.take_finished())
        kept, stepped = result.get("fault_tolerance", {}), result.get("env_runners", {})
        n_steps = stepped.get("num_env_steps_sampled", math.nan)  # NaN: no worker has answered
        return Sampled(
            n_steps=0 if math.isnan(n_steps) else int(n_steps),
            episodes=[each for some in finished for each in some],
            n_runners=int(kept.get("num_healthy_workers", self.runners.n)),
            n_restarts=int(kept.get("num_remote_worker_restarts", 0)),
            seconds=time.monotonic() - began_s,
        )

    def last_error(self) -> str:
        """Return the last error that a worker raised, or else RLlib's report of its failure."""
        if reason := self._reason():
            return reason
        return f"a process was killed or ran out of memory ({self._log.message})"

    def _reason(self) -> str:
        """Return the message of the last error that a worker raised, or "" if there is none."""
        return ray.get(self._errors.last.remote())

    def close(self) -> None:
        """Stop the runners and the learner."""
        self.algorithm.stop()
        _LOGGER.handlers = self._handlers


def make_runner_env(context: Mapping[str, Any]) -> RunnerEnv:
    """Create the environments of a runner from RLlib's context, which contains their number."""
    cluster.one_core()
    torch.set_num_threads(1)
    errors = context["errors"]

    def report(error: str) -> None:
        ray.get(errors.report.remote(error))

    with reported_errors(report):
        context["registrations"].unpack()
        envs = make_envs(context["num_envs"], context["keywords"])
    return RunnerEnv(envs, context["gamma"], report)


def envs_of(runner: EnvRunner) -> RunnerEnv:
    """Return a runner's environments without RLlib's wrappers."""
    env: Any = runner.env  # type: ignore[attr-defined]  # of every `EnvRunner` here
    while not isinstance(env, RunnerEnv):
        env = env.env
    return env


class GoOn(RLlibCallback):
    """Callback that copies the state of a running runner's rewards to restarted runners.

    The state consists of the reward-normalization statistics and the proximity weight.
    """

    def on_env_runners_recreated(
        self, *, env_runner_group: Any, env_runner_indices: list[int], **kwargs: Any
    ) -> None:
        """Update restarted runners before they step their environments."""
        living = set(env_runner_group.healthy_env_runner_ids()) - set(env_runner_indices)
        if not living:
            return
        (known,) = env_runner_group.foreach_env_runner(
            lambda runner: envs_of(runner).rewards_state(),
            local_env_runner=False, remote_worker_ids=[min(living)],
        )  # fmt: skip
        env_runner_group.foreach_env_runner(
            lambda runner: envs_of(runner).take_rewards_state(*known),
            local_env_runner=False, remote_worker_ids=env_runner_indices,
        )  # fmt: skip


class WorkerErrors:
    """A Ray actor that stores the last error of the workers."""

    def __init__(self) -> None:
        self._last = ""

    def report(self, error: str) -> None:
        """Store an error message."""
        self._last = error

    def last(self) -> str:
        """Return the last error message, or "" if there is none."""
        return self._last


class LastError(logging.Handler):
    """Log handler that stores the last error."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.message = "no error was logged"

    def emit(self, record: logging.LogRecord) -> None:
        """Store the last line of a log record."""
        lines = [line.strip() for line in record.getMessage().splitlines() if line.strip()]
        if lines and lines[-1] != "NoneType: None":  # no exception was active
            self.message = lines[-1].rstrip(".")[:400]
