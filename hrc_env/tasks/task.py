"""The base class of tasks with its hooks, and the registry of tasks by ID."""

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
    """Base class of the robot's tasks; custom tasks derive from it (see `register_task`).

    The first paragraph of a subclass's docstring describes the task. A subclass must define `id`,
    `config_type`, `achieved`, `failed`, and the methods `make_state`, `reset`, `advance`, `view`
    and `info`; the other attributes (docs/reference/declarations.md) and methods have defaults.

    All methods work on a batch of environments. `state` is a structured array, or a dataclass of
    arrays, with a row for every environment; `ids` are the indices of the rows to process. A method
    without `ids` processes all rows. `rngs` holds a random generator for every environment of the
    batch, and environment b uses only `rngs[b]`. `reset`, `set_goal` and `advance` write into
    `state`; all other arguments are read-only. `world` is the true state of the robot, its hand and
    the objects. In shapes, B is the number of processed environments, O that of the task's loose
    objects, W that of worker slots, and N that of robot joints.

    Args:
        config: settings of the task, of `config_type`; None for the defaults.
    """

    id: ClassVar[str] = ""
    """ID of the task in `gymnasium.make`, such as "HRCReach-v0"."""
    config_type: ClassVar[type[Any]]
    """Frozen dataclass of the task's settings, all with defaults; set by `config={"task":
    {...}}`."""
    observations: ClassVar[tuple[ObservationTerm, ...]] = ()
    """Observation terms of the task; their functions can read `Belief.task`."""
    rewards: ClassVar[tuple[RewardTerm, ...]] = ()
    """Reward terms of the task; their functions receive the task's settings as weights."""
    achieved: ClassVar[str] = ""
    """Name in `info` of the number of successful attempts; "success" in tables is their fraction of
    all attempts."""
    failed: ClassVar[str] = ""
    """Name in `info` of the number of failed attempts."""
    starts: ClassVar[str] = ""
    """Description of the start of an episode, for the task's documentation page."""
    ends: ClassVar[str] = ""
    """Description of the conditions that end an episode before its time limit, for the task's
    documentation page."""
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
    """Default number of workers, or a range (min, max) from which it is sampled for every
    episode."""
    viewpoint: ClassVar[str] = "beside"
    """Name of the viewpoint of pictures, one of `scene.render.VIEWPOINTS`."""
    defaults: ClassVar[Mapping[str, Any]] = {}
    """Settings that differ from the defaults of `HRCConfig`, as a nested mapping like `config=`."""
    goal: ClassVar[Goal | None] = None
    """Goal that is separate from the observation, as required by hindsight experience replay (HER);
    None for a task without such a goal."""

    config: ConfigT
    """Settings of the task."""

    def __new__(cls, *args: Any, **kwargs: Any) -> "Task[ConfigT, StateT]":
        """Raise an error if an instance of the base class itself is made.

        Raises:
            ConfigError: the class is `Task` itself.
        """
        if cls is Task:
            raise ConfigError(
                "Task is a base class. Define a subclass, class MyTask(hrc_env.Task), with the "
                "attributes and methods in its documentation, and register it "
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
            state: state of all environments; rows `ids` are written.
            ids: (n,) indices of the environments.
            rngs: random generators, one for every environment of the batch.
            world: true state of the environments `ids`.
        """
        raise NotImplementedError

    def advance(self, state: StateT, rngs: Rngs, world: World, dt_s: float) -> Any:
        """Advance every environment by one control step.

        Args:
            state: (B,) state, which is updated.
            rngs: B random generators.
            world: true state of the environments at the end of the step.
            dt_s: duration of the step [s].

        Returns:
            The result of the step, of any type, which is passed to reward terms and `is_terminal`.
        """
        raise NotImplementedError

    def view(self, state: StateT, ids: Ints) -> Any:
        """Return the robots' knowledge about their task in environments `ids`.

        It is available as `Belief.task`, and may be of any type.
        """
        raise NotImplementedError

    def info(self, state: StateT) -> Mapping[str, Floats]:
        """Return values (B,) about the current episode by name.

        Names begin with "task/", except for "is_success", which is 1 if the episode would be a
        success if it ended now, and otherwise 0.
        """
        raise NotImplementedError

    def is_terminal(self, step: Any) -> Bools | bool:
        """Return a mask (B,) of environments in which the task ends the episode; none by default.

        Args:
            step: result of the step, as returned by `advance`.
        """
        return False

    def markers(self, view: Any) -> Points3:
        """Return points (B, M, 3) of a `view` to show in pictures [m, world]; none by default."""
        return np.zeros((1, 0, 3))

    def survey(self, grounds: Grounds) -> Any:
        """Compute the task's map of the scene, which becomes `World.place`; None by default.

        The method is called once, when the environment is made.

        Raises:
            ConfigError: the scene lacks the space for the task.
        """
        return None

    def draw_start(
        self, rngs: Rngs, place: Any, home_q: JointAngles, spread_rad: Floats
    ) -> JointAngles:
        """Return sampled initial joint positions (n, N) of n robots [rad, or m for slides].

        By default, they are near the home pose.

        Args:
            rngs: n random generators, one for each robot.
            place: map that `survey` returned.
            home_q: (N,) home pose of the robot.
            spread_rad: (N,) largest deviation of each joint from the home pose.
        """
        return draw_near(home_q, spread_rad, rngs)

    def make_scene(self) -> TaskScene:
        """Return the task's part of the scene; empty by default."""
        return NOTHING

    def reach_targets(self) -> Sequence[ReachTarget]:
        """Return the positions that the tool must reach, besides loose objects; none by default.

        A robot that cannot reach all of them is rejected.
        """
        return ()

    def goal_targets(self, goal: Floats) -> Sequence[ReachTarget]:
        """Return the targets that the tool has to reach for `reset(options={"goal": ...})`.

        A task that accepts goals defines this method and `set_goal`. The method is called before
        the episode starts, and a goal out of reach is rejected.

        Raises:
            ConfigError: the goal is invalid; always raised by default, because the task accepts no
                goals.
        """
        ids = dict.fromkeys((*BUILT_IN, *TASKS))
        known = [task for task in ids if takes_goals(find_task(task))]
        raise ConfigError(
            f"{self.id} does not support the goal of a reset: leave out options['goal']. "
            f"{', '.join(known)} support it; a custom task does if it defines goal_targets and "
            "set_goal (hrc_env.Task)."
        )

    def set_goal(self, state: StateT, ids: Ints, goals: Floats, world: World) -> None:
        """Replace the goals that `reset` sampled for environments `ids`.

        Args:
            state: state of all environments; rows `ids` are written.
            ids: (n,) indices of the environments.
            goals: (n, ...) new goals, in the form that `goal_targets` accepts.
            world: true state of the environments `ids`.
        """
        raise NotImplementedError

    def object_poses(self, state: StateT, ids: Ints) -> Floats | None:
        """Return the poses (n, O, 7) of loose objects after `reset`.

        A pose is a position [m, world] and a quaternion (w, x, y, z). The default, None, keeps the
        poses of the MJCF.
        """
        return None

    def is_load(self, state: StateT) -> Bools | bool:
        """Return a mask (B, O) of the objects that count as part of the robot while they are held.

        Their surfaces are included in cost, separation and belief. By default, all objects count.
        """
        return True

    def signal(self, state: StateT) -> WorkerSignal | None:
        """Return the signal to workers that wait for the task (`Job.waits`).

        The default, None, is for tasks for which no workers wait.
        """
        return None

    def effects(self, state: StateT) -> Effects | None:
        """Return the task's forces and welds on loose objects in the next step; none by default."""
        return None

    def allowed_contact(self, belief: Belief) -> Bools | None:
        """Return a mask (B, W, S) of the estimated body segments that may touch the robot's hand.

        Built-in shields permit these contacts, so that workers can take an object from the robot.
        The default, None, permits no contact.
        """
        return None

    @property
    def description(self) -> str:
        """Description of the task: the first paragraph of the class's docstring."""
        return " ".join((getdoc(type(self)) or "").split("\n\n")[0].split())

    @property
    def observation_terms(self) -> tuple[ObservationTerm, ...]:
        """All terms of the observation, in the order robot, task, workers."""
        slides = observations.SLIDE_TERMS if self.needs_mobile_base else ()
        return (*observations.ROBOT_TERMS, *slides, *self.observations, *observations.SHARED_TERMS)

    @property
    def own_rewards(self) -> tuple[RewardTerm, ...]:
        """Reward terms of the task, beginning with the goal's term if there is a separate goal."""
        return (*reward_terms(self.goal), *self.rewards)

    @property
    def reward_terms(self) -> tuple[RewardTerm, ...]:
        """All terms of the reward: those of the task, then those that all tasks share."""
        return (*self.own_rewards, *rewards.SHARED_TERMS)

    @property
    def can_end(self) -> bool:
        """Whether the task may end episodes before their time limit."""
        return overrides(type(self), "is_terminal")

    def counts(self, info: Mapping[str, Any]) -> dict[str, Any]:
        """Return the numbers of attempts in an info, by human-readable name.

        An example is {"goals reached": 3.0, "goals missed": 1.0}.
        """
        names = (self.achieved, self.failed)
        return {name.removeprefix("task/").replace("_", " "): info[name] for name in names}


AnyTask: TypeAlias = Task[Any, Any]
"""Type of a task with any settings and any state."""
TaskType: TypeAlias = type[AnyTask]
"""Type of a task class."""
TASKS: Registry[TaskType] = Registry("task")
"""Task classes by ID: registered ones, and built-in ones that have been imported."""
HOOKS = [name for name, _ in getmembers(Task, isfunction) if name[0] != "_"]
"""Names of the methods that a subclass may override."""


def is_task_class(value: object) -> TypeGuard[TaskType]:
    """Return whether a value is a subclass of `Task`."""
    return isinstance(value, type) and issubclass(value, Task)


def overrides(task: TaskType, name: str) -> bool:
    """Return whether a class overrides a method of `Task`."""
    return getattr(task, name) is not getattr(Task, name)


def find_task(task: str | TaskType) -> TaskType:
    """Return the class of a task.

    Args:
        task: ID of the task, or its class.

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
    """Return whether a class is a built-in or a registered task."""
    if task.id in BUILT_IN and find_task(task.id) is task:
        return True
    return TASKS.name_of(task) is not None


def with_rewards(task: str | TaskType, *terms: RewardTerm, id: str) -> TaskType:
    """Return a copy of a task with additional terms of the reward.

    The copy is equivalent to a subclass `class Mine(hrc_env.find_task(ID))` with an `id` and
    `rewards = (*hrc_env.find_task(ID).rewards, term)`. Terms about people read `Belief.estimate`
    and `Belief.separation`; they receive the task's settings as weights, and `info` contains their
    values as "reward/NAME". Call `register_task` to make an environment of the copy by its ID.

    Args:
        task: ID or class of the task to copy.
        terms: additional terms; each returns an array (B,) with a value for every environment.
        id: ID of the new task, such as "MyReach-v0".

    Raises:
        ConfigError: the task is unknown, no term is given, a term is not a `RewardTerm`, or its
            name is already used by a term of the task.
    """
    base = find_task(task)
    if not terms:
        raise ConfigError(f"Pass at least one RewardTerm to add to {base.id}, got none.")
    names = [term.name for term in base().reward_terms]
    for term in terms:
        check_kind("A reward term", term, RewardTerm)
        if term.name in names:
            raise ConfigError(
                f"{base.id} already has a term {term.name!r}; choose a name other than "
                f"{', '.join(map(repr, names))}."
            )
        names.append(term.name)
    added = {"id": id, "rewards": (*base.rewards, *terms), "__doc__": base.__doc__}
    return cast(TaskType, type(base.__name__, (base,), added))


def ancestor_of(task: str, ids: Collection[str]) -> str:
    """Return the ID of a task with agents that can also act in a given task.

    It is the task itself or its closest base class among `ids` with the same observations and
    goals, such as the original of a task made by `with_rewards`. If `ids` contains neither, return
    the ID of the task itself.

    Args:
        task: ID of the task.
        ids: IDs of the tasks that have agents.
    """
    if task not in (*BUILT_IN, *TASKS):  # class is not registered
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
    """Return whether the goal of a task can be set by options of a reset."""
    return overrides(task, "set_goal")


def require_goal(task: AnyTask) -> Goal:
    """Return the goal of a task, or raise `NoGoalError` if it has none."""
    if task.goal is None:
        known = [each for each in dict.fromkeys((*BUILT_IN, *TASKS)) if find_task(each).goal]
        raise NoGoalError(
            f"{task.id} has no goals separate from its observation, so that rewards cannot be "
            f"computed for other goals (compute_reward, HER). Choose {', '.join(known)}, which "
            "have such goals, or a learner without HER."
        )
    return task.goal
