"""The base class of tasks with its hooks, and the register of tasks by id."""

from collections.abc import Collection, Mapping, Sequence
from importlib import import_module
from inspect import getdoc, getmembers, isfunction
from typing import Any, ClassVar, Generic, TypeAlias, TypeGuard, TypeVar, cast

import numpy as np

from hrc_env import observations, rewards
from hrc_env.belief import Belief
from hrc_env.core.brought import check_kind
from hrc_env.core.errors import ConfigError, NoGoalError, make_unknown_name_error
from hrc_env.core.registry import Registry
from hrc_env.core.typing import Bools, Floats, Ints, JointAngles, Points3, Rngs
from hrc_env.geometry.reach import ReachTarget
from hrc_env.motion.starts import draw_near
from hrc_env.observations import ObservationTerm
from hrc_env.rewards import RewardTerm
from hrc_env.tasks import BUILT_IN, EPISODE_STEPS
from hrc_env.tasks.goal import Goal, reward_terms
from hrc_env.world import NOTHING, Effects, Grounds, TaskScene, WorkerSignal, World

ConfigT = TypeVar("ConfigT")
StateT = TypeVar("StateT")


class Task(Generic[ConfigT, StateT]):
    """A task of the robot: derive from this class, and register yours (`register_task`).

    The first paragraph of a subclass's docstring describes the task. A subclass must define `id`,
    `config_type`, `achieved`, `failed`, and the methods `make_state`, `reset`, `advance`, `view`
    and `info`; the other attributes (docs/reference/declarations.md) and methods have defaults.

    All methods work on a batch of environments. `state` is a structured array, or a dataclass of
    arrays, with a row for every environment; `ids` are the rows in question, all rows where a
    method has no such argument. `rngs` holds a generator for every environment of the batch, and
    events in environment b draw from `rngs[b]` only. Methods write into `state` in `reset`,
    `set_goal` and `advance`, and only read their other arguments. `world` is the true state of the
    robot, its hand and the objects. B is the number of environments in question, O of the task's
    loose objects, W of worker slots, N of robot joints.

    Args:
        config: settings of the task, of `config_type`; None for the defaults.
    """

    id: ClassVar[str] = ""
    """Id of the task in `gymnasium.make`, such as "HRCReach-v0"."""
    config_type: ClassVar[type[Any]]
    """Frozen dataclass of the task's settings, each with a default: `config={"task": {...}}`."""
    observations: ClassVar[tuple[ObservationTerm, ...]] = ()
    """The task's terms of the observation; their functions read `Belief.task`."""
    rewards: ClassVar[tuple[RewardTerm, ...]] = ()
    """The task's terms of the reward; their functions are given the task's settings as weights."""
    achieved: ClassVar[str] = ""
    """Name in `info` of the number of successful attempts; "success" in tables is their share."""
    failed: ClassVar[str] = ""
    """Name in `info` of the number of failed attempts."""
    starts: ClassVar[str] = ""
    """Description of the start of an episode, for the task's page."""
    ends: ClassVar[str] = ""
    """Description of the end of an episode before its time limit, for the task's page."""
    max_episode_steps: ClassVar[int] = EPISODE_STEPS
    """Time limit of an episode [control steps]."""
    robot: ClassVar[str | None] = None
    """Name of the task's default robot; None for the package's default robot."""
    needs_gripper: ClassVar[bool] = False
    """Whether the robot must have a gripper or suction cups."""
    needs_mobile_base: ClassVar[bool] = False
    """Whether the robot must be a mobile base; if false, it must not be one."""
    scene: ClassVar[str] = "lab"
    """Name of the default scene."""
    n_workers: ClassVar[int | tuple[int, int]] = 1
    """Default number of workers, or the fewest and the most of an episode."""
    viewpoint: ClassVar[str] = "beside"
    """Viewpoint of pictures, one of `scene.render.VIEWPOINTS`."""
    defaults: ClassVar[Mapping[str, Any]] = {}
    """Values of `HRCConfig` that differ from its defaults, nested as `config=` takes them."""
    goal: ClassVar[Goal | None] = None
    """Goal that is kept apart from the observation, as hindsight replay (HER) needs it; None for
    a task without."""

    config: ConfigT
    """Settings of the task."""

    def __new__(cls, *args: Any, **kwargs: Any) -> "Task[ConfigT, StateT]":
        """Refuse to make an instance of the base class.

        Raises:
            ConfigError: the class is `Task` itself.
        """
        if cls is Task:
            raise ConfigError(
                "Task is a base class. Write class MyTask(hrc_env.Task) with the attributes and "
                "methods that its documentation names, and register the class "
                "(docs/bring_your_own/task.md)."
            )
        return super().__new__(cls)

    def __init__(self, config: ConfigT | None = None) -> None:
        self.config = self.config_type() if config is None else config

    def make_state(self, batch: int) -> StateT:
        """Return the state of `batch` environments, to be filled by `reset`."""
        raise NotImplementedError

    def reset(self, state: StateT, ids: Ints, rngs: Rngs, world: World) -> None:
        """Begin new episodes of environments `ids`.

        Args:
            state: of all environments; rows `ids` are written.
            ids: (n,) the environments in question.
            rngs: a generator for every environment of the batch.
            world: of these environments only.
        """
        raise NotImplementedError

    def advance(self, state: StateT, rngs: Rngs, world: World, dt_s: float) -> Any:
        """Advance every environment by one control step.

        Args:
            state: (B,) written.
            rngs: B generators.
            world: the environments at the end of the step.
            dt_s: duration of the step [s].

        Returns:
            The results of the step, of a type of the task's own; reward terms and `is_terminal`
            are given them.
        """
        raise NotImplementedError

    def view(self, state: StateT, ids: Ints) -> Any:
        """Return the knowledge of the robots of environments `ids` about their task.

        It is `Belief.task`, of a type of the task's own.
        """
        raise NotImplementedError

    def info(self, state: StateT) -> Mapping[str, Floats]:
        """Return numbers (B,) about the episode until now, by name.

        Names begin with "task/", except for "is_success": 1 if the episode would be a success if it
        ended now, else 0.
        """
        raise NotImplementedError

    def is_terminal(self, step: Any) -> Bools | bool:
        """Return (B,) whether the task is over after a step; by default it never is.

        Args:
            step: results of the step, as `advance` returned them.
        """
        return False

    def markers(self, view: Any) -> Points3:
        """Return (B, M, 3) points that pictures show, of a `view` [m, world]; by default none."""
        return np.zeros((1, 0, 3))

    def survey(self, grounds: Grounds) -> Any:
        """Return the task's own map of a place, made once: `World.place`; by default None.

        Raises:
            ConfigError: the place has no room for the task.
        """
        return None

    def draw_start(
        self, rngs: Rngs, place: Any, home_q: JointAngles, spread_rad: Floats
    ) -> JointAngles:
        """Draw the joint angles (n, N) with which n robots start [rad, m of slides].

        Args:
            rngs: n generators, one for each robot.
            place: the map that `survey` returned.
            home_q: (N,) the robot's home pose; by default starts are near it.
            spread_rad: (N,) largest distance of a start from the home pose.
        """
        return draw_near(home_q, spread_rad, rngs)

    def make_scene(self) -> TaskScene:
        """Return the task's part of the scene; by default it is empty."""
        return NOTHING

    def reach_targets(self) -> Sequence[ReachTarget]:
        """Return places that the tool has to reach, besides loose objects; by default none.

        A robot that is too short for them is refused.
        """
        return ()

    def goal_targets(self, goal: Floats) -> Sequence[ReachTarget]:
        """Return the places that the tool has to reach for `reset(options={"goal": ...})`.

        A task that takes goals defines this method and `set_goal`. It is called before the episode
        starts, and a goal out of reach is refused.

        Raises:
            ConfigError: this is no goal; by default always, as the task takes none.
        """
        ids = dict.fromkeys((*BUILT_IN, *TASKS))
        known = [task for task in ids if takes_goals(find_task(task))]
        raise ConfigError(
            f"{self.id} takes no goal of a reset: leave options['goal'] out. {', '.join(known)} "
            "do; a task of yours does if it defines goal_targets and set_goal (hrc_env.Task)."
        )

    def set_goal(self, state: StateT, ids: Ints, goals: Floats, world: World) -> None:
        """Replace the goals that `reset` drew for environments `ids`.

        Args:
            state: of all environments; rows `ids` are written.
            ids: (n,) the environments in question.
            goals: (n, ...) the new goals, in the form that `goal_targets` takes.
            world: of these environments only.
        """
        raise NotImplementedError

    def object_poses(self, state: StateT, ids: Ints) -> Floats | None:
        """Return (n, O, 7) the poses of loose objects after `reset`.

        A pose is a position [m, world] and a quaternion (w, x, y, z). None, the default, stands for
        the poses of the MJCF.
        """
        return None

    def is_load(self, state: StateT) -> Bools | bool:
        """Return (B, O) whether each object counts as part of the robot while it holds it.

        It does so in cost, separation and belief; by default all objects do.
        """
        return True

    def signal(self, state: StateT) -> WorkerSignal | None:
        """Return the signal to workers that wait for the task (`Job.waits`).

        None, the default, stands for workers that do not wait.
        """
        return None

    def effects(self, state: StateT) -> Effects | None:
        """Return the task's forces and welds on loose objects in the next step; by default none."""
        return None

    def allowed_contact(self, belief: Belief) -> Bools | None:
        """Return (B, W, S) whether each segment of estimated bodies may touch the robot's hand.

        Built-in shields permit these contacts, so that workers can take an object from the robot.
        None, the default, stands for no segment.
        """
        return None

    @property
    def description(self) -> str:
        """The first paragraph of the class's docstring."""
        return " ".join((getdoc(type(self)) or "").split("\n\n")[0].split())

    @property
    def observation_terms(self) -> tuple[ObservationTerm, ...]:
        """All terms of the observation in their order: robot, task, workers."""
        slides = observations.SLIDE_TERMS if self.needs_mobile_base else ()
        return (*observations.ROBOT_TERMS, *slides, *self.observations, *observations.SHARED_TERMS)

    @property
    def own_rewards(self) -> tuple[RewardTerm, ...]:
        """The task's terms of the reward; the goal's is the first, if there is one."""
        return (*reward_terms(self.goal), *self.rewards)

    @property
    def reward_terms(self) -> tuple[RewardTerm, ...]:
        """All terms of the reward: the task's, and those that every task shares."""
        return (*self.own_rewards, *rewards.SHARED_TERMS)

    @property
    def can_end(self) -> bool:
        """Whether the task ends episodes before their time limit."""
        return overrides(type(self), "is_terminal")

    def counts(self, info: Mapping[str, Any]) -> dict[str, Any]:
        """Return the counts of attempts in an info by a readable name.

        An example is {"goals reached": 3.0, "goals missed": 1.0}.
        """
        names = (self.achieved, self.failed)
        return {name.removeprefix("task/").replace("_", " "): info[name] for name in names}


AnyTask: TypeAlias = Task[Any, Any]
"""A task with any settings and any state."""
TaskType: TypeAlias = type[AnyTask]
"""A class of tasks."""
TASKS: Registry[TaskType] = Registry("task")
"""Task classes by id: the registered ones, and those of the package that have been imported."""
HOOKS = [name for name, _ in getmembers(Task, isfunction) if name[0] != "_"]
"""Names of the methods that a subclass may define."""


def is_task_class(value: object) -> TypeGuard[TaskType]:
    """Return whether a value is a subclass of `Task`."""
    return isinstance(value, type) and issubclass(value, Task)


def overrides(task: TaskType, name: str) -> bool:
    """Return whether a class defines a method of `Task` of its own."""
    return getattr(task, name) is not getattr(Task, name)


def find_task(task: str | TaskType) -> TaskType:
    """Return the class of a task.

    Args:
        task: its id, or the class itself.

    Raises:
        ConfigError: there is no such task; the error names all tasks.
    """
    if is_task_class(task):
        return task
    if not isinstance(task, str):
        raise ConfigError(
            f"task must be an id or a subclass of hrc_env.Task, got {type(task).__name__}."
        )
    if task not in TASKS and task in BUILT_IN:
        module, name = BUILT_IN[task].path.split(":")
        TASKS[task] = cast(TaskType, getattr(import_module(module), name))
    if task not in TASKS:
        raise make_unknown_name_error("task", task, sorted({*BUILT_IN, *TASKS}))
    return TASKS[task]


def is_known(task: TaskType) -> bool:
    """Return whether a class is a task of the package or a registered one."""
    if task.id in BUILT_IN and find_task(task.id) is task:
        return True
    return TASKS.name_of(task) is not None


def with_rewards(task: str | TaskType, *terms: RewardTerm, id: str) -> TaskType:
    """Return a copy of a task with additional terms of the reward.

    It is a subclass, as you may write one yourself: `class Mine(hrc_env.find_task(ID))` with an
    `id` and `rewards = (*hrc_env.find_task(ID).rewards, term)`. Terms about people read the belief,
    `Belief.estimate` and `Belief.separation`; they are given the task's settings as weights, and
    their values stand in `info` as "reward/NAME". `register_task` makes the id known.

    Args:
        task: id or class of the task to be copied.
        terms: additional terms; each returns (B,) a number for every environment.
        id: id of the new task, such as "MyReach-v0".

    Raises:
        ConfigError: there is no such task, no term, one that is no `RewardTerm`, or one whose name
            the task or all tasks have.
    """
    base = find_task(task)
    if not terms:
        raise ConfigError(f"Give at least one RewardTerm to add to {base.id}, got none.")
    names = [term.name for term in base().reward_terms]
    for term in terms:
        check_kind("A reward's term", term, RewardTerm)
        if term.name in names:
            raise ConfigError(
                f"{base.id} has a term {term.name!r} already; choose another name than "
                f"{', '.join(map(repr, names))}."
            )
        names.append(term.name)
    added = {"id": id, "rewards": (*base.rewards, *terms), "__doc__": base.__doc__}
    return cast(TaskType, type(base.__name__, (base,), added))


def ancestor_of(task: str, ids: Collection[str]) -> str:
    """Return the nearest task among `ids` with agents that also act in a task, or its own id.

    It is the task itself, or one that it derives from with the same observations and goals, as
    `with_rewards` makes them.

    Args:
        task: id of the task in question.
        ids: ids of the tasks that have agents.
    """
    if task not in (*BUILT_IN, *TASKS):  # a class that is not registered
        return task
    kind = find_task(task)
    for base in kind.__mro__:
        if not is_task_class(base) or "id" not in vars(base):
            continue
        is_alike = base.observations == kind.observations and base.goal == kind.goal
        if base.id in ids and is_alike and base.needs_gripper == kind.needs_gripper:
            return base.id
    return task


def takes_goals(task: TaskType) -> bool:
    """Return whether a reset can give a task its goal."""
    return overrides(task, "set_goal")


def require_goal(task: AnyTask) -> Goal:
    """Return the goal of a task, or raise `NoGoalError` if it has none."""
    if task.goal is None:
        known = [each for each in dict.fromkeys((*BUILT_IN, *TASKS)) if find_task(each).goal]
        raise NoGoalError(
            f"{task.id} has no goals apart from its observation, so that nothing can be judged by "
            f"another goal (compute_reward, HER). {', '.join(known)} have: choose one of these, or "
            "a learner without HER."
        )
    return task.goal
