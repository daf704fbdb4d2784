"""Record types for the state of the default estimator.

The errors of a body's joints are correlated; with one view, for example, all depths are wrong
together. Therefore the whole body is one Gaussian with the dependencies of the kinematic tree
(`gaussian`), and a few such hypotheses represent a worker. `predict` moves them, `update`
conditions them on a set of frames, and `evidence` weights them.
"""

import threading
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.declared import (
    Records1,
    Records2,
    Records3,
    Records4,
    Records5,
    dtype_of,
    make_records,
)
from hrc_env.core.skeleton import BONE_LENGTH_M, BONES, JOINT, N_JOINTS
from hrc_env.core.typing import Floats, Ints
from hrc_env.tracking.config import ParticleConfig
from hrc_env.tracking.tree.gaussian import EDGE_BONE, ROOT

LANES = 16
"""Number of columns of the arrays in `search`: one for each joint and one for padding."""
N_POINT = 9
"""Number of rows of `Work.points`: x, y, z [m], and entries 00, 11, 22, 01, 02, 12 of the predicted
position covariance [m^2]."""
N_VIEW = 3
"""Number of rows of `Frame.views`: u, v [px] and precision [1/px^2]; all 0 without a
measurement."""
N_IMAGE = 12
"""Number of rows of `Work.image`: weight of the measurement, 0 to 1; logarithm of the Gaussian
factor of its inlier odds, and the other factor of these odds; Jacobians of u and of v [px/m];
residuals [px]; reciprocal of the depth [1/m], which is 0 for a joint without a usable pixel."""
N_SUM = 9
"""Number of rows of `Work.sums`: entries 00, 11, 22, 01, 02, 12 of the information [1/m^2], and the
gradient [1/m]."""
STANDING_M: Floats = np.array(
    [
        (0.12, 0.00, 0.42),
        (0.00, 0.18, 0.25), (0.00, -0.18, 0.25),
        (0.00, 0.24, -0.02), (0.00, -0.24, -0.02),
        (0.08, 0.25, -0.27), (0.08, -0.25, -0.27),
        (0.00, 0.11, -0.25), (0.00, -0.11, -0.25),
        (0.02, 0.11, -0.67), (0.02, -0.11, -0.67),
        (0.00, 0.11, -1.08), (0.00, -0.11, -1.08),
        (0.14, 0.11, -1.14), (0.14, -0.11, -1.14),
    ]
)  # fmt: skip
"""(J, 3) joints of a standing adult relative to the centre of the torso, forward, left and up
[m]."""
STANDING_COUNT = 5.0
"""Weight of the standing body's offsets when offsets are learnt, as a number of updates."""
N_SUMS = 5
"""Length of `Noise.sums`."""
SQUARES, REDUNDANCY, PRODUCTS, LAST_SQUARES, TURN = range(N_SUMS)
"""Indices of the entries of `Noise.sums`: exponentially weighted sums of the squared residuals, of
their redundancy, of their products with the previous residuals, and of the squared previous
residuals. The last entry is used for the first joint and camera only; it is the index of the group
of joints whose noise is learnt in the next update."""
POPULATION_SHARE = 0.10
"""Standard deviation of a bone's length in the population, relative to the mean length."""
STIFFNESS_M: Floats = np.where(np.any(JOINT["nose"] == BONES, axis=-1), 0.05, 0.02)
"""Standard deviation of each distance of `skeleton.BONES` within one person [m]; it is larger for
distances from the nose, because the head moves relative to the shoulders."""
EDGE_STIFFNESS_M = tuple(
    0.0 if j == ROOT else float(STIFFNESS_M[k]) for j, k in enumerate(EDGE_BONE)
)
"""Standard deviation of the distance from each joint to its parent within one person [m]; 0 for the
root."""
_J = N_JOINTS


class Pair:
    """Relative calibration of the only two cameras that see a worker; see `pair_calibration`."""

    cameras: Annotated[Ints, (2,)]
    """Indices of the two cameras."""
    information: Annotated[Floats, (6, 6)]
    """Exponentially weighted information about the rotations from the gaps between lines of sight
    [1/rad^2]."""
    score: Annotated[Floats, (6,)]
    """Product of `information` and the rotations that the gaps alone indicate [1/rad]."""
    turn: Annotated[Floats, (6,)]
    """Estimated rotation vectors of the first and of the second camera in the world frame [rad]."""
    turn_cov: Annotated[Floats, (6, 6)]
    """Covariance of the two rotation vectors [rad^2]."""
    meeting_share: float
    """Exponentially weighted fraction of the updates in which the lines of sight of most joints
    met."""
    is_misaligned: bool
    """Whether the cameras are considered rotated relative to their calibration."""
    untracked_updates: int
    """Number of updates in which exactly two cameras showed a person without a track, less the
    number of other updates; at least 0."""


class Tree:
    """One hypothesis about one worker: a Gaussian body, and parameters learnt for the worker."""

    body: Annotated[Floats, (_J, 6)]
    """Mean position [m] and velocity [m/s] of each joint in the world frame."""
    cov: Annotated[Floats, (_J, 6, 6)]
    """Marginal covariance of each joint's position and velocity."""
    slope: Annotated[Floats, (_J, 6, 6)]
    """Slope of each joint on its parent (B_j of `gaussian`); undefined for the root."""
    age_s: Annotated[Floats, (_J,)]
    """Time since a measurement last supported the joint [s]."""
    conflict: Annotated[Ints, (_J,)]
    """Number of successive updates in which two or more cameras measured the joint and at most one
    supported the estimate."""
    tracked: bool
    """Whether the worker is tracked."""
    one_view_updates: int
    """Number of updates in which exactly one camera showed a person while the worker was not
    tracked, less the number of other updates; at least 0."""
    size_std: float
    """Relative standard deviation of the size, and therefore of the distance, of a body with a
    track started from one view; 0 once two cameras agree."""
    pair: Pair
    """Relative calibration of the only two cameras that see the body."""
    displaced_m2: Annotated[Floats, (3, 3)]
    """Covariance of a displacement of the whole body due to the uncertain rotations in `pair`
    [m^2]."""
    offset: Annotated[Floats, (_J, 3)]
    """Mean position of each joint relative to the centre of the torso, along the body's axes
    forward, left and up [m]."""
    offset_count: Annotated[Floats, (_J,)]
    """Number of updates in which the joint's offset was learnt, plus `STANDING_COUNT`."""
    bone_length: Annotated[Floats, (_J,)]
    """Distance from each joint to its parent [m]."""
    bone_variance: Annotated[Floats, (_J,)]
    """Variance of the distance from each joint to its parent [m^2]."""
    log_weight: float
    """Logarithm of the hypothesis's probability."""
    pose_log_prior: float
    """Contribution to `log_weight` of the plausibility of the current pose."""


class View:
    """State of one camera in a hypothesis."""

    swap_chance: float
    """Probability that the camera's left and right labels are swapped."""
    unseen_updates: int
    """Number of updates since the camera last saw the worker."""
    trusted_updates: int
    """Number of further updates for which the camera's left and right labels are trusted."""


class Noise:
    """Measurement noise of one joint in one camera; see `learning`."""

    factor: float
    """Learnt factor on the variance that the detector reports."""
    sums: Annotated[Floats, (N_SUMS,)]
    """Statistics from which the factor is learnt; see `SQUARES` and the names defined with it."""
    last_residual: Annotated[Floats, (2,)]
    """Last residuals of u and v in units of the reported standard deviation; they decay to 0
    without measurements."""


class Pace:
    """Recent speed of a worker's motion."""

    across: Annotated[Floats, (2,)]
    """Unit vector from right to left across hips and shoulders, projected onto the floor, at the
    last update."""
    up: Annotated[Floats, (3,)]
    """Unit vector from the hips to the shoulders at the last update."""
    since_s: float
    """Time since the last update [s]."""
    is_known: bool
    """Whether the pace has been updated since the track started."""
    turn_rad_s: float
    """Exponential moving average of the rate of rotation about the vertical [rad/s]."""
    tip_rad_s: float
    """Exponential moving average of the rate at which the trunk tilts [rad/s]."""
    speed_m_s: float
    """Exponential moving average of the trunk's speed [m/s]."""


class Work:
    """Work arrays of the kernels for one tree; j denotes a joint and q its parent."""

    a: Annotated[Floats, (6, 6)]
    """Temporary matrix."""
    b: Annotated[Floats, (6, 6)]
    """Temporary matrix."""
    c: Annotated[Floats, (6, 6)]
    """Temporary matrix."""
    d: Annotated[Floats, (6, 6)]
    """Temporary matrix."""
    edge: Annotated[Floats, (_J, 6, 6)]
    """Covariance of each joint with its parent."""
    root: Annotated[Floats, (_J, 6, 6)]
    """Covariance of each joint with the mean of the four torso joints."""
    moved: Annotated[Floats, (_J, 6, 6)]
    """Covariance of each joint after a time step; in `update.widen_jumped_joints`, the increase of
    the covariance."""
    moved_edge: Annotated[Floats, (_J, 6, 6)]
    """Covariance of each joint with its parent after a time step."""
    precision: Annotated[Floats, (_J, 6, 6)]
    """Precision P_j of each joint given its parent, plus the bone's information once it is
    added."""
    coupling: Annotated[Floats, (_J, 6, 6)]
    """Coupling P_j B_j of each joint to its parent, plus the bone's information once it is
    added."""
    back: Annotated[Floats, (_J, 6, 6)]
    """Information B_j' P_j B_j of each joint about its parent, plus the bone's information once it
    is added."""
    known: Annotated[Floats, (_J, 6, 6)]
    """Information about each joint from the cameras and from its subtree."""
    inverse: Annotated[Floats, (_J, 6, 6)]
    """Inverse Hessian of each joint given its parent."""
    step: Annotated[Floats, (_J, 6)]
    """Change of the means in position and velocity."""
    gradient: Annotated[Floats, (_J, 6)]
    """Gradient of the log-likelihood with respect to the means."""
    position_precision: Annotated[Floats, (_J, 3, 3)]
    """Precision of each position given the parent's position [1/m^2]."""
    position_slope: Annotated[Floats, (_J, 3, 3)]
    """Slope of each position on the parent's position."""
    position_coupling: Annotated[Floats, (_J, 3, 3)]
    """Product of precision and slope of each position [1/m^2]."""
    position_back: Annotated[Floats, (_J, 3, 3)]
    """Information of each position about the parent's position [1/m^2]."""
    position_inverse: Annotated[Floats, (_J, 3, 3)]
    """Inverse Hessian of each position given the parent's position [m^2]."""
    node: Annotated[Floats, (_J, 3, 3)]
    """Information about each position from the cameras and from its subtree [1/m^2]."""
    node_gradient: Annotated[Floats, (_J, 3)]
    """Gradient that corresponds to `node` [1/m]."""
    point: Annotated[Floats, (_J, 3)]
    """Positions at which the likelihood is linearised [m]."""
    shift: Annotated[Floats, (_J, 3)]
    """Difference between `point` and the predicted means [m]."""
    camera_information: Annotated[Floats, (_J, 3, 3)]
    """Information of the cameras about the shift of each joint [1/m^2]."""
    camera_gradient: Annotated[Floats, (_J, 3)]
    """Gradient of the cameras' log-likelihood at zero shift [1/m]."""
    edge_information: Annotated[Floats, (_J, 3, 3)]
    """Information of the bones about x_j - x_q [1/m^2]; undefined for the root."""
    edge_gradient: Annotated[Floats, (_J, 3)]
    """Gradient of the bones' log-likelihood at zero shift [1/m]; undefined for the root."""
    points: Annotated[Floats, (N_POINT, LANES)]
    """Positions and predicted covariances, with one column for each joint; see `N_POINT`."""
    image: Annotated[Floats, (N_IMAGE, LANES)]
    """Measurements and linearised projections of the joints in one camera; see `N_IMAGE`."""
    sums: Annotated[Floats, (N_SUM, LANES)]
    """Information and gradient of the cameras; see `N_SUM`."""
    spread: Annotated[Floats, (3, 4)]
    """Covariance of a joint triangulated from one set of frames [m^2] and, in the last column, its
    offset from the mean [m]."""
    persistence: Annotated[Floats, (_J,)]
    """Factor on a joint's variance for persistent errors, which filtering reduces less; negative
    for a joint whose noise is not learnt in this update."""
    n_views: Annotated[Ints, (_J,)]
    """Number of cameras that measured each joint."""
    bone_variance: Annotated[Floats, (_J,)]
    """Variance of each bone length as a measurement [m^2]."""
    offset: Annotated[Floats, (_J, 3)]
    """Copy of `Tree.offset`, to restore it after a prediction [m]."""
    offset_count: Annotated[Floats, (_J,)]
    """Copy of `Tree.offset_count`, to restore it after a prediction."""
    predicted: Annotated[Floats, (_J, 3, 3)]
    """Position covariances before the update [m^2]."""
    is_placed: Annotated[NDArray[np.int8], (_J,)]
    """1 for joints that were acquired anew in this update, else 0."""
    axes: Annotated[Floats, (2, 3, 3)]
    """Axes of the trunk and of the legs, with columns forward, left and up."""
    place: Annotated[Floats, (3,)]
    """Mean position of a joint relative to the torso, along the world's axes [m]."""


PAIR = dtype_of(Pair)
TREE = dtype_of(Tree)
VIEW = dtype_of(View)
NOISE = dtype_of(Noise)
PACE = dtype_of(Pace)
WORK = dtype_of(Work)


class Hypotheses(NamedTuple):
    """The hypotheses about every worker, in arrays that kernels change in place."""

    trees: Records3[Tree]
    """(B, W, H) Gaussian bodies, of which the first is the heaviest; the weights of those in use
    sum to one."""
    views: Records4[View]
    """(B, W, H, C) state of each camera."""
    noise: Records5[Noise]
    """(B, W, H, J, C) learnt measurement noise."""
    n_alive: Ints
    """(B, W) number of hypotheses in use, at least one."""
    since_search_s: Floats
    """(B, W) time since the last search for alternative hypotheses [s]."""
    pace: Records2[Pace]
    """(B, W) recent speed of the heaviest hypothesis."""


class WorkerHypotheses(NamedTuple):
    """The hypotheses about one worker, as views of the arrays in `Hypotheses`."""

    trees: Records1[Tree]
    """(H,) Gaussian bodies."""
    views: Records2[View]
    """(H, C) state of each camera."""
    noise: Records3[Noise]
    """(H, J, C) learnt measurement noise."""
    n_alive: Ints
    """(1,) number of hypotheses in use."""
    since_search_s: Floats
    """(1,) time since the last search for alternative hypotheses [s]."""
    pace: Records1[Pace]
    """(1,) recent speed of the heaviest hypothesis."""


class BoneLengths(NamedTuple):
    """Distances from joints to their parents."""

    mean_m: Floats
    """(J,) mean lengths [m]; 1 for the root."""
    variance_m2: Floats
    """(J,) variances of the lengths [m^2]."""


def make_bone_prior() -> BoneLengths:
    """Return the means and variances of bone lengths in the population."""
    length = np.array([1.0 if k < 0 else BONE_LENGTH_M[k] for k in EDGE_BONE])
    return BoneLengths(length, (POPULATION_SHARE * length) ** 2)


class Scratch(NamedTuple):
    """Memory for intermediate results of kernels, whose contents are undefined."""

    work: Records1[Work]
    """(1,) work arrays for one tree."""
    prior: Records1[Tree]
    """(1,) a tree."""


_THREAD = threading.local()
"""The scratch memory of each thread."""


def lend_scratch() -> Scratch:
    """Return the scratch memory of the calling thread, which its next caller overwrites.

    New arrays in every step would cost as much as a kernel in a single environment.
    """
    if not hasattr(_THREAD, "scratch"):
        _THREAD.scratch = Scratch(make_records(Work, 1), make_records(Tree, 1))
    return _THREAD.scratch


def make_hypotheses(
    batch: int, n_workers: int, n_cameras: int, config: ParticleConfig
) -> Hypotheses:
    """Return a state with one hypothesis at the prior for every worker.

    Args:
        batch: number of environments B.
        n_workers: number of workers W in each environment.
        n_cameras: number of cameras C.
        config: settings of the estimator.
    """
    n = config.n_hypotheses
    state = Hypotheses(
        trees=make_records(Tree, (batch, n_workers, n)),
        views=make_records(View, (batch, n_workers, n, n_cameras)),
        noise=make_records(Noise, (batch, n_workers, n, N_JOINTS, n_cameras)),
        n_alive=np.ones((batch, n_workers), np.int64),
        since_search_s=np.zeros((batch, n_workers)),
        pace=make_records(Pace, (batch, n_workers)),
    )
    reset_hypotheses(state, np.arange(batch), config)
    return state


def reset_hypotheses(state: Hypotheses, ids: Ints, config: ParticleConfig) -> None:
    """Reset the workers of environments `ids` to the prior.

    Args:
        state: hypotheses of all environments, changed in place.
        ids: (n,) indices of the environments.
        config: settings of the estimator.
    """
    fresh = np.zeros((), TREE)
    fresh["body"][:, :3] = config.prior_mean_world
    fresh["cov"] = np.eye(6)
    fresh["cov"][:, :3, :3] = config.prior_std_m**2 * np.eye(3)
    fresh["age_s"] = config.max_age_s
    fresh["offset"], fresh["offset_count"] = STANDING_M, STANDING_COUNT
    fresh["bone_length"], fresh["bone_variance"] = make_bone_prior()
    state.trees[ids] = fresh
    state.views[ids] = np.array((config.swap_start_probability, 0, 0), VIEW)
    factor = np.clip(1.0, *config.noise_bounds)  # 1: the detector's own variance
    state.noise[ids] = np.array((factor, np.zeros(N_SUMS), np.zeros(2)), NOISE)
    state.n_alive[ids], state.since_search_s[ids] = 1, 0.0
    state.pace[ids] = np.zeros((), PACE)
