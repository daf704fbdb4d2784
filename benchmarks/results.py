"""Every number and picture of the documentation again: make results, python -m benchmarks.results

Runs the studies that are older than the code and data they depend on, one after the other; puts
their numbers into `docs/results/`, their pictures into `docs/pictures/`, both into the pages. What
is finished of a study stays in `out/results/`: a run that was stopped goes on. Numbers come from a
clean commit; changes in `docs/` do not count.

    python -m benchmarks.results --list            # what is stale, why, and how long it would take
    python -m benchmarks.results --only site lab
    python -m benchmarks.results --hours 2.5       # what fits into that, the rest another time
    python -m benchmarks.results --quick           # whether every table finds its numbers
"""

import ast
import datetime
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import tyro
from rich.console import Console
from rich.table import Table

from benchmarks.studies import STUDIES, Study
from docs import generate, tables
from hrc_env.core.errors import HRCError, check_names
from hrc_env.core.results import provenance
from hrc_env.experiments.study.fingerprint import sources_of

ROOT = Path(__file__).resolve().parent.parent
OUT, QUICK_OUT = ROOT / "out" / "results", ROOT / "out" / "results_quick"
WHOLE, PICTURES = tables.RESULTS / "whole", ROOT / "docs" / "pictures"
STOPPING_S = 3.0
"""What is asked to stop is killed after so long [s]."""
NO_NUMBERS = (
    "hrc_env/cli",
    "hrc_env/core/kernels/signatures.json",
    "hrc_env/experiments/benchmark/entries",
)
"""What changes no number: command lines, what is compiled ahead, the leaderboard's entries."""


@dataclass(frozen=True)
class Arguments:
    """Make stale results again."""

    only: tuple[str, ...] = ()
    """Studies, also where they are fresh; all that are stale if not given."""
    list: bool = False
    """Say what is stale, why, and how long it would take; run nothing."""
    hours: float | None = None
    """Stop after so long; what is finished is kept."""
    quick: bool = False
    """Run short forms in out/results_quick, and see that every table finds its metrics there."""
    dirty: bool = False
    """Although there are changes that are not committed; numbers say so."""


def main(arguments: Arguments) -> int:
    """Run what is asked for."""
    console, names = Console(), arguments.only or tuple(STUDIES)
    check_names("study", names, STUDIES)
    if arguments.quick:
        return max(try_out(console, name) for name in names if STUDIES[name].quick)
    stale = {name: why_stale(name) for name in names}
    if arguments.list:
        console.print(plan(stale))
        return 0
    if "+changes" in str(provenance()["git"]) and not arguments.dirty:
        console.print("There are changes that are not committed, and results come from a clean "
                      "commit. Commit them, or give --dirty.", style="red")  # fmt: skip
        return 2
    todo = [name for name in names if stale[name] or arguments.only]
    until_s = float("inf") if arguments.hours is None else time.monotonic() + 3600 * arguments.hours
    for k, name in enumerate(todo):
        mine, all_left = expected_min(name), sum(expected_min(each) for each in todo[k:])
        console.print(f"{k + 1} of {len(todo)}: {name}, about {spoken(mine)}; {spoken(all_left)} "
                      "for all that is left", style="bold")  # fmt: skip
        is_begun = time.monotonic() + (0 if STUDIES[name].goes_on else 60 * mine) < until_s
        if is_begun and run(name, until_s):
            publish(name)
        else:
            console.print(f"{name} is not finished; the same command goes on there.")
    generate.main([])
    return 0


def plan(stale: Mapping[str, str]) -> Table:
    """Every study, how long it takes, and why it is stale."""
    table = Table("study", "makes", "takes", "is", title="python -m benchmarks.results")
    for name, why in stale.items():
        made = ", ".join((*STUDIES[name].tables, *STUDIES[name].pictures))
        table.add_row(name, made, spoken(expected_min(name)), f"stale: {why}" if why else "fresh")
    minutes = sum(expected_min(name) for name, why in stale.items() if why)
    table.caption = f"{spoken(minutes)} for what is stale"
    return table


def spoken(minutes: float) -> str:
    """As people say it."""
    return f"{minutes:.0f} min" if minutes < 100 else f"{minutes / 60:.1f} h"


def expected_min(name: str) -> float:
    """How long a study takes: as long as it took [min]."""
    return float(whole(name).get("minutes", STUDIES[name].minutes))


def whole(name: str) -> dict[str, Any]:
    """All that a study found when it was run last; empty if that is not known."""
    path = WHOLE / f"{name}.json"
    return json.loads(path.read_text()) if path.exists() else {}


def why_stale(name: str) -> str:
    """What has changed since a study's numbers were made; "" if nothing."""
    before, now = whole(name).get("depends"), depends(STUDIES[name])
    if before is None:
        return "no record of what it was made by"
    return ", ".join(sorted(k for k in before | now if before.get(k) != now.get(k)))


def depends(study: Study) -> dict[str, str]:
    """Digests of the command, of the code that it imports, and of all data, folder by folder."""
    digests = {"command": hashlib.sha256(study.command.encode())}
    files = [*sources_of(*study.modules), ROOT / "constraints.txt"]
    files += [
        each
        for top in ("assets", "hrc_env")
        for each in (ROOT / top).rglob("*")
        if each.is_file() and "__pycache__" not in each.parts and each.suffix != ".py"
    ]
    for path in sorted(files):
        inside = path.relative_to(ROOT)
        if not inside.as_posix().startswith(NO_NUMBERS):
            content = code_of(path.read_text()) if path.suffix == ".py" else path.read_bytes()
            digest = digests.setdefault("/".join(inside.parts[:2]), hashlib.sha256())
            digest.update(inside.as_posix().encode() + content)
    return {name: digest.hexdigest()[:8] for name, digest in digests.items()}


@cache
def code_of(text: str) -> bytes:
    """What a module's text does: without comments, docstrings and layout."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(body := getattr(node, "body", None), list):
            said = [isinstance(getattr(each, "value", None), ast.Constant)
                    and isinstance(each, ast.Expr) for each in body]  # fmt: skip
            body[:] = [each for each, is_said in zip(body, said, strict=True) if not is_said]
    return ast.unparse(tree).encode()


def run(name: str, until_s: float) -> bool:
    """Run a study until it is finished or the time is up; whether it is.

    Raises:
        HRCError: the command failed.
    """
    study, out = STUDIES[name], OUT / name
    mark, now = out / "depends.json", depends(study)
    kept = json.loads(mark.read_text()) if mark.exists() else {}
    is_new = kept.get("depends") != now
    if is_new and not study.is_keyed:
        shutil.rmtree(out, ignore_errors=True)
    if is_new or not study.goes_on:
        kept = {"depends": now, "minutes": 0.0}
    out.mkdir(parents=True, exist_ok=True)
    mark.write_text(json.dumps(kept))
    started_s = time.monotonic()
    status = call(study, out, "", until_s)
    kept["minutes"] += (time.monotonic() - started_s) / 60
    mark.write_text(json.dumps(kept))
    if status:
        raise HRCError(f"{study.command} ended with status {status}; what it finished is kept.")
    return status == 0


def call(study: Study, out: Path, more: str, until_s: float = float("inf")) -> int | None:
    """Call a study's command: its status, None if it was stopped as the time was up."""
    words = [sys.executable, *study.command.split()[1:], *more.split()]
    words += ["--out", str(out)] if study.tables else []
    process = subprocess.Popen(words, cwd=ROOT, start_new_session=True)
    left_s = until_s - time.monotonic()
    try:
        return process.wait(left_s if left_s < float("inf") else None)
    except (subprocess.TimeoutExpired, KeyboardInterrupt) as stopped:
        os.killpg(process.pid, signal.SIGINT)
        time.sleep(STOPPING_S)  # parts are written whole or not at all
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        if isinstance(stopped, KeyboardInterrupt):
            raise
        return None


def publish(name: str) -> None:
    """A finished study's numbers and pictures into the documentation."""
    study, out = STUDIES[name], OUT / name
    content = json.loads((out / "results.json").read_text()) if study.tables else provenance()
    content |= json.loads((out / "depends.json").read_text())
    if study.goes_on and study.is_keyed:  # parts of earlier runs may have been there
        content["minutes"] = max(content["minutes"], whole(name).get("minutes", 0.0))
    content.get("config", {}).pop("out", None)  # of this machine
    content["machine"].pop("system", None)
    content["date"] = datetime.date.today().isoformat()
    for metric in content.get("metrics", {}).values():
        metric |= {end: float(f"{metric[end]:.6g}") for end in ("value", "low", "high")}
    WHOLE.mkdir(exist_ok=True)
    kept = WHOLE / f"{name}.json"
    kept.write_text(tables.written(content))
    word = hashlib.sha256(json.dumps(content["depends"]).encode()).hexdigest()[:12]
    for each in study.tables:
        table = tables.renewed(tables.read(each), kept, depends=word)
        (tables.RESULTS / f"{each}.json").write_text(tables.written(table))
    for picture, figure in study.pictures.items():
        drawn = out / "figures" / figure
        if picture.endswith(".png"):
            shutil.copy(drawn, PICTURES / picture)
        else:
            quality = [cv2.IMWRITE_JPEG_QUALITY, 88]
            cv2.imwrite(str(PICTURES / picture), cv2.imread(str(drawn)), quality)


def try_out(console: Console, name: str) -> int:
    """A study's short form: 0 if it makes all metrics and pictures that are asked for."""
    study, out, started_s = STUDIES[name], QUICK_OUT / name, time.monotonic()
    if status := call(study, out, study.quick):
        console.print(f"{name}: ended with status {status}")
        return status
    made = json.loads((out / "results.json").read_text())["metrics"].keys()
    asked = {each for table in study.tables for each in tables.asked(tables.read(table))}
    missing = {each for each in study.pictures.values() if not (out / "figures" / each).exists()}
    missing |= asked - made
    took_s = time.monotonic() - started_s
    console.print(f"{name}: {took_s:.0f} s, " + (f"missing {sorted(missing)}" if missing else "ok"))
    return int(bool(missing))


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments, description=__doc__)))
