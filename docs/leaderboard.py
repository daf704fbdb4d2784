"""The page of the leaderboard: scores of policies, from the entries of the benchmark."""

from collections.abc import Mapping

from docs.tables import RESULTS
from hrc_env.agents.separate import ANSWER_S
from hrc_env.experiments.entries import METRICS, RATE_PER_HOUR, Entry, rank, read_entry
from hrc_env.experiments.leaderboard import CONDITIONS, SEED, VERSION
from hrc_env.experiments.report import format_metric, format_table
from hrc_env.tasks import BUILT_IN

HEAD = f"""\
# Leaderboard

This page compares policies on the tasks of the package. `python -m hrc_env benchmark --policy
POLICY` plays a policy under the same {len(CONDITIONS)} conditions of each task (version {VERSION};
the public seeds begin at {SEED:,}):

- four cameras, beside unaware, hurried or attentive people;
- unaware people, with the truth instead of cameras;
- unaware people, with images that are 200 ms late and carry their time stamps;
- unaware people, with one camera that remains after the first second.

Each condition is played without a shield and with `qp`. Contacts and cost are computed from the
truth.

The tables below show unaware people and four cameras. All numbers have 95 % intervals. Those of
contacts are exact, and become narrow only with many episodes. "0.0 in all 64" was 0 in every one of
64 episodes. All numbers are in `docs/results/leaderboard/`.

## Order

A row **qualifies** if its entry is judged, and if the upper end of the interval of contacts towards
the worker is at most {RATE_PER_HOUR:g} per hour. Qualified rows come first, sorted by goals per
minute. All others follow, sorted by that upper end. Few episodes do not qualify, even without a
contact: the upper end is 20.8 per hour after 64 episodes of 10 s, and 1.3 after 1,000.

## Judged entries

- *judged*: played by the maintainers on seeds that were unknown when the policy was submitted. They
  follow from the SHA-256 digest of the policy's files and from a salt that was drawn afterwards.
- *public seeds*: as submitted. The seeds are known, and a policy may have been chosen for them.
- *no digest*: as submitted, by a former version of the package. It cannot be replayed, and the
  environments have changed since.

The policy acts in a process of its own, which receives observations, and what an agent knows in
advance (`EnvInfo`). Its actions are checked; nothing else that it sends is used. On Linux (5.13 or
later, Landlock), which judging requires, the process reads Python's libraries, this package and
copies of the policy's files, writes to a temporary folder, and has no access to the memory of other
processes or, from 6.7 on, to TCP connections. It computes on the CPU.

Not prevented: a policy can use up time ({ANSWER_S:g} s per answer), memory and disk space, leave
processes behind, see which files exist, change their permissions and times, and use UDP and named
sockets. If the judging process belongs to root, so does the policy's: judge as an ordinary user.
Maintainers could draw several salts and keep the best; an entry contains its salt, but not the
number of draws.

`python -m hrc_env evaluate --verify docs/results/leaderboard/NAME.json` replays an entry with a
digest. Every number must be equal; other processors and versions of libraries may round
differently.

## How to enter

```bash
# a checkpoint of train
python -m hrc_env benchmark --policy runs/mine/policy.zip --ids HRCReach-v0
# the agent that my_module.make(env_info) returns
python -m hrc_env benchmark --policy my_module:make --ids HRCReach-v0 \\
    --enter docs/results/leaderboard/mine.json
# by the maintainers, with the submitted files beside the entry
python -m hrc_env judge docs/results/leaderboard/mine.json
```

`--enter FILE` writes an entry with the digest of the policy's files: the checkpoint; the module;
or, if the module is part of a package, the whole package. The process sees these files only: put
several modules or weights into one package (FOLDER with an `__init__.py`, `--policy FOLDER:make`).
Submit the entry and these files. `python -m docs.generate` adds the entry to this page; one in
NAME.ID.json replaces that in NAME.json for the task ID.
"""


def page() -> str:
    """Return docs/reference/leaderboard.md."""
    paths = sorted((RESULTS / "leaderboard").glob("*.json"), key=lambda each: -each.stem.count("."))
    entries = {path.stem: read_entry(path) for path in paths}
    return "\n".join([HEAD, *(_section(task, entries) for task in BUILT_IN)])


def _section(task: str, entries: Mapping[str, Entry]) -> str:
    """Return the table of a task; the most specific file of an entry's name counts."""
    here: dict[str, Entry] = {}
    for stem, entry in entries.items():
        if task in entry.ids:
            here.setdefault(stem.partition(".")[0], entry)
    places = rank(here, task)
    if not places:
        return f"## {task}\n\nThere is no entry yet.\n"
    rows = [
        (place.name, place.condition.shield or "none", "yes" if place.is_qualified else "no",
         place.entry.kind, f"{place.metrics['goals_per_minute'].n:,}",
         *(format_metric(place.metrics[metric], digits=2 if metric == "success" else 1)
           for metric in METRICS))
        for place in places
    ]  # fmt: skip
    heads = ("policy", "shield", "qualified", "seeds", "episodes", *METRICS.values())
    return f"## {task}\n\n{format_table(heads, rows)}\n"
