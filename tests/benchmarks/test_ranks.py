"""The benchmark of the rank order by cost, and that of the budgets."""

import json

import numpy as np
import pytest
from scipy import stats

from benchmarks import budgets, ranks
from benchmarks.common import TASKS
from benchmarks.ranks import POLICIES, QUICK, TRIED_SEED, RanksBench, correlate_ranks
from docs import tables
from hrc_env.agents.env_info import env_info
from hrc_env.agents.learner_settings import COST_LIMITS
from hrc_env.core.errors import ConfigError
from hrc_env.experiments.runner import run_experiment
from hrc_env.settings import resolve_settings
from hrc_env.simulation import Simulation

STATISTICS = ("cost", "cost_steps", "contact_steps", "contacts_towards", "approaches")


def played(rates, n=40, seed=0):
    """Episodes of policies that endanger people at these rates, in all statistics alike."""
    rng = np.random.default_rng(seed)
    return [
        [dict.fromkeys(STATISTICS, float(rng.poisson(rate))) for _ in range(n)] for rate in rates
    ]


def test_a_correlation_is_that_of_scipy_and_its_interval_contains_it():
    episodes = played(np.linspace(0.0, 3.0, 20))
    for own, other in zip(episodes, played(np.linspace(0.0, 3.0, 20), seed=1), strict=True):
        for one, another in zip(own, other, strict=True):
            one["contacts_towards"] = another["contacts_towards"]
    found = correlate_ranks(episodes)
    cost, towards = (
        [np.mean([each[name] for each in own]) for own in episodes]
        for name in ("cost", "contacts_towards")
    )
    rho = found["rank.cost.towards_per_hour"]
    assert rho.value == pytest.approx(stats.spearmanr(cost, towards).statistic)
    assert rho.low < rho.value <= rho.high < 1.0
    assert rho.n == 40
    assert found["rank.cost.approaches_per_hour"].value == pytest.approx(1.0)
    assert set(found) == {
        f"rank.{cost}.{rate}"
        for cost in ("cost", "former_cost", "perfect")
        for rate in ("towards_per_hour", "approaches_per_hour")
    }


def test_seeds_are_resampled_for_all_policies_together():
    """In every resample, equal numbers have the same order."""
    rho = correlate_ranks(played(np.linspace(1.0, 1.2, 20)))["rank.cost.towards_per_hour"]
    assert (rho.low, rho.value, rho.high) == pytest.approx((1.0, 1.0, 1.0))


def test_ties_lower_the_greatest_correlation():
    tied = np.array([[0.0, 0.0, 0.0, 1.0, 2.0], [5.0, 4.0, 3.0, 2.0, 1.0]])
    with_ties = np.sqrt(1 - (3**3 - 3) / (5**3 - 5))
    assert ranks.find_greatest_spearman(tied) == pytest.approx([with_ties, 1.0])
    assert np.isnan(ranks.compute_spearman(np.zeros((1, 3)), np.ones((1, 3)))).all()


def test_twenty_different_policies_are_listed_on_seeds_that_were_not_tried():
    assert len(POLICIES) == 20
    bench = RanksBench()
    settings = [json.dumps(row.settings(), default=str) for row in bench.study.rows.values()]
    assert len({*settings}) == 20
    tried = range(TRIED_SEED, TRIED_SEED + 50)
    assert not {*bench.seeds} & {*tried}
    assert bench.n_parts == 80
    assert bench.quick_note == ""
    assert "too few" in QUICK.quick_note
    with pytest.raises(ConfigError, match="at least 8 episodes"):
        RanksBench(3)


def test_whoever_stands_still_sends_no_velocity():
    simulation = Simulation(2, resolve_settings(perception="none"))
    agent = ranks.Standing(env_info(simulation))
    result = simulation.reset(np.arange(2), [np.random.default_rng(k) for k in range(2)])
    action = agent.act(result.observation)
    assert action.shape == (2, 6)
    assert not action.any()


@pytest.mark.slow
def test_the_benchmark_goes_on_after_a_stop(tmp_path, monkeypatch):
    few = {name: POLICIES[name] for name in ("qp", "standing")}
    monkeypatch.setattr(ranks, "POLICIES", few)
    short = RanksBench(8, TRIED_SEED, threads=1)
    metrics = run_experiment(short, tmp_path)
    assert metrics["standing.cost"].value == 0.0
    assert {"qp.towards_per_hour", "rank.cost.approaches_per_hour"} <= metrics.keys()
    play = "hrc_env.experiments.study.play_episodes"
    monkeypatch.setattr(play, lambda *of, **_: pytest.fail("played again"))
    assert run_experiment(short, tmp_path).keys() == metrics.keys()
    assert "Spearman" in (tmp_path / "report.md").read_text()


def test_every_task_has_a_budget_that_is_shown():
    study = budgets.make_study()
    assert len(study.rows) == 4 * len(TASKS)
    limits = budgets.list_limits({})
    assert {name: metric.value for name, metric in limits.items()} == {
        f"{task}.budget": limit for task, limit in COST_LIMITS.items()
    }


@pytest.mark.parametrize("task", TASKS)
def test_a_budget_is_above_the_cost_of_a_careful_agent_and_below_that_of_the_careless(task):
    metrics = tables.read("budgets").metrics
    assert metrics[f"{task}.budget"].value == COST_LIMITS[task]
    costs = [metrics[f"{task}.{name}.cost"] for name in budgets.BEHAVIOURS]
    assert min(cost.value for cost in costs) <= COST_LIMITS[task] <= max(x.high for x in costs)


def test_an_interval_contains_its_correlation():
    """Resamples add noise to the ranks of policies that hardly differ, and correlate less."""
    rng = np.random.default_rng(0)

    def draw(k: int) -> np.ndarray:
        noise = rng.normal(size=16)
        return noise - noise.mean() + 1e-3 * k

    episodes = [
        [{**dict.fromkeys(STATISTICS, 0.0), "cost": cost, "contacts_towards": towards}
         for cost, towards in zip(draw(k), draw(k), strict=True)]
        for k in range(20)
    ]  # fmt: skip
    found = correlate_ranks(episodes)["rank.cost.towards_per_hour"]
    assert found.value == pytest.approx(1.0)
    assert found.low < 0.5
    assert found.high == found.value
