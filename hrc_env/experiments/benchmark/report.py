"""What is to be read of a policy's numbers."""

from collections.abc import Sequence

from hrc_env.experiments.benchmark.conditions import CONDITIONS
from hrc_env.experiments.report import Column, Metrics, Report, table_of

COLUMNS = (
    Column("{}.goals_per_minute", "goals a minute"),
    Column("{}.success", "success", 2),
    Column("{}.towards_per_hour", "contacts an hour: towards", 0),
    Column("{}.fleeing_per_hour", "fleeing", 0),
    Column("{}.standing_per_hour", "standing", 0),
    Column("{}.cost_per_minute", "cost a minute"),
    Column("{}.regret", "regret", 1),
)
ASKED = """\
What a policy does and how safe it is, on fixed seeds. A contact is *towards* where the robot moved
towards the worker when it began, *fleeing* where it moved away, *standing* else; contacts and cost
are counted on the truth. Regret: goals a minute that the best entry of the leaderboard reaches more
under the same condition, among those that drive into people no more often."""


def report(policy: str, ids: Sequence[str], metrics: Metrics) -> Report:
    """A table a task."""
    parts = []
    for task in ids:
        rows = {f"{task}.{name}": each.words for name, each in CONDITIONS.items()}
        parts += [f"## {task}", table_of("condition", rows, COLUMNS, metrics)]
    return Report(f"Benchmark: {policy}", ASKED, parts)
