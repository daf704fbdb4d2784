"""Compilation of kernels before they are needed, on all cores."""

import json
import logging
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import lru_cache, partial
from itertools import chain
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
FIRST = " first"
"""Ending of the name of the kernels of a level that its first reset and step call."""
NICENESS = 10
"""Increase of the niceness of processes that compile in the background."""
DONE, UNSAVED = "done\n", "unsaved\n"
"""Answers of a child process: the kernel is compiled and saved, or could not be saved."""


def missing(level: str | None = None) -> list[Signature]:
    """Return the kernels of a perception level (None: any) that are not compiled yet."""
    return [each for each in recorded(level) if not each.is_compiled()]


@lru_cache(maxsize=8)
def ensure(level: str) -> None:
    """Compile the kernels of the first reset and step of a perception level; log the progress.

    The other kernels of the level are then compiled in the background, or when they are called.
    """
    if _sum_seconds(missing(level + FIRST)) > AT_ONCE_S:
        compile_missing(level + FIRST, _logged())
    if _sum_seconds(rest := missing(level)) > AT_ONCE_S:
        threading.Thread(target=_compile_in_background, args=(rest,), daemon=True).start()


def compile_missing(level: str | None, say: Say) -> int:
    """Compile missing kernels in one process per core, and return their number.

    Kernels are compiled on their first call instead if a process cannot be started or dies. A
    process compiles all kernels of a subpackage, which have callees in common.
    """
    with alone(folder(), lambda: say(0.0, "waiting for another process that compiles the kernels")):
        todo = missing(level)
        total_s, groups = _sum_seconds(todo), _group(todo)
        with ThreadPoolExecutor(n_cores()) as threads:
            serve = partial(_serve, iter(groups), total_s, say)
            for served in [threads.submit(serve) for _ in groups[: n_cores()]]:
                served.result()
    return len(todo)


def _sum_seconds(signatures: Sequence[Signature]) -> float:
    return sum(each.seconds for each in signatures)


def _group(signatures: Sequence[Signature]) -> list[list[Signature]]:
    """Return signatures grouped by subpackage, the group that takes longest first."""
    groups: dict[str, list[Signature]] = {}
    for each in signatures:
        groups.setdefault(".".join(each.kernel.split(".")[:2]), []).append(each)
    return sorted(groups.values(), key=_sum_seconds, reverse=True)


def _compile_in_background(signatures: Sequence[Signature]) -> None:
    """Compile kernels in a process of low priority, which ends with this one."""
    with suppress(RuntimeError):  # raised if the interpreter is being shut down
        _serve(iter([signatures]), 1.0, lambda share, name: None, niceness=NICENESS)


def _serve(
    groups: Iterator[Sequence[Signature]], total_s: float, on_progress: Say, niceness: int = 0
) -> None:
    """Let one child process compile groups of kernels until none are left.

    Args:
        groups: iterator over groups, which other child processes share.
        total_s: estimated compile time of all groups [s].
        on_progress: callback that receives the progress.
        niceness: increase of the niceness of the child process.
    """
    quiet = f"ignore:{UNTESTED}"  # the parent process warns once
    command = [sys.executable, "-W", quiet, "-m", "hrc_env.core.kernels.ahead", str(niceness)]
    pipes: Any = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "bufsize": 1}
    try:
        process: Any = subprocess.Popen(command, **pipes)
    except OSError as error:
        log.warning(
            "Kernels cannot be compiled in advance (%s); each is compiled when it is first called.",
            error,
        )
        return
    for each in chain.from_iterable(groups):
        answer = DONE if each.is_compiled() else _request(process, each)
        if answer != DONE:
            log.warning("Compiling %s failed; it is compiled when it is first called.", each.kernel)
        if answer in ("", UNSAVED):
            break
        on_progress(each.seconds / total_s, each.kernel.partition(":")[2])
    with suppress(OSError):
        process.communicate()


def _request(process: Any, signature: Signature) -> str:
    """Let a child process compile a kernel, and return its answer; "" if it has died."""
    with suppress(OSError):
        process.stdin.write(json.dumps([signature.kernel, signature.args]) + "\n")
    answer: str = process.stdout.readline()
    return answer


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

    `_serve` starts this function in a child process, with the increase of its niceness.
    """
    if hasattr(os, "nice"):
        os.nice(int(sys.argv[1]))
    for line in sys.stdin:
        name, args = json.loads(line)
        try:
            kernel, types = kernel_named(name), tuple(decode(each) for each in args)
            kernel.compile(types)
            answer = DONE if kernel._cache.path(types).exists() else UNSAVED
        except Exception as error:  # of many kinds: the kernel's arguments or name have changed
            answer = f"failed: {error!r}".replace("\n", " ") + "\n"
        with suppress(BrokenPipeError):  # the parent process has ended
            sys.stdout.write(answer)
            sys.stdout.flush()


if __name__ == "__main__":
    main()
