"""The Gymnasium environment: a `Simulation` of one.

import gymnasium, hrc_env
env = gymnasium.make("HRCReach-v0", perception="keypoints")
"""

import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from inspect import Parameter
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Dict
from numpy.typing import NDArray

from hrc_env import observations, rewards
from hrc_env.control import check_action
from hrc_env.core.batching import Stateful, one
from hrc_env.core.errors import ConfigError, NoAttributeError, unknown, whole
from hrc_env.core.infos import Words, worded
from hrc_env.core.registry import share
from hrc_env.core.typing import Floats
from hrc_env.env_config import signature_of_env
from hrc_env.geometry.camera_config import CameraConfig
from hrc_env.infos import words_of
from hrc_env.perception.faults.fault import FaultConfig
from hrc_env.registration import HasSpec
from hrc_env.rehearsal import rehearse
from hrc_env.render.marks import OVERLAYS
from hrc_env.render.views import CameraChoice, Views, picture_size
from hrc_env.reset_options import ResetOptions, lasting_options, named_options
from hrc_env.rewards import RewardConfig
from hrc_env.settings import Settings, settle
from hrc_env.simulation import Simulation
from hrc_env.step_result import Observation
from hrc_env.tasks import DEFAULT, goal
from hrc_env.tasks.task import TaskType, goal_of

RENDER_MODES = ("rgb_array", "depth_array")
ENDLESS = 2**62
"""Steps that are left where nobody said otherwise; time limits are gymnasium's `TimeLimit`."""


class EnvBase(HasSpec, Stateful):
    """What a single and a vector environment have in common: states, pictures' form, `spec`."""

    closed = False
    PICTURES: ClassVar[tuple[str, ...]] = RENDER_MODES
    """The render modes that are taken."""

    def _open(self, settings: Settings) -> None:
        """Keep settings, and a form of pictures once it is known to be one."""
        asked = settings.asked
        check_render_mode(asked.render_mode, self.PICTURES)
        share()
        self._size = picture_size(asked.width, asked.height)
        self._shown = shown_beside(asked.render_markers, asked.overlay)
        if asked.overlay is not None and not str(asked.render_mode).startswith("rgb_array"):
            warnings.warn(
                f"overlay={asked.overlay!r} is drawn in pictures of render_mode='rgb_array' only, "
                f"got render_mode={asked.render_mode!r}.", stacklevel=4,
            )  # fmt: skip
        self.render_mode, self.config, self._task = (
            asked.render_mode,
            settings.config,
            settings.task,
        )
        fps = round(1 / self.config.ctrl_dt)
        self.metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": fps}

    @property
    def compute_reward(self) -> Callable[[Any, Any, Any], Any]:
        """(achieved_goal, desired_goal, info) -> reward: of one pair (n,) and the info of its step,
        or of many (B, n) with a list of infos, or a vector's; see `hrc_env.tasks.goal.judged`.

        With the info of a step it is the step's reward, bit for bit: the goal's term and those that
        every task shares. Of infos that do not hold these, as HER's own, it is the goal's alone.

        Raises:
            NoGoalError: the task has no goals apart from its observation; it is an `AttributeError`
                too, so that `hasattr` tells who has.
        """
        apart, others = goal_of(self._task), [term.name for term in rewards.SHARED_TERMS]
        others = [term.name for term in self._task.rewards] + others
        factor = self._reward_factor(goal.TERM)
        return partial(goal.judged, apart, config=self.config.task, others=others, factor=factor)

    @property
    def compute_terminated(self) -> Callable[[Any, Any, Any], Any]:
        """(achieved_goal, desired_goal, info) -> whether the episode ended in the step of that
        info, or of many as `compute_reward` takes them.

        No goal ends an episode: a contact does, if `config.cost.contact_terminates`.

        Raises:
            NoGoalError: as of `compute_reward`.
            NoAttributeError: the task ends episodes itself, by `Task.is_terminal`.
        """
        apart = goal_of(self._task)
        if self._task.can_end:
            raise NoAttributeError(
                f"{self._task.id} ends episodes itself (Task.is_terminal), which does not follow "
                "from goals and infos: read `terminated` of `step`."
            )
        entries = ("cost_contact",) if self.config.cost.contact_terminates else ()
        return partial(goal.ended, apart, entries=entries)

    @property
    def compute_truncated(self) -> Callable[[Any, Any, Any], Any]:
        """(achieved_goal, desired_goal, info) -> False, for many (B,): what cuts an episode off is
        its time limit.

        Raises:
            NoGoalError: as of `compute_reward`.
        """
        return partial(goal.ended, goal_of(self._task))

    def _reward_factor(self, term: str) -> float:
        """The factor on a term of the reward (`set_reward`)."""
        raise NotImplementedError

    def refuse_closed(self) -> None:
        """Raise a `ConfigError` once the environment is closed."""
        if self.closed:
            raise ConfigError("This environment is closed; make a new one.")


class HRCEnv(  # type: ignore[override]  # a property is `spec`, too
    EnvBase, gymnasium.Env[Observation, NDArray[np.float32]]
):
    """A robot works beside people whom it knows through cameras only.

    Args:
        task: what it has to do, an id or a subclass of `Task`.
        arguments: the other fields of `EnvConfig`, which documents them all.

    Raises:
        ConfigError: a name, index or value that is not valid, with those that are.
    """

    CHANGES = (
        "simulation", "_np_random", "_np_random_seed", "_begun", "_steps_left", "_options",
        "_next_options",
    )  # fmt: skip
    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 25}  # noqa: RUF012

    __signature__ = signature_of_env(
        Parameter("task", Parameter.POSITIONAL_OR_KEYWORD, default=DEFAULT)
    )

    def __init__(self, task: str | TaskType = DEFAULT, **arguments: Any) -> None:
        settings = settle(task=task, **arguments)
        self._open(settings)
        rehearse(settings)
        self.simulation = Simulation(1, settings)
        self.views = Views(self.simulation)
        """Pictures of the scene for people, at any time and of any size."""
        self.observation_space, self.action_space = spaces(self.simulation)
        self._begun = False
        self._steps_left = ENDLESS
        self._options: dict[str, Any] = {}
        self._next_options: dict[str, Any] = {}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: of its random stream; with None the stream goes on.
            options: what of the episode is fixed, in place of what `set_options` says: fields of
                `ResetOptions` by name, such as {"goal": (0.4, 0.3, 1.1), "n_workers": 0}.

        Raises:
            ConfigError: an option that cannot be; nothing has begun then.
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
        """Act for one control step (1 / 25 s); the walk itself is `Simulation.step`."""
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
            self._steps_left <= 0,  # the time limit itself is gymnasium's TimeLimit
            result.info_of(0),
        )

    def words(self, info: Mapping[str, Any]) -> Words:
        """Return in words what an info says of workers, contacts and cameras: `infos.worded`."""
        return worded(info, words_of(self.body_names))

    @property
    def body_names(self) -> tuple[str, ...]:
        """The bodies that `worker_N/body` of infos counts."""
        return self.simulation.bodies.names

    @property
    def rig(self) -> tuple[CameraConfig, ...]:
        """The cameras of this episode, as the estimator knows them."""
        return self.simulation.rig_of(0)

    @property
    def faults(self) -> tuple[FaultConfig, ...]:
        """The faults of this episode's cameras, each with the amount that was drawn; no robot knows
        them."""
        return self.simulation.cameras.faults_of(0)

    @property
    def options(self) -> dict[str, Any]:
        """Options of `set_options`, by name."""
        return dict(self._options)

    @options.setter
    def options(self, options: Mapping[str, Any] | ResetOptions | None) -> None:
        self.set_options(options)

    @property
    def next_options(self) -> dict[str, Any]:
        """Options of the next reset alone, besides those it is given; vector environments of
        processes set them."""
        return dict(self._next_options)

    @next_options.setter
    def next_options(self, options: Mapping[str, Any] | ResetOptions | None) -> None:
        self._next_options = named_options(options)

    def set_options(self, options: Mapping[str, Any] | ResetOptions | None = None) -> None:
        """Fix something of all episodes to come, until this is called again: a curriculum.

        `get_state` holds it, so that a state goes on with the same episodes.

        Args:
            options: as of `reset`, in place of those before; what `reset` is given goes before
                them. None: nothing is fixed any more.

        Raises:
            ConfigError: an option that cannot be, or is of one reset.
        """
        given = lasting_options(options)
        self.simulation.fix(given)
        self._options = given

    def check_options(
        self, options: Mapping[str, Any] | ResetOptions | None = None, lasting: bool = False
    ) -> None:
        """Raise the error that `reset` with these options would raise; nothing begins.

        Args:
            options: as of `reset`.
            lasting: they are meant for `set_options`, in place of those before.

        Raises:
            ConfigError: an option that cannot be.
        """
        with warnings.catch_warnings():  # the reset itself warns
            warnings.simplefilter("ignore")
            if lasting:
                self.simulation.fix(lasting_options({**self._next_options, **_named(options)}))
            else:
                given = self._with_lasting(options)
                _steps_left(given)
                self.simulation.fix(given)

    def attempt(self, method: str, *args: Any, **kwargs: Any) -> Any:
        """Call a method, and return its `ConfigError` where it raises one.

        A process that raises is closed by its vector environment; this lets the error reach the
        user.

        Args:
            method: its name.
            args: of the method.
            kwargs: of the method.

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
        """Weigh the reward's terms so from the next step on.

        Args:
            weights: of the terms that all tasks share; None: as they are.
            factors: on any terms by name, also the task's own: {"goal": 2.0}; terms that are not
                named have the factor 1. None: as they are.

        Raises:
            ConfigError: an unknown term, or a factor that is no finite number.
        """
        self.simulation.set_reward(weights, factors)

    def render(self, camera: CameraChoice = None) -> NDArray[Any] | None:  # type: ignore[override]
        """Return a picture of the scene, (H, W, 3) of uint8 or (H, W) metres of depth.

        Args:
            camera: through which: an index or a name of the rig's, a viewpoint such as "room" or
                "top", or a `CameraConfig`; None: from where the task is seen best.

        Raises:
            ConfigError: there is no such camera.
        """
        self.refuse_closed()
        if self.render_mode is None:
            return None
        is_depth = self.render_mode == "depth_array"
        return self.views.picture(is_depth, size=self._size, camera=camera, **self._shown)

    def mosaic(self) -> NDArray[np.uint8]:
        """Return the images of the cameras with crops, keypoints and the estimated skeleton."""
        self.refuse_closed()
        return self.views.mosaic()

    def split_observation(self, observation: Observation) -> dict[str, Floats]:
        """Return an observation's terms by name, in metres, seconds and radians, goals too."""
        return observations.split(observation, self.simulation.layout)

    def _reward_factor(self, term: str) -> float:
        return self.simulation.reward_factors.get(term, 1.0)

    def _with_lasting(self, options: Mapping[str, Any] | ResetOptions | None) -> dict[str, Any]:
        """Options of a reset by name, with those that were set before."""
        return {**self._options, **self._next_options, **_named(options)}

    def close(self) -> None:
        """Release threads and graphics contexts."""
        self.views.close()
        self.simulation.close()
        self.closed = True


def _named(options: Mapping[str, Any] | ResetOptions | None) -> dict[str, Any]:
    """Options of one environment's reset by name; `ConfigError` for those of a vector."""
    for name in options if isinstance(options, Mapping) else ():
        if name == "elapsed_steps":
            raise ConfigError(
                "elapsed_steps is an option of vector environments: one environment does not know "
                'its time limit, which is a wrapper of gymnasium. Say options={"steps_left": n} '
                "(time limit minus elapsed steps), which both take."
            )
    return named_options(options)


def _steps_left(options: Mapping[str, Any]) -> int:
    """What the options of a reset say."""
    return whole('options["steps_left"]', options.get("steps_left", ENDLESS), 1, ENDLESS)


def check_render_mode(render_mode: str | None, valid: Sequence[str] = RENDER_MODES) -> None:
    """Raise a `ConfigError` for a render mode that is not `valid`, with those that are."""
    if render_mode == "human":
        raise ConfigError(
            "render_mode='human' is a window round an environment that draws: gymnasium.make("
            "ID, render_mode='human') puts it there (pip install 'hrc_env[view]'), or "
            "gymnasium.wrappers.HumanRendering does, round one with render_mode='rgb_array'."
        )
    if render_mode is not None and render_mode not in valid:
        raise unknown("render_mode", render_mode, valid)


def shown_beside(markers: Any, overlay: Any) -> dict[str, bool]:
    """Return the arguments of `Views.picture` for `render_markers` and `overlay`.

    Raises:
        ConfigError: values that they cannot have.
    """
    if not isinstance(markers, bool):
        raise ConfigError(f"render_markers must be True or False, got {markers!r}.")
    if overlay is not None and overlay not in OVERLAYS:
        raise unknown("overlay", overlay, OVERLAYS)
    return {"markers": markers, "capsules": overlay == "capsules"}


def spaces(simulation: Simulation) -> tuple[Any, Any]:
    """The spaces of one environment's observations, a `Box` or with goals or images a `Dict`, and
    actions, a `Box`."""
    where, apart, images = simulation.layout, simulation.task.goal, simulation.images
    seen = Box(where.low, where.high, dtype=np.float32)
    actions = Box(-1.0, 1.0, (simulation.n_actions,), np.float32)
    vars(actions)["control"] = simulation.control  # files of Stable-Baselines3 hold it, too
    if apart is None and images is None:
        return seen, actions
    parts: dict[str, Any] = {observations.FLAT: seen}
    if apart is not None:
        goals = Box(-apart.bound, apart.bound, (apart.size,), np.float32)
        parts |= {goal.ACHIEVED: goals, goal.DESIRED: goals}
    if images is not None:
        parts |= {name: Box(0, 255, images.shape, np.uint8) for name in images.names}
    return Dict(parts), actions
