"""The study of what perception is worth as it is declared: question, columns and tables."""

from collections.abc import Sequence
from dataclasses import replace

from hrc_env.experiments.columns import Column
from hrc_env.experiments.impact.episodes import SLOW_M, STOP_M
from hrc_env.experiments.impact.metrics import COMPARED, NOMINAL_MPS
from hrc_env.experiments.impact.policies import PPO, SLOWED
from hrc_env.experiments.report import Table
from hrc_env.experiments.setups import LATE, PerceptionSetup, setup_called
from hrc_env.safety.incidents import MOVING_M_S

TITLE = "What perception is worth in safety"
ASKED = f"""\
A robot keeps away from a worker whom it knows through cameras only. What is a better estimator, one
more camera or a shorter delay worth, in goals reached and in safety? Only perception is exchanged;
robots, goals and workers, who take no notice of the robot, are the same in every row, bit for bit.

Counted is the truth. *True cost*: steps nearer than 0.15 m, and steps in touch, an episode; *of it
moving towards*: while the robot moves towards the worker at more than {MOVING_M_S} m/s. The rest
comes of workers who walk up to a robot that stands, and depends on where it stands. *Contacts* a
minute, touches within half a second as one, are named by what the robot did in the step before:
*towards* the worker, *standing arm pushed*, *moving away*. In 1,000 steps, *near*: nearer than
{SLOW_M:g} m, the exposure; *approaches*: the robot moves towards a worker nearer than {STOP_M:g} m;
*missed stops*: the true
separation is below {STOP_M:g} m and the believed one is not; *false stops*: the other way round.
*Z_d*: 95th percentile of the error of all joints, also where the track is lost. *Tax*: Z_d on time
+ latency x (v_h + v_r), v_h = {NOMINAL_MPS} m/s, v_r the 95th percentile of the robot's speed
towards the worker.

Fewer than four cameras: the others fail after a second; which are left goes round. Late images say
when they were taken, and the tracker predicts from there; untold ones claim to be new."""
_STEPS = "[per 1,000 steps]"
_ROW = "{0}.{1}."
"""Of policy and setup, before the names of their metrics."""
COLUMNS = (
    Column(_ROW + "goals_per_min", "goals [1/min]"),
    Column(_ROW + "contacts_towards", "contacts towards [1/min]", 2, counted=True),
    Column(_ROW + "approaches", f"approaches {_STEPS}"),
    Column(_ROW + "missed_stops", f"missed stops {_STEPS}"),
    Column(_ROW + "false_stops", f"false stops {_STEPS}"),
    Column(_ROW + "z_d_m", "Z_d [m]", 3),
    Column(_ROW + "cost", "true cost [per episode]"),
    Column(_ROW + "cost_towards", "of it moving towards [per episode]"),
)
"""Of the documentation, and of the report."""
MORE = (
    Column(_ROW + "contacts_standing", "standing arm pushed [1/min]", 2, counted=True),
    Column(_ROW + "contacts_fleeing", "moving away [1/min]", 2, counted=True),
    Column(_ROW + "called_slowings", f"near {_STEPS}", 0),
    Column(_ROW + "separation_min_m", "least separation [m]", 3),
    Column(_ROW + "tax_m", "tax [m]", 2),
)
"""Of the report besides."""
ONE = PerceptionSetup(n_cameras=1).name
NUMBERS = {
    "contacts_with_one": Column(f"difference.{SLOWED}.{ONE}.contacts_towards", digits=2),
    "missed_with_one": Column(f"difference.{SLOWED}.{ONE}.missed_stops", digits=0),
    "goals_lost_with_one": Column(f"difference.{PPO}.{ONE}.goals_per_min", scale=-1),
}
NOTE = (
    f"{{n[{SLOWED}.truth.cost]}} episodes a row, the same workers in every row. Approach: the "
    f"robot moves at more than {100 * MOVING_M_S:g} cm/s towards a worker nearer than {STOP_M:.2f} "
    "m. Missed stop: the true separation calls for a stop and the believed one does not; false "
    "stop: the other way round. Contacts (exact 95 % intervals) are counted where the robot moved "
    "towards the worker in the step before, cost in steps in which it does. Z_d: 95th percentile "
    "of the error of all joints. Fewer than four cameras: the others fail after the first second. "
    "Untold: images do not say when they were taken. None: nobody is ever followed."
)
LATENESS = Table(
    "lateness",
    "What latency costs in separation",
    {
        each.name: (f"{1000 * each.latency_s:.0f} ms, {'told' if each.is_told else 'not told'}",)
        for each in LATE
    },
    (
        Column("lateness.{}.nominal_m", "nominal tax [m]", 3, plain=True),
        Column("lateness.{}.speeds_here_m", "tax with measured speeds [m]", 3, plain=True),
        Column("lateness.{}.squares_m", "squares added [m]", 3, plain=True),
        Column("lateness.{}.belief_m", "measured in the belief [m]", 3),
        Column("lateness.{}.margin_m", "measured in the loop [m]", 3),
    ),
    ("latency",),
    f"Nominal tax: latency x ({NOMINAL_MPS} m/s + robot speed) on top of Z_d. Measured in the "
    "belief: growth of the 95th percentile of believed less true gap. In the loop: margin that "
    "`scripted_slowed` must add until it misses no greater share of stops than on time.",
)


def results_of(policy: str, setups: Sequence[str]) -> Table:
    """Return the table of a policy, a row for each setup.

    Args:
        policy: its label.
        setups: by name.
    """
    rows = {(policy, s): (setup_called(s).words,) for s in setups}
    return Table("results", f"`{policy}`", rows, (*COLUMNS, *MORE), ("perception",))


def differences_of(policy: str, setups: Sequence[str], marked: bool) -> Table:
    """Return the table of a policy's differences from the reference.

    Args:
        policy: its label.
        setups: by name, without the reference.
        marked: whether differences are marked whose interval leaves out zero.
    """
    columns = [
        replace(each, metric=f"difference.{each.metric}", signed=True, marked=marked)
        for each in (*COLUMNS, *MORE)
        if each.metric.removeprefix(_ROW) in (*COMPARED, "z_d_m")
    ]
    return replace(results_of(policy, setups), columns=columns)


def documented(setups: Sequence[str]) -> Table:
    """Return the table of the documentation, without setups of rendered images, which are few.

    Args:
        setups: by name.
    """
    emulated = [each for each in setups if setup_called(each).level != "pixels"]
    return replace(
        results_of(SLOWED, emulated), name="impact", title=f"`{SLOWED}` with each perception",
        columns=COLUMNS, note=NOTE, numbers=NUMBERS,
    )  # fmt: skip
