"""The built-in shields in the environment: what they keep, leave alone, say and refuse."""

import pickle
from dataclasses import dataclass, replace

import gymnasium
import numpy as np
import pytest

import hrc_env
from hrc_env import simulation
from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import make_agent
from hrc_env.belief import drop_distant_unknown, estimated_separation, find_unseen_floor
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import ObjectState, WorkerPath
from hrc_env.core.skeleton import JOINT
from hrc_env.core.vacancy import EMPTY, POSSIBLE, PROBABLY_EMPTY, Coverage, Vacancy, no_others
from hrc_env.env import HRCEnv
from hrc_env.geometry import chains, shapes
from hrc_env.geometry.distances import least_separation
from hrc_env.geometry.enclosure import CAPSULE, N_CAPSULES, enclose
from hrc_env.motion import generator
from hrc_env.render.overlay import SHIELD
from hrc_env.safety.built_in import limit_command
from hrc_env.safety.config import PRESETS, ShieldConfig
from hrc_env.safety.incidents import MOVING_M_S
from hrc_env.safety.unseen import find_undetected
from hrc_env.settings import resolve_settings

VELOCITIES = ("velocity_world", "angular_velocity_world")
NO_DOUBT = {"n_sigmas": 0.0, "min_uncertainty_m": 0.0, "worker_speed_m_s": 0.0}


def vector(n, shield, **arguments):
    arguments = {"perception": "truth", "people": "unaware", "num_threads": 1, **arguments}
    return gymnasium.make_vec("HRCReach-v0", n, shield=shield, **arguments)


def steps(envs, n_steps, seed=0, agent="scripted"):
    """Infos of a scripted agent's steps, and what is believed after each."""
    part = envs.unwrapped.shards.first
    policy = make_agent(agent, env_info(part), seed=seed)
    seen, _ = envs.reset(seed=seed)
    for _ in range(n_steps):
        seen, *_, infos = envs.step(policy.act(seen))
        yield infos, part.belief


@pytest.fixture
def stand_still(monkeypatch):
    """Everybody stands as they stood when the episode began."""

    def advance(state, rngs, dt_s, n_steps):
        motion = generator.current(state)
        rest = {name: np.zeros_like(getattr(motion, name)) for name in VELOCITIES}
        places = motion.position_world, motion.quaternion_wxyz
        path = WorkerPath(*(np.repeat(each[:, None], n_steps, axis=1) for each in places))
        return path, replace(motion, **rest)

    monkeypatch.setattr(simulation.generator, "advance", advance)


@pytest.mark.usefixtures("stand_still")
@pytest.mark.parametrize("kind", ["qp", "ssm"])
def test_to_a_worker_who_stands_still_the_robot_comes_no_nearer_than_the_margin(kind):
    config = ShieldConfig(kind, margin_m=0.12, hand_margin_m=0.12, **NO_DOUBT)
    free, kept = (
        np.array([now.separation.distance_m[:, 0] for _, now in steps(vector(32, shield), 150)])
        for shield in (None, config)
    )
    apart = kept[0] > 0.13
    assert (free[:, apart].min(0) < 0.05).any()
    assert kept[:, apart].min() > 0.12 - 0.002


def test_beside_people_who_walk_into_it_the_robot_never_comes_nearer_than_the_margin():
    """In the true scene, in closed loop; without a shield it hits them."""
    bare, kept = (play_beside_headlong_people(shield) for shield in (None, "qp"))
    assert bare.contacts_towards > 0
    assert bare.nearest_while_coming_m < ShieldConfig().margin_m
    assert kept.contacts_towards == 0
    assert kept.nearest_while_coming_m >= ShieldConfig().margin_m
    assert kept.n_steps_coming > 0.7 * bare.n_steps_coming, "it works on"


@dataclass(frozen=True)
class Outcome:
    """Of some episodes, in the true scene."""

    contacts_towards: float
    nearest_while_coming_m: float
    n_steps_coming: int


def play_beside_headlong_people(shield: str | None) -> Outcome:
    separations_m, contacts = [], 0.0
    for infos, _ in steps(vector(8, shield, people="headlong"), 240, seed=71000):
        is_coming = infos["safety/robot_towards_m_s"] > MOVING_M_S
        separations_m += infos["safety/min_separation_m"][is_coming].tolist()
        contacts = infos["safety/contacts_towards"].sum()
    return Outcome(contacts, min(separations_m), len(separations_m))


def test_where_no_row_is_tight_what_is_wanted_is_applied():
    far = vector(2, "qp", n_workers=0)
    assert all((infos["shield/change"] == 0.0).all() for infos, _ in steps(far, 20))
    near = vector(8, "qp")
    changes = np.array([
        (infos["shield/change"], infos["shield/active"], infos["shield/scale"])
        for infos, _ in steps(near, 100)
    ])  # fmt: skip
    change, active, scale = changes.swapaxes(0, 1)
    assert 0.05 < active.mean() < 0.8
    assert (active == (change > 0.02)).all()
    np.testing.assert_array_equal(scale[change == 0.0], 1.0)


def test_in_a_room_that_is_seen_to_be_empty_nothing_is_capped():
    envs = vector(8, "qp", perception="keypoints", n_workers=(0, 1))
    *_, (infos, _) = steps(envs, 20)
    empty = infos["worker_0/activity"] == -1
    assert 0 < empty.sum() < 8
    np.testing.assert_array_equal(infos["shield/unknown"][empty], 0.0)
    np.testing.assert_array_equal(infos["shield/change"][empty], 0.0)


@pytest.mark.parametrize("shield", [*PRESETS, {"kind": "qp", "margin_m": 0.2}])
def test_a_vector_is_single_environments(shield):
    many = vector(3, shield, perception="keypoints", num_threads=2)
    one = gymnasium.make("HRCReach-v0", perception="keypoints", people="unaware", shield=shield)
    many.reset(seed=[5, 6, 7])
    one.reset(seed=7)
    for _ in range(12):
        actions = many.action_space.sample()
        seen, reward, *_, infos = many.step(actions)
        alone, alone_reward, *_, info = one.step(actions[2])
        np.testing.assert_array_equal(seen[2], alone)
        assert reward[2] == alone_reward
        said = {name: infos[name][2] for name in info if name.startswith("shield/")}
        assert said == {name: info[name] for name in said}
        assert {"shield/change", "shield/slack", "shield/unknown"} <= said.keys()


def test_a_vector_is_single_environments_where_somebody_takes_a_tool():
    kwargs = {"perception": "keypoints", "shield": "qp"}
    many = gymnasium.make_vec("HRCHandover-v0", 2, num_threads=1, **kwargs)
    one = gymnasium.make("HRCHandover-v0", **kwargs)
    (seen, _), (alone, _) = many.reset(seed=[2, 3]), one.reset(seed=3)
    part, welcome = many.unwrapped.shards.first, 0
    policy = make_agent("scripted", env_info(part))
    over = False
    while not over:
        actions = policy.act(seen)
        seen, *_ = many.step(actions)
        alone, _, over, *_ = one.step(actions[1])
        np.testing.assert_array_equal(seen[1], alone)
        welcome += part.belief.allowed_contact[1].any()
    assert welcome > 20


@pytest.mark.parametrize("task", ["HRCHandover-v0", "HRCDrywall-v0"])
def test_people_take_part_in_what_a_robot_does_under_a_shield(task):
    """Of four, whom it fled from before, or whose board it tore away."""
    envs = gymnasium.make_vec(task, 4, perception="keypoints", shield="qp", num_threads=1)
    policy, done = make_agent("scripted", env_info(envs.unwrapped.shards.first)), np.zeros(4, bool)
    seen, _ = envs.reset(seed=40)
    for _ in range(760):
        seen, _, terminated, *_ = envs.step(policy.act(seen))
        done |= terminated
    assert done.sum() >= 3


@pytest.mark.parametrize("control", ["joint", "tool", "twist"])
def test_it_goes_on_from_a_state_and_through_pickle(control):
    config = {"observe_shield": True}
    env = HRCEnv(perception="truth", shield="qp", control=control, config=config, people="unaware")
    env.reset(seed=2)
    actions = [env.action_space.sample() for _ in range(30)]
    for action in actions[:15]:
        env.step(action)
    state, twin = env.get_state(), pickle.loads(pickle.dumps(env))
    first = [env.step(action)[0] for action in actions[15:]]
    env.set_state(state)
    for again in (env, twin):
        np.testing.assert_array_equal(first, [again.step(action)[0] for action in actions[15:]])


@pytest.mark.parametrize("task", hrc_env.IDS)
def test_every_id_has_one(task):
    for shield in PRESETS:
        env = gymnasium.make(task, perception="truth", shield=shield)
        policy = make_agent("scripted", env_info(env.unwrapped.simulation))
        seen, _ = env.reset(seed=4)
        for _ in range(10):
            seen, *_, info = env.step(policy.act(seen))
        assert info["shield/change"] >= 0.0


def believed(task="HRCReach-v0", **arguments):
    """An environment, and what its robot believes."""
    env = HRCEnv(task, perception="truth", **arguments)
    env.reset(seed=1)
    return env.simulation, env.simulation.belief


def fastest_m_s(part, command):
    """Of the ends of capsules, by differences."""
    chain, q = part.chain, part.physics.q
    moved = chains.capsules(chain, q + 1e-6 * command) - chains.capsules(chain, q)
    return np.linalg.norm(moved, axis=-1).max() / 1e-6


def never_seen(now, *places, level=POSSIBLE):
    """A belief in which nobody was ever seen, and floor at these places (x, y) of the tool's was
    not seen empty; none: anywhere."""
    somebody = np.ones_like(now.estimate.tracked)
    nowhere = np.full_like(now.estimate.mean_world, np.nan)
    estimate = replace(now.estimate, tracked=~somebody, unknown=somebody, seen_world=nowhere)
    if not places:
        return replace(now, estimate=estimate)
    tool = now.robot.tool_world[0] * (1.0, 1.0, 0.0)
    where = tool + np.array([(*place, 0.0) for place in places])
    coverage = Coverage(where, 0.0, np.zeros(len(where), int), np.ones((1, 4), bool))
    levels = np.full((1, estimate.tracked.shape[1], 1), level)
    vacancy = Vacancy(coverage, levels, np.zeros((1, 1)), no_others(1))
    floor = find_unseen_floor(now.robot, estimate, vacancy)
    return replace(now, estimate=drop_distant_unknown(estimate, floor), unseen=floor)


@pytest.mark.parametrize("task", ["HRCReach-v0", "HRCDelivery-v0"])
def test_where_nobody_has_looked_a_robot_stands(task):
    part, now = believed(task)
    allowed, said = limit_command(
        never_seen(now), part.model.fastest_rad_s[None], 0.04, ShieldConfig()
    )
    assert said["unknown"] == 1.0
    np.testing.assert_array_equal(allowed, 0.0)


@pytest.mark.parametrize("task", ["HRCReach-v0", "HRCDelivery-v0"])
@pytest.mark.parametrize("limit_m_s", [0.25, 0.0])
def test_near_floor_that_one_camera_alone_has_seen_empty_no_point_is_faster(task, limit_m_s):
    part, now = believed(task)
    wanted, config = part.model.fastest_rad_s[None], ShieldConfig(unknown_speed_limit_m_s=limit_m_s)
    near = never_seen(now, (0.3, 0.0), level=PROBABLY_EMPTY)
    allowed, said = limit_command(near, wanted, 0.04, config)
    assert said["unknown"] == 1.0
    assert fastest_m_s(part, allowed) == pytest.approx(limit_m_s, abs=1e-4)
    np.testing.assert_allclose(np.cross(allowed[0, :3], wanted[0, :3]), 0.0, atol=1e-12)
    far = never_seen(now, (3.0, 0.0), level=PROBABLY_EMPTY)
    allowed, said = limit_command(far, wanted, 0.04, config)
    assert said["unknown"] == 0.0
    np.testing.assert_array_equal(allowed, wanted)


def test_to_floor_that_no_camera_has_seen_a_robot_comes_no_nearer_and_may_leave_it():
    part, now = believed()
    now = replace(now, command=np.zeros_like(now.command))
    moves = np.random.default_rng(0).uniform(-0.3, 0.3, (40, 6))
    near, empty = (never_seen(now, (0.15, 0.0), level=level) for level in (POSSIBLE, EMPTY))
    closing = []
    for wanted in moves:
        allowed, said = limit_command(near, wanted[None], 0.04, ShieldConfig())
        moved = chains.capsules(part.chain, now.robot.q + 1e-6 * allowed)
        gaps = [floor_gap_m(near, capsules) for capsules in (now.robot.capsules_world, moved)]
        closing.append((gaps[0] - gaps[1]) / 1e-6)
        assert said["unknown"] == 1.0
        free, said = limit_command(empty, wanted[None], 0.04, ShieldConfig())
        assert said["unknown"] == 0.0
        np.testing.assert_array_equal(free[0], wanted)
    assert max(closing) < 2e-3
    assert min(closing) < -0.05


def floor_gap_m(now, capsules):
    """From capsules to a line above the first piece of floor."""
    foot = now.unseen.floor_world[:1]
    line = np.stack([foot, foot + np.array([0.0, 0.0, 1.8])], 1)
    return least_separation(
        capsules, now.robot.capsule_radius_m, line[None], np.zeros(1)
    ).distance_m


@pytest.mark.parametrize(("depth_m", "slow"), [(0.2, False), (0.3, True)])
def test_where_shoulders_are_hardly_known_hands_are_not_either(depth_m, slow):
    _, now = believed()
    mean, cov = now.estimate.mean_world.copy(), now.estimate.cov_world.copy()
    mean[...] += now.robot.tool_world[:, None] + np.array([0.9, 0.0, 0.2]) - mean[:, :, 1:2]
    cov[..., JOINT["left_shoulder"], :, :] = np.diag(np.square((0.04, 0.05, depth_m)))
    vague = replace(now.estimate, mean_world=mean, cov_world=cov)
    limit = find_undetected(replace(now, estimate=vague), ShieldConfig()).speed_limit_m_s
    assert np.isfinite(limit[0]) == slow


@pytest.mark.parametrize(
    ("wide_m", "slow"), [((0.02, 0.08, 0.4), False), ((0.05, 0.15, 0.4), True)]
)
def test_hands_that_no_camera_shows_may_be_anywhere_within_an_arm_of_their_shoulders(wide_m, slow):
    part, now = believed()
    estimate, wanted = now.estimate, part.model.fastest_rad_s[None]
    mean, cov = estimate.mean_world.copy(), estimate.cov_world.copy()
    for side, aside_m in (("left", 0.9), ("right", 0.8)):
        mean[..., JOINT[f"{side}_shoulder"], :] = now.robot.tool_world[:, None] + (
            aside_m,
            0.0,
            0.2,
        )
    mean[..., JOINT["right_wrist"], :] += (3.0, 0.0, 0.0)
    cov[..., JOINT["right_wrist"], :, :] = np.diag(np.square(wide_m))
    far = replace(estimate, mean_world=mean, cov_world=cov)
    limit = find_undetected(replace(now, estimate=far), ShieldConfig()).speed_limit_m_s
    assert np.isfinite(limit[0]) == slow
    if slow:
        allowed, _ = limit_command(replace(now, estimate=far), wanted, 0.04, ShieldConfig())
        assert fastest_m_s(part, allowed) <= limit[0] + 1e-4


def unseen(now, away_m, unobserved_s=0.5, **known):
    """A belief in which the worker was seen last so far beside the tool, and not since."""
    place, _ = np.broadcast_arrays(now.robot.tool_world[:, None, None], now.estimate.mean_world)
    seen = place + np.array([away_m, 0.0, 0.0]) + np.linspace(0, 0.1, 15)[:, None]
    blind_s = np.full_like(now.estimate.unobserved_s, unobserved_s)
    known |= {"seen_world": seen, "unobserved_s": blind_s}
    return replace(now, estimate=replace(now.estimate, **known))


@pytest.mark.parametrize("is_tracked", [True, False])
def test_towards_where_somebody_unseen_may_be_it_comes_no_nearer_and_elsewhere_it_is_slow(
    is_tracked,
):
    part, now = believed()
    known = {"tracked": np.array([[is_tracked]]), "unknown": np.array([[not is_tracked]])}
    blind = unseen(now, 0.9, **known)
    moves = np.random.default_rng(0).uniform(-1, 1, (30, 6)) * part.model.fastest_rad_s
    closing, speeds, reach = [], [], 0.04 * part.model.slew_rad_s2
    for wanted in moves:
        allowed, said = limit_command(blind, wanted[None], 0.04, ShieldConfig())
        allowed = np.clip(allowed, -reach, reach)  # as far as it can accelerate
        moved = chains.capsules(part.chain, now.robot.q + 1e-6 * allowed)
        robot = replace(now.robot, capsules_world=moved)
        there = replace(now.estimate, mean_world=blind.estimate.seen_world)
        before, after = (estimated_separation(r, there).distance_m for r in (now.robot, robot))
        closing.append((before - after)[0, 0] / 1e-6)
        speeds.append(fastest_m_s(part, allowed))
        assert said["unknown"] == 1.0
    assert max(closing) < 2e-3
    assert 0.05 < max(speeds) < 0.25 + 1e-4


def test_whom_another_environment_has_lost_slows_nobody():
    envs = vector(2, None, n_workers=1)
    envs.reset(seed=0)
    lost = unseen(envs.unwrapped.shards.first.belief, 0.9)
    lost.estimate.unobserved_s[1] = 0.0
    limits = find_undetected(lost, ShieldConfig()).speed_limit_m_s
    assert np.isfinite(limits).tolist() == [True, False]


def test_robots_whose_cameras_all_fail_come_no_nearer_to_where_people_were():
    lost = [{"kind": "lost", "cameras": ["all"], "start_s": 1.0}]
    gaps_m, unobserved_s, driven = [], [], []
    for infos, now in steps(vector(24, "qp", perception="keypoints", faults=lost), 75):
        there = replace(now.estimate, mean_world=now.estimate.seen_world)
        there.tracked[:] = True
        gaps_m.append(estimated_separation(now.robot, there).distance_m[:, 0])
        unobserved_s.append(now.estimate.unobserved_s[:, 0])
        is_free = infos["safety/min_separation_m"] > 0.02  # nobody pushes the arm
        driven.append(now.command.any(1) & is_free)
    gaps, blind = np.array(gaps_m)[:-1], np.array(unobserved_s)[:-1]
    narrowed = -np.diff(gaps_m, axis=0)
    near = (blind > 0.6) & (gaps < 0.5) & driven[1:]
    assert near.any(0).sum() > 5
    assert narrowed[near].max() < 0.04 * MOVING_M_S
    assert narrowed[(blind == 0.0) & (gaps < 0.5)].max() > 5e-3


def test_it_stands_near_where_somebody_was_and_one_seen_just_now_changes_nothing():
    part, now = believed()
    wanted = part.model.fastest_rad_s[None]
    near, _ = limit_command(unseen(now, 0.3), wanted, 0.04, ShieldConfig())
    np.testing.assert_array_equal(near, 0.0)
    lately, _ = limit_command(unseen(now, 0.3, unobserved_s=0.2), wanted, 0.04, ShieldConfig())
    seen, said = limit_command(now, wanted, 0.04, ShieldConfig())
    np.testing.assert_array_equal(lately, seen)
    assert said["unknown"] == 0.0


def test_what_is_carried_counts_as_robot():
    """A load that reaches somebody makes rows; a heavier one may touch them less fast."""
    _, now = believed("HRCDrywall-v0", n_workers=1)
    hand = now.robot.tool_world + np.array([0.3, 0.0, 0.0])
    estimate = now.estimate
    estimate.mean_world[:] = hand[:, None, None] + np.linspace(0, 1, 15)[:, None] * [0.5, 0, 0]
    estimate.tracked[:] = True
    capsules = now.robot.capsules_world.copy()
    free = replace(now, robot=replace(now.robot, capsules_world=capsules))
    capsules[:, -1] = hand[:, None]  # a board's last capsule
    wanted = np.full((1, 6), 0.3)
    alone, _ = limit_command(now, wanted, 0.04, ShieldConfig())
    laden, said = limit_command(free, wanted, 0.04, ShieldConfig())
    assert said["clearance_m"] < 0.0
    assert np.abs(alone - laden).max() > 1e-3


def test_a_negative_margin_is_said_to_take_away_what_protects():
    with pytest.warns(UserWarning, match=r"hand_margin_m is -0.1 m: a negative margin takes away"):
        ShieldConfig(hand_margin_m=-0.1)
    with pytest.warns(UserWarning, match="margin_m is -0.02 m"):
        resolve_settings(shield={"kind": "qp", "margin_m": -0.02})


HANDS = {"tool": (8, (1.0, 0.0, 0.0)), "forearm": (4, (0.0, -1.0, 0.0))}
"""Beside a capsule of the last link, and of another one, and on which side of it."""


def comes_m_s(beside, welcome, shield, wall_m=None, load_kg=0.0):
    """How fast a capsule comes to a hand that is 4 cm from it, if it wants to come fast.

    There may be a wall so far behind the hand, and a load in the hand.
    """
    part, now = believed(n_workers=2)
    c, side = HANDS[beside]
    middle, aside = now.robot.capsules_world[0, c].mean(0), np.array(side)
    mean = np.broadcast_to(middle + 1.5 * aside, (1, 2, 15, 3)).copy()
    mean[0, 1, :, 2] += 9.0
    for joint, away_m in (("shoulder", 0.9), ("elbow", 0.7), ("wrist", 0.4)):
        mean[0, 0, JOINT[f"right_{joint}"]] = middle + away_m * aside
    body, hand = enclose(mean[:1, 0]), CAPSULE["right_hand"]
    tip_m = ((body.ends_world[0, hand] - middle) @ aside).min() - body.radius_m[0, hand]
    mean[0, 0] += (now.robot.capsule_radius_m[c] + 0.04 - tip_m) * aside
    still = {"mean_world": mean, "velocity_world": np.zeros_like(mean)}
    model, far_m = now.model, now.robot.capsule_radius_m[c] + 0.04 + 2.0 * body.radius_m[0, hand]
    if wall_m is not None:
        centre = middle + (far_m + wall_m + 1.0) * aside
        box = shapes.shape(shapes.BOX, centre, np.eye(3), np.ones(3))
        model = replace(model, obstacles=np.vstack([model.obstacles, box]))
    model, nowhere = replace(model, load_kg=np.array([load_kg])), np.zeros((1, 1, 3))
    load = ObjectState(nowhere, np.zeros((1, 1, 4)), nowhere, nowhere, np.ones((1, 1), bool))
    now = replace(now, objects=load)
    known = {"estimate": replace(now.estimate, **still), "allowed_contact": welcome}
    now = replace(now, model=model, **known)
    turns = part.physics.q + 1e-6 * np.eye(6)
    moved = chains.capsules(part.chain, turns)[:, c].mean(1)
    towards = (moved - chains.capsules(part.chain, part.physics.q)[0, c].mean(0)) @ aside / 1e-6
    wanted = 0.6 * towards / (towards @ towards)
    return limit_command(now, wanted[None], 0.04, shield)[0][0] @ towards


def arm_of(worker):
    """(1, 2, N_CAPSULES) the right arm of a worker is welcome, of nobody else."""
    welcome = np.zeros((1, 2, N_CAPSULES), bool)
    welcome[0, worker, [CAPSULE["right_forearm"], CAPSULE["right_hand"]]] = True
    return welcome


@pytest.mark.parametrize(("beside", "most_m_s"), [("tool", 0.1), ("forearm", 0.02)])
def test_to_a_welcome_hand_the_last_link_may_come_and_others_stand_still(beside, most_m_s):
    shield = ShieldConfig(contact_speed_m_s=0.1)
    assert comes_m_s(beside, arm_of(0), shield) == pytest.approx(most_m_s, abs=5e-3)
    assert comes_m_s(beside, arm_of(1), shield) < 5e-3
    assert comes_m_s(beside, np.zeros((1, 2, N_CAPSULES), bool), shield) < 5e-3


CLOSE = ShieldConfig("pfl", margin="constant", max_retreat_m_s=0.0)


@pytest.mark.parametrize("beside", HANDS)
def test_to_a_hand_before_a_wall_it_comes_slower_than_to_one_in_free_air(beside):
    free_m_s, behind_m_s, far_m_s = (
        comes_m_s(beside, None, CLOSE, wall_m) for wall_m in (None, 0.08, 0.13)
    )
    assert behind_m_s < 0.4 * free_m_s
    assert far_m_s == pytest.approx(free_m_s)
    laden_m_s = comes_m_s(beside, None, CLOSE, 0.08, load_kg=20.0)
    assert laden_m_s < (0.8 if beside == "tool" else 1.0) * behind_m_s


def test_a_welcome_hand_before_a_wall_is_touched_no_faster_than_it_bears():
    shield = ShieldConfig(contact_speed_m_s=0.25)
    free_m_s, behind_m_s = (comes_m_s("tool", arm_of(0), shield, wall_m) for wall_m in (None, 0.05))
    assert free_m_s == pytest.approx(0.25, abs=5e-3)
    assert 0.05 < behind_m_s < 0.22


def rate_contacts(shield, is_known=True, slab_m=1.0):
    """Force ratios of contacts towards people with their arms, clamped ones and free ones.

    A slab fills the room up to a height; the shield may not know of it.
    """
    envs = vector(32, shield)
    part = envs.unwrapped.shards.first
    box = shapes.shape(
        shapes.BOX, np.array([0.0, 0.0, slab_m - 0.5]), np.eye(3), np.array([2.0, 2.0, 0.5])
    )
    model = replace(part.model, obstacles=np.vstack([part.model.obstacles, box]))
    part.monitor.model = model
    part.model = model if is_known else part.model
    clamped, free = [], []
    for infos, _ in steps(envs, 200, seed=18_003_000):
        is_towards = infos["worker_0/contact_kind"] == 0
        is_head = infos["safety/contact_severity"] == 3
        for b in np.flatnonzero(is_towards & ~is_head):
            kept = clamped if infos["safety/contact_is_clamped"][b] else free
            kept.append(infos["safety/contact_force_ratio"][b])
    return clamped, free


def test_in_closed_loop_contacts_with_true_bodies_stay_within_their_limits():
    """With true bodies estimated; only a shield that knows of what is behind them does so."""
    (clamped, free), (unknown, _), (bare, _) = (
        rate_contacts(*given) for given in (("pfl",), ("pfl", False), (None,))
    )
    assert len(clamped) >= 2
    assert len(free) >= 5
    assert max(clamped + free) < 1.1
    assert max(unknown) > 1.3
    assert max(bare) > 1.3


def test_where_people_truly_are_changes_incidents_and_not_the_shield(monkeypatch):
    commands, gaps_m, made = [], [], simulation.worker_capsules
    for away_m in (0.0, 0.4):
        envs = vector(6, "pfl", perception="keypoints")
        part = envs.unwrapped.shards.first
        for _ in steps(envs, 30, seed=18_004_100):
            pass
        monkeypatch.setattr(simulation, "worker_capsules", lambda *a, x=away_m: made(*a) + x)
        infos = envs.step(np.ones((6, 6), np.float32))[4]
        monkeypatch.setattr(simulation, "worker_capsules", made)
        commands.append(part.physics.command)
        gaps_m.append(infos["safety/min_separation_m"])
    np.testing.assert_array_equal(*commands)
    assert (np.abs(gaps_m[0] - gaps_m[1]) > 0.01).all()


def test_where_people_are_estimated_to_be_changes_the_shield_and_not_incidents():
    told, allowed = [], []
    for perception in ("truth", "keypoints"):
        envs = vector(6, None, perception=perception)
        for infos, now in steps(envs, 100, seed=18_004_200, agent="random"):
            told.append({k: v for k, v in infos.items() if k.startswith("safety/")})
            allowed.append(limit_command(now, now.command, 0.04, ShieldConfig("pfl"))[0])
    for exact, seen in zip(told[:100], told[100:], strict=True):
        assert exact.keys() == seen.keys()
        for name in exact:
            np.testing.assert_array_equal(exact[name], seen[name])
    assert np.abs(np.array(allowed[:100]) - allowed[100:]).max() > 1e-2


@pytest.mark.parametrize(
    ("shield", "said"),
    [
        ("cbf", "Unknown shield 'cbf'. Valid: 'ssm', 'qp', 'pfl'"),
        ({"kind": "cbf"}, "kind of shield 'cbf'"),
        ({"n_sigmas": -0.1}, r"shield\.n_sigmas must not be negative, got -0.1"),
        ({"margin": 0.1}, r"shield\.margin"),
        ({"max_retreat_m_s": "fast"}, r"shield\.max_retreat_m_s must be a finite number"),
        (
            {"unknown_speed_limit_m_s": -1.0},
            r"shield\.unknown_speed_limit_m_s must not be negative",
        ),
        ({"deceleration_m_s2": 0.0}, r"shield\.deceleration_m_s2 must be positive"),
        (3, "shield must be a name, a ShieldConfig or a mapping"),
    ],
)
def test_what_cannot_be_is_said(shield, said):
    with pytest.raises(ConfigError, match=said):
        HRCEnv(perception="none", shield=shield)


def test_margins_that_are_no_numbers_are_refused():
    with pytest.raises(ConfigError, match="margin_m must be a finite number, got nan"):
        ShieldConfig(margin_m=np.nan)


@pytest.mark.parametrize(
    ("missing", "said"),
    [("model", "The robot's model"), ("command", "The current command")],
)
def test_what_a_shield_lacks_is_said(missing, said):
    _, now = believed()
    with pytest.raises(ConfigError, match=said):
        limit_command(replace(now, **{missing: None}), np.zeros((1, 6)), 0.04, ShieldConfig())


def test_the_observation_ends_with_what_it_changed_if_asked():
    config = {"observe_shield": True}
    envs = vector(4, "qp", config=config)
    plain = vector(4, "qp")
    assert envs.single_observation_space.shape[0] == plain.single_observation_space.shape[0] + 6
    part = envs.unwrapped.shards.first
    for infos, now in steps(envs, 60):
        norm = np.linalg.norm(now.shield_change, axis=1)
        np.testing.assert_allclose(norm, infos["shield/change"])
    assert list(part.layout.slices)[-1] == "shield_change"


def test_pictures_show_when_it_acts():
    env = HRCEnv(perception="none", shield="qp", render_mode="rgb_array")
    env.reset(seed=1)
    still, acting = (env.views, env.views)
    plain = still.picture()
    env.simulation.shield_change[:] = 0.5
    shown = acting.picture()
    env.close()
    assert (shown[0, 0] == SHIELD).all()
    assert not (plain[0, 0] == SHIELD).all()
