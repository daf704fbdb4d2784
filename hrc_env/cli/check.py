"""Check whether this machine is ready for the package, and name a remedy for each failure.

Every failure must be reported in the line of its check. Imports are therefore inside the checks,
and code that can crash the process (drivers, libraries that clash) runs in a separate process.
"""

import importlib.util
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from importlib.metadata import version
from typing import NamedTuple

from rich.console import Console
from rich.markup import escape

from hrc_env.core.errors import HRCError, MissingExtraError, learner


class Finding(NamedTuple):
    """The result of one check."""

    is_ok: bool
    message: str
    """Version or state that the check found, or the remedy for a failure."""


PACKAGES = ("mujoco", "gymnasium", "numpy", "numba")
DRAW = "from hrc_env.scene import gl; ok, text = gl.gl_status(); print(text); ok or exit(1)"
"""Python code that renders a pixel and prints the name of the renderer, or the remedy for a
failure."""
NAMES = (
    "python", "packages", "torch", "machine", "OpenGL", "triton", "kernels", "weights", "OpenVINO",
    "environment",
)  # fmt: skip
"""Names of the checks. The function `_check_NAME` performs the check NAME."""
LITTLE_GB = 2.0
"""Memory that the perception level `pixels` and films require [GB]."""


@dataclass(frozen=True)
class Check:
    """Check versions, machine, OpenGL, kernels, weights and one step of an environment.

    Each line of the output is either marked as ok or names the remedy.
    """

    def run(self) -> int:
        """Print the findings; return 0 if all are ok, otherwise 1."""
        console, all_ok = Console(), True
        for name in NAMES:
            try:
                finding = globals()[f"_check_{name.lower()}"]()
            except HRCError as error:
                finding = Finding(False, str(error))
            except Exception as error:  # any failure is a finding
                finding = Finding(False, f"{type(error).__name__}: {error}")
            all_ok &= finding.is_ok
            mark = "[green]ok  [/]" if finding.is_ok else "[red]TODO[/]"
            console.print(f"{mark} {name:12s} {escape(finding.message)}", soft_wrap=True)
        return 0 if all_ok else 1


def _check_python() -> Finding:
    is_ok = sys.version_info >= (3, 11)
    return Finding(is_ok, f"{sys.version.split()[0]} (3.11 or newer is required)")


def _check_packages() -> Finding:
    from hrc_env import __version__

    others = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    return Finding(True, f"hrc_env {__version__}, {others}")


def _check_torch() -> Finding:
    try:
        with learner():
            import stable_baselines3
            import torch
    except MissingExtraError as error:
        return Finding(True, f"not installed; only training needs it. {error}")
    gpus = {"CUDA": torch.version.cuda, "ROCm": torch.version.hip}
    builds = [f"{name} {number} build" for name, number in gpus.items() if number] or ["CPU build"]
    ours = f"{torch.__version__} ({builds[0]})"
    return Finding(True, f"{ours}, stable-baselines3 {stable_baselines3.__version__}")


def _check_machine() -> Finding:
    from hrc_env.core.machine import usable_cores, usable_memory_gb

    cores, memory_gb = usable_cores(), usable_memory_gb()
    text = f"{cores:g} cores" if cores > 1 else f"{cores:g} core: perception pixels will be slow"
    text += f", {memory_gb:.1f} GB of memory"
    too_little = ": too little for perception pixels and videos" if memory_gb < LITTLE_GB else ""
    return Finding(True, text + too_little)


def _check_opengl() -> Finding:
    return _run_in_process(DRAW)


def _check_triton() -> Finding:
    if importlib.util.find_spec("triton") is None:
        return Finding(True, "not installed (torch's CPU build has none): no conflict with Mesa")
    ours = version("triton")
    if not _run_in_process(DRAW).is_ok:
        return Finding(True, f"{ours}; OpenGL does not work, so that they cannot conflict")
    finding = _run_in_process(f"{DRAW}; import triton")
    after = "can be imported after OpenGL was used"
    text = after if finding.is_ok else f"after OpenGL was used: {finding.message}"
    return Finding(finding.is_ok, f"{ours} {text}")


def _run_in_process(code: str) -> Finding:
    """Run Python code in a new process; return its success and its last line of output."""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    if done.returncode < 0:
        return Finding(False, f"ended by signal {signal.Signals(-done.returncode).name}")
    lines = (done.stdout if done.stdout.strip() else done.stderr).strip().splitlines()
    last = lines[-1] if lines else f"exit status {done.returncode}"
    return Finding(done.returncode == 0, last)


def _check_kernels() -> Finding:
    from hrc_env.core.kernels import ahead
    from hrc_env.core.kernels.cache import folder
    from hrc_env.core.machine import n_cores

    todo = ahead.missing()
    if not todo:
        return Finding(True, f"compiled, in {folder()}")
    wait_s = sum(signature.seconds for signature in todo) / n_cores()
    text = f"{len(todo)} are not compiled yet, which takes about {wait_s:.0f} s in total when they"
    return Finding(True, f"{text} are first used; to compile them now: python -m hrc_env setup")


def _check_weights() -> Finding:
    from hrc_env.perception import weights

    for name in weights.ALWAYS:
        weights.find_weights(name)
    return Finding(True, f"official weights, in {weights.cache_dir()}")


def _check_openvino() -> Finding:
    from hrc_env.perception import vino

    return Finding(True, vino.describe_gain())


def _check_environment() -> Finding:
    import gymnasium

    from hrc_env.tasks import DEFAULT

    started_s = time.monotonic()
    env = gymnasium.make(f"hrc_env:{DEFAULT}", perception="keypoints")
    env.reset(seed=0)
    env.step(env.action_space.sample() * 0)
    env.close()
    taken_s = time.monotonic() - started_s
    text = f"{DEFAULT} at level keypoints: made, reset and stepped in {taken_s:.1f} s"
    return Finding(True, text)
