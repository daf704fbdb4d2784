"""The leaderboard's page: what policies were worth, from the entries of the benchmark."""

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

`python -m hrc_env benchmark --policy POLICY` judges a policy under {len(CONDITIONS)} conditions a
task, the same for everybody (version {VERSION}, seeds from {SEED:,} on): beside unaware, hurried
and attentive people with four cameras; beside unaware people with the truth, with images that are
200 ms late and say so, and with one camera that is left after a second; each without a shield and
with `qp`. Contacts and cost are counted on the truth.

Here: unaware people, four cameras, without a shield and with it, sorted by goals with it. Numbers
have 95 % intervals, of contacts exact ones, which show how little so few episodes tell of rare
contacts; a cost of 0.0 without one was 0 in every episode. Entries stand as they were sent and are
not played again. All numbers are in `docs/results/leaderboard/`.

## How to enter

```bash
# a checkpoint of train
python -m hrc_env benchmark --policy runs/mine/policy.zip --ids HRCReach-v0
# what my_module.make(env_info) returns
python -m hrc_env benchmark --policy my_module:make --ids HRCReach-v0 \\
    --enter docs/results/leaderboard/mine.json
```

`--enter FILE` writes an entry; `python -m docs.generate` puts it into this page: send both.
"""


def page() -> str:
    """The page."""
    paths = sorted((RESULTS / "leaderboard").glob("*.json"))
    everybody = {path.stem: read_entry(path) for path in paths}
    return "\n".join([HEAD, *(_section(task, everybody) for task in BUILT_IN)])


def _section(task: str, everybody: Mapping[str, Entry]) -> str:
    """A task's table, who reaches most under the shield first."""
    keys = [f"{task}.{name}" for name in MAIN]
    goals = f"{keys[-1]}.goals_per_minute"
    here = [(name, each.scores) for name, each in everybody.items() if goals in each.scores]
    here.sort(key=lambda each: -each[1][goals].value)
    if not here:
        return f"## {task}\n\nNobody has entered yet.\n"
    rows = [
        (name if k == 0 else "", CONDITIONS[MAIN[k]].shield or "none",
         str(scores[f"{key}.goals_per_minute"].n),
         *(format_metric(scores[f"{key}.{what}"], digits=2 if what == "success" else 1)
           for what in ENTRY_METRICS))
        for name, scores in here for k, key in enumerate(keys)
    ]  # fmt: skip
    heads = ("policy", "shield", "episodes", *ENTRY_METRICS.values())
    return f"## {task}\n\n{format_table(heads, rows)}\n"
