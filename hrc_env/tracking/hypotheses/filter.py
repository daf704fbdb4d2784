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
    state, s, m = hypotheses(state), Settings(*s), MixtureSettings(*m)
    work, slots = works[0], state.slots
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
def update_all(state, P, px, confidence, sigma_px, standing, s, m, noise, works):
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
    n_batch, _, n_workers, n_joints = confidence.shape
    prior = (np.empty((n_joints, 6)), np.empty((n_joints, 6, 6)), np.empty((n_joints, 6, 6)))
    slots, limit = state.slots, state.slots.tracked.shape[1] // n_workers
    seen, work = make_seen(P), works[0]
    measured = (seen.z, seen.sigma, seen.ok)
    for b in range(n_batch):
        for w in range(n_workers):
            first = w * limit
            read_worker(px, confidence, sigma_px, b, w, s.sigma_scale, *measured)
            if not slots.tracked[b, first]:
                scale_sigma(slots.noise_factor[b, first], seen.sigma)
                if acquire(slots, b, first, P, seen.z, seen.sigma, seen.ok, standing, s):
                    slots.slope[b, first] = 0.0
                continue
            several = state.n_alive[b, w] > 1
            look = limit > 1 and state.waited_s[b, w] >= m.look_every_s
            look &= is_ambiguous(P, slots.body[b, first], slots.cov[b, first], seen.ok, m)
            for h in range(state.n_alive[b, w]):
                if h > 0:
                    read_worker(
                        px, confidence, sigma_px, b, w, s.sigma_scale, seen.z, seen.sigma, seen.ok
                    )
                searches = look and h == 0
                _follow(state, b, w, h, several, searches, seen, standing, s, m, noise, prior, work)
            if state.n_alive[b, w] > 1:
                _tidy(state, b, w, m, work)


@kernel(makes_arrays=True)
def _follow(state, b, w, h, several, look, seen, standing, s, m, noise, prior, work):
    """What one set of frames does to one hypothesis; `look` for others beside it."""
    P, z, sigma, ok = seen.P, seen.z, seen.sigma, seen.ok
    slots = state.slots
    k = w * (slots.tracked.shape[1] // state.n_alive.shape[1]) + h
    scale_sigma(slots.noise_factor[b, k], sigma)
    swaps = (slots.swap_chance[b, k], slots.blind[b, k], slots.believed[b, k])
    undo_swaps(P, slots.body[b, k], slots.cov[b, k], z, sigma, ok, *swaps, s)
    keep_positions(slots.cov[b, k], work.predicted)
    evidence = 0.0
    if several or look:
        evidence = _weigh(slots, b, k, seen, s, prior, work)
        _weight_form(state, b, k, several, m.trust * evidence, m)
    else:
        follow(slots, b, k, seen, s, work)
    known = (slots.noise_factor[b, k], slots.noise_sums[b, k], slots.noise_last[b, k])
    body = (slots.body[b, k], slots.cov[b, k], work.predicted)
    learn_noise(seen, body, *known, noise, work)
    if look:
        state.waited_s[b, w] = 0.0
        branch(state, b, w, prior, evidence, seen, s, m, work)
    recover(slots, b, k, seen, standing, s, work)


@kernel
def _weight_form(state, b, k, several, gain, m):
    """Weigh a hypothesis by its evidence, and by its pose in the place of the last one."""
    pose_log_prior = m.anatomy * anatomy(state.slots.body[b, k])
    if several:
        state.log_weight[b, k] += gain + pose_log_prior - state.pose_log_prior[b, k]
    state.pose_log_prior[b, k] = pose_log_prior


@kernel(makes_arrays=True)
def _weigh(slots, b, k, seen, s, prior, work):
    """Update a hypothesis, keep what it was before in `prior`; its log-evidence."""
    body, cov, slope = slots.body[b, k], slots.cov[b, k], slots.slope[b, k]
    prior[0][:], prior[1][:], prior[2][:] = body, cov, slope
    condition(slots, b, k, seen, s, work)
    bones = (slots.bone_length[b, k], work.bone_variance)
    # the mean correction needs the factors that the evidence leaves alone
    evidence = log_evidence(
        prior, (body, cov, slope), seen, bones, s.inlier_odds, s.floor_std_m, work
    )
    correct_mean(slots, b, k, seen, s, work)
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
