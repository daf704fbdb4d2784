"""The Gymnasium environment `HRCEnv`, a `Simulation` with a batch of one.

import gymnasium, hrc_env
env = gymnasium.make("HRCReach-v0", perception="keypoints")
"""

import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from inspect import Parameter
from typing import Any, ClassVar, NamedTuple

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Dict
from numpy.typing import NDArray

from hrc_env import observations, rewards
from hrc_env.control import check_action
from hrc_env.core.batching import Stateful, one
from hrc_env.core.errors import (
    ConfigError,
    NoAttributeError,
    check_integer,
    make_unknown_name_error,
)
from hrc_env.core.infos import Words, name_indices
from hrc_env.core.registry import share
from hrc_env.core.typing import Floats
from hrc_env.env_config import signature_of_env
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.infos import words_of
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.registration import HasSpec
from hrc_env.rehearsal import rehearse
from hrc_env.render.marks import OVERLAYS
from hrc_env.render.views import CameraChoice, Views, check_size
from hrc_env.reset_options import ResetOptions, lasting_options, named_options
from hrc_env.rewards import RewardConfig
from hrc_env.settings import Settings, resolve_settings
from hrc_env.simulation import Simulation
from hrc_env.step_result import Observation
from hrc_env.tasks import DEFAULT, goal
from hrc_env.tasks.task import TaskType, require_goal

RENDER_MODES = ("rgb_array", "depth_array")
"""Render modes of a single environment."""
ENDLESS = 2**62
"""Number of remaining steps of an environment without a time limit. Gymnasium's wrapper `TimeLimit`
enforces time limits."""


class EnvBase(HasSpec, Stateful):
    """Base class of single and vector environments, with states, rendering settings and `spec`."""

    closed = False
    """Whether the environment has been closed."""
    PICTURES: ClassVar[tuple[str, ...]] = RENDER_MODES
    """Render modes that this class supports."""

    def _open(self, settings: Settings) -> None:
        """Store the settings, and check the rendering settings."""
        asked = settings.asked
        check_render_mode(asked.render_mode, self.PICTURES)
        share()
        self._size = check_size(asked.width, asked.height)
        self._shown = parse_overlays(asked.render_markers, asked.overlay)
        if asked.overlay is not None and not str(asked.render_mode).startswith("rgb_array"):
            warnings.warn(
                f"overlay={asked.overlay!r} requires render_mode='rgb_array', got "
                f"render_mode={asked.render_mode!r}.",
                stacklevel=4,
            )
        self.render_mode = asked.render_mode
        self.config, self._task = settings.config, settings.task
        fps = round(1 / self.config.ctrl_dt)
        self.metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": fps}

    @property
    def compute_reward(self) -> Callable[[Any, Any, Any], Any]:
        """Callable (achieved_goal, desired_goal, info) that computes the reward of transitions.

        It takes one pair of goals (n,) and the info of its step, or many pairs (B, n) with a list
        of infos or the infos of a vector environment. With the info of a step it returns exactly
        the reward of that step: the goal's term and the terms that all tasks share. With infos that
        lack these terms, such as those of hindsight replay, it returns the goal's term alone.

        Raises:
            NoGoalError: the task has no goals apart from its observation. The error is also an
                `AttributeError`; therefore `hasattr` returns False.
        """
        separate_goal, terms = require_goal(self._task), rewards.SHARED_TERMS
        return partial(
            goal.compute_reward,
            separate_goal,
            config=self.config.task,
            others=[term.name for term in (*self._task.rewards, *terms)],
            factor=self._reward_factor(goal.TERM),
        )

    @property
    def compute_terminated(self) -> Callable[[Any, Any, Any], Any]:
        """Callable (achieved_goal, desired_goal, info) that determines whether episodes terminate.

        It takes the arguments of `compute_reward`. Reaching a goal does not end an episode; a
        contact ends it if `config.cost.contact_terminates` is true.

        Raises:
            NoGoalError: the task has no goals apart from its observation.
            NoAttributeError: the task terminates episodes by `Task.is_terminal`.
        """
        separate_goal = require_goal(self._task)
        if self._task.can_end:
            raise NoAttributeError(
                f"{self._task.id} terminates episodes by Task.is_terminal, which cannot be "
                "computed from goals and infos: use `terminated`, which `step` returns."
            )
        entries = ("cost_contact",) if self.config.cost.contact_terminates else ()
        return partial(goal.compute_terminated, separate_goal, entries=entries)

    @property
    def compute_truncated(self) -> Callable[[Any, Any, Any], Any]:
        """Callable (achieved_goal, desired_goal, info) that returns False for each transition.

        Only the time limit truncates an episode.

        Raises:
            NoGoalError: the task has no goals apart from its observation.
        """
        return partial(goal.compute_terminated, require_goal(self._task))

    def _reward_factor(self, term: str) -> float:
        """Return the factor of a reward term, as set by `set_reward`."""
        raise NotImplementedError

    def refuse_closed(self) -> None:
        """Raise `ConfigError` if the environment has been closed."""
        if self.closed:
            raise ConfigError("This environment is closed; make a new one.")


class HRCEnv(  # type: ignore[override]  # a property is `spec`, too
    EnvBase, gymnasium.Env[Observation, NDArray[np.float32]]
):
    """A Gymnasium environment in which a robot observes the people beside it only by cameras.

    Args:
        task: the robot's task, an ID or a subclass of `Task`.
        arguments: the other fields of `EnvConfig`, which documents all arguments.

    Raises:
        ConfigError: a name, index or value is invalid; the error names the valid ones.
    """

    CHANGES = (
        "simulation",
        "_np_random",
        "_np_random_seed",
        "_begun",
        "_steps_left",
        "_options",
        "_next_options",
    )
    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 25}  # noqa: RUF012

    __signature__ = signature_of_env(
        Parameter("task", Parameter.POSITIONAL_OR_KEYWORD, default=DEFAULT)
    )

    def __init__(self, task: str | TaskType = DEFAULT, **arguments: Any) -> None:
        settings = resolve_settings(task=task, **arguments)
        self._open(settings)
        rehearse(settings)
        self.simulation = Simulation(1, settings)
        self.views = Views(self.simulation)
        """Renderer of pictures of the scene, available at any time and in any size."""
        self.observation_space, self.action_space = make_spaces(self.simulation)
        self._begun = False
        self._steps_left = ENDLESS
        self._options: dict[str, Any] = {}
        self._next_options: dict[str, Any] = {}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: seed of the environment's random stream; None continues the stream.
            options: fixed parts of the episode, which replace those of `set_options`: fields of
                `ResetOptions` by name, such as {"goal": (0.4, 0.3, 1.1), "n_workers": 0}.

        Returns:
            The observation and the info.

        Raises:
            ConfigError: an option is invalid; the previous episode continues.
        """
        self.refuse_closed()
        given = self._with_lasting(options)
        steps_left = _steps_left(given)
        fixed = [self.simulation.fix(given)] if given else []
        self._next_options = {}
        super().reset(seed=seed)
        self._begun, self._steps_left = True, steps_left
        result = self.simulation.reset(np.array([0]), [self.np_random], fixed)
        return one(result.observation, 0), result.info_of(0)

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advance the environment by one control step, 1 / 25 s by default.

        Args:
            action: (A,) the action, in [-1, 1].

        Returns:
            Observation, reward, whether the episode is terminated, whether it is truncated, and
            info.
        """
        self.refuse_closed()
        if not self._begun:
            raise ConfigError("Call reset() before step().")
        values = check_action(action, (self.simulation.n_actions,), self.simulation.control)
        result = self.simulation.step(values[None])
        self._steps_left -= 1
        return (
            one(result.observation, 0),
            float(result.reward[0]),
            bool(result.terminated[0]),
            self._steps_left <= 0,  # the time limit is enforced by gymnasium's TimeLimit
            result.info_of(0),
        )

    def words(self, info: Mapping[str, Any]) -> Words:
        """Convert the indices in an info to names of activities, bodies, contacts and cameras.

        Args:
            info: info that `reset` or `step` returned.

        Returns:
            Tuples of names, by the keys in docs/reference/infos.md, such as "worker/activity".
        """
        return name_indices(info, words_of(self.body_names))

    @property
    def body_names(self) -> tuple[str, ...]:
        """Names of the workers' bodies; `worker_N/body` in infos is an index into them."""
        return self.simulation.bodies.names

    @property
    def rig(self) -> tuple[CameraConfig, ...]:
        """Calibration of this episode's cameras, as known to the estimator."""
        return self.simulation.rig_of(0)

    @property
    def faults(self) -> tuple[FaultConfig, ...]:
        """Faults of this episode's cameras with their sampled amounts, which no belief contains."""
        return self.simulation.cameras.faults_of(0)

    @property
    def options(self) -> dict[str, Any]:
        """Options of all future episodes by name, as set by `set_options`."""
        return dict(self._options)

    @options.setter
    def options(self, options: Mapping[str, Any] | ResetOptions | None) -> None:
        self.set_options(options)

    @property
    def next_options(self) -> dict[str, Any]:
        """Options of the next reset only, set by vector environments that use subprocesses."""
        return dict(self._next_options)

    @next_options.setter
    def next_options(self, options: Mapping[str, Any] | ResetOptions | None) -> None:
        self._next_options = named_options(options)

    def set_options(self, options: Mapping[str, Any] | ResetOptions | None = None) -> None:
        """Fix parts of all future episodes until the next call, for example for a curriculum.

        The options are part of the state that `get_state` returns; a restored environment therefore
        continues with the same options.

        Args:
            options: options of `reset`, which replace the previous ones; options passed to `reset`
                take precedence. None removes all options.

        Raises:
            ConfigError: an option is invalid, or is for a single reset only.
        """
        given = lasting_options(options)
        self.simulation.fix(given)
        self._options = given

    def check_options(
        self, options: Mapping[str, Any] | ResetOptions | None = None, lasting: bool = False
    ) -> None:
        """Check options of `reset` without resetting.

        Args:
            options: options of `reset`.
            lasting: whether the options are for `set_options` rather than for `reset`.

        Raises:
            ConfigError: an option is invalid.
        """
        with warnings.catch_warnings():  # the reset itself issues the warnings
            warnings.simplefilter("ignore")
            if lasting:
                self.simulation.fix(lasting_options({**self._next_options, **_named(options)}))
            else:
                given = self._with_lasting(options)
                _steps_left(given)
                self.simulation.fix(given)

    def attempt(self, method: str, *args: Any, **kwargs: Any) -> Any:
        """Call a method, and return its `ConfigError` instead of raising it.

        A vector environment closes a subprocess that raises an error; a returned error reaches the
        user.

        Args:
            method: name of the method.
            args: arguments of the method.
            kwargs: keyword arguments of the method.

        Returns:
            The result of the method, or the error.
        """
        try:
            return getattr(self, method)(*args, **kwargs)
        except ConfigError as error:
            return error

    def set_reward(
        self, weights: RewardConfig | None = None, factors: Mapping[str, float] | None = None
    ) -> None:
        """Set the weights of the reward's terms from the next step on.

        Args:
            weights: weights of the terms that all tasks share; None keeps them.
            factors: factors by which terms are multiplied, by name, including terms of the task:
                {"goal": 2.0}. All other terms have the factor 1. None keeps the factors.

        Raises:
            ConfigError: a term is unknown, or a factor is not a finite number.
        """
        self.simulation.set_reward(weights, factors)

    def render(self, camera: CameraChoice = None) -> NDArray[Any] | None:  # type: ignore[override]
        """Return a picture of the scene: (H, W, 3) RGB of uint8, or (H, W) depths [m].

        Args:
            camera: index or name of a camera of the rig, a viewpoint such as "room" or "top", or a
                `CameraConfig`; None for the task's viewpoint.

        Raises:
            ConfigError: there is no such camera.
        """
        self.refuse_closed()
        if self.render_mode is None:
            return None
        is_depth = self.render_mode == "depth_array"
        return self.views.picture(is_depth, size=self._size, camera=camera, **self._shown)

    def mosaic(self) -> NDArray[np.uint8]:
        """Return a mosaic of the cameras' images with crops, keypoints and estimated skeletons."""
        self.refuse_closed()
        return self.views.mosaic()

    def split_observation(self, observation: Observation) -> dict[str, Floats]:
        """Return the terms of an observation by name, in metres, seconds and radians.

        Args:
            observation: observation that `reset` or `step` returned; goals are also terms.
        """
        return observations.split(observation, self.simulation.layout)

    def _reward_factor(self, term: str) -> float:
        return self.simulation.reward_factors.get(term, 1.0)

    def _with_lasting(self, options: Mapping[str, Any] | ResetOptions | None) -> dict[str, Any]:
        """Return the options of a reset by name, merged with those of `set_options`."""
        return {**self._options, **self._next_options, **_named(options)}

    def close(self) -> None:
        """Release threads and graphics contexts."""
        self.views.close()
        self.simulation.close()
        self.closed = True


def _named(options: Mapping[str, Any] | ResetOptions | None) -> dict[str, Any]:
    """Return the options of a reset by name; reject the options of vector environments."""
    for name in options if isinstance(options, Mapping) else ():
        if name == "elapsed_steps":
            raise ConfigError(
                "elapsed_steps is an option of vector environments: a single environment does not "
                "know its time limit, which a wrapper of gymnasium enforces. Use "
                'options={"steps_left": n} (time limit minus elapsed steps), which is valid for '
                "both."
            )
    return named_options(options)


def _steps_left(options: Mapping[str, Any]) -> int:
    """Return the number of remaining steps that the options of a reset specify."""
    return check_integer('options["steps_left"]', options.get("steps_left", ENDLESS), 1, ENDLESS)


def check_render_mode(render_mode: str | None, valid: Sequence[str] = RENDER_MODES) -> None:
    """Raise `ConfigError` for a render mode that is not among the valid ones."""
    if render_mode == "human":
        raise ConfigError(
            "render_mode='human' requires a wrapper that shows a window: gymnasium.make(ID, "
            "render_mode='human') adds it (pip install 'hrc_env[view]'), or wrap an environment "
            "with render_mode='rgb_array' in gymnasium.wrappers.HumanRendering."
        )
    if render_mode is not None and render_mode not in valid:
        raise make_unknown_name_error("render_mode", render_mode, valid)


def parse_overlays(markers: object, overlay: object) -> dict[str, bool]:
    """Return the arguments of `Views.picture` for `render_markers` and `overlay`.

    Raises:
        ConfigError: a value is invalid.
    """
    if not isinstance(markers, bool):
        raise ConfigError(f"render_markers must be True or False, got {markers!r}.")
    if overlay is not None and overlay not in OVERLAYS:
        raise make_unknown_name_error("overlay", overlay, OVERLAYS)
    return {"markers": markers, "capsules": overlay == "capsules"}


class Spaces(NamedTuple):
    """Spaces of one environment."""

    observation: Any
    """Space of observations: a `Box`, or a `Dict` with goals or images."""
    action: Any
    """Space of actions, a `Box`."""


def make_spaces(simulation: Simulation) -> Spaces:
    """Return the spaces of one environment's observations and actions."""
    layout, separate_goal, images = simulation.layout, simulation.task.goal, simulation.images
    flat = Box(layout.low, layout.high, dtype=np.float32)
    actions = Box(-1.0, 1.0, (simulation.n_actions,), np.float32)
    vars(actions)["control"] = simulation.control  # saved in files of Stable-Baselines3
    if separate_goal is None and images is None:
        return Spaces(flat, actions)
    parts: dict[str, Any] = {observations.FLAT: flat}
    if separate_goal is not None:
        bound = separate_goal.bound
        goals = Box(-bound, bound, (separate_goal.size,), np.float32)
        parts |= {goal.ACHIEVED: goals, goal.DESIRED: goals}
    if images is not None:
        parts |= {name: Box(0, 255, images.shape, np.uint8) for name in images.names}
    return Spaces(Dict(parts), actions)
