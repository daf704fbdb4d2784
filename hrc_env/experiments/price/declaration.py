"""The declaration of the price study: question, columns and tables."""

from collections.abc import Sequence

from hrc_env.experiments.columns import Column
from hrc_env.experiments.price.halving import Status
from hrc_env.experiments.price.metrics import CHOOSING, CONTRASTS, NO_SETTING, name_level
from hrc_env.experiments.price.settings import list_settings
from hrc_env.experiments.price.setups import PriceSetup, list_setups
from hrc_env.experiments.report import Table

TITLE = "The price of sight"
QUESTION = """\
How much throughput does a perception setup leave if the robot may touch a worker at most {levels}
times an hour while moving towards them? The levels were stated beforehand. For each setup,
{n_settings} settings of the shield are compared: without a shield, and with other margins, limits
near the unknown, and responses to doubtful estimates. {n_kept} of them are kept after {n_choosing}
episodes each and played for {n_proof} episodes on other seeds (`hrc_env.experiments.price.halving`
states the rules). The intervals of contacts are exact. A level is *met* if the upper end of the
interval does not exceed it, and *estimated* if only the estimate does not. Nothing is extrapolated:
if no setting is below a level, there is no number.

Workers ignore {robot}. A contact is named by the robot's motion in the step before, and touches
within half a second of each other are one. Detections are emulated. Throughput is relative to an
unshielded robot with true joints on the same seeds, so that with few cameras it also contains what
perception costs without a shield. The settings are those that were tried: others may be better."""
STATUS_WORDS = {
    Status.SHOWN: "met", Status.ESTIMATED: "estimated", Status.MISSED: "not met",
}  # fmt: skip
"""Words in tables for whether a level is met."""


def _list_columns(prefix: str) -> tuple[Column, ...]:
    """Return the columns of contacts of the rows with a prefix of their metrics."""
    return (
        Column(f"{prefix}towards", "contacts towards [1/h]", 2, counted=True),
        Column(f"{prefix}contacts", "contacts of all kinds [1/h]", 1, counted=True),
        Column(f"{prefix}severe", "contacts above the force limit [1/h]", 2, counted=True),
    )


def _list_proof_columns(prefix: str) -> tuple[Column, ...]:
    """Return the columns of rows on the proof seeds."""
    return (
        Column(f"{prefix}share", "throughput [% of unshielded]", 1, 100),
        Column(f"{prefix}goals_per_min", "goals [1/min]"),
        *_list_columns(prefix),
        Column(
            f"{prefix}above_force_limit", "of all contacts [%]", 0, 100, counted=True,
            shows="value of n",
        ),
    )  # fmt: skip


MORE = (
    Column("{0}.{1}.standing", "standing [1/h]", 2, counted=True),
    Column("{0}.{1}.away", "fleeing [1/h]", 2, counted=True),
    Column("{0}.{1}.interventions", "interventions [1/h]", 0, counted=True),
    Column("{0}.{1}.cost", "cost"),
)
"""Further columns of the table of all kept settings in the report."""


def make_best_table(setups: Sequence[PriceSetup], levels_per_hour: Sequence[float]) -> Table:
    """Return the table of the best setting of each perception setup at each level.

    Args:
        setups: perception setups in the order of the rows.
        levels_per_hour: levels of the rate of contacts [1/h].
    """
    rows: dict[tuple[str, ...], tuple[str, ...]] = {}
    for level_per_hour in levels_per_hour:
        for setup in setups:
            words = {name: each.words for name, each in list_settings(setup.family).items()}
            key, cells = (name_level(level_per_hour), setup.name), (f"{level_per_hour:g}",)
            for setting, said in words.items():
                for status in (Status.SHOWN, Status.ESTIMATED):
                    row = (*cells, setup.words, said, STATUS_WORDS[status])
                    rows[*key, setting, status.value] = row
            missed = (*cells, setup.words, "-", STATUS_WORDS[Status.MISSED])
            rows[*key, NO_SETTING, Status.MISSED.value] = missed
    return Table(
        "price",
        "Throughput at stated rates of contacts",
        rows,
        _list_proof_columns("{0}.{1}.{2}.{3}."),
        ("at most [1/h]", "perception", "shield", "level"),
        "The best of twelve settings of the `qp` shield for each perception setup, among them the "
        "unshielded robot. Level: met if the upper end of the exact interval of contacts towards "
        "does not exceed it, estimated if only the estimate does not. Throughput: goals relative "
        "to an unshielded robot with true joints on the same seeds. The contacts above the force "
        "limit of the touched region are given per hour and as a share of all contacts. True "
        "capsules: the shield receives the workers' true surfaces, which no sensor provides. True "
        "joints: the body around the joints is estimated.",
    )


def make_frontier_table(setups: Sequence[PriceSetup]) -> Table:
    """Return the table of all settings that were played on the proof seeds.

    Args:
        setups: perception setups in the order of the rows.
    """
    rows = {
        (setup.name, name): (setup.words, each.words)
        for setup in setups
        for name, each in list_settings(setup.family).items()
    }
    return Table(
        "price_frontier", "Settings on the proof seeds", rows,
        (*_list_proof_columns("{0}.{1}."), *MORE), ("perception", "shield"),
    )  # fmt: skip


def make_choosing_table(setups: Sequence[PriceSetup]) -> Table:
    """Return the table of all settings on the choosing seeds.

    Args:
        setups: perception setups in the order of the rows.
    """
    rows = {
        (setup.name, name): (setup.words, each.words)
        for setup in setups
        for name, each in list_settings(setup.family).items()
    }
    prefix = CHOOSING + "{0}.{1}."
    goals = Column(f"{prefix}goals_per_min", "goals [1/min]")
    columns = (goals, *_list_columns(prefix))
    return Table(
        "price_choosing", "Settings on the choosing seeds", rows, columns, ("perception", "shield"),
        "From these numbers the settings were chosen; they prove nothing.",
    )  # fmt: skip


def make_worth_table(levels_per_hour: Sequence[float]) -> Table:
    """Return the table of all contrasts between perception setups.

    Args:
        levels_per_hour: levels of the rate of contacts [1/h].
    """
    words = {name: each.words for name, each in list_setups().items()}
    rows: dict[tuple[str, ...], tuple[str, ...]] = {
        (name_level(level), name): (
            f"{level:g}", f"{words[pair.better]} instead of {words[pair.worse]}"
        )
        for level in levels_per_hour
        for name, pair in CONTRASTS.items()
    }  # fmt: skip
    return Table(
        "worth",
        "Gain in throughput at stated rates of contacts",
        rows,
        (Column("worth.{0}.{1}", "gain [%]", 1, 100.0, signed=True),),
        ("at most [1/h]", "improvement"),
        "Difference between the throughputs of the best settings, in percentage points, on the "
        "same seeds. Contrasts without a setting at the level are left out. Where a level is "
        "only estimated, the two robots may touch workers at different rates. Intervals are those "
        "of single rows.",
    )


def make_unshielded_table() -> Table:
    """Return the table of the unshielded robot with true joints on the proof seeds."""
    columns = (Column("unshielded.goals_per_min", "goals [1/min]"), *_list_columns("unshielded."))
    return Table("price_unshielded", "Without a shield", {"": ("no shield",)}, columns)
