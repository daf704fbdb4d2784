"""The options of a command, as words: unknown ones are answered with the nearest, and switches may
be given in either of two ways."""

import difflib
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

import tyro

from hrc_env.core.errors import ConfigError, unknown

BOOLEANS = {"true": True, "false": False}
ALWAYS = ("help",)


def understood(command: type[Any], words: Sequence[str], program: str) -> list[str]:
    """Return a command's words as its parser takes them.

    Switches may come with a value: `--film False` is `--no-film`, `--film True` is `--film`; those
    that can be left open, too: `--no-her` is `--her False`.

    Args:
        command: the record that the words are to fill.
        words: that were given.
        program: how the command is called.

    Raises:
        ConfigError: an option that there is not, with the nearest; or a switch with another value.
    """
    given, found = [*words], list[str]()
    while given and given[0] == "--":
        given.pop(0)
    while (kinds := _subcommands(command)) and given and not given[0].startswith("-"):
        found.append(given.pop(0))
        if found[-1] not in kinds:
            raise unknown("command", found[-1], kinds)
        command, program = kinds[found[-1]], f"{program} {found[-1]}"
    options = _options(command)
    switches = {name for name, kind in options.items() if kind is bool}
    left_open = {name for name, kind in options.items() if _members(kind) == {bool, NoneType}}
    while given:
        word = given.pop(0)
        if not word.startswith("--") or _subcommands(command):
            found.append(word)
            continue
        said, equals, text = word.removeprefix("--").partition("=")
        name, is_off = said.replace("_", "-"), False
        if name.startswith("no-") and name[3:] in switches | left_open:
            name, is_off = name[3:], True
        if name not in {*options, *ALWAYS}:
            raise _unknown(f"--{said}", options, program)
        if name not in switches | left_open:
            found.append(word)
            continue
        if not equals and given and given[0].lower() in {*BOOLEANS, "none"}:
            equals, text = " ", given.pop(0)
        if text.lower() == "none" and name in left_open and not is_off:
            continue  # which is what it is if it is not given
        if equals and (text.lower() not in BOOLEANS or is_off):
            raise ConfigError(
                f"--{name} takes True or False, or nothing: --{name}, --no-{name}; got {word!r}"
                f"{f' {text!r}' if equals == ' ' else ''}."
            )
        is_on = BOOLEANS.get(text.lower(), True) and not is_off
        if name in left_open:
            found += [f"--{name}", str(is_on)]
        else:
            found.append(f"--{name}" if is_on else f"--no-{name}")
    return found


def _unknown(option: str, options: dict[str, Any], program: str) -> ConfigError:
    names = [f"--{name}" for name in options]
    names += [f"--no-{name}" for name, kind in options.items() if kind is bool]
    near = difflib.get_close_matches(option.replace("_", "-"), names, n=1)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    return ConfigError(f"Unknown option {option!r}.{hint} {program} --help lists all.")


def _options(command: type[Any]) -> dict[str, Any]:
    """Return the kinds of a record's fields by the names of their options."""
    hints = get_type_hints(command, include_extras=True)
    named = {each.name: hints[each.name] for each in fields(command) if each.init}
    return {
        name.replace("_", "-"): _bare(kind)
        for name, kind in named.items()
        if tyro.conf.Positional not in getattr(kind, "__metadata__", ())
    }


def _subcommands(command: type[Any]) -> dict[str, type[Any]]:
    """Return the records one of which a record is about, by their words; of most none."""
    for kind in get_type_hints(command, include_extras=True).values():
        if get_origin(kind) is Annotated:
            continue
        members = [each for each in get_args(kind) if is_dataclass(_bare(each))]
        if members:
            return {_word_of(each): _bare(each) for each in members}
    return {}


def _word_of(kind: Any) -> str:
    """Return the word that `tyro.conf.subcommand` gave to a record."""
    named = (getattr(each, "name", None) for each in getattr(kind, "__metadata__", ()))
    return next(name for name in named if name)


def _members(kind: Any) -> set[Any]:
    return set(get_args(kind)) if get_origin(kind) in (Union, UnionType) else {kind}


def _bare(kind: Any) -> Any:
    return get_args(kind)[0] if get_origin(kind) is Annotated else kind
