"""The arguments of an environment, as the commands take them that make one."""

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrc_env.core.errors import ConfigError
from hrc_env.tasks import DEFAULT


@dataclass(frozen=True, kw_only=True)
class EnvironmentArguments:
    """What `gymnasium.make` takes; names are in `python -m hrc_env list`."""

    task: str = DEFAULT
    """Which environment, by its id."""
    perception: str = "pixels"
    """What the robot sees with: pixels, keypoints, truth or none."""
    estimator: str = "particle"
    """particle, kalman, paper, triangulation or ransac."""
    cameras: tuple[str, ...] = ()
    """Names or numbers of cameras of the scene; or a rig: its name or a .toml file. All cameras
    of the scene if not given."""
    scene: str = "lab"
    """lab or site."""
    robot: str = "ur10e_like"
    """ur10e_like, or one that was registered (--import)."""
    n_workers: int | tuple[int, int] = 1
    """How many workers; two numbers are the fewest and the most, drawn for every episode."""
    people: str | None = None
    """attentive, hurried or unaware; --config motion.people.FIELD=VALUE for more."""
    motions: tuple[Path, ...] = ()
    """Clips (.npz) that workers play, too: python -m hrc_env import-motion."""
    faults: tuple[str, ...] = ()
    """What goes wrong with cameras, each a JSON object:
    '{"kind": "late", "cameras": ["camera_1"], "amount": 0.2}'."""
    appearance: str | None = None
    """as_built, varied, lights, surfaces or people (pixels only); --config appearance.FIELD=VALUE
    for more."""
    control: str = "joint"
    """What actions are: joint or tool velocities."""
    shield: str | None = None
    """A shield that was registered (--import)."""
    config: tuple[str, ...] = ()
    """Changes to the default configuration: FIELD=VALUE as in reward.proximity=0 (a value is
    JSON, or else text), or a file of them (.json or .toml). Later ones win. docs/environment.md"""

    def keywords(self) -> dict[str, Any]:
        """Keyword arguments of `HRCEnv`, of lists, mappings, text and numbers only.

        Raises:
            ConfigError: a fault or a change that cannot be read.
        """
        given = {
            "cameras": cameras_named(self.cameras),
            "people": self.people,
            "motions": [str(path) for path in self.motions],
            "faults": [_fault(text) for text in self.faults],
            "appearance": self.appearance,
            "shield": self.shield,
            "config": read_config(self.config),
        }
        return {
            "task": self.task,
            "perception": self.perception,
            "estimator": self.estimator,
            "scene": self.scene,
            "robot": self.robot,
            "n_workers": self.n_workers,
            "control": self.control,
            **{name: value for name, value in given.items() if value},
        }


def cameras_named(words: Sequence[str]) -> str | list[int | str]:
    """A rig's name or file, or a list of cameras' names and numbers."""
    if len(words) == 1:
        from hrc_env.scene.rigs import RIGS  # here: it imports the simulator

        if words[0].endswith(".toml") or words[0] in RIGS:
            return words[0]
    return [int(word) if word.isdigit() else word for word in words]


def read_config(words: Sequence[str]) -> dict[str, Any]:
    """A nested mapping of changes from FIELD=VALUE and files; later ones win.

    Raises:
        ConfigError: neither, or a file that cannot be read.
    """
    config: dict[str, Any] = {}
    for word in words:
        config = merged(config, _assigned(word) if "=" in word else _in_file(Path(word)))
    return config


def merged(one: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    """Both nested mappings; where both say something, the other."""
    both = {**one, **other}
    for name in one.keys() & other.keys():
        if isinstance(one[name], Mapping) and isinstance(other[name], Mapping):
            both[name] = merged(one[name], other[name])
    return both


def _assigned(word: str) -> dict[str, Any]:
    """The nested mapping that a.b=VALUE is."""
    path, _, text = word.partition("=")
    try:
        value = json.loads(text)
    except json.JSONDecodeError:
        value = text
    return _nested(path.split("."), value)


def _nested(path: Sequence[str], value: Any) -> dict[str, Any]:
    return {path[0]: _nested(path[1:], value) if path[1:] else value}


def _in_file(path: Path) -> dict[str, Any]:
    readers = {".json": json.loads, ".toml": tomllib.loads}
    if path.suffix not in readers:
        raise ConfigError(
            f"--config takes FIELD=VALUE, as reward.proximity=0, or a .json or .toml file, "
            f"got {str(path)!r}."
        )
    try:
        content = readers[path.suffix](path.read_text())
    except (OSError, ValueError) as error:  # the readers' errors are ValueErrors
        raise ConfigError(f"--config {path} cannot be read: {error}.") from error
    if not isinstance(content, dict):
        raise ConfigError(f"--config {path} must hold names and values, got {content!r}.")
    return content


def _fault(text: str) -> dict[str, Any]:
    try:
        fault = json.loads(text)
    except json.JSONDecodeError:
        fault = None
    if not isinstance(fault, dict):
        raise ConfigError(
            "--faults takes JSON objects, as "
            '\'{"kind": "late", "cameras": ["camera_1"], "amount": 0.2}\', '
            f"got {text!r}. docs/cameras.md"
        )
    return fault
