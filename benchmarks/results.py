"""Every number and picture of the documentation again: python -m benchmarks.results (make results)

Runs the studies whose numbers are older than the code and data that they depend on, one after the
other; puts their numbers into `docs/results/`, their pictures into `docs/pictures/`, and both into
the pages. What is finished of a study stays in `out/results/`, so that a run that was stopped goes
on. Numbers come from a clean commit; changes in `docs/` do not count.

    python -m benchmarks.results --list            # what is stale, why, and how long it would take
    python -m benchmarks.results --only site lab
    python -m benchmarks.results --hours 2.5       # what fits into that, the rest another time
    python -m benchmarks.results --quick           # whether every table finds its numbers
"""

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import tyro
from rich.console import Console
from rich.table import Table

from docs import generate, tables
from hrc_env.core.errors import HRCError, check_names
from hrc_env.core.results import provenance
from hrc_env.experiments.study.fingerprint import code_of, data_files, sources_of

ROOT = Path(__file__).resolve().parent.parent
OUT, QUICK_OUT = ROOT / "out" / "results", ROOT / "out" / "results_quick"
WHOLE, PICTURES = tables.RESULTS / "whole", ROOT / "docs" / "pictures"
WITHOUT = ("hrc_env.cli",)
"""Command lines change no number."""
EXPERIMENT, BENCH = "python -m hrc_env experiment ", "python -m hrc_env bench "


@dataclass(frozen=True, slots=True)
class Study:
    """A command, and what of the documentation it makes."""

    command: str
    modules: tuple[str, ...]
    """Numbers depend on these, on what they import of this repository, and on all data."""
    minutes: float
    """How long it takes on two cores, about."""
    tables: tuple[str, ...] = ()
    """Files in `docs/results/`."""
    pictures: Mapping[str, str] = field(default_factory=dict)
    """Of `docs/pictures/`, and from which file of the command's folder `figures`."""
    quick: str = "--quick"
    """What makes it short; "": nothing does."""
    goes_on: bool = True
    """Whether it keeps what is finished when it is stopped."""
    is_keyed: bool = True
    """Whether what it keeps says by what code it was made; otherwise other code begins anew."""


STUDIES: dict[str, Study] = {
    "occlusion": Study(
        "python -m benchmarks.occlusion", ("benchmarks.occlusion",), 0.2, ("occlusion",),
        goes_on=False,
    ),
    "forecast": Study(
        "python -m benchmarks.prediction", ("benchmarks.prediction",), 1, ("forecast",),
        goes_on=False,
    ),
    "work": Study(
        "python -m benchmarks.work_mix", ("benchmarks.work_mix", "agents.scripted"), 10,
        ("people", "activities"), quick="--episodes 4", goes_on=False,
    ),
    "speed": Study(
        BENCH + "speed", ("benchmarks.speed.bench",), 5, ("speed", "speed_organs"),
        {"speed_organs.png": "organs.png"}, goes_on=False,
    ),
    "footage": Study(
        BENCH + "tracking --real", ("benchmarks.recorded.bench",), 2, ("footage",),
        quick="", goes_on=False,
    ),
    "learning": Study(
        "python -m benchmarks.learning --timesteps 450000",
        ("benchmarks.learning", "agents.training", "agents.ppo"), 6, ("learning",),
        {"learning.png": "curves.png"}, quick="--timesteps 8192", is_keyed=False,
    ),
    "site": Study(
        EXPERIMENT + "site", ("hrc_env.experiments.site.experiment",), 15, ("site",),
        {"site_figure_3.jpg": "figure_3.png", "site_figure_4.png": "figure_4_particle.png"},
    ),
    "lab": Study(
        EXPERIMENT + "lab --folded heavy", ("hrc_env.experiments.lab.experiment",), 30, ("lab",),
        {"lab_figure_6.jpg": "figure_6.png"},
    ),
    "tracking": Study(
        BENCH + "tracking", ("benchmarks.tracking.bench",), 60, ("tracking", "tracking_cost"),
    ),
    "perception": Study(
        BENCH + "perception", ("benchmarks.perception.bench",), 60,
        ("pixels_accuracy", "faults", "miscalibration", "appearance", "emulator", "speed_pixels"),
        {"emulator.png": "emulator.png"},
    ),
    "baselines": Study(
        "python -m benchmarks.baselines", ("benchmarks.baselines", "agents.training", "agents.ppo"),
        60, ("baselines",), is_keyed=False,
    ),
    "ablations": Study(
        EXPERIMENT + "ablations", ("hrc_env.experiments.ablations.experiment",), 60, ("ablations",),
        {f"ablations_{name}.png": f"{name}.png" for name in ("cameras", "occlusion", "filter")},
    ),
    "impact": Study(
        EXPERIMENT + "impact", ("hrc_env.experiments.impact.experiment",), 90,
        ("impact", "lateness"), {"impact_tradeoff.png": "tradeoff.png"},
    ),
    "pictures": Study(
        "python -m docs.make_pictures", ("hrc_env.env", "benchmarks.gallery.still"), 2,
        quick="", goes_on=False,
    ),
}  # fmt: skip
"""By name, the shortest first."""


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
    changed = {name: why_stale(name, STUDIES[name]) for name in names}
    if arguments.list:
        console.print(plan(changed))
        return 0
    if arguments.quick:
        return max(try_out(console, name) for name in names if STUDIES[name].quick)
    if "+changes" in str(provenance()["git"]) and not arguments.dirty:
        console.print("[bold red]There are changes that are not committed[/]: results come from "
                      "a clean commit. Commit them, or give --dirty.")  # fmt: skip
        return 2
    todo = [name for name in names if changed[name] or arguments.only]
    until_s = None if arguments.hours is None else time.monotonic() + 3600 * arguments.hours
    for k, name in enumerate(todo):
        rest_min = sum(expected_min(each) for each in todo[k:])
        console.print(f"[bold]{k + 1} of {len(todo)}: {name}[/], about {spoken(expected_min(name))}"
                      f"; {spoken(rest_min)} for all that is left")  # fmt: skip
        if not (fits(name, until_s) and run(name, until_s)):
            console.print(f"{name} is not finished; the same command goes on there.")
            continue
        publish(name)
    generate.main([])
    return 0


def plan(changed: Mapping[str, str]) -> Table:
    """Every study, how long it takes, and why it is stale."""
    table = Table("study", "makes", "takes", "is", title="python -m benchmarks.results")
    for name, why in changed.items():
        made = ", ".join((*STUDIES[name].tables, *STUDIES[name].pictures))
        table.add_row(name, made, spoken(expected_min(name)), f"stale: {why}" if why else "fresh")
    stale = sum(expected_min(name) for name, why in changed.items() if why)
    table.caption = f"{spoken(stale)} for what is stale"
    return table


def spoken(minutes: float) -> str:
    """As people say it."""
    return f"{minutes:.0f} min" if minutes < 100 else f"{minutes / 60:.1f} h"


def why_stale(name: str, study: Study) -> str:
    """What has changed since a study's numbers were made; "" if nothing."""
    before, now = whole(name).get("depends"), depends(study)
    if before is None:
        return "no record of what it was made by"
    return ", ".join(sorted(k for k in before | now if before.get(k) != now.get(k)))


def depends(study: Study) -> dict[str, str]:
    """Digests of the command, of code without comments, and of data, folder by folder."""
    groups = {"command": hashlib.sha256(study.command.encode())}
    files = [*sources_of(*study.modules, without=WITHOUT), *data_files(), ROOT / "constraints.txt"]
    for path in sorted(set(files)):
        inside = path.relative_to(ROOT)
        if inside.parts[:3] == ("hrc_env", "core", "kernels") and path.suffix == ".json":
            continue  # signatures of kernels, which follow from the code
        group = groups.setdefault("/".join(inside.parts[:2]), hashlib.sha256())
        is_code = path.suffix == ".py"
        content = code_of(path.read_text()) if is_code else path.read_bytes()
        group.update(inside.as_posix().encode() + content)
    return {name: digest.hexdigest()[:8] for name, digest in groups.items()}


def digest(found: Mapping[str, str]) -> str:
    """All of what a study depends on, in a word."""
    return hashlib.sha256(json.dumps(found, sort_keys=True).encode()).hexdigest()[:12]


def whole(name: str) -> dict[str, Any]:
    """All that a study found when it was run last; empty if that is not known."""
    path = WHOLE / f"{name}.json"
    return json.loads(path.read_text()) if path.exists() else {}


def expected_min(name: str) -> float:
    """How long a study takes: as long as last time [min]."""
    return float(whole(name).get("minutes", STUDIES[name].minutes))


def fits(name: str, until_s: float | None) -> bool:
    """Whether it is worth beginning: what keeps nothing must be finished in time."""
    left_s = float("inf") if until_s is None else until_s - time.monotonic()
    return left_s > (0 if STUDIES[name].goes_on else 60 * expected_min(name))


def run(name: str, until_s: float | None) -> bool:
    """Run a study until it is finished or the time is up; whether it is.

    Raises:
        HRCError: the command failed.
    """
    study, out = STUDIES[name], OUT / name
    mark, now = out / "depends.json", depends(study)
    before = json.loads(mark.read_text()) if mark.exists() else {}
    if before.get("depends") != now:
        if not study.is_keyed:
            shutil.rmtree(out, ignore_errors=True)
        before = {"depends": now, "minutes": 0.0}
    out.mkdir(parents=True, exist_ok=True)
    mark.write_text(json.dumps(before))
    started_s = time.monotonic()
    status = call(study, out, "", until_s)
    before["minutes"] += (time.monotonic() - started_s) / 60
    mark.write_text(json.dumps(before))
    if status not in (0, None):
        raise HRCError(f"{study.command} ended with status {status}; what it finished is kept.")
    return status == 0


def call(study: Study, out: Path, more: str, until_s: float | None = None) -> int | None:
    """Call a study's command: its status, None if it was stopped as the time was up."""
    words = [sys.executable, *study.command.split()[1:], *more.split()]
    words += ["--out", str(out)] if study.tables else []
    process = subprocess.Popen(words, cwd=ROOT, start_new_session=True)
    left_s = None if until_s is None else until_s - time.monotonic()
    try:
        return process.wait(left_s)
    except (subprocess.TimeoutExpired, KeyboardInterrupt) as stopped:
        os.killpg(process.pid, signal.SIGINT)
        process.wait()
        if isinstance(stopped, KeyboardInterrupt):
            raise
        return None


def publish(name: str) -> None:
    """A finished study's numbers and pictures into the documentation."""
    study, out = STUDIES[name], OUT / name
    content = json.loads((out / "results.json").read_text()) if study.tables else provenance()
    content |= json.loads((out / "depends.json").read_text())
    WHOLE.mkdir(exist_ok=True)
    (WHOLE / f"{name}.json").write_text(tables.written(content))
    for each in study.tables:
        told = {"minutes": round(content["minutes"], 1), "depends": digest(content["depends"])}
        table = tables.renewed(tables.read(each), out / "results.json", **told)
        (tables.RESULTS / f"{each}.json").write_text(tables.written(table))
    for picture, figure in study.pictures.items():
        copy_picture(out / "figures" / figure, PICTURES / picture)


def copy_picture(figure: Path, picture: Path) -> None:
    """A PNG into the documentation, as a JPEG if it is called one."""
    if picture.suffix == ".png":
        shutil.copy(figure, picture)
    else:
        cv2.imwrite(str(picture), cv2.imread(str(figure)), [cv2.IMWRITE_JPEG_QUALITY, 88])


def try_out(console: Console, name: str) -> int:
    """A study's short form: 0 if it makes all metrics and pictures that are asked for."""
    study, out, started_s = STUDIES[name], QUICK_OUT / name, time.monotonic()
    if status := call(study, out, study.quick):
        console.print(f"{name}: ended with status {status}")
        return 1
    made = json.loads((out / "results.json").read_text())["metrics"]
    missing = {each for table in study.tables for each in tables.asked(tables.read(table))} - {
        *made
    }
    missing |= {each for each in study.pictures.values() if not (out / "figures" / each).exists()}
    took_s = time.monotonic() - started_s
    console.print(f"{name}: {took_s:.0f} s; " + (f"missing {sorted(missing)}" if missing else "ok"))
    return int(bool(missing))


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments, description=__doc__)))
