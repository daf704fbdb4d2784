"""The kernels of `particle`: one loop over environments, workers and hypotheses.

`state` is `hypotheses.slots.Hypotheses`, `s` and `m` are `settings.Settings` and
`mixture.MixtureSettings`; everything that happens to one hypothesis is `tree.filter`'s.
"""

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.tracking.hypotheses.anatomy import anatomy
from hrc_env.tracking.hypotheses.branching import branch, is_ambiguous
from hrc_env.tracking.hypotheses.mixture import MixtureSettings
from hrc_env.tracking.hypotheses.slots import Hypotheses, drop, merge, normalise
from hrc_env.tracking.measurements import make_seen, read_worker
from hrc_env.tracking.models.acquisition import heading
from hrc_env.tracking.models.noise import NoiseModel, learn_noise, scale_sigma
from hrc_env.tracking.models.swaps import undo_swaps
from hrc_env.tracking.models.track_management import acquire, grow_older
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tracks import count_up
from hrc_env.tracking.tree.evidence import log_evidence
from hrc_env.tracking.tree.filter import condition, correct_mean, follow, keep_positions, recover
from hrc_env.tracking.tree.predict import predict_tree

_TORSO = (1, 2, 7, 8)


@kernel(makes_arrays=True)
def predict_all(state, model, dt, s, m, works):
    """Let dt [s] pass: hypotheses move and age; `model` as in `tree.predict.predict_tree`, the rest
    as in `update_all`."""
    state, s, m = Hypotheses(*state), Settings(*s), MixtureSettings(*m)
    work, limit = works[0], state.trees.shape[1] // state.n_alive.shape[1]
    for b in range(state.n_alive.shape[0]):
        for w in range(state.n_alive.shape[1]):
            if state.trees[b, w * limit].tracked:
                state.waited_s[b, w] += dt
                _move(state, b, w, model, dt, m, work)
            _grow_older(state, b, w, dt, s)


@kernel(makes_arrays=True)
def _move(state, b, w, model, dt, m, work):
    """Move a worker's hypotheses; several at once learn no places on the body."""
    first = w * (state.trees.shape[1] // state.n_alive.shape[1])
    for k in range(first, first + state.n_alive[b, w]):
        tree = state.trees[b, k]
        gaussian = (tree.body, tree.cov, tree.slope)
        if state.n_alive[b, w] == 1:
            predict_tree(*gaussian, tree.offset, tree.offset_count, model, dt, work)
        else:
            for j in range(len(tree.offset)):
                work.offset_count[j] = tree.offset_count[j]
                for i in range(3):
                    work.offset[j, i] = tree.offset[j, i]
            predict_tree(*gaussian, work.offset, work.offset_count, model, dt, work)
            tree.log_weight += m.walking_odds * dt * forwards(tree.body)
    if state.n_alive[b, w] > 1:
        normalise(state, b, w, m.log_drop)


@kernel
def _grow_older(state, b, w, dt, s):
    """Count ages up; a worker who is lost has one hypothesis."""
    first = w * (state.trees.shape[1] // state.n_alive.shape[1])
    tree = state.trees[b, first]
    grow_older(tree, dt, s)
    if not tree.tracked:
        state.n_alive[b, w], tree.log_weight, tree.pose_log_prior = 1, 0.0, 0.0
    for k in range(first + 1, first + state.n_alive[b, w]):
        count_up(state.trees[b, k].age_s, dt, s.max_age_s)


@kernel
def forwards(body):
    """How clearly a body (J, 6) walks forwards, -1 (backwards) to 1."""
    cos, sin, known = heading(body)
    if not known:
        return 0.0
    speed = 0.0
    for j in _TORSO:
        speed += 0.25 * (cos * body[j, 3] + sin * body[j, 4])
    return min(max(speed / 0.5, -1.0), 1.0)


@kernel(makes_arrays=True)
def update_all(state, P, px, confidence, sigma_px, standing, s, m, noise, works):
    """Take one set of frames in.

    Args:
        state: plain tuple of `Hypotheses`, which are changed in place.
        P: (C, 3, 4).
        px, confidence, sigma_px: as in `records.Keypoints`.
        standing: (J, 3) `acquisition.STANDING_M`.
        s, m: plain tuples of `Settings` and `MixtureSettings`.
        noise: of `noise.NoiseModel`.
    """
    state, s, m, noise = Hypotheses(*state), Settings(*s), MixtureSettings(*m), NoiseModel(*noise)
    n_batch, _, n_workers, n_joints = confidence.shape
    prior = (np.empty((n_joints, 6)), np.empty((n_joints, 6, 6)), np.empty((n_joints, 6, 6)))
    limit = state.trees.shape[1] // n_workers
    seen, work = make_seen(P), works[0]
    measured = (seen.z, seen.sigma, seen.ok)
    for b in range(n_batch):
        for w in range(n_workers):
            first = w * limit
            read_worker(px, confidence, sigma_px, b, w, s.sigma_scale, *measured)
            tree = state.trees[b, first]
            if not tree.tracked:
                scale_sigma(state.noise[b, first], seen.sigma)
                if acquire(tree, P, seen.z, seen.sigma, seen.ok, standing, s):
                    tree.slope[:] = 0.0
                continue
            several = state.n_alive[b, w] > 1
            look = limit > 1 and state.waited_s[b, w] >= m.look_every_s
            look &= is_ambiguous(P, tree.body, tree.cov, seen.ok, m)
            for h in range(state.n_alive[b, w]):
                if h > 0:
                    read_worker(px, confidence, sigma_px, b, w, s.sigma_scale, *measured)
                searches = look and h == 0
                _follow(state, b, w, h, several, searches, seen, standing, s, m, noise, prior, work)
            if state.n_alive[b, w] > 1:
                _tidy(state, b, w, m, work)


@kernel(makes_arrays=True)
def _follow(state, b, w, h, several, look, seen, standing, s, m, noise, prior, work):
    """What one set of frames does to one hypothesis; `look` for others beside it."""
    P, z, sigma, ok = seen.P, seen.z, seen.sigma, seen.ok
    k = w * (state.trees.shape[1] // state.n_alive.shape[1]) + h
    tree, learnt = state.trees[b, k], state.noise[b, k]
    scale_sigma(learnt, sigma)
    undo_swaps(P, tree.body, tree.cov, z, sigma, ok, state.views[b, k], s)
    keep_positions(tree.cov, work.predicted)
    evidence = 0.0
    if several or look:
        evidence = _weigh(tree, seen, s, prior, work)
        _weigh_pose(tree, several, m.trust * evidence, m)
    else:
        follow(tree, seen, s, work)
    learn_noise(seen, (tree.body, tree.cov, work.predicted), learnt, noise, work)
    if look:
        state.waited_s[b, w] = 0.0
        branch(state, b, w, prior, evidence, seen, s, m, work)
    recover(tree, seen, standing, s, work)


@kernel
def _weigh_pose(tree, several, gain, m):
    """Weigh a hypothesis by its evidence, and by its pose in the place of the last one."""
    pose_log_prior = m.anatomy * anatomy(tree.body)
    if several:
        tree.log_weight += gain + pose_log_prior - tree.pose_log_prior
    tree.pose_log_prior = pose_log_prior


@kernel(makes_arrays=True)
def _weigh(tree, seen, s, prior, work):
    """Update a hypothesis, keep what it was before in `prior`; its log-evidence."""
    body, cov, slope = tree.body, tree.cov, tree.slope
    prior[0][:], prior[1][:], prior[2][:] = body, cov, slope
    condition(tree, seen, s, work)
    bones = (tree.bone_length, work.bone_variance)
    # the mean correction needs the factors that the evidence leaves alone
    evidence = log_evidence(
        prior, (body, cov, slope), seen, bones, s.inlier_odds, s.floor_std_m, work
    )
    correct_mean(tree, seen, s, work)
    return evidence


@kernel(makes_arrays=True)
def _tidy(state, b, w, m, work):
    """Drop hypotheses that are lost or too light, and merge those that have come close."""
    first = w * (state.trees.shape[1] // state.n_alive.shape[1])
    for h in range(state.n_alive[b, w] - 1, -1, -1):
        if state.n_alive[b, w] > 1 and not state.trees[b, first + h].tracked:
            drop(state, b, w, h)
    normalise(state, b, w, m.log_drop)
    merge(state, b, w, m.close, work)
    normalise(state, b, w, m.log_drop)
