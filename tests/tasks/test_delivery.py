"""HRCDelivery-v0: a base that drives brings material across the site."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from hrc_env.agents.env_info import env_info
from hrc_env.agents.experts import make_expert
from hrc_env.agents.scripted import Yielding
from hrc_env.core.errors import ConfigError
from hrc_env.geometry import chains
from hrc_env.geometry.ways import find_overlaps, gaps_m, ranges_m, value_at, ways_m
from hrc_env.motion import generator
from hrc_env.motion.anatomy import CHEST
from hrc_env.scene.build import build
from hrc_env.scene.robot import ROBOTS, make_chain
from hrc_env.tasks import delivery
from hrc_env.world import World

ID = "HRCDelivery-v0"
BASE = make_chain(ROBOTS["mobile_base"], (0.0, 0.0, 0.0))
SITE = build(name="site", robot="mobile_base")
TASK = delivery.Delivery()
CONFIG = TASK.config
PLACE = TASK.survey(SITE.map)
ANYWHERE = np.zeros(3), np.zeros(3)
"""Home and spread, which starts of bases do not depend on."""
WALL = np.array([[1.0, 0.0, 0.1, 3.0, 0.0]])
"""A wall along y at x = 0.9 to 1.1."""


def world(*places: tuple[float, float, float], qd: float = 0.0, touched: bool = False) -> World:
    q = np.array(places)
    robot = chains.robot_state(BASE, q, np.full_like(q, qd))
    return World(robot, touched=np.full(len(q), touched), place=PLACE)


def begun(*places: tuple[float, float, float]) -> np.ndarray:
    state = TASK.make_state(len(places))
    rngs = [np.random.default_rng(k) for k in range(len(places))]
    TASK.reset(state, np.arange(len(places)), rngs, world(*places))
    return state


def moved(state: np.ndarray, now: World, task: delivery.Delivery = TASK) -> np.ndarray:
    return task.advance(state, [np.random.default_rng(0)] * len(state), now, 0.04)


def at(zone: int) -> tuple[float, float, float]:
    return (*PLACE.zones[zone].tolist(), 0.0)


def played(env, agent, seed: int, n_steps: int = 1000) -> tuple[list[float], dict, np.ndarray]:
    observation, info = env.reset(seed=seed)
    rewards, observations = [], [observation]
    for _ in range(n_steps):
        observation, reward, terminated, truncated, info = env.step(agent(observation))
        rewards.append(reward)
        observations.append(observation)
        if terminated or truncated:
            break
    return rewards, info, np.array(observations)


def test_ways_lead_round_a_wall_and_cost_what_they_are_long():
    xs = ys = np.arange(-5.0, 5.01, 0.2)
    gaps = gaps_m(xs, ys, WALL)
    price = np.where(gaps > 0.4, 1.0, np.inf)
    origin = np.array([-5.0, -5.0])
    ways = ways_m(price, (35, 25), 0.2)  # the goal at (2, 0), behind the wall
    before = value_at(0.0, 0.0, ways, origin, 0.2)
    round_it = np.hypot(0.9, 3.4) + np.hypot(0.9, 3.4) + 0.2
    assert round_it < before < 1.15 * round_it
    assert np.isfinite(ways).all()
    beside = value_at(0.7, 0.0, ways, origin, 0.2)  # not free: as on the nearest free ground
    assert abs(beside - value_at(0.4, 0.0, ways, origin, 0.2)) < 0.5
    assert value_at(1.3, 0.0, ways, origin, 0.2) < 1.2


def test_rays_end_at_what_stands_there():
    xs = ys = np.arange(-8.0, 8.01, 0.1)
    gaps = gaps_m(xs, ys, WALL)
    places = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, np.pi / 2]])
    found = ranges_m(places, np.array([0.0, -np.pi / 2]), gaps, xs[[0, 0]], 0.1, 6.0)
    np.testing.assert_allclose(found, [[0.9, 6.0], [0.4, 6.0]], atol=0.03)


@pytest.mark.parametrize(
    ("x", "yaw", "touches"),
    [(0.39, 0.0, False), (0.41, 0.0, True), (0.52, np.pi / 2, False), (0.55, np.pi / 2, True)],
)
def test_a_base_meets_a_wall_where_its_outline_does(x, yaw, touches):
    robot = chains.robot_state(BASE, np.array([[x, 0.0, yaw]]), np.zeros((1, 3)))
    assert find_overlaps(robot.capsules_world, robot.capsule_radius_m, WALL)[0] == touches


def test_zones_are_free_and_where_nobody_works():
    works = np.array([place.xy_m for place in SITE.map.places])
    assert len(PLACE.zones) > 10
    for x, y in PLACE.zones.tolist():
        assert gaps_m(np.array([x]), np.array([y]), PLACE.footprints)[0, 0] > 0.7
        assert np.hypot(*(works - [x, y]).T).min() > 1.5
    x, y = SITE.grounds.robot_xy_m  # the pedestal is in the way
    assert gaps_m(np.array([x]), np.array([y]), PLACE.footprints)[0, 0] < 0


def test_starts_and_destinations_are_seeded_and_far_enough_apart():
    rngs = [np.random.default_rng(seed) for seed in range(20)]
    starts = TASK.draw_start(rngs, PLACE, *ANYWHERE)
    again = TASK.draw_start([np.random.default_rng(seed) for seed in range(20)], PLACE, *ANYWHERE)
    np.testing.assert_array_equal(starts, again)
    state = begun(*map(tuple, starts.tolist()))
    low, high = CONFIG.way_m
    assert (state["way_m"] > low - 0.5).all()
    assert (state["way_m"] < high + 0.5).all()
    assert len(np.unique(state["zone"])) > 4


def test_the_material_is_delivered_when_the_base_stands_in_its_zone():
    state = begun(at(0), at(0))
    goal = at(int(state["zone"][0]))
    driving = moved(state.copy(), world(goal, goal, qd=0.3))
    assert not driving["delivered"].any()
    standing = moved(state, world(goal, at(0)))
    assert standing["delivered"].tolist() == [True, False]
    info = TASK.info(state)
    assert info["is_success"].tolist() == info["task/delivered"].tolist() == [1.0, 0.0]
    assert info["task/not_delivered"].tolist() == [0.0, 1.0]


@pytest.mark.parametrize("what", ["obstacle", "worker"])
def test_who_hits_something_has_not_delivered(what):
    state = begun(at(0))
    x, y = SITE.grounds.robot_xy_m
    struck = world((x - 0.4, y, 0.0)) if what == "obstacle" else world(at(0), touched=True)
    for _ in range(3):  # one hit, however long it lasts
        step = moved(state, struck)
    assert not step["hit"][0]
    moved(state, world(at(int(state["zone"][0]))))
    info = TASK.info(state)
    assert info[f"task/{what}_collisions"][0] == 1
    assert info["is_success"][0] == 0


def test_the_way_gained_is_what_was_left_and_cannot_be_farmed():
    state, rng = begun(at(0)), np.random.default_rng(5)
    first_m, gained_m = state["way_m"][0], 0.0
    for _ in range(200):
        place = (*rng.uniform(-5, 5, 2), 0.0)
        gained_m += moved(state, world(place))["progress_m"][0]
    assert gained_m == pytest.approx(first_m - state["way_m"][0])
    assert gained_m < first_m


def test_a_sparse_reward_counts_the_delivery_only():
    env = gymnasium.make(ID, perception="none", n_workers=0, config={"task": {"reward": "sparse"}})
    env.reset(seed=2)
    for _ in range(20):
        _, _, _, _, info = env.step(np.array([1.0, 0.2, 0.0], np.float32))
        assert info["reward/progress"] == info["reward/delivered"] == 0.0
    env.close()


def test_the_expert_delivers_and_its_way_is_the_seeds():
    env = gymnasium.make(ID, perception="truth")
    agent = make_expert(env_info(env.unwrapped.simulation))
    for seed in (3_000_000, 3_000_001):
        rewards, info, seen = played(env, agent.act, seed)
        assert info["is_success"]
        assert sum(rewards) > CONFIG.delivered_bonus
        _, _, again = played(env, make_expert(env_info(env.unwrapped.simulation)).act, seed)
        np.testing.assert_array_equal(seen, again)
    env.close()


def test_who_yields_is_never_faster_and_stops_beside_people():
    env = gymnasium.make(ID, perception="truth", n_workers=1)
    simulation = env.unwrapped.simulation
    free, yields = (make_expert(env_info(simulation), each) for each in (None, Yielding()))
    observation, _ = env.reset(seed=3_000_000)
    np.testing.assert_array_equal(free.act(observation), yields.act(observation))
    near = observation.copy()
    near[simulation.layout.slices["worker_separation"]] = 0.05 / 0.5
    assert np.abs(free.act(near)).max() > 0.1
    np.testing.assert_array_equal(yields.act(near), 0.0)
    env.close()


def test_many_are_as_one():
    seeds, n_steps = (5, 6, 7), 60
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (n_steps, 3, 3)).astype(np.float32)
    envs = gymnasium.make_vec(ID, num_envs=3, perception="keypoints", num_threads=2)
    together = [envs.reset(seed=list(seeds))[0]]
    together += [envs.step(action)[0].copy() for action in actions]
    env = gymnasium.make(ID, perception="keypoints")
    alone = [env.reset(seed=seeds[1])[0], *(env.step(action[1])[0] for action in actions)]
    np.testing.assert_array_equal(np.array(together)[:, 1], np.array(alone))
    env.close()
    envs.close()


def test_wild_driving_breaks_nothing():
    envs = gymnasium.make_vec(ID, num_envs=16, perception="truth", n_workers=(3, 6))
    observation, _ = envs.reset(seed=0)
    rng, way = np.random.default_rng(1), np.zeros((16, 3), np.float32)
    for step in range(250):
        if step % 25 == 0:  # straight on, into whatever stands there
            way = rng.uniform(-1, 1, (16, 3)).astype(np.float32).round()
        observation, reward, _, _, _ = envs.step(way)
        assert np.isfinite(observation).all()
        assert np.isfinite(reward).all()
    q = envs.unwrapped.shards.first.physics.q
    assert np.abs(q[:, :2]).max() < BASE.range_rad[0, 1]
    hits = TASK.info(envs.unwrapped.shards.first.task_state)["task/obstacle_collisions"]
    assert hits.max() > 0
    envs.close()


@pytest.mark.parametrize(("people", "met"), [("attentive", False), ("unaware", True)])
def test_walkers_stop_for_a_base_that_gets_in_their_way(people, met):
    env = gymnasium.make(ID, perception="none", n_workers=1, people=people)
    simulation, hits, tries = env.unwrapped.simulation, 0, 0
    for seed in range(16):
        env.reset(seed=seed)
        for _ in range(400):
            env.step(np.zeros(3, np.float32))
            motion = generator.current(simulation.motion, np.array([0]))
            chest, speed = motion.position_world[0, 0, CHEST], motion.velocity_world[0, 0, CHEST]
            if _walks(simulation) and np.hypot(*speed[:2]) > 0.9:
                break
        else:
            continue
        ahead = chest[:2] + 2.8 * speed[:2] / np.hypot(*speed[:2])
        simulation.physics.reset(np.array([0]), np.array([[*ahead, 0.0]]))
        tries += 1
        hits += any(env.step(np.zeros(3, np.float32))[4]["cost_contact"] > 0 for _ in range(75))
    assert tries >= 5
    assert (hits > tries // 2) if met else (hits <= 1)
    env.close()


def _walks(simulation) -> bool:
    activity = generator.activity(simulation.motion)[0, 0]
    return generator.activity_names[int(activity)] == "walk"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"scene": "lab"}, 'two zones .* Valid is scene="site"'),
        ({"control": "tool"}, 'valid is control="joint"'),
        ({"control": "twist"}, 'valid is control="joint"'),
        ({"robot": "ur10e_like"}, "a mobile robot, which 'ur10e_like' .* 'mobile_base'"),
        ({"config": {"task": {"way_m": (30.0, 40.0)}}}, "a path of 30 to 40 m"),
        ({"config": {"task": {"way_m": (8.0, 4.0)}}}, r"\(low, high\)"),
        ({"config": {"task": {"reward": "some"}}}, '"dense" or "sparse"'),
        ({"config": {"task": {"zone_m": 0.0}}}, "zone_m"),
    ],
)
def test_what_does_not_fit_is_said(arguments, said):
    with pytest.raises(ConfigError, match=said):
        gymnasium.make(ID, perception="truth", **arguments)


def test_an_arms_task_wants_an_arm():
    with pytest.raises(ConfigError, match="an arm on the pedestal, which 'mobile_base'"):
        gymnasium.make("HRCReach-v0", perception="truth", robot="mobile_base")


def test_a_command_for_a_hand_is_refused():
    env = gymnasium.make(ID, perception="none", n_workers=0)
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=r"\(3,\).*\(4,\)"):
        env.unwrapped.step(np.zeros(4, np.float32))
    env.close()


def test_no_reward_and_no_observation_reads_who_was_touched():
    state = begun(at(0))
    calm, touched = (state.copy() for _ in range(2))
    steps = moved(calm, world(at(1))), moved(touched, world(at(1), touched=True))
    np.testing.assert_array_equal(*steps)
    views = [TASK.view(each, np.array([0])) for each in (calm, touched)]
    for name in ("goal_world", "way_m", "way_direction", "ranges_m"):
        np.testing.assert_array_equal(*(getattr(each, name) for each in views))


def test_a_state_brings_an_episode_back():
    env = gymnasium.make(ID, perception="keypoints", n_workers=3)
    env.reset(seed=4)
    action = np.array([0.5, -0.5, 0.2], np.float32)
    for _ in range(10):
        env.step(action)
    kept = env.unwrapped.get_state()
    first = [env.step(action)[0] for _ in range(10)]
    env.unwrapped.set_state(kept)
    np.testing.assert_array_equal(first, [env.step(action)[0] for _ in range(10)])
    env.close()


def test_a_robot_of_ones_own_may_drive():
    slow = replace(ROBOTS["mobile_base"], name="slow_base", slew=(0.5, 0.5, 1.0))
    env = gymnasium.make(ID, perception="none", n_workers=0, robot=slow)
    env.reset(seed=0)
    env.step(np.array([1.0, 0.0, 0.0], np.float32))
    assert abs(env.unwrapped.simulation.physics.qd[0, 0]) < 0.03
    env.close()


def test_an_experts_action_hangs_on_its_own_observation_only():
    envs = gymnasium.make_vec(ID, num_envs=4, perception="truth", num_threads=1)
    simulation = envs.unwrapped.shards.first
    agent, few, alone = (make_expert(env_info(simulation)) for _ in range(3))
    few._fields = few._fields[:4]  # what is not followed now is forgotten
    observation, _ = envs.reset(seed=1)
    for _ in range(60):
        action = agent.act(observation)
        np.testing.assert_array_equal(action, few.act(observation))
        np.testing.assert_array_equal(action[2], alone.act(observation[2]))
        observation = envs.step(action)[0]
    envs.close()
