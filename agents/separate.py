"""Agents in processes of their own, which receive observations and nothing else.

A policy in the process of the environment could find the simulation in memory and read the truth or
change the score. Here, the policy's process contains no environment; the judging process checks
every action that it receives, and executes and unpickles nothing of it. On Linux, the process can
also read only Python's libraries, this package and copies of the policy's files, and can write only
to a temporary folder (`confinement`). It computes on the CPU.

Not prevented: a policy can use time up to `ANSWER_S`, memory and disk space, and leave processes
behind; it can see which files exist, and change their permissions and times; it can use UDP and
named sockets, and the rights of root if the judging process has them. Without Landlock, it can read
and change the files and processes of its user.
"""

import os
import pickle
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import weakref
from collections.abc import Generator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from json import dumps
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrc_env import registration
from hrc_env.core import folders
from hrc_env.core.errors import AgentError, HRCError
from hrc_env.core.kernels.cache import folder as find_kernels
from hrc_env.core.registry import FILES
from hrc_env.observations import FLAT

from . import confinement
from .env_info import EnvInfo, Observation
from .messages import (
    ACTION_KINDS,
    EndedError,
    describe_observation,
    receive_bytes,
    receive_header,
    send,
)
from .submission import Submission

START_S = 600.0
"""Time in which a policy's process must start and make its agent [s]."""
ANSWER_S = 600.0
"""Time in which a policy must answer an observation or a batch of observations [s]. It only ends
policies that hang: with 60 s, a scripted policy was late once on a machine with 12 other loads."""
KEPT = ("PATH", "LANG", "TZ", "LD_LIBRARY_PATH", "HRC_ENV_CORES")
KEPT_BEGINNINGS = ("LC_", "OMP_", "OPENBLAS_", "MKL_", "NUMBA_")
"""Environment variables that a policy's process receives, and beginnings of others. They determine
how numbers are computed; others may be secret."""
SYSTEM = (
    "/usr", "/lib", "/lib64", "/bin", "/etc/ld.so.cache", "/etc/localtime", "/etc/passwd",
    "/sys/devices/system", "/dev/urandom", "/dev/random", "/dev/zero", "/proc/self",
    "/proc/cpuinfo", "/proc/meminfo",
)  # fmt: skip
"""Files of the system that a policy may read."""
END_S = 5.0
"""Time in which a process ends that has closed its connection [s]."""
OUTPUT = "output.txt"
"""Name of the file to which the standard output of a policy's process is written."""
MOST_LINES, MOST_SHOWN = 3, 80
"""Maximum number of lines of a policy's output, and of characters of its values, in an error."""


@dataclass(frozen=True, slots=True)
class SeparateProcess:
    """Factory of agents that act in a process of their own."""

    submission: Submission
    """The policy."""
    trust: bool = False
    """Whether pickles in a checkpoint may be loaded, as in `make_agent`."""
    must_confine: bool = False
    """Whether the policy is played only if its process can be confined by Landlock."""

    def __call__(self, env_info: EnvInfo) -> "SeparateAgent":
        """Start a process and make the agent in it; arguments and errors as `SeparateAgent`."""
        return SeparateAgent(self, env_info)


class SeparateAgent:
    """An agent in a process of its own."""

    def __init__(self, made_by: SeparateProcess, env_info: EnvInfo) -> None:
        """Start the process and make the agent in it.

        Raises:
            AgentError: the policy cannot be made for this environment, or takes too long.
            HRCError: processes cannot be separated, or not confined as required, on this machine.
        """
        if sys.platform == "win32":
            raise HRCError("Policies act in processes of their own only on Linux and macOS.")
        if made_by.must_confine and not confinement.find_version():
            raise HRCError(
                "A policy is judged only where its process can be confined: Linux 5.13 or later "
                "with Landlock, which this kernel lacks."
            )
        self.policy, self.n_actions = made_by.submission.policy, env_info.n_actions
        self._folder = Path(tempfile.mkdtemp(prefix="hrc_env_policy_")).resolve()
        self._judge, theirs = socket.socketpair()
        with theirs:
            self._process = _start(self._folder, made_by.submission, theirs)
        self.close = weakref.finalize(self, _end, self._process, self._judge, self._folder)
        """End the process and remove its files, at the latest when this agent is no longer used."""
        info = pickle.dumps(env_info)
        header = {"policy": made_by.submission.name, "seed": 0, "trust": made_by.trust,
                  "env_info": len(info)}  # fmt: skip
        self._end_s = 0.0
        self._ask(header, START_S, info)

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return actions (..., A) of the policy for observations (..., n).

        Raises:
            AgentError: the process has ended, answers too late, or its actions have another shape
                or are not finite.
        """
        arrays = observation if isinstance(observation, Mapping) else {FLAT: observation}
        expected = (*arrays[FLAT].shape[:-1], self.n_actions)
        answer = self._ask(describe_observation(observation), ANSWER_S, *arrays.values())
        kind, shape = answer.get("kind"), answer.get("shape")
        if kind not in ACTION_KINDS or shape != [*expected]:
            raise self._fail(
                f"its actions must be numbers of shape {expected}, got {str(kind)[:MOST_SHOWN]} "
                f"of shape {str(shape)[:MOST_SHOWN]}"
            )
        with self._failing():
            n_bytes = int(np.prod(expected)) * np.dtype(kind).itemsize
            content = receive_bytes(self._judge, n_bytes, self._end_s)
        action = np.frombuffer(content, kind).reshape(expected)
        if n_invalid := int(action.size - np.isfinite(action).sum()):
            raise self._fail(
                f"its actions must be finite, got {n_invalid} of {action.size} numbers that are "
                "not finite"
            )
        return action

    def _ask(
        self, header: Mapping[str, Any], limit_s: float, *parts: bytes | NDArray[Any]
    ) -> dict[str, Any]:
        """Send a message and return the header of the answer."""
        self._end_s = time.monotonic() + limit_s
        self._judge.settimeout(limit_s)
        with self._failing():
            send(self._judge, header, *parts)
            answer = receive_header(self._judge, self._end_s)
        if "error" in answer:
            raise self._fail(f"it raised {_make_printable(str(answer['error']))}")
        return answer

    @contextmanager
    def _failing(self) -> Generator[None]:
        """Return a context that turns failures of the connection into `AgentError`."""
        try:
            yield
        except EndedError as error:
            raise self._fail(f"its process ended with {self._describe_end()}") from error
        except TimeoutError as error:
            limits = f"{ANSWER_S:g} s for an answer, {START_S:g} s for the start"
            raise self._fail(f"its process did not answer in time ({limits})") from error
        except ValueError as error:
            raise self._fail(f"its process sent {error}") from error

    def _describe_end(self) -> str:
        try:
            status = self._process.wait(END_S)
        except subprocess.TimeoutExpired:
            return "a closed connection"
        return f"status {status}" if status >= 0 else signal.Signals(-status).name

    def _fail(self, reason: str) -> AgentError:
        """End the process, and return the error with the last lines of its output."""
        lines = _make_printable((self._folder / OUTPUT).read_text(errors="replace")).splitlines()
        last = " / ".join(line.strip() for line in lines[-MOST_LINES:])
        self.close()
        shown = f" Its last output: {last}" if last else ""
        return AgentError(f"The policy {self.policy!r} failed: {reason}.{shown}")


def _start(own: Path, submission: Submission, theirs: socket.socket) -> subprocess.Popen[bytes]:
    """Start the process of a policy.

    Args:
        own: folder of the process; it is created by the judging process and removed by it.
        submission: the policy.
        theirs: end of the connection that the process receives.
    """
    package = Path(registration.__file__).resolve().parent
    library, policy, scratch = (own / name for name in ("library", "policy", "scratch"))
    for each in (library, policy, scratch):
        each.mkdir()
    (library / "hrc_env").symlink_to(package)
    for name, content in submission.files.items():
        (policy / name).parent.mkdir(parents=True, exist_ok=True)
        (policy / name).write_bytes(content)
    installed = [each for each in sys.path if Path(each).name in ("site-packages", "dist-packages")]
    imported = [*filter(None, os.environ.get(registration.IMPORT, "").split(os.pathsep)), *FILES]
    variables = {
        **{name: value for name, value in os.environ.items()
           if name in KEPT or name.startswith(KEPT_BEGINNINGS)},
        "HOME": str(scratch), "TMPDIR": str(scratch), "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONPATH": os.pathsep.join(map(str, (library, policy, *installed))),
        registration.IMPORT: os.pathsep.join(dict.fromkeys(imported)),
    }  # fmt: skip
    if usual := folders.usual_cache():
        variables["XDG_CACHE_HOME"] = str(usual.parent)  # compiled kernels, which it may read
    command = [sys.executable, "-P", "-m", f"{__package__}.serving", str(theirs.fileno())]
    if confinement.find_version():
        prefixes = (sys.prefix, sys.base_prefix, sys.exec_prefix)
        parts = (each.resolve() for each in package.iterdir())  # links in a checkout
        readable = (*SYSTEM, *prefixes, *installed, package, *parts, find_kernels(), *imported,
                    library)  # fmt: skip
        allowed = {"readable": [*map(str, readable)],
                   "writable": [str(policy), str(scratch), os.devnull]}  # fmt: skip
        command = [sys.executable, "-I", "-S", confinement.__file__, dumps(allowed), *command]
    with (own / OUTPUT).open("wb") as output:
        return subprocess.Popen(
            command, cwd=policy, env=variables, stdin=subprocess.DEVNULL, stdout=output,
            stderr=output, pass_fds=(theirs.fileno(),), start_new_session=True,
        )  # fmt: skip


def _end(process: subprocess.Popen[bytes], judge: socket.socket, own: Path) -> None:
    """End the process of a policy with the processes of its session, and remove its folder."""
    judge.close()
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    shutil.rmtree(own, ignore_errors=True)


def _make_printable(text: str) -> str:
    """Return a text without characters that control a terminal."""
    return "".join(each for each in text if each.isprintable() or each == "\n")
