"""Motion sampled from the estimators' motion model, with a known bound on estimation errors.

The state has 90 numbers, the positions and velocities of all joints: x' = f(x) + w, w ~ N(0, Q).
The function f damps the motion of each joint towards its nominal position relative to the root (the
centre of the torso); the nominal positions turn with the torso. Q consists of the noise of each
joint and an acceleration that all joints share. The bodies have no bones. The model of the Gaussian
estimators is the same with two exceptions: they learn the nominal positions, and they ignore the
error of the heading.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.tracking.rigs import DT_S
from hrc_env.core.skeleton import N_JOINTS, TORSO
from hrc_env.core.typing import Floats, Points3
from hrc_env.tracking.tree.predict import discretise_joints
from hrc_env.tracking.tree.state import STANDING_M

N_STATES = 6 * N_JOINTS
N_PLACES = 3 * N_JOINTS
"""Number of position coordinates in the state [m]; the same number of velocities follows [m/s]."""
_LEFT_RIGHT = np.zeros(N_JOINTS)
_LEFT_RIGHT[TORSO] = (0.5, -0.5, 0.5, -0.5)
_WARM_UP_FRAMES = 50


@dataclass(frozen=True, slots=True, eq=False)
class MatchedModel:
    """Motion model of a body that corresponds to the model of the estimators."""

    F: Floats
    """Transition matrices (J, 2, 2) of (position, velocity), relative to the joint's nominal
    position.
    """
    Q: Floats
    """Covariance of the process noise (90, 90)."""
    linear: Floats
    """Jacobian of f for a fixed heading of the body (90, 90)."""
    offset: Floats
    """Nominal positions of the joints relative to the root (J, 3): forward, left and up [m]."""


def make_matched_model(damping: float, root_acceleration: float) -> MatchedModel:
    """Return the motion model of `tracking.tree.predict` for the whole body at 25 Hz.

    The arguments have the meaning of the settings in `ParticleConfig`.
    """
    F, own = discretise_joints(DT_S, damping, 0.0)
    average = np.zeros((N_JOINTS, N_JOINTS))
    average[:, TORSO] = 1 / len(TORSO)
    # influence of the root's (position, velocity) on a joint
    along = np.array([[1, DT_S], [0, 1]]) - F
    linear = np.block(
        [[np.diag(F[:, i, k]) + along[:, i, k, None] * average for k in (0, 1)] for i in (0, 1)]
    )
    shared = root_acceleration * np.array([[DT_S**3 / 3, DT_S**2 / 2], [DT_S**2 / 2, DT_S]])
    everybody = np.ones((N_JOINTS, N_JOINTS))
    Q = np.block(
        [[np.diag(own[:, i, k]) + shared[i, k] * everybody for k in (0, 1)] for i in (0, 1)]
    )
    return MatchedModel(
        F=F,
        Q=np.asarray(np.kron(Q, np.eye(3)), float),
        linear=np.asarray(np.kron(linear, np.eye(3)), float),
        offset=STANDING_M,
    )


def draw(model: MatchedModel, seeds: list[int], n_frames: int) -> Points3:
    """Sample joint positions (T, S, J, 3) of one body per seed [m].

    The motion begins two seconds before frame 0. Until frame 0, the root is held at rest above the
    origin: the body drifts without bound, and should remain in view for a while.
    """
    rngs = [np.random.default_rng([seed, 3]) for seed in seeds]
    place = model.offset + np.array([0.0, 0.0, 1.0])
    state = np.tile(np.concatenate([place, np.zeros_like(place)]).ravel(), (len(seeds), 1))
    factor = np.linalg.cholesky(model.Q)
    joints = np.empty((n_frames, len(seeds), N_JOINTS, 3))
    for t in range(-_WARM_UP_FRAMES, n_frames):
        noise = np.stack([rng.standard_normal(N_STATES) for rng in rngs])
        state = advance(model, state) + noise @ factor.T
        if t < 0:
            state = _centre(state)
        else:
            joints[t] = state[:, :N_PLACES].reshape(-1, N_JOINTS, 3)
    return joints


def _centre(state: Floats) -> Floats:
    """Shift a state so that the root is above the origin and at rest.

    The dynamics f are invariant to such shifts of all joints.
    """
    body = state.reshape(len(state), 2, N_JOINTS, 3)
    root = body[:, :, TORSO].mean(2, keepdims=True)
    root[:, 0, :, 2] -= 1.0
    return (body - root).reshape(state.shape)


def advance(model: MatchedModel, state: Floats) -> Floats:
    """Evaluate f, which returns the expected state (S, 90) one frame later."""
    body = state.reshape(-1, 2, N_JOINTS, 3)
    root = body[:, :, TORSO].mean(2, keepdims=True)
    anchor = root[:, 0] + _rotate(model.offset, heading(body[:, 0]))
    place, speed = body[:, 0] - anchor, body[:, 1] - root[:, 1]
    F = model.F[..., None]
    moved = np.stack(
        [
            anchor + DT_S * root[:, 1] + F[:, 0, 0] * place + F[:, 0, 1] * speed,
            root[:, 1] + F[:, 1, 0] * place + F[:, 1, 1] * speed,
        ],
        1,
    )
    return moved.reshape(state.shape)


def transition(model: MatchedModel, joints: Points3) -> Floats:
    """Return the Jacobian of f (S, 90, 90) for bodies with joints (S, J, 3)."""
    angle = heading(joints)
    left = np.einsum("j,sji->si", _LEFT_RIGHT, joints)
    width2 = (left[:, :2] ** 2).sum(-1)
    by_place = np.zeros_like(joints)  # derivative of the angle
    by_place[..., 0] = _LEFT_RIGHT * (-left[:, 1] / width2)[:, None]
    by_place[..., 1] = _LEFT_RIGHT * (left[:, 0] / width2)[:, None]
    level = np.array([1.0, 1.0, 0.0])
    turning = _rotate(model.offset * level, angle + np.pi / 2)
    F = model.F[..., None]
    by_angle = np.stack([(1 - F[:, 0, 0]) * turning, -F[:, 1, 0] * turning], 1)
    n = len(joints)
    out = np.tile(model.linear, (n, 1, 1))
    out[:, :, :N_PLACES] += by_angle.reshape(n, -1, 1) * by_place.reshape(n, 1, -1)
    return out


def heading(joints: Points3) -> Floats:
    """Return the heading (S,) of bodies (S, J, 3), from the left-right axis of the torso [rad]."""
    left = np.einsum("j,sji->si", _LEFT_RIGHT, joints)
    return np.arctan2(left[:, 1], left[:, 0]) - np.pi / 2


def _rotate(offset: Floats, angle: Floats) -> Floats:
    """Rotate offsets (J, 3) about the vertical axis by angles (S,); the result is (S, J, 3)."""
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y, z = offset.T
    return np.stack([cos * x - sin * y, sin * x + cos * y, z + 0 * cos], -1)
