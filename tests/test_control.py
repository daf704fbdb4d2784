"""Actions to joint velocities: scaled directly, or resolved from a tool velocity."""

import numpy as np
import pytest

from hrc_env.control import (
    SINGULAR_M3,
    ControlConfig,
    joint_command,
    n_actions,
    resolve_rate,
    resolve_twist,
)
from hrc_env.core.errors import ConfigError
from hrc_env.geometry.chains import angular_jacobian, jacobian
from hrc_env.scene.build import build

SCENE = build(n_workers=0)
CHAIN, HOME = SCENE.chain, SCENE.home_q


def near_home(n: int = 20) -> np.ndarray:
    return HOME + np.random.default_rng(0).uniform(-0.3, 0.3, (n, 6))


def test_a_full_action_is_half_of_the_speed_limit():
    command = joint_command("joint", np.ones((1, 6)), HOME[None], CHAIN, HOME, ControlConfig())
    np.testing.assert_allclose(command[0], 0.5 * CHAIN.velocity_limit_rad_s)


def test_a_tool_velocity_is_followed_away_from_singular_postures():
    """Damping takes a few per cent off; the direction stays."""
    q = near_home()
    wanted = np.tile([0.1, -0.2, 0.15], (len(q), 1))
    qd = resolve_rate(CHAIN, q, wanted, HOME, ControlConfig())
    got = np.einsum("bij,bj->bi", jacobian(CHAIN, q), qd)
    cosine = (got * wanted).sum(1) / np.linalg.norm(got, axis=1) / np.linalg.norm(wanted, axis=1)
    assert cosine.min() > 0.99
    np.testing.assert_allclose(np.linalg.norm(got, axis=1), np.linalg.norm(wanted[0]), rtol=0.1)


def test_the_posture_pull_does_not_move_the_tool():
    q = near_home()
    qd = resolve_rate(CHAIN, q, np.zeros((len(q), 3)), HOME, ControlConfig(damping=1e-4))
    moved = np.einsum("bij,bj->bi", jacobian(CHAIN, q), qd)
    assert np.abs(moved).max() < 1e-4
    assert np.abs(qd).max() > 1e-3


def test_joint_limits_of_speed_hold_and_keep_the_direction():
    q = near_home()
    fast = resolve_rate(CHAIN, q, np.full((len(q), 3), 50.0), HOME, ControlConfig())
    share = np.abs(fast) / CHAIN.velocity_limit_rad_s
    np.testing.assert_allclose(share.max(1), 1.0)


def test_an_unknown_control_names_the_valid_ones():
    with pytest.raises(ConfigError, match="'joint', 'tool'"):
        n_actions("torque", CHAIN)


def test_a_twist_is_the_damped_least_squares_solution_also_at_singular_postures():
    config, rng = ControlConfig(), np.random.default_rng(5)
    q = np.concatenate([near_home(), np.zeros((1, CHAIN.n_joints))])  # the last: a straight arm
    twist = 0.01 * rng.normal(size=(len(q), 6))
    J = np.concatenate([jacobian(CHAIN, q), angular_jacobian(CHAIN, q)], axis=1)
    gram = J @ J.swapaxes(1, 2)
    near = 1.0 - np.sqrt(np.maximum(np.linalg.det(gram), 0.0)) / SINGULAR_M3
    damping = np.square(config.damping * np.clip(near, 0.0, 1.0)) + 1e-9
    solved = np.linalg.solve(gram + damping[:, None, None] * np.eye(6), twist[..., None])
    expected = (J.swapaxes(1, 2) @ solved)[..., 0]
    assert near[-1] == 1.0
    assert near[0] < 1.0
    np.testing.assert_allclose(resolve_twist(CHAIN, q, twist, config), expected, atol=1e-9)
