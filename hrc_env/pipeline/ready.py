"""Bring a machine to where a command can begin, the quickest first: weights, OpenGL, kernels.

Imports are inside the functions: `--help` loads neither simulator nor compiler.
"""

import os
import shutil
import subprocess
from collections.abc import Sequence

from rich.console import Console

from hrc_env.core.errors import RenderingError
from hrc_env.core.progress import progress_bar


def make_ready(console: Console, level: str, draws: bool = False, installs: bool = False) -> None:
    """Fetch and compile what a perception level needs and this machine lacks.

    Args:
        console: where it is reported.
        level: of perception.
        draws: whether pictures are drawn at any level.
        installs: whether OpenGL may be installed, as `find_opengl` does it.

    Raises:
        WeightsError: weights are missing and cannot be fetched.
        RenderingError: there is no OpenGL.
    """
    if level == "pixels":
        fetch_networks(console, says=False)
    if draws or level == "pixels":
        ready, message = find_opengl(console, installs)
        if not ready:
            raise RenderingError(message)
    compile_kernels(console, level)


def fetch_networks(console: Console, names: Sequence[str] = (), says: bool = True) -> None:
    """Fetch the weights of the default networks and of others that are missing."""
    from hrc_env.perception import weights

    weights.fetch_weights([*weights.ALWAYS, *names])
    if says:
        console.print(f"[green]ok[/] pose network: official weights in {weights.cache_dir()}")


def find_opengl(console: Console, installs: bool = True) -> tuple[bool, str]:
    """Return whether a pixel can be drawn, and a sentence; where there is no OpenGL, root
    installs Debian's if `installs`."""
    from hrc_env.scene import gl

    ready, message = gl.gl_status()
    others = os.environ.get("MUJOCO_GL", "").lower().strip() not in ("", "egl")
    if ready or others or not (installs and _may_install()):
        return ready, message
    console.print(f"Installing OpenGL: {gl.APT_LINE}")
    subprocess.run(["apt-get", "update", "-qq"], check=False)
    apt, install, *packages = gl.APT_LINE.removeprefix("sudo ").split()
    subprocess.run([apt, install, "-qq", "-y", *packages], check=False)
    return gl.gl_status()


def compile_kernels(console: Console, level: str | None = None, says: bool = False) -> None:
    """Compile the kernels of a perception level (None: any) that are missing, under a bar."""
    from hrc_env.core.kernels import ahead
    from hrc_env.core.kernels.cache import folder

    if n_missing := len(ahead.missing(level)):
        console.print(f"Compiling {n_missing} kernels for this machine, once ...")
        with progress_bar(console, "kernels") as say:
            ahead.compile_missing(level, say)
    if says:
        console.print(f"[green]ok[/] kernels: compiled, in {folder()}")


def _may_install() -> bool:
    """Root on a machine with apt-get (not on Windows, which has no users by number)."""
    return shutil.which("apt-get") is not None and getattr(os, "geteuid", lambda: 1)() == 0
