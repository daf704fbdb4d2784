"""Bring your own: a task, an estimator and more, by a name that works wherever one is asked for.

What is registered by a file of yours is known to the command line, too, and to every process that
it starts: `python -m hrc_env --import my_file.py play MyTask-v0`, or the environment variable
`HRC_ENV_IMPORT`. The files in `examples/bring_your_own/` show one of each.
"""

import os
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gymnasium.envs.registration import register

from hrc_env.core.errors import ConfigError
from hrc_env.tasks import BUILT_IN, EPISODE_STEPS

if TYPE_CHECKING:
    from hrc_env.tasks.task import Task
    from hrc_env.tracking.estimators import EstimatorSpec

IMPORT = "HRC_ENV_IMPORT"
"""Environment variable: Python files that are imported with this package, as PATH has folders."""
IDS: list[str] = []
"""The environments that are registered."""


def register_task(task: "Task") -> None:
    """Make a task an environment: its id works in `gymnasium.make`, `make_vec` and `play`.

    Args:
        task: a `hrc_env.tasks.task.Task`.

    Raises:
        ConfigError: its id is taken, or something in it is missing or of the wrong kind.
    """
    from hrc_env.tasks.checks import check_task  # here and below: kernels take time to import
    from hrc_env.tasks.task import TASKS, task_called

    for each in BUILT_IN:
        task_called(each)
    check_task(task)
    _add(TASKS, "task", task.id, task)
    register_environment(task.id, task.max_episode_steps)


def register_estimator(spec: "EstimatorSpec") -> None:
    """Make an estimator known by its name: wherever `estimator=` or `--estimator` is taken.

    Args:
        spec: a `hrc_env.tracking.estimators.EstimatorSpec`.

    Raises:
        ConfigError: its name is taken, a function is missing, or an estimate has a wrong shape, no
            finite numbers or no covariance.
    """
    from hrc_env.tracking.checks import check_estimator
    from hrc_env.tracking.estimators import ESTIMATORS

    check_estimator(spec)
    _add(ESTIMATORS, "estimator", spec.name, spec)


def register_environment(task_id: str, max_episode_steps: int = EPISODE_STEPS) -> None:
    """Tell Gymnasium about the environment of a task."""
    register(
        id=task_id,
        entry_point="hrc_env.env:HRCEnv",
        vector_entry_point="hrc_env.vector.factory:make_vector",
        max_episode_steps=max_episode_steps,
        kwargs={"task": task_id},
    )
    IDS.append(task_id)


def _add(known: dict[str, Any], what: str, name: str, thing: Any) -> None:
    if name in known:
        raise ConfigError(f"There is the {what} {name!r} already; choose another name.")
    known[name] = thing


def import_files(paths: str | None = None) -> None:
    """Import Python files, each once; their calls of `register_...` take effect.

    Args:
        paths: files, separated as in PATH; None: those of the environment variable
            `HRC_ENV_IMPORT`.

    Raises:
        ConfigError: a file that is not there.
    """
    given = os.environ.get(IMPORT, "") if paths is None else paths
    for path in (Path(each).resolve() for each in given.split(os.pathsep) if each):
        name = f"hrc_env_import_{path.stem}"
        if name in sys.modules:
            continue
        spec = spec_from_file_location(name, path)
        if spec is None or spec.loader is None or not path.is_file():
            raise ConfigError(f"{path} cannot be imported: it must be a Python file (.py).")
        module = module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
