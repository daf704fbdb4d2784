"""How a command is called: its words fill its record, and errors are shown without a traceback."""

import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.registration import IMPORT, import_files


def show_errors(run: Callable[[], int]) -> int:
    """Run something; return its exit status, 2 for what was asked wrongly, 130 for what was stopped
    by Ctrl-C."""
    try:
        return run()
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


def import_first(words: Sequence[str], program: str) -> list[str]:
    """Import the files of `--import FILE`, here or in the process that started this one; return the
    other words."""
    words = list(words)
    while "--import" in words:
        at = words.index("--import")
        if at + 1 == len(words):
            raise ConfigError("--import wants a Python file, as in --import my_task.py.")
        known, file = os.environ.get(IMPORT, ""), str(Path(words[at + 1]).resolve())
        os.environ[IMPORT] = os.pathsep.join(filter(None, (known, file)))
        words = words[:at] + words[at + 2 :]
    import_files()
    if not words:
        raise ConfigError(f"--import goes with a command; {program} --help names them.")
    return words


def run_command(command: type[Any], words: Sequence[str], program: str) -> int:
    """Make a command's record of words and run it; return the exit status."""
    import tyro

    from hrc_env.cli.options import understood

    filled = tyro.cli(
        command,
        prog=program,
        args=understood(command, words, program),
        config=(tyro.conf.OmitArgPrefixes, tyro.conf.OmitSubcommandPrefixes),
    )
    return int(filled.run() or 0)
