"""Compiles kernels where a command's user can see it."""

from rich.console import Console

from hrc_env.cli.progress import progress_bar
from hrc_env.core.kernels import ahead


def compile_kernels(console: Console, level: str | None = None) -> None:
    """Compile what a perception level (None: any) calls and is not compiled yet, under a bar."""
    n_missing = len(ahead.missing(level))
    if n_missing:
        console.print(f"Compiling {n_missing} kernels for this machine, once ...")
        with progress_bar(console, "kernels") as say:
            ahead.compile_missing(level, say)
