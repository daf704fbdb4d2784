"""Every number and picture of the documentation again: make results, python -m benchmarks.results

Runs the studies that are older than the subsystems they depend on (`behaviour.toml`), one after the
other; puts their numbers into `docs/results/whole/`, their pictures into `docs/pictures/`, both
into the pages, and a summary of every part into `docs/results/parts/`, by which `benchmarks.verify`
replays some. What is finished of a study stays in `out/results/`: a run that was stopped goes on.
Numbers come from a clean commit; changes in `docs/` do not count.

    python -m benchmarks.results --list            # what is stale, why, and how long it would take
    python -m benchmarks.results --only site lab
    python -m benchmarks.results --hours 2.5       # what fits into that, the rest another time
    python -m benchmarks.results --quick           # whether every table finds its numbers
"""

import datetime
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import tyro
from rich.console import Console
from rich.table import Table

from benchmarks import records
from benchmarks.studies import COMMANDS, STUDIES, Command, commands_of
from docs import generate, tables
from hrc_env.core.errors import HRCError
from hrc_env.core.results import provenance
from hrc_env.experiments.cache import release_folder
from hrc_env.experiments.runner import describe_experiment
from hrc_env.experiments.versions import select_versions

ROOT = Path(__file__).resolve().parent.parent
OUT, QUICK_OUT = ROOT / "out" / "results", ROOT / "out" / "results_quick"
WHOLE, PICTURES = tables.RESULTS / "whole", ROOT / "docs" / "pictures"
MARK = "made_by.json"
"""In a study's folder: versions, how long it has run, and when its latest run began."""
STOPPING_S = 3.0
"""What is asked to stop is killed after so long [s]."""


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
    trainings: bool = False
    """Also what is for a release only: trainings of policies, for hours."""


def main(arguments: Arguments) -> int:
    """Run what is asked for."""
    console, names = Console(), commands_of(arguments.only or tuple(STUDIES))
    if not arguments.trainings:
        names = tuple(name for name in names if not COMMANDS[name].is_release)
    if arguments.quick:
        return max(try_out(console, name) for name in names if COMMANDS[name].quick)
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
        mine = COMMANDS[name].minutes
        all_left = sum(COMMANDS[each].minutes for each in todo[k:])
        console.print(f"{k + 1} of {len(todo)}: {name}, about {spell_time(mine)}; "
                      f"{spell_time(all_left)} for all that is left", style="bold")  # fmt: skip
        is_begun = time.monotonic() + (0 if COMMANDS[name].goes_on else 60 * mine) < until_s
        if is_begun and run(name, until_s):
            publish(name)
        else:
            console.print(f"{name} is not finished; the same command goes on there.")
    generate.main()
    return 0


def plan(stale: Mapping[str, str]) -> Table:
    """Return a table of commands by study: budget, how long it took last, and why it is stale."""
    heads = ("study", "command", "makes", "budget", "took", "is")
    table = Table(*heads, title="python -m benchmarks.results")
    study_of = {name: each for each, study in STUDIES.items() for name in study.commands}
    for name, why in stale.items():
        command, took = COMMANDS[name], whole(name).get("minutes")
        made = ", ".join((*command.tables, *command.pictures))
        table.add_row(study_of[name], name, made, spell_time(command.minutes),
                      "" if took is None else spell_time(took),
                      f"stale: {why}" if why else "fresh")  # fmt: skip
    minutes = sum(COMMANDS[name].minutes for name, why in stale.items() if why)
    all_minutes = sum(COMMANDS[name].minutes for name in stale)
    table.caption = (
        f"{spell_time(minutes)} for what is stale, {spell_time(all_minutes)} from nothing"
    )
    return table


def spell_time(minutes: float) -> str:
    """Return a time in minutes, or in hours if it is long."""
    return f"{minutes:.0f} min" if minutes < 100 else f"{minutes / 60:.1f} h"


def whole(name: str) -> dict[str, Any]:
    """Return all that a command found when it was run last; empty if that is not known."""
    path = WHOLE / f"{name}.json"
    return json.loads(path.read_text()) if path.exists() else {}


def why_stale(name: str) -> str:
    """Return what has changed since a study's numbers were made; "" if nothing has."""
    command, made = COMMANDS[name], whole(name)
    before = made.get("depends")
    if before is None:
        return "no record of the versions that it was made at"
    found = [
        f"{subsystem} {before.get(subsystem, 'not recorded')} -> {version}"
        for subsystem, version in select_versions(command.depends).items()
        if before.get(subsystem) != version
    ]
    if made.get("command") != command.command:
        found.append("another command")
    else:
        found += changed_settings(made.get("config", {}), current_settings(name))
    if spoiled := records.read(name).spoiled:
        first, words = next(iter(spoiled.items()))
        rest = f" (and {len(spoiled) - 1} more)" if len(spoiled) > 1 else ""
        found.append(f"replayed, part {first}{rest} differs: {words}")
    return ", ".join(found)


def current_settings(name: str) -> dict[str, Any]:
    """Return the settings of a command as its results.json has them; empty where it has none."""
    made = COMMANDS[name].made
    return (
        {} if made is None else json.loads(json.dumps(describe_experiment(made.make(OUT / name))))
    )


def changed_settings(recorded: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """Yield the settings that have other values now: "n_seeds 10 -> 9".

    A setting that only one of them has is left out: a new one begins with what was done before,
    and one whose name was changed has kept its value.
    """
    for name in recorded:
        if name not in now or recorded[name] == now[name]:
            continue
        if isinstance(recorded[name], Mapping) and isinstance(now[name], Mapping):
            yield from changed_settings(recorded[name], now[name])
        else:
            yield f"{name} {_shorten(recorded[name])} -> {_shorten(now[name])}"


def _shorten(value: Any) -> str:
    """Return a value in a few letters."""
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 24 else f"{text[:20]} ..."


def made_by(name: str) -> dict[str, Any]:
    """Return what the parts of a study in `out/` must have been made by."""
    command = COMMANDS[name]
    return {
        "command": command.command,
        "depends": select_versions(command.depends),
        "spoiled": records.read(name).spoiled,
    }


def run(name: str, until_s: float) -> bool:
    """Run a study until it is finished or the time is up; whether it is.

    Raises:
        HRCError: the command failed.
    """
    command, out = COMMANDS[name], OUT / name
    mark, now = out / MARK, made_by(name)
    kept = json.loads(mark.read_text()) if mark.exists() else {}
    if now["spoiled"] and kept.get("spoiled") != now["spoiled"]:
        shutil.rmtree(out, ignore_errors=True)  # its parts have valid keys, and wrong values
    if {each: kept.get(each) for each in now} != now or not command.goes_on:
        kept = {**now, "minutes": 0.0}
    kept["began_s"] = time.time()
    out.mkdir(parents=True, exist_ok=True)
    mark.write_text(json.dumps(kept))
    started_s = time.monotonic()
    status = call(command, out, "", until_s)
    kept["minutes"] += (time.monotonic() - started_s) / 60
    mark.write_text(json.dumps(kept))
    if status:
        raise HRCError(f"{command.command} ended with status {status}; what it finished is kept.")
    return status == 0


def call(command: Command, out: Path, more: str, until_s: float = float("inf")) -> int | None:
    """Call a study's command: its status, None if it was stopped as the time was up."""
    words = [sys.executable, *command.command.split()[1:], *more.split()]
    words += ["--out", str(out)] if command.tables else []
    release_folder(out)  # settings may have changed; the parts know with which they were made
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
    command, out = COMMANDS[name], OUT / name
    content = json.loads((out / "results.json").read_text()) if command.tables else provenance()
    mark = json.loads((out / MARK).read_text())
    content |= {each: mark[each] for each in ("command", "depends", "minutes")}
    content.get("config", {}).pop("out", None)  # of this machine
    before = whole(name)
    if command.goes_on and before.get("config") == content.get("config"):
        # Parts of earlier runs may have been there.
        content["minutes"] = max(content["minutes"], before.get("minutes", 0.0))
    content["machine"].pop("system", None)
    content["date"] = datetime.date.today().isoformat()
    for metric in content.get("metrics", {}).values():
        metric |= {end: float(f"{metric[end]:.6g}") for end in ("value", "low", "high")}
    WHOLE.mkdir(exist_ok=True)
    kept = WHOLE / f"{name}.json"
    kept.write_text(written(content))
    records.write(name, mark["depends"], out / "parts", mark["began_s"])
    for picture, figure in command.pictures.items():
        drawn = out / "figures" / figure
        if picture.endswith(".png"):
            shutil.copy(drawn, PICTURES / picture)
        else:
            quality = [cv2.IMWRITE_JPEG_QUALITY, 88]
            cv2.imwrite(str(PICTURES / picture), cv2.imread(str(drawn)), quality)


def written(content: Mapping[str, Any]) -> str:
    """Return the text of a file of `docs/results/whole/`: a line for each metric."""
    parts = []
    for name, value in content.items():
        text = json.dumps(value, ensure_ascii=False)
        if isinstance(value, list):
            text = "[\n  " + ",\n  ".join(json.dumps(each) for each in value) + "\n ]"
        elif isinstance(value, dict):
            pairs = (
                f"{json.dumps(k)}: {json.dumps(v, ensure_ascii=False)}" for k, v in value.items()
            )
            text = "{\n  " + ",\n  ".join(pairs) + "\n }"
        parts.append(f" {json.dumps(name)}: {text}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def try_out(console: Console, name: str) -> int:
    """A study's short form: 0 if it makes all metrics and pictures that are asked for."""
    command, out, started_s = COMMANDS[name], QUICK_OUT / name, time.monotonic()
    if status := call(command, out, command.quick):
        console.print(f"{name}: ended with status {status}")
        return status
    made = json.loads((out / "results.json").read_text())["metrics"].keys()
    asked = {each for table in command.tables for each in tables.asked(table)}
    missing = {each for each in command.pictures.values() if not (out / "figures" / each).exists()}
    missing |= asked - made
    took_s = time.monotonic() - started_s
    console.print(f"{name}: {took_s:.0f} s, " + (f"missing {sorted(missing)}" if missing else "ok"))
    return int(bool(missing))


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments, description=__doc__)))
