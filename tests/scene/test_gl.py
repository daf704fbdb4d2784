"""OpenGL contexts: in any company, on any machine."""

import ctypes.util
import importlib.util
import shutil
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from hrc_env.core.errors import RenderingError
from hrc_env.scene import gl
from hrc_env.scene.build import build
from hrc_env.scene.viewer import Viewer

NO_TRITON = importlib.util.find_spec("triton") is None

STEPS = {
    "render": "from hrc_env.scene import gl; ok, said = gl.gl_status(); assert ok, said",
    "foreign": "import mujoco; foreign = mujoco.GLContext(64, 64); foreign.make_current()",
    "triton": "import triton",
    "torch": "import torch",
    "optimiser": "import torch; torch.optim.Adam([torch.nn.Parameter(torch.zeros(3))]).step()",
    "kernel": "import numba; assert numba.njit(lambda x: x + 1)(1) == 2",
    "openvino": "import openvino; openvino.Core().get_property('CPU', 'FULL_DEVICE_NAME')",
}
"""What a user may do in one process; `foreign` draws without the door."""
NEEDS = {"torch": "torch", "optimiser": "torch", "openvino": "openvino", "triton": "triton"}

STATUS = "from hrc_env.scene import gl; print(gl.gl_status())"
TRUTH = """
import gymnasium, hrc_env
from hrc_env.core.errors import RenderingError
env = gymnasium.make("HRCReach-v0", perception="truth", render_mode="rgb_array")
env.reset(seed=0)
env.step(env.action_space.sample())
try:
    env.render()
except RenderingError as error:
    print("RenderingError", error)
"""


@pytest.mark.parametrize(
    "order",
    [
        "render triton render",
        "render torch optimiser render",
        "optimiser openvino render kernel",
        "kernel render openvino optimiser render",
        "openvino render kernel triton",
        "foreign render triton render",
    ],
)
def test_no_order_of_libraries_crashes(order, process):
    """`make test-stock` runs this with triton: torch's build for CPUs has none."""
    steps = order.split()
    missing = {NEEDS[step] for step in steps if step in NEEDS} - {
        name for name in set(NEEDS.values()) if importlib.util.find_spec(name) is not None
    }
    if missing:
        pytest.skip(f"not tested, because not installed: {', '.join(sorted(missing))}")
    code = "; ".join(STEPS[step] for step in steps)
    done = process("-c", code, MUJOCO_GL="egl")
    assert done.returncode == 0, (done.returncode, done.stderr)


@pytest.mark.skipif(NO_TRITON, reason="not tested: triton is not installed")
def test_triton_compiles_and_mesa_draws_in_one_process(process):
    """Each keeps to its own LLVM: a kernel for a GPU that need not be there, between pictures."""
    code = f"{STEPS['render']}; import tests.scene.triton_kernel as k; k.compile_it()"
    done = process("-c", code, MUJOCO_GL=None)
    assert done.returncode == 0, (done.returncode, done.stderr)
    assert "exp" in done.stdout or ".entry" in done.stdout


def test_tritons_library_is_there_before_the_first_context(monkeypatch, tmp_path: Path):
    """A library in triton's place, where no triton need be installed."""
    library = tmp_path / "triton" / "_C" / "libtriton.so"
    library.parent.mkdir(parents=True)
    (tmp_path / "triton" / "__init__.py").touch()
    shutil.copy(np.random.mtrand.__file__, library)
    seen = []

    def look(_: str):
        seen.append(str(library) in Path("/proc/self/maps").read_text())
        raise ImportError("seen enough")

    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "triton", raising=False)
    monkeypatch.setattr(gl, "_context_class", look)
    gl.load_triton_first.cache_clear()
    with pytest.raises(RenderingError, match="seen enough"):
        gl.new_context(8, 8, mujoco.MjModel.from_xml_string("<mujoco/>"))
    gl.load_triton_first.cache_clear()
    assert seen == [True]


def test_pictures_need_no_display(process):
    """A dead display is everyday in ssh."""
    done = process("-c", STATUS, MUJOCO_GL=None, DISPLAY=":99")
    assert "True, message='OpenGL works (MUJOCO_GL=egl" in done.stdout, done.stderr


@pytest.mark.parametrize(
    ("backend", "said"),
    [
        ("glfw", "No window system is available (DISPLAY=':99'"),
        ("nonsense", "Valid: 'egl', 'osmesa', 'glfw'"),
        ("off", "unset it"),
    ],
)
def test_a_backend_that_cannot_draw_says_what_to_do(backend, said, process):
    done = process("-c", STATUS, MUJOCO_GL=backend, DISPLAY=":99")
    assert done.returncode == 0, done.stderr
    assert "False" in done.stdout
    assert said in done.stdout.replace("\\", "")


@pytest.mark.parametrize(
    ("name", "value"), [("PYOPENGL_PLATFORM", "glx"), ("MUJOCO_EGL_DEVICE_ID", "first")]
)
def test_a_variable_that_keeps_pictures_away_is_named(name, value, process):
    """Clusters set it; whoever draws nothing does not notice."""
    done = process("-c", TRUTH, MUJOCO_GL="egl", **{name: value})
    assert done.returncode == 0, done.stderr
    said = "RenderingError No OpenGL context could be created (MUJOCO_GL='egl', "
    assert said in done.stdout
    assert f"{name}={value!r}" in done.stdout
    assert not done.stderr


@pytest.mark.skipif(bool(ctypes.util.find_library("OSMesa")), reason="OSMesa is installed here")
def test_without_a_library_truth_works_and_pictures_say_what_to_do(process):
    """mujoco itself cannot be imported with such a MUJOCO_GL."""
    done = process("-c", TRUTH, MUJOCO_GL="osmesa")
    assert done.returncode == 0, done.stderr
    assert "RenderingError" in done.stdout
    assert "the library libOSMesa is missing" in done.stdout
    assert "apt-get install" in done.stdout


def test_a_driver_that_draws_nothing_is_not_called_ok(monkeypatch):
    monkeypatch.setattr(mujoco, "mjr_readPixels", lambda *_: None)
    works, sentence = gl.gl_status()
    assert not works
    assert "draws wrong pixels" in sentence


def test_the_viewer_does_not_wait_for_a_dead_display(monkeypatch):
    monkeypatch.setattr("glfw.init", lambda: 0)
    monkeypatch.setattr("mujoco.viewer.launch_passive", lambda *_: pytest.fail("it would wait"))
    with pytest.raises(RenderingError, match="No window system is available"):
        Viewer(build(n_workers=1))
