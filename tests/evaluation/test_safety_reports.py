"""Contacts an hour, their severity, and interventions of a shield: from infos to a score."""

from contextlib import closing

import gymnasium
import numpy as np
import pytest

import hrc_env
from hrc_env.__main__ import main
from hrc_env.core.results import describe_metric
from hrc_env.evaluation.episodes import play_episodes, summarize
from hrc_env.evaluation.sums import (
    ABOVE,
    ACTIVE,
    APPROACHES,
    COMING,
    FORCE,
    INTERVENTIONS,
    RATED,
    SEVERITY,
    STATISTICS,
    EpisodeSums,
    count_interventions,
    count_severe,
)

HEADLONG = {"perception": "keypoints", "people": "unaware", "max_episode_steps": 100}


def add_steps(**infos: list[float]) -> EpisodeSums:
    """Sums of one episode with these infos in its steps."""
    sums = EpisodeSums(1)
    for values in zip(*infos.values(), strict=True):
        info = {name: np.array([value]) for name, value in zip(infos, values, strict=True)}
        sums.add(np.zeros(1), info | {f"_{name}": np.array([True]) for name in info})
    return sums


def test_an_intervention_begins_when_the_shield_becomes_active():
    active = [1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0]
    sums = add_steps(**{ACTIVE: active})
    assert sums.sums[INTERVENTIONS].tolist() == [3.0]
    infos = [{ACTIVE: np.array([each]), SEVERITY: np.zeros(1)} for each in active]
    assert count_interventions(infos)[INTERVENTIONS].tolist() == [3]


def test_without_a_shield_interventions_are_absent_and_not_zero():
    sums = add_steps(**{SEVERITY: [0.0, 0.0]})
    assert np.isnan(sums.sums[INTERVENTIONS]).all()
    assert count_interventions([{SEVERITY: np.zeros(2)}]) == {}


def test_a_new_episode_begins_without_interventions():
    sums = add_steps(**{ACTIVE: [1.0, 1.0]})
    sums.begin(np.array([0]))
    info = {ACTIVE: np.array([1.0]), f"_{ACTIVE}": np.array([True])}
    sums.add(np.zeros(1), info)
    assert sums.sums[INTERVENTIONS].tolist() == [1.0]


def test_an_approach_is_an_entry_of_a_robot_that_moves_towards_somebody():
    near = [0.0, 1.0, 1.0, 0.0, 1.0, 0.0, 1.0, 1.0]
    towards_m_s = [0.9, 0.3, 0.9, 0.0, 0.04, 0.0, 0.06, -1.0]
    sums = add_steps(**{"cost_proximity": near, COMING: towards_m_s, "cost_contact": near})
    assert sums.sums[APPROACHES].tolist() == [2.0]
    assert sums.sums["cost_contact"].tolist() == [5.0]
    sums.begin(np.array([0]))
    assert sums.sums[APPROACHES].tolist() == [0.0]


def test_approaches_are_not_zero_but_unknown_without_speeds():
    assert np.isnan(add_steps(**{"cost_proximity": [0.0, 1.0]}).sums[APPROACHES]).all()
    assert np.isnan(add_steps(**{COMING: [0.0, 1.0]}).sums[APPROACHES]).all()


def test_a_contact_is_severe_if_its_force_is_above_the_limit_of_the_region():
    severity, ratio = [0.0, 1.0, 2.0, 3.0, 0.0], [0.0, 1.0, 1.1, 0.4, 0.0]  # the last on the head
    sums = add_steps(**{SEVERITY: severity, FORCE: ratio}).sums
    assert (sums[RATED].tolist(), sums[ABOVE].tolist()) == ([3.0], [1.0])
    pairs = zip(severity, ratio, strict=True)
    infos = [{SEVERITY: np.array([s]), FORCE: np.array([r])} for s, r in pairs]
    counted = count_severe(infos)
    assert (counted[RATED].tolist(), counted[ABOVE].tolist()) == ([3], [1])


def episode(**changes: float) -> dict[str, float]:
    return dict.fromkeys(STATISTICS, 0.0) | {"seconds": 36.0} | changes


def test_a_score_has_contacts_an_hour_with_exact_intervals():
    one = {"contacts_towards": 2.0, "contacts_standing": 1.0, RATED: 3.0, ABOVE: 1.0}
    score = summarize([episode(**one, interventions=4.0), *[episode()] * 9])  # 0.1 h
    assert score.contacts_towards_per_hour.value == pytest.approx(20.0)
    assert score.contacts_fleeing_per_hour.value == 0.0 < score.contacts_fleeing_per_hour.high
    assert score.contacts_per_hour.value == pytest.approx(30.0)
    severe = score.contacts_above_limit
    assert (severe.value, severe.n) == (pytest.approx(1 / 3), 3)
    assert (severe.low, severe.high) == pytest.approx((0.0084, 0.9057), abs=1e-4)  # binomial tables
    assert score.interventions_per_hour.value == pytest.approx(40.0)
    assert score.numbers()["contacts_towards_per_hour"] == pytest.approx(20.0)
    assert score.describe()["contacts_above_limit"] == "0.333 (0.008 to 0.906), n = 3"


def test_what_was_not_observed_is_not_zero():
    score = summarize([episode(interventions=np.nan)] * 10)
    assert np.isnan(score.contacts_above_limit.value)
    assert np.isnan(score.interventions_per_hour.value)
    assert score.contacts_above_limit.n == score.interventions_per_hour.n == 0
    assert describe_metric(score.interventions_per_hour) == "- (n = 0)"


@pytest.mark.parametrize("shield", [None, "qp"])
def test_episodes_of_a_batch_and_single_ones_count_what_their_infos_say(shield):
    made = {**HEADLONG, "shield": shield}
    batch = play_episodes(lambda info: hrc_env.make_agent("scripted", info), 6, 1000, **made)
    n_rated = n_above = n_begun = 0
    with closing(gymnasium.make("HRCReach-v0", **made)) as env:
        for k in range(6):
            observation, _ = env.reset(seed=1000 + k)
            agent = hrc_env.make_agent("scripted", hrc_env.env_info(env))
            is_over, before, begun = False, 0.0, 0
            while not is_over:
                observation, _, over, cut, info = env.step(agent.act(observation))
                n_rated += info["safety/contact_severity"] > 0
                n_above += info["safety/contact_force_ratio"] > 1
                begun += info.get("shield/active", 0) > before
                before, is_over = info.get("shield/active", 0), over or cut
            if shield:
                assert batch[k][INTERVENTIONS] == begun
            else:
                assert np.isnan(batch[k][INTERVENTIONS])
            n_begun += begun
    assert sum(each[RATED] for each in batch) == n_rated
    assert sum(each[ABOVE] for each in batch) == n_above
    kinds = [f"contacts_{kind}" for kind in ("towards", "fleeing", "standing")]
    assert sum(each[name] for each in batch for name in kinds) == n_rated
    assert n_begun > 0 if shield else n_rated > 0


def test_evaluate_and_play_print_them(capsys):
    words = ["HRCReach-v0", "--agent", "scripted", "--perception", "keypoints", "--episodes", "2",
             "--people", "unaware"]  # fmt: skip
    for command, shield in (("evaluate", ["--shield", "qp"]), ("play", [])):
        assert main([command, *words, *shield]) == 0
        lines = capsys.readouterr().out.splitlines()
        said = dict(line.split(maxsplit=1) for line in lines if "_per_hour" in line)
        assert said.keys() >= {
            f"contacts_{kind}_per_hour" for kind in ("towards", "fleeing", "standing")
        }
        assert " to " in said["contacts_per_hour"]
        assert said["interventions_per_hour"].startswith("-") == (not shield)
        assert any(line.startswith("contacts_above_limit") for line in lines)
