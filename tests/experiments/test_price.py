"""What sight costs at one rate of contacts: search, intervals, setups, what is written."""

import json
import signal
from collections.abc import Callable, Generator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hrc_env.agents import experts
from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.core.results import Metric
from hrc_env.core.typing import Floats
from hrc_env.engines.local import Processes
from hrc_env.experiments.cache import PartCache
from hrc_env.experiments.price import experiment
from hrc_env.experiments.price.declaration import CONTRAST_LABELS
from hrc_env.experiments.price.episodes import STEP, Driver, EpisodeRunner, sum_episodes
from hrc_env.experiments.price.experiment import (
    Price,
    check_walks,
    make_experiment,
)
from hrc_env.experiments.price.metrics import (
    CONTRASTS,
    N_DRAWS,
    Played,
    Row,
    compute_metrics,
    suppose_margin_m,
)
from hrc_env.experiments.price.report import choose_bars
from hrc_env.experiments.price.search import MarginSearch, draw_seeds, run_together, search
from hrc_env.experiments.price.setups import ELSEWHERE, QUICK, find_setups, list_setups
from hrc_env.experiments.price.shield import Widened
from hrc_env.experiments.runner import run_experiment
from hrc_env.experiments.setups import PerceptionSetup
from hrc_env.safety.shield import SHIELDS
from hrc_env.settings import resolve_settings
from hrc_env.simulation import Simulation

TINY = Price(
    setups=("truth", "two_cameras"), n_seeds=5, n_fresh=6, n_search=1, n_pixels=0, n_steps=50
)


def silent(share, label):
    """Say nothing."""


@pytest.fixture(scope="module")
def end_to_end(tmp_path_factory):
    """A run from beginning to end: its folder and its numbers."""
    out = tmp_path_factory.mktemp("price")
    return out, run_experiment(TINY, out, silent)


def contacts_at(margin_m: float) -> float:
    """Contacts a minute that fall by a factor of e every 5 cm: 0.18 at 11 cm."""
    return 0.18 * np.exp((0.11 - margin_m) / 0.05)


def tried_by_a_search(rate: Callable[[float], float], *given: Any) -> list[float]:
    """The margins that a search tries of a function."""

    def asked(margin_m: float) -> Generator[float, float, float]:
        return (yield margin_m)

    (found,) = run_together([search(asked, *given)], lambda margins_m: [*map(rate, margins_m)])
    return found


def test_a_search_halves_its_bracket_and_looks_beside():
    margins_m = tried_by_a_search(contacts_at, -0.4, 0.4, 0.18, 4)
    assert margins_m == pytest.approx([0.0, 0.2, 0.1, 0.15, 0.05])
    assert tried_by_a_search(contacts_at, -0.4, 0.4, 0.18, 12)[11] == pytest.approx(
        0.11, abs=0.8 / 2**12
    )


def test_a_search_goes_to_the_end_of_a_bracket_that_lacks_the_level():
    assert max(tried_by_a_search(lambda margin: 1.0, -0.4, 0.4, 0.5, 4)) == pytest.approx(0.45)
    assert min(tried_by_a_search(lambda margin: 0.0, -0.4, 0.4, 0.5, 4)) == pytest.approx(-0.45)


def test_searches_take_their_steps_together():
    rounds: list[list[str]] = []

    def count(name: str, n_steps: int) -> Generator[str, int, int]:
        total = 0
        for k in range(n_steps):
            total += yield f"{name}{k}"
        return total

    def answer(asked: list[str]) -> list[int]:
        rounds.append(asked)
        return [int(each[1:]) for each in asked]

    assert run_together([count("a", 3), count("b", 0), count("c", 2)], answer) == [3, 0, 1]
    assert rounds == [["a0", "c0"], ["a1", "c1"], ["a2"]]


def test_a_search_supposes_the_level_between_two_margins():
    tried = {m: {"towards": [contacts_at(m) * 600], "minutes": [600]} for m in (0.05, 0.1, 0.15)}
    assert suppose_margin_m(tried, 30.0) == pytest.approx(0.11, abs=0.002)


def tried(rng, n: int = 300, m: int = 1000, fresh_more: float = 1.0) -> MarginSearch:
    """A search on a synthetic curve: contacts as `contacts_at`, goals 40 - 50 x margin a minute;
    every seed has a number of its own, so that margins differ by what they do."""
    margins_m = np.sort(tried_by_a_search(contacts_at, -0.4, 0.4, 0.18, 4))
    expected = np.array([contacts_at(margin) for margin in margins_m]) / 6.0
    luck, fresh_luck = rng.uniform(size=n), rng.uniform(size=m)
    goals = (40 - 50 * margins_m) / 6.0
    own, fresh_own = rng.normal(0, 1, n), rng.normal(0, 1, m)
    fresh = (fresh_luck < fresh_more * contacts_at(0.1) / 6.0).astype(float)
    return MarginSearch(
        margins_m, (luck < expected[:, None]).astype(float), goals[:, None] + own,
        np.full((len(margins_m), n), 1 / 6), 0.1, fresh, 35 / 6.0 + fresh_own, np.full(m, 1 / 6),
    )  # fmt: skip


def test_what_is_found_at_the_level_is_in_its_interval():
    inside = np.zeros(2)
    for seed in range(40):
        drawn = tried(np.random.default_rng(seed)).evaluate(0.18, *draw_seeds(300, 1000, 200))[1:]
        low, high = np.quantile(drawn, [0.025, 0.975], axis=0)
        inside += (low <= [0.11, 34.5]) & (high >= [0.11, 34.5])
    assert (inside >= 34).all()
    assert 0.005 < (high - low)[0] < 0.08


def test_fresh_seeds_that_say_otherwise_move_the_margin():
    """Three times the contacts at that margin: it needs a wider one, at fewer goals."""
    drawn = draw_seeds(300, 1000, 1)
    margins_m = {
        more: tried(np.random.default_rng(0), fresh_more=more).evaluate(0.18, *drawn)[0]
        for more in (0.5, 1.0, 3.0)
    }
    assert margins_m[0.5][0] < margins_m[1.0][0] < margins_m[3.0][0]
    assert margins_m[3.0][1] < margins_m[1.0][1]


def test_draws_are_the_same_for_everybody():
    first, second = draw_seeds(5, 7, 3)
    assert first[0].tolist() == [1] * 5
    assert (second[1:].sum(1) == 7).all()
    assert np.array_equal(draw_seeds(9, 7, 3)[1], second)


def played(n_steps: int = 20, **columns: Floats) -> dict[str, float]:
    """What one episode of such steps came to."""
    steps = np.zeros((n_steps, 1), STEP)
    for name, values in columns.items():
        steps[name][:, 0] = values
    return {name: values[0] for name, values in sum_episodes(steps, 0.04).items()}


def test_nothing_counts_after_the_end_of_an_episode():
    k = np.arange(20)
    found = played(over=k == 9, achieved=k, cost=np.ones(20), towards=k // 9, away=k // 12)
    assert [found[name] for name in ("achieved", "cost", "towards", "away")] == [9, 10, 1, 0]
    assert found["minutes"] == pytest.approx(10 * 0.04 / 60)


def test_setups_are_what_their_names_say():
    known = list_setups()
    assert set(QUICK) <= known.keys()
    assert len(QUICK) == 12
    assert set(ELSEWHERE) <= set(QUICK)
    assert {name for pair in CONTRASTS.values() for name in pair} <= known.keys()
    assert CONTRAST_LABELS.keys() == CONTRASTS.keys()
    (turned,) = known["all_turned_1deg"].turns("lab")
    assert turned.faults[0].kind == "wrong_rotation"
    assert turned.faults[0].max_amount == pytest.approx(np.deg2rad(1))
    assert len(known["one_frozen"].turns("lab")) == 4
    assert known["half_covariance"].covariance == 0.5
    assert known["paper_restarts"].perception == PerceptionSetup(estimator="paper_restarts")
    sites = known["one_camera"].turns("site")
    assert sites[0].cameras != known["one_camera"].turns("lab")[0].cameras


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"n_seeds": 0}, "--seeds must be at least 1"),
        (
            {"setups": ("one_camara",)},
            "Unknown perception setup 'one_camara'. Did you mean 'one_camera'",
        ),
        ({"setups": ()}, "No perception setup to compare"),
        ({"bracket_m": (0.1, 0.1)}, "bracket_m must be"),
        ({"level": 0.0}, "level must be positive"),
        ({"task": "HRCReach-v1"}, "Unknown task 'HRCReach-v1'"),
    ],
)
def test_what_cannot_be_played_is_refused(change, words):
    with pytest.raises(ConfigError, match=words):
        replace(TINY, **change)


def test_a_task_that_nobody_has_scripted_is_refused(monkeypatch):
    monkeypatch.delitem(experts.EXPERTS, "HRCHandover-v0")
    with pytest.raises(ConfigError, match=r"exists only for HRCR.*, not for HRCHandover-v0"):
        replace(TINY, task="HRCHandover-v0")


def test_a_folder_of_other_results_is_refused(tmp_path):
    (tmp_path / "experiment.json").write_text(json.dumps({"experiment": "impact"}))
    with pytest.raises(ConfigError, match="holds the results of 'impact'; this study is 'price'"):
        run_experiment(TINY, tmp_path, silent)


def test_what_the_command_asks_for():
    full, quick = make_experiment(), make_experiment(quick=True)
    assert quick.setups == QUICK
    assert (quick.others, quick.n_pixels) == ((), 0)
    assert (quick.n_seeds, quick.n_fresh, quick.n_search) == (300, 600, 4)
    assert full.n_fresh == 1000
    assert len(full.others) == 6
    assert full.n_pixels == 40
    assert make_experiment(seeds=3).n_fresh == 10
    elsewhere = make_experiment(task="HRCHandover-v0")
    assert elsewhere.setups == ELSEWHERE
    assert len(elsewhere.list_seeds("HRCHandover-v0", 300)) == 100  # as much time
    assert make_experiment(setups=("truth", "truth")).setups == ("truth",)


def test_a_wider_shield_intervenes_more_and_covariances_are_told():
    stage = EpisodeRunner(replace(list_setups()["truth"]), "HRCReach-v0", 60)
    seeds = [3_000_000 + k for k in range(8)]
    narrow, wide, again = (stage.play(seeds, m, lambda share: None) for m in (-2.0, 1.0, -2.0))
    stage.close()
    assert narrow == again
    assert sum(wide["achieved"]) < sum(narrow["achieved"])
    assert narrow["walk"] == wide["walk"]
    alone = EpisodeRunner(list_setups()["truth"], "HRCReach-v0", 60, is_shielded=False)
    bare = alone.play(seeds, 0.0, lambda share: None)
    assert narrow.pop("interventions") == [0] * 8 < wide["interventions"]
    assert bare == narrow  # without a shield, interventions are absent
    alone.close()


def test_only_the_shield_is_told_other_covariances(monkeypatch):
    told = []

    def note(now, wanted, dt_s):
        told.append(now)
        return wanted, {}

    monkeypatch.setitem(SHIELDS, "qp", note)
    part = Simulation(1, resolve_settings(perception="truth"))
    part.reset(np.zeros(1, int), [np.random.default_rng(0)])
    now = part.belief
    Widened(2.0, -0.1)(now, np.zeros((1, 6)), 0.04)
    assert told[0].estimate.cov_world == pytest.approx(2.0 * now.estimate.cov_world)
    assert told[0].robot.capsule_radius_m == pytest.approx(now.robot.capsule_radius_m - 0.1)
    part.close()


def test_every_row_says_everything(end_to_end):
    out, metrics = end_to_end
    for name in TINY.setups:
        for what in ("margin_m", "goals_per_min", "share", "of_truth", "confirmed.margin_m",
                     "confirmed.towards", "confirmed.standing", "confirmed.away",
                     "confirmed.goals_per_min", "confirmed.cost"):  # fmt: skip
            assert f"HRCReach-v0.{name}.{what}" in metrics
        margin = metrics[f"HRCReach-v0.{name}.margin_m"]
        assert -1.2 <= margin.value <= 1.2
        assert np.isnan([margin.low, margin.high]).all()  # six seeds
    assert metrics["HRCReach-v0.truth.of_truth"] == Metric(1.0, np.nan, np.nan, "share", 6)
    assert "HRCReach-v0.truth.confirmed.interventions" in metrics
    assert "HRCReach-v0.unshielded.interventions" not in metrics
    text = (out / "report.md").read_text()
    assert "true joints" in text
    assert (out / "figures" / "price.png").exists()
    written = json.loads((out / "results.json").read_text())
    assert set(written["metrics"]) == set(metrics)
    assert written["config"]["shield"] == "qp"


def test_a_run_that_is_killed_goes_on_to_the_same_numbers(end_to_end, process, tmp_path):
    _, metrics = end_to_end
    script = (
        "import os, sys; from pathlib import Path; "
        "from hrc_env.experiments.price.episodes import Driver\n"
        "from hrc_env.experiments.price.experiment import Price\n"
        "from hrc_env.experiments.runner import run_experiment\n"
        f"config = {TINY!r}\n"
        "def say(share, label):\n"
        "    if label.startswith('HRCReach-v0.two_cameras.fresh'): os.kill(os.getpid(), 9)\n"
        "run_experiment(config, Path(sys.argv[1]), say)"
    )
    assert process("-c", script, tmp_path).returncode == -signal.SIGKILL
    kept = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "parts").iterdir()}
    assert len(kept) >= 10  # without a shield; of both four that were searched; of one the fresh
    assert run_experiment(TINY, tmp_path, silent) == metrics
    for name, time_ns in kept.items():
        assert (tmp_path / "parts" / name).stat().st_mtime_ns == time_ns


@pytest.mark.slow
def test_parts_do_not_depend_on_the_engine(end_to_end, tmp_path):
    out, metrics = end_to_end
    assert run_experiment(TINY, tmp_path, silent, engine=Processes(2)) == metrics
    for path in (out / "parts").glob("*.json"):
        one, other = (
            json.loads((each / "parts" / path.name).read_text()) for each in (out, tmp_path)
        )
        assert (one["key"], one["part"]) == (other["key"], other["part"])


def row(rng, goals: float) -> Row:
    """A setup whose search is `tried`, with so many goals more."""
    found = tried(rng, 50, 60)
    searches = {
        m: {"towards": e, "achieved": a + goals, "minutes": minutes}
        for m, e, a, minutes in zip(
            found.margins_m, found.events, found.achieved, found.minutes, strict=True
        )
    }
    fresh = {"towards": found.fresh_events, "achieved": found.fresh_achieved + goals,
             "minutes": found.fresh_minutes, "walk": list(range(60))}  # fmt: skip
    names = ("standing", "away", "cost", "contacts_rated", "contacts_above_limit")
    nothing = dict.fromkeys(names, np.zeros(60))
    return Row(searches, found.fresh_margin_m, {**fresh, **nothing})


def test_contrasts_have_p_values_that_are_adjusted_for_their_number():
    """A setup that equals the reference but for luck differs from it in no mark."""
    more = {"truth": 1.0, "particle": 0.6, "one_camera": 0.0}
    rows = {name: row(np.random.default_rng(0), goals) for name, goals in more.items()}
    rows["two_cameras"] = row(np.random.default_rng(1), 0.6)
    alone = {"HRCReach-v0": rows["truth"].fresh}
    found = compute_metrics(Played({"HRCReach-v0": rows}, alone, {}), 30.0)
    names = ("truth", "one_camera", "two_cameras")
    single, adjusted = (
        np.array([found[f"{p}.worth.{name}"].value for name in names]) for p in ("p", "p_holm")
    )
    assert (single[:2] == 2 / (N_DRAWS + 1)).all()
    assert single[2] > 0.05
    np.testing.assert_allclose(adjusted[:2], 3 * single[:2])
    assert found["p_holm.worth.truth"].n == 3


def test_setups_are_compared_draw_by_draw():
    more = {"truth": 1.0, "particle": 0.6, "one_camera": 0.0}
    rows = {name: row(np.random.default_rng(0), goals) for name, goals in more.items()}
    alone = {"HRCReach-v0": rows["truth"].fresh}
    found = compute_metrics(Played({"HRCReach-v0": rows}, alone, {}), 30.0)
    assert found["HRCReach-v0.ranking"].value == 1.0
    assert 0 < found["worth.truth"].low < found["worth.truth"].high
    shares = [found[f"HRCReach-v0.{name}.share"] for name in ("particle", "one_camera")]
    worth = found["worth.one_camera"]
    assert worth.value == pytest.approx(shares[0].value - shares[1].value)
    assert worth.high - worth.low < shares[0].high - shares[0].low  # what is shared goes out


def test_a_search_goes_on_where_fresh_seeds_say_so(tmp_path, monkeypatch):
    """With the search's seeds nobody is ever touched; with the fresh ones everybody is."""

    def play(stage, seeds, margin_m, tick):
        touched = float(seeds[0] == experiment.FIRST_FRESH or margin_m < -0.7)
        one = {"minutes": 1.0, "achieved": 1.0, "towards": touched, "walk": 0}
        return {name: [value] * len(seeds) for name, value in one.items()}

    monkeypatch.setattr(EpisodeRunner, "play", play)
    cache, alone = PartCache(tmp_path, "", 1, silent), {"walk": [0] * TINY.n_fresh}
    (setup,) = find_setups(["truth"])
    margin_search = experiment.search_margin(TINY, "HRCReach-v0", setup, alone)
    (row,) = run_together([margin_search], cache.make_parts)
    assert sorted(row.searched) == pytest.approx([-0.8, -0.4, 0.0, 0.4, 0.45, 0.55, 0.75])
    assert row.ends_at(row.evaluate(30.0)[0, 0])
    assert row.margin_m == pytest.approx(0.75)  # what is achieved at the end is played there


def test_workers_who_walk_otherwise_are_noticed_where_nobody_waits():
    one = row(np.random.default_rng(0), 0.0)
    other = {**one.fresh, "walk": [0]}
    check_walks("HRCHandover-v0", other, one)
    with pytest.raises(HRCError, match="moved differently"):
        check_walks("HRCReach-v0", other, one)


def test_the_best_setups_stand_above():
    metrics = {
        f"HRCReach-v0.{name}.share": Metric(k / 10, k / 10, k / 10, "share", 1)
        for k, name in enumerate(("truth", "one_camera", "particle"))
    }
    setups = find_setups(["truth", "particle", "one_camera"])
    shown = choose_bars(metrics, "HRCReach-v0", setups)
    assert [each.name for each in shown] == ["truth", "one_camera", "particle"]


def test_ones_own_robot_has_a_price(tmp_path):
    """One that does not move needs no margin, and has nothing to lose."""
    config = replace(TINY, driver=Driver("random"), n_steps=8)
    metrics = run_experiment(config, tmp_path, silent)
    assert metrics["HRCReach-v0.unshielded.goals_per_min"].value == 0
    text = (tmp_path / "report.md").read_text()
    assert "the robot that the agent `random` drives" in text
    assert "Quick run, 5 seeds of 0.32 s: too few seeds for intervals" in text
    settings = json.loads((tmp_path / "results.json").read_text())["config"]
    assert settings["agent"] == "random"


def test_one_robot_has_a_price_at_a_time(tmp_path, monkeypatch):
    with pytest.raises(
        ConfigError,
        match="The study compares perception setups for a single robot, got --robots random s",
    ):
        make_experiment(robots=["random", "scripted"])
    alone = make_experiment(robots=["random"], control="tool", task="HRCHandover-v0")
    assert alone.others == ()
    assert alone.driver.env_arguments == {"control": "tool"}
    monkeypatch.delitem(experts.EXPERTS, "HRCHandover-v0")
    make_experiment(robots=["random"], task="HRCHandover-v0")  # nobody has scripted it


def test_the_usual_robot_changes_no_key():
    assert Driver().settings() == {}
    assert "driver" not in TINY.settings()
