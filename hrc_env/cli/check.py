"""python -m hrc_env check: is this machine ready? Each line is ok or says what to do."""

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version

from rich.console import Console

from hrc_env.errors import HRCError
from hrc_env.perception import vino, weights
from hrc_env.scene.gl import gl_status

Finding = tuple[bool, str]


@dataclass(frozen=True)
class Check:
    """Versions, OpenGL, weights, cores: each line ok, or what to do."""

    def run(self) -> int:
        """Print the findings; 0 if all are ok."""
        console, fine = Console(), True
        checks: dict[str, Callable[[], Finding]] = {
            "python": _python,
            "packages": _packages,
            "cores": _cores,
            "OpenGL": gl_status,
            "weights": _weights,
            "OpenVINO": _openvino,
            "environment": _environment,
        }
        for name, check in checks.items():
            try:
                ok, message = check()
            except Exception as error:  # whatever is wrong with this machine, say it
                ok, message = False, f"{type(error).__name__}: {error}"
            fine &= ok
            console.print(f"[{'green]ok  ' if ok else 'red]TODO'}[/] {name:12s} {message}")
        return 0 if fine else 1


def _python() -> Finding:
    return sys.version_info >= (3, 11), f"{sys.version.split()[0]} (3.11 or newer is needed)"


def _packages() -> Finding:
    names = ("mujoco", "gymnasium", "numpy", "numba", "torch", "stable-baselines3")
    return True, ", ".join(f"{name} {version(name)}" for name in names)


def _cores() -> Finding:
    cores = os.cpu_count() or 1
    return True, f"{cores}" + ("" if cores > 1 else ": pixels will be slow on a single core")


def _weights() -> Finding:
    try:
        for name in weights.ALWAYS:
            weights.find_weights(name)
    except HRCError as error:
        return False, str(error)
    return True, f"official, in {weights.cache_dir()}"


def _openvino() -> Finding:
    if not vino.installed():
        return True, f"not installed; it makes pixels faster: {vino.INSTALL}"
    return True, f"computes in {vino.precision()} where eyes.runtime is openvino or auto"


def _environment() -> Finding:
    import gymnasium

    env = gymnasium.make("HRCReach-v0", perception="keypoints")
    env.reset(seed=0)
    env.step(env.action_space.sample() * 0)
    env.close()
    return True, "HRCReach-v0 steps"
