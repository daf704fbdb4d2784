"""Rank order of policies by the cost, by contacts and by approaches.

    python -m benchmarks ranks

Twenty policies, listed in `POLICIES` before any number was seen, reach on the same seeds beside
workers with the behaviour `unaware`. They are ranked by the mean cost of an episode, by contacts an
hour in which the robot moves towards the worker, and by approaches an hour (steps in which it gets
nearer than `CostConfig.proximity_m` at more than 0.05 m/s). Spearman's rank correlation has a 95 %
bootstrap interval over seeds, which are resampled for all policies together; as resampling adds
noise to both ranks, the resamples are shifted towards 0, and the interval is extended to the
correlation itself. The former default of the cost, the sum of
steps near a worker and steps in contact, is shown for comparison.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from hrc_env.agents.env_info import EnvInfo, Observation
from hrc_env.core.errors import ConfigError
from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats, Ints
from hrc_env.evaluation.intervals import MIN_SEEDS, bootstrap
from hrc_env.evaluation.sums import ACHIEVED, APPROACHES, TOUCHING_STEPS
from hrc_env.experiments.agents import AgentChoice
from hrc_env.experiments.cache import PartCache
from hrc_env.experiments.columns import Column, Episodes, mean, per_minute, rate
from hrc_env.experiments.report import (
    SHIELD_CHOSEN_ON,
    Conditions,
    Metrics,
    Report,
    Table,
    format_seeds,
)
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.experiments.stage import WORKER
from hrc_env.experiments.study import FOUR, Played, Row, Study
from hrc_env.observations import FLAT

FIRST_SEED, TRIED_SEED = 18_310_000, 18_200_000
"""Seeds of the first episode of every policy, and of the episodes on which the benchmark was tried
out, which short runs use, too."""
N_TOGETHER = 125
"""Number of episodes in a part, after which an interrupted run continues."""
ONE, LATE = PerceptionSetup(n_cameras=1), PerceptionSetup(latency_s=0.2, is_told=False)
"""Perception setups besides four cameras."""
REFERENCES = {"towards_per_hour": "contacts towards", "approaches_per_hour": "approaches"}
"""Rates with which the costs are compared, by the name of their metric, with their description."""
COSTS = {"cost": "`cost`", "former_cost": "former cost, `proximity` + `contact`"}
"""Costs that are compared, by the name of their metric, with their description."""
PERFECT = {"perfect": "greatest possible with the ties of the rate"}
"""Row of the correlation of a cost that orders all policies as the rate does, with its description.
It is below 1 if policies are tied, as those without a contact are."""


class Standing:
    """An agent that never moves."""

    def __init__(self, env_info: EnvInfo) -> None:
        self.n_actions = env_info.n_actions

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return actions (..., A) of zero."""
        flat = observation[FLAT] if isinstance(observation, Mapping) else observation
        return np.zeros((*np.asarray(flat).shape[:-1], self.n_actions), np.float32)


def _widen(margin_m: float) -> dict[str, Any]:
    """Return the shield `qp` with additional margins [m]."""
    return {"kind": "qp", "margin_m": margin_m, "hand_margin_m": margin_m}


@dataclass(frozen=True, slots=True)
class Policy:
    """An agent with its shield and perception."""

    words: str
    """Description in tables."""
    agent: AgentChoice = "scripted"
    shield: Any = None
    """Shield, as the environment's argument."""
    setup: PerceptionSetup = FOUR


FAST, LIMITED = "hrc://HRCReach-v0/fast", "hrc://HRCReach-v0/limited"
POLICIES: Mapping[str, Policy] = {
    "bare": Policy("`scripted`"),
    "qp": Policy("`scripted`, `qp`", shield="qp"),
    "qp_05": Policy("`scripted`, `qp`, margins 0.05 m", shield=_widen(0.05)),
    "qp_10": Policy("`scripted`, `qp`, margins 0.10 m", shield=_widen(0.10)),
    "qp_20": Policy("`scripted`, `qp`, margins 0.20 m", shield=_widen(0.20)),
    "qp_constant": Policy(
        '`scripted`, `qp`, `margin="constant"`', shield={"kind": "qp", "margin": "constant"}
    ),
    "ssm": Policy("`scripted`, `ssm`", shield="ssm"),
    "pfl": Policy("`scripted`, `pfl`", shield="pfl"),
    "qp_one": Policy("`scripted`, `qp`, one camera after 1 s", shield="qp", setup=ONE),
    "qp_late": Policy("`scripted`, `qp`, 200 ms late, not time-stamped", shield="qp", setup=LATE),
    "slowed": Policy("`scripted_slowed`", "scripted_slowed"),
    "slowed_qp": Policy("`scripted_slowed`, `qp`", "scripted_slowed", "qp"),
    "slowed_one": Policy("`scripted_slowed`, one camera after 1 s", "scripted_slowed", setup=ONE),
    "random": Policy("`random`", "random"),
    "random_qp": Policy("`random`, `qp`", "random", "qp"),
    "standing": Policy("standing still", Standing),
    "fast": Policy(f"`{FAST}`", FAST),
    "fast_qp": Policy(f"`{FAST}`, `qp`", FAST, "qp"),
    "limited": Policy(f"`{LIMITED}`", LIMITED),
    "limited_qp": Policy(f"`{LIMITED}`, `qp`", LIMITED, "qp"),
}
"""The policies by name, in the order of the table."""


@dataclass(frozen=True, slots=True)
class RanksBench:
    """Benchmark of the rank order of policies by cost."""

    name = "bench ranks"
    depends = ("env", "tracker", "emulator", "motion", "shield", "agents")
    n_episodes: int = 500
    """Number of episodes of each policy."""
    first_seed: int = FIRST_SEED
    """Seed of the first episode of every policy."""
    threads: int | None = None
    """Number of threads that step the environments, without effect on the results; None: all
    cores."""

    def __post_init__(self) -> None:
        """Raise `ConfigError` if there are too few episodes for an interval."""
        if self.n_episodes < MIN_SEEDS:
            raise ConfigError(
                f"The benchmark needs at least {MIN_SEEDS} episodes of each policy, got "
                f"{self.n_episodes}."
            )

    @property
    def study(self) -> Study:
        """The study of the policies' episodes."""
        rows = {
            name: Row(
                each.words,
                self.n_episodes,
                each.agent,
                each.setup,
                {"people": "unaware", "shield": each.shield, "config": {"worker": WORKER}},
                n_together=N_TOGETHER,
            )
            for name, each in POLICIES.items()
        }
        return Study(
            name="ranks", title="Policies", about="", depends=self.depends,
            first_seed=self.first_seed, rows=rows, columns=COLUMNS, heads=("policy",),
            note=f"{self.n_episodes} episodes of `HRCReach-v0` each. Cost: mean of an episode. 95 "
            "% intervals, exact for contacts.",
            conditions=Conditions(
                people="`unaware`", scene="`lab`", perception="`keypoints`, four cameras unless a "
                "row names others", worker=WORKER, chosen_on=SHIELD_CHOSEN_ON,
            ),
            threads=self.threads,
        )  # fmt: skip

    @property
    def seeds(self) -> Sequence[int]:
        """Seeds of the episodes."""
        return self.study.seeds

    @property
    def n_parts(self) -> float:
        """Number of parts."""
        return self.study.n_parts

    @property
    def quick_note(self) -> str:
        """Warning for the tables of a short run, or "" if the run is long enough."""
        if self.n_episodes > QUICK.n_episodes:
            return ""
        return f"{self.n_episodes} episodes of each policy: too few to compare."

    def settings(self) -> dict[str, Any]:
        """Return all settings on which the results depend."""
        given = asdict(self)
        del given["threads"]
        return {**given, **self.study.settings()}

    def play(self, cache: PartCache) -> Played:
        """Return the episodes of each policy; compute the parts that are not in the cache."""
        return self.study.play(cache)

    def metrics(self, played: Played) -> dict[str, Metric]:
        """Return the metrics of each policy, and the rank correlations as "rank.COST.RATE"."""
        return {**self.study.metrics(played), **correlate_ranks(list(played.values()))}

    def shown_tables(self) -> tuple[Table, ...]:
        """Return the tables of the rank correlations and of the policies."""
        policies = (replace(each, name="ranks_policies") for each in self.study.shown_tables())
        return (make_table(self.seeds), *policies)

    def report(self, played: Played, metrics: Metrics, figures: Path) -> Report:
        """Return the report with the tables."""
        parts = [each.to_markdown(metrics) for each in self.shown_tables()]
        return Report("Rank order by cost", (__doc__ or "").strip(), parts)


def correlate_ranks(policies: Sequence[Episodes]) -> dict[str, Metric]:
    """Return Spearman's correlation of each cost with each rate over policies.

    Args:
        policies: episodes of each policy, with the same seeds in the same order.

    Returns:
        The correlations as "rank.COST.RATE", with bootstrap intervals over seeds, and
            "rank.perfect.RATE", the greatest that ties in the rate allow; `Metric.n` is the number
            of seeds.
    """
    values = {
        "cost": _get_values(policies, "cost"),
        "former_cost": _get_values(policies, "cost_steps") + _get_values(policies, TOUCHING_STEPS),
        "towards_per_hour": _get_values(policies, "contacts_towards"),
        "approaches_per_hour": _get_values(policies, APPROACHES),
    }
    n_seeds = values["cost"].shape[1]

    def correlate(weights: Ints, cost: Floats, events: Floats) -> Floats:
        return compute_spearman(weights @ cost.T, weights @ events.T)

    found = {
        f"rank.{cost}.{rate_name}": bootstrap(
            lambda weights, x=values[cost], y=values[rate_name]: correlate(weights, x, y),
            n_seeds,
            "1",
        )
        for cost in COSTS
        for rate_name in REFERENCES
    }
    found = {name: _extend(each) for name, each in found.items()}
    for rate_name in REFERENCES:
        found[f"rank.perfect.{rate_name}"] = bootstrap(
            lambda weights, y=values[rate_name]: find_greatest_spearman(weights @ y.T), n_seeds, "1"
        )
    return found


def _extend(metric: Metric) -> Metric:
    """Return a metric with an interval that contains its value."""
    low, high = min(metric.low, metric.value), max(metric.high, metric.value)
    return replace(metric, low=low, high=high)


def compute_spearman(a: Floats, b: Floats) -> Floats:
    """Return the rank correlation (R,) of the columns of a and b (R, P); ties have their mean rank.

    The correlation is NaN where all entries of a row are equal.
    """
    ranks = [stats.rankdata(each, axis=1) for each in (a, b)]
    x, y = (each - each.mean(1, keepdims=True) for each in ranks)
    with np.errstate(invalid="ignore"):
        return (x * y).sum(1) / np.sqrt(np.square(x).sum(1) * np.square(y).sum(1))


def find_greatest_spearman(values: Floats) -> Floats:
    """Return the greatest rank correlation (R,) that anything without ties has with values (R, P).

    It is that of an order of the entries of each row that agrees with their values.
    """
    order = np.argsort(np.argsort(values, axis=1, kind="stable"), axis=1)
    return compute_spearman(order.astype(float), values)


def _get_values(policies: Sequence[Episodes], statistic: str) -> Floats:
    """Return the values (P, n) of a statistic in n episodes of P policies."""
    return np.array([[each[statistic] for each in episodes] for episodes in policies], float)


def make_table(seeds: Sequence[int]) -> Table:
    """Return the table of the rank correlations.

    Args:
        seeds: seeds of the episodes.
    """
    return Table(
        "ranks",
        "Rank correlation with the cost",
        {name: (words,) for name, words in (COSTS | PERFECT).items()},
        tuple(
            Column(f"rank.{{}}.{name}", f"{words} an hour", 2)
            for name, words in REFERENCES.items()
        ),
        ("cost",),
        f"Spearman's rank correlation over {len(POLICIES)} policies, with 95 % bootstrap intervals "
        f"over {len(seeds)} seeds ({format_seeds(seeds)}).",
    )  # fmt: skip


COLUMNS: tuple[Column, ...] = (
    mean("cost", "cost"),
    mean("cost_steps", "steps near", "close_steps"),
    mean(TOUCHING_STEPS, "touching steps", "contact_steps"),
    rate("contacts_towards", "contacts towards [1/h]", "towards_per_hour", "hour"),
    per_minute(
        APPROACHES, "approaches [1/h]", "approaches_per_minute", "1/min", digits=0, scale=60
    ),
    per_minute(ACHIEVED, "goals [1/min]", "goals_per_minute"),
)
QUICK = RanksBench(MIN_SEEDS, TRIED_SEED)
"""Settings of the quick form."""
