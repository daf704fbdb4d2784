"""What somebody meets on the first day: each thing does what was meant, or says why not."""

import sys
import warnings
from dataclasses import replace

import numpy as np
import pytest
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecNormalize

import hrc_env
from hrc_env.__main__ import main
from hrc_env.agents import acting, callbacks, checkpoints
from hrc_env.agents.registry import find_control
from hrc_env.core.errors import CheckpointError
from hrc_env.experiments import leaderboard, report
from hrc_env.experiments.impact import experiment
from hrc_env.scene.robot import ROBOTS
from hrc_env.tasks.task import TASKS
from tests.tasks.variants import vary

REACH = hrc_env.find_task("HRCReach-v0")
TASK = """
import hrc_env
hrc_env.register_task(type("Mine", (hrc_env.find_task("HRCReach-v0"),), {"id": "FirstDay-v0"}))
"""


def said_by(capsys, *words):
    """What a command says that fails."""
    assert main(list(map(str, words))) == 2
    return " ".join(capsys.readouterr().err.split())


def test_the_benchmark_takes_tasks_of_users(monkeypatch):
    monkeypatch.setitem(TASKS, "Hover-v0", vary(REACH, id="Hover-v0"))
    study = leaderboard.make_plan("scripted", ["Hover-v0"], n=1).make_study()
    assert {row.env["task"] for row in study.rows.values()} == {"Hover-v0"}
    with pytest.raises(hrc_env.ConfigError, match=r"Unknown task 'Hver-v0'.*--import FILE"):
        leaderboard.make_plan("scripted", ["Hver-v0"]).make_study()


def test_only_tasks_of_the_package_enter_the_leaderboard(monkeypatch, capsys, tmp_path):
    monkeypatch.setitem(TASKS, "Hover-v0", vary(REACH, id="Hover-v0"))
    words = (
        "benchmark",
        "--policy",
        "scripted",
        "--ids",
        "Hover-v0",
        "--enter",
        tmp_path / "a.json",
    )
    assert "Unknown environment of the leaderboard 'Hover-v0'" in said_by(capsys, *words)


@pytest.mark.parametrize(
    "words",
    [
        ("play", "Hover-v0"), ("play", "--robot", "mine"), ("play", "--shield", "mine"),
        ("play", "--perception", "keypoints", "--estimator", "mine"),
        ("benchmark", "--policy", "scripted", "--ids", "Hover-v0"),
        ("experiment", "impact", "--estimator", "mine"), ("train", "--task", "Hover-v0"),
    ],
)  # fmt: skip
def test_a_name_of_users_that_is_not_known_says_how_it_becomes_so(capsys, words):
    assert "--import FILE" in said_by(capsys, *words)


def test_a_checkpoint_of_strangers_is_read_when_asked_for(monkeypatch):
    given = []

    def make_agent(name, env_info, trust=False):
        given.append(trust)
        raise CheckpointError("not read")

    monkeypatch.setattr("hrc_env.agents.registry.make_agent", make_agent)
    for asked in ({}, {"trust": True}):
        with pytest.raises(CheckpointError):
            hrc_env.evaluate("scripted", 1, perception="none", engine="serial", **asked)
    assert given == [False, True]


@pytest.mark.parametrize("goal", [(0.1, 0.2, np.nan), (np.inf, 0.0, 1.0)])
def test_goals_that_are_no_numbers_reach_no_task(goal):
    task = vary(REACH, id="Mine-v0", goal_targets=lambda self, goal: [])
    env = hrc_env.HRCVectorEnv(2, task=task, perception="none")
    with pytest.raises(hrc_env.ConfigError, match="must be finite"):
        env.reset(seed=0, options={"goal": goal})


def test_paired_gives_the_difference_of_a_statistic_of_one_row():
    ours, theirs = (
        np.array([1.0, 2.0, 4.0, 8.0, 9.0, 3.0, 5.0, 6.0]),
        np.array([0.5, 1.0, 3.0, 7.0, 8.0, 2.0, 6.0, 5.0]),
    )
    both = np.array([*ours, *theirs])
    found = hrc_env.compare_paired("mean", lambda w: w @ both / w.sum(-1), len(ours), "m")
    compared = hrc_env.compare_means(ours, theirs, "m")
    assert found["difference.mean"] == compared.difference
    assert found["p.mean"].value == compared.p


def test_actions_of_another_control_are_told_from_those_of_this_one(tmp_path):
    model = PPO("MlpPolicy", hrc_env.HRCVecEnv(2, perception="none", control="twist"), n_steps=8)
    model.save(tmp_path / "plain.zip")
    name = str(tmp_path / "plain.zip")
    assert find_control(name) == "twist"
    joint = hrc_env.env_info(hrc_env.HRCVectorEnv(1, perception="none"))
    with pytest.raises(CheckpointError, match=r"uses control='twist'.*--control twist"):
        hrc_env.make_agent(name, joint)
    twist = hrc_env.env_info(hrc_env.HRCVectorEnv(1, perception="none", control="twist"))
    assert hrc_env.make_agent(name, twist).act(np.zeros((2, *twist.layout.low.shape))).shape == (
        2,
        6,
    )


def test_a_checkpoint_of_train_tells_its_control(tmp_path):
    env = hrc_env.HRCVecEnv(2, perception="none", control="twist")
    facts = {"environment": {"control": "twist"}}
    checkpoints.save(PPO("MlpPolicy", env, n_steps=8), tmp_path / "ours.zip", facts)
    joint = hrc_env.env_info(hrc_env.HRCVectorEnv(1, perception="none"))
    for load in (checkpoints.load, acting.load):
        with pytest.raises(CheckpointError, match=r"uses control='twist'.*--control twist"):
            load(tmp_path / "ours.zip", joint)


def test_actions_of_a_wrong_shape_say_what_chooses_their_meaning():
    env = hrc_env.HRCVectorEnv(2, perception="none")
    env.reset(seed=0)
    with pytest.raises(
        hrc_env.ConfigError, match=r"\(2, 6\).*control='joint'.*--control.*\(2, 3\)"
    ):
        env.step(np.zeros((2, 3)))


def test_an_experiment_says_whose_actions_are_wrong(monkeypatch):
    def play(*given):
        raise hrc_env.ConfigError("action must have another shape")

    monkeypatch.setattr(experiment, "play_row", play)
    with pytest.raises(hrc_env.ConfigError, match="my:robot: action must"):
        experiment._play("my:robot", 1, 2)


def test_a_ramp_of_ones_own_lets_the_proximity_term_grow():
    env = hrc_env.HRCVecEnv(2, perception="none", config={"reward": {"proximity": 3.0}})
    weights = []

    class Watch(BaseCallback):
        def _on_rollout_end(self):
            weights.append(env.simulation.reward_weights.proximity)

        def _on_step(self):
            return True

    model = PPO("MlpPolicy", VecNormalize(env, norm_obs=False), n_steps=8, batch_size=16)
    model.learn(64, callback=[hrc_env.ProximityRamp(32), Watch()])
    assert weights == [0.0, 1.5, 3.0, 3.0]
    with pytest.raises(hrc_env.ConfigError, match="needs an HRCVecEnv, got DummyVecEnv"):
        PPO("MlpPolicy", "CartPole-v1", n_steps=8, batch_size=8).learn(
            8, callback=hrc_env.ProximityRamp()
        )


def shielded(shield):
    env = hrc_env.HRCVectorEnv(2, perception="none", shield=shield)
    env.reset(seed=0)
    return env.step(np.ones((2, 6)))[-1]


@pytest.mark.parametrize("name", ["active", "change", "scale"])
def test_a_shield_says_nothing_that_is_measured_of_all(name):
    with pytest.raises(hrc_env.ConfigError, match=f"must not return the value '{name}'"):
        shielded(lambda now, velocities, dt_s: (velocities, {name: np.ones(len(velocities))}))


def test_a_shield_that_is_faster_than_joints_can_be_is_warned_of():
    with pytest.warns(UserWarning, match=r"lets joint \d move at .* times its velocity limit"):
        shielded(lambda now, velocities, dt_s: (velocities * 100, {}))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        shielded(lambda now, velocities, dt_s: (velocities, {}))
        shielded("qp")


def test_files_are_imported_as_paths_come(tmp_path):
    files = [tmp_path / f"first_day_{k}.py" for k in range(3)]
    for k, each in enumerate(files):
        each.write_text(f"import sys\nsys.first_day = [*getattr(sys, 'first_day', []), {k}]")
    hrc_env.import_files([files[0], str(files[1])])
    hrc_env.import_files(files[2])
    assert sys.first_day == [0, 1, 2]
    with pytest.raises(hrc_env.ConfigError, match=r"nowhere\.py cannot be imported: there is no"):
        hrc_env.import_files(tmp_path / "nowhere.py")
    with pytest.raises(hrc_env.ConfigError, match="must be the paths of Python files, got 3"):
        hrc_env.import_files(3)
    assert "HRC_ENV_IMPORT" in hrc_env.import_files.__doc__


def test_methods_of_all_environments_are_among_the_valid_ones():
    env = hrc_env.HRCVecEnv(2, perception="none")
    with pytest.raises(AttributeError, match=r"Did you mean 'set_reward'.*'set_reward'"):
        env.env_method("set_rewards", None)


def test_episodes_of_an_evaluation_can_be_compared():
    ours, theirs = (
        hrc_env.evaluate_episodes(agent, 6, perception="none", max_episode_steps=20)
        for agent in ("scripted", "random")
    )
    score = hrc_env.evaluate("scripted", 6, perception="none", max_episode_steps=20)
    assert np.mean([each["r"] for each in ours]) == pytest.approx(score.return_mean)
    found = hrc_env.compare_means([e["r"] for e in ours], [e["r"] for e in theirs])
    assert found.difference.value > 0


@pytest.mark.parametrize("exposure", [[1, 2, 3], [[1.0, 2.0]], []])
def test_rates_are_of_the_same_seeds(exposure):
    with pytest.raises(hrc_env.ConfigError, match=r"same seeds|must have shape"):
        hrc_env.estimate_rate([1, 1], exposure)
    with pytest.raises(hrc_env.ConfigError, match=r"same seeds|must have shape"):
        hrc_env.compare_rates([1, 1], [1, 0], 2.0, exposure)


def test_margins_of_equal_contacts_can_be_set():
    for margin_m in (-0.122, 0.05):
        shield = hrc_env.ShieldConfig(margin_m=margin_m, hand_margin_m=margin_m + 0.08)
        env = hrc_env.HRCVectorEnv(2, perception="truth", people="unaware", shield=shield)
        env.reset(seed=0)
        assert np.isfinite(env.step(np.ones((2, 6)))[1]).all()
    with pytest.raises(hrc_env.ConfigError, match="margin_m must be a finite number"):
        hrc_env.ShieldConfig(margin_m=-np.inf)


def test_intervals_below_zero_can_be_read():
    assert report.format_interval(-0.15, -0.193, -0.144, 3) == "-0.150 (-0.193 to -0.144)"
    assert report.format_interval(0.15, 0.1, 0.2, 1) == "0.1 (0.1 to 0.2)"


@pytest.mark.parametrize("name", ["", " "])
def test_a_robot_needs_a_name(name):
    robot = replace(ROBOTS["ur10e_like"], name=name)
    with pytest.raises(hrc_env.ConfigError, match="must have a name"):
        hrc_env.register_robot(robot)


def test_joints_that_are_no_arms_are_named():
    for joints, said in (("", "has no joint"), ("<freejoint/>", "has 1 free joint")):
        mjcf = f'<mujoco><worldbody><body>{joints}<geom size=".1"/></body></worldbody></mujoco>'
        with pytest.raises(hrc_env.ConfigError, match=said):
            hrc_env.robot_from_mjcf(mjcf, "odd")


@pytest.mark.parametrize("render_mode", [None, "depth_array"])
def test_an_overlay_that_nothing_shows_is_warned_of(render_mode):
    made = {"perception": "none", "overlay": "capsules"}
    with pytest.warns(UserWarning, match="requires render_mode='rgb_array'"):
        hrc_env.HRCVectorEnv(1, render_mode=render_mode, **made).close()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        hrc_env.HRCVectorEnv(1, render_mode="rgb_array", **made).close()


def test_shields_are_listed(capsys):
    assert main(["list"]) == 0
    assert "qp" in capsys.readouterr().out


def test_words_beside_a_curve_do_not_run_into_each_other(tmp_path, monkeypatch):
    kept = []
    monkeypatch.setattr(callbacks, "save", lambda figure, path, **_: kept.append(figure))
    point = dict.fromkeys((*callbacks.PANELS, *callbacks.LIMITED, "is_success", "limit"), 0.5)
    curve = [{**point, "steps": float(n), "safety_share": 1.0} for n in (1, 2)]
    for each in ([{k: v for k, v in one.items() if k != "limit"} for one in curve], curve):
        callbacks.plot_curve(each, tmp_path / "curve.png", "t")
        figure = kept[-1]
        figure.draw_without_rendering()
        axes = figure.axes
        boxes = [axis.yaxis.label.get_window_extent() for axis in axes]
        assert all(box.y0 >= 0 and box.y1 <= figure.bbox.y1 for box in boxes)
        overlap = [a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[k + 1 :]]
        assert not any(overlap)
