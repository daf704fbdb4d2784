"""Normalization of a command's options, and suggestions for unknown ones."""

import difflib
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

import tyro

from hrc_env.core.errors import ConfigError, make_unknown_name_error

BOOLEANS = {"true": True, "false": False}
ALWAYS = ("help",)


def normalize_words(command: type[Any], words: Sequence[str], program: str) -> list[str]:
    """Return a command's arguments in the form that its parser takes.

    Switches may have a value: `--film False` becomes `--no-film`, and `--film True` becomes
    `--film`. For switches that can also be None, `--no-her` becomes `--her False`.

    Args:
        command: the dataclass that the arguments fill.
        words: the arguments of the command line.
        program: the command as it is called, for error messages.

    A command may list renamed options in `RENAMED: ClassVar[Mapping[str, str]]`, new names by old
    names.

    Raises:
        ConfigError: an option does not exist (the message suggests the nearest one, or gives the
            current name of a renamed one), or a switch has a value other than True and False.
    """
    given, result = [*words], list[str]()
    while given and given[0] == "--":
        given.pop(0)
    while (kinds := _find_subcommands(command)) and given and not given[0].startswith("-"):
        result.append(given.pop(0))
        if result[-1] not in kinds:
            raise make_unknown_name_error("command", result[-1], kinds)
        command, program = kinds[result[-1]], f"{program} {result[-1]}"
    options = _find_options(command)
    switches = {name for name, kind in options.items() if kind is bool}
    optional = {name for name, kind in options.items() if _list_members(kind) == {bool, NoneType}}
    while given:
        word = given.pop(0)
        if not word.startswith("--") or _find_subcommands(command):
            result.append(word)
            continue
        option, equals, text = word.removeprefix("--").partition("=")
        name, is_off = option.replace("_", "-"), False
        if name in (renamed := getattr(command, "RENAMED", {})):
            raise ConfigError(f"The option --{name} is called --{renamed[name]} now.")
        if name.startswith("no-") and name[3:] in switches | optional:
            name, is_off = name[3:], True
        if name not in {*options, *ALWAYS}:
            raise _make_unknown_error(f"--{option}", options, program)
        if name not in switches | optional:
            result.append(word)
            continue
        if not equals and given and given[0].lower() in {*BOOLEANS, "none"}:
            equals, text = " ", given.pop(0)
        if text.lower() == "none" and name in optional and not is_off:
            continue  # the default
        if equals and (text.lower() not in BOOLEANS or is_off):
            raise ConfigError(
                f"--{name} takes True, False or no value (--{name}, --no-{name}); got "
                f"{word!r}{f' {text!r}' if equals == ' ' else ''}."
            )
        is_on = BOOLEANS.get(text.lower(), True) and not is_off
        if name in optional:
            result += [f"--{name}", str(is_on)]
        else:
            result.append(f"--{name}" if is_on else f"--no-{name}")
    return result


def _make_unknown_error(option: str, options: dict[str, Any], program: str) -> ConfigError:
    names = [f"--{name}" for name in options]
    names += [f"--no-{name}" for name, kind in options.items() if kind is bool]
    near = difflib.get_close_matches(option.replace("_", "-"), names, n=1)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    return ConfigError(f"Unknown option {option!r}.{hint} {program} --help lists all options.")


def _find_options(command: type[Any]) -> dict[str, Any]:
    """Return the types of a command's options by name."""
    hints = get_type_hints(command, include_extras=True)
    named = {each.name: hints[each.name] for each in fields(command) if each.init}
    return {
        name.replace("_", "-"): _strip_annotation(kind)
        for name, kind in named.items()
        if tyro.conf.Positional not in getattr(kind, "__metadata__", ())
    }


def _find_subcommands(command: type[Any]) -> dict[str, type[Any]]:
    """Return the dataclasses of a command's subcommands by name, or {} if it has none."""
    for kind in get_type_hints(command, include_extras=True).values():
        if get_origin(kind) is Annotated:
            continue
        members = [each for each in get_args(kind) if is_dataclass(_strip_annotation(each))]
        if members:
            return {_read_name(each): _strip_annotation(each) for each in members}
    return {}


def _read_name(kind: Any) -> str:
    """Return the name that `tyro.conf.subcommand` gave to a subcommand."""
    named = (getattr(each, "name", None) for each in getattr(kind, "__metadata__", ()))
    return next(name for name in named if name)


def _list_members(kind: Any) -> set[Any]:
    return set(get_args(kind)) if get_origin(kind) in (Union, UnionType) else {kind}


def _strip_annotation(kind: Any) -> Any:
    return get_args(kind)[0] if get_origin(kind) is Annotated else kind
