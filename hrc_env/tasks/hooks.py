"""Wrappers of a task's hooks that check their results and protect their arguments."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.brought import check_kind, describe, flags_of, numbers_of
from hrc_env.core.errors import ConfigError, check_shape
from hrc_env.core.lending import call_user_function, is_of_user, read_only
from hrc_env.geometry.enclosure import N_CAPSULES
from hrc_env.geometry.reach import ReachTarget
from hrc_env.tasks.task import HOOKS, AnyTask, TaskType
from hrc_env.world import Effects, WorkerSignal


@dataclass(slots=True)
class Sizes:
    """Sizes of the axes of the arrays that hooks return."""

    batch: int
    """Number of environments, B."""
    workers: int
    """Number of worker slots, W."""
    objects: int = 0
    """Number of the task's loose objects, O, which is known after its scene has been built."""


Check = Callable[[str, object, Sizes], None]
"""Type of check functions, which take the name of a hook for error messages, the hook's result and
the sizes, and raise `ConfigError`."""


def add_checks(task: AnyTask, sizes: Sizes) -> AnyTask:
    """Return a copy of a task with hooks that check their results.

    The hooks raise `ConfigError` if a result has a wrong type or shape, or is not numeric.
    """
    kind = type(task)
    hooks = {name: _check_results(kind, name, check, sizes) for name, check in CHECKS.items()}
    checked_kind = type(kind.__name__, (kind,), {**hooks, "__doc__": kind.__doc__})
    checked: AnyTask = checked_kind(task.config)
    return checked


def check_targets(name: str, targets: object) -> None:
    """Raise `ConfigError` unless a value is a sequence of `ReachTarget`."""
    if not isinstance(targets, Sequence) or isinstance(targets, str):
        raise ConfigError(f"{name} must be a list of ReachTarget, got {describe(targets)}.")
    for k, target in enumerate(cast(Sequence[object], targets)):
        check_kind(f"{name}[{k}]", target, ReachTarget)


def _check_results(kind: TaskType, name: str, check: Check, sizes: Sizes) -> Callable[..., Any]:
    """Return a method that calls a task's hook and checks its result.

    Args:
        kind: class of the task.
        name: name of the hook.
        check: check of the hook's result.
        sizes: sizes of the result's axes.
    """
    hook = getattr(kind, name)

    @wraps(hook)
    def method(self: AnyTask, *args: Any, **kwargs: Any) -> Any:
        result = hook(self, *args, **kwargs)
        check(f"{self.id}: {name}", result, sizes)
        return result

    return method


def _check_signal(name: str, signal: object, sizes: Sizes) -> None:
    check_kind(name, signal, WorkerSignal, None)
    if isinstance(signal, WorkerSignal):
        shape = (sizes.batch, 3)
        numbers_of(f"{name}.stage", signal.stage, (sizes.batch,), "B")
        numbers_of(f"{name}.offered_world", signal.offered_world, shape, "B, xyz [m]", finite=False)


def _check_effects(name: str, effects: object, sizes: Sizes) -> None:
    check_kind(name, effects, Effects, None)
    if isinstance(effects, Effects):
        shape = (sizes.batch, sizes.objects, 6)
        check_kind(f"{name}.welded", effects.welded, Mapping)
        numbers_of(f"{name}.push_world", effects.push_world, shape, "B, O, force and torque")


def _check_contacts(name: str, contacts: object, sizes: Sizes) -> None:
    if contacts is not None:
        shape = sizes.batch, sizes.workers, N_CAPSULES
        flags_of(name, contacts, shape, "B, W, capsules of a body")


def _check_loads(name: str, loads: object, sizes: Sizes) -> None:
    if not isinstance(loads, bool | np.bool_):
        flags_of(name, loads, (sizes.batch, sizes.objects), "B, O; or True or False for all")


def _check_end(name: str, over: object, sizes: Sizes) -> None:
    if not isinstance(over, bool | np.bool_):
        flags_of(name, over, (sizes.batch,), "one entry per environment, or True or False for all")


def _check_points(name: str, points: object, sizes: Sizes) -> None:
    shape = _shape_of(points)
    if len(shape) != 3:
        raise ConfigError(
            f"{name} must be points (B, M, 3) [m, world], got {describe(points)}; for no points, "
            "return numpy.zeros((B, 0, 3))."
        )
    check_shape(name, shape[2:], (3,), "xyz")


def _shape_of(value: object) -> tuple[int, ...]:
    """Return the shape of an array, or () for any other value."""
    return cast(NDArray[Any], value).shape if isinstance(value, np.ndarray) else ()


def _check_angles(name: str, angles: Any, sizes: Sizes) -> None:
    if np.ndim(angles) == 2:  # the shape is checked when they are used
        numbers_of(name, angles, np.shape(angles), "one angle per joint")


def _check_info(name: str, info: object, sizes: Sizes) -> None:
    check_kind(name, info, Mapping)


CHECKS: dict[str, Check] = {
    "allowed_contact": _check_contacts,
    "draw_start": _check_angles,
    "effects": _check_effects,
    "info": _check_info,
    "is_load": _check_loads,
    "is_terminal": _check_end,
    "markers": _check_points,
    "signal": _check_signal,
}
"""Check of the result of each hook, by name of the hook."""
WRITERS = ("reset", "set_goal", "advance")
"""Names of the hooks that write to their first argument, the state; all other hooks only read
it."""
UNPROTECTED = ("make_state", "make_scene", "reach_targets", "counts")
"""Names of the hooks without shared arrays in their arguments."""


def protect_arrays(task: AnyTask) -> AnyTask:
    """Make a task's user-defined methods receive read-only arrays, and return the task.

    Such a method raises `ConfigError` if it writes into one of them, because the arrays are shared
    with other functions, such as shields.
    """
    for name in HOOKS:
        if name not in UNPROTECTED and is_of_user(getattr(type(task), name)):
            vars(task)[name] = _pass_read_only(task, name)
    return task


def _pass_read_only(task: AnyTask, name: str) -> Callable[..., Any]:
    """Return a function that calls a task's method with read-only arrays."""
    hook = getattr(task, name)
    n_written = 1 if name in WRITERS else 0

    @wraps(hook)
    def function(*args: Any) -> Any:
        rest: list[Any] = [
            arg if isinstance(arg, list) else read_only(arg)  # lists contain generators
            for arg in args[n_written:]
        ]
        return call_user_function(f"{task.id}: {name}", hook, *args[:n_written], *rest)

    return function
