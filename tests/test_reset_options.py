"""What a reset fixes of an episode, what it leaves alone, and what it refuses."""

import pickle
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest

import hrc_env
from hrc_env import (
    ConfigError,
    HRCEnv,
    HRCVectorEnv,
    Lens,
    ResetOptions,
    RigDistribution,
)
from hrc_env.vector.make import PixelVectorEnv

GOAL = (0.5, 0.3, 1.1)
STEPS = 12
DRAWN = RigDistribution(
    max_shift_m=0.2, max_rotation_rad=0.05, max_focal_change=0.05, n_cameras=(2, 4)
)
LATE = {"kind": "late", "cameras": ["all"], "amount": [0.0, 0.3]}
OPTIONS: list[dict[str, Any]] = [
    {"goal": GOAL, "people": "unaware"},
    {"n_workers": 2, "bodies": ["worker_2", "worker_1"], "activity": ["hammer", None]},
    {
        "n_workers": 1,
        "cameras": ["camera_2", "camera_4"],
        "faults": [{**LATE, "kind": "wrong_rotation"}],
    },
    {"n_workers": 2, "cameras": DRAWN, "appearance": {"light": (0.2, 0.5)}, "faults": [LATE]},
]
"""Of four environments, of which each fixes something else."""
ARGUMENTS: dict[str, Any] = {
    "perception": "keypoints", "n_workers": (0, 2), "config": {"worker": "any"},
}  # fmt: skip


def make(task: str = "HRCReach-v0", **arguments: Any) -> HRCEnv:
    return HRCEnv(task, **{"perception": "keypoints", **arguments})


def episode(env: gymnasium.Env, seed: int, options: Any = None) -> list[Any]:
    """Observations, rewards and infos of an episode of random actions."""
    actions, (observation, info) = np.random.default_rng(3), env.reset(seed=seed, options=options)
    told = [(observation, 0.0, info)]
    for _ in range(STEPS):
        observation, reward, _, _, info = env.step(actions.uniform(-1, 1, 6).astype(np.float32))
        told.append((observation, reward, info))
    return told


def assert_same(one: list[Any], other: list[Any]) -> None:
    for (seen, reward, info), (seen_too, reward_too, info_too) in zip(one, other, strict=True):
        np.testing.assert_array_equal(seen, seen_too)
        assert reward == reward_too
        for name, value in info.items():
            np.testing.assert_array_equal(value, info_too[name], err_msg=name)


def episodes_of(envs: gymnasium.vector.VectorEnv, **reset: Any) -> list[list[Any]]:
    """The same of each of a vector's environments, which all act alike."""
    observations, infos = envs.reset(**reset)
    actions, told = np.random.default_rng(3), []

    def keep(rewards: Any) -> None:
        for k in range(envs.num_envs):
            info = {name: infos[name][k] for name in infos if not name.startswith("_")}
            told.append((observations[k].copy(), rewards[k], info))

    keep(np.zeros(envs.num_envs))
    for _ in range(STEPS):
        action = actions.uniform(-1, 1, 6).astype(np.float32)
        observations, rewards, _, _, infos = envs.step(np.tile(action, (envs.num_envs, 1)))
        keep(rewards)
    return [told[k :: envs.num_envs] for k in range(envs.num_envs)]


@pytest.fixture(scope="module")
def singles() -> list[list[Any]]:
    """Each of the four episodes in an environment of its own."""
    return [episode(make(**ARGUMENTS), 7 + k, each) for k, each in enumerate(OPTIONS)]


def test_a_batch_gives_the_episodes_of_single_environments(singles) -> None:
    envs = HRCVectorEnv(4, num_threads=2, **ARGUMENTS)
    for one, other in zip(singles, episodes_of(envs, seed=7, options={"each": OPTIONS}),
                          strict=True):  # fmt: skip
        assert_same(one, other)


def test_options_of_all_resets_give_the_episodes_of_options_of_one(singles) -> None:
    envs = HRCVectorEnv(4, num_threads=1, **ARGUMENTS)
    envs.set_options({"each": OPTIONS})
    for one, other in zip(singles, episodes_of(envs, seed=7), strict=True):
        assert_same(one, other)


def test_processes_give_the_episodes_of_single_environments(singles, process) -> None:
    one = partial(gymnasium.make, "hrc_env:HRCReach-v0", **ARGUMENTS)
    envs = PixelVectorEnv([one] * 4, context="spawn")
    for alone, other in zip(singles, episodes_of(envs, seed=7, options={"each": OPTIONS}),
                            strict=True):  # fmt: skip
        assert_same(alone, other)
    envs.set_options({"each": OPTIONS})
    for alone, other in zip(singles, episodes_of(envs, seed=7), strict=True):
        assert_same(alone, other)
    envs.close()


def test_sb3_takes_options_of_the_next_reset_and_of_all(singles) -> None:
    envs = hrc_env.HRCVecEnv(4, **ARGUMENTS)
    for take in (envs.set_options, lambda each: [
        envs.env_method("set_options", one, indices=[k]) for k, one in enumerate(each)
    ]):  # fmt: skip
        take(OPTIONS)
        envs.seed(7)
        observations = envs.reset()
        for k, told in enumerate(singles):
            np.testing.assert_array_equal(observations[k], told[0][0])


def test_what_is_not_fixed_is_drawn_as_without_options() -> None:
    env = make()
    free, given = episode(env, 5), episode(env, 5, {"goal": GOAL})
    terms = [env.split_observation(told[0][0]) for told in (free, given)]
    for name, value in terms[0].items():
        if not name.startswith("goal"):
            np.testing.assert_array_equal(value, terms[1][name], err_msg=name)
    assert not np.array_equal(terms[0]["goal_from_tool"], terms[1]["goal_from_tool"])


def test_options_of_one_reset_leave_the_next_as_it_was() -> None:
    env = make(**ARGUMENTS)
    free = episode(env, 5)
    for options in OPTIONS:
        episode(env, 5, options)
    assert_same(free, episode(env, 5))


@pytest.mark.parametrize("task", ["HRCReach-v0", "HRCReachGoal-v0"])
def test_the_goal_is_where_it_was_asked_for(task: str) -> None:
    env = make(task)
    env.reset(seed=0, options={"goal": GOAL})
    np.testing.assert_array_equal(env.simulation.markers(0), [GOAL])


def test_the_robot_starts_as_it_was_asked_to() -> None:
    env = make()
    q = env.simulation.scene.home_q + 0.1
    env.reset(seed=0, options={"start_q": q})
    np.testing.assert_array_equal(env.simulation.physics.q[0], q)


def test_workers_are_who_and_do_what_was_asked_for() -> None:
    env = make(**ARGUMENTS)
    for seed in range(4):
        who = {"n_workers": 2, "bodies": ["worker_5", "worker_1"], "activity": ["saw", "kneel"]}
        _, info = env.reset(seed=seed, options=who)
        words = env.words(info)
        assert words["worker/activity"] == ("saw", "kneel")
        assert words["worker/body"] == ("worker_5", "worker_1")
    _, info = env.reset(seed=0, options={"n_workers": 0})
    assert env.words(info)["worker/activity"] == ("absent", "absent")


def test_people_of_one_episode_do_not_look_out_for_the_robot() -> None:
    def reactions(options: Any) -> float:
        env, told = make(config={"motion": {"people": {"pause_probability": 1.0,
                         "step_back_probability": 0.0, "notice_m": 3.0}}}), 0.0  # fmt: skip
        env.reset(seed=1, options=options)
        for _ in range(200):
            env.step(np.zeros(6, np.float32))
            told += float((env.simulation.motion.workers["reacts_at_s"] < np.inf).any())
        return told

    assert reactions(None) > 0.0
    assert reactions({"people": "unaware"}) == 0.0
    blind = {"pause_probability": 1.0, "step_back_probability": 0.0, "notice_m": 0.0}
    assert reactions({"people": {**blind, "fast_m_s": 99.0}}) == 0.0


def test_fault_amounts_are_drawn_anew_for_every_episode() -> None:
    env = make(faults=[{**LATE, "kind": "wrong_rotation", "amount": [0.01, 0.02]}])
    turned = set()
    for _ in range(5):
        env.reset(seed=None if turned else 0)
        recent = env.simulation.pipeline.cameras.history
        (fault,) = recent.schedule_of(0).faults
        assert 0.01 <= fault.max_amount <= 0.02
        turned.add(fault.max_amount)
    assert len(turned) == 5


def test_rigs_are_drawn_within_their_bounds_for_every_episode() -> None:
    env = make(cameras=DRAWN)
    told = {camera.name: camera for camera in env.rig}
    counts, places = set(), set()
    for seed in range(12):
        env.reset(seed=seed)
        counts.add(len(env.rig))
        places.add(env.rig[0].eye_world)
        for camera in env.rig:
            off_m = np.subtract(camera.eye_world, told[camera.name].eye_world)
            assert np.abs(off_m).max() <= 0.2
    assert counts == {2, 3, 4}
    assert len(places) == 12


def test_the_estimator_knows_the_rig_of_its_episode() -> None:
    """With cameras half a metre elsewhere, workers are tracked as well as with the scene's own."""
    env = make(cameras=RigDistribution(max_shift_m=0.5, max_rotation_rad=0.1))
    env.reset(seed=3)
    errors_m = []
    for _ in range(60):
        *_, info = env.step(np.zeros(6, np.float32))
        errors_m.append(info["tracking/mpjpe_m"])
    assert np.nanmedian(errors_m) < 0.1


def test_infos_have_the_same_keys_whatever_the_rig() -> None:
    env = make()
    _, info = env.reset(seed=0)
    _, alone = env.reset(seed=0, options={"cameras": ["camera_3", "camera_1"]})
    assert list(info) == list(alone)


@pytest.mark.parametrize("again", ["set_state", "pickle"])
def test_a_state_holds_the_cameras_and_people_of_the_episode(again: str) -> None:
    envs = HRCVectorEnv(4, num_threads=2, **ARGUMENTS)
    envs.reset(seed=7, options={"each": OPTIONS})
    actions = np.zeros((4, 6), np.float32)
    envs.step(actions)
    other = pickle.loads(pickle.dumps(envs)) if again == "pickle" else HRCVectorEnv(
        4, num_threads=2, **ARGUMENTS
    )  # fmt: skip
    if again == "set_state":
        other.set_state(envs.get_state())
    for _ in range(STEPS):
        np.testing.assert_array_equal(envs.step(actions)[0], other.step(actions)[0])


def test_options_of_all_resets_hold_after_the_end_of_an_episode() -> None:
    envs = HRCVectorEnv(2, max_episode_steps=3, num_threads=1, perception="truth")
    envs.set_options({"goal": [GOAL, (0.4, 0.2, 1.0)]})
    envs.reset(seed=0)
    for _ in range(4):
        envs.step(np.zeros((2, 6), np.float32))
    state = envs.simulation.task_state["goal_world"]
    np.testing.assert_array_equal(state, [GOAL, (0.4, 0.2, 1.0)])
    envs.set_attr("options", None)
    envs.reset(seed=0)
    assert not np.isin(envs.simulation.task_state["goal_world"], GOAL).any()


def test_a_vector_takes_a_row_for_each_environment_or_one_value_for_all() -> None:
    envs = HRCVectorEnv(2, num_threads=1, perception="truth", n_workers=(0, 2))
    envs.reset(seed=0, options={"n_workers": [0, 2], "goal": GOAL})
    np.testing.assert_array_equal(envs.simulation.present.sum(1), [0, 2])
    np.testing.assert_array_equal(envs.simulation.task_state["goal_world"], [GOAL, GOAL])
    mask = np.array([False, True])
    envs.reset(options={"n_workers": 1, "reset_mask": mask})
    np.testing.assert_array_equal(envs.simulation.present.sum(1), [0, 1])


def test_factors_weigh_any_term_of_the_reward() -> None:
    env, twice = make(perception="truth"), make(perception="truth")
    factors = {"progress": 2.0, "effort": 0.0, "proximity": 3.0}
    twice.set_reward(factors=factors)
    for (_, _, info), (_, reward, of_twice) in zip(
        episode(env, 1)[1:], episode(twice, 1)[1:], strict=True
    ):
        terms = [name for name in info if name.startswith("reward/")]
        for name in terms:
            factor = factors.get(name.removeprefix("reward/"), 1.0)
            assert of_twice[name] == factor * info[name]
        assert reward == pytest.approx(sum(of_twice[name] for name in terms))


def test_a_goal_is_judged_again_with_the_factor_on_its_term() -> None:
    env = make("HRCReachGoal-v0", perception="truth")
    env.set_reward(factors={"goal": 5.0})
    env.reset(seed=0)
    observation, reward, *_, info = env.step(np.ones(6, np.float32))
    goals = observation["achieved_goal"], observation["desired_goal"]
    assert env.compute_reward(*goals, info) == reward
    assert env.compute_reward(*goals, {}) == -5.0
    state = env.get_state()
    env.set_reward(factors={})
    env.set_state(state)
    assert env.compute_reward(*goals, {}) == -5.0


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"gaol": GOAL}, "Did you mean 'goal'"),
    ({"goal": (3, 3, 3)}, "out of reach"),
    ({"goal": (0.4, 0.3, -1.0)}, "above the floor"),
    ({"goal": "there"}, "must be numbers"),
    ({"n_workers": 3}, "from 0 to 2"),
    ({"n_workers": 1, "bodies": ["worker_1", "worker_2"]}, "one for each of 1 workers"),
    ({"bodies": "worker_99"}, "Did you mean"),
    ({"people": "unawar"}, "Did you mean 'unaware'"),
    ({"activity": "hamer"}, "Did you mean 'hammer'"),
    ({"activity": "walk"}, "Valid: "),
    ({"n_workers": 2, "activity": "saw"}, "fewer free positions"),
    ({"start_q": [0.0] * 5}, "one entry per joint"),
    ({"start_q": [9.0] * 6}, "joint 'shoulder_pan' must be from"),
    ({"start_q": [0.0, 1.5, 0.0, 0.0, 0.0, 0.0]}, "touch"),
    ({"cameras": ["camera_9"]}, "Did you mean"),
    ({"cameras": [(1.0, 1.0, 2.4)] * 5}, "'camera_5'"),
    ({"cameras": {"max_shift": 0.1}}, "Did you mean 'cameras.max_shift_m'"),
    ({"cameras": {"max_shift_m": 50.0}}, "in 100 draws"),
    ({"cameras": {"n_cameras": (3, 2)}}, "fewest, most"),
    ({"cameras": ["camera_1"], "faults": [{**LATE, "cameras": ["camera_2"]}]}, "camera of fault"),
    ({"faults": [{**LATE, "amount": [0.3, 0.0]}]}, "(least, most)"),
    ({"faults": [{**LATE, "amount": [0.0, 3.0]}]}, "must be from 0 to 1 s"),
    ({"faults": [{**LATE, "amount": [0.0, 0.1, 0.2]}]}, "(least, most)"),
    ({"faults": [{"kind": "noise", "cameras": ["all"]}]}, "need images"),
    ({"appearance": "varied"}, "Appearances need images"),
    ({"steps_left": 0}, "steps_left"),
]


@pytest.mark.parametrize(("options", "words"), REFUSED)
@pytest.mark.filterwarnings("ignore:.*sees")
def test_options_that_cannot_be_are_refused_in_words(options: dict, words: str) -> None:
    env = make(**ARGUMENTS)
    with pytest.raises(ConfigError) as error:
        env.reset(seed=0, options=options)
    assert words in str(error.value)
    envs = HRCVectorEnv(2, num_threads=1, **ARGUMENTS)
    with pytest.raises(ConfigError) as error:
        envs.reset(seed=0, options=options)
    assert words in str(error.value)


@pytest.mark.parametrize(("options", "words"), [
    ({"each": [{}]}, "a list of 2 mappings"),
    ({"each": [{"goal": GOAL}, None], "goal": GOAL}, "give it only once"),
    ({"goal": [GOAL] * 3}, "(2,)"),
    ({"steps_left": 3, "elapsed_steps": 3}, "give only one of them"),
])  # fmt: skip
def test_a_vector_refuses_options_that_exclude_each_other(options: dict, words: str) -> None:
    envs = HRCVectorEnv(2, num_threads=1, perception="truth")
    with pytest.raises(ConfigError) as error:
        envs.reset(seed=0, options=options)
    assert words in str(error.value)


@pytest.mark.parametrize("options", [{"steps_left": 3}, {"goal": (3, 3, 3)}, {"gaol": GOAL}])
def test_what_cannot_hold_for_all_resets_is_refused_when_it_is_set(options: dict) -> None:
    with pytest.raises(ConfigError):
        make().set_options(options)
    envs = HRCVectorEnv(2, num_threads=1, perception="truth")
    with pytest.raises(ConfigError):
        envs.set_options(options)
    with pytest.raises(ConfigError):
        envs.call("set_options", options)


def test_a_task_without_goals_says_which_take_one() -> None:
    with pytest.raises(ConfigError, match="HRCReach-v0, HRCReachGoal-v0"):
        make("HRCPickPlace-v0", perception="truth").reset(options={"goal": GOAL})


@pytest.mark.parametrize("factors", [{"gaol": 2.0}, {"goal": np.nan}, {"goal": "much"}])
def test_factors_that_cannot_be_are_refused(factors: dict) -> None:
    with pytest.raises(ConfigError):
        make(perception="truth").set_reward(factors=factors)


@pytest.mark.parametrize("cameras", [{"max_shift_m": -1.0}, {"max_focal_change": 1.0},
                                     {"nominal": "lab_gopr"}, {"n_cameras": 5},
                                     {"max_shift_m": 50.0}])  # fmt: skip
def test_rigs_that_cannot_be_are_refused_at_make(cameras: dict) -> None:
    with pytest.raises(ConfigError):
        make(cameras=cameras)


def test_a_record_of_options_is_as_good_as_a_mapping() -> None:
    env = make()
    assert_same(episode(env, 2, {"goal": GOAL}), episode(env, 2, ResetOptions(goal=GOAL)))


def test_pixels_take_a_rig_of_the_episode(pixels) -> None:
    env = make(perception="pixels", render_mode="rgb_array")
    free = episode(env, 4)
    options = {"cameras": DRAWN, "faults": [{"kind": "noise", "cameras": ["all"],
               "amount": [1.0, 5.0]}], "appearance": "varied"}  # fmt: skip
    drawn = episode(env, 4, options)
    assert_same(drawn, episode(make(perception="pixels"), 4, options))
    assert env.mosaic().ndim == 3
    assert_same(free, episode(env, 4))
    env.close()


GOPRO = Lens("kannala_brandt", (0.0667,))


def test_lenses_are_drawn_and_people_are_tracked_through_them() -> None:
    env = make(cameras=RigDistribution(lenses=(Lens(), GOPRO)))
    worn, errors_m = set(), []
    for seed in range(4):
        env.reset(seed=seed)
        worn |= {camera.lens.model for camera in env.rig}
        for _ in range(20):
            *_, info = env.step(np.zeros(6, np.float32))
            errors_m.append(info["tracking/mpjpe_m"])
    assert worn == {"none", "kannala_brandt"}
    assert np.nanmedian(errors_m) < 0.1


@pytest.mark.usefixtures("pixels")
def test_images_are_of_the_rig_of_the_episode() -> None:
    """The image of a camera that does not hang is black; with the same rig images are the same."""
    env = make(observe_images=(32, 48))
    two = {"cameras": ["camera_3", "camera_1"]}
    whole, _ = env.reset(seed=1)
    fewer, _ = env.reset(seed=1, options=two)
    for name in ("image_camera_1", "image_camera_3"):
        np.testing.assert_array_equal(whole[name], fewer[name])
    assert not fewer["image_camera_2"].any()
    drawn, _ = env.reset(seed=1, options={"cameras": RigDistribution(max_rotation_rad=0.2)})
    assert (drawn["image_camera_1"] != whole["image_camera_1"]).any()
    again, _ = env.reset(seed=1)
    np.testing.assert_array_equal(whole["image_camera_2"], again["image_camera_2"])


@pytest.mark.usefixtures("pixels")
def test_images_take_a_lens_where_the_environment_was_made_for_lenses() -> None:
    lenses = RigDistribution(lenses=(GOPRO,))
    with pytest.raises(ConfigError, match="was created to observe images of cameras without"):
        make(observe_images=(32, 32)).reset(seed=1, options={"cameras": lenses})
    env = make(observe_images=(32, 32), cameras=lenses)
    seen, _ = env.reset(seed=1)
    assert len(np.unique(seen["image_camera_1"])) > 20


def test_images_show_no_other_rig_where_nothing_looks_through_cameras(pixels) -> None:
    env = make(perception="truth", observe_images=(32, 32))
    with pytest.raises(ConfigError, match="requires a perception level with cameras"):
        env.reset(seed=1, options={"cameras": ["camera_1"]})


def test_drawn_cameras_hang_in_the_room() -> None:
    """The laboratory's walls, and its ceiling, end at 3.045, 2.74 and 2.59 m."""
    env = make(cameras=RigDistribution(max_shift_m=0.3, n_cameras=4))
    for seed in range(10):
        env.reset(seed=seed)
        eyes_world = np.abs([camera.eye_world for camera in env.rig])
        assert (eyes_world < (3.045, 2.74, 2.59)).all()


def test_where_images_would_show_a_rig_that_is_not_drawn_it_is_refused() -> None:
    drawn = RigDistribution(max_shift_m=0.1)
    with pytest.raises(ConfigError, match="with perception='truth' no rig is drawn"):
        make(perception="truth", observe_images=(32, 32), cameras=drawn)
