"""Do two checkouts give the same numbers? python -m benchmarks.unchanged OTHER_CHECKOUT

Each plays the same seeds and actions in a process of its own; every observation term, reward term
and info key is compared. Names that have changed are in `benchmarks/renamed.toml`, old to new; what
the other checkout does not know yet is listed and is no difference.
"""

import json
import os
import subprocess
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro
from rich.console import Console
from rich.table import Table

from benchmarks.trajectory import CASES, differences
from hrc_env.cli.progress import track
from hrc_env.core.errors import ConfigError, HRCError

ROOT = Path(__file__).resolve().parent.parent
RENAMED = Path(__file__).with_name("renamed.toml")
ROUNDING = 1e-6
"""What sums in another order may be apart."""
Trajectory = dict[str, list[Any]]


@dataclass(frozen=True)
class Arguments:
    """Compare this checkout with another."""

    other: tyro.conf.Positional[Path]
    """The other checkout's folder, as of `git worktree add ../before a76908f`."""
    id: str = "HRCReach-v0"
    """Which environment."""
    steps: int = 500
    """Steps of each case."""
    cases: tuple[str, ...] = tuple(CASES)
    """Which of them."""


def main(arguments: Arguments) -> int:
    """Compare and print; 1 if anything differs by more than rounding."""
    if not (arguments.other / "hrc_env").is_dir():
        raise ConfigError(f"{arguments.other} is no checkout: it has no folder hrc_env.")
    console, names = Console(), tomllib.loads(RENAMED.read_text())
    table = Table("case", "keys", "largest difference", "where", "beyond rounding", "new keys")
    n_wrong = 0
    for case in track(arguments.cases, "comparing", console=console):
        words = (arguments.id, case, str(arguments.steps))
        with ThreadPoolExecutor(2) as threads:
            old, new = threads.map(played, (arguments.other, ROOT), (words, words))
        old = translated(old, names)
        apart = differences(old, {name: matched(new, old, name) for name in new if name in old})
        where = max(apart, key=lambda name: apart[name])
        wrong = [name for name, size in apart.items() if not size <= ROUNDING]
        added = [name for name in new if name not in old]
        cells = (case, len(apart), f"{apart[where]:.2g}", where, ", ".join(wrong) or "-")
        table.add_row(*map(str, cells), ", ".join(added) or "-")
        n_wrong += len(wrong)
    console.print(table)
    return int(n_wrong > 0)


def played(checkout: Path, words: tuple[str, ...]) -> Trajectory:
    """What `trajectory.py` says to those words, played by a checkout's own package."""
    done = subprocess.run(
        [sys.executable, ROOT / "benchmarks" / "trajectory.py", *words],
        cwd=checkout, env={**os.environ, "PYTHONPATH": str(checkout.resolve())},
        stdout=subprocess.PIPE, text=True, check=True,
    )  # fmt: skip
    said = json.loads(done.stdout.splitlines()[-1])
    if not Path(said["package"]).is_relative_to(checkout.resolve()):
        raise HRCError(f"{checkout} was to be played, {said['package']} was.")
    return said["trajectory"]


def translated(old: Trajectory, names: dict[str, dict[str, Any]]) -> Trajectory:
    """By the names and the words of today; without what there is no longer, on purpose."""
    renamed, gone, words = names["renamed"], names["gone"], names["words"]
    return {
        renamed.get(name, name): [_reworded(value, words) for value in values]
        for name, values in old.items()
        if name not in gone
    }


def matched(new: Trajectory, old: Trajectory, name: str) -> list[Any]:
    """A key's values at the moments at which the other checkout had it, too."""
    return [
        None if before is None else now for now, before in zip(new[name], old[name], strict=True)
    ]


def _reworded(value: Any, words: dict[str, str]) -> Any:
    if isinstance(value, list):
        return [_reworded(each, words) for each in value]
    return words.get(value, value) if isinstance(value, str) else value


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Arguments, description=__doc__)))
