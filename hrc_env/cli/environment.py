"""The arguments of an environment, as the commands take them that make one."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from hrc_env.core.errors import ConfigError
from hrc_env.core.mapping import read_toml
from hrc_env.tasks import DEFAULT

FAULT = """'{"kind": "late", "cameras": ["camera_1"], "amount": 0.2}'"""


@dataclass(frozen=True, kw_only=True)
class EnvironmentArguments:
    """What `gymnasium.make` takes; names are in `python -m hrc_env list`."""

    task: str = DEFAULT
    """Which environment, by its id."""
    perception: str = "pixels"
    """What the robot sees with: pixels, keypoints, truth or none."""
    estimator: str = "particle"
    """particle, kalman, paper, paper_restarts, triangulation or ransac."""
    cameras: tuple[str, ...] = ()
    """Names or numbers of cameras of the scene; or a rig: its name or a .toml file. All cameras
    of the scene if not given."""
    scene: str | None = None
    """lab or site; the one that the task is made for if not given."""
    robot: str | None = None
    """ur10e_like, ur10e_gripper, or one that was registered (--import); the task's own if not
    given."""
    n_workers: int | tuple[int, int] | None = None
    """How many workers, as the task is made for if not given; two numbers are the
    fewest and the most, drawn for every episode."""
    people: str | None = None
    """attentive, hurried or unaware; --config motion.people.FIELD=VALUE for more."""
    motions: tuple[Path, ...] = ()
    """Clips (.npz) that workers play, too: python -m hrc_env import-motion."""
    faults: tuple[str, ...] = ()
    """What goes wrong with cameras, each a JSON object:
    '{"kind": "late", "cameras": ["camera_1"], "amount": 0.2}'."""
    appearance: str | None = None
    """as_built, varied, lights, surfaces or people (pixels only; keypoints knows
    appearance.light); --config appearance.FIELD=VALUE for more."""
    control: str | None = None
    """What actions are: joint, velocities of the joints, if not given; tool, of the tool; or twist,
    which turns the tool, too."""
    shield: str | None = None
    """qp, ssm, pfl, or one that was registered (--import); or a JSON object of changes to the
    first: '{"kind": "qp", "margin_m": 0.1}'."""
    config: tuple[str, ...] = ()
    """Changes to the default configuration: FIELD=VALUE as in reward.proximity=0 (a value is
    JSON, or else text), or a .toml file of them. Later ones win. docs/reference/config.md"""

    def keywords(self) -> dict[str, Any]:
        """Keyword arguments of `HRCEnv`, of lists, mappings, text and numbers only."""
        given = {each.name: getattr(self, each.name) for each in fields(EnvironmentArguments)}
        given["cameras"] = cameras_named(self.cameras)
        given["motions"] = [str(path) for path in self.motions]
        given["faults"] = [_fault(text) for text in self.faults]
        given["shield"] = shield_named(self.shield)
        given["config"] = read_config(self.config or ())
        return {name: value for name, value in given.items() if value not in (None, [], {})}


def shield_named(word: str | None) -> str | dict[str, Any] | None:
    """A shield's name, or what a JSON object says of its settings."""
    return _value(word) if word and word.startswith("{") else word


def cameras_named(words: Sequence[str]) -> str | list[int | str]:
    """A rig's name or file, or a list of cameras' names and numbers."""
    if len(words) == 1:
        from hrc_env.scene.rigs import RIGS  # here: it imports the simulator

        if words[0].endswith(".toml") or words[0] in RIGS:
            return words[0]
    return [int(word) if word.isdigit() else word for word in words]


def read_config(words: Sequence[str]) -> dict[str, Any]:
    """A nested mapping of changes from FIELD=VALUE and TOML files; later ones win."""
    config: dict[str, Any] = {}
    for word in words:
        if "=" not in word and not word.endswith(".toml"):
            raise ConfigError(
                f"--config takes FIELD=VALUE, as reward.proximity=0, or a .toml file, got {word!r}."
            )
        config = merged(config, _assigned(word) if "=" in word else read_toml(word))
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
    value = _value(text)
    for name in reversed(path.split(".")):
        value = {name: value}
    return value


def _fault(text: str) -> dict[str, Any]:
    fault = _value(text)
    if not isinstance(fault, dict):
        raise ConfigError(f"--faults takes JSON objects, as {FAULT}, got {text!r}.")
    return fault


def _value(text: str) -> Any:
    """What JSON it is, or else the text."""
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text
