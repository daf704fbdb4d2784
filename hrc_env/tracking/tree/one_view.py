"""A track that one view alone begins: a standing body of usual size, turned every way, is fitted.

The size gives the depth: the body may be farther and larger by a share that is kept beside the
Gaussian (`size_std` of `tree.state.TREE`) and reported with it, until two views agree.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.geometry.triangulation import linear_point
from hrc_env.tracking.tree.askew import count_views
from hrc_env.tracking.tree.evidence import anatomy, log_evidence
from hrc_env.tracking.tree.gaussian import ORDER, PARENT
from hrc_env.tracking.tree.learning import learn_lengths
from hrc_env.tracking.tree.predict import SPEED_M_S
from hrc_env.tracking.tree.search import find_pose_near, stiff_lengths
from hrc_env.tracking.tree.state import STANDING_M
from hrc_env.tracking.tree.update import correct_mean, update_tree

_N_TURNS, _SEARCH_STEPS = 8, 6
_LEAST_EVIDENCE = 2.0
"""For the body, a joint that the view has found [nat]: people have 4 and more, points anywhere in a
box as large as a body hardly ever as much."""
_POSE_STD_M, _ROOT_STD_M, _ROOT_SPEED_STD_M_S, _DEPTH_SHARE = 0.2, 0.3, 1.0, 0.3
"""Before the search: of a joint's place on its parent's, of the root's place and speed on each
axis, and of its depth as a share; judgements, wide enough for bodies that bend and walk."""
_BLIND = 100
"""Updates for which the other cameras count as blind."""


@kernel(makes_arrays=True)
def start_from_one_view(own, frame, s, scratch):
    """Begin a track from one view where no second one has come for a while."""
    tree, cameras = own.trees[0], np.zeros(2, np.int64)
    n_views = count_views(frame, s.acquire_min_joints, cameras)
    tree.waited = tree.waited + 1 if n_views == 1 else max(tree.waited - 1, 0)
    if n_views == 1 and (tree.waited > s.wait_updates or len(frame.P) == 1):
        begin_from_one(own, cameras[1], frame, s, scratch)
        tree.waited, own.waited_s[0] = 0, s.look_every_s


@kernel(makes_arrays=True)
def begin_from_one(own, camera, frame, s, scratch):
    """Make slot 0 of `Hypotheses` the body that explains one camera best, if any does."""
    work, prior = scratch
    tree, best = own.trees[0], own.trees[:1].copy()
    most = least = _LEAST_EVIDENCE * frame.ok[:, camera].sum()
    stiff_lengths(tree.bone_variance, s.bone_give, work.bone_variance)
    for turn in range(_N_TURNS):
        if not _stand(tree, frame, camera, 2.0 * math.pi * turn / _N_TURNS):
            continue
        prior[0], work.point[:] = tree, tree.body[:, :3]
        find_pose_near(tree, frame, s, _SEARCH_STEPS, 1.0, work)
        update_tree(tree, work)
        evidence = log_evidence(prior[0], tree, frame, s, work)
        correct_mean(tree, frame, s, work)
        learn_lengths(tree, work.n_views)
        tree.pose_log_prior = s.anatomy_trust * anatomy(tree.body)
        if evidence + tree.pose_log_prior > most:
            best[0], most = tree, evidence + tree.pose_log_prior
    own.trees[0] = best[0]
    if most > least:
        tree.tracked, tree.size_std = True, s.size_std
        own.views[0].blind[:] = _BLIND
        own.views[0, camera].blind = 0
        if s.stands_std_m > 0.0:
            _measure_size(tree, frame.cameras[camera].eye, s)


@kernel(makes_arrays=True)
def _stand(tree, frame, camera, angle):
    """Predict a body that stands turned by `angle` [rad] where its joints fit the pixels best;
    whether it can be in view."""
    P, cos, sin = frame.P[camera], math.cos(angle), math.sin(angle)
    views, place = np.empty((len(STANDING_M), 3, 4)), np.empty(3)
    tree.body[:], tree.cov[:], tree.slope[:] = 0.0, 0.0, 0.0
    for j in range(len(views)):  # every joint is a view of the middle of the body
        forward, left, up = STANDING_M[j]
        x, y = cos * forward - sin * left, sin * forward + cos * left
        tree.body[j, 0], tree.body[j, 1], tree.body[j, 2], views[j] = x, y, up, P
        views[j, :, 3] += P[:, 0] * x + P[:, 1] * y + P[:, 2] * up
    if not linear_point(views, frame.z[:, camera], frame.ok[:, camera], place):
        return False
    along = _DEPTH_SHARE * (place - frame.cameras[camera].eye)
    for j in ORDER:
        q, cov = PARENT[j], tree.cov[j]
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
def _measure_size(tree, eye, s):
    """Measure the size of a body (and how surely) that has its lowest joint on the floor."""
    drop = eye[2] - tree.body[:, 2].min()
    if drop > 0.0:
        trust = s.size_std**2 / (s.size_std**2 + (s.stands_std_m / drop) ** 2)
        size = 1.0 + trust * (eye[2] / drop - 1.0)
        tree.size_std *= math.sqrt(1.0 - trust)
        tree.bone_length[:] *= size
        tree.offset[:] *= size
        for j in range(len(tree.body)):
            tree.body[j, :3] = eye + size * (tree.body[j, :3] - eye)
