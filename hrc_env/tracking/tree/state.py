"""The state of the default estimator, as records declared in one place.

The joints of a body share their errors: with one view the depth of all of them is wrong together.
So the whole body is one Gaussian with the dependencies of the kinematic tree (`gaussian`), and a
worker is a few such hypotheses. `predict` moves them, `update` conditions them on a frame,
`evidence` weighs them.
"""

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
"""Columns of the arrays of `search`: one for each joint, and one that is padding."""
N_POINT = 9
"""Rows of `Work.points`: x, y, z [m]; then 00, 11, 22, 01, 02, 12 of the predicted position
covariance [m^2]."""
N_VIEW = 3
"""Rows of `Frame.views`: u, v [px] and precision [1/px^2]; all 0 without a measurement."""
N_IMAGE = 12
"""Rows of `Work.image`: weight of the measurement, 0 to 1; logarithm and factor of its odds of
being an inlier; Jacobians of u and of v [px/m]; residuals [px]; reciprocal of the depth [1/m], 0
for a joint without a usable pixel."""
N_SUM = 9
"""Rows of `Work.sums`: information 00, 11, 22, 01, 02, 12 [1/m^2], then gradient [1/m]."""
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
"""(J, 3) joints of a standing adult from the middle of the torso [m]: forward, left, up."""
STANDING_COUNT = 5.0
"""Updates that the standing body's offsets are worth before any was learnt."""
N_SUMS = 5
"""Length of `Noise.sums`."""
SQUARES, REDUNDANCY, PRODUCTS, LAST_SQUARES, TURN = range(N_SUMS)
"""Entries of `Noise.sums`: fading sums of the residuals' squares, of their redundancy, of their
products with the last residuals and of the last residuals' squares; and, at the first joint and
camera only, the number of the turn in which joints are learnt from."""
POPULATION_SHARE = 0.10
"""Standard deviation of a bone's length over people, as a share of it."""
STIFFNESS_M: Floats = np.where(np.any(JOINT["nose"] == BONES, axis=-1), 0.05, 0.02)
"""Standard deviation of each distance of `skeleton.BONES` within one person [m]: the head turns
on its neck."""
EDGE_STIFFNESS_M = tuple(
    0.0 if j == ROOT else float(STIFFNESS_M[k]) for j, k in enumerate(EDGE_BONE)
)
"""The same of the edge from each joint to its parent [m]; 0 at the root."""
_J = N_JOINTS


class Pair:
    """The relative calibration of two cameras that alone see a worker.

    `pair_calibration` learns it.
    """

    cameras: Annotated[Ints, (2,)]
    """Indices of the two cameras."""
    information: Annotated[Floats, (6, 6)]
    """Fading information of the gaps between lines of sight about the turns [1/rad^2]."""
    score: Annotated[Floats, (6,)]
    """Information times the turns that the gaps alone measure [1/rad]."""
    turn: Annotated[Floats, (6,)]
    """Estimated rotation vectors of the first and of the second camera in the world frame [rad]."""
    turn_cov: Annotated[Floats, (6, 6)]
    """Covariance of the two rotation vectors [rad^2]."""
    meeting_share: float
    """Share of the last updates, fading, in which the lines of sight of most joints met."""
    is_misaligned: bool
    """Whether the cameras count as turned against their calibration."""
    untracked_updates: int
    """Updates in which both cameras showed a person without a track, less those in which not."""


class Tree:
    """The Gaussian of one hypothesis about one worker, with all that it has learnt about them."""

    body: Annotated[Floats, (_J, 6)]
    """Mean position [m] and velocity [m/s] of each joint in the world frame."""
    cov: Annotated[Floats, (_J, 6, 6)]
    """Marginal covariance of each joint's position and velocity."""
    slope: Annotated[Floats, (_J, 6, 6)]
    """Slope of each joint on its parent (B_j of `gaussian`); without meaning at the root."""
    age_s: Annotated[Floats, (_J,)]
    """Time since a measurement last supported the joint [s]."""
    conflict: Annotated[Ints, (_J,)]
    """Updates in a row in which two or more cameras measured the joint without supporting it."""
    tracked: bool
    """Whether the worker is tracked."""
    one_view_updates: int
    """Updates in which one camera alone has shown a person while the worker was not tracked, less
    those in which not."""
    size_std: float
    """Relative standard deviation of the size, and with it of the distance, of a body while one
    camera alone has begun its track; 0 once two cameras agree."""
    pair: Pair
    """Relative calibration of the two cameras that alone see the body."""
    displaced_m2: Annotated[Floats, (3, 3)]
    """Covariance of the body's displacement as a whole that the uncertain turns of `pair` leave
    [m^2]."""
    offset: Annotated[Floats, (_J, 3)]
    """Mean place of each joint relative to the middle of the torso, in the torso's axes forward,
    left and up [m]."""
    offset_count: Annotated[Floats, (_J,)]
    """Number of updates from which the joint's offset was learnt."""
    bone_length: Annotated[Floats, (_J,)]
    """Distance from each joint to its parent [m]."""
    bone_variance: Annotated[Floats, (_J,)]
    """Variance of that distance [m^2]."""
    log_weight: float
    """Logarithm of the hypothesis's probability."""
    pose_log_prior: float
    """The part of `log_weight` that the present pose's plausibility contributes."""


class View:
    """Memory of one camera in a hypothesis."""

    swap_chance: float
    """Probability that the camera exchanges left and right."""
    unseen_updates: int
    """Updates since the camera last saw the worker."""
    trusted_updates: int
    """Updates for which the camera's left and right are still taken as they are."""


class Noise:
    """The measurement noise of one joint in one camera, as `learning` learns it."""

    factor: float
    """Learnt factor on the variance that the detector reports."""
    sums: Annotated[Floats, (N_SUMS,)]
    """Statistics that the factor is learnt from; see `SQUARES` and the names after it."""
    last_residual: Annotated[Floats, (2,)]
    """Last residuals of u and v in reported standard deviations, fading; 0 without any."""


class Pace:
    """How fast a worker has moved lately."""

    across: Annotated[Floats, (2,)]
    """Unit vector across hips and shoulders on the floor in the last update."""
    up: Annotated[Floats, (3,)]
    """Unit vector from the hips to the shoulders in the last update."""
    since_s: float
    """Time since the last update [s]."""
    is_known: bool
    """Whether there was an update since the track began."""
    turn_rad_s: float
    """Fading mean of the rate of turning about the vertical [rad/s]."""
    tip_rad_s: float
    """Fading mean of the rate at which the trunk tips [rad/s]."""
    speed_m_s: float
    """Fading mean of the trunk's speed [m/s]."""


class Work:
    """Scratch of the kernels for one tree; j is a joint, q its parent."""

    a: Annotated[Floats, (6, 6)]
    """Scratch matrix."""
    b: Annotated[Floats, (6, 6)]
    """Scratch matrix."""
    c: Annotated[Floats, (6, 6)]
    """Scratch matrix."""
    d: Annotated[Floats, (6, 6)]
    """Scratch matrix."""
    edge: Annotated[Floats, (_J, 6, 6)]
    """Covariance of each joint with its parent."""
    root: Annotated[Floats, (_J, 6, 6)]
    """Covariance of each joint with the mean of the four torso joints."""
    moved: Annotated[Floats, (_J, 6, 6)]
    """Covariance of each joint a moment later; growth of it in `update.widen_jumped_joints`."""
    moved_edge: Annotated[Floats, (_J, 6, 6)]
    """Covariance of each joint with its parent a moment later."""
    precision: Annotated[Floats, (_J, 6, 6)]
    """Precision of each joint given its parent, P_j; with the bone's information, if added."""
    coupling: Annotated[Floats, (_J, 6, 6)]
    """Coupling P_j B_j of each joint to its parent; with the bone's information, if added."""
    back: Annotated[Floats, (_J, 6, 6)]
    """Information B_j' P_j B_j of each joint about its parent; with the bone's, if added."""
    known: Annotated[Floats, (_J, 6, 6)]
    """Information of the cameras and of the subtree about each joint."""
    inverse: Annotated[Floats, (_J, 6, 6)]
    """Inverse Hessian of each joint given its parent."""
    step: Annotated[Floats, (_J, 6)]
    """Change of the means."""
    gradient: Annotated[Floats, (_J, 6)]
    """Gradient of the log-likelihood about the means."""
    position_precision: Annotated[Floats, (_J, 3, 3)]
    """Precision of each position given the parent's [1/m^2]."""
    position_slope: Annotated[Floats, (_J, 3, 3)]
    """Slope of each position on the parent's."""
    position_coupling: Annotated[Floats, (_J, 3, 3)]
    """Precision times slope of each position [1/m^2]."""
    position_back: Annotated[Floats, (_J, 3, 3)]
    """Information of each position's slope about the parent's position [1/m^2]."""
    position_inverse: Annotated[Floats, (_J, 3, 3)]
    """Inverse Hessian of each position given the parent's [m^2]."""
    node: Annotated[Floats, (_J, 3, 3)]
    """Information of the cameras and of the subtree about each position [1/m^2]."""
    node_gradient: Annotated[Floats, (_J, 3)]
    """Gradient that belongs to `node` [1/m]."""
    point: Annotated[Floats, (_J, 3)]
    """Positions at which the likelihood is linearised [m]."""
    shift: Annotated[Floats, (_J, 3)]
    """Those positions minus the predicted means [m]."""
    camera_information: Annotated[Floats, (_J, 3, 3)]
    """Information of the cameras about the shift of each joint [1/m^2]."""
    camera_gradient: Annotated[Floats, (_J, 3)]
    """Gradient of the cameras' log-likelihood at no shift [1/m]."""
    edge_information: Annotated[Floats, (_J, 3, 3)]
    """Information of the bones about x_j - x_q [1/m^2]; without meaning at the root."""
    edge_gradient: Annotated[Floats, (_J, 3)]
    """Gradient of the bones' log-likelihood at no shift [1/m]; without meaning at the root."""
    points: Annotated[Floats, (N_POINT, LANES)]
    """Positions and predicted covariances, a column for each joint; see `N_POINT`."""
    image: Annotated[Floats, (N_IMAGE, LANES)]
    """The joints in one camera; see `N_IMAGE`."""
    sums: Annotated[Floats, (N_SUM, LANES)]
    """Information and gradient of the cameras; see `N_SUM`."""
    spread: Annotated[Floats, (3, 4)]
    """Covariance of a joint triangulated from one frame [m^2] and, in the last column, its offset
    from the mean [m]."""
    persistence: Annotated[Floats, (_J,)]
    """Factor on a joint's variance for errors that persist, of which only a part averages out;
    negative for a joint that is not learnt from."""
    n_views: Annotated[Ints, (_J,)]
    """Number of cameras that measured each joint."""
    bone_variance: Annotated[Floats, (_J,)]
    """Variances of the bones' lengths as measurements [m^2]."""
    offset: Annotated[Floats, (_J, 3)]
    """Copy of `Tree.offset` where a prediction must not change it [m]."""
    offset_count: Annotated[Floats, (_J,)]
    """Copy of `Tree.offset_count` likewise."""
    predicted: Annotated[Floats, (_J, 3, 3)]
    """Position covariances before the update [m^2]."""
    is_placed: Annotated[NDArray[np.int8], (_J,)]
    """1 for joints that were found again in this update."""
    axes: Annotated[Floats, (2, 3, 3)]
    """Axes of the trunk and of the legs; columns forward, left and up."""
    place: Annotated[Floats, (3,)]
    """Mean place of a joint relative to the torso in the world's axes [m]."""


PAIR = dtype_of(Pair)
TREE = dtype_of(Tree)
VIEW = dtype_of(View)
NOISE = dtype_of(Noise)
PACE = dtype_of(Pace)
WORK = dtype_of(Work)


class Hypotheses(NamedTuple):
    """The hypotheses about every worker; kernels change the arrays in place."""

    trees: Records3[Tree]
    """(B, W, H) Gaussians; the weights of those in use sum to one, the first is the heaviest."""
    views: Records4[View]
    """(B, W, H, C) memory of each camera."""
    noise: Records5[Noise]
    """(B, W, H, J, C) learnt measurement noise."""
    n_alive: Ints
    """(B, W) number of hypotheses in use, at least one."""
    since_search_s: Floats
    """(B, W) time since other hypotheses were last searched for [s]."""
    pace: Records2[Pace]
    """(B, W) recent speed of the heaviest hypothesis."""


class WorkerHypotheses(NamedTuple):
    """The hypotheses about one worker: views into `Hypotheses`."""

    trees: Records1[Tree]
    """(H,) Gaussians."""
    views: Records2[View]
    """(H, C) memory of each camera."""
    noise: Records3[Noise]
    """(H, J, C) learnt measurement noise."""
    n_alive: Ints
    """(1,) number of hypotheses in use."""
    since_search_s: Floats
    """(1,) time since other hypotheses were last searched for [s]."""
    pace: Records1[Pace]
    """(1,) recent speed of the heaviest hypothesis."""


class BoneLengths(NamedTuple):
    """Distances from joints to their parents, one entry for each joint."""

    mean_m: Floats
    """(J,) mean lengths [m]; 1 at the root."""
    variance_m2: Floats
    """(J,) their variances [m^2]."""


def make_bone_prior() -> BoneLengths:
    """Return the lengths of bones over the population."""
    length = np.array([1.0 if k < 0 else BONE_LENGTH_M[k] for k in EDGE_BONE])
    return BoneLengths(length, (POPULATION_SHARE * length) ** 2)


def make_hypotheses(
    batch: int, n_workers: int, n_cameras: int, config: ParticleConfig
) -> Hypotheses:
    """Return one hypothesis at the prior for every worker.

    Args:
        batch: number of environments B.
        n_workers: number of workers W in each.
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
    """Put the workers of environments `ids` back to the prior.

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
