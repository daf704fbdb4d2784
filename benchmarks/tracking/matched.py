"""Motion drawn from the estimators' own model, for which a bound on any estimator is known.

The state is all joints' positions and velocities, 90 numbers: x' = f(x) + w, w ~ N(0, Q). f
damps every joint towards its place on the body about the root (the torso's middle), turned as
the torso is; Q has each joint's own noise and an acceleration that all joints share. That is all
there is to `matched`: bodies without bones, which the Gaussian estimators describe but for the
places on the body, which they learn, and the turning, whose error they leave out.

`matched_bones` has bones too. They tilt every transition: p(x' | x) is N(f(x), Q) times
N(|x'_a - x'_b|; length, stiffness) over the bones, normalised. A draw from it is made by
randomised maximisation, exact but for the bones' curvature: it is f(x) + w, moved by the gain
K = Q b' (b Q b' + stiffness^2)^-1 towards lengths drawn about the right ones (b: the lengths'
derivatives). No estimator of the package is matched to that: they take bones for measurements,
which says more than this chain does about the state before. And no estimator can reach the
bound on it: the bound knows the bones' directions, an estimator knows them to its error over
the bone's length. The filter that has the whole model (`full_state`) is at 1.013 of
the bound in the lab and 1.034 on the site with detections of 3 px, at 1.000 and 1.002 with
0.5 px, and at 1.003 and 1.001 without bones (60 sequences each): the gap is that second order.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.tracking.rigs import DT_S
from hrc_env.core.skeleton import BONES, N_JOINTS, TORSO
from hrc_env.core.typing import Floats, Ints, Points3
from hrc_env.tracking.models.acquisition import STANDING_M
from hrc_env.tracking.models.motion import damped_joints
from hrc_env.tracking.tree.bone_lengths import STIFFNESS_M

N_STATES = 6 * N_JOINTS
N_PLACES = 3 * N_JOINTS
"""The first half of the state: positions [m], joint by joint; then velocities [m/s]."""
_LEFT_RIGHT = np.zeros(N_JOINTS)
_LEFT_RIGHT[TORSO] = (0.5, -0.5, 0.5, -0.5)
_WARM_UP_FRAMES, _BONE_STEPS = 50, 3


@dataclass(frozen=True, slots=True, eq=False)
class MatchedModel:
    """A body that moves as the estimators think bodies move."""

    F: Floats
    """(J, 2, 2) motion of (position, velocity) relative to the joint's place on the body."""
    Q: Floats
    """(90, 90) process noise."""
    linear: Floats
    """(90, 90) derivative of f without the turning of the body."""
    offset: Floats
    """(J, 3) places on the body: forward, left, up of the root [m]."""
    bones: Ints
    """(N, 2) joints at the ends of the bones that tilt the motion: all 16, or none."""
    length: Floats
    """(N,) their lengths [m]."""
    stiffness: Floats
    """(N,) how much a length varies [m]."""


def matched_model(damping: float, root_acceleration: float, n_bones: int) -> MatchedModel:
    """The motion model of `tracking.models.motion` as a model of the whole body at 25 Hz.

    Args:
        damping: as `TrackerConfig.damping`.
        root_acceleration: as `TrackerConfig.root_acceleration` [m^2/s^3].
        n_bones: how many of `skeleton.BONES` tilt the motion, from the first one.
    """
    F, own = damped_joints(DT_S, damping, 0.0)
    average = np.zeros((N_JOINTS, N_JOINTS))
    average[:, TORSO] = 1 / len(TORSO)
    # what of the root's (position, velocity) a joint takes along; the rest is its own
    along = np.array([[1, DT_S], [0, 1]]) - F
    linear = np.block(
        [[np.diag(F[:, i, k]) + along[:, i, k, None] * average for k in (0, 1)] for i in (0, 1)]
    )
    shared = root_acceleration * np.array([[DT_S**3 / 3, DT_S**2 / 2], [DT_S**2 / 2, DT_S]])
    everybody = np.ones((N_JOINTS, N_JOINTS))
    Q = np.block(
        [[np.diag(own[:, i, k]) + shared[i, k] * everybody for k in (0, 1)] for i in (0, 1)]
    )
    bones = BONES[:n_bones]
    ends = STANDING_M[bones]
    return MatchedModel(
        F=F,
        Q=np.asarray(np.kron(Q, np.eye(3)), float),
        linear=np.asarray(np.kron(linear, np.eye(3)), float),
        offset=STANDING_M,
        bones=bones,
        length=np.linalg.norm(ends[:, 0] - ends[:, 1], axis=-1),
        stiffness=STIFFNESS_M[:n_bones],
    )


def draw(model: MatchedModel, seeds: list[int], n_frames: int) -> Points3:
    """Joints (T, S, J, 3) [m] of one body per seed.

    Limbs are let go two seconds before frame 0; until then the root is held at rest over the
    origin, so that the body, which drifts without bound, stays in view for a while.
    """
    rngs = [np.random.default_rng([seed, 3]) for seed in seeds]
    place = model.offset + np.array([0.0, 0.0, 1.0])
    state = np.tile(np.concatenate([place, np.zeros_like(place)]).ravel(), (len(seeds), 1))
    factor = np.linalg.cholesky(model.Q)
    joints = np.empty((n_frames, len(seeds), N_JOINTS, 3))
    for t in range(-_WARM_UP_FRAMES, n_frames):
        noise = np.stack([rng.standard_normal(N_STATES) for rng in rngs])
        wobble = np.stack([rng.standard_normal(len(model.bones)) for rng in rngs])
        drawn = advance(model, state) + noise @ factor.T
        state = _tilt(model, drawn, model.length + model.stiffness * wobble)
        if t < 0:
            state = _centred(state)
        else:
            joints[t] = state[:, :N_PLACES].reshape(-1, N_JOINTS, 3)
    return joints


def _centred(state: Floats) -> Floats:
    """Root over the origin and at rest: shifts all joints alike, which f and the bones allow."""
    body = state.reshape(len(state), 2, N_JOINTS, 3)
    root = body[:, :, TORSO].mean(2, keepdims=True)
    root[:, 0, :, 2] -= 1.0
    return (body - root).reshape(state.shape)


def advance(model: MatchedModel, state: Floats) -> Floats:
    """f: the expected state (S, 90) a frame later."""
    body = state.reshape(-1, 2, N_JOINTS, 3)
    root = body[:, :, TORSO].mean(2, keepdims=True)
    anchor = root[:, 0] + _turned(model.offset, heading(body[:, 0]))
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
    """Derivative of f, (S, 90, 90), for bodies whose joints are at (S, J, 3)."""
    angle = heading(joints)
    left = np.einsum("j,sji->si", _LEFT_RIGHT, joints)
    width2 = (left[:, :2] ** 2).sum(-1)
    by_place = np.zeros_like(joints)  # of the angle
    by_place[..., 0] = _LEFT_RIGHT * (-left[:, 1] / width2)[:, None]
    by_place[..., 1] = _LEFT_RIGHT * (left[:, 0] / width2)[:, None]
    level = np.array([1.0, 1.0, 0.0])
    turning = _turned(model.offset * level, angle + np.pi / 2)
    F = model.F[..., None]
    by_angle = np.stack([(1 - F[:, 0, 0]) * turning, -F[:, 1, 0] * turning], 1)
    n = len(joints)
    out = np.tile(model.linear, (n, 1, 1))
    out[:, :, :N_PLACES] += by_angle.reshape(n, -1, 1) * by_place.reshape(n, 1, -1)
    return out


def heading(joints: Points3) -> Floats:
    """(S,) where bodies (S, J, 3) face, from the torso's left-right line [rad]."""
    left = np.einsum("j,sji->si", _LEFT_RIGHT, joints)
    return np.arctan2(left[:, 1], left[:, 0]) - np.pi / 2


def _turned(offset: Floats, angle: Floats) -> Floats:
    """(S, J, 3) offsets turned about the vertical."""
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y, z = offset.T
    return np.stack([cos * x - sin * y, sin * x + cos * y, z + 0 * cos], -1)


def bone_rows(joints: Points3, bones: Ints) -> tuple[Floats, Floats]:
    """Lengths (S, N) of bones (N, 2), and their derivatives (S, N, 45) by the positions."""
    along = joints[:, bones[:, 0]] - joints[:, bones[:, 1]]
    length = np.linalg.norm(along, axis=-1)
    along /= length[..., None]
    rows = np.zeros((len(joints), len(bones), N_JOINTS, 3))
    which = np.arange(len(bones))
    rows[:, which, bones[:, 0]] = along
    rows[:, which, bones[:, 1]] = -along
    return length, rows.reshape(len(joints), len(bones), N_PLACES)


def bone_gain(model: MatchedModel, rows: Floats) -> Floats:
    """K (S, 90, N): how far a transition's draw gives way to bones with `rows` (S, N, 45)."""
    spread = model.Q[:, :N_PLACES] @ rows.swapaxes(1, 2)
    innovation = rows @ spread[:, :N_PLACES] + np.diag(model.stiffness**2)
    gain = np.linalg.solve(innovation, spread.swapaxes(1, 2)).swapaxes(1, 2)
    return np.asarray(gain, float)


def tilted(model: MatchedModel, before: Points3, after: Points3) -> tuple[Floats, Floats]:
    """The tilted transition from joints (S, J, 3) to the next, linearised there.

    Returns:
        derivative (S, 90, 90) and covariance (S, 90, 90) of the next state.
    """
    _, rows = bone_rows(after, model.bones)
    keep = np.tile(np.eye(N_STATES), (len(rows), 1, 1))
    keep[:, :, :N_PLACES] -= bone_gain(model, rows) @ rows
    noise = keep @ model.Q
    return keep @ transition(model, before), (noise + noise.swapaxes(1, 2)) / 2


def _tilt(model: MatchedModel, drawn: Floats, wanted: Floats) -> Floats:
    """The likeliest states (S, 90) about `drawn` whose bones measure (S, N) `wanted`."""
    state = drawn
    for _ in range(_BONE_STEPS):
        length, rows = bone_rows(state[:, :N_PLACES].reshape(-1, N_JOINTS, 3), model.bones)
        moved = np.einsum("sbp,sp->sb", rows, (state - drawn)[:, :N_PLACES])
        miss = wanted - length + moved
        state = drawn + np.einsum("snb,sb->sn", bone_gain(model, rows), miss)
    return state
