"""Change the code line by line, and see whether probes and tests notice: the net is attacked.

    python -m tests.behaviour.mutate                              # play draw A
    python -m tests.behaviour.mutate semantic draw_B              # play other lists
    python -m tests.behaviour.mutate draw_A --missed              # only those not noticed yet
    python -m tests.behaviour.mutate --draw B --seed 20261201     # make a draw; plays nothing

Each mutant is made in a copy of the checkout. The probes of its room are played, those first that
are likely to notice it; then those of kernels once more with every index checked; then the room's
unit tests. The first notice ends it. Finished mutants are kept in `out/mutants/LIST.json`, from
which a run that was stopped goes on. The exit status is 1 if any was not noticed.
"""

import contextlib
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass, field
from pathlib import Path
from queue import SimpleQueue
from typing import Annotated, Any

import tyro
from rich.console import Console
from scipy.stats import binomtest

from hrc_env.core.progress import Meter
from tests.behaviour.mutants import CODE, ROOT, Mutant, MutantError, draw, read_list
from tests.behaviour.mutants.child import ELSEWHERE, MARK, NOTICED, SAME
from tests.behaviour.playing import BOUNDED, bounds_checked

OUT = ROOT / "out" / "mutants"
KERNELS = ROOT / "hrc_env" / "__pycache__" / "kernels"
BOUNDED_KERNELS = ROOT / "out" / "bounds" / "hrc_env"
JUDGED = ("hrc_env", "agents", "assets", "tests", "pyproject.toml")
"""Parts of the checkout on which an outcome depends."""
OURS = ("tests/behaviour/mut", "tests/behaviour/test_mutations.py")
"""Paths that begin so are of this tool, on which none does."""
FAST, SLOW = "not slow and not long", "slow and not long"
"""The unit tests that run first, and those that run last."""
SHOWN_EVERY_S = 5.0


@dataclass(frozen=True)
class Arguments:
    """Change the code line by line, and see whether probes and tests notice."""

    lists: Annotated[tuple[str, ...], tyro.conf.Positional] = ("draw_A",)
    """Lists of mutants in tests/behaviour/mutants, without ".toml"."""
    draw: str = ""
    """Make a draw of this letter, unless it has been made, and play nothing."""
    seed: int = 0
    """Seed of the draw."""
    n: int = 80
    """Number of mutants in the draw."""
    missed: bool = False
    """Keep the mutants that were noticed in earlier states of the checkout; play the rest again."""
    probes: tuple[str, ...] = ()
    """Play probes of these rooms only; all of a room's if none is given."""
    without_tests: bool = False
    """Run no unit tests."""
    at_once: int = 2
    """How many mutants are judged at the same time."""
    limit_min: float = 5.0
    """Probes, and tests, that take longer than this count as noticed: they hang [min]."""


@dataclass(frozen=True, slots=True)
class Notice:
    """How something was noticed."""

    by: str
    """The label of a probe, or the id of a test."""
    how: str
    """"probe" or "test": a value was another one; "exception", "crash" or "hang"."""
    words: str = ""


@dataclass(frozen=True, slots=True)
class Result:
    """The outcome of one mutant."""

    mutant: Mutant
    notice: Notice | None
    seconds: float
    checkout: str
    """Digest of the checkout in which it was judged."""

    def as_entry(self) -> dict[str, Any]:
        """Return it as it is kept."""
        found = self.notice or Notice("", "")
        return {
            **asdict(self.mutant), "noticed_by": found.by or None, "how": found.how,
            "words": found.words[:500], "seconds": round(self.seconds, 1),
            "checkout": self.checkout,
        }  # fmt: skip


class KilledError(Exception):
    """A process was ended from outside, so that its mutant is not judged."""


@dataclass
class Kept:
    """The finished mutants of a list, in a file that is never half written."""

    path: Path
    checkout: str
    takes_noticed: bool = False
    """Whether mutants that were noticed in other states of the checkout count as finished."""
    entries: dict[str, dict[str, Any]] = field(default_factory=dict)
    """By the mutant's name."""

    def __post_init__(self) -> None:
        if self.path.exists():
            found = json.loads(self.path.read_text())["mutants"]
            self.entries = {each["name"]: each for each in found if self._counts(each)}

    def _counts(self, entry: Mapping[str, Any]) -> bool:
        is_noticed = entry["noticed_by"] is not None
        return entry["checkout"] == self.checkout or (self.takes_noticed and is_noticed)

    def has(self, mutant: Mutant) -> bool:
        """Return whether this very mutant is finished."""
        entry = self.entries.get(mutant.name)
        return entry is not None and entry["edits"] == [asdict(each) for each in mutant.edits]

    def add(self, result: Result) -> None:
        """Keep a result."""
        self.entries[result.mutant.name] = result.as_entry()
        write_json(self.path, {"mutants": list(self.entries.values())})


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a file: to a draft first, which then takes its place."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".draft")
    draft.write_text(json.dumps(content, indent=1))
    draft.replace(path)


# The copies.


def copy_checkout(root: Path, folder: Path) -> None:
    """Copy the files that git knows or would add, as they stand in the working tree."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(command, cwd=root, stdout=subprocess.PIPE, text=True, check=True).stdout
    for name in sorted(set(filter(None, names.split("\0")))):
        if (root / name).is_symlink() or (root / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, folder / name, follow_symlinks=False)


def digest_checkout(folder: Path, *settings: object) -> str:
    """Return a digest of everything on which an outcome depends."""
    digest = hashlib.sha256(repr(settings).encode())
    for path in sorted(each for each in folder.rglob("*") if each.is_file()):
        name = path.relative_to(folder).as_posix()
        if name.startswith(JUDGED) and not name.startswith(OURS) and "__pycache__" not in name:
            digest.update(name.encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:16]


class Processes:
    """Runs processes that end when this one does."""

    def __init__(self) -> None:
        self._running: set[int] = set()
        self._lock, self._is_over = threading.Lock(), False

    def run(
        self, command: Sequence[str], folder: Path, kernels: Mapping[str, str], limit_s: float
    ) -> tuple[int | None, str, str]:
        """Run a command in a copy; return its exit status, None if it hung, and its output.

        Args:
            command: the command.
            folder: the copy.
            kernels: environment variables of its kernels.
            limit_s: when it counts as hanging [s].
        """
        variables = {
            "PYTHONPATH": str(folder), "OMP_NUM_THREADS": "1", **kernels,
            "PYTHONDONTWRITEBYTECODE": "1",  # its check of a file's age is too coarse for mutants
        }  # fmt: skip
        with self._lock:
            if self._is_over:
                raise KilledError("The run was stopped.")
            process = subprocess.Popen(
                command, cwd=folder, env={**os.environ, **variables}, stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace",
                start_new_session=True,
            )  # fmt: skip
            self._running.add(process.pid)
        try:
            output, complaint = process.communicate(timeout=limit_s)
            status: int | None = process.returncode
        except subprocess.TimeoutExpired:
            _end(process.pid)
            (output, complaint), status = process.communicate(), None
        finally:
            self._running.discard(process.pid)
        if status == -signal.SIGKILL:
            raise KilledError("A process was killed from outside; was there too little memory?")
        return status, output, complaint

    def end_all(self) -> None:
        """End all running processes, and begin no more."""
        with self._lock:
            self._is_over = True
            for pid in list(self._running):
                _end(pid)


def _end(pid: int) -> None:
    """End the process that leads a group, and the group."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(pid, signal.SIGKILL)


# Judging.


class Judge:
    """Judges mutants in copies of one state of the checkout."""

    def __init__(
        self, copies: Sequence[Path], kernels: Path, checkout: str, arguments: Arguments, out: Path
    ) -> None:
        self.kernels, self.checkout, self.arguments = kernels, checkout, arguments
        self.processes = Processes()
        self._free: SimpleQueue[Path] = SimpleQueue()
        for copy in copies:
            self._free.put(copy)
        self._passed_path = out / "baseline.json"
        self._passed = self._read_passed()
        self._lock, self._bounds_lock = threading.Lock(), threading.Lock()
        self._room_locks = {room: threading.Lock() for room in CODE}

    def judge(self, mutant: Mutant) -> Result:
        """Judge one mutant, as soon as a copy is free."""
        started_s, copy = time.monotonic(), self._free.get()
        try:
            notice = self._look(mutant, copy)
        finally:
            self._free.put(copy)
        return Result(mutant, notice, time.monotonic() - started_s, self.checkout)

    def _look(self, mutant: Mutant, copy: Path) -> Notice | None:
        room = CODE[mutant.room]
        hints = tuple(dict.fromkeys(Path(edit.file).stem for edit in mutant.edits))
        rooms = self.rooms_for(mutant)
        notice = self._changed(mutant, copy, self._play_probes, rooms, hints)
        bounded = tuple(each for each in rooms if each in BOUNDED)
        if notice is None and bounded:
            self.require_bounds(bounded, copy)
            notice = self._changed(mutant, copy, self._check_bounds, bounded, hints)
        if notice is None and not self.arguments.without_tests:
            self.require_tests(mutant.room, copy)
            for marks in (FAST, SLOW):
                notice = notice or self._changed(mutant, copy, self._run_tests, room.tests, marks)
        return notice

    def _changed(self, mutant: Mutant, copy: Path, look: Any, *words: Any) -> Notice | None:
        """Look at a copy while the mutant is in it."""
        before = mutant.write_into(copy)
        try:
            return look(copy, *words)
        finally:
            for path, text in before.items():
                path.write_text(text)

    def rooms_for(self, mutant: Mutant) -> tuple[str, ...]:
        """Return the rooms of probes that speak for a mutant."""
        chosen = self.arguments.probes
        return tuple(each for each in CODE[mutant.room].probes if not chosen or each in chosen)

    def _play_probes(
        self, copy: Path, rooms: tuple[str, ...], hints: tuple[str, ...] = ()
    ) -> Notice | None:
        plain = {"NUMBA_CACHE_DIR": str(self.kernels / "plain")}
        return self._call(f"play_probes({rooms!r}, {hints!r})", copy, plain)

    def _check_bounds(
        self, copy: Path, rooms: tuple[str, ...], hints: tuple[str, ...] = ()
    ) -> Notice | None:
        bounded = bounds_checked(self.kernels / "bounds")
        return self._call(f"play_probes({rooms!r}, {hints!r})", copy, bounded)

    def _run_tests(self, copy: Path, paths: tuple[str, ...], marks: str) -> Notice | None:
        plain = {"NUMBA_CACHE_DIR": str(self.kernels / "plain")}
        return self._call(f"run_tests({paths!r}, {marks!r})", copy, plain)

    def _call(self, call: str, copy: Path, kernels: Mapping[str, str]) -> Notice | None:
        """Call a function of `mutants.child` in a copy and return its notice."""
        code = f"import sys; from tests.behaviour.mutants import child; sys.exit(child.{call})"
        limit_s = 60.0 * self.arguments.limit_min
        command = [sys.executable, "-c", code]
        status, output, complaint = self.processes.run(command, copy, kernels, limit_s)
        if status == ELSEWHERE:
            raise MutantError(f"{copy} was to be imported, and another checkout was.")
        return read_notice(status, output, complaint)

    # The unchanged code.

    def require_probes(self, room: str) -> None:
        """Raise `MutantError` unless the probes of a room pass on the unchanged code."""
        copy = self._free.get()
        try:
            self._require(f"probes of {room}", lambda: self._play_probes(copy, (room,)))
        finally:
            self._free.put(copy)

    def require_bounds(self, rooms: tuple[str, ...], copy: Path) -> None:
        """Raise `MutantError` unless the kernels of rooms keep to their arrays in the unchanged
        code."""
        with self._bounds_lock:
            for room in rooms:
                self._require(
                    f"bounds of {room}", lambda room=room: self._check_bounds(copy, (room,))
                )

    def require_tests(self, room: str, copy: Path) -> None:
        """Raise `MutantError` unless the tests of a room of the code pass on the unchanged code."""
        with self._room_locks[room]:
            for marks in (FAST, SLOW):
                self._require(
                    f"tests of {room}, {marks}",
                    lambda marks=marks: self._run_tests(copy, CODE[room].tests, marks),
                )

    def _require(self, name: str, look: Any) -> None:
        if name in self._passed:
            return
        notice = look()
        if notice is not None:
            raise MutantError(
                f"The unchanged code does not pass the {name}, so that they can judge no mutant: "
                f"{notice.by} ({notice.how}) {notice.words}"
            )
        with self._lock:
            self._passed.append(name)
            content = {"checkout": self.checkout, "passed": self._passed}
            write_json(self._passed_path, content)

    def _read_passed(self) -> list[str]:
        if not self._passed_path.exists():
            return []
        content = json.loads(self._passed_path.read_text())
        return list(content["passed"]) if content["checkout"] == self.checkout else []


def read_notice(status: int | None, output: str, complaint: str) -> Notice | None:
    """Return the notice of a process, by its exit status (None: it hung) and its output."""
    lines = [json.loads(line[len(MARK) :]) for line in output.splitlines() if line.startswith(MARK)]
    last = next((each["playing"] for each in reversed(lines) if "playing" in each), "its start")
    found = next((each for each in lines if "noticed" in each), None)
    rest = [line for line in f"{output}\n{complaint}".splitlines() if line.strip()]
    words = next((line for line in reversed(rest) if not line.startswith(MARK)), "")
    if status is None:
        return Notice(last, "hang", "It took longer than the limit.")
    if found is not None:
        return Notice(found["noticed"], found["how"], found["words"])
    if status == SAME:
        return None
    if status == NOTICED:
        return Notice(last, "exception", words)
    return Notice(last, "crash", f"exit status {status}: {words}")


# The command.


def main(arguments: Arguments) -> int:
    """Draw or play; 0 if everything was noticed."""
    console = Console()
    if arguments.draw:
        path = draw(arguments.draw, arguments.seed, arguments.n)
        console.print(f"{path.relative_to(ROOT)}: {len(read_list(path.stem))} mutants")
        return 0
    lists = {name: read_list(name) for name in arguments.lists}
    with tempfile.TemporaryDirectory(prefix="mutants-") as place:
        copies = [Path(place) / f"copy_{k}" for k in range(arguments.at_once)]
        copy_checkout(ROOT, copies[0])
        for copy in copies[1:]:
            shutil.copytree(copies[0], copy)
        kernels = Path(place) / "kernels"
        for made, name in ((KERNELS, "plain"), (BOUNDED_KERNELS, "bounds")):
            if made.is_dir():
                shutil.copytree(made, kernels / name / "hrc_env")
        checkout = digest_checkout(copies[0], arguments.probes, arguments.without_tests)
        judge = Judge(copies, kernels, checkout, arguments, OUT)
        try:
            n_missed = sum(play(name, mutants, judge, console) for name, mutants in lists.items())
        finally:
            judge.processes.end_all()
    return int(n_missed > 0)


def play(name: str, mutants: Sequence[Mutant], judge: Judge, console: Console) -> int:
    """Judge a list of mutants, keep and report the results; return how many were not noticed."""
    kept = Kept(OUT / f"{name}.json", judge.checkout, judge.arguments.missed)
    left = [each for each in mutants if not kept.has(each)]
    with ThreadPoolExecutor(judge.arguments.at_once) as threads:
        try:
            rooms = dict.fromkeys(room for each in left for room in judge.rooms_for(each))
            baseline = [threads.submit(judge.require_probes, room) for room in rooms]
            _collect(baseline, Meter(console, "unchanged code", len(rooms), "rooms"), None)
            futures = [threads.submit(judge.judge, each) for each in left]
            n_done = len(mutants) - len(left)
            meter = Meter(console, name, len(mutants), "mutants", done=n_done)
            _collect(futures, meter, kept)
        except BaseException:
            judge.processes.end_all()
            threads.shutdown(wait=False, cancel_futures=True)
            raise
    return report(name, [kept.entries[each.name] for each in mutants], console)


def _collect(futures: Iterable[Future[Any]], meter: Meter, kept: Kept | None) -> None:
    """Show how far they are, and keep each result as it comes."""
    waiting, n_missed = set(futures), 0
    with meter:
        while waiting:
            done, waiting = wait(waiting, SHOWN_EVERY_S, FIRST_COMPLETED)
            for future in done:
                result = future.result()
                if kept is not None:
                    kept.add(result)
                    n_missed += result.notice is None
            note = f"{n_missed} not noticed" if kept is not None else ""
            meter.show(meter.done + len(done), note=note)


def report(name: str, entries: Sequence[Mapping[str, Any]], console: Console) -> int:
    """Print the mutants that were not noticed, and counts; return how many were not."""
    missed = [each for each in entries if each["noticed_by"] is None]

    def say(text: str) -> None:
        console.print(text, markup=False, highlight=False, soft_wrap=True)

    for each in missed:
        say(f"Not noticed: {each['name']} ({each['room']}, {each['kind']})")
        for edit in each["edits"]:
            say(f"    {edit['file']}:{edit['line']}")
            say(f"      - {edit['before'].strip()}\n      + {edit['after'].strip()}")
    n, n_noticed = len(entries), len(entries) - len(missed)
    if n:
        interval = binomtest(n_noticed, n).proportion_ci(method="exact")
        how = Counter(each["how"] for each in entries if each["noticed_by"] is not None)
        say(
            f"{name}: {n_noticed} of {n} noticed ({100 * n_noticed / n:.1f} %, 95 % interval "
            f"{100 * interval.low:.1f} to {100 * interval.high:.1f}); "
            + ", ".join(f"{count} by {kind}" for kind, count in how.most_common())
        )
    say(f"Each of them: {OUT / name}.json")
    return len(missed)


def _stop(*_: object) -> None:
    raise SystemExit("The run was stopped. The next one goes on from the finished mutants.")


def run() -> int:
    """Parse the command line and run; refusals are printed in words."""
    signal.signal(signal.SIGTERM, _stop)
    signal.signal(signal.SIGINT, _stop)
    try:
        return main(tyro.cli(Arguments, description=__doc__))
    except (MutantError, KilledError) as refusal:
        Console(stderr=True).print(
            f"Refused: {refusal}", markup=False, highlight=False, soft_wrap=True
        )
        return 2


if __name__ == "__main__":
    sys.exit(run())
