"""Commands as people type them, without the price of a new process."""

import os
import runpy
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


def hrc(*words: str, **env: str) -> subprocess.CompletedProcess[str]:
    """`python -m hrc_env` in this process; with other variables `env`, in one of its own."""
    if env:
        return subprocess.run(
            [sys.executable, "-m", "hrc_env", *words],
            capture_output=True, text=True, check=False, env={**os.environ, **env},
        )  # fmt: skip
    return called(ROOT / "hrc_env" / "__main__.py", *words)


def called(script: Path, *words: object) -> subprocess.CompletedProcess[str]:
    """A script run as `python script words` runs it, in this process."""
    command = [str(script), *map(str, words)]
    said, complained, code = StringIO(), StringIO(), None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", command)
        with redirect_stdout(said), redirect_stderr(complained):
            try:
                runpy.run_path(command[0], run_name="__main__")
            except SystemExit as end:
                code = end.code
    if isinstance(code, str):  # sys.exit("words") says them and gives 1
        complained.write(f"{code}\n")
        code = 1
    return subprocess.CompletedProcess(command, code or 0, said.getvalue(), complained.getvalue())
