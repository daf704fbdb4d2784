"""Throughput and safety of a robot with a shield.

    python -m benchmarks.shielded

Goals, contacts by kind and severity, interventions and cost are measured for the scripted reaching
agent, which ignores people, while people ignore the robot. The robot has no shield, or the shield
`qp` with several perception setups.
"""

import sys
from typing import Any

from benchmarks.command import main
from hrc_env.evaluation.sums import ACHIEVED
from hrc_env.experiments.columns import (
    Column,
    list_safety_columns,
    mean,
    per_minute,
    share_of_baseline,
)
from hrc_env.experiments.report import SHIELD_CHOSEN_ON, Conditions
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.experiments.stage import WORKER
from hrc_env.experiments.study import FOUR, Row, Study
from hrc_env.perception.faults.fault import ALL, FaultConfig

BLIND = (FaultConfig("lost", (ALL,), None, 3.0, 6.0),)
"""Fault in which all cameras fail from 3 s to 6 s."""


def _make_row(
    words: str,
    n_episodes: int,
    setup: PerceptionSetup = FOUR,
    shield: Any = "qp",
    baseline: str = "bare",
    **env: Any,
) -> Row:
    """Return a row of the study, with workers of all bodies that ignore the robot."""
    known = {"people": "unaware", "config": {"worker": WORKER}, "shield": shield, **env}
    return Row(words, n_episodes, "scripted", setup, known, baseline, is_shown=words != "")


STUDY = Study(
    name="shielded",
    title="Throughput and safety with the shield",
    about=(__doc__ or "").strip(),
    depends=("env", "tracker", "emulator", "motion", "shield", "agents"),
    first_seed=8_000_000,
    rows={
        "bare": _make_row("four cameras, no shield", 2000, shield=None),
        "four": _make_row("four cameras", 2000),
        "truth": _make_row("`truth`", 500, PerceptionSetup("truth")),
        "one": _make_row("one camera after 1 s", 1000, PerceptionSetup(n_cameras=1)),
        "late": _make_row("200 ms late, time-stamped", 1000, PerceptionSetup(latency_s=0.2)),
        "untold": _make_row(
            "200 ms late, not time-stamped", 1000, PerceptionSetup(latency_s=0.2, is_told=False)
        ),
        "blind": _make_row("all cameras lost from 3 to 6 s", 500, faults=BLIND),
        "blind_stop": _make_row(
            "the same, `unknown_speed_limit_m_s=0`",
            500,
            shield={"kind": "qp", "unknown_speed_limit_m_s": 0.0},
            faults=BLIND,
        ),
        "nobody_bare": _make_row("", 250, shield=None, n_workers=0),
        "nobody": _make_row("no worker", 250, baseline="nobody_bare", n_workers=0),
    },
    heads=("perception",),
    columns=(
        Column("{}.share", "episodes", 0, shows="n"),
        share_of_baseline(ACHIEVED, "throughput [%]", scale=100),
        *list_safety_columns(),
        mean("cost", "cost"),
        per_minute(ACHIEVED, name="goals_per_minute"),
    ),
    note="The agent `scripted` beside workers who ignore it, with `shield=\"qp\"` unless stated "
    "otherwise. Throughput: goals relative to an unshielded robot on the same seeds. Contacts per "
    "hour of simulated time, by the motion of the robot; above the force limit: share of all "
    "contacts, by the estimated force and the limit of the touched body region; interventions: "
    "times that the shield becomes active, per hour; cost per episode of 10 s. 95 % intervals, "
    "exact for contacts.",
    conditions=Conditions(
        people="`unaware`", scene="`lab`", perception="`keypoints`, unless a row names another",
        chosen_on=SHIELD_CHOSEN_ON, worker=WORKER,
    ),
)  # fmt: skip

if __name__ == "__main__":
    sys.exit(main(lambda: STUDY, __doc__))
