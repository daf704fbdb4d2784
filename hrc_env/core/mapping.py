"""Conversion between settings and plain mappings or TOML files."""

import dataclasses
import enum
import json
import math
import re
import tomllib
import types
import typing
from collections.abc import Mapping
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from hrc_env.core.errors import ConfigError, make_unknown_name_error
from hrc_env.core.typing import is_array, is_list_or_tuple, is_mapping, is_numpy_scalar

RecordT = TypeVar("RecordT")
PRESETS: dict[Any, dict[str, Any]] = {}
"""Named values of settings: for each type hint, a mapping from the accepted names to their
values."""
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def answer_unknown_fields(record: type[RecordT]) -> type[RecordT]:
    """Make a dataclass raise `ConfigError` instead of `TypeError` for an unknown keyword.

    The error names the nearest field, or the current name of a renamed field; a class may list
    renamed fields in `RENAMED: ClassVar[Mapping[str, str]]`, new names by old names.
    """
    init = record.__init__
    names = frozenset(each.name for each in dataclasses.fields(record))  # type: ignore[arg-type]

    @wraps(init)
    def checked(self: RecordT, *args: Any, **values: Any) -> None:
        for name in values:
            if name not in names:
                raise _unknown_field(record, f"field of {record.__name__}", "", name)
        init(self, *args, **values)

    record.__init__ = checked  # type: ignore[method-assign]
    return record


def from_mapping(
    kind: type[RecordT],
    mapping: Mapping[str, Any],
    path: str = "",
    kinds: Mapping[str, type] | None = None,
) -> RecordT:
    """Make a dataclass from a mapping; nested dataclasses may be mappings, and tuples may be lists.

    Args:
        kind: the dataclass.
        mapping: values by field.
        path: prefix of the field names in error messages.
        kinds: types of fields whose hints in the dataclass leave the type open.

    Numbers must be finite, except for fields that `kind.MAY_BE_NAN` names.

    Raises:
        ConfigError: a field is unknown or missing, its value has the wrong type or length, or the
            dataclass rejects it; the message contains the path, as in `scene.cameras[0].name`.
    """
    hints = {**typing.get_type_hints(kind), **(kinds or {})}
    fields = dataclasses.fields(kind)  # type: ignore[arg-type]
    names = [f"{path}{each.name}" for each in fields]
    values: dict[str, Any] = {}
    for name, value in mapping.items():
        where = f"{path}{name}"
        if where not in names:
            raise _unknown_field(kind, "config field", path, name)
        is_nan = isinstance(value, float) and math.isnan(value)
        if is_nan and name in getattr(kind, "MAY_BE_NAN", ()):
            values[name] = value
        else:
            values[name] = convert_to_hint(hints[name], value, where)
    for each in fields:
        nothing = each.default is each.default_factory is dataclasses.MISSING
        if nothing and each.name not in values:
            raise ConfigError(f"Config field {path}{each.name} is missing and has no default.")
    try:
        return kind(**values)
    except ConfigError as error:
        raise _located(error, kind, path) from error


def _unknown_field(record: type, what: str, path: str, name: str) -> ConfigError:
    """Return the error for a field that is unknown or was renamed."""
    renamed = getattr(record, "RENAMED", {})
    if name in renamed:
        return ConfigError(f"The {what} {path}{name} is called {path}{renamed[name]} now.")
    names = [f"{path}{each.name}" for each in dataclasses.fields(record)]
    return make_unknown_name_error(what, f"{path}{name}", names)


def convert_to_hint(hint: Any, value: Any, where: str) -> Any:
    """Return a value converted to a type hint, or raise `ConfigError` with the path `where`."""
    if isinstance(value, str) and (presets := PRESETS.get(hint, {})):
        if value not in presets:
            raise make_unknown_name_error(where, value, presets)
        return presets[value]
    if dataclasses.is_dataclass(hint):
        if is_mapping(value):
            return from_mapping(typing.cast(type[Any], hint), value, f"{where}.")
        is_it = isinstance(value, typing.cast(type, hint))
        return _checked(is_it, f"{_name_or(hint)}a mapping", value, where)
    if isinstance(hint, types.UnionType):
        return _one_of(typing.get_args(hint), value, where)
    if typing.get_origin(hint) is tuple:
        return _tuple(hint, value, where)
    if is_numpy_scalar(value):
        value = value.item()
    if hint is str and isinstance(value, Path):
        return str(value)
    if hint is Path:
        return _checked(isinstance(value, str | Path), "a path", value, where)
    if hint is float:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        finite = is_number and math.isfinite(typing.cast(float, value))
        return float(_checked(finite, "a finite number", value, where))
    if hint is int:
        whole = isinstance(value, int) and not isinstance(value, bool)
        return _checked(whole, "a whole number", value, where)
    if hint in (bool, str):
        return _checked(isinstance(value, hint), f"a {hint.__name__}", value, where)
    return value


def _name_or(hint: Any) -> str:
    """Return the preset names that a field accepts, as the beginning of an error message."""
    presets = PRESETS.get(hint, {})
    return f"a name ({', '.join(map(repr, presets))}) or " if presets else ""


def _one_of(hints: tuple[Any, ...], value: Any, where: str) -> Any:
    """Return a value converted to the first hint that fits; the error lists all hints."""
    refused: list[str] = []
    for hint in hints:
        try:
            return convert_to_hint(hint, value, where)
        except ConfigError as error:
            refused.append(str(error))
    raise ConfigError(" Or: ".join(refused))


def _tuple(hint: Any, value: Any, where: str) -> tuple[Any, ...]:
    """Return a tuple whose elements are converted to their hints, or raise `ConfigError`."""
    _checked(isinstance(value, list | tuple), f"{_name_or(hint)}a list", value, where)
    inner = typing.get_args(hint)
    hints = [inner[0]] * len(value) if inner[-1] is Ellipsis else list(inner)
    _checked(len(value) == len(hints), f"{len(hints)} values", value, where)
    return tuple(
        convert_to_hint(hint, part, f"{where}[{k}]")
        for k, (hint, part) in enumerate(zip(hints, value, strict=True))
    )


def merge(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Return two nested mappings merged into one; values of `above` take precedence."""
    both = {**below, **above}
    for name in below.keys() & above.keys():
        if isinstance(below[name], Mapping) and isinstance(above[name], Mapping):
            both[name] = merge(below[name], above[name])
    return both


def convert_to_plain(value: Any) -> Any:
    """Return a value converted to JSON types if possible.

    Paths become strings; NumPy scalars and enumerations become their values. Other objects (a
    recorded clip, a function) are returned unchanged; `for_json` rejects them.
    """
    if is_mapping(value):
        return {name: convert_to_plain(each) for name, each in value.items()}
    if is_list_or_tuple(value):
        return type(value)(map(convert_to_plain, value))
    if is_array(value) or is_numpy_scalar(value):
        return value.tolist()
    if isinstance(value, enum.Enum):
        return value.value
    return str(value) if isinstance(value, Path) else value


def for_json(value: Any, where: str) -> Any:
    """Return a value converted to JSON types, with records as mappings of their fields.

    Raises:
        ConfigError: a part has no JSON form, such as a function, a class or a recording; the
            message contains its path.
    """
    value = convert_to_plain(value)
    if is_mapping(value):
        return {name: for_json(each, f"{where}.{name}") for name, each in value.items()}
    if is_list_or_tuple(value):
        return [for_json(each, f"{where}[{k}]") for k, each in enumerate(value)]
    if dataclasses.is_dataclass(value) and not callable(value):
        parts = {each.name: getattr(value, each.name) for each in dataclasses.fields(value)}
        if not any(isinstance(part, np.ndarray) for part in parts.values()):
            return for_json(parts, where)
    if value is not None and not isinstance(value, bool | int | float | str):
        raise ConfigError(f"{where} is a {type(value).__name__}, which JSON cannot represent.")
    return value


def read_toml(path: str | Path) -> dict[str, Any]:
    """Return the content of a TOML file, or raise `ConfigError`."""
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"The file {path} cannot be read: {error}.") from error
    except ValueError as error:  # from tomllib or the decoder
        raise ConfigError(f"{path} is not valid TOML: {error}") from error


def to_toml(content: Mapping[str, Any], path: str = "") -> str:
    """Return nested mappings, lists, strings, numbers and booleans as TOML; None is omitted."""
    lines: list[str] = []
    tables: list[str] = []
    for name, value in content.items():
        key = name if _BARE.fullmatch(name) else json.dumps(name)
        if is_mapping(value):
            tables.append(f"[{path}{key}]\n{to_toml(value, f'{path}{key}.')}")
        elif is_list_or_tuple(value) and value and is_mapping(value[0]):
            for each in value:
                tables.append(f"[[{path}{key}]]\n{to_toml(each, f'{path}{key}.')}")
        elif value is not None:
            lines.append(f"{key} = {_value(value, path + key)}\n")
    return "\n".join(["".join(lines), *tables] if lines else tables)


def _value(value: Any, where: str) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, int | float):
        return repr(value)
    if is_list_or_tuple(value):
        return f"[{', '.join(_value(each, where) for each in value)}]"
    raise ConfigError(f"{where} cannot be written to a file: {value!r}.")


def _located(error: ConfigError, kind: type, path: str) -> ConfigError:
    """Return the error of a dataclass with the names of fields replaced by their paths.

    Names with an underscore are replaced anywhere, others only at the beginning of the message.
    """
    if not path:
        return error
    said = str(error).removeprefix(f"{kind.__name__}.")
    names = [each.name for each in dataclasses.fields(kind)]
    long = "|".join(name for name in names if "_" in name) or "(?!)"
    pattern = rf"^(?:{'|'.join(names)})\b|(?<![\w.'\"])(?:{long})\b(?!['\"])"
    located = re.sub(pattern, lambda found: f"{path}{found[0]}", said)
    if path not in located:
        located = f"{path.rstrip('.')}: {located}"
    return type(error)(located)


def _checked(good: bool, expected: str, value: Any, where: str) -> Any:
    if not good:
        raise ConfigError(f"Config field {where} must be {expected}, got {value!r}.")
    return value
