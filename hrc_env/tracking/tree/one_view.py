"""Track initialization from one view, by fits of an average standing body in several headings.

The assumed size determines the depth. The uncertainty of the size, by which the body may be larger
and farther, is stored separately from the Gaussian (`Tree.size_std`) and included in the reported
covariance until two views agree.
"""

import math

import numpy as np

from hrc_env.core.declared import Records1
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.geometry.triangulation import linear_point
from hrc_env.tracking.measurements import Frame
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tree.evidence import log_evidence, score_pose
from hrc_env.tracking.tree.gaussian import ORDER, PARENT
from hrc_env.tracking.tree.learning import learn_lengths
from hrc_env.tracking.tree.pair_calibration import count_views
from hrc_env.tracking.tree.predict import SPEED_M_S
from hrc_env.tracking.tree.search import find_pose_near, set_bone_variances
from hrc_env.tracking.tree.state import STANDING_M, Tree, Work, WorkerHypotheses
from hrc_env.tracking.tree.update import correct_mean, update_tree

_N_TURNS = 8
"""Number of headings that are tried."""
_SEARCH_STEPS = 6
"""Number of Gauss-Newton steps from each heading."""
_LEAST_EVIDENCE = 2.0
"""Minimum evidence for a body per detected joint [nat]. It is at least 4 for people; random points
in a box as large as a body rarely reach this minimum."""
_POSE_STD_M = 0.2
"""Standard deviation of a joint's position relative to its parent before the search [m]. Like the
next three values, it is an estimate that is large enough for bodies that bend and walk."""
_ROOT_STD_M = 0.3
"""Standard deviation of the root's position on each axis [m]."""
_ROOT_SPEED_STD_M_S = 1.0
"""Standard deviation of the root's speed on each axis [m/s]."""
_DEPTH_SHARE = 0.3
"""Relative standard deviation of the root's depth."""
_UNSEEN_UPDATES = 100
"""Number of updates for which the other cameras are initially assumed not to have seen the
worker."""


@kernel(makes_arrays=True)
def start_from_one_view(
    worker: WorkerHypotheses,
    frame: Frame,
    settings: Settings,
    work: Work,
    prior: Records1[Tree],
) -> None:
    """Start a track from one view after `one_view_wait_updates` updates without a second view.

    Args:
        worker: the hypotheses about a worker without a track, changed in place.
        frame: the measurements.
        settings: settings of the estimator.
        work: work arrays.
        prior: (1,) work array for a hypothesis before its update.
    """
    tree, cameras = worker.trees[0], np.zeros(2, np.int64)
    n_views, n = count_views(frame, settings.acquire_min_joints, cameras), tree.one_view_updates
    tree.one_view_updates = n + 1 if n_views == 1 else max(n - 1, 0)
    has_waited = tree.one_view_updates > settings.one_view_wait_updates or len(frame.P) == 1
    if n_views == 1 and has_waited:
        fit_to_one_view(worker, cameras[1], frame, settings, work, prior)
        tree.one_view_updates, worker.since_search_s[0] = 0, settings.hypothesis_search_period_s


@kernel(makes_arrays=True)
def fit_to_one_view(
    worker: WorkerHypotheses,
    camera: int,
    frame: Frame,
    settings: Settings,
    work: Work,
    prior: Records1[Tree],
) -> None:
    """Start a track with the body that explains one view best, if its evidence suffices.

    Args:
        worker: the hypotheses about a worker without a track, changed in place.
        camera: index of the camera.
        frame: the measurements.
        settings: settings of the estimator.
        work: work arrays.
        prior: (1,) work array for a hypothesis before its update.
    """
    tree, best = worker.trees[0], worker.trees[:1].copy()
    most = least = _LEAST_EVIDENCE * frame.ok[:, camera].sum()
    set_bone_variances(tree.bone_variance, settings.bone_variation_scale, work.bone_variance)
    for turn in range(_N_TURNS):
        if not _stand_body(tree, frame, camera, 2.0 * math.pi * turn / _N_TURNS):
            continue
        prior[0], work.point[:] = tree, tree.body[:, :3]
        find_pose_near(tree, frame, settings, _SEARCH_STEPS, 1.0, work)
        update_tree(tree, work)
        evidence = log_evidence(prior[0], tree, frame, settings, work)
        correct_mean(tree, frame, settings, work)
        learn_lengths(tree, work.n_views)
        tree.pose_log_prior = settings.anatomy_exponent * score_pose(tree.body)
        if evidence + tree.pose_log_prior > most:
            best[0], most = tree, evidence + tree.pose_log_prior
    worker.trees[0] = best[0]
    if most > least:
        tree.tracked, tree.size_std = True, settings.size_std
        for c in range(len(frame.P)):
            worker.views[0, c].unseen_updates = 0 if c == camera else _UNSEEN_UPDATES
        if settings.initial_foot_height_std_m > 0.0:
            _measure_size(tree, frame.cameras[camera].eye, settings)


@kernel(makes_arrays=True)
def _stand_body(tree: Tree, frame: Frame, camera: int, angle: float) -> bool:
    """Set a tree to a standing body at the position that fits the pixels of one camera best.

    Args:
        tree: the hypothesis, of which the Gaussian is filled in.
        frame: the measurements.
        camera: index of the camera.
        angle: heading of the body [rad].

    Returns:
        Whether such a position exists.
    """
    P, cos, sin = frame.P[camera], math.cos(angle), math.sin(angle)
    views, place = np.empty((len(STANDING_M), 3, 4)), np.empty(3)
    tree.body[:], tree.cov[:], tree.slope[:] = 0.0, 0.0, 0.0
    for j in range(len(views)):  # every joint is a view of the centre of the body
        forward, left, up = STANDING_M[j]
        x, y = cos * forward - sin * left, sin * forward + cos * left
        tree.body[j, 0], tree.body[j, 1], tree.body[j, 2], views[j] = x, y, up, P
        views[j, :, 3] += P[:, 0] * x + P[:, 1] * y + P[:, 2] * up
    if not linear_point(views, frame.z[:, camera], frame.ok[:, camera], place):
        return False
    along = _DEPTH_SHARE * (place - frame.cameras[camera].eye)
    for j in ORDER:
        q: int = PARENT[j]
        cov = tree.cov[j]
        tree.body[j, :3] += place
        for i in range(3):
            cov[i, i] = (_ROOT_STD_M if q < 0 else _POSE_STD_M) ** 2
            cov[3 + i, 3 + i] = (_ROOT_SPEED_STD_M_S if q < 0 else SPEED_M_S[j]) ** 2
            if q < 0:
                cov[i, :3] += along[i] * along
            else:
                tree.slope[j, i, i] = tree.slope[j, 3 + i, 3 + i] = 1.0
        if q >= 0:
            cov += tree.cov[q]
    return True


@kernel(makes_arrays=True)
def _measure_size(tree: Tree, eye: Floats, settings: Settings) -> None:
    """Scale a body about the camera so that its lowest joint comes closer to the floor.

    Args:
        tree: the hypothesis, of which body, lengths, offsets and `size_std` are changed in place.
        eye: (3,) optical centre of the camera [m].
        settings: settings of the estimator.
    """
    size_std, drop = settings.size_std, eye[2] - tree.body[:, 2].min()
    if drop > 0.0:
        trust = size_std**2 / (size_std**2 + (settings.initial_foot_height_std_m / drop) ** 2)
        size = 1.0 + trust * (eye[2] / drop - 1.0)
        tree.size_std *= math.sqrt(1.0 - trust)
        tree.bone_length[:] *= size
        tree.offset[:] *= size
        for j in range(len(tree.body)):
            tree.body[j, :3] = eye + size * (tree.body[j, :3] - eye)
