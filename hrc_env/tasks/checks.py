"""What a task that somebody registers must have."""

import re
from collections import Counter
from dataclasses import fields, is_dataclass

import numpy as np

from hrc_env.core.errors import ConfigError, check_shape
from hrc_env.tasks.task import Task

_ID = re.compile(r"[A-Za-z]\w*-v\d+")


def check_task(task: Task) -> None:
    """Raise `ConfigError` for what is missing or wrong in a task.

    Shapes and values of its terms are checked when an environment of it is reset and steps.
    """
    if not isinstance(task, Task):
        raise ConfigError(f"A task must be a hrc_env.tasks.task.Task, got {type(task).__name__}.")
    if not isinstance(task.id, str) or not _ID.fullmatch(task.id):
        raise ConfigError(f"A task's id must be like 'HRCSort-v0', got {task.id!r}.")
    for name in ("init", "reset", "advance", "view", "info", "markers"):
        if not callable(getattr(task, name)):
            raise ConfigError(f"{task.id}: {name} must be a function (see Task).")
    if not (isinstance(task.config, type) and is_dataclass(task.config)):
        raise ConfigError(f"{task.id}: config must be a dataclass, got {task.config!r}.")
    try:
        task.config()
    except TypeError as error:
        raise ConfigError(f"{task.id}: every field of config needs a default ({error}).") from error
    _check_terms(task)
    _check_state(task)


def _check_terms(task: Task) -> None:
    for terms in (task.observation_terms, task.reward_terms):
        name, times = Counter(term.name for term in terms).most_common(1)[0]
        if times > 1:
            raise ConfigError(f"{task.id}: there is a term {name!r} already; choose another name.")


def _check_state(task: Task) -> None:
    state = task.init(2)
    if not is_dataclass(state):
        raise ConfigError(
            f"{task.id}: init must give a dataclass of arrays, got {type(state).__name__}."
        )
    for each in fields(state):
        shape = np.shape(getattr(state, each.name))
        check_shape(f"{task.id}: state.{each.name}", shape[:1], (2,), "a row an environment")
    info = task.info(state)
    for name in (task.achieved, task.failed, "is_success"):
        if name not in info:
            raise ConfigError(f"{task.id}: info must hold {name!r}, has {', '.join(info)}.")
    for name, value in info.items():
        if name != "is_success" and not name.startswith("task/"):
            raise ConfigError(f"{task.id}: names in info must begin with 'task/', got {name!r}.")
        check_shape(f"{task.id}: info[{name!r}]", np.shape(value), (2,), "a value an environment")
