"""Compilation of kernels before they are needed, on all cores."""

import contextlib
import json
import logging
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache, partial
from typing import Any

from hrc_env.core.folders import alone
from hrc_env.core.kernels import UNTESTED
from hrc_env.core.kernels.cache import folder
from hrc_env.core.kernels.signatures import Signature, decode, kernel_named, recorded
from hrc_env.core.machine import n_cores

log = logging.getLogger("hrc_env.core.kernels")
Say = Callable[[float, str], None]
"""Callback that receives the increase of the completed fraction and the current activity."""
AT_ONCE_S = 3.0
"""Compile time below which a kernel is compiled on its first call [s]; the start of a process takes
about as long."""
LOG_EVERY_S = 10.0


def missing(level: str | None = None) -> list[Signature]:
    """Return the kernels of a perception level (None: any) that are not compiled yet."""
    return [each for each in recorded(level) if not each.is_compiled()]


@lru_cache(maxsize=8)
def ensure(level: str) -> None:
    """Compile the kernels of a perception level that are not cached on disk.

    The progress is logged.
    """
    if sum(each.seconds for each in missing(level)) > AT_ONCE_S:
        compile_missing(level, _logged())


def compile_missing(level: str | None, say: Say) -> int:
    """Compile missing kernels in one process per core, and return their number.

    Kernels are compiled on their first call instead if a process cannot be started or dies.
    """
    with alone(folder(), lambda: say(0.0, "waiting for another process that compiles the kernels")):
        todo = missing(level)
        wanted, total_s = iter(todo), sum(each.seconds for each in todo)
        with ThreadPoolExecutor(n_cores()) as threads:
            serve = partial(_serve, wanted, total_s, say)
            for served in [threads.submit(serve) for _ in todo[: n_cores()]]:
                served.result()
    return len(todo)


def _serve(wanted: Iterator[Signature], total_s: float, say: Say) -> None:
    """Let one child process compile kernels until none are left.

    Other child processes take kernels from the same iterator.
    """
    quiet = f"ignore:{UNTESTED}"  # the parent process warns once
    command = [sys.executable, "-W", quiet, "-m", "hrc_env.core.kernels.ahead"]
    pipes: Any = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "bufsize": 1}
    try:
        process: Any = subprocess.Popen(command, **pipes)
    except OSError as error:
        log.warning(
            "Kernels cannot be compiled in advance (%s); each is compiled when it is first called.",
            error,
        )
        return
    for each in wanted:
        with contextlib.suppress(OSError):  # raised for a process that has died
            process.stdin.write(json.dumps([each.kernel, each.args]) + "\n")
        answer = process.stdout.readline()
        if answer != "done\n":
            log.warning("Compiling %s failed; it is compiled when it is first called.", each.kernel)
        if not answer:
            break
        say(each.seconds / total_s, each.kernel.partition(":")[2])
    with contextlib.suppress(OSError):
        process.communicate()


def _logged() -> Say:
    """Return a callback that writes the progress to the log."""
    began_s = said_s = time.monotonic()
    done = 0.0
    log.warning(
        "Compiling the kernels of hrc_env for this machine, only once (a minute or two) ..."
    )

    def say(share: float, _: str) -> None:
        nonlocal done, said_s
        done += share
        if time.monotonic() - said_s > LOG_EVERY_S:
            said_s = time.monotonic()
            left_s = (said_s - began_s) * (1 / max(done, 1e-3) - 1)
            log.warning("Compiling kernels: %.0f %%, about %.0f s left", 100 * done, left_s)

    return say


def main() -> None:
    """Compile the kernels named by lines of JSON [kernel, args], and acknowledge each of them.

    `_serve` starts this function in a child process.
    """
    for line in sys.stdin:
        name, args = json.loads(line)
        try:
            kernel_named(name).compile(tuple(decode(each) for each in args))
            answer = "done"
        except Exception as error:  # of many kinds: the kernel's arguments or name have changed
            answer = f"failed: {error!r}".replace("\n", " ")
        sys.stdout.write(f"{answer}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
