"""Parse and run a command, and print its errors without a traceback."""

import os
import select
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.registration import IMPORT, import_files


def show_errors(run: Callable[[], int]) -> int:
    """Run a function, print an `HRCError` without a traceback, and return the exit status.

    Returns:
        The status that the function returns; 2 after an `HRCError`; 130 after Ctrl-C; 141 if the
        program that reads the output, such as `head`, has ended.
    """
    try:
        try:
            return run()
        finally:
            sys.stdout.flush()  # a closed pipe is noticed here and not when the interpreter ends
    except HRCError as error:
        from rich.console import Console
        from rich.markup import escape

        name = type(error).__name__
        message = f"[bold red]{name}[/]: {escape(str(error))}"
        Console(stderr=True).print(message, highlight=False, soft_wrap=True)
        return 2
    except KeyboardInterrupt:
        print("Stopped.", file=sys.stderr)
        return 130
    except BrokenPipeError:
        if not _is_output_closed():  # another pipe, such as that of a process
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141


def _is_output_closed() -> bool:
    """Return whether the standard output is a pipe that nothing reads."""
    try:
        output = sys.stdout.fileno()
    except OSError:  # it is captured in memory
        return False
    poll = select.poll()
    poll.register(output, 0)
    return any(event & select.POLLERR for _, event in poll.poll(0))


def import_first(words: Sequence[str], program: str) -> list[str]:
    """Import the files that `--import FILE` names, and return the remaining arguments.

    Files that the parent process imported are also imported.
    """
    words = list(words)
    while "--import" in words:
        at = words.index("--import")
        if at + 1 == len(words):
            raise ConfigError("--import takes a Python file, for example --import my_task.py.")
        known, file = os.environ.get(IMPORT, ""), str(Path(words[at + 1]).resolve())
        os.environ[IMPORT] = os.pathsep.join(filter(None, (known, file)))
        words = words[:at] + words[at + 2 :]
    import_files()
    if not words:
        raise ConfigError(f"--import requires a command; {program} --help lists them.")
    return words


def run_command(command: type[Any], words: Sequence[str], program: str) -> int:
    """Parse the arguments of a command, run it and return its exit status."""
    import tyro

    from hrc_env.cli.options import normalize_words

    parsed = tyro.cli(
        command,
        prog=program,
        args=normalize_words(command, words, program),
        config=(tyro.conf.OmitArgPrefixes, tyro.conf.OmitSubcommandPrefixes),
    )
    return int(parsed.run() or 0)
