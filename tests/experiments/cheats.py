"""Policies that try to get at the simulation that judges them, or to disturb it.

Tests copy this file to a folder of its own and play it as a policy. Where a policy can report, it
does so by its actions: all 1 if an attack succeeded, else all 0.
"""

import gc
import inspect
import json
import os
import pickle
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import hrc_env

JUDGING = {"Simulation", "HRCVectorEnv", "HRCEnv", "EpisodeSums", "Shards"}
"""Classes of which a policy's process must have no object."""
FORGED = 1e6


class Scripted:
    """Acts as the scripted agent, and cheats before."""

    def __init__(self, env_info):
        self.expert = hrc_env.make_agent("scripted", env_info)
        self.n = env_info.n_actions

    def act(self, observation):
        self.cheat()
        return self.expert.act(observation)

    def cheat(self):
        """Change nothing."""


class Collector(Scripted):
    """Finds the sums of the score among all objects, and forges them."""

    def cheat(self):
        for each in gc.get_objects():
            if type(each).__name__ == "EpisodeSums":
                each.sums["reward"] = FORGED


class FrameWalker(Scripted):
    """Finds the sums of the score in the frames that call it, and forges them."""

    def cheat(self):
        frames = [sys._getframe(), *(each.frame for each in inspect.stack())]
        for frame in frames:
            while frame is not None:
                for each in frame.f_locals.values():
                    if type(each).__name__ == "EpisodeSums":
                        each.sums["reward"] = FORGED
                frame = frame.f_back


class Patcher(Scripted):
    """Steps a simulation of its own, and replaces the functions that count."""

    def __init__(self, env_info):
        super().__init__(env_info)
        from hrc_env.evaluation.sums import EpisodeSums

        self.own = hrc_env.HRCVectorEnv(1, perception="none")
        self.own.reset(seed=0)
        self.own.step(np.zeros((1, self.n), np.float32))
        summarize = EpisodeSums.summarize
        EpisodeSums.summarize = lambda *given: {**summarize(*given), "r": FORGED}


class Reporter:
    """Answers with whether an attack succeeded."""

    def __init__(self, env_info):
        self.n = env_info.n_actions

    def act(self, observation):
        return np.full((*observation.shape[:-1], self.n), float(self.succeeds()), np.float32)

    def succeeds(self):
        return False


class Searcher(Reporter):
    """Looks for an object that belongs to the judging process."""

    def succeeds(self):
        return any(type(each).__name__ in JUDGING for each in gc.get_objects())


def attempt(function):
    """Whether a function returns without an error of the operating system."""
    try:
        function()
    except OSError:
        return False
    return True


SECRET = Path("/SECRET")
"""Replaced by the tests: a file of the judging process."""


class Reader(Reporter):
    def succeeds(self):
        return attempt(SECRET.read_text)


class Lister(Reporter):
    def succeeds(self):
        return attempt(lambda: os.listdir(SECRET.parent))


class Writer(Reporter):
    def succeeds(self):
        return attempt(lambda: SECRET.write_text("forged"))


class Adder(Reporter):
    def succeeds(self):
        return attempt(lambda: SECRET.with_name("added").write_text("forged"))


class Remover(Reporter):
    def succeeds(self):
        return attempt(SECRET.unlink)


class Spawner(Reporter):
    """Lets a further process read."""

    def succeeds(self):
        return subprocess.run(["/bin/cat", SECRET], check=False).returncode == 0


class LinkReader(Reporter):
    """Reads by a link from the folder that it may write to."""

    def succeeds(self):
        link = Path("link")
        if not link.is_symlink():
            link.symlink_to(SECRET)
        return attempt(link.read_text)


class RootReader(Reporter):
    """Reads by another path to the root of the file system."""

    def succeeds(self):
        return attempt(Path(f"/proc/self/root{SECRET}").read_text)


class MemoryCaller(Reporter):
    """Reads the memory of the judging process by a system call, at the address of libc's data."""

    def succeeds(self):
        import ctypes

        class Span(ctypes.Structure):
            _fields_ = (("base", ctypes.c_void_p), ("length", ctypes.c_size_t))

        here, there = ctypes.create_string_buffer(8), Span(1, 8)
        spans = ctypes.byref(Span(ctypes.addressof(here), 8)), 1, ctypes.byref(there), 1
        libc = ctypes.CDLL(None, use_errno=True)
        libc.process_vm_readv(os.getppid(), *spans, 0)
        return ctypes.get_errno() != 1  # EPERM; EFAULT if only the address is wrong


class MemoryReader(Reporter):
    def succeeds(self):
        return attempt(Path(f"/proc/{os.getppid()}/mem").open)


class ArgumentReader(Reporter):
    def succeeds(self):
        return attempt(Path(f"/proc/{os.getppid()}/cmdline").read_bytes)


SEIZE = 0x4206
"""PTRACE_SEIZE."""


class Tracer(Reporter):
    """Attaches to the judging process as a debugger, without stopping it."""

    def succeeds(self):
        import ctypes

        return ctypes.CDLL(None).ptrace(SEIZE, os.getppid(), None, None) == 0


class PackageWriter(Reporter):
    def succeeds(self):
        return attempt(Path(hrc_env.__file__).with_name("forged.py").touch)


class EnvironmentReader(Reporter):
    def succeeds(self):
        return "HRC_TEST_SECRET" in os.environ


class Dialer(Reporter):
    """Connects to a server of the judging machine, at the port that the tests put here."""

    PORT = 0

    def succeeds(self):
        return attempt(lambda: socket.create_connection(("127.0.0.1", self.PORT), 5))


class Nan(Reporter):
    def act(self, observation):
        action = super().act(observation)
        action[0, 0] = np.nan
        return action


class Infinite(Reporter):
    def act(self, observation):
        return super().act(observation) + np.inf


class WrongShape(Reporter):
    def act(self, observation):
        return np.zeros((3, self.n), np.float32)


class Scalar(Reporter):
    def act(self, observation):
        return 0.5


class Huge(Reporter):
    def act(self, observation):
        return np.zeros((100_000, 1_000), np.float32)


class Words(Reporter):
    def act(self, observation):
        return np.full((len(observation), self.n), "fast")


class Raiser(Reporter):
    def act(self, observation):
        raise ValueError("no idea \x1b[31m")


class Leaver(Reporter):
    def act(self, observation):
        print("leaving now", flush=True)
        sys.exit(3)


class Crasher(Reporter):
    def act(self, observation):
        os.kill(os.getpid(), 11)


class Sleeper(Reporter):
    def act(self, observation):
        time.sleep(3600)


class Late:
    """Does not finish being made."""

    def __init__(self, env_info):
        time.sleep(3600)


class Talker(Reporter):
    """Writes to its output much more than a pipe holds, and acts."""

    def act(self, observation):
        print("word " * 200_000, flush=True)
        return super().act(observation)


def connection():
    """The end of the connection to the judging process that this process has."""
    return next(each for each in gc.get_objects() if type(each) is socket.socket)


class Sender(Reporter):
    """Sends a message of its own in place of actions."""

    def message(self):
        raise NotImplementedError

    def act(self, observation):
        connection().sendall(self.message())
        time.sleep(3600)


def packed(text):
    return len(text).to_bytes(4, "big") + text


class LongHeader(Sender):
    def message(self):
        return b"\xff" * 100


class NoJson(Sender):
    def message(self):
        return packed(b"{nothing")


class NoObject(Sender):
    def message(self):
        return packed(b"[1, 2]")


class Nested(Sender):
    def message(self):
        return packed(b"[" * 60_000)


class Pickle(Sender):
    """Sends a pickle that would create a file."""

    def message(self):
        return packed(pickle.dumps(Bomb()))


class Bomb:
    def __reduce__(self):
        return os.mkdir, (str(SECRET.with_name("exploded")),)


class ObjectKind(Sender):
    """Announces objects, which NumPy could only unpickle."""

    def message(self):
        return packed(json.dumps({"kind": "|O", "shape": [2, 6]}).encode()) + b"x" * 96


class Incomplete(Sender):
    """Announces right actions, and sends a part of them."""

    def message(self):
        return packed(json.dumps({"kind": "<f4", "shape": [2, 6]}).encode()) + b"x"
