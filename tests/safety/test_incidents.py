"""What is counted of people: contacts by kind, how hard, near misses, distances that are broken."""

import numpy as np
import pytest

from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import make_agent
from hrc_env.core.errors import ConfigError
from hrc_env.env import HRCEnv
from hrc_env.geometry import shapes
from hrc_env.geometry.chains import SerialChain, robot_state
from hrc_env.geometry.inertia import LinkInertias
from hrc_env.geometry.robot_model import RobotModel
from hrc_env.motion import generator
from hrc_env.motion.starts import measure_gap_m
from hrc_env.safety import contact, incidents
from hrc_env.safety.contact import clamping_force, contact_force
from hrc_env.safety.cost import COMPONENTS, CostConfig, find_unsafe, measure_cost
from hrc_env.safety.incidents import (
    KINDS,
    TouchingRobots,
    detect_incidents,
    make_history,
    make_recent_motion,
)
from hrc_env.settings import resolve_settings
from hrc_env.simulation import Simulation, worker_truth
from hrc_env.vector.env import HRCVectorEnv
from hrc_env.worker.body import load_body
from hrc_env.world import World

DT, T = 0.04, 5
REGIONS = incidents.find_regions(["left_hand", "head"])


def a_slide(mass_kg=15.0, wall_m=None):
    """A robot of one link that slides along x, perhaps before a wall at a place on x [m]."""
    along_x = np.eye(4)
    along_x[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]  # z of the slide is the world's x
    chain = SerialChain(
        np.eye(4), along_x[None], np.eye(4), np.array([[-9.0, 9.0]]), np.ones(1),
        np.ones(1, bool), np.zeros(1, int), np.zeros((1, 2, 3)), np.array([0.1]),
    )  # fmt: skip
    one = np.ones(1)
    inertias = LinkInertias(mass_kg * one, np.zeros((1, 3)), np.zeros((1, 3, 3)), 0.0 * one)
    walls = np.zeros((0, shapes.WIDTH))
    if wall_m is not None:
        centre, half = np.array([wall_m + 0.1, 0.0, 0.0]), np.array([0.1, 2.0, 2.0])
        walls = shapes.shape(shapes.BOX, centre, np.eye(3), half)[None]
    return RobotModel(chain, one, one, 0.5 * mass_kg, np.zeros(0), inertias, walls)


class Line:
    """A robot of one ball and a worker of a hand, and a head 5 m behind it, that move along x."""

    def __init__(self, gap_m=0.5, n_workers=1, wall_m=None):
        self.robot = TouchingRobots(a_slide(wall_m=wall_m), np.zeros((1, 1)), np.zeros(1))
        self.state, self.robot_m = make_history(1, n_workers), 0.0
        self.recent = make_recent_motion(1, 1, n_workers, 2)
        self.hand_m = np.full(n_workers, gap_m + 0.2)
        self.time_to_stop_s = 0.1

    def step(self, robot_m_s=0.0, hand_m_s=0.0):
        """Both move on; what happened to each worker, (W,)."""
        ahead = np.arange(1, T + 1) / T * DT
        robot, hand = self.robot_m + robot_m_s * ahead, self.hand_m + hand_m_s * ahead[:, None]
        self.robot_m, self.hand_m = robot[-1], hand[-1]
        n = self.hand_m.size
        robots, workers = np.zeros((1, T, 1, 2, 3)), np.zeros((1, T, n, 2, 2, 3))
        robots[..., 0] = robot[None, :, None, None]
        workers[..., 0] = hand[None, :, :, None, None] + [[0.0], [5.0]]
        paths = incidents.measure_paths(robots, np.array([0.1]), workers, np.full((1, n, 2), 0.1))
        given = paths, REGIONS, self.robot, np.array([0.1]), DT
        nobody = np.zeros((1, n), bool)
        found = detect_incidents(self.state, self.recent, *given)
        self.is_unsafe = find_unsafe(measure_cost(paths.gaps_m, CostConfig()), found, nobody)[0]
        return found[0]


def begun(line, *speeds):
    """Kinds of contacts that begin in steps with these speeds of robot and hand, in their order."""
    found = [line.step(*speed)[0] for speed in speeds]
    return [KINDS[each["kind"]] for each in found if each["kind"] >= 0]


def test_directed_speeds_are_what_narrows_the_gap():
    found = Line(0.5).step(0.6, -1.0)[0]
    assert (found["robot_m_s"], found["worker_m_s"]) == pytest.approx((0.6, 1.0))
    assert found["separation_m"] == pytest.approx(0.5 - 1.6 * DT)
    assert np.isnan(Line(1.5).step(0.6)[0]["robot_m_s"])


@pytest.mark.parametrize(
    ("robot_m_s", "kind"), [(0.3, "towards"), (-0.3, "fleeing"), (0.0, "standing")]
)
def test_a_contact_is_named_by_what_the_robot_did_in_the_step_before(robot_m_s, kind):
    line = Line(0.04)
    assert begun(line, (robot_m_s, -0.2), (-robot_m_s, -3.0), (0.0, 0.0)) == [kind]
    assert line.state["contacts"].sum() == 1
    assert line.state["contacts"][0, 0, KINDS.index(kind)] == 1


def test_who_touches_again_within_half_a_second_is_in_the_same_contact():
    line = Line(0.03)
    bounce = [(0.5, 0.0), (0.0, -1.0), (-1.5, 0.0), (0.0, 0.0), (1.5, 0.0), (-2.0, 0.0)]
    assert begun(line, *bounce) == ["towards"]
    away = [(0.0, 0.0)] * 13
    assert begun(line, *away, (1.0, 0.0), (1.5, 0.0)) == ["towards"]


def test_how_hard_a_contact_is_follows_from_region_and_closing_speed():
    line = Line(0.03)
    line.step(0.4, 0.0)
    hit = line.step(0.4, -1.0)[0]
    assert (hit["robot_speed_m_s"], hit["closing_speed_m_s"]) == pytest.approx((0.4, 1.4))
    assert incidents.REGION_NAMES[hit["region"]] == "hand and fingers"
    assert hit["force_ratio"] == pytest.approx(contact_force("hand and fingers", 1.4, 15.0) / 280.0)
    assert hit["severity"] == (1 if hit["force_ratio"] <= 1 else 2)


def test_a_contact_is_of_the_pair_that_touches_though_another_is_nearer_before():
    """One ball of the robot stands 1 cm from the head; the other one drives into the hand."""
    history, recent, found = make_history(1, 1), make_recent_motion(1, 2, 1, 2), None
    ahead = np.arange(1, T + 1) / T * DT
    for k in range(3):
        robots, workers = np.zeros((1, T, 2, 2, 3)), np.zeros((1, T, 1, 2, 2, 3))
        robots[0, :, 0, :, 0] = 0.4 * (k * DT + ahead)[:, None]
        robots[0, :, 1, :, 0] = 9.0
        workers[0, :, 0, 0, :, 0], workers[0, :, 0, 1, :, 0] = 0.24, 9.21
        radius_m = np.full((1, 1, 2), 0.1)
        paths = incidents.measure_paths(robots, np.full(2, 0.1), workers, radius_m)
        given = paths, REGIONS, Line().robot, np.array([0.1]), DT
        found = detect_incidents(history, recent, *given)[0, 0]
    assert KINDS[found["kind"]] == "towards"
    assert incidents.REGION_NAMES[found["region"]] == "hand and fingers"
    assert (found["robot_speed_m_s"], found["closing_speed_m_s"]) == pytest.approx((0.4, 0.4))
    assert found["force_ratio"] > 0.0
    assert history["contacts"][0, 0].tolist() == [1, 0, 0]


def test_a_robot_that_has_just_stopped_is_named_by_its_last_step_and_its_recent_speed_is_told():
    line = Line(0.1)
    for speed in (0.5, 0.5, 0.0):
        line.step(speed)
    hit = line.step(0.0, -2.0)[0]
    assert KINDS[hit["kind"]] == "standing"
    assert (hit["robot_speed_m_s"], hit["recent_robot_speed_m_s"]) == pytest.approx((0.0, 0.5))
    assert (hit["closing_speed_m_s"], hit["recent_closing_speed_m_s"]) == pytest.approx((2.0, 2.0))
    for _ in range(20):
        line.step(-0.5)
    assert line.step(20.0)[0]["recent_robot_speed_m_s"] < 0.0  # longer ago than five steps


def test_the_head_is_never_to_be_hit():
    assert incidents.CAPSULE_REGIONS["head"] == "skull and forehead"
    hit = np.zeros(1, incidents.INCIDENT)[0]
    hit["closing_speed_m_s"] = 0.01
    head = contact.REGIONS[incidents.REGION_NAMES[incidents.find_regions(["head"])[0]]]
    incidents._rate_contact(hit, head, 15.0)
    assert hit["severity"] == incidents.NEVER
    assert 0 < hit["force_ratio"] < 1


@pytest.mark.parametrize(
    ("wall_m", "robot_m_s", "hand_m_s", "clamped"),
    [
        (0.42, 0.4, 0.0, True),  # the wall is 9 cm behind the hand
        (0.47, 0.4, 0.0, False),  # 14 cm
        (None, 0.4, 0.0, False),
        (0.36, 0.0, -1.0, False),  # the hand comes to a robot that stands
        (0.40, 0.4, -3.0, True),  # the blow of a hand is harder than the wall
    ],
)
def test_a_hand_before_a_wall_is_clamped_by_a_robot_that_moves_towards_it(
    wall_m, robot_m_s, hand_m_s, clamped
):
    line = Line(0.03, wall_m=wall_m)
    line.step(robot_m_s, 0.0)
    found, at_m = [], line.hand_m.copy()
    while not found:
        hit = line.step(robot_m_s, hand_m_s)[0]
        found += [hit] if hit["kind"] >= 0 else []
    assert at_m == pytest.approx(0.23)
    closing_m_s = robot_m_s - hand_m_s
    free = contact_force("hand and fingers", closing_m_s, 15.0) / 280.0
    pressed = clamping_force("hand and fingers", robot_m_s, 15.0) / 140.0
    assert bool(hit["is_clamped"]) == clamped
    assert hit["force_ratio"] == pytest.approx(max(free, pressed) if clamped else free)
    told = incidents.summarize(np.array([[hit]]), line.state)[0]
    assert told["contact_is_clamped"] == clamped


def test_a_load_makes_a_contact_harder():
    ratios = []
    for load_kg in (0.0, 10.0):
        line = Line(0.03)
        line.robot.load_kg[:] = load_kg
        line.step(0.4)
        ratios.append(line.step(0.4)[0]["force_ratio"])
    masses = contact_force("hand and fingers", 0.4, np.array([15.0, 25.0])) / 280.0
    assert ratios == pytest.approx(masses.tolist())


def test_a_near_miss_ends_without_a_touch():
    line = Line(0.12)
    passed = [line.step(*v)[0]["is_near_miss"] for v in [(2.0, 0.0), (-1.0, 0.0), (-1.0, 0.0)]]
    assert passed == [False, False, True]
    touched = Line(0.12)
    for speed in (3.0, 2.0, -4.0, -4.0, -4.0):
        assert not touched.step(speed)[0]["is_near_miss"]
    assert touched.state["near_misses"] == 0


def test_too_near_is_nearer_than_the_protective_distance_while_the_robot_comes():
    """S_p = 1.6 x 0.2 + 0.5 x 0.15 = 0.395 m."""
    assert Line(0.40).step(0.5, -1.6)[0]["is_separation_violated"]
    assert not Line(0.50).step(0.5, -1.6)[0]["is_separation_violated"]
    assert not Line(0.20).step(0.0, -1.6)[0]["is_separation_violated"]


def test_every_worker_has_contacts_of_their_own():
    line = Line(0.02, n_workers=2)
    line.hand_m[1] += 0.05
    line.step(0.3)
    found = [line.step(0.6) for _ in range(3)]
    kinds = np.array([each["kind"] for each in found])
    assert (kinds >= 0).sum(0).tolist() == [1, 1]


def test_every_capsule_of_a_body_is_of_a_region():
    assert set(load_body().capsule_names) == set(incidents.CAPSULE_REGIONS)


@pytest.mark.parametrize(
    ("components", "words"),
    [
        ((), "one or more different names"),
        (("contact", "contact"), "one or more different names"),
        (("contacts",), "Unknown cost component 'contacts'"),
    ],
)
def test_a_cost_of_other_parts_is_refused(components, words):
    with pytest.raises(ConfigError, match=words):
        CostConfig(components=components)


@pytest.mark.parametrize(
    ("gap_m", "speeds", "unsafe"),
    [
        (0.14, [(0.06, 0.0)], [1]),  # near, and it comes
        (0.14, [(0.04, -1.0)], [0]),  # near, and the worker comes
        (0.30, [(0.5, 0.0)], [0]),  # far
        (0.12, [(0.0, -2.0), (0.0, -3.0)], [0, 0]),  # it stands and is touched, however hard
        (0.05, [(-0.2, -1.0), (-0.2, -0.8)], [0, 0]),  # it flees and is touched softly enough
        (0.15, [(-0.2, -2.5), (-0.2, -4.0)], [0, 1]),  # it flees too late
        (0.03, [(0.5, 0.0), (0.0, -1.0)], [1, 1]),  # it moves into a hand, and stops in the touch
    ],
)  # fmt: skip
def test_a_step_is_unsafe_if_the_robot_endangers_somebody(gap_m, speeds, unsafe):
    line, found = Line(gap_m), []
    for speed in speeds:
        line.step(*speed)
        found.append(line.is_unsafe)
    assert found == unsafe


def standing(n_steps, batch=24, seed=0):
    """A simulation in which robots stand beside people who ignore them, with its infos."""
    known = {"perception": "none", "people": "unaware", "config": {"worker": "any"}}
    simulation = Simulation(batch, resolve_settings(**known))
    rngs = [np.random.default_rng(seed + b) for b in range(batch)]
    simulation.reset(np.arange(batch), rngs)
    for _ in range(n_steps):
        yield simulation, simulation.step(np.zeros((batch, 6))).info


def test_a_standing_robot_that_is_touched_costs_nothing_although_it_springs_back():
    costs, touches, springs, kinds = 0.0, 0.0, 0.0, {}
    for _, info in standing(200):
        costs += info["cost"].sum()
        touches += info["cost_contact"].sum()
        near = info["cost_proximity"] > 0
        springs += (near & (info["safety/robot_towards_m_s"] > incidents.MOVING_M_S)).sum()
        kinds = {kind: info[f"safety/contacts_{kind}"].sum() for kind in KINDS}
    assert costs == 0.0
    assert touches > 20
    assert springs > 5
    assert kinds["standing"] > 1 > kinds["towards"]


def test_whoever_is_touched_and_then_drives_on_is_not_pushed():
    """By a command in one direction or in the other, of the fastest that there is."""
    for simulation, info in standing(200):
        monitor = simulation.monitor
        touched = np.flatnonzero(info["cost_contact"])
        if len(touched) and (monitor.last_kind[touched] == KINDS.index("standing")).all():
            break
    else:
        pytest.fail("nobody was touched")
    world = make_world(simulation)
    nothing = np.zeros((24, 6))
    assert monitor.find_pushed(*world, nothing)[touched].all()
    found = []
    for joint in range(6):
        for sign in (-1.0, 1.0):
            command = nothing.copy()
            command[:, joint] = sign * 1e3  # limited to what an action can command
            found.append(monitor.find_pushed(*world, command)[touched])
    assert not np.all(found, axis=0).any()
    assert np.any(found, axis=0).all()
    assert monitor.find_pushed(*world, np.full((24, 6), np.nan))[touched].all()
    monitor.last_kind[touched] = KINDS.index("towards")  # whoever drove in is not pushed
    assert not monitor.find_pushed(*world, nothing)[touched].any()


def make_world(simulation):
    """The robots, and the bodies as they are now, as `find_pushed` takes them."""
    truth = worker_truth(simulation.bodies, generator.current(simulation.motion))
    robot = robot_state(simulation.chain, simulation.physics.q, simulation.physics.qd)
    paths = incidents.measure_paths(
        robot.capsules_world[:, None], robot.capsule_radius_m, truth.capsules_world[:, None],
        truth.capsule_radius_m,
    )  # fmt: skip
    return World(robot), paths


def test_the_cost_of_a_step_is_an_indicator_and_the_former_sum_is_an_option():
    agreed = {"components": ("proximity", "contact")}
    _, (first, *infos) = played(200)
    _, former = played(200, config={"cost": agreed})
    assert "cost_unsafe" in first
    assert "cost_unsafe" not in former[0]
    cost = np.array([info["cost"] for info in infos])
    assert np.unique(cost).tolist() == [0.0, 1.0]
    for info, old in zip(infos, former[1:], strict=True):
        assert (info["cost"] == info["cost_unsafe"]).all()
        assert (info["cost"] <= info["cost_proximity"] + info["cost_contact"]).all()
        assert (old["cost"] == info["cost_proximity"] + info["cost_contact"]).all()
    assert max(old["cost"].max() for old in former) == 2.0


def test_a_robot_that_leaves_a_near_worker_for_one_far_away_is_safe():
    line = Line(0.14, n_workers=2)
    line.hand_m[1] = -0.8
    found = line.step(-0.5)
    assert found["robot_m_s"].tolist() == pytest.approx([-0.5, 0.5])
    assert not line.is_unsafe


def test_a_hand_that_slowed_down_before_the_touch_has_its_recent_speed():
    line = Line(0.12)
    for speed in (-2.0, -0.5):
        line.step(0.0, speed)
    hit = line.step(0.0, -0.6)[0]
    assert hit["closing_speed_m_s"] == pytest.approx(0.6)
    assert hit["recent_closing_speed_m_s"] == pytest.approx(2.0)


def test_an_episode_begins_without_the_motion_of_the_last_one():
    line = Line(0.1)
    line.step(0.5)
    assert line.recent.robot_world.any()
    monitor = Simulation(2, resolve_settings(perception="none")).monitor
    monitor.recent.robot_world[:], monitor.recent.workers_world[:] = 1.0, 1.0
    monitor.recent.n_steps[:] = 3
    monitor.reset(np.array([1]))
    for values in (monitor.recent.robot_world, monitor.recent.workers_world):
        assert values[0].all()
        assert not values[1].any()
    assert monitor.recent.n_steps.tolist() == [3, 0]


def played(n_steps, batch=24, **arguments):
    """A simulation with a robot that heeds nobody, and its infos, the reset's first."""
    simulation = Simulation(
        batch, resolve_settings(perception="none", people="unaware", **arguments)
    )
    agent = make_agent("scripted", env_info(simulation))
    ids, rngs = np.arange(batch), [np.random.default_rng(b) for b in range(batch)]
    results = [simulation.reset(ids, rngs)]
    for _ in range(n_steps):
        results.append(simulation.step(agent.act(results[-1].observation)))
    return simulation, [result.info for result in results]


def test_info_says_what_happened_and_chosen_parts_are_the_cost():
    _, (first, *infos) = played(200, config={"cost": {"components": COMPONENTS}})
    assert not (first["safety/contacts_towards"] + first["cost_towards"]).any()
    kinds = np.array([info["worker_0/contact_kind"] for info in infos])
    assert (kinds >= 0).sum() > 5
    for info, kind in zip(infos, kinds, strict=True):
        assert ((info["worker_0/contact_region"] >= 0) == (kind >= 0)).all()
        assert (np.isfinite(info["safety/contact_force_ratio"]) == (kind >= 0)).all()
        assert info["cost_towards"].tolist() == (kind == KINDS.index("towards")).tolist()
        parts = sum(info[f"cost_{name}"] for name in COMPONENTS)
        assert info["cost"] == pytest.approx(parts)
        assert (info["cost"] == info["cost_sum"]).all()
    for k, name in enumerate(KINDS):
        assert infos[-1][f"safety/contacts_{name}"].tolist() == (kinds == k).sum(0).tolist()
    assert infos[-1]["episode_cost"] == pytest.approx(sum(info["cost"] for info in infos))


def test_directed_speeds_add_up_to_how_the_gap_closes():
    simulation, _ = played(40, batch=40)
    moving = simulation.motion, simulation.chain, simulation.bodies
    before = measure_gap_m(np.arange(40), simulation.physics.q, *moving)
    info = simulation.step(np.zeros((40, 6))).info
    closing = (before - measure_gap_m(np.arange(40), simulation.physics.q, *moving)) / DT
    both = info["safety/robot_towards_m_s"] + info["safety/worker_towards_m_s"]
    near = np.isfinite(both)
    assert near.sum() > 10
    assert both[near] == pytest.approx(closing[near], abs=0.25)


def test_without_workers_nothing_happens():
    _, (_, *infos) = played(5, batch=1, n_workers=0)
    assert not [name for name in infos[-1] if name.startswith("worker_")]
    assert np.isnan(infos[-1]["safety/robot_towards_m_s"])
    assert infos[-1]["safety/time_to_stop_s"] > 0


def test_a_batch_counts_what_its_environments_do_and_states_keep_it():
    several = HRCVectorEnv(3, perception="none", people="unaware", num_threads=1)
    single = HRCEnv(perception="none", people="unaware")
    several.reset(seed=11)
    single.reset(seed=12)
    rng = np.random.default_rng(5)
    for _ in range(80):
        action = np.sign(rng.uniform(-1, 1, (3, 6))).astype(np.float32)
        told, alone = several.step(action)[4], single.step(action[1])[4]
        for name, value in alone.items():
            if name.startswith("safety/"):
                assert told[name][1] == value
    watched = single.simulation.monitor.history
    watched["contacts"], watched["since_s"] = 7, 0.1
    state = single.get_state()
    single.reset(seed=1)
    assert not single.simulation.monitor.history["contacts"].any()
    single.set_state(state)
    assert single.simulation.monitor.history["contacts"].sum() == 21


def test_what_is_carried_hits_harder():
    simulation = Simulation(1, resolve_settings(task="HRCPickPlace-v0", perception="none"))
    assert 5.0 < simulation.model.mass_kg < 40.0
    assert simulation.model.load_kg == pytest.approx(0.5)
