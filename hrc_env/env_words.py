"""Arguments of an environment on the command line."""

import json
from collections.abc import Callable, Sequence
from dataclasses import Field, field, fields, make_dataclass
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import tyro

from hrc_env.core.docstrings import field_docs
from hrc_env.core.errors import ConfigError
from hrc_env.core.mapping import merge, read_toml
from hrc_env.env_config import EnvConfig

FAULT = """'{"kind": "late", "cameras": ["camera_1"], "amount": 0.2}'"""


def read_cameras(words: Sequence[str]) -> Any:
    """Return the value of `cameras=`.

    It is a rig's name or file, the mapping of a distribution of rigs, or a list of cameras: names,
    numbers and mappings.
    """
    if len(words) == 1:
        from hrc_env.scene.rig_distribution import (
            RigDistribution,
        )  # here, as it imports the simulator
        from hrc_env.scene.rigs import RIGS

        if words[0].endswith(".toml") or words[0] in RIGS:
            return words[0]
        value = read_word(words[0])
        names = {each.name for each in fields(RigDistribution)} | RigDistribution.RENAMED.keys()
        if isinstance(value, dict) and value.keys() <= names:
            return value
    return [int(word) if word.isdigit() else read_word(word) for word in words]


def read_config(words: Sequence[str]) -> dict[str, Any]:
    """Return a nested mapping of changes from FIELD=VALUE and TOML files; later ones win."""
    config: dict[str, Any] = {}
    for word in words:
        if "=" not in word and not word.endswith(".toml"):
            raise ConfigError(
                f"--config takes FIELD=VALUE, as reward.proximity=0, or a .toml file, got {word!r}."
            )
        config = merge(config, _read_assignment(word) if "=" in word else read_toml(word))
    return config


def _read_assignment(word: str) -> dict[str, Any]:
    """Return the nested mapping for a.b=VALUE."""
    path, _, text = word.partition("=")
    value = _read_value(text)
    for name in reversed(path.split(".")):
        value = {name: value}
    return value


def _read_fault(text: str) -> dict[str, Any]:
    """Return the mapping of a fault, or raise `ConfigError` if the text is none."""
    fault = _read_value(text)
    if not isinstance(fault, dict):
        raise ConfigError(f"--faults takes JSON objects, as {FAULT}, got {text!r}.")
    return fault


def _read_value(text: str) -> Any:
    """Return the value of a text in JSON, or else the text."""
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text


def read_word(word: str | None) -> Any:
    """Return the value of a JSON object, or else the word."""
    return _read_value(word) if word and word.startswith("{") else word


def _read_counts(words: Sequence[str]) -> Any:
    """Return one value, or several, such as the fewest and the most workers."""
    values = [_read_value(word) for word in words]
    return values[0] if len(values) == 1 else values


READERS: dict[str, Callable[[Any], Any]] = {
    "cameras": read_cameras,
    "n_workers": _read_counts,
    "config": read_config,
    "observe_images": _read_counts,
    "faults": lambda words: [_read_fault(text) for text in words],
}
"""Functions that make an argument from words, if it is no value or list of values."""
AGENTS_OWN = ("control",)
"""Arguments whose default is the agent's."""
ON_THE_COMMAND_LINE = {
    "faults": "Each is a JSON object.",
    "cameras": "A RigDistribution is a JSON object.",
    "observe_images": "Here: HEIGHT WIDTH, or a JSON object.",
    "people": "--config motion.people.FIELD=VALUE changes one thing.",
    "appearance": "--config appearance.FIELD=VALUE changes one thing.",
    "control": "If not given: the agent's own, or joint.",
    "config": "Here: FIELD=VALUE as in reward.proximity=0 (a value is JSON, or else text), or "
    ".toml files; later ones win.",
}
"""Further sentences about arguments in the help of commands."""


def _read(each: Field[Any], words: Any) -> Any:
    """Return the value of an argument from its words."""
    if each.name in READERS:
        return READERS[each.name](words)
    return [read_word(str(word)) for word in words] if _is_many(each) else read_word(words)


def _is_many(each: Field[Any]) -> bool:
    """Return whether an argument takes several words."""
    return bool(each.metadata.get("many"))


def _arguments() -> list[Field[Any]]:
    """Return the fields of `EnvConfig` that commands take."""
    return [each for each in fields(EnvConfig) if each.metadata.get("words", True)]


class Option(NamedTuple):
    """A field of a command, as `make_dataclass` takes it."""

    name: str
    """Name of the field."""
    annotation: Any
    """Type of its words, with their help."""
    default: Any
    """Default of its words."""


def _options() -> list[Option]:
    """Return the arguments of an environment as fields of a command."""
    docs, options = field_docs(EnvConfig), list[Option]()
    for each in _arguments():
        kind: Any = tuple[str, ...] if _is_many(each) else str | None
        shown = isinstance(each.default, str) and each.name not in AGENTS_OWN
        default: Any = () if _is_many(each) else each.default if shown else None
        text = f"{docs[each.name]} {ON_THE_COMMAND_LINE.get(each.name, '')}".strip()
        option = Annotated[kind, tyro.conf.arg(help=text)]
        options.append(Option(each.name, option, field(default=default)))
    return options


class _Command:
    """Base of commands that make an environment."""

    def keywords(self) -> dict[str, Any]:
        """Return keyword arguments of `HRCEnv`: lists, mappings, text and numbers only."""
        given = {each.name: _read(each, getattr(self, each.name)) for each in _arguments()}
        return {name: value for name, value in given.items() if value not in (None, [], {})}


if TYPE_CHECKING:

    class EnvironmentArguments(EnvConfig, _Command):
        """Arguments of an environment on the command line."""

else:
    EnvironmentArguments = make_dataclass(
        "EnvironmentArguments",
        _options(),
        bases=(_Command,),
        frozen=True,
        kw_only=True,
        namespace={"__doc__": "Arguments of an environment on the command line."},
    )
    EnvironmentArguments.__module__ = __name__
