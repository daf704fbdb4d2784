"""Set up everything that pip does not install."""

from dataclasses import dataclass
from typing import Literal

from rich.console import Console

from hrc_env.pipeline.ready import compile_kernels, fetch_networks, find_opengl


@dataclass(frozen=True)
class Setup:
    """Download the weights of the pose network, compile the kernels and check headless OpenGL.

    Weights are fetched once and verified; kernels are compiled for this machine.
    """

    networks: tuple[Literal["lite", "heavy"], ...] = ()
    """Additional landmark networks to fetch (41 MB), for detector.folded_network and
    detector.network."""

    def run(self) -> int:
        """Carry out the setup and return 0, even without OpenGL, which only images require."""
        from hrc_env.perception.vino import describe_gain  # here: --help imports no network

        console = Console()
        fetch_networks(console, [f"pose_landmark_{network}" for network in self.networks])
        ready, message = find_opengl(console)
        compile_kernels(console, is_verbose=True)
        if ready:
            console.print(f"[green]ok[/] headless OpenGL: {message}")
        else:
            console.print(
                f"[yellow]no headless OpenGL[/]: {message}\n"
                "Everything works without it except perception='pixels' and pictures."
            )
        console.print(f"[green]ok[/] OpenVINO: {describe_gain()}", highlight=False)
        return 0
