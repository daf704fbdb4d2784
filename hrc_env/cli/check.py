"""python -m hrc_env check: is this machine ready? Each line is ok or says what to do.

Whatever is wrong must end up in its line: imports are inside the checks, and what may take a
process with it (drivers, libraries that clash) is tried in one of its own.
"""

import importlib.util
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from importlib.metadata import version

from rich.console import Console
from rich.markup import escape

from hrc_env.core.errors import HRCError, MissingExtraError, learner

Finding = tuple[bool, str]

PACKAGES = ("mujoco", "gymnasium", "numpy", "numba")
DRAW = "from hrc_env.scene import gl; ok, said = gl.gl_status(); print(said); ok or exit(1)"
"""Draws a pixel; says with what, or what to do."""
NAMES = (
    "python", "packages", "torch", "machine", "OpenGL", "triton", "kernels", "weights", "OpenVINO",
    "environment",
)  # fmt: skip
"""What is checked, each by the function of that name."""
LITTLE_GB = 2.0
"""Level `pixels` and a film do not fit into much less [GB]."""


@dataclass(frozen=True)
class Check:
    """Versions, machine, OpenGL, kernels, weights, one step: each line ok, or what to do."""

    def run(self) -> int:
        """Print the findings; 0 if all are ok."""
        console, fine = Console(), True
        for name in NAMES:
            try:
                ok, message = globals()[f"_{name.lower()}"]()
            except HRCError as error:
                ok, message = False, str(error)
            except Exception as error:  # whatever is wrong with this machine, say it
                ok, message = False, f"{type(error).__name__}: {error}"
            fine &= ok
            mark = "[green]ok  [/]" if ok else "[red]TODO[/]"
            console.print(f"{mark} {name:12s} {escape(message)}", soft_wrap=True)
        return 0 if fine else 1


def _python() -> Finding:
    return sys.version_info >= (3, 11), f"{sys.version.split()[0]} (3.11 or newer is needed)"


def _packages() -> Finding:
    from hrc_env import __version__

    others = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    return True, f"hrc_env {__version__}, {others}"


def _torch() -> Finding:
    try:
        with learner():
            import stable_baselines3
            import torch
    except MissingExtraError as error:
        return True, f"not installed, the environment does without. {error}"
    gpus = {"CUDA": torch.version.cuda, "ROCm": torch.version.hip}
    builds = [f"{name} {number} build" for name, number in gpus.items() if number] or ["CPU build"]
    ours = f"{torch.__version__} ({builds[0]})"
    return True, f"{ours}, stable-baselines3 {stable_baselines3.__version__}"


def _machine() -> Finding:
    from hrc_env.core.machine import usable_cores, usable_memory_gb

    cores, memory_gb = usable_cores(), usable_memory_gb()
    said = f"{cores:g} cores" if cores > 1 else f"{cores:g} core: pixels will be slow"
    said += f", {memory_gb:.1f} GB of memory"
    return True, said + (": too little for pixels and films" if memory_gb < LITTLE_GB else "")


def _opengl() -> Finding:
    return _in_a_process(DRAW)


def _triton() -> Finding:
    if importlib.util.find_spec("triton") is None:
        return True, "not installed (torch's CPU build has none): nothing that clashes with Mesa"
    ours = version("triton")
    if not _in_a_process(DRAW)[0]:
        return True, f"{ours}; OpenGL does not draw, so that they cannot clash"
    ok, said = _in_a_process(f"{DRAW}; import triton")
    said = "can be imported after OpenGL has drawn" if ok else f"after OpenGL has drawn: {said}"
    return ok, f"{ours} {said}"


def _in_a_process(code: str) -> Finding:
    """Whether Python code ends well, and the last line that it prints."""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    if done.returncode < 0:
        return False, f"the process was ended by {signal.Signals(-done.returncode).name}"
    lines = (done.stdout if done.stdout.strip() else done.stderr).strip().splitlines()
    return done.returncode == 0, lines[-1] if lines else f"exit status {done.returncode}"


def _kernels() -> Finding:
    from hrc_env.core.kernels import ahead
    from hrc_env.core.kernels.cache import folder
    from hrc_env.core.machine import n_cores

    todo = ahead.missing()
    if not todo:
        return True, f"compiled, in {folder()}"
    wait_s = sum(each.seconds for each in todo) / n_cores()
    said = f"{len(todo)} are not compiled yet: whoever first needs them waits, about {wait_s:.0f} s"
    return True, f"{said} for all; or do it now: python -m hrc_env setup"


def _weights() -> Finding:
    from hrc_env.perception import weights

    for name in weights.ALWAYS:
        weights.find_weights(name)
    return True, f"official, in {weights.cache_dir()}"


def _openvino() -> Finding:
    from hrc_env.perception import vino

    if not vino.is_installed():
        return True, f"not installed; it makes pixels faster: {vino.INSTALL}"
    return True, f"computes in {vino.precision()} where detector.runtime is openvino or auto"


def _environment() -> Finding:
    import gymnasium

    from hrc_env.tasks import DEFAULT

    started_s = time.monotonic()
    env = gymnasium.make(f"hrc_env:{DEFAULT}", perception="keypoints")
    env.reset(seed=0)
    env.step(env.action_space.sample() * 0)
    env.close()
    taken_s = time.monotonic() - started_s
    return True, f"{DEFAULT} at level keypoints: made, reset and stepped in {taken_s:.1f} s"
