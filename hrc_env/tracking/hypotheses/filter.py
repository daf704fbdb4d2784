"""The kernels of `particle`: one loop over environments, workers and hypotheses.

`state` is `hypotheses.slots.Hypotheses`, `s` and `m` are `settings.Settings` and
`mixture.MixtureSettings`; everything that happens to one hypothesis is `tree.filter`'s.
"""

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.tracking.hypotheses.anatomy import anatomy
from hrc_env.tracking.hypotheses.branching import branch, is_ambiguous
from hrc_env.tracking.hypotheses.mixture import MixtureSettings
from hrc_env.tracking.hypotheses.slots import drop, hypotheses, merge, normalise
from hrc_env.tracking.measurements import read_worker
from hrc_env.tracking.models.acquisition import heading
from hrc_env.tracking.models.noise import NoiseModel, learn_noise, scale_sigma
from hrc_env.tracking.models.proposal import inlier_odds_of
from hrc_env.tracking.models.swaps import undo_swaps
from hrc_env.tracking.models.track_management import acquire, grow_older
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tracks import count_up
from hrc_env.tracking.tree.evidence import log_evidence
from hrc_env.tracking.tree.filter import condition, correct_mean, follow, keep_positions, recover
from hrc_env.tracking.tree.predict import predict_tree
from hrc_env.tracking.tree.work import make_work

_TORSO = (1, 2, 7, 8)


@kernel(makes_arrays=True)
def predict_all(state, model, dt, s, m):
    """Let dt [s] pass: hypotheses move and age; `model` as in `tree.predict.predict_tree`, the rest
    as in `update_all`."""
    state, s, m = hypotheses(state), Settings(*s), MixtureSettings(*m)
    work, slots = make_work(0), state.slots
    n_joints = slots.body.shape[2]
    held = (np.empty((n_joints, 3)), np.empty(n_joints))
    limit = slots.tracked.shape[1] // state.n_alive.shape[1]
    for b in range(state.n_alive.shape[0]):
        for w in range(state.n_alive.shape[1]):
            if slots.tracked[b, w * limit]:
                state.waited_s[b, w] += dt
                _move(state, b, w, model, dt, m, held, work)
            _grow_older(state, b, w, dt, s)


@kernel
def _move(state, b, w, model, dt, m, held, work):
    """Move a worker's hypotheses; several at once learn no places on the body (`held`)."""
    slots = state.slots
    first = w * (slots.tracked.shape[1] // state.n_alive.shape[1])
    for k in range(first, first + state.n_alive[b, w]):
        gaussian = (slots.body[b, k], slots.cov[b, k], slots.slope[b, k])
        if state.n_alive[b, w] == 1:
            learnt = (slots.offset[b, k], slots.offset_count[b, k])
            predict_tree(*gaussian, *learnt, model, dt, work)
        else:
            places, counts = held
            for j in range(len(counts)):
                counts[j] = slots.offset_count[b, k, j]
                for i in range(3):
                    places[j, i] = slots.offset[b, k, j, i]
            predict_tree(*gaussian, places, counts, model, dt, work)
            state.log_weight[b, k] += m.walking_odds * dt * forwards(slots.body[b, k])
    if state.n_alive[b, w] > 1:
        normalise(state, b, w, m.log_drop)


@kernel
def _grow_older(state, b, w, dt, s):
    """Count ages up; a worker who is lost has one hypothesis."""
    slots = state.slots
    first = w * (slots.tracked.shape[1] // state.n_alive.shape[1])
    grow_older(slots, b, first, dt, s)
    if not slots.tracked[b, first]:
        state.n_alive[b, w], state.log_weight[b, first], state.pose_log_prior[b, first] = (
            1,
            0.0,
            0.0,
        )
    for k in range(first + 1, first + state.n_alive[b, w]):
        count_up(slots.age_s[b, k], dt, s.max_age_s)


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
def update_all(state, P, px, confidence, sigma_px, standing, s, m, noise):
    """Take one set of frames in.

    Args:
        state: `slots.plain` of `Hypotheses`, which are changed in place.
        P: (C, 3, 4).
        px, confidence, sigma_px: as in `records.Keypoints`.
        standing: (J, 3) `acquisition.STANDING_M`.
        s, m: plain tuples of `Settings` and `MixtureSettings`.
        noise: of `noise.NoiseModel`.
    """
    state, s, m, noise = hypotheses(state), Settings(*s), MixtureSettings(*m), NoiseModel(*noise)
    n_batch, n_cameras, n_workers, n_joints = confidence.shape
    z, sigma = np.empty((n_joints, n_cameras, 2)), np.empty((n_joints, n_cameras))
    ok, belief = np.empty((n_joints, n_cameras), np.bool_), np.empty((n_joints, n_cameras))
    scratch = (belief, np.empty(n_joints), make_work(n_cameras))
    placed, predicted = np.empty(n_joints, np.bool_), np.empty((n_joints, 3, 3))
    prior = (np.empty((n_joints, 6)), np.empty((n_joints, 6, 6)), np.empty((n_joints, 6, 6)))
    kept = (scratch, prior, placed, predicted)
    slots, limit = state.slots, state.slots.tracked.shape[1] // n_workers
    seen = (P, z, sigma, ok)
    for b in range(n_batch):
        for w in range(n_workers):
            first = w * limit
            read_worker(px, confidence, sigma_px, b, w, s.sigma_scale, z, sigma, ok)
            if not slots.tracked[b, first]:
                scale_sigma(slots.noise_factor[b, first], sigma)
                if acquire(slots, b, first, *seen, standing, s):
                    slots.slope[b, first] = 0.0
                continue
            several = state.n_alive[b, w] > 1
            look = limit > 1 and state.waited_s[b, w] >= m.look_every_s
            look &= is_ambiguous(P, slots.body[b, first], slots.cov[b, first], ok, m)
            for h in range(state.n_alive[b, w]):
                if h > 0:
                    read_worker(px, confidence, sigma_px, b, w, s.sigma_scale, z, sigma, ok)
                searches = look and h == 0
                _follow(state, b, w, h, several, searches, seen, standing, s, m, noise, kept)
            if state.n_alive[b, w] > 1:
                _tidy(state, b, w, m, scratch[2])


@kernel(makes_arrays=True)
def _follow(state, b, w, h, several, look, seen, standing, s, m, noise, kept):
    """What one set of frames does to one hypothesis; `look` for others beside it."""
    scratch, prior, placed, predicted = kept
    P, z, sigma, ok = seen
    slots = state.slots
    k = w * (slots.tracked.shape[1] // state.n_alive.shape[1]) + h
    scale_sigma(slots.noise_factor[b, k], sigma)
    swaps = (slots.swap_chance[b, k], slots.blind[b, k], slots.believed[b, k])
    undo_swaps(P, slots.body[b, k], slots.cov[b, k], z, sigma, ok, *swaps, s)
    keep_positions(slots.cov[b, k], predicted)
    evidence = 0.0
    if several or look:
        evidence = _weigh(slots, b, k, seen, s, prior, scratch)
        _weight_form(state, b, k, several, m.trust * evidence, m)
    else:
        follow(slots, b, k, seen, s, scratch)
    known = (slots.noise_factor[b, k], slots.noise_sums[b, k], slots.noise_last[b, k])
    body = (slots.body[b, k], slots.cov[b, k], predicted)
    learn_noise(seen, scratch[0], body, *known, noise, scratch[2])
    if look:
        state.waited_s[b, w] = 0.0
        branch(state, b, w, prior, evidence, seen, s, m, scratch)
    recover(slots, b, k, seen, standing, s, placed, scratch[2].a)


@kernel
def _weight_form(state, b, k, several, gain, m):
    """Weigh a hypothesis by its evidence, and by its pose in the place of the last one."""
    pose_log_prior = m.anatomy * anatomy(state.slots.body[b, k])
    if several:
        state.log_weight[b, k] += gain + pose_log_prior - state.pose_log_prior[b, k]
    state.pose_log_prior[b, k] = pose_log_prior


@kernel(makes_arrays=True)
def _weigh(slots, b, k, seen, s, prior, scratch):
    """Update a hypothesis, keep what it was before in `prior`; its log-evidence."""
    body, cov, slope = slots.body[b, k], slots.cov[b, k], slots.slope[b, k]
    prior[0][:], prior[1][:], prior[2][:] = body, cov, slope
    condition(slots, b, k, seen, s, scratch)
    inlier_odds = inlier_odds_of(s.outlier_weight, s.image_area_px)
    bones = (slots.bone_length[b, k], scratch[1])
    # the mean correction needs the factors that the evidence leaves alone
    evidence = log_evidence(
        prior, (body, cov, slope), seen, bones, inlier_odds, s.floor_std_m, scratch[2]
    )
    correct_mean(slots, b, k, seen, s, scratch)
    return evidence


@kernel
def _tidy(state, b, w, m, work):
    """Drop hypotheses that are lost or too light, and merge those that have come close."""
    first = w * (state.slots.tracked.shape[1] // state.n_alive.shape[1])
    for h in range(state.n_alive[b, w] - 1, -1, -1):
        if state.n_alive[b, w] > 1 and not state.slots.tracked[b, first + h]:
            drop(state, b, w, h)
    normalise(state, b, w, m.log_drop)
    merge(state, b, w, m.close, work)
    normalise(state, b, w, m.log_drop)
