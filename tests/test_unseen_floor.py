"""Nobody is said to be absent from floor that cameras do not see: rigs, calibrations, robots."""

import warnings

import gymnasium
import numpy as np
import pytest

import hrc_env  # noqa: F401
from hrc_env import observations
from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import make_agent
from hrc_env.core.vacancy import EMPTY, POSSIBLE
from hrc_env.env import HRCEnv

EYES = ((2.9, 2.6, 2.4), (-2.9, 2.6, 2.4))
ALL = [f"camera_{k}" for k in (1, 2, 3, 4)]
EMPTY_SEED = 1
"""Of an episode for one worker or none in which none is there."""


def rig(target, hfov_deg, eyes=EYES):
    return [
        {"name": f"c{k}", "eye_world": eye, "target_world": target, "hfov_deg": hfov_deg}
        for k, eye in enumerate(eyes)
    ]


RIGS = {
    "see a part": rig((0.0, 2.2, 1.0), 60.0),
    "see another part": rig((2.0, -0.5, 1.0), 50.0, ((0.5, 2.6, 2.4), (2.9, -2.6, 2.4))),
    "face a wall": rig((0.0, 9.0, 1.0), 60.0),
    "look at the ceiling": rig((0.0, 0.0, 9.0), 40.0),
    "see the robot only": rig((-0.75, 0.0, 0.6), 12.0),
}
WRONG = {
    "turned": {"kind": "wrong_rotation", "cameras": ALL, "amount": 0.3},
    "two turned": {"kind": "wrong_rotation", "cameras": ALL[:2], "amount": 0.5},
    "moved": {"kind": "wrong_translation", "cameras": ALL, "amount": 1.0},
}


def played(n, n_steps, seed, agent=None, **arguments):
    """Terms of the observations (T, n, ...) of steps, and the true separation (T, n) [m]."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        arguments = {"perception": "keypoints", "people": "unaware", "num_threads": 1, **arguments}
        envs = gymnasium.make_vec("HRCReach-v0", n, **arguments)
    part = envs.unwrapped.shards.first
    policy = None if agent is None else make_agent(agent, env_info(part), seed=seed)
    seen, _ = envs.reset(seed=seed)
    told, apart_m = [], []
    for _ in range(n_steps):
        action = np.zeros((n, 6), np.float32) if policy is None else policy.act(seen)
        seen, *_, infos = envs.step(action)
        told.append(observations.split(seen, part.layout))
        apart_m.append(infos["safety/min_separation_m"])
    envs.close()
    terms = {name: np.array([each[name] for each in told]) for name in told[0]}
    return terms, np.array(apart_m), infos


def absent(terms):
    return (terms["worker_tracked"][..., 0] == 0) & (terms["worker_unknown"][..., 0] == 0)


@pytest.mark.parametrize("name", RIGS)
def test_no_rig_says_that_nobody_is_there_of_people_near_the_robot(name):
    terms, apart_m, _ = played(8, 100, 70, cameras=RIGS[name])
    assert (apart_m < 1.0).mean() > 0.5
    assert not (absent(terms) & (apart_m < 1.0)).any()


def test_the_scenes_own_cameras_say_that_an_empty_room_is_empty():
    for scene in ("lab", "site"):
        env = HRCEnv(perception="keypoints", n_workers=(0, 1), scene=scene)
        seed = EMPTY_SEED
        while env.reset(seed=seed) and env.simulation.present.any():
            seed += 1
        unknown = [env.split_observation(env.step(np.zeros(6, np.float32))[0])["worker_unknown"]]
        assert unknown == [[0.0]]
        empty = env.simulation.belief.unseen.level == EMPTY
        assert empty.mean() > (0.97 if scene == "site" else 0.999)


@pytest.mark.parametrize("name", WRONG)
def test_wrong_calibrations_are_named_and_leave_nobody_absent_nor_where_they_are_not(name):
    terms, apart_m, infos = played(8, 150, 71, faults=[WRONG[name]])
    assert not (absent(terms) & (apart_m < 1.0)).any()
    settled = terms["worker_unknown"][40:, :, 0]
    assert settled.mean() > 0.8
    assert np.mean([bool(named) for named in infos["perception/miscalibrated"]]) > 0.8


@pytest.mark.parametrize("people", ["hurried", "unaware"])
@pytest.mark.parametrize("scene", ["lab", "site"])
def test_the_scenes_own_rigs_are_never_taken_for_wrong_ones(people, scene):
    terms, _, _ = played(8, 150, 72, "scripted", people=people, scene=scene)
    assert not terms["worker_unknown"].any()


def test_where_no_camera_has_seen_the_floor_a_shielded_robot_reaches_nothing_and_hits_nobody():
    counts = {}
    for shield in (None, "qp"):
        _, _, infos = played(24, 200, 73, "scripted", cameras=RIGS["see a part"], shield=shield)
        counts[shield] = infos["safety/contacts_towards"].sum()
    assert counts[None] > 5
    assert counts["qp"] <= 1
    _, _, infos = played(8, 60, 73, "scripted", perception="none", shield="qp")
    assert not infos["task/goals_reached"].any()
    assert not infos["safety/contacts_towards"].any()


def test_a_belief_knows_where_somebody_may_be():
    env = HRCEnv(perception="keypoints", cameras=RIGS["face a wall"], n_workers=1)
    env.reset(seed=4)
    floor = env.simulation.belief.unseen
    assert (floor.level == POSSIBLE).all()
    assert floor.possible_m < 0.6
    assert np.isinf(floor.probable_m)
    seen = HRCEnv(perception="keypoints", n_workers=1)
    seen.reset(seed=4)
    assert (seen.simulation.belief.unseen.level == EMPTY).all()
    assert np.isinf(seen.simulation.belief.unseen.possible_m)
    assert HRCEnv(perception="truth").simulation.belief.unseen is None


@pytest.mark.slow
@pytest.mark.parametrize(("name", "least_named"), [("turned", 10), ("two turned", 0)])
def test_people_whom_searches_find_and_nothing_explains_are_not_absent(name, least_named):
    fault = {**WRONG[name], "amount": 0.5}
    env = HRCEnv(perception="pixels", people="unaware", faults=[fault])
    env.reset(seed=5)
    named = 0
    for step in range(70):
        observation, *_, info = env.step(np.zeros(6, np.float32))
        terms = env.split_observation(observation)
        near = info["safety/min_separation_m"] < 1.0
        assert terms["worker_tracked"][0] or terms["worker_unknown"][0] or not near, step
        named += bool(info["perception/miscalibrated"])
    env.close()
    assert named >= least_named


@pytest.mark.slow
def test_an_empty_room_is_known_to_be_empty_a_second_after_the_reset_at_pixels():
    env = HRCEnv(perception="pixels", n_workers=(0, 1))
    env.reset(seed=EMPTY_SEED)
    assert not env.simulation.present.any()
    rng = np.random.default_rng(0)
    unknown = [
        env.split_observation(env.step(rng.uniform(-1, 1, 6).astype(np.float32))[0])
        for _ in range(40)
    ]
    env.close()
    assert np.flatnonzero([each["worker_unknown"][0] == 0 for each in unknown])[0] <= 25
