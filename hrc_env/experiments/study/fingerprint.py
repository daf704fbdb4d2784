"""What a finished part depends on: settings, code, data and libraries, by their content."""

import ast
import hashlib
import inspect
import json
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import hrc_env
from hrc_env.core.results import versions

OURS = ("hrc_env", "agents", "benchmarks", "assets")
"""Packages of this repository; where it is installed, others lie beside them."""
_PACKAGE = Path(hrc_env.__file__).resolve().parent
_CODE = {".py", ".pyc"}
_NO_DATA = ("__pycache__", "experiments/benchmark/entries")
"""Folders from which nothing is made: compiled code and the leaderboard's entries."""


def fingerprint_of(settings: Mapping[str, Any], *modules: str) -> str:
    """What a part depends on, as a word: settings, the modules that make it (dotted names), what
    these import of this repository, directly or not, all data files and the libraries' versions.

    Raises:
        ModuleNotFoundError: a module is not of this repository.
    """
    digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode())
    for path in sorted(sources_of(*modules)):
        digest.update(path.read_bytes())
    digest.update(_surroundings().encode())
    return digest.hexdigest()[:16]


def sources_of(*modules: str) -> set[Path]:
    """The files of modules and of everything of this repository that they import, in time."""
    found, todo, asked = set[Path](), set(modules), set[str]()
    while todo:
        asked.add(name := todo.pop())
        if path := _file(name):
            found.add(path)
            todo |= _imports(path) - asked
        elif name in modules:
            raise ModuleNotFoundError(f"{name} is no module of this repository.", name=name)
    return found


def _file(name: str) -> Path | None:
    """The source of a module, in a clone or an installed package; None if it is another's."""
    parts = name.split(".")
    if parts[0] not in OURS:
        return None
    is_inside = parts[0] == "agents" and (_PACKAGE / "agents").is_dir()
    path = (_PACKAGE if is_inside else _PACKAGE.parent).joinpath(*parts)
    files = path.with_suffix(".py"), path / "__init__.py"
    return next(filter(Path.is_file, files), None)


@cache
def _imports(path: Path) -> frozenset[str]:
    """Modules, and names that may be modules, that a file imports anywhere in it."""
    found: set[str] = set()
    folders = path.relative_to(_PACKAGE.parent).parent.parts
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            inside = folders[: len(folders) - node.level + 1] if node.level else ()
            module = ".".join(filter(None, (*inside, node.module)))
            found |= {module, *(f"{module}.{alias.name}" for alias in node.names)}
    return frozenset(found)


def source_digest(made: Any) -> str:
    """Of the file that defines what somebody may have registered; "" where nobody can tell."""
    try:
        return hashlib.sha256(Path(inspect.getfile(made)).read_bytes()).hexdigest()
    except (OSError, TypeError):
        return ""


@cache
def _surroundings() -> str:
    """Versions of Python and libraries, and the content of every data file from which something is
    made."""
    from hrc_env.worker.body import assets_dir  # here: --help of a command imports no compiler

    digest = hashlib.sha256(json.dumps({"python": sys.version} | versions()).encode())
    for root in sorted({assets_dir(), _PACKAGE}):
        for path in sorted(root.rglob("*")):
            is_made_from = not any(name in path.as_posix() for name in _NO_DATA)
            if path.is_file() and path.suffix not in _CODE and is_made_from:
                digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()
