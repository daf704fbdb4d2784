"""What workers do, one thing after another: a small graph of tasks at kinds of workplaces."""

from collections.abc import Sequence
from dataclasses import dataclass

from hrc_env.core.errors import ConfigError, unknown
from hrc_env.core.records import WORKPLACE_KINDS
from hrc_env.motion.state import ACTIVITY_NAMES
from hrc_env.worker.props import PROP_NAMES

HERE = "here"
"""As a kind of place: wherever the worker is."""
ROUTES = ("walk", "push")
"""How workers go to a task."""


@dataclass(frozen=True, slots=True)
class Task:
    """One thing to do, and what may follow; weights are shares of their sum."""

    name: str
    activity: str
    """One of `plans.ACTIVITY_NAMES`."""
    at: str
    """Kind of workplace (`WORKPLACE_KINDS`), or "here"."""
    then: tuple[tuple[str, float], ...] = ()
    """What may follow, with weights; nothing, or the same place for too long: it is over."""
    begins: float = 0.0
    """Weight with which an errand begins with this task; 0: none does."""
    prop: str = "nothing"
    """What is picked up, or pushed on the way."""
    by: str = "walk"
    """How workers go there: "walk", or "push" the prop."""


TASKS: tuple[Task, ...] = (
    Task("work with the robot", "reach", "robot",
         (("work with the robot", 0.78), ("wait for the robot", 0.16), ("show where", 0.03),
          ("watch the robot", 0.03))),
    Task("wait for the robot", "stand", "robot", (("work with the robot", 1.0),)),
    Task("watch the robot", "look round", "robot", (("work with the robot", 1.0),)),
    Task("show where", "point", "robot", (("work with the robot", 1.0),)),
    Task("fetch a board", "pick up", "pile",
         (("bring it to the wall", 0.7), ("bring it to the robot", 0.3)), 1.0, "board"),
    Task("bring it to the wall", "set down", "wall",
         (("nail it", 0.6), ("screw it on", 0.4))),
    Task("bring it to the robot", "hand over", "robot", (("work with the robot", 1.0),)),
    Task("fetch a box", "pick up", "pile",
         (("put it on the bench", 0.6), ("put it on the floor", 0.4)), 0.7, "box"),
    Task("put it on the bench", "set down", "bench", (("work at the bench", 1.0),)),
    Task("put it on the floor", "set down", "floor", (("look about", 1.0),)),
    Task("move a load", "lift", "floor", (("look about", 0.4), ("move a load", 0.3),
         ("work on the floor", 0.3)), 0.6),
    Task("nail it", "hammer", "wall", (("nail it", 0.3), ("measure the wall", 0.3),
         ("screw it on", 0.2), ("look about", 0.2)), 0.5),
    Task("screw it on", "drill", "wall", (("nail it", 0.3), ("measure the wall", 0.3),
         ("look about", 0.4)), 0.4),
    Task("measure the wall", "measure", "wall", (("nail it", 0.4), ("screw it on", 0.4),
         ("look about", 0.2)), 0.5),
    Task("work overhead", "drill overhead", "overhead", (("work overhead", 0.5),
         ("look about", 0.5)), 0.6),
    Task("work at the bench", "saw", "bench", (("work at the bench", 0.4), ("tidy the bench", 0.6)),
         0.5),
    Task("tidy the bench", "reach", "bench", (("tidy the bench", 0.5), ("work at the bench", 0.3),
         ("look about", 0.2)), 0.5),
    Task("work on the floor", "kneel", "floor", (("look about", 1.0),), 0.4),
    Task("look at the floor", "squat", "floor", (("look about", 1.0),), 0.3),
    Task("take the cart", "stand", "cart", (("bring the cart", 1.0),), 0.4),
    Task("bring the cart", "look round", "open", (("look about", 1.0),), 0.0, "cart", "push"),
    Task("climb up", "climb", "step", (("look about", 0.6), ("climb up", 0.4)), 0.3),
    Task("stand about", "stand", "open", (("look about", 0.4), ("stand about", 0.3),
         ("do something", 0.3)), 0.8),
    Task("do something", "reach", "open", (("stand about", 0.5), ("do something", 0.5)), 0.4),
    Task("look about", "look round", HERE),
)  # fmt: skip
"""Judgement: framing work beside a robot that holds what is worked on."""


def check_tasks(tasks: Sequence[Task]) -> None:
    """Refuse unknown names of activities, places, tasks and props, bad weights, and no robot."""
    names = [task.name for task in tasks]
    if len(set(names)) < len(names):
        raise ConfigError(f"Tasks must have different names, got {names}.")
    if not any(task.at == "robot" for task in tasks):
        raise ConfigError("Some task must be at the robot: at='robot'.")
    for task in tasks:
        for what, got, valid in (
            ("activity of", task.activity, ACTIVITY_NAMES),
            ("kind of place of", task.at, (*WORKPLACE_KINDS, HERE)),
            ("prop of", task.prop, PROP_NAMES),
            ("way to", task.by, ROUTES),
            *(("task after", name, names) for name, _ in task.then),
        ):
            if got not in valid:
                raise unknown(f"{what} {task.name!r}", got, valid)
        if task.begins < 0.0 or not all(weight > 0.0 for _, weight in task.then):
            raise ConfigError(
                f"{task.name!r}: begins must be 0 or more, weights must be > 0, got "
                f"{task.begins} and {task.then}."
            )


@dataclass(frozen=True, slots=True, eq=False)
class Errands:
    """The graph where only some kinds of places are: indices into `tasks`."""

    tasks: tuple[Task, ...]
    then: tuple[tuple[tuple[int, float], ...], ...]
    """After each task: what may follow, with running shares up to 1."""
    robot: int
    """The first task at the robot."""
    begins: tuple[tuple[int, float], ...]
    """How errands elsewhere begin, with running shares; empty where there is nowhere else."""


def errands_at(tasks: Sequence[Task], kinds: Sequence[str]) -> Errands:
    """The tasks that can be done at these kinds of places; places at the robot always are."""
    there = {*kinds, "robot", HERE}
    kept = tuple(task for task in tasks if task.at in there)
    index = {task.name: k for k, task in enumerate(kept)}
    then = tuple(
        _shares([(index[name], weight) for name, weight in task.then if name in index])
        for task in kept
    )
    robot = next(k for k, task in enumerate(kept) if task.at == "robot")
    return Errands(kept, then, robot, _shares([(index[task.name], task.begins) for task in kept]))


def _shares(weights: list[tuple[int, float]]) -> tuple[tuple[int, float], ...]:
    """Weights as running shares of their sum; those of weight 0 are left out."""
    total, running, shares = sum(weight for _, weight in weights), 0.0, []
    for k, weight in weights:
        if weight > 0.0:
            running += weight / total
            shares.append((k, running))
    return tuple(shares)


def picked(shares: tuple[tuple[int, float], ...], draw: float) -> int:
    """The task that a uniform draw in [0, 1) falls on; shares are not empty."""
    return next((k for k, share in shares if draw < share), shares[-1][0])
