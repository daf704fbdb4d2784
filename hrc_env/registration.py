"""Registration of custom tasks, estimators, robots, detectors and shields by name.

The command line imports files with registrations by `python -m hrc_env --import my_file.py play
MyTask-v0` or by the environment variable `HRC_ENV_IMPORT`. Child processes adopt the registrations
of this process when they import this package. The files in `examples/bring_your_own/` contain an
example of each kind.
"""

import os
import sys
import zlib
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from gymnasium.envs.registration import EnvSpec, register, registry

from hrc_env.core.errors import ConfigError
from hrc_env.core.reservation import reserve
from hrc_env.tasks import BUILT_IN, DEFAULT, EPISODE_STEPS

if TYPE_CHECKING:
    from hrc_env.core.registry import Registry
    from hrc_env.perception.detector import KeypointFunction
    from hrc_env.safety.shield import Shield
    from hrc_env.scene.robot import Robot
    from hrc_env.tasks.task import TaskType
    from hrc_env.tracking.estimators import EstimatorSpec

EntryT = TypeVar("EntryT")
IMPORT = "HRC_ENV_IMPORT"
"""Environment variable with the paths of Python files to import, separated as in PATH."""
IDS: list[str] = []
"""IDs of the registered environments."""


def register_task(task: "TaskType") -> None:
    """Register a task, so that its ID can be used in `gymnasium.make`, `make_vec` and `play`.

    Args:
        task: a subclass of `Task`.

    Raises:
        ConfigError: the ID is already in use, or a part of the task is missing or invalid.
    """
    from hrc_env.rehearsal import play_briefly  # here, because importing kernels takes time
    from hrc_env.settings import resolve_settings
    from hrc_env.tasks.check import check_task
    from hrc_env.tasks.task import TASKS
    from hrc_env.together import check_rows

    check_task(task)
    settings = resolve_settings(task=task, perception="none")
    play_briefly(settings)
    check_rows(settings)
    _add(TASKS, task.id, task)
    register_environment(task.id, task.max_episode_steps)


def register_estimator(spec: "EstimatorSpec") -> None:
    """Register an estimator under its name for `estimator=` and `--estimator`.

    Its estimates must be finite and have the shapes of `PoseEstimate`.

    Raises:
        ConfigError: the name is already in use, or a part of the estimator is missing or invalid.
    """
    from hrc_env.tracking.estimators import ESTIMATORS, check_estimator

    check_estimator(spec)
    _add(ESTIMATORS, spec.name, spec)


def register_robot(robot: "Robot") -> None:
    """Register a robot under its name for `robot=` and `--robot`.

    A warning is issued if the visual geoms, which cameras see, differ from the capsules, with which
    distances are computed.

    Raises:
        ConfigError: the name is already in use, or a part of the robot is missing or invalid.
    """
    from hrc_env.scene.robot import ROBOTS, Robot, find_robot
    from hrc_env.scene.robot_looks import warn_of_mismatch

    if not isinstance(robot, Robot):
        raise ConfigError(f"A robot must be a Robot, got {type(robot).__name__}.")
    robot = find_robot(robot)
    warn_of_mismatch(robot)
    if not str(robot.mjcf).lstrip().startswith("<"):  # working directories may differ
        robot = replace(robot, mjcf=str(Path(robot.mjcf).resolve()))
    _add(ROBOTS, robot.name, robot)


def register_detector(name: str, make: "Callable[[], KeypointFunction]") -> None:
    """Register a pose detector under a name for the setting `detector.keypoints`.

    An environment with perception="pixels" uses it with the argument
    `config={"detector": {"keypoints": name}}`.

    Args:
        name: name of the detector.
        make: callable without arguments, which is called once in each detection thread and returns
            the detector. The detector is a callable that takes a crop (256, 256, 3), RGB of uint8.
            It returns an array (15, 3) with x, y [px] from the crop's corner and confidence in [0,
            1] of each of `JOINTS`, or NaN, NaN, 0 for an undetected joint; it returns None if no
            person is detected.

    Raises:
        ConfigError: the name is already in use, or `make` is not such a function.
    """
    from hrc_env.core.brought import check_arguments
    from hrc_env.perception.detector import DETECTORS

    if callable(make):
        check_arguments(f"{name}: make", make)
    _add(DETECTORS, name, make, is_function=True)


def register_shield(name: str, shield: "Shield") -> None:
    """Register a shield under a name for `shield=` and `--shield`.

    Args:
        name: name of the shield.
        shield: the shield, a function with the signature of `hrc_env.Shield`.

    Raises:
        ConfigError: the name is already in use, or the shield is not such a function.
    """
    from hrc_env.safety.shield import SHIELDS, check_shield

    if callable(shield):
        check_shield(name, shield)
    _add(SHIELDS, name, shield, is_function=True)


def register_environment(task_id: str, max_episode_steps: int = EPISODE_STEPS) -> None:
    """Register a task as an environment of Gymnasium."""
    if task_id in IDS:  # inherited from another process
        registry.pop(task_id, None)
        IDS.remove(task_id)
    register(
        id=task_id,
        entry_point="hrc_env.env:HRCEnv",
        vector_entry_point="hrc_env.vector.make:make_vector",
        max_episode_steps=max_episode_steps,
        kwargs={"task": task_id},
    )
    IDS.append(task_id)


def import_files(paths: str | Path | Sequence[str | Path] | None = None) -> None:
    """Import Python files with registrations once, in this process and in child processes.

    Args:
        paths: a path, a list of paths, or a string of several paths, separated as in PATH; None for
            the paths in the environment variable `HRC_ENV_IMPORT`.

    Raises:
        ConfigError: a file does not exist or cannot be imported.
    """
    given = os.environ.get(IMPORT, "") if paths is None else paths
    each = [given] if isinstance(given, str | Path) else given
    if not isinstance(each, Sequence) or not all(isinstance(one, str | Path) for one in each):
        raise ConfigError(f"paths must be the paths of Python files, got {given!r}.")
    names = [name for one in each for name in str(one).split(os.pathsep) if name]
    for path in (Path(name).resolve() for name in names):
        _import_file(path, recorded=paths is not None)


def adopt() -> None:
    """Adopt the registrations of the parent process.

    Registrations of this process take precedence. If a file cannot be imported, its error is stored
    and shown when a name is looked up that it would have registered.
    """
    if not reserve():
        return
    from hrc_env.core.registry import FILES
    from hrc_env.core.snapshot import inherited

    parent = inherited()
    for path in parent.files:
        try:
            _import_file(Path(path), recorded=False)
        except Exception as error:  # the file may not be needed in this process
            FILES[path] = f"{type(error).__name__}: {error}"
    for task_id, entry in parent.entries.get("task", {}).items():
        if task_id not in IDS:
            register_environment(task_id, entry.max_episode_steps)


def _import_file(path: Path, recorded: bool) -> None:
    """Import a file if it is new; child processes import it only if it is `recorded`."""
    from hrc_env.core.registry import FILES, importing, share

    name = f"hrc_env_import_{path.stem}"
    if name in sys.modules and sys.modules[name].__file__ != str(path):  # another file
        name = f"{name}_{zlib.crc32(str(path).encode()):x}"
    if name in sys.modules:
        return
    spec = spec_from_file_location(name, path)
    if not path.is_file():
        raise ConfigError(f"{path} cannot be imported: there is no such file.")
    if spec is None or spec.loader is None:
        raise ConfigError(f"{path} cannot be imported: it must be a Python file (.py).")
    sys.modules[name] = module = module_from_spec(spec)
    try:
        with importing(str(path), recorded):
            spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    if recorded:
        FILES[str(path)] = ""
        share()


def _add(table: "Registry[EntryT]", name: str, entry: EntryT, is_function: bool = False) -> None:
    """Add an entry to a registry, after a check of its name.

    Args:
        table: the registry.
        name: name of the entry.
        entry: the entry.
        is_function: whether it must be a function.

    Raises:
        ConfigError: the name is already in use, or the entry is not a function.
    """
    if is_function and not callable(entry):
        raise ConfigError(f"{name}: a {table.kind} must be a function, got {entry!r}.")
    if name in BUILT_IN:
        raise ConfigError(f"The {table.kind} {name!r} exists already; choose another name.")
    table.register(name, entry)


ADVICE = {
    "task": "Register the task (hrc_env.register_task) and pass its id.",
    "estimator": "Register the estimator (hrc_env.register_estimator) and pass its name.",
    "shield": "Register the shield (hrc_env.register_shield) and pass its name.",
}
"""Advice in errors about arguments that cannot be stored as JSON, by name."""
OTHERWISE = (
    "Pass text, numbers, or lists, records or mappings of these; for a clip in memory, the path of "
    "its file (hrc_env.save_clip writes one)."
)
"""Advice in errors about all other arguments that cannot be stored as JSON."""


class Spec(EnvSpec):
    """An environment specification that stores all arguments of the environment in its JSON."""

    def to_json(self) -> str:
        """Return the specification as JSON; raise `ConfigError` if it cannot hold an argument."""
        from hrc_env.config import HRCConfig, resolve
        from hrc_env.core.mapping import for_json
        from hrc_env.tasks.task import find_task
        from hrc_env.tracking.estimators import find_estimator

        given = {**self.kwargs}
        if isinstance(given.get("config"), HRCConfig):  # its tracker depends on estimator
            task = find_task(given.get("task", DEFAULT))
            estimator = find_estimator(given.get("estimator", "particle"))
            given["config"] = resolve(given["config"], task, estimator)
        for name, value in given.items():
            try:
                given[name] = for_json(value, name)
            except ConfigError as error:
                raise ConfigError(f"{error} {ADVICE.get(name, OTHERWISE)}") from error
        return EnvSpec.to_json(replace(self, kwargs=given))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, EnvSpec) and vars(self) == vars(other)

    __hash__ = None  # type: ignore[assignment]  # as of EnvSpec


def make_spec(spec: EnvSpec) -> Spec:
    """Return a specification with plain arguments, which refers to registered objects by name."""
    from hrc_env.core.mapping import convert_to_plain
    from hrc_env.safety.shield import SHIELDS
    from hrc_env.tasks.task import TASKS
    from hrc_env.tracking.estimators import ESTIMATORS

    given = convert_to_plain(spec.kwargs)
    tables = {"task": TASKS, "estimator": ESTIMATORS, "shield": SHIELDS}
    for name in tables.keys() & given.keys():
        given[name] = tables[name].name_of(given[name]) or given[name]
    parts = {each.name: getattr(spec, each.name) for each in fields(spec) if each.init}
    return Spec(**{**parts, "kwargs": given})


class HasSpec:
    """Base class of environments that can be made again from their `spec`."""

    _spec: Spec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """Specification from which `gymnasium.make` made this environment, with plain arguments."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = spec and make_spec(spec)
