"""What a task is: a record of settings, functions over a batch, terms and names."""

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from importlib import import_module
from typing import Any

import numpy as np

from hrc_env import observations, rewards
from hrc_env.belief import Belief
from hrc_env.core.errors import ConfigError, NoGoalError, check_shape, unknown
from hrc_env.core.records import Cue, Effects, Grounds, World
from hrc_env.core.registry import Registry
from hrc_env.core.things import NOTHING, Things
from hrc_env.core.typing import Bools, Floats, Ints, JointAngles, Points3
from hrc_env.observations import ObservationTerm
from hrc_env.rewards import RewardTerm
from hrc_env.tasks import BUILT_IN, EPISODE_STEPS
from hrc_env.tasks.goal import Goal, reward_terms
from hrc_env.tasks.spot import Spot

_ID = re.compile(r"[A-Za-z]\w*-v\d+")
Rngs = Sequence[np.random.Generator]


@dataclass(frozen=True, slots=True)
class Task:
    """A task. Rows of its state, a structured array or a dataclass of arrays, are environments.

    State, progress and view are of types of the task's own; `config` below is an instance of the
    type of that name. `rngs` holds a generator for every environment of the batch; what happens
    in environment b is drawn from its own only.
    """

    id: str
    """As `gymnasium.make` knows it, "HRCName-v0"."""
    says: str
    """A sentence: what the robot has to do."""
    config: type
    """A frozen dataclass of settings, every one with a default."""
    init: Callable[[int], Any]
    """(batch) -> state, to be filled by `reset`."""
    reset: Callable[[Any, Ints, Rngs, World, Any], None]
    """(state, ids, rngs, world, config): start environments `ids` anew; world is of these."""
    advance: Callable[[Any, Rngs, World, float, Any], Any]
    """(state, rngs, world, dt_s, config) -> progress: move all environments on by a step."""
    view: Callable[[Any, Ints, Any], Any]
    """(state, ids, config) -> what robots `ids` know of their task: `Belief.task`."""
    observations: tuple[ObservationTerm, ...]
    """The task's part of the observation; terms read `Belief.task`."""
    rewards: tuple[RewardTerm, ...]
    """The task's part of the reward; the weights that these terms are given are `config`."""
    info: Callable[[Any], Mapping[str, Floats]]
    """(state) -> "task/..." values (B,) of the episode so far, and "is_success", 0 or 1."""
    achieved: str
    """The name in `info` that counts what was achieved,"""
    failed: str
    """and what was not, of as many attempts."""
    markers: Callable[[Any], Points3]
    """(view) -> (B, M, 3) points that pictures show [m]."""
    starts: str = ""
    """For its page: how episodes begin,"""
    ends: str = ""
    """and what ends them before the time limit."""
    max_episode_steps: int = EPISODE_STEPS
    robot: str | None = None
    """Who does it unless somebody says otherwise; None: the default robot."""
    grips: bool = False
    """Whether that must be a robot with a hand."""
    drives: bool = False
    """Whether it must be one that drives; others must not."""
    scene: str = "lab"
    """Where, unless somebody says otherwise,"""
    n_workers: int | tuple[int, int] = 1
    """and beside how many workers."""
    viewpoint: str = "beside"
    """From where people look on: one of `scene.render.VIEWPOINTS`."""
    survey: Callable[[Grounds, Any], Any] = lambda grounds, config: None
    """(map, config) -> `World.place`: what the task makes of the place, once. It raises
    `ConfigError` where there is no room for the task."""
    start: Callable[[Rngs, Any, Any], JointAngles] | None = None
    """(rngs, place, config) -> (n, N) where robots begin; None: near their pose at rest."""
    things: Callable[[Any], Things] = lambda config: NOTHING
    """(config) -> what the task puts there."""
    spots: Callable[[Any], Sequence[Spot]] = lambda config: ()
    """(config) -> where tools have to get to, besides what is loose: arms that are too short are
    refused."""
    poses: Callable[[Any, Ints, Any], Floats] | None = None
    """(state, ids, config) -> (n, O, 7) where what is loose lies when `reset` is done: place in
    the world [m] and quaternion; None: as in the MJCF."""
    loads: Callable[[Any], Bools] | None = None
    """(state) -> (B, O) which objects count as part of the robot while it holds them: in cost,
    separations and belief; None: all."""
    cue: Callable[[Any], Cue] | None = None
    """(state) -> how far what workers wait for has come (`Job.waits`); None: they do not."""
    effects: Callable[[Any, Any], Effects] | None = None
    """(state, config) -> what is done to objects until the next step; None: nothing."""
    welcome: Callable[[Belief], Bools] | None = None
    """(belief) -> (B, W, S) which segments of estimated bodies may come to the robot's hand, as to
    take what it brings: built-in shields let them (`safety.guard`); None: none."""
    over: Callable[[Any], Bools] | None = None
    """(progress) -> (B,) whether there is nothing more to do; None: there always is."""
    defaults: Mapping[str, Any] = field(default_factory=dict)
    """Settings of `HRCConfig` that differ from its defaults, nested, as `config=` takes them."""

    goal: Goal | None = None
    """What is wanted, where it stands apart from the observation, as HER asks for."""

    @property
    def observation_terms(self) -> tuple[ObservationTerm, ...]:
        """All of the observation, in its order: the robot, the task, the workers."""
        slides = observations.SLIDE_TERMS if self.drives else ()
        return (*observations.ROBOT_TERMS, *slides, *self.observations, *observations.SHARED_TERMS)

    @property
    def own_rewards(self) -> tuple[RewardTerm, ...]:
        """The task's part of the reward, first the goal's if there is one."""
        return (*reward_terms(self.goal), *self.rewards)

    @property
    def reward_terms(self) -> tuple[RewardTerm, ...]:
        """All of the reward: the task's, and those that every task shares."""
        return (*self.own_rewards, *rewards.SHARED_TERMS)

    def counts(self, info: Mapping[str, Any]) -> dict[str, Any]:
        """What an info says of attempts, in words: {"goals reached": 3.0, "goals missed": 1.0}."""
        names = (self.achieved, self.failed)
        return {name.removeprefix("task/").replace("_", " "): info[name] for name in names}

    def __reduce__(self) -> tuple[Any, ...]:
        """A task that is known by its id is pickled as that."""
        if TASKS.get(self.id) is self:
            return task_called, (self.id,)
        return Task, tuple(getattr(self, each.name) for each in fields(self))


TASKS: Registry[Task] = Registry("task")
"""By id: those that have been asked for, and those that were registered."""


def task_called(task: str | Task) -> Task:
    """A task by its id, or itself."""
    if isinstance(task, Task):
        return task
    if task not in TASKS and task in BUILT_IN:
        TASKS[task] = import_module(BUILT_IN[task]).TASK
    if task not in TASKS:
        raise unknown("task", task, sorted({*BUILT_IN, *TASKS}))
    return TASKS[task]


def goal_of(task: Task) -> Goal:
    """The goal of a task, or `NoGoalError`."""
    if task.goal is None:
        known = [each for each in dict.fromkeys((*BUILT_IN, *TASKS)) if task_called(each).goal]
        raise NoGoalError(
            f"{task.id} has no goals apart from its observation, so that nothing can be judged by "
            f"another goal (compute_reward, HER). {', '.join(known)} have: choose one of these, or "
            "a learner without HER."
        )
    return task.goal


def check_task(task: Task) -> None:
    """Raise `ConfigError` for what is missing or wrong in a task.

    Shapes and values of its terms are checked when an environment of it is reset and steps.
    """
    if not isinstance(task, Task):
        raise ConfigError(f"A task must be a hrc_env.tasks.task.Task, got {type(task).__name__}.")
    if not isinstance(task.id, str) or not _ID.fullmatch(task.id):
        raise ConfigError(f"A task's id must be like 'Name-v0', got {task.id!r}.")
    for name in ("init", "reset", "advance", "view", "info", "markers"):
        if not callable(getattr(task, name)):
            raise ConfigError(f"{task.id}: {name} must be a function (see Task).")
    if not (isinstance(task.config, type) and is_dataclass(task.config)):
        raise ConfigError(f"{task.id}: config must be a dataclass, got {task.config!r}.")
    try:
        task.config()
    except TypeError as error:
        raise ConfigError(f"{task.id}: every field of config needs a default ({error}).") from error
    for terms in (task.observation_terms, task.reward_terms):
        name, times = Counter(term.name for term in terms).most_common(1)[0]
        if times > 1:
            raise ConfigError(f"{task.id}: there is a term {name!r} already; choose another name.")
    if task.goal is not None and not isinstance(task.goal, Goal):
        raise ConfigError(f"{task.id}: goal must be a Goal, got {type(task.goal).__name__}.")
    _check_state(task)


def _check_state(task: Task) -> None:
    state = task.init(2)
    if is_dataclass(state):
        parts = {f"state.{each.name}": getattr(state, each.name) for each in fields(state)}
    elif isinstance(state, np.ndarray):
        parts = {"state": state}
    else:
        raise ConfigError(
            f"{task.id}: init must give a structured array or a dataclass of arrays, "
            f"got {type(state).__name__}."
        )
    for name, part in parts.items():
        check_shape(f"{task.id}: {name}", np.shape(part)[:1], (2,), "a row an environment")
    info = task.info(state)
    for name in (task.achieved, task.failed, "is_success"):
        if name not in info:
            raise ConfigError(f"{task.id}: info must hold {name!r}, has {', '.join(info)}.")
    for name, value in info.items():
        if name != "is_success" and not name.startswith("task/"):
            raise ConfigError(f"{task.id}: names in info must begin with 'task/', got {name!r}.")
        check_shape(f"{task.id}: info[{name!r}]", np.shape(value), (2,), "a value an environment")
