"""Checks of a custom task, before an environment is made from it."""

import inspect
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from itertools import takewhile
from typing import Any, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike

from hrc_env.core.brought import check_kind
from hrc_env.core.errors import ConfigError, check_integer, check_shape
from hrc_env.core.lending import read_only, refuse_writing
from hrc_env.observations import ObservationTerm
from hrc_env.rewards import RewardTerm
from hrc_env.tasks.goal import Goal
from hrc_env.tasks.hooks import check_targets
from hrc_env.tasks.task import HOOKS, AnyTask, Task, TaskType, is_task_class
from hrc_env.world import TaskScene

_ID = re.compile(r"[A-Za-z]\w*-v\d+")
Terms: TypeAlias = tuple[object, ...]
REQUIRED = ("make_state", "reset", "advance", "view", "info")
"""Names of the methods that every task must define."""
RENAMED = {
    "init": "make_state",
    "says": "the class's docstring",
    "config": "config_type",
    "things": "make_scene",
    "spots": "reach_targets",
    "poses": "object_poses",
    "loads": "is_load",
    "cue": "signal",
    "welcome": "allowed_contact",
    "over": "is_terminal",
    "start": "draw_start",
    "grips": "needs_gripper",
    "drives": "needs_mobile_base",
}
"""Current names of renamed attributes and methods of tasks, by former name."""


def check_task(task: object) -> None:
    """Raise `ConfigError` if a part of a task class is missing or invalid.

    Shapes and values of its terms are checked later, when its environment is reset and stepped.
    """
    if not is_task_class(task):
        raise ConfigError(
            f"A task must be a class that derives from hrc_env.Task, got {_describe(task)}."
        )
    if not isinstance(cast(object, task.id), str) or not _ID.fullmatch(task.id):
        raise ConfigError(f"A task's id must be like 'Name-v0', got {task.id!r}.")
    check_parts(task)


def check_parts(task: TaskType) -> None:
    """Raise `ConfigError` if a part of a class other than its ID is missing or invalid."""
    _check_names(task)
    _check_attributes(task)
    _check_methods(task)
    config_type = getattr(task, "config_type", None)
    if not (isinstance(config_type, type) and is_dataclass(config_type)):
        raise ConfigError(f"{task.id}: config_type must be a dataclass, got {config_type!r}.")
    try:
        made = task()
    except TypeError as error:
        raise ConfigError(f"{task.id}: every field of config needs a default ({error}).") from error
    if task.goal is not None:
        check_kind(f"{task.id}: goal", task.goal, Goal)
        _check_goal(task.id, task.goal, made.config)
    _check_terms(made)
    check_kind(f"{task.id}: make_scene", made.make_scene(), TaskScene)
    check_targets(f"{task.id}: reach_targets", made.reach_targets())
    _check_state(made)


def _check_goal(who: str, goal: Goal, config: Any) -> None:
    """Raise `ConfigError` if the reward of a pair of goals depends on the other pairs."""
    name, size = f"{who}: Goal.reward", check_integer(f"{who}: Goal.size", goal.size, 1, 2**62)
    rng = np.random.default_rng(0)
    achieved = goal.bound * rng.uniform(-1, 1, (2, 3, size))
    desired = achieved + 0.1 * goal.bound * rng.uniform(-1, 1, (2, 3, size))
    desired[0] = achieved[0]  # reached
    signature = f"(..., {size}) and (..., {size}) to (...), for any leading axes: reduce axis=-1"
    try:
        rewards = [
            np.asarray(goal.reward(*read_only((achieved[at], desired[at])), config))
            for at in (..., 0, (0, 0), 1, (1, 2))
        ]
    except (ValueError, IndexError, TypeError) as error:
        if "read-only" in str(error):
            refuse_writing(name, error)  # type: ignore[arg-type]
        raise ConfigError(f"{name} must take {signature}; it raises {error}.") from error
    of_all, *parts = rewards
    for at, part in zip((0, (0, 0), 1, (1, 2)), parts, strict=True):
        if of_all.shape != (2, 3) or part.shape != of_all[at].shape:
            raise ConfigError(
                f"{name} must take {signature}; got {of_all.shape} of (2, 3, {size})."
            )
        if not np.allclose(part, of_all[at], equal_nan=True):
            raise ConfigError(f"{name} must evaluate each pair independently of the others.")


def _describe(task: object) -> str:
    """Return a description of an object that is not a task class, for an error message."""
    if isinstance(task, Task):
        name = cast(object, task).__class__.__name__
        return f"an instance: register the class {name} itself"
    return task.__name__ if isinstance(task, type) else task.__class__.__name__


def _check_names(task: TaskType) -> None:
    """Raise `ConfigError` for former names, and for methods named similarly to hooks."""
    bases = takewhile(lambda base: base is not Task, task.__mro__)
    names = [name for base in bases for name in vars(base)]
    for name in names:
        if name in RENAMED:
            raise ConfigError(
                f"{task.id}: {name} is called {RENAMED[name]} now (see hrc_env.Task)."
            )
        is_new = name[0] != "_" and not hasattr(Task, name) and callable(getattr(task, name))
        similar = get_close_matches(name, set(HOOKS) - set(names), 1, 0.85) if is_new else []
        if similar:
            raise ConfigError(
                f"{task.id}: {name} is never called. Did you mean {similar[0]}? A custom method "
                "needs a less similar name."
            )


def _check_attributes(task: TaskType) -> None:
    """Raise `ConfigError` if an attribute of the class has a wrong type."""
    for name in ("starts", "ends", "scene", "viewpoint"):
        check_kind(f"{task.id}: {name}", getattr(task, name), str)
    check_kind(f"{task.id}: robot", task.robot, str, None)
    check_kind(f"{task.id}: defaults", task.defaults, Mapping)
    for name in ("needs_gripper", "needs_mobile_base"):
        check_kind(f"{task.id}: {name}", getattr(task, name), bool)
    check_integer(f"{task.id}: max_episode_steps", task.max_episode_steps, 1, 2**62)


def _check_methods(task: TaskType) -> None:
    """Raise `ConfigError` if a hook is missing, is not a function, or has other parameters."""
    for name in HOOKS:
        hook, expected = getattr(task, name), getattr(Task, name)
        if name in REQUIRED and hook is expected:
            raise ConfigError(f"{task.id}: the method {name} is missing (see hrc_env.Task).")
        if not callable(hook):
            raise ConfigError(f"{task.id}: {name} must be a method, got {hook!r}.")
        wanted = list(inspect.signature(expected).parameters)
        try:
            signature = inspect.signature(inspect.getattr_static(task, name))
        except (TypeError, ValueError):  # not introspectable
            continue
        try:
            signature.bind(*wanted)
        except TypeError as error:
            raise ConfigError(
                f"{task.id}: {name} must be a method of ({', '.join(wanted)}), got one of "
                f"{signature}: {error}."
            ) from error


def _check_terms(task: AnyTask) -> None:
    """Raise `ConfigError` if a term has a wrong type, or two terms have the same name."""
    for name, kind in (("observations", ObservationTerm), ("rewards", RewardTerm)):
        terms: object = getattr(task, name)
        is_tuple = isinstance(terms, tuple)
        if not is_tuple or not all(isinstance(each, kind) for each in cast(Terms, terms)):
            raise ConfigError(f"{task.id}: {name} must be a tuple of {kind.__name__}.")
    for all_terms in (task.observation_terms, task.reward_terms):
        name, times = Counter(term.name for term in all_terms).most_common(1)[0]
        if times > 1:
            raise ConfigError(f"{task.id}: the term {name!r} exists already; choose another name.")


def _check_state(task: AnyTask) -> None:
    """Raise `ConfigError` if the state lacks a row per environment, or its info is invalid."""
    state = task.make_state(2)
    if is_dataclass(state) and not isinstance(state, type):
        parts = {f"state.{each.name}": getattr(state, each.name) for each in fields(state)}
    elif isinstance(state, np.ndarray):
        parts = {"state": cast(object, state)}
    else:
        raise ConfigError(
            f"{task.id}: make_state must give a structured array or a dataclass of arrays, "
            f"got {type(state).__name__}."
        )
    for name, part in parts.items():
        shape = np.shape(cast(ArrayLike, part))
        check_shape(f"{task.id}: {name}", shape[:1], (2,), "one row per environment")
    info = task.info(state)
    check_kind(f"{task.id}: info", info, Mapping)
    _check_info(task, info, 2)


def _check_info(task: AnyTask, info: Mapping[str, Any], batch: int) -> None:
    """Raise `ConfigError` if a task's info lacks names or contains wrong shapes."""
    for part, counts in (("achieved", "successful"), ("failed", "failed")):
        if not isinstance(name := getattr(task, part), str) or not name.startswith("task/"):
            raise ConfigError(
                f"{task.id}: {part} must be the name in info that counts {counts} attempts, such "
                f"as 'task/{'goals_reached' if part == 'achieved' else 'goals_missed'}'; got "
                f"{name!r}."
            )
    if task.achieved == task.failed:
        raise ConfigError(
            f"{task.id}: achieved and failed must be two different counts, from which the success "
            f"rate is computed; both are {task.achieved!r}."
        )
    for name in (task.achieved, task.failed, "is_success"):
        if name not in info:
            raise ConfigError(f"{task.id}: info must hold {name!r}, got {', '.join(info)}.")
    for name, value in info.items():
        if name != "is_success" and not name.startswith("task/"):
            raise ConfigError(f"{task.id}: names in info must begin with 'task/', got {name!r}.")
        check_shape(
            f"{task.id}: info[{name!r}]", np.shape(value), (batch,), "one entry per environment"
        )


def check_counts(task: AnyTask, info: Mapping[str, Any]) -> None:
    """Raise `ConfigError` if the info of a step has invalid numbers of attempts or success.

    `achieved` and `failed` are non-negative numbers of attempts. `is_success` is 1 if the episode
    would be a success if it ended now, and otherwise 0. The two measures differ, and tables show
    both.
    """
    for name in (task.achieved, task.failed):
        values = np.asarray(info[name], float)
        if not (np.isfinite(values).all() and (values >= 0).all()):
            raise ConfigError(
                f"{task.id}: info[{name!r}] must count attempts of the episode so far, finite and "
                f"0 or more, got {values}."
            )
    success = np.asarray(info["is_success"], float)
    if not np.isin(success, (0.0, 1.0)).all():
        raise ConfigError(
            f"{task.id}: info['is_success'] must be 0 or 1: whether the episode would be a success "
            f"if it ended now; got {success}."
        )
