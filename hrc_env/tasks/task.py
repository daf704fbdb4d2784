"""Tasks: the base class with its hooks, and the tasks that are known by an id."""

from collections.abc import Collection, Mapping, Sequence
from importlib import import_module
from inspect import getdoc
from typing import Any, ClassVar, Generic, TypeVar, cast

import numpy as np

from hrc_env import observations, rewards
from hrc_env.belief import Belief
from hrc_env.core.brought import described
from hrc_env.core.errors import ConfigError, NoGoalError, unknown
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
    """What a robot is to achieve: derive from it, and register the class (`register_task`).

    The first paragraph of a subclass's docstring describes the task. A subclass must define `id`,
    `config_type`, `achieved`, `failed`, and the methods `make_state`, `reset`, `advance`, `view`
    and `info`; the other attributes (docs/reference/declarations.md) and methods have defaults.

    All methods work on a batch of environments. `state` is a structured array, or a dataclass of
    arrays, with a row for every environment; `ids` are the rows in question, all rows where a
    method has no such argument. `rngs` holds a generator for every environment of the batch, and
    events in environment b draw from `rngs[b]` only. Methods write into `state` in `reset`,
    `set_goal` and `advance`, and only read all else. `world` is the robot, its hand and the objects
    as they are. B is the number of environments in question,
    O of the task's loose objects, W of worker slots, N of robot joints.

    Args:
        config: the task's settings, of `config_type`; None: its defaults.
    """

    id: ClassVar[str] = ""
    """Its name in `gymnasium.make`, such as "HRCReach-v0"."""
    config_type: ClassVar[type[Any]]
    """A frozen dataclass of settings, each with a default: `config={"task": {...}}`."""
    observations: ClassVar[tuple[ObservationTerm, ...]] = ()
    """The task's terms of the observation; their functions read `Belief.task`."""
    rewards: ClassVar[tuple[RewardTerm, ...]] = ()
    """The task's terms of the reward; their functions are given the task's settings as weights."""
    achieved: ClassVar[str] = ""
    """The name in `info` that counts successful attempts; "success" in tables is their share."""
    failed: ClassVar[str] = ""
    """The name in `info` that counts failed attempts."""
    starts: ClassVar[str] = ""
    """How episodes begin, for the task's page."""
    ends: ClassVar[str] = ""
    """How episodes end before the time limit, for the task's page."""
    max_episode_steps: ClassVar[int] = EPISODE_STEPS
    """Time limit of an episode [control steps]."""
    robot: ClassVar[str | None] = None
    """Name of the robot that does it by default; None: the package's default robot."""
    needs_gripper: ClassVar[bool] = False
    """Whether the robot must have a hand or suction cups."""
    needs_mobile_base: ClassVar[bool] = False
    """Whether the robot must drive; where it is false the robot must not."""
    scene: ClassVar[str] = "lab"
    """Name of the scene by default."""
    n_workers: ClassVar[int | tuple[int, int]] = 1
    """Number of workers by default, or the fewest and the most of an episode."""
    viewpoint: ClassVar[str] = "beside"
    """From where pictures show it: one of `scene.render.VIEWPOINTS`."""
    defaults: ClassVar[Mapping[str, Any]] = {}
    """Values of `HRCConfig` that differ from its defaults, nested as `config=` takes them."""
    goal: ClassVar[Goal | None] = None
    """The goal, if it stands apart from the observation as hindsight replay (HER) needs it."""

    config: ConfigT
    """The task's settings."""

    def __new__(cls, *args: Any, **kwargs: Any) -> "Task[ConfigT, StateT]":
        if cls is Task:
            raise ConfigError(
                "Task is a base class. Write class MyTask(hrc_env.Task) with the attributes and "
                "methods that its documentation names, and register the class "
                "(docs/bring_your_own.md)."
            )
        return super().__new__(cls)

    def __init__(self, config: ConfigT | None = None) -> None:
        self.config = self.config_type() if config is None else config

    def make_state(self, batch: int) -> StateT:
        """Return the state of `batch` environments, to be filled by `reset`."""
        raise NotImplementedError

    def reset(self, state: StateT, ids: Ints, rngs: Rngs, world: World) -> None:
        """Start environments `ids` anew: write their rows of `state`; `world` is of these only."""
        raise NotImplementedError

    def advance(self, state: StateT, rngs: Rngs, world: World, dt_s: float) -> Any:
        """Advance every environment by one control step of dt_s [s].

        Returns:
            What the step brought, of a type of the task's own: reward terms and `is_terminal`
            are given it.
        """
        raise NotImplementedError

    def view(self, state: StateT, ids: Ints) -> Any:
        """Return what the robots of environments `ids` know of their task: `Belief.task`."""
        raise NotImplementedError

    def info(self, state: StateT) -> Mapping[str, Floats]:
        """Return numbers (B,) about the episode so far, by name.

        Names begin with "task/"; beside them stands "is_success", 0 or 1: whether the episode would
        be a success if it ended now.
        """
        raise NotImplementedError

    def is_terminal(self, step: Any) -> Bools | bool:
        """Return (B,) whether the task is over, given what `advance` returned; never by default."""
        return False

    def markers(self, view: Any) -> Points3:
        """Return (B, M, 3) points that pictures show [m, world]; none by default."""
        return np.zeros((1, 0, 3))

    def survey(self, grounds: Grounds) -> Any:
        """Return what the task needs to know of the place, once: `World.place`; by default None.

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
            place: what `survey` returned.
            home_q: (N,) the robot's pose at rest; by default starts are near it.
            spread_rad: (N,) how far from it they are at most.
        """
        return draw_near(home_q, spread_rad, rngs)

    def make_scene(self) -> TaskScene:
        """Return the task's part of the scene; by default nothing."""
        return NOTHING

    def reach_targets(self) -> Sequence[ReachTarget]:
        """Return places that the tool has to get to, besides loose objects.

        A robot that is too short for them is refused.
        """
        return ()

    def goal_targets(self, goal: Floats) -> Sequence[ReachTarget]:
        """Return where the tool has to get to for a goal that `reset(options={"goal": ...})` gives.

        A task that takes goals defines this and `set_goal`; it is asked before the episode starts,
        and what is out of reach is refused.

        Raises:
            ConfigError: this is no goal; by default always, as the task takes none.
        """
        known = [
            each for each in dict.fromkeys((*BUILT_IN, *TASKS)) if takes_goals(find_task(each))
        ]
        raise ConfigError(
            f"{self.id} takes no goal of a reset: leave options['goal'] out. {', '.join(known)} "
            "do; a task of yours does if it defines goal_targets and set_goal (hrc_env.Task)."
        )

    def set_goal(self, state: StateT, ids: Ints, goals: Floats, world: World) -> None:
        """Give environments `ids` these goals in the place of those that `reset` drew.

        Args:
            state: of all environments; rows `ids` are written.
            ids: (n,) the environments in question.
            goals: (n, ...) as `goal_targets` was given each.
            world: of these environments only.
        """
        raise NotImplementedError

    def object_poses(self, state: StateT, ids: Ints) -> Floats | None:
        """Return (n, O, 7) where loose objects lie after `reset`.

        Position [m, world] and quaternion (w, x, y, z); None, the default: as in the MJCF.
        """
        return None

    def is_load(self, state: StateT) -> Bools | bool:
        """Return (B, O) which objects count as part of the robot while it holds them.

        They do so in cost, separation and belief; by default all.
        """
        return True

    def signal(self, state: StateT) -> WorkerSignal | None:
        """Return what waiting workers are shown (`Job.waits`).

        None, the default: they do not wait.
        """
        return None

    def effects(self, state: StateT) -> Effects | None:
        """Return what is done to loose objects during the next step; by default nothing."""
        return None

    def allowed_contact(self, belief: Belief) -> Bools | None:
        """Return (B, W, S) which segments of estimated bodies may touch the robot's hand.

        So workers take what it brings: built-in shields let them. None, the default: none of them.
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
        return type(self).is_terminal is not Task.is_terminal

    def counts(self, info: Mapping[str, Any]) -> dict[str, Any]:
        """Return the attempts in an info, in words: {"goals reached": 3.0, "goals missed": 1.0}."""
        names = (self.achieved, self.failed)
        return {name.removeprefix("task/").replace("_", " "): info[name] for name in names}


TaskType = type[Task[Any, Any]]
TASKS: Registry[TaskType] = Registry("task")
"""Task classes by id: those that were asked for, and those that were registered."""


def find_task(task: str | TaskType) -> TaskType:
    """Return the class of a task, given that or its id.

    Raises:
        ConfigError: there is no such task; it names those that there are.
    """
    if isinstance(task, type) and issubclass(task, Task):
        return task
    if not isinstance(task, str):
        raise ConfigError(
            f"task must be an id or a subclass of hrc_env.Task, got {type(task).__name__}."
        )
    if task not in TASKS and task in BUILT_IN:
        module, name = BUILT_IN[task].where.split(":")
        TASKS[task] = cast(TaskType, getattr(import_module(module), name))
    if task not in TASKS:
        raise unknown("task", task, sorted({*BUILT_IN, *TASKS}))
    return TASKS[task]


def is_known(task: TaskType) -> bool:
    """Return whether a class is a task of the package, or registered."""
    if task.id in BUILT_IN and find_task(task.id) is task:
        return True
    return TASKS.name_of(task) is not None


def with_rewards(task: str | TaskType, *terms: RewardTerm, id: str) -> TaskType:
    """Return a task that is rewarded for more than another one, and is else the same.

    It is a subclass, as you may write one yourself: `class Mine(hrc_env.find_task(ID))` with an
    `id` and `rewards = (*hrc_env.find_task(ID).rewards, term)`. Terms of people read the belief,
    `Belief.estimate` and `Belief.separation`; they are given the task's settings as weights, and
    stand in `info` as "reward/NAME". `register_task` makes the id known.

    Args:
        task: that is taken, its id or class.
        terms: what is added; each returns (B,) a number for every environment.
        id: of the new task, such as "MyReach-v0".

    Raises:
        ConfigError: there is no such task, no term, one that is no `RewardTerm`, or one whose name
            the task or all tasks have.
    """
    base = find_task(task)
    if not terms:
        raise ConfigError(f"Give at least one RewardTerm to add to {base.id}, got none.")
    names = [term.name for term in base().reward_terms]
    for term in terms:
        if not isinstance(term, RewardTerm):
            raise ConfigError(f"A reward's term must be a RewardTerm, got {described(term)}.")
        if term.name in names:
            raise ConfigError(
                f"{base.id} has a term {term.name!r} already; choose another name than "
                f"{', '.join(map(repr, names))}."
            )
        names.append(term.name)
    added = {"id": id, "rewards": (*base.rewards, *terms), "__doc__": base.__doc__}
    return cast(TaskType, type(base.__name__, (base,), added))


def ancestor_of(task: str, ids: Collection[str]) -> str:
    """Return the nearest task among `ids` whose agents act in a task, or the task's own id.

    That is the task itself, or one that it derives from with the same observations and goals, as
    `with_rewards` makes them.
    """
    if task not in (*BUILT_IN, *TASKS):  # a class that is not registered
        return task
    kind = find_task(task)
    for each in kind.__mro__:
        if not issubclass(each, Task) or "id" not in vars(each):
            continue
        alike = each.observations == kind.observations and each.goal == kind.goal
        if each.id in ids and alike and each.needs_gripper == kind.needs_gripper:
            return each.id
    return task


def takes_goals(task: TaskType) -> bool:
    """Return whether a reset can give a task its goal."""
    return task.set_goal is not Task.set_goal


def goal_of(task: Task[Any, Any]) -> Goal:
    """Return the goal of a task, or raise `NoGoalError`."""
    if task.goal is None:
        known = [each for each in dict.fromkeys((*BUILT_IN, *TASKS)) if find_task(each).goal]
        raise NoGoalError(
            f"{task.id} has no goals apart from its observation, so that nothing can be judged by "
            f"another goal (compute_reward, HER). {', '.join(known)} have: choose one of these, or "
            "a learner without HER."
        )
    return task.goal
