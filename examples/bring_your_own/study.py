"""A study of your own: the cost and the benefit of a shield, on the same 40 episodes with and
without it.

python examples/bring_your_own/study.py out/my_study
"""

import sys
from pathlib import Path

from hrc_env import Row, Study, columns, run_experiment

UNAWARE = {"people": "unaware"}
STUDY = Study(
    name="my_study",
    title="Cost and benefit of a shield",
    about="A scripted robot beside people who do not avoid it, with and without a shield.",
    depends=("env", "tracker", "emulator", "motion", "shield", "agents"),
    first_seed=20_000_000,
    rows={
        "bare": Row("no shield", 40, env=UNAWARE, baseline="bare"),
        "qp": Row("`qp`", 40, env={**UNAWARE, "shield": "qp"}, baseline="bare"),
    },
    columns=(
        columns.share_of_baseline("goals_reached", "throughput [%]", scale=100),
        columns.mean("cost", "cost [control steps]"),
        columns.rate("contacts_towards", "contacts towards [in 1,000]", per="1000 episodes"),
    ),
)

if __name__ == "__main__":
    run_experiment(STUDY, Path(sys.argv[1]))
