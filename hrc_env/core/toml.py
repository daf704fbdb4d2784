"""Settings in TOML files: read with errors that name the file, written so that they come back."""

import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hrc_env.core.errors import ConfigError

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def read_toml(path: str | Path) -> dict[str, Any]:
    """The content of a TOML file; `ConfigError` without one."""
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"The file {path} cannot be read: {error}.") from error
    except ValueError as error:  # what tomllib and the decoder raise
        raise ConfigError(f"{path} must be TOML; reading it ended with: {error}") from error


def to_toml(content: Mapping[str, Any], path: str = "") -> str:
    """TOML of nested mappings, lists, text, numbers and truth values; None is left out."""
    lines, tables = [], []
    for name, value in content.items():
        key = name if _BARE.fullmatch(name) else json.dumps(name)
        if isinstance(value, Mapping):
            tables.append(f"[{path}{key}]\n{to_toml(value, f'{path}{key}.')}")
        elif isinstance(value, list | tuple) and value and isinstance(value[0], Mapping):
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
    if isinstance(value, list | tuple):
        return f"[{', '.join(_value(each, where) for each in value)}]"
    raise ConfigError(f"{where} cannot be written to a file: {value!r}.")
