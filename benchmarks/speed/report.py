"""The speed bench as people read it: Markdown tables, and a picture of where the time goes."""

from collections.abc import Mapping
from pathlib import Path

from benchmarks.speed.measured import (
    REACHER,
    REST,
    SINGLE,
    TOTAL,
    configurations_of,
    title,
)
from benchmarks.speed.organs import ORGANS
from benchmarks.speed.plot import plot_organs
from hrc_env.core.provenance import provenance
from hrc_env.core.results import Metric

_Metrics = Mapping[str, Metric]


def write_report(out: Path, metrics: _Metrics, load_before: float | None) -> None:
    """Write speed.md and organs.png into `out`; `load_before` is the machine's before it began."""
    (out / "speed.md").write_text(markdown(metrics, load_before))
    plot_organs(out / "organs.png", metrics)


def markdown(metrics: _Metrics, load_before: float | None) -> str:
    """Steps a second, beside Reacher's; the organs; resets."""
    blocks = [
        "# Speed bench",
        _introduction(metrics, load_before),
        "## Environment steps a second",
        _by_level(metrics, "env_steps_per_s", 0),
        "## The same, divided by the single Reacher's",
        _by_level(metrics, "ratio_to_reacher", 3),
        "## Microseconds per environment and step, level `keypoints`",
        _organs(metrics),
        _ABOUT_THE_ORGANS,
        "## Milliseconds of a reset, level `keypoints`",
        _resets(metrics),
    ]
    return "\n\n".join(blocks) + "\n"


def _introduction(metrics: _Metrics, load_before: float | None) -> str:
    made = provenance()
    n_rounds = metrics[f"env_steps_per_s.{REACHER}.{SINGLE}"].n
    rounds = (
        f"Medians of {n_rounds} rounds in which everybody takes turns, smallest and largest in "
        "brackets."
        if n_rounds > 1
        else "A single round: nothing says how far to trust a number."
    )
    busy = "" if load_before is None else f", load average {load_before} before it began"
    return (
        f"Commit {made['git']}, {made['machine']['cores']} cores{busy}. Random actions for whole "
        f"episodes, resets inside, every info read. {rounds} `{SINGLE}` is `gymnasium.make`, the "
        f"others are `gymnasium.make_vec`; `{REACHER}` is Gymnasium's Reacher-v5 in the same "
        "rounds (64 of it: its SyncVectorEnv)."
    )


_ABOUT_THE_ORGANS = (
    "Taken in runs of their own with a stopwatch round each organ's functions, which itself costs "
    "about half a microsecond a call. With two threads an organ's time is divided by two: columns "
    "are time on the wall, and half of the column for one thread would be perfect. Time in which "
    "a thread waits for the other is the waiting organ's, or the rest's. `physics` includes the "
    "controller, `distances` the robot's own bodies, `reward` the task, `reset` all organs' work "
    "in resets, `rest` everything else."
)


def _by_level(metrics: _Metrics, kind: str, digits: int) -> str:
    """One row per configuration, one column per level."""
    names = [name.split(".", 2)[1:] for name in metrics if name.startswith(f"{kind}.")]
    levels = dict.fromkeys(level for level, _ in names)
    lines = []
    for configuration in sorted({configuration for _, configuration in names}, key=_size):
        found = [metrics.get(f"{kind}.{level}.{configuration}") for level in levels]
        cells = ["" if m is None else _cell(m, digits, spread=True) for m in found]
        lines.append([title(configuration), *cells])
    return _table(["", *levels], lines)


def _size(configuration: str) -> tuple[int, str]:
    """By what configurations are sorted."""
    size, _, how = configuration.partition(".")
    return (0, "") if configuration == SINGLE else (int(size), how)


def _organs(metrics: _Metrics) -> str:
    """One row per organ, one column per configuration."""
    configurations = configurations_of(metrics)
    lines = [
        [organ, *(_cell(metrics[f"us_per_env_step.{organ}.{each}"], 1) for each in configurations)]
        for organ in (*ORGANS, REST, TOTAL)
    ]
    return _table(["", *map(title, configurations)], lines)


def _resets(metrics: _Metrics) -> str:
    found = {name: metric for name, metric in metrics.items() if name.startswith("reset_ms.")}
    lines = [
        [name.split(".")[1].replace("_", " "), _cell(metric, 2, spread=True)]
        for name, metric in found.items()
    ]
    return _table(["", "ms"], lines)


def _cell(metric: Metric, digits: int, spread: bool = False) -> str:
    text = f"{metric.value:,.{digits}f}"
    if not spread or metric.n == 1:
        return text
    return text + f" ({metric.low:,.{digits}f}-{metric.high:,.{digits}f})"


def _table(header: list[str], lines: list[list[str]]) -> str:
    rows = [header, ["---", *["---:"] * (len(header) - 1)], *lines]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)
