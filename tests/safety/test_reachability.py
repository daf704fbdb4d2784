"""The shield "sara": what is swept, what is executed, and how fast the robot is near people."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from hrc_env.agents.env_info import env_info
from hrc_env.agents.registry import make_agent
from hrc_env.env import HRCEnv
from hrc_env.geometry import chains
from hrc_env.geometry.distances import least_separation
from hrc_env.geometry.enclosure import CAPSULES, enclose
from hrc_env.safety.built_in import describe_pose, limit_command
from hrc_env.safety.config import PRESETS
from hrc_env.safety.contact import CAPSULE_REGIONS, permitted_contact_speed
from hrc_env.safety.reachability import brake, find_braking_time, sweep_path

SARA = PRESETS["sara"]
DT_S = 0.04


def believed(**arguments):
    env = HRCEnv("HRCReach-v0", perception="truth", **arguments)
    env.reset(seed=1)
    return env.simulation.belief


def place_workers(now, offset_m):
    """A belief in which the middle of the body of everybody is this far from the tool."""
    mean = now.estimate.mean_world
    shift = now.robot.tool_world[:, None] + np.asarray(offset_m) - mean.mean(2)
    return replace(now, estimate=replace(now.estimate, mean_world=mean + shift[:, :, None]))


def sweep(now, velocities, hold_s=0.1):
    return sweep_path(now.robot, now.model, describe_pose(now).links, velocities, hold_s)


def test_the_swept_space_covers_the_motion_and_its_speed():
    now, rng = believed(), np.random.default_rng(0)
    for _ in range(20):
        velocities = rng.uniform(-1, 1, (1, 6)) * now.model.fastest_rad_s
        swept, brake_s = sweep(now, velocities), find_braking_time(velocities, now.model)[0]
        assert swept.until_s[0, -1] == pytest.approx(0.1 + brake_s)
        times_s = np.linspace(0, 0.1 + brake_s, 301)
        rate = np.clip(1 - (times_s - 0.1) / brake_s, 0, 1)
        moved_s = np.concatenate([[0], np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(times_s))])
        path = chains.capsules(now.model.chain, now.robot.q + moved_s[:, None] * velocities)
        speeds = np.linalg.norm(np.diff(path, axis=0), axis=-1).max(-1) / np.diff(times_s)[:, None]
        interval = np.searchsorted(swept.until_s[0], times_s - 1e-9).clip(max=4)
        grown_m = swept.radii_m[0] - now.robot.capsule_radius_m
        away_m = np.linalg.norm(path - swept.capsules[0][interval], axis=-1).max(-1)
        assert (away_m <= grown_m[interval] + 0.004).all()
        assert (speeds <= swept.speed_m_s[0][interval[:-1]] * 1.03 + 0.02).all()


def test_a_robot_brakes_along_its_path_within_the_limits_of_its_joints():
    now = believed()
    command = np.array([[0.5, -0.4, 0.3, 0.2, 0.1, -0.1]])
    slower = brake(command, now.model, DT_S)
    assert (np.abs(command - slower) <= now.model.slew_rad_s2 * DT_S + 1e-12).all()
    np.testing.assert_allclose(slower / command, (slower / command)[0, 0])
    assert (brake(0.01 * command, now.model, 1.0) == 0).all()
    assert (brake(0 * command, now.model, DT_S) == 0).all()


def test_what_is_wanted_is_executed_where_nobody_can_be():
    now = place_workers(believed(), (8.0, 0.0, 0.0))
    wanted = np.random.default_rng(0).uniform(-1, 1, (1, 6)) * now.model.fastest_rad_s
    allowed, values = limit_command(now, wanted, DT_S, SARA)
    np.testing.assert_array_equal(allowed, wanted)
    assert np.isnan(values["clearance_m"][0])
    assert values["slack"][0] == 0


def test_a_robot_among_people_stands_still():
    now = place_workers(believed(), (0.0, 0.0, 0.0))
    wanted = np.full((1, 6), 0.5) * now.model.fastest_rad_s
    still = replace(SARA, contact_speed_m_s=0.0)
    allowed, values = limit_command(now, wanted, DT_S, still)
    assert (allowed == 0).all()
    assert values["clearance_m"][0] < 0
    moving = replace(now, command=wanted)
    braking, values = limit_command(moving, wanted, DT_S, still)
    np.testing.assert_array_equal(braking, brake(wanted, now.model, DT_S))
    assert values["slack"][0] > 0, "it is still moving"


def test_standing_still_and_slow_motions_are_verified_anywhere():
    now = place_workers(believed(), (0.0, 0.0, 0.0))
    for wanted in (np.zeros((1, 6)), np.full((1, 6), 1e-4)):
        allowed, _ = limit_command(now, wanted, DT_S, SARA)
        np.testing.assert_array_equal(allowed, wanted)


def test_people_who_may_be_faster_are_kept_farther_away():
    now = believed()
    wanted = np.full((1, 6), 0.4) * now.model.fastest_rad_s
    moving = replace(now, command=wanted)

    def is_executed(offset_m, config):
        placed = place_workers(moving, (offset_m, 0.0, 0.0))
        return (limit_command(placed, wanted, DT_S, config)[0] == wanted).all()

    at_m = np.linspace(0.2, 4.0, 39)
    slow, fast, late = (
        at_m[[not is_executed(each, config) for each in at_m]].max()
        for config in (
            replace(SARA, worker_speed_m_s=0.5), SARA, replace(SARA, latency_s=0.5),
        )
    )  # fmt: skip
    assert slow < fast < late


def measure_excess_before_touch(shield, n_steps=200):
    """Speeds of robots before an episode's first touch, minus what the body tolerates [m/s].

    Of people who were no faster than the shield assumes; later, they push the robot.
    """
    envs = gymnasium.make_vec(
        "HRCReach-v0", 32, shield=shield, perception="truth", people="unaware", num_threads=1
    )
    part = envs.unwrapped.shards.first
    policy = make_agent("scripted", env_info(part), seed=0)
    seen, _ = envs.reset(seed=18_490_000)
    regions = [permitted_contact_speed(CAPSULE_REGIONS[each], part.model.mass_kg)
               for each in CAPSULES]  # fmt: skip
    limits, excess = np.minimum(regions, SARA.contact_speed_m_s), list[float]()
    touched, person_m_s, speeds = np.zeros(32, bool), np.zeros(32), np.zeros((32, 1))
    for _ in range(n_steps):
        before, slower = part.belief, speeds
        there = enclose(before.estimate.mean_world[:, 0]).ends_world
        seen, *_ = envs.step(policy.act(seen))
        robot, bodies = part.belief.robot, enclose(part.belief.estimate.mean_world[:, 0])
        speeds = measure_speeds(before.robot.capsules_world, robot.capsules_world)
        fastest = measure_speeds(there, bodies.ends_world).max(1)
        person_m_s = np.maximum(0.9 * person_m_s, fastest)
        n = robot.capsules_world.shape[1]
        gaps_m = least_separation(
            robot.capsules_world.reshape(-1, 1, 2, 3),
            np.tile(robot.capsule_radius_m, 32)[:, None],
            np.repeat(bodies.ends_world, n, axis=0)[:, :, None],
            np.repeat(bodies.radius_m, n, axis=0)[:, :, None],
        ).distance_m.reshape(32, n, -1)
        for b in np.flatnonzero((gaps_m.min((1, 2)) < 0) & ~touched).tolist():
            touched[b] = True
            c, s = np.unravel_index(gaps_m[b].argmin(), gaps_m[b].shape)
            if person_m_s[b] < SARA.worker_speed_m_s:
                excess.append(slower[b, c] - limits[s])
    return np.array(excess)


def measure_speeds(before, after):
    """Speed of each capsule's faster end [m/s]."""
    return np.linalg.norm(after - before, axis=-1).max(-1) / DT_S


def test_before_touch_the_robot_is_no_faster_than_people_tolerate():
    """In closed loop with true poses; without a shield it is faster."""
    bare, kept = measure_excess_before_touch(None), measure_excess_before_touch("sara")
    assert len(bare) > 3
    assert np.median(bare) > 0.1
    assert len(kept) > 3
    assert kept.max() < 0.02
