"""The declaration of the impact study: question, columns and tables."""

from collections.abc import Sequence
from dataclasses import replace

from hrc_env.evaluation.sums import INTERVENTIONS
from hrc_env.experiments.columns import Column
from hrc_env.experiments.impact.episodes import SLOW_M, STOP_M
from hrc_env.experiments.impact.metrics import ALL_CONTACTS, COMPARED, NOMINAL_MPS, SEVERE
from hrc_env.experiments.impact.policies import PPO, SLOWED
from hrc_env.experiments.report import Conditions, Table
from hrc_env.experiments.setups import LATE, PerceptionSetup, find_setup
from hrc_env.safety.incidents import MOVING_M_S

TITLE = "Effect of perception on safety"
QUESTION = f"""\
A robot keeps its distance from a worker whom it perceives by cameras only. How much do a better
estimator, one more camera or a shorter delay improve throughput and safety? Only perception is
exchanged; robots, goals and workers, who ignore the robot, are the same in every row, bit for bit.

All events are counted from the truth. *True cost*: steps closer than 0.15 m plus steps in contact,
per episode; *while moving towards*: the part of it in steps in which the robot moves towards the
worker faster than {MOVING_M_S} m/s. The rest comes from workers who walk up to a robot at rest, and
depends on where it rests. *Contacts* per hour of simulated time, where touches within half a second
count as one, are classified by the motion of the robot in the step before: *towards* the worker,
*standing arm pushed*, *moving away*. *Above the force limit*: share of contacts with an estimated
force above the limit of the touched body region (ISO/TS 15066). *Interventions*: times that the
shield becomes active, per hour.
Per 1,000 steps, *near*: closer than {SLOW_M:g} m, the exposure; *approaches*: the robot moves
towards a worker closer than {STOP_M:g} m; *missed stops*: the true separation is below {STOP_M:g} m
and the estimated one is not; *false stops*: the reverse. *Z_d*: 95th percentile of the error of all
joints, including those of lost tracks. *Tax*: Z_d on time + latency x (v_h + v_r),
v_h = {NOMINAL_MPS} m/s, v_r the 95th percentile of the robot's speed towards the worker.

With fewer than four cameras, the others fail after a second; episodes rotate over the choices.
Late images carry their time stamps, from which the tracker predicts; images that are not
time-stamped appear to be current."""
_STEPS = "[per 1,000 steps]"
_ROW = "{0}.{1}."
"""Prefix of the names of metrics, with placeholders for the policy and the setup."""
COLUMNS = (
    Column(_ROW + "goals_per_min", "goals [1/min]"),
    Column(_ROW + "contacts_towards", "contacts towards [1/h]", 1, 60, counted=True),
    Column(_ROW + SEVERE, "contacts above the force limit [%]", 0, 100, counted=True,
           shows="value of n"),
    Column(_ROW + "approaches", f"approaches {_STEPS}"),
    Column(_ROW + "missed_stops", f"missed stops {_STEPS}"),
    Column(_ROW + "false_stops", f"false stops {_STEPS}"),
    Column(_ROW + "z_d_m", "Z_d [m]", 3),
    Column(_ROW + "cost", "true cost [per episode]"),
    Column(_ROW + "cost_towards", "true cost while moving towards [per episode]"),
)  # fmt: skip
"""Columns of the tables in the documentation and in the report."""
MORE = (
    Column(_ROW + "contacts_standing", "standing arm pushed [1/h]", 1, 60, counted=True),
    Column(_ROW + "contacts_fleeing", "moving away [1/h]", 1, 60, counted=True),
    Column(_ROW + ALL_CONTACTS, "contacts [1/h]", 1, 60, counted=True),
    Column(_ROW + INTERVENTIONS, "interventions [1/h]", 0, counted=True),
    Column(_ROW + "called_slowings", f"near {_STEPS}", 0),
    Column(_ROW + "separation_min_m", "least separation [m]", 3),
    Column(_ROW + "tax_m", "tax [m]", 2),
)
"""Further columns of the tables in the report."""
ONE = PerceptionSetup(n_cameras=1).name
NUMBERS = {
    "contacts_with_one": Column(f"difference.{SLOWED}.{ONE}.contacts_towards", digits=0, scale=60),
    "missed_with_one": Column(f"difference.{SLOWED}.{ONE}.missed_stops", digits=0),
    "goals_lost_with_one": Column(f"difference.{PPO}.{ONE}.goals_per_min", scale=-1),
}
NOTE = (
    f"{{n[{SLOWED}.truth.cost]}} episodes per row, with the same workers in every row. Approach: a "
    f"step in which the robot moves faster than {100 * MOVING_M_S:g} cm/s towards a worker closer "
    f"than {STOP_M:.2f} m. Missed stop: a step in which the true separation is below {STOP_M:.2f} "
    "m and the estimated one is not; false stop: the reverse. Contacts towards (exact 95 % "
    "intervals): the robot moved towards the worker in the step before. Above the force limit: "
    "share of all contacts, by the estimated force and the limit of the touched body region. Z_d: "
    "95th percentile of the error of all joints. Fewer than four cameras: the others fail after "
    "the first second. None: the robot has no track of any worker."
)
LATENESS = Table(
    "lateness",
    "Separation lost to latency",
    {
        each.name: (
            f"{1000 * each.latency_s:.0f} ms, {'' if each.is_told else 'not '}time-stamped",
        )
        for each in LATE
    },
    (
        Column("lateness.{}.nominal_m", "nominal tax [m]", 3, plain=True),
        Column("lateness.{}.speeds_here_m", "tax with measured speeds [m]", 3, plain=True),
        Column("lateness.{}.squares_m", "if independent [m]", 3, plain=True),
        Column("lateness.{}.belief_m", "measured in the belief [m]", 3),
        Column("lateness.{}.margin_m", "measured in the loop [m]", 3),
    ),
    ("latency",),
    f"Nominal tax: latency x ({NOMINAL_MPS} m/s + speed of the robot); with measured speeds: with "
    "the speeds of workers and robot in these episodes; if independent: the growth that would "
    "follow if latency and all other errors were independent. Measured in the belief: growth of "
    "the 95th percentile of the estimated minus the true separation. Measured in the loop: margin "
    "that `scripted_slowed` must add to have the share of missed stops that it has without "
    "latency.",
)


def make_results_table(
    policy: str, setups: Sequence[str], conditions: Conditions | None = None
) -> Table:
    """Return the table of a policy, with one row per setup.

    Args:
        policy: label of the policy.
        setups: names of perception setups.
        conditions: conditions of the episodes.
    """
    rows = {(policy, s): (find_setup(s).words,) for s in setups}
    columns = (*COLUMNS, *MORE)
    return Table("results", f"`{policy}`", rows, columns, ("perception",), conditions=conditions)


def make_differences_table(
    policy: str, setups: Sequence[str], marked: bool, conditions: Conditions | None = None
) -> Table:
    """Return the table of a policy's differences from the reference setup.

    Args:
        policy: label of the policy.
        setups: names of perception setups, without the reference.
        marked: whether a difference with an adjusted p-value below .05 is marked.
        conditions: conditions of the episodes.
    """
    columns = [
        replace(each, metric=f"difference.{each.metric}", signed=True, marked=marked)
        for each in (*COLUMNS, *MORE)
        if each.metric.removeprefix(_ROW) in (*COMPARED, "z_d_m")
    ]
    return replace(make_results_table(policy, setups, conditions), columns=columns)


def make_documentation_table(setups: Sequence[str]) -> Table:
    """Return the table for the documentation.

    Setups with rendered images are left out, because they have few episodes.

    Args:
        setups: names of perception setups.
    """
    emulated = [name for name in setups if find_setup(name).level != "pixels"]
    table = make_results_table(SLOWED, emulated)
    return replace(
        table, name="impact", title=f"`{SLOWED}` with each perception",
        columns=COLUMNS, note=NOTE, numbers=NUMBERS,
    )  # fmt: skip
