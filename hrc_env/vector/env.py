"""The vector environment: many environments as one `gymnasium.vector.VectorEnv`.

import gymnasium, hrc_env
envs = gymnasium.make_vec("HRCReach-v0", num_envs=64, perception="keypoints")

Environment k equals `gymnasium.make("HRCReach-v0", ...)`, bit for bit, for any number of
environments and threads. Results have the form of those of gymnasium's `SyncVectorEnv`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from hrc_env.control import check_action
from hrc_env.core.batching import State, copy_arrays, gather, map_arrays, one, write_rows
from hrc_env.core.errors import ConfigError, check_integer, check_shape
from hrc_env.core.infos import InfoDict
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.env import RENDER_MODES, EnvBase, make_spaces
from hrc_env.env_config import check_keywords
from hrc_env.rehearsal import rehearse
from hrc_env.render.views import CameraChoice
from hrc_env.reset_options import Fixed, ResetOptions, lasting_options, named_options
from hrc_env.rewards import RewardConfig
from hrc_env.settings import resolve_settings
from hrc_env.simulation import Simulation
from hrc_env.step_result import Observation, StepResult
from hrc_env.tasks.task import AnyTask
from hrc_env.vector.infos import InfoTable, make_table, words_of_infos
from hrc_env.vector.member import TOGETHER, Member
from hrc_env.vector.options import (
    ALONE,
    MAX_ENVS,
    OF_VECTORS,
    count_elapsed_steps,
    count_shards,
    parse_autoreset,
    parse_branch_seeds,
    parse_seeds,
    parse_sources,
    parse_time_limit,
    read_options,
    split_options,
)
from hrc_env.vector.pictures import LISTS, Pictures
from hrc_env.vector.shards import Shards

Step: TypeAlias = tuple[Observation, NDArray[np.float64], Bools, Bools, dict[str, Any]]
"""Observation, rewards, terminated, truncated and infos of a step, as in gymnasium."""

_OF_BRANCHES = ("_steps", "_ended", "_observation", "_options", "_fixed")
"""Attributes of `HRCVectorEnv` that a branch takes from its source."""


@dataclass(frozen=True, slots=True, eq=False)
class Kept:
    """Copies of environments in the middle of their episodes (`HRCVectorEnv.keep`)."""

    settings: State
    """Settings of the environments."""
    simulated: State
    """State of the simulations, with a row for each environment."""
    own: State
    """Attributes of the vector environment, with a row for each environment."""

    def __len__(self) -> int:
        return len(self.own["_steps"])


class HRCVectorEnv(  # type: ignore[override]  # a property is `spec`, too
    EnvBase, VectorEnv[Observation, NDArray[np.float32], NDArray[Any]]
):
    """A vector environment: a batch of robots, each with separate workers, that step together.

    Environment k after `reset(seed=s)` equals the single environment after `reset(seed=s + k)`, bit
    for bit. Actions are (num_envs, A), observations (num_envs, n).

    Args:
        num_envs: number of environments.
        max_episode_steps: time limit [control steps]; None for the task's limit, -1 for no limit.
        autoreset_mode: when an environment is reset after the end of an episode: in the next step
            (the default), in the same step, or never ("Disabled").
        num_threads: maximum number of threads that share the environments; None for all cores.
            Each of them steps at least `options.MIN_PER_THREAD` environments.
        arguments: fields of `EnvConfig`. `perception` is "keypoints" (the default), "truth" or
            "none", because images are not rendered in batches. If the render mode has the suffix
            "_list", `render` returns the pictures of all steps since the last `render` or the start
            of the episode, for each environment.

    Raises:
        ConfigError: a name, index or value is not valid; the error names the valid ones.
    """

    CHANGES = ("shards", "_streams", "_steps", "_ended", "_observation")
    PICTURES = (*RENDER_MODES, *LISTS)

    def __init__(
        self,
        num_envs: int,
        *,
        max_episode_steps: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        num_threads: int | None = None,
        **arguments: Any,
    ) -> None:
        check_keywords(HRCVectorEnv, arguments)
        arguments = {"perception": "keypoints", **arguments}
        if arguments["perception"] == "pixels":
            raise ConfigError(
                'perception="pixels" cannot be batched in one process: gymnasium.make_vec creates '
                "one process per environment, and so does SB3's make_vec_env with "
                'vec_env_cls=hrc_env.HRCSubprocVecEnv. perception="keypoints" emulates it and can '
                "be batched."
            )
        settings = resolve_settings(**arguments)
        self._open(settings)
        if self.render_mode in LISTS:
            self.metadata["render_modes"].append(self.render_mode)
        self.arguments = arguments if self.render_mode else _without_pictures(arguments)
        """Arguments for `HRCEnv` that the user has passed, without those that concern pictures if
        there is no render mode."""
        self.num_envs = check_integer("num_envs", num_envs, 1, MAX_ENVS)
        self.autoreset_mode = parse_autoreset(autoreset_mode)
        self.metadata["autoreset_mode"] = self.autoreset_mode
        rehearse(settings)
        n_shards = count_shards(self.num_envs, num_threads)
        self.shards = Shards(self.num_envs, n_shards, partial(Simulation, settings=settings))
        self.pictures = Pictures(self.shards, self.render_mode, self._size, self._shown)
        self.single_observation_space, self.single_action_space = make_spaces(self.shards.first)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._streams = [seeding.np_random() for _ in range(self.num_envs)]
        """Random generator and seed of each environment."""
        self._action_shape = (self.num_envs, self.shards.first.n_actions)
        limit = settings.task.max_episode_steps if max_episode_steps is None else max_episode_steps
        self.max_episode_steps = parse_time_limit(limit)
        self._steps = np.zeros(self.num_envs, int)
        self._ended = np.zeros(self.num_envs, bool)
        self._observation: Observation | None = None
        self._options: list[dict[str, Any]] = [{}] * self.num_envs
        """Options that fix parts of all future episodes, for each environment."""
        self._fixed: list[Fixed | None] = [None] * self.num_envs
        """Parsed form of `_options`, for each environment."""
        self.notes: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        """Attributes that users have set with `set_attr`, for each environment."""

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: Mapping[str, Any] | ResetOptions | None = None,
    ) -> tuple[Observation, dict[str, Any]]:
        """Start episodes of all or of some environments.

        Args:
            seed: environment k is seeded with `seed + k`, or with the k-th entry of a list. With
                None, its random stream continues.
            options: options by name. "reset_mask", (num_envs,) bool, selects the environments that
                start an episode. "steps_left", an int or (num_envs,) int, is the maximum number of
                steps of these episodes; alternatively, "elapsed_steps", (num_envs,) int, is the
                number of steps of the time limit that have already passed. The other fields of
                `ResetOptions` fix parts of the episodes; "each" is a list with a mapping of such
                fields for each environment.

        Returns:
            Observations of all environments, and infos of those that have started an episode.

        Raises:
            ConfigError: an option is invalid; in that case no episode is started.
        """
        self.refuse_closed()
        seeds = parse_seeds(seed, self.num_envs)
        asked = read_options(options, self.num_envs, self.max_episode_steps)
        mask, elapsed_steps = asked.mask, asked.elapsed_steps
        if self._observation is None and not mask.all():
            raise ConfigError(
                "The first reset() must include all environments: leave out the reset_mask."
            )
        ids = np.flatnonzero(mask)
        fixed = self._fix_each(ids, asked.each)
        for k in ids.tolist():
            if seeds[k] is not None:
                self._streams[k] = seeding.np_random(seeds[k])
        fresh = self._begin(ids, fixed)
        self._steps[ids] = elapsed_steps[ids]
        if self._observation is None:
            self._observation = map_arrays(fresh.observation, np.empty_like)
        write_rows(self._observation, ids, fresh.observation)
        self._ended = self._ended & ~mask
        self.pictures.take(mask, mask)
        return copy_arrays(self._observation), make_table(fresh, ids, self.num_envs).arrays(mask)

    def step(self, actions: NDArray[np.float32]) -> Step:
        """Advance every environment by one control step.

        In the autoreset mode NEXT_STEP, environments with an episode that ended in the previous
        step are reset instead, and their actions are ignored.

        Args:
            actions: (num_envs, A) actions in [-1, 1].

        Returns:
            Observations, rewards (num_envs,), whether episodes are terminated, whether they are
            truncated, and infos: arrays (num_envs,), each with a mask "_name".
        """
        result = self.shards.step(self._check_actions(actions))
        observation = copy_arrays(result.observation)
        info = make_table(result, slice(None), self.num_envs)
        reward, terminated, over = result.reward.copy(), result.terminated.copy(), self._ended
        self._steps += 1
        if over.any():  # in the mode NEXT_STEP only
            self._restart(over, observation, info)
            reward[over], terminated[over] = 0.0, False
        truncated = self._steps >= self.max_episode_steps
        ended, finals = terminated | truncated, {}
        if self.autoreset_mode is AutoresetMode.SAME_STEP and ended.any():
            finals = _finals(observation, info, ended)
            self._restart(ended, observation, info)
            over, ended = ended, np.zeros_like(ended)
        self._observation, self._ended = observation, ended
        self.pictures.take(np.ones_like(over), over)
        infos = InfoDict({**finals, **info.arrays(np.ones_like(ended))})
        return copy_arrays(observation), reward, terminated, truncated, infos

    def branch(
        self,
        ids: Sequence[int] | Ints,
        seeds: Sequence[int | None] | Ints,
        kept: Sequence[Kept] = (),
    ) -> Observation:
        """Let environments go on from the present state of others, with new random numbers.

        Environment k becomes a copy of environment `ids[k]`, in the middle of its episode, and its
        random streams are spawned anew from `seeds[k]`. Copies with different seeds have the same
        past and different futures, as multilevel splitting needs them; with the same seed, they
        have the same future, with any number of threads. What was sampled for the whole episode
        (rig, faults and appearance) stays the same, and so do time limit and options. An agent with
        a memory must be copied, too.

        Args:
            ids: (num_envs,) index of the environment that each one becomes. Indices from `num_envs`
                on count the environments in `kept`.
            seeds: (num_envs,) seeds, all different. None is for an environment that becomes itself
                and is not changed, bit for bit.
            kept: environments that `keep` has returned.

        Returns:
            Observations of all environments.

        Raises:
            ConfigError: an index or a seed is invalid, `kept` belongs to an environment with other
                arguments, or `reset` has not been called; no environment is changed then.
            HRCError: the state of the task or the estimator has no row per environment.
        """
        bounds = [0, self.num_envs, *(self.num_envs + np.cumsum([len(each) for each in kept]))]
        sources = parse_sources(ids, self.num_envs, bounds[-1])
        given = parse_branch_seeds(seeds, sources)
        for each in kept:
            self.shards.first.check_settings(each.settings, "batch")
        every = (self.keep(range(self.num_envs)), *kept)
        own = gather([each.own for each in every], bounds, sources)
        seeded = [k for k, seed in enumerate(given) if seed is not None]
        streams = {k: seeding.np_random(given[k]) for k in seeded}
        self.shards.set_rows([each.simulated for each in every], bounds, sources)
        self.shards.restart_streams(np.array(seeded, int), [streams[k][0] for k in seeded])
        self._streams = [streams.get(k, own) for k, own in enumerate(self._streams)]
        for name, value in own.items():
            setattr(self, name, value)
        return copy_arrays(self._observation)

    def keep(self, ids: Sequence[int] | Ints) -> Kept:
        """Return copies of environments in the middle of their episodes, for `branch`.

        Args:
            ids: (n,) indices of the environments.

        Raises:
            ConfigError: an index is invalid, or `reset` has not been called.
        """
        self.refuse_closed()
        if self._observation is None:
            raise ConfigError("Call reset() before keep() or branch().")
        rows = parse_sources(ids, np.size(ids), self.num_envs)
        own = {name: getattr(self, name) for name in _OF_BRANCHES}
        taken = gather([own], [0, self.num_envs], rows)
        return Kept(self.shards.first.settings, self.shards.get_rows(rows), taken)

    def words(self, infos: Mapping[str, Any]) -> dict[str, NDArray[np.object_]]:
        """Convert indices in infos to names of activities, bodies, contacts and cameras.

        Args:
            infos: infos of `reset` or `step`.

        Returns:
            Arrays (num_envs,) of tuples of names, by the keys in docs/reference/infos.md.
        """
        return words_of_infos(infos, self.num_envs, self.shards.first.bodies.names)

    def set_options(self, options: Mapping[str, Any] | ResetOptions | None = None) -> None:
        """Fix parts of all future episodes in every environment, until the next call.

        Args:
            options: options of `reset`, including "each"; None removes all fixed parts.

        Raises:
            ConfigError: an option is invalid, or is permitted for a single reset only.
        """
        each = split_options(lasting_options(options, *OF_VECTORS), self.num_envs)
        for of_one in each:
            lasting_options(of_one)
        nothing: list[dict[str, Any]] = [{}] * self.num_envs
        everyone = np.arange(self.num_envs)
        fixed = _fix_episodes(self.shards.first, everyone, nothing, each)
        self._options, self._fixed = each, fixed

    def get_state(self) -> State:
        """Return a copy of the complete state, including the options from `set_options`."""
        return {**super().get_state(), "options": copy_arrays(self._options)}

    def set_state(self, state: State) -> None:
        """Restore a state of an environment with the same arguments, bit for bit."""
        super().set_state(state)
        self.set_options({"each": copy_arrays(state["options"])})

    def check_options(self, k: int, options: Mapping[str, Any] | ResetOptions | None) -> None:
        """Raise `ConfigError` if a reset of environment `k` would reject these options."""
        given = named_options(options, *ALONE)
        count_elapsed_steps({n: given.pop(n) for n in ALONE if n in given}, self.max_episode_steps)
        self.shards.first.fix({**self._options[k], **given})

    def options_of(self, k: int) -> dict[str, Any]:
        """Return the options of all future episodes of environment `k`, by name."""
        return dict(self._options[k])

    def set_options_of(self, k: int, options: Mapping[str, Any] | ResetOptions | None) -> None:
        """Fix parts of all future episodes of the single environment `k`."""
        given = lasting_options(options)
        fixed = self.shards.first.fix(given) if given else None
        self._options = [given if b == k else each for b, each in enumerate(self._options)]
        self._fixed[k] = fixed

    def set_reward(
        self, weights: RewardConfig | None = None, factors: Mapping[str, float] | None = None
    ) -> None:
        """Set the weights of the reward terms in all environments, as `HRCEnv.set_reward` does."""
        for part in self.shards.parts:
            part.set_reward(weights, factors)

    def render(self, camera: CameraChoice = None) -> tuple[Any, ...] | None:  # type: ignore[override]
        """Return the picture, or in list modes the list of pictures, of every environment.

        The pictures are rendered one after the other, which is slow.

        Args:
            camera: camera of the pictures, as for `HRCEnv.render`; must be None if lists are
                returned.

        Raises:
            ConfigError: the camera does not exist.
        """
        self.refuse_closed()
        if self.render_mode is None:
            return None
        return tuple(self.pictures.of(k, camera) for k in range(self.num_envs))

    def member(self, k: int) -> Member:
        """Return the interface of the single environment `k`."""
        return Member(self, k)

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Return the result of a method, or the value of an attribute, of every environment.

        Args:
            name: name of the method or attribute; the methods in `member.TOGETHER` are called only
                once.
            args: arguments of the method.
            kwargs: keyword arguments of the method.
        """
        if name in TOGETHER:
            return (getattr(self, name)(*args, **kwargs),) * self.num_envs
        values = [getattr(self.member(k), name) for k in range(self.num_envs)]
        return tuple(each(*args, **kwargs) if callable(each) else each for each in values)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return the value of an attribute of `Member` for every environment."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Set a user-defined attribute of `Member` for every environment.

        Args:
            name: name of the attribute.
            values: a value for all environments, or a list or tuple with one value for each.
        """
        each = values if isinstance(values, (list, tuple)) else [values] * self.num_envs
        check_shape(
            f"values of {name!r}", (len(each),), (self.num_envs,), "one entry per environment"
        )
        for k, value in enumerate(each):
            setattr(self.member(k), name, value)

    @property
    def simulation(self) -> Simulation:
        """Simulation of the environments; the first simulation if there are several."""
        return self.shards.first

    @property
    def task(self) -> AnyTask:
        """Task of the robots."""
        return self._task

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """Random generator of each environment."""
        return tuple(generator for generator, _ in self._streams)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """Seed of each environment's random generator; -1 if it is unknown."""
        return tuple(seed for _, seed in self._streams)

    def set_stream(self, k: int, stream: np.random.Generator) -> None:
        """Set the random generator of environment `k`, and its seed to -1 (unknown)."""
        if not isinstance(stream, np.random.Generator):
            raise ConfigError(f"np_random must be a numpy.random.Generator, got {stream!r}.")
        self._streams[k] = stream, -1

    def close_extras(self, **kwargs: Any) -> None:
        """Stop the threads and release graphics contexts."""
        if "pictures" not in vars(self):  # gymnasium before 1.4 also closes after an error
            return
        self.pictures.close()
        self.shards.close()

    def _reward_factor(self, term: str) -> float:
        return self.shards.first.reward_factors.get(term, 1.0)

    def _begin(self, ids: Ints, fixed: Sequence[Fixed | None] = ()) -> StepResult:
        """Begin new episodes in environments `ids`; their random streams continue."""
        self._steps[ids] = 0
        return self.shards.reset(ids, [self._streams[k][0] for k in ids.tolist()], fixed)

    def _fix_each(self, ids: Ints, each: Sequence[dict[str, Any]]) -> list[Fixed | None]:
        """Return the fixed parts of the episodes of environments `ids`.

        Args:
            ids: (n,) indices of the environments.
            each: options of one reset for each of the B environments.
        """
        if not any(each):
            return [self._fixed[k] for k in ids.tolist()]
        return _fix_episodes(self.shards.first, ids, self._options, each)

    def _restart(self, mask: Bools, observation: Observation, info: InfoTable) -> None:
        """Reset environments, and replace their observations and infos.

        Args:
            mask: (B,) mask of the environments that are reset.
            observation: observations of all environments; the rows of those that are reset are
                replaced.
            info: infos of all environments; the rows of those that are reset are replaced.
        """
        ids = np.flatnonzero(mask)
        fresh = self._begin(ids, [self._fixed[k] for k in ids.tolist()])
        write_rows(observation, ids, fresh.observation)
        info.write(ids, fresh)

    def _check_actions(self, actions: Any) -> Floats:
        """Return actions (num_envs, A) clipped to [-1, 1]; 0 for environments that are reset."""
        self.refuse_closed()
        if self._observation is None:
            raise ConfigError("Call reset() before step().")
        over = np.flatnonzero(self._ended)
        if len(over) > 0 and self.autoreset_mode is AutoresetMode.DISABLED:
            raise ConfigError(
                f"The episodes of environments {over.tolist()} have ended: call "
                'reset(options={"reset_mask": terminations | truncations}) before step().'
            )
        if len(over) > 0 and np.shape(actions) == self.action_space.shape:
            actions = np.array(actions)
            actions[over] = 0.0
        return check_action(actions, self._action_shape, self.shards.first.control)


def _without_pictures(arguments: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments without those that concern pictures."""
    names = ("render_mode", "width", "height", "render_markers", "overlay")
    return {name: value for name, value in arguments.items() if name not in names}


def _fix_episodes(
    simulation: Simulation,
    ids: Ints,
    lasting: Sequence[dict[str, Any]],
    each: Sequence[dict[str, Any]],
) -> list[Fixed | None]:
    """Return the fixed parts of the episodes of environments `ids`.

    Args:
        simulation: a simulation with the settings of the environments.
        ids: (n,) indices of the environments.
        lasting: options of all resets for each of the B environments.
        each: options of one reset for each of the B environments.
    """
    known: dict[tuple[int, int], Fixed | None] = {}
    for k in ids.tolist():
        key = id(lasting[k]), id(each[k])
        if key not in known:
            options = {**lasting[k], **each[k]}
            known[key] = simulation.fix(options) if options else None
    return [known[id(lasting[k]), id(each[k])] for k in ids.tolist()]


def _finals(observation: Observation, info: InfoTable, ended: Bools) -> dict[str, Any]:
    """Return the final observations and infos of the episodes that `ended` (B,)."""
    last = np.full(len(ended), None, object)
    for b in np.flatnonzero(ended):
        last[b] = copy_arrays(one(observation, int(b)))
    final_info = {"final_info": info.arrays(ended), "_final_info": ended.copy()}
    return {"final_obs": last, "_final_obs": ended.copy(), **final_info}
