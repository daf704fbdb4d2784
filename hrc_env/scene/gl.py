"""Access to OpenGL: selection of a backend, contexts, and errors if OpenGL is unavailable.

mujoco reads MUJOCO_GL when it is imported. Unless the user has set it, Linux renders by EGL if its
library is installed (no display is needed), otherwise by OSMesa, or else in a hidden window. A
context is current on a thread only while that thread renders; therefore any thread may render next
or close the context.
"""

import atexit
import contextlib
import ctypes
import ctypes.util
import functools
import importlib.util
import os
import sys
import threading
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hrc_env.core.errors import RenderingError, make_unknown_name_error

if TYPE_CHECKING:
    import mujoco

APT_LINE = "sudo apt-get install -y libegl1 libgl1 libglx-mesa0 libegl-mesa0"
"""Command that installs a software implementation of OpenGL on Debian or Ubuntu."""
LIBRARIES = {"egl": "EGL", "osmesa": "OSMesa"}
"""Shared libraries of the backends that need no window system, in order of preference."""
WINDOWS = ("", "glfw", "glx", "enable", "enabled", "on", "true", "1")
"""Values of MUJOCO_GL with which mujoco renders in a hidden window on Linux."""
OFF = ("disable", "disabled", "off", "false", "0")
"""Values of MUJOCO_GL that disable rendering."""
VARIABLES = ("PYOPENGL_PLATFORM", "MUJOCO_EGL_DEVICE_ID", "CUDA_VISIBLE_DEVICES", "EGL_PLATFORM")
"""Names of further environment variables that affect whether a context can be made."""
EXIT_PATIENCE_S = 2.0
"""Maximum time for which the process waits at exit for rendering in another thread [s]."""
_MAKING = threading.Lock()
"""Lock that allows only one thread at a time to make a context."""
_OPEN: weakref.WeakSet["Drawing"] = weakref.WeakSet()
"""Contexts that have not been freed."""


class Drawing:
    """An OpenGL context with a model's textures and meshes, which one thread at a time may use."""

    def __init__(self, context: Any, looks: "mujoco.MjrContext") -> None:
        """Wrap an OpenGL context.

        Args:
            context: context of one of mujoco's classes.
            looks: textures and meshes that were made in the context.
        """
        self._gl, self.looks = context, looks
        self._lock, self._freed = threading.RLock(), False

    @contextlib.contextmanager
    def current(self) -> Iterator["mujoco.MjrContext"]:
        """Make the context current on this thread; restore the previous one afterwards."""
        with self._lock:
            if self._freed:
                raise RenderingError("This graphics context has been freed: create a new renderer.")
            restore = _find_restore(type(self._gl))
            self._gl.make_current()
            try:
                yield self.looks
            finally:
                restore()

    def free(self) -> None:
        """Free the context; it cannot be used afterwards. A second call has no effect."""
        with self._lock:
            if not self._freed:
                with self.current():
                    self.looks.free()
                self._gl.free()
                self._freed = True

    def free_at_exit(self) -> None:
        """Free the context, and keep its lock to prevent use by other threads."""
        if self._lock.acquire(timeout=EXIT_PATIENCE_S):
            self.free()


def import_mujoco() -> None:
    """Import mujoco even if the backend of MUJOCO_GL, needed only to render, cannot be loaded."""
    chosen = choose_backend()
    try:
        importlib.import_module("mujoco")
    except Exception:  # PyOpenGL raises several errors for a missing library
        os.environ["MUJOCO_GL"] = OFF[0]
        try:
            importlib.import_module("mujoco")
        finally:
            os.environ["MUJOCO_GL"] = chosen


def choose_backend() -> str:
    """Set MUJOCO_GL if it is not set, and return the backend's name ("" is mujoco's default)."""
    chosen = os.environ.get("MUJOCO_GL", "").lower().strip()
    if chosen or not sys.platform.startswith("linux"):
        return chosen
    for backend, library in LIBRARIES.items():
        if _has_library(library):
            os.environ["MUJOCO_GL"] = backend
            return backend
    return ""


def draw_on_one_thread() -> None:
    """Make Mesa's software OpenGL render in the calling thread, unless LP_NUM_THREADS is set.

    Mesa's rendering threads, one per core, would compete with the thread of the detector.
    """
    os.environ.setdefault("LP_NUM_THREADS", "0")


@functools.cache
def load_triton_first() -> None:
    """Load the library of triton, if it is installed, before Mesa's first context or window.

    If the library is loaded later, for example by `torch.optim`, it uses Mesa's LLVM instead of its
    own and crashes.
    """
    with contextlib.suppress(OSError, ValueError):  # without triton there is no problem
        triton = importlib.util.find_spec("triton")
        late = "libLLVM" in Path("/proc/self/maps").read_text()  # a picture was rendered before
        mode = ctypes.DEFAULT_MODE | (os.RTLD_DEEPBIND if late else 0)
        for folder in (triton and triton.submodule_search_locations) or ():
            for library in (Path(folder) / "_C").glob("libtriton*.so"):
                ctypes.CDLL(str(library), mode)


def require_display() -> None:
    """Raise `RenderingError` if no window system is available."""
    import glfw

    if not glfw.init():
        raise RenderingError(
            f"No window system is available (DISPLAY={os.environ.get('DISPLAY', '')!r}, "
            f"WAYLAND_DISPLAY={os.environ.get('WAYLAND_DISPLAY', '')!r})"
        )


class GlStatus(NamedTuple):
    """Availability of OpenGL on this machine."""

    works: bool
    """Whether pixels can be rendered."""
    message: str
    """Description of the backend, or of the error and its remedy, in one sentence."""


def gl_status() -> GlStatus:
    """Render a test picture, and return whether OpenGL is available."""
    import mujoco

    try:
        drawing = new_context(16, 16, mujoco.MjModel.from_xml_string("<mujoco/>"))
    except RenderingError as error:
        return GlStatus(False, str(error))
    rectangle, seen = mujoco.MjrRect(0, 0, 16, 16), np.zeros((16, 16, 3), np.uint8)
    with drawing.current() as looks:
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, looks)
        mujoco.mjr_rectangle(rectangle, 1.0, 0.0, 1.0, 1.0)
        mujoco.mjr_readPixels(seen, None, rectangle, looks)
        renderer = _renderer()
    drawing.free()
    backend = os.environ.get("MUJOCO_GL") or "the default"
    if tuple(seen[8, 8]) != (255, 0, 255):
        return GlStatus(False, f"OpenGL (MUJOCO_GL={backend}, {renderer}) draws wrong pixels.")
    return GlStatus(True, f"OpenGL works (MUJOCO_GL={backend}, {renderer}).")


def new_context(width_px: int, height_px: int, model: "mujoco.MjModel") -> Drawing:
    """Make an OpenGL context of the chosen backend, which is not current on any thread.

    Args:
        width_px: width of the context's pictures [px].
        height_px: height of the context's pictures [px].
        model: drawing model with the textures and meshes for the context.

    Raises:
        RenderingError: no context could be created; the error names the remedy.
    """
    import mujoco

    backend = choose_backend()
    if backend in OFF:
        raise RenderingError(f"Rendering is switched off by MUJOCO_GL={backend!r}: unset it.")
    load_triton_first()
    try:
        with _MAKING:  # one thread at a time loads libraries and opens displays
            kind = _context_class(backend)
            restore = _find_restore(kind)
            try:
                context = kind(width_px, height_px)
                context.make_current()
                font = mujoco.mjtFontScale.mjFONTSCALE_100.value
                made = Drawing(context, mujoco.MjrContext(model, font))
            finally:
                restore()
            if not _OPEN:
                atexit.unregister(_free_all)
                atexit.register(_free_all)  # registered after mujoco's function, to run before it
            _OPEN.add(made)
            return made
    except Exception as error:
        raise RenderingError(
            f"No OpenGL context could be created ({_settings(backend)}): "
            f"{str(error).strip().rstrip('.')}. EGL, which needs no display, is the default if "
            f"MUJOCO_GL is not set; on Debian or Ubuntu, install it with: {APT_LINE}"
        ) from error


def _settings(backend: str) -> str:
    """Return a description of the environment variables that affect rendering."""
    others = [f"{name}={os.environ[name]!r}" for name in VARIABLES if name in os.environ]
    return ", ".join([f"MUJOCO_GL={backend or 'not set'!r}", *others])


def _free_all() -> None:
    """Free all contexts before their libraries are unloaded, to avoid errors at exit."""
    for drawing in list(_OPEN):
        with contextlib.suppress(Exception):
            drawing.free_at_exit()


def _find_restore(context_class: type) -> Callable[[], Any]:
    """Return a function that restores the context that is now current on this thread."""
    kind = context_class.__module__
    if kind == "mujoco.egl":
        egl = sys.modules[kind]
        library, nothing = egl.EGL, (egl.EGL.EGL_NO_SURFACE,) * 2
        library.eglBindAPI(library.EGL_OPENGL_API)  # a new thread has no API bound
        before = library.eglGetCurrentContext()
        if not before:
            none = library.EGL_NO_CONTEXT
            return lambda: library.eglMakeCurrent(egl.EGL_DISPLAY, *nothing, none)
        faces = [
            library.eglGetCurrentSurface(side) for side in (library.EGL_DRAW, library.EGL_READ)
        ]
        display = library.eglGetCurrentDisplay()
        return lambda: library.eglMakeCurrent(display, *faces, before)
    if kind == "mujoco.osmesa":
        made = sys.modules[kind]
        return lambda: made.osmesa.OSMesaMakeCurrent(None, None, made.GL.GL_FLOAT, 0, 0)
    if kind == "mujoco.glfw":
        import glfw

        window = glfw.get_current_context()
        return lambda: glfw.make_context_current(window)
    return lambda: None


def _context_class(backend: str) -> Any:
    """Return the context class of a backend, which may differ from that at mujoco's import."""
    if not sys.platform.startswith("linux"):
        return importlib.import_module("mujoco").GLContext
    if backend in WINDOWS:
        require_display()
        return importlib.import_module("mujoco.glfw").GLContext
    if backend not in LIBRARIES:
        raise make_unknown_name_error("MUJOCO_GL", backend, [*LIBRARIES, "glfw"])
    if not _has_library(LIBRARIES[backend]):
        raise OSError(f"the library lib{LIBRARIES[backend]} is missing")
    platform = os.environ.get("PYOPENGL_PLATFORM") or backend
    if platform.lower() != backend:
        raise OSError(f"PYOPENGL_PLATFORM={platform!r} must be {backend!r} or not set")
    return importlib.import_module(f"mujoco.{backend}").GLContext


def _renderer() -> str:
    """Return the name of OpenGL's renderer in the current context."""
    try:
        from OpenGL.GL import GL_RENDERER, glGetString

        name: Any = glGetString(GL_RENDERER)
        return name.decode()
    except Exception as error:  # the name is only printed
        return f"renderer without a name: {error}"


def _has_library(name: str) -> bool:
    """Return whether a shared library can be loaded."""
    if ctypes.util.find_library(name):
        return True
    for suffix in (".so.1", ".so.8", ".so"):
        with contextlib.suppress(OSError):
            ctypes.CDLL(f"lib{name}{suffix}")
            return True
    return False
