"""Tasks that differ from others in a few things."""

from typing import Any

from hrc_env.tasks.task import TaskType


def vary(task: TaskType, **changes: Any) -> TaskType:
    """Return a subclass of a task with other attributes or methods."""
    return type(task.__name__, (task,), changes)
