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
    """Parse the words of `--cameras` into a value of the argument `cameras`.

    The value is the name or path of a rig, the mapping of a distribution of rigs, or a list of
    names, indices and mappings of cameras.
    """
    if len(words) == 1:
        from hrc_env.scene.rig_distribution import (
            RigDistribution,
        )  # here, because it imports the simulator
        from hrc_env.scene.rigs import RIGS

        if words[0].endswith(".toml") or words[0] in RIGS:
            return words[0]
        value = read_word(words[0])
        names = {each.name for each in fields(RigDistribution)} | RigDistribution.RENAMED.keys()
        if isinstance(value, dict) and value.keys() <= names:
            return value
    return [int(word) if word.isdigit() else read_word(word) for word in words]


def read_config(words: Sequence[str]) -> dict[str, Any]:
    """Parse FIELD=VALUE words and TOML files into a nested mapping; later words take precedence."""
    config: dict[str, Any] = {}
    for word in words:
        if "=" not in word and not word.endswith(".toml"):
            raise ConfigError(
                "--config takes FIELD=VALUE, such as reward.proximity=0, or a .toml file, got "
                f"{word!r}."
            )
        config = merge(config, _read_assignment(word) if "=" in word else read_toml(word))
    return config


def _read_assignment(word: str) -> dict[str, Any]:
    """Parse a.b=VALUE into a nested mapping."""
    path, _, text = word.partition("=")
    value = _read_value(text)
    for name in reversed(path.split(".")):
        value = {name: value}
    return value


def _read_fault(text: str) -> dict[str, Any]:
    """Parse the mapping of a fault, or raise `ConfigError` if the text is not a JSON object."""
    fault = _read_value(text)
    if not isinstance(fault, dict):
        raise ConfigError(f"--faults takes JSON objects, such as {FAULT}, got {text!r}.")
    return fault


def _read_value(text: str) -> Any:
    """Parse a text as JSON, or return the text itself if it is not JSON."""
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text


def read_word(word: str | None) -> Any:
    """Parse a word as a JSON object if it begins with a brace; otherwise return the word itself."""
    return _read_value(word) if word and word.startswith("{") else word


def _read_counts(words: Sequence[str]) -> Any:
    """Parse one word into a value, or several words into a list, such as the bounds on workers."""
    values = [_read_value(word) for word in words]
    return values[0] if len(values) == 1 else values


READERS: dict[str, Callable[[Any], Any]] = {
    "cameras": read_cameras,
    "n_workers": _read_counts,
    "config": read_config,
    "observe_images": _read_counts,
    "faults": lambda words: [_read_fault(text) for text in words],
}
"""Parsers of arguments that need special treatment, by name of the argument."""
AGENTS_OWN = ("control",)
"""Arguments with a default that the agent determines."""
ON_THE_COMMAND_LINE = {
    "faults": "On the command line, each fault is a JSON object.",
    "cameras": "On the command line, a RigDistribution is a JSON object.",
    "observe_images": "On the command line: HEIGHT WIDTH, or a JSON object.",
    "people": "--config motion.people.FIELD=VALUE changes a single setting.",
    "appearance": "--config appearance.FIELD=VALUE changes a single setting.",
    "control": "Default: the control of the agent, or joint.",
    "config": "On the command line: FIELD=VALUE, such as reward.proximity=0 (the value is JSON, "
    "otherwise text), or .toml files; later ones take precedence.",
}
"""Sentences that the help of commands adds to the descriptions of arguments, by name."""


def _read(each: Field[Any], words: Any) -> Any:
    """Parse the words of an argument into its value."""
    if each.name in READERS:
        return READERS[each.name](words)
    return [read_word(str(word)) for word in words] if _is_many(each) else read_word(words)


def _is_many(each: Field[Any]) -> bool:
    """Return whether an argument takes several words."""
    return bool(each.metadata.get("many"))


def _arguments() -> list[Field[Any]]:
    """Return the fields of `EnvConfig` that are options of commands."""
    return [each for each in fields(EnvConfig) if each.metadata.get("words", True)]


class Option(NamedTuple):
    """Field of a command's dataclass, in the order of elements that `make_dataclass` expects."""

    name: str
    """Name of the field."""
    annotation: Any
    """Type of the option's words, annotated with the help text."""
    default: Any
    """Default of the option, before parsing."""


def _options() -> list[Option]:
    """Return the arguments of an environment as fields of a command's dataclass."""
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
    """Base class of commands that make an environment."""

    def keywords(self) -> dict[str, Any]:
        """Return keyword arguments of `HRCEnv` as lists, mappings, texts and numbers."""
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
