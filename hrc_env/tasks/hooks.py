"""Hooks of a task: checked for the steps of its registration, and read-only for those of users."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from typing import Any

import numpy as np

from hrc_env.core.brought import check_kind, described, flags_of, numbers_of
from hrc_env.core.errors import ConfigError, check_shape
from hrc_env.core.lending import called, is_of_user, read_only
from hrc_env.core.skeleton import SEGMENT_RADIUS_M
from hrc_env.geometry.reach import ReachTarget
from hrc_env.tasks.task import Task
from hrc_env.world import Effects, WorkerSignal


@dataclass(slots=True)
class Sizes:
    """Lengths of axes of results."""

    batch: int
    """Environments."""
    workers: int
    """Slots."""
    objects: int = 0
    """Loose ones, of a scene that is built."""


Check = Callable[[str, Any, Sizes], None]
"""(name, result of a hook, sizes); raises `ConfigError`."""


def with_checks(task: Task[Any, Any], sizes: Sizes) -> Task[Any, Any]:
    """Return a task that does the same, and whose hooks raise `ConfigError` for results of another
    kind or shape, or that are no numbers."""
    kind = type(task)
    hooks = {name: _checked(kind, name, check, sizes) for name, check in CHECKS.items()}
    watched = type(kind.__name__, (kind,), {**hooks, "__doc__": kind.__doc__})
    made: Task[Any, Any] = watched(task.config)
    return made


def check_places(what: str, targets: Any) -> None:
    """Raise `ConfigError` unless these are `ReachTarget`s."""
    if not isinstance(targets, Sequence) or isinstance(targets, str):
        raise ConfigError(f"{what} must be a list of ReachTarget, got {described(targets)}.")
    for k, target in enumerate(targets):
        check_kind(f"{what}[{k}]", target, ReachTarget)


def _checked(
    kind: type[Task[Any, Any]], name: str, check: Check, sizes: Sizes
) -> Callable[..., Any]:
    hook = getattr(kind, name)

    @wraps(hook)
    def checked(self: Task[Any, Any], *args: Any, **kwargs: Any) -> Any:
        given = hook(self, *args, **kwargs)
        check(f"{self.id}: {name}", given, sizes)
        return given

    return checked


def _signal(what: str, signal: Any, sizes: Sizes) -> None:
    check_kind(what, signal, WorkerSignal, None)
    if signal is not None:
        numbers_of(f"{what}.stage", signal.stage, (sizes.batch,), "B")
        where = f"{what}.offered_world"
        numbers_of(where, signal.offered_world, (sizes.batch, 3), "B, xyz [m]", finite=False)


def _effects(what: str, effects: Any, sizes: Sizes) -> None:
    check_kind(what, effects, Effects, None)
    if effects is not None:
        shape = (sizes.batch, sizes.objects, 6)
        check_kind(f"{what}.welded", effects.welded, Mapping)
        numbers_of(f"{what}.push_world", effects.push_world, shape, "B, O, force and torque")


def _contacts(what: str, contacts: Any, sizes: Sizes) -> None:
    if contacts is not None:
        shape = sizes.batch, sizes.workers, len(SEGMENT_RADIUS_M)
        flags_of(what, contacts, shape, "B, W, segments of a body")


def _loads(what: str, loads: Any, sizes: Sizes) -> None:
    if not isinstance(loads, bool | np.bool_):
        flags_of(what, loads, (sizes.batch, sizes.objects), "B, O, or True or False for all")


def _over(what: str, over: Any, sizes: Sizes) -> None:
    if not isinstance(over, bool | np.bool_):
        flags_of(what, over, (sizes.batch,), "one an environment, or True or False for all")


def _points(what: str, points: Any, sizes: Sizes) -> None:
    shape = np.shape(points) if isinstance(points, np.ndarray) else ()
    if len(shape) != 3:
        raise ConfigError(
            f"{what} must be points (B, M, 3) [m, world], got {described(points)}; none are "
            "numpy.zeros((B, 0, 3))."
        )
    check_shape(what, shape[2:], (3,), "xyz")


def _angles(what: str, angles: Any, sizes: Sizes) -> None:
    if np.ndim(angles) == 2:  # the shape is checked where they are used
        numbers_of(what, angles, np.shape(angles), "an angle a joint")


def _numbers_by_name(what: str, info: Any, sizes: Sizes) -> None:
    check_kind(what, info, Mapping)


CHECKS: dict[str, Check] = {
    "allowed_contact": _contacts,
    "draw_start": _angles,
    "effects": _effects,
    "info": _numbers_by_name,
    "is_load": _loads,
    "is_terminal": _over,
    "markers": _points,
    "signal": _signal,
}
"""Checks of results, by hook."""

WRITERS = ("reset", "set_goal", "advance")
"""Methods that write their first argument, the state; all others only read it."""
_READERS = [
    name for name, hook in inspect.getmembers(Task, inspect.isfunction)
    if name[0] != "_" and name not in ("make_state", "make_scene", "reach_targets", "counts")
]  # fmt: skip


def lent(task: Task[Any, Any]) -> Task[Any, Any]:
    """Give read-only arrays to methods that a user has written; return the task.

    Such a method raises `ConfigError` if it writes into one of them, as others, a shield among
    them, are given the same arrays.
    """
    for name in _READERS:
        if is_of_user(getattr(type(task), name)):
            vars(task)[name] = _reading(task, name)
    return task


def _reading(task: Task[Any, Any], name: str) -> Callable[..., Any]:
    hook = getattr(task, name)
    first = 1 if name in WRITERS else 0

    @wraps(hook)
    def reading(*given: Any) -> Any:
        rest = [each if isinstance(each, list) else read_only(each) for each in given[first:]]
        return called(f"{task.id}: {name}", hook, *given[:first], *rest)

    return reading
