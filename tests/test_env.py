"""The environment's contract: both checkers, determinism, pickling, errors that help."""

import pickle
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_for_sb3

import hrc_env  # registers the ids
from hrc_env.config import HRCConfig
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Keypoints
from hrc_env.env import HRCEnv
from hrc_env.pipeline.levels import LEVELS
from hrc_env.rewards import RewardConfig
from hrc_env.scene.rig import CameraConfig
from hrc_env.tasks import BUILT_IN

FAST_LEVELS = ("keypoints", "truth", "none")


def make(**kwargs) -> gymnasium.Env:
    return gymnasium.make("HRCReach-v0", **kwargs)


def roll(env: gymnasium.Env, n_steps: int, seed: int = 0):
    """Observations, rewards and infos of a seeded random walk through actions."""
    rng = np.random.default_rng(seed)
    observation, info = env.reset(seed=seed)
    seen = [(observation, 0.0, info)]
    for _ in range(n_steps):
        action = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        observation, reward, terminated, truncated, info = env.step(action)
        seen.append((observation, reward, info))
        if terminated or truncated:
            break
    return seen


def same(a, b) -> bool:
    return all(
        np.array_equal(x[0], y[0]) and x[1] == y[1] and x[2] == y[2]
        for x, y in zip(a, b, strict=True)
    )


@pytest.mark.parametrize("level", LEVELS)
def test_both_checkers_have_nothing_to_say(level):
    env = HRCEnv(perception=level, render_mode="rgb_array" if level == "truth" else None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env_for_sb3(env)
        # gymnasium's checker wants the spec that make() adds
        check_env(make(perception=level).unwrapped, skip_render_check=True)
    env.close()


@pytest.mark.parametrize(("level", "n_steps"), [("pixels", 12), ("keypoints", 120), ("truth", 120)])
def test_two_runs_with_the_same_seed_are_bit_identical(level, n_steps):
    first, second = make(perception=level), make(perception=level)
    assert same(roll(first, n_steps), roll(second, n_steps))
    first.close(), second.close()


def test_another_seed_is_another_episode():
    env = make(perception="truth")
    assert not same(roll(env, 5, seed=0), roll(env, 5, seed=1))


def test_a_reset_without_a_seed_goes_on_with_the_stream():
    env = make(perception="truth")
    first, _ = env.reset(seed=3)
    second, _ = env.reset()
    again, _ = env.reset(seed=3)
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, second)


@pytest.mark.parametrize(
    ("level", "n_steps"), [("pixels", 3), ("keypoints", 20), ("truth", 20), ("none", 20)]
)
def test_pickled_in_the_middle_of_an_episode_it_goes_on_the_same(level, n_steps):
    env = HRCEnv(perception=level)
    roll(env, n_steps)
    twin = pickle.loads(pickle.dumps(env))
    rng = np.random.default_rng(5)
    for _ in range(n_steps):
        action = rng.uniform(-1, 1, 6).astype(np.float32)
        a, b = env.step(action), twin.step(action)
        np.testing.assert_array_equal(a[0], b[0])
        assert a[1:] == b[1:]
    env.close(), twin.close()


def test_the_worker_walks_the_same_whoever_looks():
    """The level is exchanged on the same seed; true separation depends on walk and actions only."""
    separations = []
    for level in LEVELS:
        env = make(perception=level)
        n_steps = 10 if level == "pixels" else 100
        separations.append([seen[2].get("safety/min_separation_m") for seen in roll(env, n_steps)])
        env.close()
    assert separations[0] == separations[1][:11]
    assert separations[1] == separations[2] == separations[3]


def test_two_environments_stepped_in_turn_do_not_disturb_each_other():
    """In lockstep, another one with another seed between them."""
    first, other, second = (make(perception="keypoints") for _ in range(3))
    rng = np.random.default_rng(2)
    a, _ = first.reset(seed=5)
    other.reset(seed=6)
    b, _ = second.reset(seed=5)
    for _ in range(40):
        np.testing.assert_array_equal(a, b)
        action = rng.uniform(-1, 1, 6).astype(np.float32)
        a, *rest_a = first.step(action)
        other.step(-action)
        b, *rest_b = second.step(action)
        assert rest_a == rest_b


def test_reward_is_the_sum_of_its_terms_in_info():
    for _, reward, info in roll(make(perception="keypoints"), 60)[1:]:
        terms = [value for name, value in info.items() if name.startswith("reward/")]
        assert reward == pytest.approx(sum(terms), abs=1e-12)


def test_cost_is_in_every_step_and_adds_up():
    total = 0.0
    for _, _, info in roll(make(perception="truth"), 250, seed=2)[1:]:
        assert info["cost"] == info["cost_sum"] == info["cost_unsafe"]
        assert info["cost"] in (0.0, 1.0)
        total += info["cost"]
        assert info["episode_cost"] == total


def test_an_episode_is_ten_seconds():
    assert len(roll(make(perception="none"), 1000)) == 251


def test_observations_stay_inside_their_space_and_are_fresh_copies():
    env = make(perception="keypoints")
    seen = [observation for observation, _, _ in roll(env, 120)]
    assert all(env.observation_space.contains(observation) for observation in seen)
    kept = seen[10].copy()
    env.step(env.action_space.sample())
    np.testing.assert_array_equal(seen[10], kept)


@pytest.mark.parametrize("level", ["truth", "keypoints"])
def test_the_site_is_a_scene_like_the_laboratory(level):
    env = HRCEnv(scene="site", perception=level)
    env.reset(seed=5)
    errors_m = [env.step(np.zeros(6))[4]["tracking/mpjpe_m"] for _ in range(30)]
    assert np.median(errors_m) < 0.08


def test_nobody_there_and_tool_control():
    env = make(perception="keypoints", n_workers=0, control="tool")
    assert env.action_space.shape == (3,)
    infos = [info for _, _, info in roll(env, 30)]
    assert all(info["tracking/mpjpe_measured"] == 0.0 for info in infos)
    assert all(info["tracking/lost"] == 0.0 for info in infos)


def test_without_an_estimate_the_prior_is_observed_at_its_bounds():
    env = HRCEnv(perception="none")
    observation, info = env.reset(seed=0)
    terms = env.split_observation(observation)
    assert terms["worker_tracked"] == [0.0]
    assert terms["worker_separation"] == [1.0]
    np.testing.assert_allclose(terms["worker_joints_std"], 1.0)
    np.testing.assert_allclose(terms["worker_joints_age"], 2.0)
    assert info["tracking/lost"] == 1.0
    assert info["tracking/mpjpe_measured"] == 0.0


def looking_at_the_ceiling() -> dict:
    """A rig that no worker can walk into."""
    eyes = ((2.0, 2.0, 1.0), (-2.0, 2.0, 1.0))
    cameras = [
        CameraConfig(f"up_{k}", eye, (eye[0] * 0.99, eye[1], 2.5), 40.0)
        for k, eye in enumerate(eyes)
    ]
    return {"scene": {"cameras": tuple(cameras)}}


@pytest.mark.filterwarnings("ignore:Camera .* sees:UserWarning")
@pytest.mark.parametrize(("level", "n_steps"), [("keypoints", 60), ("pixels", 2)])
def test_a_worker_out_of_every_view_is_data(level, n_steps):
    """Never acquired, never an exception: the prior, and the episode goes on."""
    env = HRCEnv(perception=level, config=looking_at_the_ceiling())
    for observation, reward, info in roll(env, n_steps):
        assert info["tracking/lost"] == 1.0
        assert info["tracking/mpjpe_measured"] == 0.0
        assert np.isfinite(observation).all()
        assert np.isfinite(reward)
    env.close()


def test_a_worker_who_leaves_the_views_is_lost_with_growing_doubt():
    """Twenty steps with four cameras, then none: deviation and age grow until the track ends."""
    env = HRCEnv(perception="keypoints")
    roll(env, 20)
    hide_everything(env)
    stds, lost = [], []
    for _ in range(60):
        observation, *_, info = env.step(np.zeros(6, np.float32))
        stds.append(env.split_observation(observation)["worker_joints_std"].mean())
        lost.append(info["tracking/lost"])
    assert stds[5] < stds[15] < stds[25]
    assert lost[10] == 0.0
    assert lost[-1] == 1.0


def hide_everything(env: HRCEnv) -> None:
    """From now on the detector finds nobody."""
    pipeline = env.simulation.pipeline
    blank = pipeline.keypoints
    nothing = Keypoints(
        np.full_like(blank.px, np.nan), np.zeros_like(blank.confidence),
        np.full_like(blank.sigma_px, np.inf),
    )  # fmt: skip
    pipeline.detect = lambda ids, expected, due, rngs: nothing


def test_contact_ends_the_episode_when_asked():
    config = {"cost": {"contact_terminates": True, "proximity_m": 9.0}}
    for seed in range(40):
        seen = roll(make(perception="truth", config=config), 250, seed)
        if seen[-1][2]["cost_contact"]:
            assert len(seen) < 251
            return
    pytest.fail("no contact in 40 episodes: the test saw nothing")


def test_a_reset_costs_nothing_and_knows_the_separation():
    env = make(perception="truth")
    _, info = env.reset(seed=0)
    costs = {name: value for name, value in info.items() if "cost" in name}
    assert costs == dict.fromkeys(
        ("cost", "cost_sum", "cost_proximity", "cost_contact", "cost_unsafe", "episode_cost"), 0.0
    )
    now_m = env.step(np.zeros(6, np.float32))[-1]["safety/min_separation_m"]
    assert info["safety/min_separation_m"] == pytest.approx(now_m, abs=0.1)


def ends(env: gymnasium.Env) -> list[bool]:
    return [env.step(np.zeros(6, np.float32))[3] for _ in range(5)]


def test_an_episode_begins_with_so_many_steps_left_and_the_next_has_all_of_them():
    env = make(perception="none", n_workers=0, max_episode_steps=4)
    env.reset(seed=0, options={"steps_left": 2})
    assert ends(env)[:2] == [False, True]
    env.reset()
    assert ends(env)[:4] == [False, False, False, True]


def test_steps_left_are_no_more_than_the_time_limit_and_go_with_a_state():
    env = make(perception="none", n_workers=0, max_episode_steps=4)
    env.reset(seed=0, options={"steps_left": 200})
    assert ends(env)[:4] == [False, False, False, True]
    bare = HRCEnv(perception="none", n_workers=0)
    bare.reset(seed=0, options={"steps_left": 3})
    state = bare.get_state()
    assert ends(bare)[:3] == [False, False, True]
    bare.set_state(state)
    assert ends(bare)[:3] == [False, False, True]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"elapsed_steps": 3}, r"does not know.*\{\"steps_left\": n\}"),
        ({"step_left": 3}, "Did you mean 'steps_left'"),
        ({"steps_left": 0}, "whole number from 1"),
        ({"steps_left": np.array([1, 2])}, "whole number from 1"),
    ],
)
def test_reset_options_that_cannot_work_say_so(options, said):
    with pytest.raises(ConfigError, match=said):
        make(perception="none").reset(options=options)


@pytest.mark.parametrize(
    "config", [{"reward": {"proximity": 0.0}}, HRCConfig(reward=RewardConfig(proximity=0.0))]
)
def test_a_config_survives_the_spec(config):
    """`EnvSpec.to_json` turns dataclasses into mappings and tuples into lists."""
    env = make(perception="truth", config=config)
    again = gymnasium.make(gymnasium.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.config == env.unwrapped.config
    assert again.unwrapped.config.reward.proximity == 0.0


@pytest.mark.parametrize("n_workers", [12, 36, 10**9, (0, 36)])
def test_more_workers_than_there_is_room_for_are_refused_with_how_many_fit(n_workers):
    with pytest.raises(ConfigError, match="at most 11 fit into this scene"):
        HRCEnv(perception="none", n_workers=n_workers)


def test_a_large_site_has_room_and_memory_for_many_workers():
    env = HRCEnv(perception="none", scene="site", n_workers=40)
    env.reset(seed=0)
    assert np.isfinite(env.step(np.ones(6))[0]).all()


@pytest.mark.parametrize(
    ("kwargs", "said"),
    [
        ({"config": {"task": {"radius_m": -1}}}, r"^task\.radius_m must be positive"),
        ({"people": {"tempo": -1.0}}, r"^people\.tempo must be"),
        ({"people": {"temp": 1.0}}, r"Did you mean 'people\.tempo'"),
        ({"people": ["hurried"]}, "a name.*'unaware'.*a mapping"),
        ({"motions": 5}, "motions must be a list"),
        ({"config": {"forecast_s": [3.0]}}, r"forecast_s must be in \(0, 1\] s"),
        ({"perception": "pixel"}, "Did you mean 'pixels'"),
        ({"estimator": "ekf"}, "'paper'"),
        ({"cameras": [7]}, "camera_4.* 0 to 3, got 7"),
        ({"cameras": []}, "at least one camera"),
        ({"cameras": ["camera_9"]}, "camera_1"),
        ({"scene": "moon"}, "'lab'"),
        ({"control": "torque"}, "'joint', 'tool'"),
        ({"n_workers": -1}, "0 or more"),
        ({"render_mode": "human"}, "'rgb_array'"),
        ({"config": {"rewards": {}}}, "Did you mean 'reward'"),
        ({"config": {"reward": {"proximty": 1}}}, "Did you mean 'reward.proximity'"),
        ({"config": {"ctrl_dt": 0.043}}, "multiple of scene.sim_dt"),
        ({"config": 3}, "must be an HRCConfig"),
        ({"config": {"reward": 5}}, "reward must be a mapping, got 5"),
        ({"config": {"reward": {"proximity": "high"}}}, "must be a finite number, got 'high'"),
        ({"config": {"reward": {"proximity": float("nan")}}}, "must be a finite number"),
        ({"config": {"task": {"height_m": [0.8, 1.4, 9]}}}, "must be 2 values"),
        ({"config": {"scene": {"sim_dt": "fast"}}}, "must be a finite number"),
        ({"config": {"scene": {"cameras": [{"name": "a"}]}}}, "eye_world is missing"),
        ({"config": {"control": {"tool_speed_m_s": -1.0}}}, "tool_speed_m_s must be positive"),
        ({"config": {"start_spread_rad": [1.0, 2.0]}}, "start_spread_rad must have shape"),
        ({"cameras": "camera_1"}, "is not a rig.*list of names, indices"),
        ({"cameras": [0.5]}, "Camera index .* 0 to 3, got 0.5"),
        ({"cameras": [True]}, "Camera index .* 0 to 3, got True"),
        ({"cameras": 0}, "list of names or indices"),
        ({"n_workers": 1.5}, "whole number"),
        ({"n_workers": "1"}, "whole number"),
    ],
)
def test_bad_arguments_are_answered_with_the_valid_ones(kwargs, said):
    with pytest.raises(ConfigError, match=said):
        HRCEnv(**{"perception": "truth", **kwargs})


@pytest.mark.parametrize(
    ("action", "said"),
    [
        (np.zeros(5), r"shape \(6,\)"),
        (np.full(6, np.nan), "finite"),
        (np.array([0, 0, np.nan, 0, 0, 0]), "finite"),
        (np.full(6, np.inf), "finite"),
        ("abc", "must be numbers"),
    ],
)
def test_bad_actions_are_refused_in_words(action, said):
    env = HRCEnv(perception="truth")
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=said):
        env.step(action)


def test_an_unknown_id_names_the_package():
    with pytest.raises(gymnasium.error.Error, match="HRCReach"):
        gymnasium.make("HRCReach-v7")
    assert list(BUILT_IN) == hrc_env.IDS


def test_the_id_registers_itself_when_its_package_is_named():
    env = gymnasium.make("hrc_env:HRCReach-v0", perception="none")
    assert isinstance(env.unwrapped, HRCEnv)


def test_pictures_have_the_shape_they_promise():
    env = HRCEnv(perception="keypoints", render_mode="rgb_array")
    env.reset(seed=0)
    assert env.render().shape == (720, 960, 3)
    assert env.mosaic().shape == (724, 1284, 3)
    depth = HRCEnv(perception="truth", render_mode="depth_array")
    depth.reset(seed=0)
    metres = depth.render()
    assert metres.shape == (720, 960)
    assert 0.3 < np.median(metres) < 9.0
    env.close(), depth.close()


def test_stepping_before_a_reset_is_refused():
    with pytest.raises(ConfigError, match="reset"):
        HRCEnv(perception="truth").step(np.zeros(6))
