"""Policies as submitted: a name of the package, or files with their digest.

The files are read without executing anything. The policy's process receives copies of exactly the
files that the digest covers (`separate`).
"""

import hashlib
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path

from hrc_env import __version__
from hrc_env.core.errors import ConfigError

from . import policies
from .interface import Interface
from .registry import AGENTS, check_agent, find_interface, is_checkpoint, is_policy

MOST_BYTES = 1 << 29
"""Maximum size of all files of a policy [bytes]."""


@dataclass(frozen=True, slots=True)
class Submission:
    """A policy with its files."""

    policy: str
    """The policy, as `hrc_env.agents.registry.make_agent` accepts it."""
    name: str
    """The same for a process that has the files in its working directory."""
    files: Mapping[str, bytes] = field(default_factory=dict[str, bytes], repr=False)
    """Content of the files by path; empty for an agent without files."""
    interface: Interface = field(default_factory=Interface)
    """Settings of an environment that a file of the policy states to be necessary."""

    @property
    def sha256(self) -> str:
        """SHA-256 digest of the policy.

        It is the digest of a single file. Of several files, it is the digest of the lines that
        `sha256sum` prints for them, sorted by path; of an agent without files, that of its name
        with the version of this package.
        """
        if not self.files:
            return _hash(f"{self.policy} of hrc_env {__version__}".encode())
        digests = {path: _hash(content) for path, content in sorted(self.files.items())}
        if len(digests) == 1:
            return next(iter(digests.values()))
        return _hash("".join(f"{each}  {path}\n" for path, each in digests.items()).encode())


def read_submission(policy: str, beside: Path | None = None) -> Submission:
    """Read the files of a policy.

    A file of `train`, `export` or Stable-Baselines3 is itself the policy; one with a model card
    consists of two files. The files of MODULE:FUNCTION are the module, or the whole package that
    contains it.

    Args:
        policy: the policy as `hrc_env.agents.registry.make_agent` accepts it.
        beside: folder in which its files may lie instead of their own place; None for none.

    Raises:
        ConfigError: the policy or its module does not exist, or its files are too large.
        CheckpointError: the policy is damaged.
    """
    if beside is not None and not Path(policy).exists():
        other = beside / Path(policy).name
        policy = str(other) if other.is_file() else policy
    is_file = is_policy(policy) or is_checkpoint(policy)
    if policy not in AGENTS and ":" in policy and not is_file:
        return Submission(policy, policy, _read_module(policy, beside))
    check_agent(policy)
    interface = find_interface(policy)
    if policy in AGENTS:
        return Submission(policy, policy)
    path = policies.find_path(policy)
    paths = (path, path.with_suffix(".json")) if is_policy(policy) else (path,)
    files = {each.name: _read(each) for each in paths}
    return Submission(policy, policy if policy.startswith(policies.PREFIX) else path.name, files,
                      interface)  # fmt: skip


def _read_module(policy: str, beside: Path | None) -> dict[str, bytes]:
    """Return the files of a module, or of the package that contains it, without importing it."""
    module = policy.partition(":")[0]
    if module.partition(".")[0] == "hrc_env":  # the process of the policy has this package
        return {}
    places = [os.getcwd(), *([] if beside is None else [str(beside)]), *sys.path]
    top = PathFinder.find_spec(module.partition(".")[0], places)
    if top is None or top.origin is None or not top.origin.endswith(".py"):
        raise ConfigError(
            f"There is no policy {policy!r}: no file {module.replace('.', '/')}.py in the working "
            "directory or on Python's path. It must be MODULE:FUNCTION: a module or a package with "
            "an __init__.py, which contains a function that takes an EnvInfo and returns an agent."
        )
    origin = Path(top.origin)
    files = _list_files(top, origin)
    total = sum(path.stat().st_size for path in files.values())
    if total > MOST_BYTES:
        raise ConfigError(
            f"The files of {policy!r} have {total:,} bytes, and at most {MOST_BYTES:,} are "
            f"allowed: move the policy to a module of its own, outside of {origin.parent}."
        )
    return {name: _read(path) for name, path in files.items()}


def _list_files(top: ModuleSpec, origin: Path) -> dict[str, Path]:
    """Return the files of a module or package by their paths below its parent folder."""
    if top.submodule_search_locations is None:
        return {origin.name: origin}
    paths = (path for path in origin.parent.rglob("*") if "__pycache__" not in path.parts)
    found = {str(path.relative_to(origin.parents[1])): path for path in paths if path.is_file()}
    if links := [name for name, path in found.items() if path.is_symlink()]:
        raise ConfigError(f"{links[0]} must be a file of its own, but is a symbolic link.")
    return found


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}.") from error


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
