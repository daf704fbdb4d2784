"""Which OpenGL this machine has: chosen before mujoco's first import, explained when missing.

mujoco reads MUJOCO_GL when it is imported. Unless the user has set it, a machine without a
display gets EGL when its library is there (with or without a GPU), otherwise OSMesa.
"""

import ctypes
import ctypes.util
import os
import sys
from typing import Any

from hrc_env.errors import RenderingError

APT_LINE = "sudo apt-get install -y libegl1 libgl1 libglx-mesa0 libegl-mesa0"
"""What gives a bare Debian or Ubuntu a software OpenGL."""


def choose_backend() -> str:
    """Set MUJOCO_GL where nobody has; returns the backend's name ("" is mujoco's default)."""
    chosen = os.environ.get("MUJOCO_GL", "").lower().strip()
    if chosen or not sys.platform.startswith("linux"):
        return chosen
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        return "glfw"
    for backend, library in (("egl", "EGL"), ("osmesa", "OSMesa")):
        if _has_library(library):
            os.environ["MUJOCO_GL"] = backend
            return backend
    return ""


def draw_on_one_thread() -> None:
    """Let Mesa's software OpenGL draw in the thread that asks, from this process's first context
    on, unless the user has set LP_NUM_THREADS.

    Its own threads, one a core, take turns with the thread that detects: with them a step of
    level `pixels` took half as long again on two cores.
    """
    os.environ.setdefault("LP_NUM_THREADS", "0")


def gl_status() -> tuple[bool, str]:
    """Whether pictures can be made here, and a sentence that says with what or what to do."""
    backend = choose_backend()
    try:
        context = new_context(16, 16)
    except RenderingError as error:
        return False, str(error)
    context.free()
    return True, f"OpenGL works (MUJOCO_GL={backend or 'the default'})."


def new_context(width_px: int, height_px: int) -> Any:
    """A GL context of the chosen backend, current on this thread.

    Raises:
        RenderingError: no context can be made; the message says how to get OpenGL.
    """
    backend = choose_backend()
    if backend in ("disable", "disabled", "off", "false", "0"):
        raise RenderingError(f"Rendering is switched off by MUJOCO_GL={backend!r}: unset it.")
    try:
        context = _context_class(backend)(width_px, height_px)
        context.make_current()
    except Exception as error:
        raise RenderingError(
            f"No OpenGL context could be made (MUJOCO_GL={backend or 'not set'!r}): {error}. "
            f"On Debian or Ubuntu: {APT_LINE}"
        ) from error
    return context


def _context_class(backend: str) -> Any:
    """The backend's class itself: mujoco.GLContext is fixed at mujoco's first import."""
    if backend == "egl":
        from mujoco.egl import GLContext
    elif backend == "osmesa":
        from mujoco.osmesa import GLContext
    else:
        from mujoco import GLContext
    return GLContext


def _has_library(name: str) -> bool:
    if ctypes.util.find_library(name):
        return True
    for suffix in (".so.1", ".so.8", ".so"):
        try:
            ctypes.CDLL(f"lib{name}{suffix}")
        except OSError:
            continue
        return True
    return False
