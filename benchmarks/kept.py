"""Scores of the trained policies that come with the package.

    python -m benchmarks.kept

The package contains policies that `python -m benchmarks.learners`, `python -m benchmarks.limited`
and `python -m benchmarks.under_shield` trained, at least one for every task. Each one is evaluated
without a shield and with the shield `qp`, on the same fixed seeds.
"""

import sys

from benchmarks.command import main
from hrc_env.agents import policies
from hrc_env.evaluation.episodes import EVALUATION_SEED
from hrc_env.evaluation.sums import ACHIEVED
from hrc_env.experiments.columns import (
    list_safety_columns,
    mean,
    per_minute,
    rate,
    share_of_tries,
)
from hrc_env.experiments.report import SHIELD_CHOSEN_ON, Conditions
from hrc_env.experiments.stage import WORKER
from hrc_env.experiments.study import Row, Study


def _make_row(address: str, shield: str | None) -> Row:
    """Return the row of a policy, evaluated with or without a shield."""
    card = policies.read(policies.find_path(address)).card
    env = {"task": card.task, "control": card.control, "shield": shield,
           "config": {"worker": WORKER}}  # fmt: skip
    return Row((f"`{address}`", f"`{shield}`" if shield else "none"), 48, address, env=env)


def make_study() -> Study:
    """Return the study of all policies that come with the package."""
    return Study(
        name="kept",
        title="Scores of the package's policies",
        about=(__doc__ or "").strip(),
        depends=("env", "tracker", "emulator", "motion", "shield", "agents"),
        first_seed=EVALUATION_SEED,
        rows={
            f"{address.removeprefix(policies.PREFIX)}.{shield or 'none'}": _make_row(
                address, shield
            )
            for address in policies.list_names()
            for shield in (None, "qp")
        },
        heads=("policy", "shield"),
        columns=(
            share_of_tries("success", digits=2),
            per_minute(ACHIEVED, "goals [1/min]", "goals_per_minute"),
            mean("cost", "cost"),
            *list_safety_columns(),
            rate("contacts", name="contacts_per_episode"),
        ),
        note="48 episodes per row; cost per episode, contacts and interventions of the shield per "
        "hour of simulated time. Above the force limit: share of all contacts, by the estimated "
        "force and the limit of the touched body region. 95 % intervals are exact for contacts, "
        "for success exact for the effective number of attempts, as attempts of one episode are "
        "dependent, and bootstraps otherwise.",
        conditions=Conditions(
            people="`attentive`", scene="that of the task", perception="`keypoints`",
            chosen_on=f"policies were trained on {_list_training_seeds()}, with the body "
            f"`worker_1`{_list_other_bodies()}; {SHIELD_CHOSEN_ON}",
            worker=WORKER,
        ),
    )  # fmt: skip


def _list_training_seeds() -> str:
    """Return the seeds on which the policies of the package were trained, as text."""
    cards = [policies.read(policies.find_path(each)).card for each in policies.list_names()]
    seeds = sorted({card.seed for card in cards})
    return f"seed{'s' if len(seeds) > 1 else ''} {', '.join(map(str, seeds))}"


def _list_other_bodies() -> str:
    """Return the names of the policies that were trained with workers of any body, as text."""
    names = [
        address.rpartition("/")[2]
        for address in policies.list_names()
        if f"worker={WORKER}" in policies.read(policies.find_path(address)).card.command
    ]
    return f" ({', '.join(f'`{name}`' for name in names)}: any body)" if names else ""


if __name__ == "__main__":
    sys.exit(main(make_study, __doc__))
