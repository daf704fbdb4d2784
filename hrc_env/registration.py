"""Bring your own: a task, an estimator and more, by a name that works wherever one is asked for.

What is registered by a file of yours is known to the command line, too, and to every process that
it starts: `python -m hrc_env --import my_file.py play MyTask-v0`, or the environment variable
`HRC_ENV_IMPORT`. The files in `examples/bring_your_own/` show one of each.
"""

import os
import sys
from collections.abc import Callable
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gymnasium.envs.registration import register

from hrc_env.core.errors import ConfigError
from hrc_env.tasks import BUILT_IN, EPISODE_STEPS

if TYPE_CHECKING:
    from hrc_env.perception.detector import KeypointFunction
    from hrc_env.safety.shield import Shield
    from hrc_env.scene.robot import Robot
    from hrc_env.tasks.task import Task
    from hrc_env.tracking.estimators import EstimatorSpec

IMPORT = "HRC_ENV_IMPORT"
"""Environment variable: Python files that are imported with this package, as PATH has folders."""
IDS: list[str] = []
"""The environments that are registered."""


def register_task(task: "Task") -> None:
    """Make a task an environment: its id works in `gymnasium.make`, `make_vec` and `play`.

    Raises:
        ConfigError: here and below: the name is taken, or something is missing or of a wrong kind.
    """
    from hrc_env.tasks.task import TASKS, check_task  # in functions: kernels take time to import

    check_task(task)
    _add(TASKS, "task", task.id, task)
    register_environment(task.id, task.max_episode_steps)


def register_estimator(spec: "EstimatorSpec") -> None:
    """Make an estimator known by its name: wherever `estimator=` or `--estimator` is taken. Its
    estimates must be finite and of the right shapes."""
    from hrc_env.tracking.estimators import ESTIMATORS, check_estimator

    check_estimator(spec)
    _add(ESTIMATORS, "estimator", spec.name, spec)


def register_robot(robot: "Robot") -> None:
    """Make a robot known by its name: wherever `robot=` or `--robot` is taken. A warning says where
    what cameras see of it and what distances count differ."""
    from hrc_env.scene.robot import ROBOTS, Robot, robot_called
    from hrc_env.scene.robot_looks import warn_of_looks

    if not isinstance(robot, Robot):
        raise ConfigError(f"A robot must be a Robot, got {type(robot).__name__}.")
    robot = robot_called(robot)
    warn_of_looks(robot)
    _add(ROBOTS, "robot", robot.name, robot)


def register_detector(name: str, make: "Callable[[], KeypointFunction]") -> None:
    """Make a pose detector known: `config={"detector": {"keypoints": name}}`, level "pixels".
    `make` is called once for each thread that detects."""
    from hrc_env.perception.detector import DETECTORS

    _add(DETECTORS, "detector", name, make, is_function=True)


def register_shield(name: str, shield: "Shield") -> None:
    """Make a shield (`hrc_env.safety.shield.Shield`) known: `shield=name` of every environment."""
    from hrc_env.safety.shield import SHIELDS

    _add(SHIELDS, "shield", name, shield, is_function=True)


def register_environment(task_id: str, max_episode_steps: int = EPISODE_STEPS) -> None:
    """Tell Gymnasium about the environment of a task."""
    register(
        id=task_id,
        entry_point="hrc_env.env:HRCEnv",
        vector_entry_point="hrc_env.vector.env:make_vector",
        max_episode_steps=max_episode_steps,
        kwargs={"task": task_id},
    )
    IDS.append(task_id)


def import_files(paths: str | None = None) -> None:
    """Import Python files, each once, which register things; separated as in PATH; None: those
    of the environment variable `IMPORT`."""
    given = os.environ.get(IMPORT, "") if paths is None else paths
    for path in (Path(each).resolve() for each in given.split(os.pathsep) if each):
        name = f"hrc_env_import_{path.stem}"
        if name in sys.modules:
            continue
        spec = spec_from_file_location(name, path)
        if spec is None or spec.loader is None or not path.is_file():
            raise ConfigError(f"{path} cannot be imported: it must be a Python file (.py).")
        sys.modules[name] = module = module_from_spec(spec)
        try:
            spec.loader.exec_module(module)
        except BaseException:
            del sys.modules[name]
            raise


def _add(
    table: dict[str, Any], what: str, name: str, thing: Any, is_function: bool = False
) -> None:
    """Keep a thing in the table in which things of its kind are looked up by name."""
    if is_function and not callable(thing):
        raise ConfigError(f"{name}: a {what} must be a function, got {thing!r}.")
    if name in table or name in BUILT_IN:
        raise ConfigError(f"There is the {what} {name!r} already; choose another name.")
    table[name] = thing
