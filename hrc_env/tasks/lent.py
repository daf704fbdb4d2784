"""Tasks of users: their methods write the state where they are to, and nothing else."""

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Any

from hrc_env.core.lending import called, is_of_user, read_only
from hrc_env.tasks.task import Task

WRITERS = ("reset", "set_goal", "advance")
"""Methods that write their first argument, the state; all others only read it."""
_HOOKS = [
    name for name, hook in inspect.getmembers(Task, inspect.isfunction)
    if name[0] != "_" and name not in ("make_state", "make_scene", "reach_targets", "counts")
]  # fmt: skip


def lent(task: Task[Any, Any]) -> Task[Any, Any]:
    """Give read-only arrays to methods that a user has written; return the task.

    Such a method raises `ConfigError` if it writes into one of them, as others, a shield among
    them, are given the same arrays.
    """
    for name in _HOOKS:
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
