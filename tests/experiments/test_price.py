"""What sight leaves at stated rates of contacts: halving, true bodies, metrics, what is written."""

import json
import signal
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from hrc_env.agents import experts
from hrc_env.core.errors import ConfigError, HRCError
from hrc_env.core.typing import Floats
from hrc_env.engines.local import Processes
from hrc_env.evaluation.intervals import MIN_SEEDS
from hrc_env.experiments.cache import PartCache
from hrc_env.experiments.price import declaration, true_bodies
from hrc_env.experiments.price.episodes import STEP, Driver, play_episodes, sum_episodes
from hrc_env.experiments.price.experiment import (
    CHOOSING,
    CHOOSING_SEED,
    PROOF,
    PROOF_SEED,
    Price,
    check_walks,
    make_experiment,
    replay,
)
from hrc_env.experiments.price.halving import (
    Best,
    Status,
    Tally,
    count_permitted,
    find_best,
    keep_settings,
)
from hrc_env.experiments.price.metrics import CONTRASTS, Played, compute_metrics, find_bests, tally
from hrc_env.experiments.price.settings import UNSHIELDED, list_settings
from hrc_env.experiments.price.setups import QUICK, Family, find_setups, list_setups
from hrc_env.experiments.price.true_bodies import TrueBodyShield, read_true_bodies
from hrc_env.experiments.runner import run_experiment
from hrc_env.motion import generator
from hrc_env.safety.config import ShieldConfig
from hrc_env.settings import resolve_settings
from hrc_env.simulation import Simulation
from hrc_env.worker.body import worker_truth

TINY = Price(
    setups=("true_capsules", "two_cameras"), n_settings=2, n_choosing=8, n_kept=1, n_proof=12,
    n_together=8, n_steps=50, choosing_seed=21_000_000, proof_seed=22_000_000,
)  # fmt: skip
HOURS = 4000 * 10 / 3600
"""Duration of the episodes of one setting on the proof seeds [h]."""


def silent(share, label):
    """Say nothing."""


@pytest.fixture(scope="module")
def end_to_end(tmp_path_factory):
    """A run from beginning to end: its folder and its numbers."""
    out = tmp_path_factory.mktemp("price")
    return out, run_experiment(TINY, out, silent)


def draw_tallies(rng: np.random.Generator, rates: Floats, goals: Floats, n: int):
    """Tallies of settings with known rates [1/h] and goals [1/min] after so many episodes."""
    hours = n * 10 / 3600
    contacts = rng.poisson(rates * hours)
    noise = rng.normal(0, 4 / np.sqrt(n), len(rates))
    return {
        str(k): Tally(int(count), hours, float(goal))
        for k, (count, goal) in enumerate(zip(contacts, goals + noise, strict=True))
    }


RATES = np.array([231.0, 60.0, 30.0, 18.0, 9.0, 5.0, 3.0, 1.5, 0.5, 0.2, 0.1, 0.05])
GOALS = np.linspace(47.0, 36.0, 12)
"""A synthetic frontier: contacts an hour, and the goals a minute that fall with them."""


def test_halving_keeps_the_best_and_finds_it():
    """At ten an hour the sixth setting is the best that can be proved, at one an hour the ninth.

    Two goals less are as good as the choosing seeds can tell.
    """
    rng, found = np.random.default_rng(0), {1.0: [], 10.0: []}
    for _ in range(200):
        chosen = draw_tallies(rng, RATES, GOALS, 500)
        kept = keep_settings(chosen, (1.0, 10.0), 3, HOURS)
        assert len(set(kept)) == 3
        proved = draw_tallies(rng, RATES, GOALS, 4000)
        for level, bests in found.items():
            bests.append(find_best(chosen, {name: proved[name] for name in kept}, level))
    for level, best in ((10.0, {"5", "6", "7"}), (1.0, {"8", "9", "10"})):
        assert np.mean([each.setting in best for each in found[level]]) > 0.9
        false = [each.status is Status.SHOWN and RATES[int(each.setting or 0)] > level
                 for each in found[level]]  # fmt: skip
        assert np.mean(false) <= 0.025


def test_the_level_that_is_hard_to_prove_has_two_of_three_places():
    chosen = {
        "fast": Tally(200, HOURS, 47.0), "lax": Tally(60, HOURS, 44.0),
        "strict": Tally(3, HOURS, 42.0), "stricter": Tally(0, HOURS, 40.0),
        "slow": Tally(0, HOURS, 20.0),
    }  # fmt: skip
    assert keep_settings(chosen, (10.0, 1.0), 3, HOURS) == ("stricter", "lax", "strict")
    assert keep_settings(chosen, (10.0, 1.0), 9, HOURS) == (
        *keep_settings(chosen, (1.0, 10.0), 5, HOURS),
    )


def test_a_fast_robot_without_a_shield_is_the_best_where_it_touches_nobody():
    chosen = {UNSHIELDED: Tally(0, HOURS, 9.4), "default": Tally(0, HOURS, 3.8)}
    assert keep_settings(chosen, (1.0,), 1, HOURS) == (UNSHIELDED,)
    assert find_best(chosen, chosen, 1.0) == Best(UNSHIELDED, Status.SHOWN)


def test_the_proof_seeds_decide_only_whether_a_level_is_met():
    """Goals on the proof seeds, however many, change neither order nor preference."""
    chosen = {"a": Tally(0, HOURS, 40.0), "b": Tally(0, HOURS, 41.0)}
    proved = {"a": Tally(0, HOURS, 90.0), "b": Tally(0, HOURS, 1.0)}
    assert find_best(chosen, proved, 1.0) == Best("b", Status.SHOWN)


def test_the_examination_ends_with_the_first_setting_that_fails():
    """Otherwise one of several settings would pass by chance more often than one alone."""
    chosen = {"first": Tally(0, HOURS, 40.0), "second": Tally(9, HOURS, 41.0)}
    proved = {"first": Tally(6, HOURS, 40.0), "second": Tally(0, HOURS, 41.0)}
    assert find_best(chosen, proved, 1.0) == Best("second", Status.ESTIMATED)


@pytest.mark.parametrize(
    ("contacts", "status"),
    [(4, Status.SHOWN), (5, Status.ESTIMATED), (11, Status.ESTIMATED), (12, Status.MISSED)],
)
def test_a_level_is_met_if_its_exact_interval_says_so(contacts, status):
    one = {"a": Tally(contacts, HOURS, 40.0)}
    assert find_best(one, one, 1.0) == Best(None if status is Status.MISSED else "a", status)


def test_permitted_counts_are_those_of_the_exact_interval():
    assert [count_permitted(level, HOURS) for level in (0.1, 1.0, 10.0)] == [-1, 4, 90]
    for level in (1.0, 10.0):
        most = count_permitted(level, HOURS)
        rates = [Tally(k, HOURS, 1.0).max_rate_per_hour for k in (most, most + 1)]
        assert rates[0] <= level < rates[1]


def test_the_chance_of_a_proof_is_predicted():
    """Of rates drawn from what three contacts say, as many lead to a proof."""
    rng, hours = np.random.default_rng(0), 500 * 10 / 3600
    rates = rng.gamma(3.5, 1 / hours, 200_000)
    passed = rng.poisson(rates * HOURS) <= count_permitted(2.0, HOURS)
    predicted = Tally(3, hours, 1.0).predict_success(2.0, HOURS)
    assert predicted == pytest.approx(passed.mean(), abs=5e-3)


def test_a_tally_needs_time():
    with pytest.raises(ConfigError, match=r"got 1 in 0.0 h"):
        Tally(1, 0.0, 1.0)


def make_rows(contacts: int, goals: float, n: int = 40, seed: int = 0) -> dict[str, list[float]]:
    """Sums of episodes of 10 s with so many contacts in all, and goals that vary with the seed."""
    rng = np.random.default_rng(seed)
    touched = np.zeros(n)
    touched[:contacts] = 1
    zeros = dict.fromkeys(("standing", "away", "cost"), [0.0] * n)
    return {
        "minutes": [1 / 6] * n, "achieved": list(goals + rng.normal(0, 1, n)),
        "towards": list(touched), "contacts_rated": list(touched),
        "contacts_above_limit": [0.0] * n, "walk": list(range(n)), **zeros,
    }  # fmt: skip


def test_a_missed_level_has_no_number_and_is_said():
    rows = {UNSHIELDED: make_rows(40, 8.0), "default": make_rows(30, 7.0)}
    few = {UNSHIELDED: make_rows(40, 8.0), "default": make_rows(0, 7.5)}
    table = {"four_cameras": rows, "truth": few}
    played = Played(table, table, make_rows(40, 8.0))
    metrics = compute_metrics(played, (1.0, 10.0))
    assert np.isnan(metrics["at_1.four_cameras.none.missed.share"].value)
    assert not any(name.startswith("at_1.four_cameras.none.missed.to") for name in metrics)
    assert metrics["at_1.truth.default.estimated.towards"].value == 0
    assert metrics["at_1.truth.default.estimated.towards"].high > 30  # Garwood, of .11 h
    assert not any(name.startswith("worth.") for name in metrics)  # one of each pair is missing
    shown = declaration.make_best_table(find_setups(table), (1.0, 10.0)).to_markdown(metrics)
    assert "| 1 | four cameras | - | not met | - | - |" in shown
    assert "| 10 | true joints | default | estimated | " in shown


def test_contrasts_are_paired_and_adjusted_for_their_number():
    """Setups that equal each other but for their seeds' luck differ in no mark."""
    goals = {"true_capsules": 8.0, "truth": 7.4, "four_cameras": 7.4, "two_cameras": 5.0}
    rows = {
        name: {"default": make_rows(0, value, seed=int(name == "four_cameras"))}
        for name, value in goals.items()
    }
    metrics = compute_metrics(Played(rows, rows, make_rows(0, 8.0)), (1.0,))
    body = metrics["worth.at_1.body"]
    share = metrics["true_capsules.default.share"]
    assert share.value == share.low == share.high == 1.0  # the same episodes as the reference
    assert body.value == pytest.approx(share.value - metrics["truth.default.share"].value)
    assert body.low == pytest.approx(body.high, abs=0.01)  # the luck of seeds goes out
    assert metrics["p.worth.at_1.sight"].value > 0.05
    assert metrics["p_holm.worth.at_1.body"].n == 4  # those with both setups
    smallest = metrics["p.worth.at_1.body"].value
    assert metrics["p_holm.worth.at_1.body"].value == pytest.approx(4 * smallest)


def test_below_eight_seeds_nothing_has_an_interval_but_counts():
    few = MIN_SEEDS - 1
    rows = {name: {"default": make_rows(0, 7.0, few)} for name in ("true_capsules", "truth")}
    metrics = compute_metrics(Played(rows, rows, make_rows(1, 8.0, few)), (1.0,))
    for name in ("truth.default.share", "worth.at_1.body"):
        assert np.isnan([metrics[name].low, metrics[name].high]).all()
    assert np.isnan(metrics["p_holm.worth.at_1.body"].value)
    assert metrics["truth.default.towards"].high > 0


def make_simulation(seed: int = 0, **given) -> Simulation:
    """A simulation of one environment with true joints, in which an episode begins."""
    part = Simulation(1, resolve_settings(perception="truth", **given))
    part.reset(np.zeros(1, int), [np.random.default_rng(seed)])
    return part


EXACT = list_settings("exact")["default"].shield
assert EXACT is not None
STILL = replace(EXACT, worker_time_s=0.0, margin_m=3.0, hand_margin_m=3.0)
"""The same without anticipation, and with a margin that makes distant workers count."""


def clearance_m(part: Simulation, shield) -> float:
    """What a shield believes to be the smallest clearance now."""
    now = part.belief
    return float(shield(now, np.zeros((1, 6)), 0.04)[1]["clearance_m"][0])


def test_the_first_row_acts_on_true_capsules_and_on_nothing_else():
    """Bodies that are 7 cm thicker are 7 cm nearer, whatever is believed of their joints."""
    part = make_simulation()
    for _ in range(30):
        part.step(np.zeros((1, 6)))
    shield = TrueBodyShield(part, STILL)
    true_m = float(part.separation_m[0].min()) - 3.0
    assert clearance_m(part, shield) == pytest.approx(true_m, abs=2e-3)  # of a substep's motion
    before_m = clearance_m(part, shield)
    part.bodies = replace(part.bodies, capsule_radius_m=part.bodies.capsule_radius_m + 0.07)
    assert clearance_m(part, shield) == pytest.approx(before_m - 0.07, abs=1e-9)
    now = part.belief
    moved = replace(now, estimate=replace(now.estimate, mean_world=now.estimate.mean_world + 0.3))
    found = shield(moved, np.zeros((1, 6)), 0.04)[1]["clearance_m"][0]
    assert found == pytest.approx(before_m - 0.07, abs=1e-9)
    part.close()


def test_a_shield_of_joints_believes_another_clearance():
    part = make_simulation()
    joints = resolve_settings(perception="truth", shield=STILL).shield
    assert abs(clearance_m(part, joints) - clearance_m(part, TrueBodyShield(part, STILL))) > 5e-3
    part.close()


def test_true_velocities_are_those_of_the_capsules():
    part = make_simulation()
    for _ in range(20):
        part.step(np.zeros((1, 6)))
    known = read_true_bodies(part)
    motion = generator.current(part.motion)
    step_s = 1e-5
    position = motion.position_world + step_s * motion.velocity_world
    turned = motion.quaternion_wxyz.copy()
    w, x, y, z = np.moveaxis(motion.quaternion_wxyz, -1, 0)
    a, b, c = 0.5 * step_s * np.moveaxis(motion.angular_velocity_world, -1, 0)
    turned += np.stack(
        [-a * x - b * y - c * z, a * w + b * z - c * y, b * w + c * x - a * z,
         c * w + a * y - b * x], axis=-1,
    )  # fmt: skip
    turned /= np.linalg.norm(turned, axis=-1, keepdims=True)
    later = worker_truth(
        part.bodies, replace(motion, position_world=position, quaternion_wxyz=turned)
    ).capsules_world
    measured = (later - known.capsules.ends_world) / step_s
    assert np.abs(known.velocity_world).max() > 0.05
    np.testing.assert_allclose(known.velocity_world, measured, atol=1e-4)
    part.close()


def test_episodes_of_the_first_row_are_played_with_true_capsules(monkeypatch):
    """If the study handed them estimated bodies, nobody would ask for the true ones."""
    asked = []

    def note(part):
        asked.append(part)
        return read_true_bodies(part)

    monkeypatch.setattr(true_bodies, "read_true_bodies", note)
    for name, times in (("true_capsules", 1), ("truth", 0)):
        asked.clear()
        (setup,) = find_setups([name])
        play_episodes(setup, EXACT, "HRCReach-v0", 5, Driver(), [1, 2], lambda share: None)
        assert bool(asked) == bool(times)
        asked.clear()
        play_episodes(setup, None, "HRCReach-v0", 5, Driver(), [1, 2], lambda share: None)
        assert asked == []


def count(n_steps: int = 20, **columns: Floats) -> dict[str, float]:
    """What one episode of such steps came to."""
    steps = np.zeros((n_steps, 1), STEP)
    for name, values in columns.items():
        steps[name][:, 0] = values
    return {name: values[0] for name, values in sum_episodes(steps, 0.04).items()}


def test_nothing_counts_after_the_end_of_an_episode():
    k = np.arange(20)
    found = count(over=k == 9, achieved=k, cost=np.ones(20), towards=k // 9, away=k // 12)
    assert [found[name] for name in ("achieved", "cost", "towards", "away")] == [9, 10, 1, 0]
    assert found["minutes"] == pytest.approx(10 * 0.04 / 60)


def test_setups_and_settings_are_what_their_names_say():
    known = list_setups()
    assert len(known) == 8
    assert set(QUICK) <= known.keys()
    assert {name for pair in CONTRASTS.values() for name in pair} <= known.keys()
    assert [name for name, each in known.items() if each.knows_bodies] == ["true_capsules"]
    assert {each.family for each in known.values()} == set(get_args(Family))
    for family in get_args(Family):
        settings = list_settings(family)
        assert len(settings) == len({repr(each.shield) for each in settings.values()}) == 12
        assert len({each.words for each in settings.values()}) == 12
        assert next(iter(settings)) == UNSHIELDED
    varied = [vars_of(each.shield) for each in list_settings("one camera").values() if each.shield]
    for name in ("margin_m", "unknown_speed_limit_m_s", "single_view_sigmas", "n_sigmas"):
        assert len({each[name] for each in varied}) > 1, name
    assert EXACT.min_uncertainty_m == EXACT.margin_m == 0.0
    sites = known["one_camera"].turns("site")
    assert sites[0].cameras != known["one_camera"].turns("lab")[0].cameras


def vars_of(shield: ShieldConfig) -> dict[str, object]:
    """The settings of a shield by name."""
    return {name: getattr(shield, name) for name in ShieldConfig.__dataclass_fields__}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"n_choosing": 0}, "n_choosing must be at least 1"),
        (
            {"setups": ("one_camara",)},
            "Unknown perception setup 'one_camara'. Did you mean 'one_camera'",
        ),
        ({"setups": ()}, "No perception setup to compare"),
        ({"levels_per_hour": (1.0, 0.0)}, "levels_per_hour must be different positive rates"),
        ({"levels_per_hour": (1.0, 1.0)}, "levels_per_hour must be different positive rates"),
        ({"n_together": 6}, "n_together must be a multiple of 4, got 6"),
        ({"proof_seed": 21_000_007}, "data on which a choice was made cannot prove it; 1 seeds"),
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
    assert (full.n_choosing, full.n_settings, full.n_kept, full.n_proof) == (500, 12, 3, 4000)
    assert full.levels_per_hour == (1.0, 10.0)
    assert (full.choosing_seed, full.proof_seed) == (CHOOSING_SEED, PROOF_SEED)
    assert full.n_parts == 8 * 12 * 1 + (8 * 3 + 1) * 8
    assert quick.setups == QUICK
    for short in (quick, make_experiment(seeds=3), make_experiment(seeds=499)):
        assert short.quick_note
        assert not set(short.seeds) & set(full.seeds)  # a preview uses up no proof
    elsewhere = make_experiment(task="HRCHandover-v0")
    assert len(elsewhere.choosing_seeds) == 167  # as much time
    assert make_experiment(setups=("truth", "truth")).setups == ("truth",)


def test_a_part_begins_with_the_first_choice_of_cameras():
    """Otherwise the cameras of an episode would depend on how episodes are split."""
    (setup,) = find_setups(["one_camera"])
    config = replace(TINY, setups=("one_camera",), n_steps=5, n_choosing=12)
    shield = list_settings("one camera")["default"]
    parts = config.make_parts(CHOOSING, setup, shield)
    assert [part.label for part in parts] == [
        f"one_camera.default.choosing.{seed}" for seed in (21_000_000, 21_000_008)
    ]
    split = [value for part in parts for value in part.make(lambda share: None)["cost"]]
    (whole,) = replace(config, n_together=12).make_parts(CHOOSING, setup, shield)
    assert whole.make(lambda share: None)["cost"] == split


def test_a_part_is_known_by_all_that_it_depends_on():
    """Otherwise a setting that was changed would keep its old episodes."""
    config = replace(TINY, setups=tuple(list_setups()), n_settings=12)
    keys = [
        part.key
        for setup in find_setups(config.setups)
        for setting in config.list_settings(setup).values()
        for role in (CHOOSING, PROOF)
        for part in config.make_parts(role, setup, setting)
    ]
    assert len(set(keys)) == len(keys) == 8 * 12 * 3


def test_every_row_says_everything(end_to_end):
    out, metrics = end_to_end
    for name in TINY.setups:
        (kept,) = {each.split(".")[1] for each in metrics if each.startswith(f"{name}.")}
        for what in ("share", "goals_per_min", "towards", "standing", "away", "contacts", "severe",
                     "above_force_limit", "cost"):  # fmt: skip
            assert f"{name}.{kept}.{what}" in metrics
        for setting in (UNSHIELDED, "default"):
            assert f"choosing.{name}.{setting}.towards" in metrics
        assert sum(each.startswith(f"at_1.{name}.") for each in metrics)
    assert metrics["unshielded.towards"].n == 12
    text = (out / "report.md").read_text()
    assert "21,000,000 to 21,000,007" in text  # choosing seeds
    assert "Played on seeds 22,000,000 to 22,000,011" in text
    assert "Quick run, 12 seeds of 2 s: too few for comparisons" in text
    assert "●" not in text
    for name in ("frontier", "severity"):
        assert (out / "figures" / f"{name}.png").exists()
    written = json.loads((out / "results.json").read_text())
    assert set(written["metrics"]) == set(metrics)
    assert written["config"]["shields"]["true_capsules"]["default"]["kind"] == "qp"


def test_settings_are_kept_without_a_look_at_the_proof_seeds(end_to_end, tmp_path, monkeypatch):
    """What is asked for on the proof seeds is known before one of them was played."""
    rounds: list[set[str]] = []
    make_parts = PartCache.make_parts

    def note(cache, parts, one_core=False):
        rounds.append({part.label.split(".")[2] for part in parts})
        return make_parts(cache, parts, one_core)

    monkeypatch.setattr(PartCache, "make_parts", note)
    out, _ = end_to_end
    cache = PartCache(out / "parts", "", TINY.n_parts, silent)
    played = TINY.play(cache)
    assert rounds == [{CHOOSING}, {PROOF}]
    for setup, settings in played.choosing.items():
        assert TINY.keep_settings(settings) == (*played.proof[setup],)
        assert all(len(rows["minutes"]) == 8 for rows in settings.values())
    assert {best.status for best in find_bests(played, 1.0).values()} <= set(Status)


def test_a_run_that_is_killed_goes_on_to_the_same_numbers(end_to_end, process, tmp_path):
    _, metrics = end_to_end
    script = (
        "import os, sys; from pathlib import Path; "
        "from hrc_env.experiments.price.episodes import Driver\n"
        "from hrc_env.experiments.price.experiment import Price\n"
        "from hrc_env.experiments.runner import run_experiment\n"
        f"config = {TINY!r}\n"
        "def say(share, label):\n"
        "    if label.startswith('two_cameras') and '.proof.' in label:\n"
        "        os.kill(os.getpid(), 9)\n"
        "run_experiment(config, Path(sys.argv[1]), say)"
    )
    assert process("-c", script, tmp_path).returncode == -signal.SIGKILL
    kept = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "parts").iterdir()}
    assert len(kept) >= 6  # two settings of both setups, the reference and the first row
    assert run_experiment(TINY, tmp_path, silent) == pytest.approx(metrics, nan_ok=True)
    for name, time_ns in kept.items():
        assert (tmp_path / "parts" / name).stat().st_mtime_ns == time_ns


@pytest.mark.slow
def test_parts_do_not_depend_on_the_engine(end_to_end, tmp_path):
    out, _ = end_to_end
    run_experiment(TINY, tmp_path, silent, engine=Processes(2))
    assert len([*(tmp_path / "parts").glob("*.json")]) == TINY.n_parts
    for path in (out / "parts").glob("*.json"):
        one, other = (
            json.loads((each / "parts" / path.name).read_text()) for each in (out, tmp_path)
        )
        assert (one["key"], one["part"]) == (other["key"], other["part"])


def test_parts_can_be_played_again_one_by_one(end_to_end, tmp_path):
    out, _ = end_to_end
    labels = sorted(path.stem for path in (out / "parts").glob("reference.*.json"))
    assert len(labels) == 2
    replay(TINY, PartCache(tmp_path, "", 1, silent), labels)
    for label in labels:
        one, other = (
            json.loads((folder / f"{label}.json").read_text())
            for folder in (out / "parts", tmp_path)
        )
        assert (one["key"], one["part"]) == (other["key"], other["part"])


def test_workers_who_walk_otherwise_are_noticed_where_nobody_waits():
    table = {"truth": {"a": {"walk": [1, 2]}, "b": {"walk": [1, 3]}}}
    check_walks("HRCHandover-v0", table)
    with pytest.raises(HRCError, match="moved differently"):
        check_walks("HRCReach-v0", table)
    check_walks("HRCReach-v0", {"truth": {"a": {"walk": [1, 2]}}, "b": {"a": {"walk": [1, 2]}}})


def test_ones_own_robot_has_a_price(tmp_path):
    """One that reaches nothing has no throughput to lose."""
    config = replace(
        TINY, setups=("truth",), n_settings=1, driver=Driver("random"), n_steps=8, n_proof=4
    )
    metrics = run_experiment(config, tmp_path, silent)
    assert metrics["unshielded.goals_per_min"].value == 0
    assert np.isnan(metrics["truth.no_shield.share"].value)
    text = (tmp_path / "report.md").read_text()
    assert "the robot that the agent `random` drives" in text
    assert "Quick run, 4 seeds of 0.32 s: too few seeds for intervals" in text
    settings = json.loads((tmp_path / "results.json").read_text())["config"]
    assert settings["agent"] == "random"


def test_one_robot_has_a_price_at_a_time(monkeypatch):
    with pytest.raises(
        ConfigError,
        match="The study compares perception setups for a single robot, got --robots random s",
    ):
        make_experiment(robots=["random", "scripted"])
    alone = make_experiment(robots=["random"], control="tool", task="HRCHandover-v0")
    assert alone.driver.env_arguments == {"control": "tool"}
    monkeypatch.delitem(experts.EXPERTS, "HRCHandover-v0")
    make_experiment(robots=["random"], task="HRCHandover-v0")  # nobody has scripted it


def test_the_usual_robot_changes_no_key():
    assert Driver().settings() == {}
    assert "driver" not in TINY.settings()


def test_a_tally_counts_towards_and_no_other_contacts():
    rows = make_rows(3, 6.0)
    rows["standing"] = [1.0] * 40
    found = tally(rows)
    assert (found.contacts, found.hours) == (3, pytest.approx(40 / 360))
