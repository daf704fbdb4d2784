"""The vector environment: many environments as one `gymnasium.vector.VectorEnv`.

import gymnasium, hrc_env
envs = gymnasium.make_vec("HRCReach-v0", num_envs=64, perception="keypoints")

Environment k is `gymnasium.make("HRCReach-v0", ...)`, bit for bit, whatever the number of
environments and of threads. What it says, and in which form, is what gymnasium's
`SyncVectorEnv` of the same environments says.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from hrc_env.control import check_action
from hrc_env.core.batching import State, copied, mapped, one, write_rows
from hrc_env.core.errors import ConfigError, check_shape, whole
from hrc_env.core.typing import Bools, Floats, Ints
from hrc_env.env import RENDER_MODES, EnvBase, spaces
from hrc_env.env_config import check_keywords
from hrc_env.rehearsal import rehearse
from hrc_env.render.views import CameraChoice
from hrc_env.reset_options import Fixed, ResetOptions, lasting_options, named_options
from hrc_env.rewards import RewardConfig
from hrc_env.settings import settle
from hrc_env.simulation import Simulation
from hrc_env.step_result import Observation, StepResult
from hrc_env.tasks.task import Task
from hrc_env.vector.infos import InfoTable, table, words_of_infos
from hrc_env.vector.member import TOGETHER, Member
from hrc_env.vector.options import (
    ALONE,
    MAX_ENVS,
    OF_VECTORS,
    autoreset_of,
    options_of_each,
    read_options,
    seeds_of,
    steps_behind,
    threads_of,
    time_limit,
)
from hrc_env.vector.pictures import LISTS, Pictures
from hrc_env.vector.shards import Shards

Step = tuple[Observation, NDArray[np.float64], Bools, Bools, dict[str, Any]]


class HRCVectorEnv(  # type: ignore[override]  # a property is `spec`, too
    EnvBase, VectorEnv[Observation, NDArray[np.float32], NDArray[Any]]
):
    """A vector environment: robots, each beside workers of its own, stepped at once.

    Environment k of `reset(seed=s)` is the single environment after `reset(seed=s + k)`, to the
    bit. Actions are (num_envs, A), observations (num_envs, n).

    Args:
        num_envs: how many environments step together.
        max_episode_steps: the time limit; None is the task's, -1 none.
        autoreset_mode: when an environment whose episode is over starts anew: at the next
            step (default), in the same step, or not by itself ("Disabled").
        num_threads: threads that share the environments; all cores if None.
        arguments: of `EnvConfig`. perception is "keypoints" (default), "truth" or "none", as
            pictures have no batched form; with "_list" behind a render mode `render` gives every
            environment's pictures of all steps since the last `render` or the beginning of the
            episode.

    Raises:
        ConfigError: a name, index or value that is not valid, with those that are.
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
                'perception="pixels" has no batched form: gymnasium.make_vec makes it with a '
                "process for each environment, and SB3's make_vec_env with vec_env_cls="
                'hrc_env.HRCSubprocVecEnv. perception="keypoints" emulates it, batched.'
            )
        settings = settle(**arguments)
        self._open(settings)
        if self.render_mode in LISTS:
            self.metadata["render_modes"].append(self.render_mode)
        self.arguments = arguments if self.render_mode else _without_pictures(arguments)
        """Given arguments of `HRCEnv`."""
        self.num_envs = whole("num_envs", num_envs, 1, MAX_ENVS)
        self.autoreset_mode = autoreset_of(autoreset_mode)
        self.metadata["autoreset_mode"] = self.autoreset_mode
        rehearse(settings)
        n_shards = min(threads_of(num_threads), self.num_envs)
        self.shards = Shards(self.num_envs, n_shards, partial(Simulation, settings=settings))
        self.pictures = Pictures(self.shards, self.render_mode, self._size, self._shown)
        self.single_observation_space, self.single_action_space = spaces(self.shards.first)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._streams = [seeding.np_random() for _ in range(self.num_envs)]
        """Each environment's generator, and what it was made from."""
        self._action_shape = (self.num_envs, self.shards.first.n_actions)
        limit = settings.task.max_episode_steps if max_episode_steps is None else max_episode_steps
        self.max_episode_steps = time_limit(limit)
        self._steps = np.zeros(self.num_envs, int)
        self._ended = np.zeros(self.num_envs, bool)
        self._observation: Observation | None = None
        self._options: list[dict[str, Any]] = [{}] * self.num_envs
        """The parts of each environment's episodes that are fixed until further notice."""
        self._fixed: list[Fixed | None] = [None] * self.num_envs
        """The same, checked."""
        self.notes: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        """Attributes of every environment that a user has set."""

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: Mapping[str, Any] | ResetOptions | None = None,
    ) -> tuple[Observation, dict[str, Any]]:
        """Start episodes of all environments, or of some.

        Args:
            seed: environment k gets `seed + k`, or the k-th of a list; with None its random
                stream goes on.
            options: "reset_mask", (num_envs,) bool: only these environments start anew.
                "steps_left", one or (num_envs,) int: after so many steps these first episodes are
                truncated, if not before. Or "elapsed_steps", (num_envs,) int: how much of the
                time limit they have behind them. What of the episodes is fixed: the other fields
                of `ResetOptions`, and "each", a list of a mapping of them for each environment.

        Returns:
            Observations of all environments, and infos of those that started.
        """
        self.refuse_closed()
        seeds = seeds_of(seed, self.num_envs)
        asked = read_options(options, self.num_envs, self.max_episode_steps)
        mask, elapsed_steps = asked.mask, asked.elapsed_steps
        if self._observation is None and not mask.all():
            raise ConfigError("The first reset() must be for everyone: leave out the reset_mask.")
        ids = np.flatnonzero(mask)
        fixed = self._fix_each(ids, asked.each)
        for k in ids.tolist():
            if seeds[k] is not None:
                self._streams[k] = seeding.np_random(seeds[k])
        fresh = self._begin(ids, fixed)
        self._steps[ids] = elapsed_steps[ids]
        if self._observation is None:
            self._observation = mapped(fresh.observation, np.empty_like)
        write_rows(self._observation, ids, fresh.observation)
        self._ended = self._ended & ~mask
        self.pictures.take(mask, mask)
        return copied(self._observation), table(fresh, ids, self.num_envs).arrays(mask)

    def step(self, actions: NDArray[np.float32]) -> Step:
        """One control step of every environment; actions (num_envs, n) in [-1, 1].

        In the mode NEXT_STEP those of environments whose episode has just ended are ignored:
        these start anew instead. Infos are arrays (num_envs,), each with a mask "_name".
        """
        result = self.shards.step(self._checked(actions))
        observation = copied(result.observation)
        info = table(result, slice(None), self.num_envs)
        reward, terminated, over = result.reward.copy(), result.terminated.copy(), self._ended
        self._steps += 1
        if over.any():  # only where the mode is NEXT_STEP
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
        infos = {**finals, **info.arrays(np.ones_like(ended))}
        return copied(observation), reward, terminated, truncated, infos

    def words(self, infos: Mapping[str, Any]) -> dict[str, NDArray[np.object_]]:
        """Return in words what infos say of workers, contacts and cameras.

        Args:
            infos: as `reset` and `step` return them.

        Returns:
            (num_envs,) tuples of words by the names of docs/reference/infos.md.
        """
        return words_of_infos(infos, self.num_envs, self.shards.first.bodies.names)

    def set_options(self, options: Mapping[str, Any] | ResetOptions | None = None) -> None:
        """Fix something of all episodes to come, as `HRCEnv.set_options`, in every environment.

        Args:
            options: as of `reset`, "each" included; None: nothing is fixed any more.

        Raises:
            ConfigError: an option that cannot be, or is of one reset.
        """
        each = options_of_each(lasting_options(options, *OF_VECTORS), self.num_envs)
        for of_one in each:
            lasting_options(of_one)
        nothing: list[dict[str, Any]] = [{}] * self.num_envs
        everyone = np.arange(self.num_envs)
        fixed = _fixed_each(self.shards.first, everyone, nothing, each)
        self._options, self._fixed = each, fixed

    def get_state(self) -> State:
        """Return a copy of everything that changes, options of `set_options` included."""
        return {**super().get_state(), "options": copied(self._options)}

    def set_state(self, state: State) -> None:
        """Continue from a state that was taken with the same arguments, bit for bit."""
        super().set_state(state)
        self.set_options({"each": copied(state["options"])})

    def check_options(self, k: int, options: Mapping[str, Any] | ResetOptions | None) -> None:
        """Raise the `ConfigError` that a reset of environment `k` with these options raises."""
        given = named_options(options, *ALONE)
        steps_behind({n: given.pop(n) for n in ALONE if n in given}, self.max_episode_steps)
        self.shards.first.fix({**self._options[k], **given})

    def options_of(self, k: int) -> dict[str, Any]:
        """Return the fixed parts of environment `k`'s episodes to come, by name."""
        return dict(self._options[k])

    def set_options_of(self, k: int, options: Mapping[str, Any] | ResetOptions | None) -> None:
        """Fix something of the episodes to come of environment `k` alone."""
        given = lasting_options(options)
        fixed = self.shards.first.fix(given) if given else None
        self._options = [given if b == k else each for b, each in enumerate(self._options)]
        self._fixed[k] = fixed

    def set_reward(
        self, weights: RewardConfig | None = None, factors: Mapping[str, float] | None = None
    ) -> None:
        """Weigh the reward's terms so from the next step on, in all environments (`HRCEnv`)."""
        for part in self.shards.parts:
            part.set_reward(weights, factors)

    def render(self, camera: CameraChoice = None) -> tuple[Any, ...] | None:  # type: ignore[override]
        """Return every environment's picture, or its list of pictures, by the render mode.

        They are drawn one after the other, which is slow.

        Args:
            camera: through which, as of `HRCEnv.render`; not of lists.

        Raises:
            ConfigError: there is no such camera.
        """
        self.refuse_closed()
        if self.render_mode is None:
            return None
        return tuple(self.pictures.of(k, camera) for k in range(self.num_envs))

    def member(self, k: int) -> Member:
        """Return environment `k` by itself."""
        return Member(self, k)

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Return the result of a method, or the value of an attribute, of every environment.

        Args:
            name: of the method or attribute; the methods `TOGETHER` are called once.
            args: of the method.
            kwargs: of the method.
        """
        if name in TOGETHER:
            return (getattr(self, name)(*args, **kwargs),) * self.num_envs
        said = [getattr(self.member(k), name) for k in range(self.num_envs)]
        return tuple(each(*args, **kwargs) if callable(each) else each for each in said)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute of every environment; see `Member`."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of your own of every environment; see `Member`.

        Args:
            name: of the attribute.
            values: one for all environments, or a list or tuple of one for each.
        """
        each = values if isinstance(values, (list, tuple)) else [values] * self.num_envs
        check_shape(f"values of {name!r}", (len(each),), (self.num_envs,), "one an environment")
        for k, value in enumerate(each):
            setattr(self.member(k), name, value)

    @property
    def simulation(self) -> Simulation:
        """The environments' simulation; of several, the first."""
        return self.shards.first

    @property
    def task(self) -> Task[Any, Any]:
        """The task of every robot."""
        return self._task

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The environments' random generators."""
        return tuple(generator for generator, _ in self._streams)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """What the environments' random generators were made from."""
        return tuple(seed for _, seed in self._streams)

    def set_stream(self, k: int, stream: np.random.Generator) -> None:
        """Let environment `k` draw from this generator, of unknown seed (-1)."""
        if not isinstance(stream, np.random.Generator):
            raise ConfigError(f"np_random must be a numpy.random.Generator, got {stream!r}.")
        self._streams[k] = stream, -1

    def close_extras(self, **kwargs: Any) -> None:
        """Stop the threads and release graphics contexts."""
        if "pictures" not in vars(self):  # gymnasium before 1.4 closes what could not be made, too
            return
        self.pictures.close()
        self.shards.close()

    def _reward_factor(self, term: str) -> float:
        return self.shards.first.reward_factors.get(term, 1.0)

    def _begin(self, ids: Ints, fixed: Sequence[Fixed | None] = ()) -> StepResult:
        """Start environments `ids` anew; their random streams go on."""
        self._steps[ids] = 0
        return self.shards.reset(ids, [self._streams[k][0] for k in ids.tolist()], fixed)

    def _fix_each(self, ids: Ints, each: Sequence[dict[str, Any]]) -> list[Fixed | None]:
        """What is fixed of the episodes of environments `ids`, by the options of a reset (B,) and
        those of all."""
        if not any(each):
            return [self._fixed[k] for k in ids.tolist()]
        return _fixed_each(self.shards.first, ids, self._options, each)

    def _restart(self, who: Bools, observation: Observation, info: InfoTable) -> None:
        """Start environments `who` (B,) anew and write what they see over what they saw."""
        ids = np.flatnonzero(who)
        fresh = self._begin(ids, [self._fixed[k] for k in ids.tolist()])
        write_rows(observation, ids, fresh.observation)
        info.write(ids, fresh)

    def _checked(self, actions: Any) -> Floats:
        """Actions (num_envs, n) clipped to [-1, 1]; zero for environments that start anew."""
        self.refuse_closed()
        if self._observation is None:
            raise ConfigError("Call reset() before step().")
        over = np.flatnonzero(self._ended)
        if len(over) > 0 and self.autoreset_mode is AutoresetMode.DISABLED:
            raise ConfigError(
                f"The episodes of environments {over.tolist()} are over: call "
                'reset(options={"reset_mask": terminations | truncations}) before step().'
            )
        if len(over) > 0 and np.shape(actions) == self.action_space.shape:
            actions = np.array(actions)
            actions[over] = 0.0
        return check_action(actions, self._action_shape, self.shards.first.control)


def _without_pictures(arguments: dict[str, Any]) -> dict[str, Any]:
    """Return arguments without those of pictures, which nobody draws."""
    of_pictures = ("render_mode", "width", "height", "render_markers", "overlay")
    return {name: value for name, value in arguments.items() if name not in of_pictures}


def _fixed_each(
    simulation: Simulation, ids: Ints, lasting: Sequence[dict[str, Any]],
    each: Sequence[dict[str, Any]],
) -> list[Fixed | None]:  # fmt: skip
    """What options (B,), those of all resets and those of one, fix of environments `ids`."""
    known: dict[tuple[int, int], Fixed | None] = {}
    for k in ids.tolist():
        key = id(lasting[k]), id(each[k])
        if key not in known:
            options = {**lasting[k], **each[k]}
            known[key] = simulation.fix(options) if options else None
    return [known[id(lasting[k]), id(each[k])] for k in ids.tolist()]


def _finals(observation: Observation, info: InfoTable, who: Bools) -> dict[str, Any]:
    """The last observations and infos of the episodes of environments `who` (B,)."""
    last = np.full(len(who), None, object)
    for b in np.flatnonzero(who):
        last[b] = copied(one(observation, int(b)))
    final_info = {"final_info": info.arrays(who), "_final_info": who.copy()}
    return {"final_obs": last, "_final_obs": who.copy(), **final_info}
