"""python -m hrc_env setup: everything that pip does not bring."""

from dataclasses import dataclass
from typing import Literal

from rich.console import Console

from hrc_env.pipeline.ready import compile_kernels, fetch_networks, find_opengl


@dataclass(frozen=True)
class Setup:
    """Fetch the pose network's weights (once, checked), compile the kernels for this machine, and
    see that headless OpenGL works."""

    networks: tuple[Literal["lite", "heavy"], ...] = ()
    """Other landmark networks that are to be fetched, too (41 MB): for detector.folded and
    detector.network."""

    def run(self) -> int:
        """Set up; 0 also without OpenGL, which only pictures need."""
        console = Console()
        fetch_networks(console, [f"pose_landmark_{network}" for network in self.networks])
        ready, message = find_opengl(console)
        compile_kernels(console, is_verbose=True)
        if ready:
            console.print(f"[green]ok[/] headless OpenGL: {message}")
        else:
            console.print(
                f"[yellow]no headless OpenGL[/]: {message}\n"
                "Without it everything works but perception='pixels' and pictures."
            )
        return 0
