"""The impact experiment: only perception is exchanged, and what is counted is the truth."""

import hashlib
import json
import signal
from dataclasses import replace

import numpy as np
import pytest

from docs import tables
from hrc_env.agents import policies as kept
from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.core.mapping import for_json
from hrc_env.core.results import Metric
from hrc_env.evaluation.counts import GAPS_M, Bins
from hrc_env.evaluation.intervals import estimate_binned_quantile
from hrc_env.experiments.agents import label_agent, label_agents
from hrc_env.experiments.cache import PartCache
from hrc_env.experiments.impact import policies
from hrc_env.experiments.impact.episodes import STEP, play, sum_episodes
from hrc_env.experiments.impact.experiment import Impact, check_walks, make_experiment
from hrc_env.experiments.impact.metrics import COMPARED, compute_metrics, find_margin
from hrc_env.experiments.impact.policies import Policy, get_maker, train_once
from hrc_env.experiments.impact.report import has_learnt, make_report
from hrc_env.experiments.price.experiment import make_experiment as make_price
from hrc_env.experiments.runner import run_experiment
from hrc_env.experiments.setups import (
    REFERENCE,
    PerceptionSetup,
    find_setup,
    list_setups,
)
from hrc_env.experiments.stage import Stage
from hrc_env.safety.incidents import KINDS

LATE = PerceptionSetup(latency_s=0.12).name
TINY = Impact(
    n_seeds=2,
    n_steps=12,
    policies=("scripted", "scripted_slowed"),
    setups=("truth", "none", REFERENCE, PerceptionSetup(n_cameras=1).name, LATE),
    margins_m=(0.1,),
)


CONDITIONS = TINY.conditions


def silent(share, label):
    """Say nothing."""


def sums(*steps, margin_m=0.0):
    """What steps (true gap, believed gap, robot's speed, touching) of one episode come to."""
    played, touching = np.zeros((len(steps), 1), STEP), np.array(steps, float)[:, 3:]
    for k, name in enumerate(("true_separation_m", "believed_separation_m", "robot_mps")):
        played[name] = np.array(steps, float)[:, k : k + 1]
    info = {"safety/min_separation_m": np.array([0.5])}
    info |= {f"task/goals_{what}": np.zeros(1) for what in ("reached", "missed")}
    info |= {f"safety/contacts_{how}": np.zeros(1) for how in KINDS}
    info |= {f"safety/contact_{what}": np.zeros(1) for what in ("severity", "force_ratio")}
    infos = [info | {"cost": touch} for touch in touching]
    return {name: value[0] for name, value in sum_episodes(played, infos, margin_m, 0.04).items()}


@pytest.fixture(scope="module")
def end_to_end(tmp_path_factory):
    """A run from beginning to end: its folder and its numbers."""
    out = tmp_path_factory.mktemp("impact")
    return out, run_experiment(TINY, out, silent)


def test_eyes_are_called_what_they_are():
    assert PerceptionSetup(estimator="paper").name == "keypoints_paper_4cam_0ms"
    assert find_setup("keypoints_particle_1cam_120ms").latency_s == 0.12
    assert all(setup.name == name for name, setup in list_setups().items())
    with pytest.raises(ConfigError, match="Did you mean 'keypoints_paper_4cam_0ms'"):
        find_setup("keypoints_papers_4cam_0ms")


def test_cameras_that_are_left_come_after_a_second_of_four():
    (lost,) = PerceptionSetup(n_cameras=1).turns[1].faults
    assert lost.cameras == ("camera_1", "camera_3", "camera_4")
    assert lost.start_s == 1.0
    assert not PerceptionSetup(n_cameras=1, is_alone=True).turns[1].faults


def test_only_eyes_that_are_told_their_delay_have_cameras_that_say_it():
    (told,), (untold,) = (
        PerceptionSetup(latency_s=0.2, is_told=how).turns for how in (True, False)
    )
    assert [camera.latency_s for camera in told.cameras] == [0.2] * 4
    assert [camera.latency_s for camera in untold.cameras] == [0.0] * 4
    assert [(fault.kind, fault.amount) for fault in untold.faults] == [("out_of_step", 5.0)]
    assert not told.faults


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"n_seeds": 0}, "--seeds must be at least 1"),
        ({"policies": ("scripted_slow",)}, "Unknown policy"),
        ({"setups": ("truth",)}, "must contain the reference"),
        ({"setups": (REFERENCE, "camera_9")}, "Unknown perception setup"),
    ],
)
def test_what_cannot_be_played_is_refused(change, words):
    with pytest.raises(ConfigError, match=words):
        replace(TINY, **change)


def test_quick_plays_every_row_of_the_full_run():
    full, quick = make_experiment(), make_experiment(quick=True)
    assert (quick.setups, quick.policies) == (full.setups, full.policies)
    assert make_experiment(seeds=7).n_seeds == 7


def test_a_stop_is_missed_where_the_belief_is_too_hopeful():
    found = sums((0.05, 0.2, 0, 0), (0.2, 0.05, 0, 0), (0.05, 0.05, 0, 0))
    assert (found["called_stops"], found["missed_stops"], found["false_stops"]) == (2, 1, 1)
    assert (found["called_slowings"], found["missed_slowings"]) == (3, 0)


def test_a_margin_makes_up_for_hope():
    assert sums((0.05, 0.2, 0, 0), margin_m=0.15)["missed_stops"] == 0


def test_a_worker_whom_the_robot_knows_nothing_of_is_a_missed_stop():
    assert sums((0.05, np.inf, 0, 0))["missed_stops"] == 1


def test_cost_is_split_by_whether_the_robot_moves_towards_the_worker():
    found = sums((0.0, 0.0, 0.3, 1), (0.0, 0.0, -0.3, 1), (0.0, 0.0, 0.0, 1), (0.5, 0.5, 0.3, 0))
    assert (found["cost"], found["cost_towards"]) == (3, 1)


def test_quantiles_of_bins_are_those_of_the_values():
    rng = np.random.default_rng(0)
    values = rng.normal(0.2, 0.1, (40, 500))
    found = estimate_binned_quantile(GAPS_M, GAPS_M.count(values).tolist(), 0.95, "m")
    assert found.value == pytest.approx(np.quantile(values, 0.95), abs=0.002)
    assert found.low < found.value < found.high


def test_values_that_do_not_count_are_in_no_bin():
    bins = Bins(np.array([0.0, 1.0]))
    counts = bins.count(np.array([[-1.0, 0.5, 9.0]]), np.array([[True, True, False]]))
    assert counts.tolist() == [[1, 1, 0]]


def test_the_margin_is_where_no_more_stops_are_missed_than_on_time():
    def row(missed):
        return {"missed_stops": [missed] * 5, "called_stops": [10] * 5, "walk": [""] * 5}

    margin = find_margin([row(6), row(2), row(0)], np.array([0.0, 0.1, 0.2]), row(3))
    assert margin.value == pytest.approx(0.075)
    assert find_margin([row(2), row(1)], np.array([0.0, 0.1]), row(3)).value == 0.0
    assert find_margin([row(6), row(5)], np.array([0.0, 0.1]), row(3)).value == 0.1


def test_every_row_says_everything(end_to_end):
    out, metrics = end_to_end
    keys = ("separation_min_m", "contacts_towards", "contacts_fleeing", "contacts_standing",
            "cost", "cost_towards", "goals_per_min", "missed_stops", "false_stops", "z_d_m",
            "tax_m")  # fmt: skip
    for policy in TINY.policies:
        for setup in TINY.setups:
            for key in keys:
                assert np.isfinite(metrics[f"{policy}.{setup}.{key}"].value), (policy, setup, key)
            assert f"{policy}.{setup}.above_force_limit" in metrics
            assert f"{policy}.{setup}.interventions" not in metrics  # there is no shield
    for policy in TINY.policies:
        for what in (*COMPARED, "z_d_m"):
            less, ours, theirs = (
                metrics[f"{name}.{what}"].value
                for name in (
                    f"difference.{policy}.truth",
                    f"{policy}.truth",
                    f"{policy}.{REFERENCE}",
                )
            )
            if what != "separation_min_m":  # which rows give as a mean of the middle half
                assert less == pytest.approx(ours - theirs, abs=1e-9)
            for p in ("p", "p_holm"):  # of two seeds
                assert np.isnan(metrics[f"{p}.{policy}.truth.{what}"].value)
    written = json.loads((out / "results.json").read_text())
    assert set(written["metrics"]) == set(metrics)
    asked = tables.asked("impact") | tables.asked("lateness")
    asked = {name for name in asked if name.split(".")[-2] in TINY.setups and "ppo" not in name}
    assert len(asked) > 20
    assert asked <= metrics.keys()
    assert written["seeds"] == [1_000_000, 1_000_001]


def test_the_report_holds_its_picture_and_every_table(end_to_end):
    out, _ = end_to_end
    page, text = ((out / f"report.{kind}").read_text() for kind in ("html", "md"))
    assert page.count("data:image/png;base64,") == 1
    assert text.count("\n|---") == 2 * len(TINY.policies) + 1
    assert "nan" not in text


def test_the_truth_has_no_error_and_lateness_a_tax(end_to_end):
    _, metrics = end_to_end
    assert metrics["scripted.truth.z_d_m"].value < 1e-3
    late, on_time = metrics[f"scripted.{LATE}.tax_m"], metrics[f"scripted.{REFERENCE}.z_d_m"]
    assert late.value >= on_time.value + 0.12 * 1.6 - 1e-9


def test_workers_who_walk_otherwise_are_noticed():
    table = {("scripted", "truth"): {"walk": ["a", "b"]}, ("scripted", "none"): {"walk": ["a"]}}
    check_walks(table)
    with pytest.raises(HRCError, match="moved differently"):
        check_walks(table | {("ppo", "none"): {"walk": ["b"]}})


def test_an_environment_that_is_used_again_starts_afresh():
    setup = find_setup(LATE)
    stage = Stage(setup, setup.turns, {})
    make = get_maker(Policy("scripted_slowed"), None)
    first, again = (play(stage, [5, 6], 10, make, 0.0, lambda share: None) for _ in range(2))
    stage.close()
    assert first == again


def test_a_run_that_is_killed_goes_on_to_the_same_numbers(end_to_end, process, tmp_path):
    _, metrics = end_to_end
    script = (
        "import os, sys; from pathlib import Path; "
        "from hrc_env.experiments.impact.experiment import Impact\n"
        "from hrc_env.experiments.runner import run_experiment\n"
        f"config = {TINY!r}\n"
        "def say(share, label):\n"
        f"    if label == 'scripted.{REFERENCE}': os.kill(os.getpid(), 9)\n"
        "run_experiment(config, Path(sys.argv[1]), say)"
    )
    killed = process("-c", script, tmp_path)
    assert killed.returncode == -signal.SIGKILL
    kept = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "parts").iterdir()}
    assert len(kept) == 4  # truth and none, two policies each
    assert not (tmp_path / "results.json").exists()
    resumed = run_experiment(TINY, tmp_path, silent)
    np.testing.assert_equal(for_json(resumed, "resumed"), for_json(metrics, "metrics"))
    for name, time_ns in kept.items():
        assert (tmp_path / "parts" / name).stat().st_mtime_ns == time_ns


def test_a_policy_is_learnt_once_and_again_only_if_its_file_is_lost(tmp_path, monkeypatch):
    learnt = []

    def learn(n_steps, path, tick, task):
        learnt.append(1)
        path.write_bytes(b"policy")
        return {"sha256": hashlib.sha256(b"policy").hexdigest()}

    monkeypatch.setattr(policies, "learn_ppo", learn)
    cache, path = PartCache(tmp_path, "here", 1, silent), tmp_path / "ppo.zip"
    digests = {train_once(cache, 1, path, "key") for _ in range(2)}
    assert len(learnt) == 1
    path.write_bytes(b"half")
    assert digests == {train_once(cache, 1, path, "key")}
    assert path.read_bytes() == b"policy"
    assert len(learnt) == 2


def test_a_report_is_made_without_the_policy_that_yields(end_to_end, tmp_path):
    _, metrics = end_to_end
    config = replace(TINY, policies=("scripted",), setups=("truth", REFERENCE))
    table = config.play(PartCache(tmp_path / "parts", "", 1, silent))
    found = make_report(tmp_path / "figures", table, metrics, {"scripted": "scripted"}, CONDITIONS)
    assert (tmp_path / "figures" / "tradeoff.png").exists()
    assert "scripted_slowed" not in str(found.parts[1])


def metric(value: float, low: float = 0.0) -> Metric:
    return Metric(value, low, 2 * value, "1/min", 8)


@pytest.mark.parametrize(
    ("ppo", "others", "expected"),
    [
        ((5.0, 3.0), {"scripted": 48.0}, False),
        ((12.0, 3.0), {"scripted": 48.0}, True),
        ((12.0, 3.0), {"scripted": 20.0, "mine": 60.0}, False),
        ((0.1, 0.0), {}, False),
        ((9.0, 4.0), {}, True),
        ((0.0, 0.0), {"mine": 0.0}, False),
    ],
)
def test_a_policy_has_learnt_if_it_does_something(ppo, others, expected):
    found = {"ppo": metric(*ppo), **{name: metric(value) for name, value in others.items()}}
    metrics = {f"{name}.{REFERENCE}.goals_per_min": each for name, each in found.items()}
    assert has_learnt(metrics, list(found)) == expected


def played(goals: dict[str, float], n: int = 3) -> dict[tuple[str, str], dict[str, list]]:
    """Episodes of robots that reach so many goals each, with two setups."""
    table = {}
    for policy, reached in goals.items():
        for name in (REFERENCE, "truth"):
            episode = sums((0.3, 0.3, 0.1, 0.0), (0.2, 0.2, 0.1, 0.0))
            episode |= {"walk": "", "goals": reached}
            table[policy, name] = {what: [each] * n for what, each in episode.items()}
    return table


def test_a_policy_that_did_not_learn_is_left_out_and_named(tmp_path):
    table = played({"scripted": 5.0, "ppo": 0.0})
    metrics = compute_metrics(table, ())
    robots = {"scripted": "scripted", "ppo": "ppo"}
    found = make_report(tmp_path / "figures", table, metrics, robots, CONDITIONS)
    assert "`ppo` did not learn its task (0.0 goals per minute" in found.question
    assert not any("| ppo" in part for part in found.parts)
    alone = make_report(
        tmp_path / "figures", played({"ppo": 0.0}), metrics, {"ppo": "ppo"}, CONDITIONS
    )
    assert alone.parts == ()
    both = played({"scripted": 5.0, "ppo": 4.0})
    metrics = compute_metrics(both, ())
    learnt = make_report(tmp_path / "figures", both, metrics, robots, CONDITIONS)
    assert "did not learn" not in learnt.question


def test_nothing_empty_is_printed_of_one_setup_and_one_robot(tmp_path):
    table = {key: row for key, row in played({"scripted": 5.0}).items() if key[1] == REFERENCE}
    found = make_report(
        tmp_path / "figures",
        table,
        compute_metrics(table, ()),
        {"scripted": "scripted"},
        CONDITIONS,
    )
    assert len(found.parts) == 2
    assert "paired" not in "".join(found.parts[1:])
    assert all(found.parts)


OWN = """
import numpy as np


class Still:
    def __init__(self, info):
        self.n = info.n_actions

    def act(self, observation):
        return np.zeros((*observation.shape[:-1], self.n), np.float32)


def make(info):
    return Still(info)
"""


def test_ones_own_robot_is_played_and_nothing_learns(tmp_path, monkeypatch):
    (tmp_path / "still_robots.py").write_text(OWN)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(policies, "learn_ppo", None)
    config = replace(
        make_experiment(quick=True, seeds=2, robots=["still_robots:make", "random"]),
        n_steps=8, setups=("truth", REFERENCE),
    )  # fmt: skip
    assert config.policies == ("still_robots:make", "random")
    out = tmp_path / "out"
    metrics = run_experiment(config, out, silent)
    assert metrics[f"still_robots-make.{REFERENCE}.goals_per_min"].value == 0
    assert len(list((out / "parts").iterdir())) == 4
    text = (out / "report.md").read_text()
    assert "`still_robots-make` is the agent `still_robots:make`" in text
    assert "learnt" not in text
    before = {path: path.stat().st_mtime_ns for path in (out / "parts").iterdir()}
    (tmp_path / "still_robots.py").write_text(OWN + "\n# changed\n")
    run_experiment(config, out, silent)
    anew = {path.name for path, t in before.items() if path.stat().st_mtime_ns != t}
    assert anew == {path.name for path in before if path.name.startswith("still")}


def test_robots_by_their_file_act_as_they_learnt_to(tmp_path):
    name = next(each for each in kept.list_names() if each.startswith("hrc://HRCReach-v0/"))
    config = replace(
        make_experiment(quick=True, seeds=1, robots=[name], control="twist"),
        n_steps=4, setups=("none", REFERENCE),
    )  # fmt: skip
    metrics = run_experiment(config, tmp_path, silent)
    assert f"{label_agent(name, {})}.none.cost" in metrics


@pytest.mark.parametrize(
    ("robots", "said"),
    [
        (["scriptde"], "Unknown policy 'scriptde'. Did you mean 'scripted'"),
        (["nowhere:make"], "There is no agent 'nowhere:make'"),
        (["none.zip"], "Unknown agent 'none.zip'"),
        (["."], "is a folder"),
    ],
)
def test_robots_that_there_are_not_are_refused_before_anything_is_played(robots, said):
    for make in (make_experiment, make_price):
        if make is make_price and ":" not in robots[0] and "." not in robots[0]:
            continue
        with pytest.raises(ConfigError, match=said):
            make(robots=robots)


def test_names_of_robots_are_told_apart():
    assert label_agent("runs/a/policy.zip", {}) == "runs-a-policy"
    assert label_agent("ppo.zip", {"ppo": ""}) == "own-ppo"
    assert label_agents(["scripted", "m:f", "m:f"], {"scripted": ""}) == {
        "scripted": "scripted", "m-f": "m:f",
    }  # fmt: skip
    with pytest.raises(ConfigError, match="would both be named 'a-b'"):
        label_agents(["a/b.zip", "a:b"], {})


def test_a_quick_run_says_so_and_marks_nothing(tmp_path):
    assert not make_experiment().is_quick
    for quick in (
        make_experiment(quick=True),
        make_experiment(quick=True, seeds=90),
        make_experiment(seeds=8),
    ):
        assert quick.is_quick
    config = replace(
        make_experiment(quick=True),
        n_seeds=8,
        policies=("scripted_slowed",),
        setups=("truth", REFERENCE),
    )
    table = {}
    for name, reached in ((REFERENCE, 1.0), ("truth", 9.0)):
        episode = sums((0.3, 0.3, 0.1, 0.0), (0.2, 0.2, 0.1, 0.0)) | {"walk": "", "goals": reached}
        table["scripted_slowed", name] = {what: [each] * 8 for what, each in episode.items()}
    metrics = compute_metrics(table, ())
    difference = "scripted_slowed.truth.goals_per_min"
    assert metrics[f"difference.{difference}"].low > 0
    assert metrics[f"p.{difference}"].value == 2 / 2**8
    assert metrics[f"p_holm.{difference}"].value == 11 * 2 / 2**8  # of eleven contrasts
    metrics |= {f"p_holm.{difference}": Metric(0.01, 0.01, 0.01, "p", 11)}
    found = config.report(table, metrics, tmp_path / "figures")
    replace(found, quick=config.quick_note).write(tmp_path, {}, [0], metrics)
    for page in ("report.md", "report.html"):
        text = (tmp_path / page).read_text()
        assert "This run was quick: 8 episodes of 4 s per row" in text
        assert "not enough to compare estimators" in text
        assert "●" not in text
        assert "A dot" not in text
        assert text.count("Quick run, 8 seeds of 4 s: too few") == 4  # above, a figure, two tables
    whole = make_experiment().report(table, metrics, tmp_path / "figures")
    assert "quick" not in whole.title + whole.question
    assert "●" in str(whole.parts)


def test_an_estimator_that_a_file_registers_is_compared(tmp_path, process, brought):
    """One command, one file."""
    config = replace(
        make_experiment(True, 2, ["dlt_kalman"]),
        n_steps=12,
        policies=("scripted_slowed",),
        margins_m=(),
    )
    metrics = run_experiment(config, tmp_path, silent)
    assert "scripted_slowed.keypoints_dlt_kalman_4cam_0ms.cost" in metrics
    assert (tmp_path / "figures").is_dir()
