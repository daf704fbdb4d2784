"""Camera images in observations: what they show, the same in any batch, and bad input."""

import pickle
import warnings
from contextlib import closing

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import hrc_env
from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import make_agent
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Roi
from hrc_env.env import HRCEnv
from hrc_env.scene.camera_images import COARSE, SMOOTHING, ImageConfig, parse_images
from hrc_env.scene.canvas import Canvas
from hrc_env.scene.render import CROP_QUALITY
from hrc_env.vector.env import HRCVectorEnv

SIZE = (36, 48)
NAMES = [f"image_camera_{k}" for k in (1, 2, 3, 4)]
ONE = {"height": 40, "width": 40, "cameras": ["camera_2"]}
PUSH = np.full(6, 0.4, np.float32)


def make(**given) -> HRCEnv:
    return HRCEnv(**{"perception": "truth", "observe_images": SIZE, **given})


def same(a, b) -> bool:
    return a.keys() == b.keys() and all(np.array_equal(a[name], b[name]) for name in a)


def of(observation, k: int):
    return {name: part[k] for name, part in observation.items()}


def test_the_observation_is_a_dictionary_of_belief_and_images():
    with closing(make()) as env:
        observation = env.reset(seed=0)[0]
        assert sorted(observation) == [*NAMES, "observation"]
        assert env.observation_space.contains(observation)
        for name in NAMES:
            assert observation[name].shape == (*SIZE, 3)
            assert observation[name].dtype == np.uint8
            assert observation[name].std() > 20
        with closing(HRCEnv(perception="truth")) as plain:
            np.testing.assert_array_equal(plain.reset(seed=0)[0], observation["observation"])


@pytest.mark.parametrize("level", ["keypoints", "truth", "none"])
def test_gymnasium_finds_nothing_wrong_at_any_level(level):
    env = make(perception=level, observe_images=ONE)
    with closing(env), warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env, skip_render_check=True)


def test_goals_and_images_stand_beside_the_belief():
    with closing(make(task="HRCReachGoal-v0", observe_images=ONE)) as env:
        names = ["achieved_goal", "desired_goal", "image_camera_2", "observation"]
        assert sorted(env.reset(seed=0)[0]) == names


def test_cameras_are_chosen_by_names_and_indices():
    for given, names in (
        ({"cameras": ("camera_3", 0)}, ["image_camera_1", "image_camera_3"]),
        ({"cameras": "camera_4"}, ["image_camera_4"]),
        ({"cameras": 1}, ["image_camera_2"]),
    ):
        with closing(make(observe_images=given)) as env:
            assert [each for each in env.observation_space if each != "observation"] == names


def test_an_image_is_what_the_camera_sees_all_at_once():
    """What lies about and what stands still is drawn before what moves, and not anew; rings on the
    arm that are thinner than a fifth of a pixel are left out."""
    quality, side = {**CROP_QUALITY, **COARSE}, SMOOTHING * 84
    with closing(make(observe_images=(84, 84))) as env:
        env.reset(seed=5)
        scene = env.simulation.scene
        canvas = Canvas(scene, side, side, quality)
        for _ in range(3):
            for _ in range(20):
                observation = env.step(PUSH)[0]
            canvas.pose(*env.views.pose())
            for camera in scene.cameras:
                canvas.show()
                middle = Roi((camera.width_px / 2, camera.height_px / 2), camera.width_px, 0.0)
                canvas.aim(camera, middle, camera.height_px)
                mean = canvas.paint().reshape(84, SMOOTHING, 84, SMOOTHING, 3).mean((1, 3))
                off = np.abs(mean - observation[f"image_{camera.name}"]).max(-1)
                assert (off > 1.0).sum() < 60
                assert (off > 12.0).sum() < 15
        canvas.close()


def test_an_image_follows_what_moves():
    with closing(make(observe_images=ONE)) as env:
        first = env.reset(seed=1)[0]["image_camera_2"]
        for _ in range(25):
            last = env.step(PUSH)[0]["image_camera_2"]
    changed = (first != last).any(-1)
    assert 10 < changed.sum() < 0.3 * changed.size


def test_goals_are_not_in_images():
    shown = []
    with closing(make(observe_images=ONE)) as env:
        for away_m in (0.0, 0.5):
            env.reset(seed=1)
            env.simulation.task_state["goal_world"][0] += away_m
            shown.append(env.step(PUSH)[0]["image_camera_2"])
    np.testing.assert_array_equal(*shown)


def test_a_lens_is_in_the_image():
    with closing(make(cameras="lab_gopro", observe_images=(45, 80))) as bent:
        seen = bent.reset(seed=1)[0]["image_camera_1"]
        assert seen.std() > 20
        with closing(make(observe_images=(45, 80))) as straight:
            other = straight.reset(seed=1)[0]["image_camera_1"]
        assert np.abs(seen.astype(float) - other).mean() > 10


@pytest.mark.parametrize("threads", [1, 2])
def test_a_batch_sees_what_single_environments_see(threads):
    singles = [make(perception="keypoints") for _ in range(3)]
    many = HRCVectorEnv(3, observe_images=SIZE, num_threads=threads)
    seen = many.reset(seed=4)[0]
    for k, env in enumerate(singles):
        assert same(of(seen, k), env.reset(seed=4 + k)[0])
    for _ in range(5):
        seen = many.step(np.tile(PUSH, (3, 1)))[0]
        for k, env in enumerate(singles):
            assert same(of(seen, k), env.step(PUSH)[0])
    assert many.observation_space.contains(seen)
    for env in (many, *singles):
        env.close()


def test_the_last_images_of_an_episode_are_kept_when_the_next_begins_at_once():
    env = HRCVectorEnv(
        2, perception="none", observe_images=ONE, max_episode_steps=2, autoreset_mode="SameStep"
    )
    with closing(env):
        env.reset(seed=0)
        env.step(np.tile(PUSH, (2, 1)))
        fresh, *_, infos = env.step(np.tile(PUSH, (2, 1)))
        last = infos["final_obs"][1]
        assert last["image_camera_2"].shape == (40, 40, 3)
        assert not np.array_equal(last["image_camera_2"], fresh["image_camera_2"][1])


@pytest.mark.parametrize("level", ["keypoints", "pixels"])
def test_processes_see_what_a_single_environment_sees(level, process):
    done = process(
        "-c",
        f"""
import gymnasium, hrc_env, numpy as np
if __name__ == "__main__":
    how = dict(perception={level!r}, observe_images=(36, 48))
    make = lambda: gymnasium.make("HRCReach-v0", **how)
    one = make()
    if {level!r} == "pixels":
        many = gymnasium.make_vec("HRCReach-v0", num_envs=2, **how)
    else:
        many = gymnasium.vector.AsyncVectorEnv([make] * 2)
    seen, alone = many.reset(seed=3)[0], one.reset(seed=4)[0]
    for _ in range(3):
        for name in alone:
            np.testing.assert_array_equal(seen[name][1], alone[name])
        action = np.full((2, 6), 0.4, np.float32)
        seen, alone = many.step(action)[0], one.step(action[0])[0]
    many.close()
    print("same")
""",
    )
    assert done.stdout.endswith("same\n"), done.stderr


@pytest.mark.parametrize("n_workers", [0, 1])
def test_looks_are_drawn_at_every_level_and_are_those_of_the_episode(n_workers):
    given = {"observe_images": ONE, "appearance": "varied", "n_workers": n_workers}
    with (
        closing(make(**given)) as env,
        closing(HRCVectorEnv(2, perception="truth", **given)) as many,
    ):
        first, second = env.reset(seed=1)[0], env.reset(seed=2)[0]
        off = first["image_camera_2"].astype(float) - second["image_camera_2"]
        assert np.abs(off).mean() > 10
        seen = many.reset(seed=1)[0]
        for _ in range(2):  # each keeps its own while they take turns
            seen = many.step(np.tile(PUSH, (2, 1)))[0]
        env.reset(seed=2)
        env.step(PUSH)
        assert same(of(seen, 1), env.step(PUSH)[0])


def test_states_and_pickles_bring_the_images_back():
    with closing(make(observe_images=ONE, appearance="lights")) as env:
        env.reset(seed=1)
        env.step(PUSH)
        kept, twin = env.get_state(), pickle.loads(pickle.dumps(env))
        after = env.step(PUSH)[0]
        env.reset(seed=8)
        env.set_state(kept)
        assert same(after, env.step(PUSH)[0])
        assert same(after, twin.step(PUSH)[0])
        twin.close()


def test_images_change_nothing_that_happens():
    runs = []
    for images in (None, SIZE):
        with closing(HRCEnv(perception="keypoints", observe_images=images)) as env:
            env.reset(seed=6)
            seen = [env.step(PUSH)[0] for _ in range(6)]
            runs.append([each["observation"] if images else each for each in seen])
    np.testing.assert_array_equal(*runs)


def test_terms_and_images_by_name():
    with closing(make(observe_images=ONE)) as env:
        observation = env.reset(seed=0)[0]
        terms = env.split_observation(observation)
    np.testing.assert_array_equal(terms["image_camera_2"], observation["image_camera_2"])
    assert terms["goal_from_tool"].shape == (3,)


@pytest.mark.parametrize(
    "name", ["random", "scripted", "scripted_slowed", "hrc://HRCReach-v0/fast"]
)
def test_agents_that_read_the_belief_act_beside_images(name):
    with closing(HRCEnv(observe_images=ONE, perception="keypoints")) as env:
        observation = env.reset(seed=0)[0]
        action = make_agent(name, env_info(env)).act(observation)
        alone = make_agent(name, env_info(env)).act({"observation": observation["observation"]})
        np.testing.assert_array_equal(action, alone)
        assert env_info(env).images == {"image_camera_2": (40, 40, 3)}


def test_the_arguments_survive_json_and_toml(tmp_path):
    config = hrc_env.EnvConfig(observe_images=ImageConfig(32, 40, ("camera_1", 2)))
    config.save(tmp_path / "env.toml")
    assert parse_images(hrc_env.EnvConfig.load(tmp_path / "env.toml").observe_images) == (
        ImageConfig(32, 40, ("camera_1", 2))
    )
    env = gymnasium.make("HRCReach-v0", perception="none", observe_images=ONE)
    again = gymnasium.make(gymnasium.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    assert again.observation_space == env.observation_space
    env.close()
    again.close()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ((0, 84), r"observe_images: height of images \[px\] must be .* from 8 to 1024, got 0"),
        ((84, 10_000), "width of images .* got 10000"),
        ((84.0, 84), "got 84.0"),
        (10_000, r"must be \(height, width\) .* got 10000"),
        ((84,), r"got \(84,\)"),
        (True, "got True"),
        ("pixels", "got 'pixels'"),
        ({"widht": 84}, "Did you mean 'width'"),
        ({"cameras": ["camera_9"]}, "camera of observe_images 'camera_9'. Did you mean"),
        ({"cameras": "keypoints"}, "Valid: 'camera_1', 'camera_2'"),
        ({"cameras": [7]}, "from 0 to 3, got 7"),
        ({"cameras": [-1]}, "from 0 to 3, got -1"),
        ({"cameras": []}, "one or more cameras"),
        ({"cameras": [0, "camera_1"]}, "'camera_1' is in observe_images more than once"),
    ],
)
def test_images_that_cannot_be_are_answered_before_an_episode(given, said):
    with pytest.raises(ConfigError, match=said):
        HRCEnv(perception="none", observe_images=given)
    with pytest.raises(ConfigError, match=said):
        HRCVectorEnv(2, perception="none", observe_images=given)


def test_looks_without_any_image_are_refused_with_the_way_out():
    with pytest.raises(ConfigError, match="observe_images"):
        HRCEnv(perception="truth", appearance="varied")
