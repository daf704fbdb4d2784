"""The page of the leaderboard: scores of policies, from the entries of the benchmark."""

from collections.abc import Mapping

from docs.tables import RESULTS
from hrc_env.experiments.leaderboard import (
    CONDITIONS,
    ENTRY_METRICS,
    MAIN,
    SEED,
    VERSION,
    Entry,
    read_entry,
)
from hrc_env.experiments.report import format_metric, format_table
from hrc_env.tasks import BUILT_IN

HEAD = f"""\
# Leaderboard

This page compares policies on the tasks of the package. `python -m hrc_env benchmark --policy
POLICY` plays a policy under the same {len(CONDITIONS)} conditions of each task, on fixed seeds
(version {VERSION}, seeds from {SEED:,}):

- four cameras, beside unaware, hurried or attentive people;
- unaware people, with the truth instead of cameras;
- unaware people, with images that are 200 ms late and carry their time stamps;
- unaware people, with one camera that remains after the first second.

Each condition is played without a shield and with `qp`. Contacts and cost are computed from the
truth.

The tables below show unaware people and four cameras. They are sorted by goals under the shield.
All numbers have 95 % intervals. Those of contacts are exact: they are wide because contacts are
rare. "0.0 in all 64" was 0 in every one of 64 episodes. Entries are shown as they were
submitted, and are not played again. All numbers are in `docs/results/leaderboard/`.

## How to enter

```bash
# a checkpoint of train
python -m hrc_env benchmark --policy runs/mine/policy.zip --ids HRCReach-v0
# the agent that my_module.make(env_info) returns
python -m hrc_env benchmark --policy my_module:make --ids HRCReach-v0 \\
    --enter docs/results/leaderboard/mine.json
```

`--enter FILE` writes an entry, and `python -m docs.generate` adds it to this page. Submit both
files.
"""


def page() -> str:
    """Return docs/reference/leaderboard.md."""
    paths = sorted((RESULTS / "leaderboard").glob("*.json"))
    entries = {path.stem: read_entry(path) for path in paths}
    return "\n".join([HEAD, *(_section(task, entries) for task in BUILT_IN)])


def _section(task: str, entries: Mapping[str, Entry]) -> str:
    """Return the table of a task, sorted by goals under the shield."""
    keys = [f"{task}.{name}" for name in MAIN]
    goals = f"{keys[-1]}.goals_per_minute"
    here = [(name, each.scores) for name, each in entries.items() if goals in each.scores]
    here.sort(key=lambda each: -each[1][goals].value)
    if not here:
        return f"## {task}\n\nThere is no entry yet.\n"
    rows = [
        (name if k == 0 else "", CONDITIONS[MAIN[k]].shield or "none",
         str(scores[f"{key}.goals_per_minute"].n),
         *(format_metric(scores[f"{key}.{metric}"], digits=2 if metric == "success" else 1)
           for metric in ENTRY_METRICS))
        for name, scores in here for k, key in enumerate(keys)
    ]  # fmt: skip
    heads = ("policy", "shield", "episodes", *ENTRY_METRICS.values())
    return f"## {task}\n\n{format_table(heads, rows)}\n"
