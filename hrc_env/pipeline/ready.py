"""Preparation of a machine for a command: network weights, OpenGL and compiled kernels.

Imports are inside the functions, so that `--help` loads neither the simulator nor the compiler.
"""

import os
import shutil
import subprocess
from collections.abc import Sequence
from typing import NamedTuple

from rich.console import Console

from hrc_env.core.errors import RenderingError
from hrc_env.core.progress import progress_bar


class OpenGL(NamedTuple):
    """The state of OpenGL on a machine."""

    is_ready: bool
    """Whether OpenGL can render pictures."""
    message: str
    """A sentence that describes the state, for users."""


def make_ready(console: Console, level: str, draws: bool = False, installs: bool = False) -> None:
    """Download the weights and compile the kernels that a perception level needs, if missing.

    Args:
        console: console for messages.
        level: perception level.
        draws: whether the command renders pictures at every level.
        installs: whether OpenGL may be installed (see `find_opengl`).

    Raises:
        WeightsError: weights are missing and cannot be fetched.
        RenderingError: OpenGL is needed but not available.
    """
    if level == "pixels":
        fetch_networks(console, is_verbose=False)
    if draws or level == "pixels":
        opengl = find_opengl(console, installs)
        if not opengl.is_ready:
            raise RenderingError(opengl.message)
    compile_kernels(console, level)


def fetch_networks(console: Console, names: Sequence[str] = (), is_verbose: bool = True) -> None:
    """Download missing weights of the default networks and of further networks.

    Args:
        console: console for messages.
        names: names of further networks.
        is_verbose: whether success is reported.
    """
    from hrc_env.perception import weights

    weights.fetch_weights([*weights.ALWAYS, *names])
    if is_verbose:
        console.print(f"[green]ok[/] pose network: official weights in {weights.cache_dir()}")


def find_opengl(console: Console, installs: bool = True) -> OpenGL:
    """Return the state of OpenGL, after installing it if necessary and allowed.

    Args:
        console: console for messages.
        installs: whether Debian's OpenGL packages are installed if OpenGL is not found and the user
            is root.
    """
    from hrc_env.scene import gl

    status = OpenGL(*gl.gl_status())
    is_other = os.environ.get("MUJOCO_GL", "").lower().strip() not in ("", "egl")
    if status.is_ready or is_other or not (installs and _may_install()):
        return status
    console.print(f"Installing OpenGL: {gl.APT_LINE}")
    subprocess.run(["apt-get", "update", "-qq"], check=False)
    apt, install, *packages = gl.APT_LINE.removeprefix("sudo ").split()
    subprocess.run([apt, install, "-qq", "-y", *packages], check=False)
    return OpenGL(*gl.gl_status())


def compile_kernels(console: Console, level: str | None = None, is_verbose: bool = False) -> None:
    """Compile missing kernels, with a progress bar.

    Args:
        console: console for messages.
        level: perception level of which the kernels are compiled that the first steps need; None
            for all kernels of all levels.
        is_verbose: whether success is reported.
    """
    from hrc_env.core.kernels import ahead
    from hrc_env.core.kernels.cache import folder

    wanted = None if level is None else level + ahead.FIRST
    if n_missing := len(ahead.missing(wanted)):
        console.print(f"Compiling {n_missing} kernels for this machine, once ...")
        with progress_bar(console, "kernels") as say:
            ahead.compile_missing(wanted, say)
    if is_verbose:
        console.print(f"[green]ok[/] kernels: compiled, in {folder()}")


def _may_install() -> bool:
    """Return whether the user is root on a machine with apt-get."""
    return shutil.which("apt-get") is not None and getattr(os, "geteuid", lambda: 1)() == 0
