"""Regenerate every number and picture of the documentation.

This command runs the studies that are older than the subsystems on which they depend
(`behaviour.toml`), one after the other. It writes their numbers to `docs/results/whole/` and their
pictures to `docs/pictures/`, and inserts both into the pages. It also writes a summary of each part
to `docs/results/parts/`, with which `benchmarks.verify` compares replays. The results of completed
parts are cached in `out/results/`, and an interrupted run continues from them. The working tree
must be clean, except for changes in `docs/`.

    python -m benchmarks.results --list            # stale studies, with the reason and the time
    python -m benchmarks.results --only site lab
    python -m benchmarks.results --hours 2.5       # studies that fit into this time
    python -m benchmarks.results --quick           # check that every table finds its numbers
"""

import datetime
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import tyro
from rich.console import Console
from rich.table import Table

from benchmarks import records
from benchmarks.studies import COMMANDS, STUDIES, Command, list_commands
from docs import generate, tables
from hrc_env.core.errors import HRCError
from hrc_env.core.results import provenance
from hrc_env.experiments.cache import release_folder
from hrc_env.experiments.runner import describe_experiment
from hrc_env.experiments.versions import select_versions

ROOT = Path(__file__).resolve().parent.parent
OUT, QUICK_OUT = ROOT / "out" / "results", ROOT / "out" / "results_quick"
"""Folders for the output of studies and of their quick runs."""
WHOLE, PICTURES = tables.RESULTS / "whole", ROOT / "docs" / "pictures"
"""Folders of the published numbers and pictures."""
MARK = "made_by.json"
"""Name of the file in a study's folder that records the versions, the computing time, and the start
of the latest run.
"""
STOPPING_S = 3.0
"""Time after an interrupt after which a command is killed [s]."""


@dataclass(frozen=True)
class Arguments:
    """Run the studies with outdated (stale) results again."""

    only: tuple[str, ...] = ()
    """Names of studies to run, even if they are up to date (default: all stale ones)."""
    list: bool = False
    """Only print the stale studies, with the reasons and the required times."""
    hours: float | None = None
    """Stop after this time [h]; results of completed parts are kept."""
    quick: bool = False
    """Run all studies with --quick in out/results_quick, and check that no table lacks metrics."""
    dirty: bool = False
    """Run despite uncommitted changes; the results record that there were some."""
    trainings: bool = False
    """Include the training of policies, which takes hours and is needed only for a release."""


def main(arguments: Arguments) -> int:
    """Run the requested studies; return the exit status."""
    console, names = Console(), list_commands(arguments.only or tuple(STUDIES))
    if not arguments.trainings:
        names = tuple(name for name in names if not COMMANDS[name].is_release)
    if arguments.quick:
        return max(try_out(console, name) for name in names if COMMANDS[name].quick)
    stale = {name: explain_stale(name) for name in names}
    if arguments.list:
        console.print(make_plan(stale))
        return 0
    if "+changes" in str(provenance()["git"]) and not arguments.dirty:
        console.print("There are uncommitted changes, and results need a clean commit. Commit "
                      "them, or use --dirty.", style="red")  # fmt: skip
        return 2
    todo = [name for name in names if stale[name] or arguments.only]
    until_s = float("inf") if arguments.hours is None else time.monotonic() + 3600 * arguments.hours
    for k, name in enumerate(todo):
        mine = COMMANDS[name].minutes
        all_left = sum(COMMANDS[each].minutes for each in todo[k:])
        console.print(f"{k + 1} of {len(todo)}: {name}, about {format_time(mine)}; "
                      f"{format_time(all_left)} for all that remain", style="bold")  # fmt: skip
        is_begun = time.monotonic() + (0 if COMMANDS[name].is_resumable else 60 * mine) < until_s
        if is_begun and run(name, until_s):
            publish(name)
        else:
            console.print(f"{name} is not finished; the same command continues it.")
    generate.main()
    return 0


def make_plan(stale: Mapping[str, str]) -> Table:
    """Return a table of stale commands: time budget, last duration, and reason."""
    heads = ("study", "command", "makes", "budget", "took", "is")
    table = Table(*heads, title="python -m benchmarks.results")
    study_of = {name: label for label, study in STUDIES.items() for name in study.commands}
    for name, why in stale.items():
        command, took = COMMANDS[name], read_results(name).get("minutes")
        made = ", ".join((*command.tables, *command.pictures))
        table.add_row(study_of[name], name, made, format_time(command.minutes),
                      "" if took is None else format_time(took),
                      f"stale: {why}" if why else "fresh")  # fmt: skip
    minutes = sum(COMMANDS[name].minutes for name, why in stale.items() if why)
    all_minutes = sum(COMMANDS[name].minutes for name in stale)
    table.caption = f"{format_time(minutes)} for stale studies, {format_time(all_minutes)} for all"
    return table


def format_time(minutes: float) -> str:
    """Format a duration in minutes, or in hours if it is long."""
    return f"{minutes:.0f} min" if minutes < 100 else f"{minutes / 60:.1f} h"


def read_results(name: str) -> dict[str, Any]:
    """Read the published results of a command; without a file, return an empty dict."""
    path = WHOLE / f"{name}.json"
    return json.loads(path.read_text()) if path.exists() else {}


def explain_stale(name: str) -> str:
    """Describe the changes since the results of a command were computed, or return ""."""
    command, made = COMMANDS[name], read_results(name)
    before = made.get("depends")
    if before is None:
        return "no record of its versions"
    reasons = [
        f"{subsystem} {before.get(subsystem, 'not recorded')} -> {version}"
        for subsystem, version in select_versions(command.depends).items()
        if before.get(subsystem) != version
    ]
    if made.get("command") != command.command:
        reasons.append("another command")
    else:
        reasons += list_changes(made.get("config", {}), read_settings(name))
    if zeros := list_unbounded_zeros(made.get("metrics", {})):
        reasons.append(f"zero without a bound: {zeros[0]} and {len(zeros) - 1} more")
    if spoiled := records.read(name).spoiled:
        first, words = next(iter(spoiled.items()))
        rest = f" (and {len(spoiled) - 1} more)" if len(spoiled) > 1 else ""
        reasons.append(f"replayed, part {first}{rest} differs: {words}")
    return ", ".join(reasons)


COUNTED_IN = ("share", "1/min", "1/h", "per 1000", "per 1000 steps", "per 100 sequences",
              "per 1000 episodes of 10 s")  # fmt: skip
"""Units of rates and shares."""


def list_unbounded_zeros(metrics: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return the names of rates and shares of zero with an interval of no width.

    If nothing was observed, such a rate still has an upper bound. Paired differences of zero are
    left out, as both rows can be the same.

    Args:
        metrics: metrics by name, as results.json contains them.
    """
    return [
        name
        for name, metric in metrics.items()
        if metric["value"] == metric["low"] == metric["high"] == 0
        and metric["n"] > 1
        and metric["unit"] in COUNTED_IN
        and not name.startswith(("difference.", "worth."))
    ]


def read_settings(name: str) -> dict[str, Any]:
    """Return the settings of a command as in results.json, or an empty dict if it has none."""
    source = COMMANDS[name].made
    if source is None:
        return {}
    return json.loads(json.dumps(describe_experiment(source.make(OUT / name))))


def list_changes(recorded: Mapping[str, Any], current: Mapping[str, Any]) -> Iterator[str]:
    """Yield the settings that have changed, e.g. "n_seeds 10 -> 9".

    Settings that exist in only one of the two are ignored: the default of a new setting is the
    former behaviour, and a renamed setting keeps its value.
    """
    for name in recorded:
        if name not in current or recorded[name] == current[name]:
            continue
        if isinstance(recorded[name], Mapping) and isinstance(current[name], Mapping):
            yield from list_changes(recorded[name], current[name])
        else:
            yield f"{name} {_shorten(recorded[name])} -> {_shorten(current[name])}"


def _shorten(value: Any) -> str:
    """Format a value as a text of limited length."""
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 24 else f"{text[:20]} ..."


def describe_source(name: str) -> dict[str, Any]:
    """Return the command and the versions that must apply to the cached parts of a study."""
    command = COMMANDS[name]
    return {
        "command": command.command,
        "depends": select_versions(command.depends),
        "spoiled": records.read(name).spoiled,
    }


def run(name: str, until_s: float) -> bool:
    """Run a command until it ends or the time is up; return whether it has ended.

    Raises:
        HRCError: the command failed.
    """
    command, out = COMMANDS[name], OUT / name
    mark, source = out / MARK, describe_source(name)
    kept = json.loads(mark.read_text()) if mark.exists() else {}
    if source["spoiled"] and kept.get("spoiled") != source["spoiled"]:
        shutil.rmtree(out, ignore_errors=True)  # cached parts have valid keys, but wrong values
    if {key: kept.get(key) for key in source} != source or not command.is_resumable:
        kept = {**source, "minutes": 0.0}
    kept["began_s"] = time.time()
    out.mkdir(parents=True, exist_ok=True)
    mark.write_text(json.dumps(kept))
    started_s = time.monotonic()
    status = call(command, out, "", until_s)
    kept["minutes"] += (time.monotonic() - started_s) / 60
    mark.write_text(json.dumps(kept))
    if status:
        raise HRCError(f"{command.command} ended with status {status}; finished parts are kept.")
    return status == 0


def call(command: Command, out: Path, more: str, until_s: float = float("inf")) -> int | None:
    """Execute a command; return its exit status, or None if it was stopped for lack of time."""
    words = [sys.executable, *command.command.split()[1:], *more.split()]
    words += ["--out", str(out)] if command.tables else []
    release_folder(out)  # settings may have changed; the keys of parts differ then
    process = subprocess.Popen(words, cwd=ROOT, start_new_session=True)
    left_s = until_s - time.monotonic()
    try:
        return process.wait(left_s if left_s < float("inf") else None)
    except (subprocess.TimeoutExpired, KeyboardInterrupt) as stopped:
        os.killpg(process.pid, signal.SIGINT)
        time.sleep(STOPPING_S)  # an interrupted write leaves no partial file
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        if isinstance(stopped, KeyboardInterrupt):
            raise
        return None


def publish(name: str) -> None:
    """Copy the numbers and pictures of a completed command into the documentation."""
    command, out = COMMANDS[name], OUT / name
    content = json.loads((out / "results.json").read_text()) if command.tables else provenance()
    mark = json.loads((out / MARK).read_text())
    content |= {key: mark[key] for key in ("command", "depends", "minutes")}
    content.get("config", {}).pop("out", None)  # of this machine
    before = read_results(name)
    if command.is_resumable and before.get("config") == content.get("config"):
        # Some parts may have been computed by earlier runs.
        content["minutes"] = max(content["minutes"], before.get("minutes", 0.0))
    content["machine"].pop("system", None)
    content["seeds"] = _shorten_seeds(content.get("seeds", []))
    content["date"] = datetime.date.today().isoformat()
    for metric in content.get("metrics", {}).values():
        metric |= {end: float(f"{metric[end]:.6g}") for end in ("value", "low", "high")}
    WHOLE.mkdir(exist_ok=True)
    kept = WHOLE / f"{name}.json"
    kept.write_text(format_results(content))
    records.write(name, mark["depends"], out / "parts", mark["began_s"])
    for picture, figure in command.pictures.items():
        drawn = out / "figures" / figure
        if picture.endswith(".png"):
            shutil.copy(drawn, PICTURES / picture)
        else:
            quality = [cv2.IMWRITE_JPEG_QUALITY, 88]
            cv2.imwrite(str(PICTURES / picture), cv2.imread(str(drawn)), quality)


def _shorten_seeds(seeds: Sequence[int]) -> Sequence[int] | dict[str, int]:
    """Return consecutive seeds as their first and last one; other seeds stay a list."""
    is_range = len(seeds) > 1 and list(seeds) == [*range(seeds[0], seeds[-1] + 1)]
    return {"first": seeds[0], "last": seeds[-1]} if is_range else seeds


def format_results(content: Mapping[str, Any]) -> str:
    """Format results for a file in `docs/results/whole/`, with one line per metric."""
    parts = []
    for name, value in content.items():
        text = json.dumps(value, ensure_ascii=False)
        if isinstance(value, list):
            text = "[\n  " + ",\n  ".join(json.dumps(item) for item in value) + "\n ]"
        elif isinstance(value, dict):
            pairs = (
                f"{json.dumps(k)}: {json.dumps(v, ensure_ascii=False)}" for k, v in value.items()
            )
            text = "{\n  " + ",\n  ".join(pairs) + "\n }"
        parts.append(f" {json.dumps(name)}: {text}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def try_out(console: Console, name: str) -> int:
    """Run a command with --quick; return 0 if it yields all required metrics and pictures."""
    command, out, started_s = COMMANDS[name], QUICK_OUT / name, time.monotonic()
    if status := call(command, out, command.quick):
        console.print(f"{name}: ended with status {status}")
        return status
    made = json.loads((out / "results.json").read_text())["metrics"].keys()
    needed = {metric for table in command.tables for metric in tables.asked(table)}
    figures = command.pictures.values()
    missing = {figure for figure in figures if not (out / "figures" / figure).exists()}
    missing |= needed - made
    took_s = time.monotonic() - started_s
    console.print(f"{name}: {took_s:.0f} s, " + (f"missing {sorted(missing)}" if missing else "ok"))
    return int(bool(missing))


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments, description=__doc__)))
