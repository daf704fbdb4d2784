"""python -m hrc_env setup: everything that pip does not bring."""

import os
import shutil
import subprocess
from dataclasses import dataclass
from typing import Literal

from rich.console import Console

from hrc_env.cli.progress import compile_kernels


@dataclass(frozen=True)
class Setup:
    """Fetch the pose network's weights (once, checked), compile the kernels for this machine, and
    see that headless OpenGL works."""

    networks: tuple[Literal["lite", "heavy"], ...] = ()
    """Other landmark networks that are to be fetched, too (41 MB): for detector.folded and
    detector.network."""

    def run(self) -> int:
        """Set up; 0 also without OpenGL, which only pictures need."""
        from hrc_env.core.kernels.cache import folder  # here: --help imports no simulator
        from hrc_env.perception import weights
        from hrc_env.scene.gl import APT_LINE, gl_status

        console = Console()
        with console.status("Fetching the weights of MediaPipe Pose ..."):
            extra = [f"pose_landmark_{network}" for network in self.networks]
            weights.fetch_weights(names=[*weights.ALWAYS, *extra])
        console.print(f"[green]ok[/] pose network: official weights in {weights.cache_dir()}")
        compile_kernels(console)
        console.print(f"[green]ok[/] kernels: compiled, in {folder()}")
        ready, message = gl_status()
        if not ready and _may_install():
            console.print(f"Installing OpenGL: {APT_LINE}")
            subprocess.run(["apt-get", "update", "-qq"], check=False)
            apt, install, *packages = APT_LINE.removeprefix("sudo ").split()
            subprocess.run([apt, install, "-qq", "-y", *packages], check=False)
            ready, message = gl_status()
        if ready:
            console.print(f"[green]ok[/] headless OpenGL: {message}")
        else:
            console.print(
                f"[yellow]no headless OpenGL[/]: {message}\n"
                "Without it everything works but perception='pixels' and pictures."
            )
        return 0


def _may_install() -> bool:
    """Root on a machine with apt-get (not on Windows, which has no users by number)."""
    return shutil.which("apt-get") is not None and getattr(os, "geteuid", lambda: 1)() == 0
