"""What kept policies are worth in today's environments: python -m benchmarks.kept

Policies that `python -m benchmarks.learners` and `python -m benchmarks.limited` made come with the
package, one or more of every task. Each is judged as it learnt and under the shield `qp`, on the
same fixed seeds.
"""

import sys

from benchmarks.command import main
from hrc_env.agents import policies
from hrc_env.evaluation.episodes import EVALUATION_SEED
from hrc_env.evaluation.sums import ACHIEVED
from hrc_env.experiments.columns import mean, per_minute, rate, share_of_tries
from hrc_env.experiments.study import Row, Study


def _row(address: str, shield: str | None) -> Row:
    """Return a policy under a shield."""
    card = policies.read(policies.path_of(address))[0]
    env = {"task": card.task, "control": card.control, "shield": shield}
    return Row((f"`{address}`", f"`{shield}`" if shield else "none"), 48, address, env=env)


def make_study() -> Study:
    """Return the study of every policy that comes with the package."""
    return Study(
        name="kept",
        title="What the policies of the package are worth",
        about=(__doc__ or "").strip(),
        depends=("env", "tracker", "emulator", "motion", "shield", "agents"),
        first_seed=EVALUATION_SEED,
        rows={
            f"{address.removeprefix(policies.PREFIX)}.{shield or 'none'}": _row(address, shield)
            for address in policies.names()
            for shield in (None, "qp")
        },
        heads=("policy", "shield"),
        columns=(
            share_of_tries("success", clustered=False, digits=2),
            per_minute(ACHIEVED, "goals [1/min]", "goals_per_minute"),
            mean("cost", "cost"),
            rate("contacts", "contacts", digits=2),
            rate("contacts_towards", "towards [in 1,000]", "towards", "1000 episodes"),
        ),
        note="Beside attentive workers at `keypoints`, 48 episodes. Contacts an episode, and "
        "towards the worker in 1,000. 95 % intervals: exact ones of success and contacts, else "
        "bootstraps.",
    )


if __name__ == "__main__":
    sys.exit(main(make_study, __doc__))
