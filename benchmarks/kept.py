"""Scores of the trained policies that come with the package.

    python -m benchmarks.kept

The package contains policies that `python -m benchmarks.learners` and `python -m
benchmarks.limited` trained, at least one for every task. Each one is evaluated without a shield and
with the shield `qp`, on the same fixed seeds.
"""

import sys

from benchmarks.command import main
from hrc_env.agents import policies
from hrc_env.evaluation.episodes import EVALUATION_SEED
from hrc_env.evaluation.sums import ACHIEVED
from hrc_env.experiments.columns import mean, per_minute, rate, share_of_tries
from hrc_env.experiments.study import Row, Study


def _make_row(address: str, shield: str | None) -> Row:
    """Return the row of a policy, evaluated with or without a shield."""
    card = policies.read(policies.find_path(address)).card
    env = {"task": card.task, "control": card.control, "shield": shield}
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
            share_of_tries("success", clustered=False, digits=2),
            per_minute(ACHIEVED, "goals [1/min]", "goals_per_minute"),
            mean("cost", "cost"),
            rate("contacts", "contacts", digits=2),
            rate(
                "contacts_towards",
                "contacts towards [per 1,000 episodes]",
                "towards",
                "1000 episodes",
            ),
        ),
        note="48 episodes per row beside attentive workers at `keypoints`; cost and contacts per "
        "episode. 95 % intervals are exact for success and contacts and bootstraps otherwise.",
    )


if __name__ == "__main__":
    sys.exit(main(make_study, __doc__))
