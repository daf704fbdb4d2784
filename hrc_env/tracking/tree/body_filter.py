"""The way of a measurement through the default estimator: one loop over environments and workers.

`update_all` reads a worker's measurements as each hypothesis takes them (`measurements`),
conditions the hypothesis on them (`update`, which searches the mode first: `search`), weighs it
(`evidence`), learns from it (`learning`), looks for other hypotheses (`branching`), repairs what
has gone astray (`acquisition`), and prunes and merges.

`own` are a worker's `Hypotheses`, `s` are `settings.Settings`, `frame` is `measurements.Frame`,
`work` is a record of `WORK`, `scratch` that and room for a prediction.
"""

from hrc_env.core.kernels import kernel
from hrc_env.tracking.measurements import make_frame, read_for_hypothesis, read_worker, scale_sigma
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tracks import age_worker, count_up
from hrc_env.tracking.tree.acquisition import acquire, agree_on_sides, recover, start_track
from hrc_env.tracking.tree.askew import aim_cameras, check_pair_calibration
from hrc_env.tracking.tree.branching import branch, is_ambiguous
from hrc_env.tracking.tree.evidence import heading, normalise, prune_and_merge, weigh_pose
from hrc_env.tracking.tree.learning import NoiseModel, learn_from_frame
from hrc_env.tracking.tree.one_view import start_from_one_view
from hrc_env.tracking.tree.predict import predict_tree
from hrc_env.tracking.tree.report import measure_pace
from hrc_env.tracking.tree.state import Hypotheses
from hrc_env.tracking.tree.update import condition_on_frame

_TORSO = (1, 2, 7, 8)


@kernel(makes_arrays=True)
def update_all(state, cameras, measured, s, noise, works, prior):
    """Update every worker's hypotheses by one set of frames.

    Args:
        state: plain tuple of `Hypotheses`, which are changed in place.
        cameras: (C,) records of `lines_of_sight.CAMERA`, as the rig has them.
        measured: pixels, confidence and sigma of all workers, as `arrays_of` makes them.
        s, noise: plain tuples of `Settings` and of `learning.NoiseModel`.
        works: (1,) scratch, records of `WORK`.
        prior: (1,) records of `TREE`: room for a hypothesis before its update.
    """
    state, s, noise = Hypotheses(*state), Settings(*s), NoiseModel(*noise)
    frame, scratch = make_frame(cameras), (works[0], prior)
    for b in range(state.n_alive.shape[0]):
        for w in range(state.n_alive.shape[1]):
            own, at = worker_slots(state, b, w), (b, w)
            _hang_as_rigged(frame)
            if own.trees[0].pair.askew:
                aim_cameras(own.trees[0].pair, frame)
            if own.trees[0].tracked:
                _update_worker(own, measured, at, frame, s, noise, scratch)
                continue
            read_worker(measured, b, w, s.sigma_scale, frame)
            scale_sigma(own.noise[0], frame.sigma)
            agree_on_sides(frame, s)
            start_track(own, frame, s)
            check_pair_calibration(own, frame, s)
            if not own.trees[0].tracked:
                start_from_one_view(own, frame, s, scratch)


@kernel
def _hang_as_rigged(frame):
    """Write the projections frame.P of the cameras as the rig has them."""
    for c in range(len(frame.P)):
        for i in range(3):
            for k in range(4):
                frame.P[c, i, k] = frame.cameras[c].P[i, k]


@kernel
def _update_worker(own, measured, at, frame, s, noise, scratch):
    """Update the hypotheses about a worker who is tracked, and look for others if it is time."""
    work, prior = scratch
    if own.trees[0].size_std > 0.0:
        read_worker(measured, at[0], at[1], s.sigma_scale, frame)
        if start_track(own, frame, s):
            return
    searches_now = len(own.trees) > 1 and own.waited_s[0] >= s.look_every_s
    if searches_now:
        read_worker(measured, at[0], at[1], s.sigma_scale, frame)
        searches_now = is_ambiguous(own.trees[0], frame, s)
    for h in range(own.n_alive[0]):
        tree, learnt, several = own.trees[h], own.noise[h], own.n_alive[0] > 1
        branches = searches_now and h == 0
        mirrored = read_for_hypothesis(tree, own.views[h], learnt, measured, at, s, frame)
        if mirrored and acquire(tree, frame, s):
            tree.slope[:] = 0.0
        evidence = condition_on_frame(tree, prior, several or branches, frame, s, work)
        if several or branches:
            weigh_pose(tree, several, s.evidence_trust * evidence, s)
        learn_from_frame(frame, tree, learnt, noise, work)
        if branches:
            own.waited_s[0] = 0.0
            branch(own, prior, evidence, frame, s, work)
        recover(tree, frame, s, work)
    if own.n_alive[0] > 1:
        prune_and_merge(own, s, work)
    measure_pace(own)
    check_pair_calibration(own, frame, s)


@kernel(makes_arrays=True)
def worker_slots(state, b, w):
    """Return worker w of environment b alone: (H, ...); `n_alive`, `waited_s`, `pace` are (1,)."""
    trees, views, noise = state.trees[b, w], state.views[b, w], state.noise[b, w]
    n_alive, waited_s = state.n_alive[b, w : w + 1], state.waited_s[b, w : w + 1]
    return Hypotheses(trees, views, noise, n_alive, waited_s, state.pace[b, w : w + 1])


@kernel(makes_arrays=True)
def predict_all(state, model, dt, s, works):
    """Move and age every worker's hypotheses by dt [s].

    `model` is as in `predict_tree`, the rest as in `update_all`.
    """
    state, s = Hypotheses(*state), Settings(*s)
    for b in range(state.n_alive.shape[0]):
        for w in range(state.n_alive.shape[1]):
            own = worker_slots(state, b, w)
            if own.trees[0].tracked:
                own.waited_s[0] += dt
                own.pace[0].since_s += dt
                _move(own, model, dt, s, works[0])
            _grow_older(own, dt, s)


@kernel(makes_arrays=True)
def _move(own, model, dt, s, work):
    """Move a worker's hypotheses; several at once learn no places on the body."""
    several = own.n_alive[0] > 1
    for h in range(own.n_alive[0]):
        tree = own.trees[h]
        if several:
            work.offset[:], work.offset_count[:] = tree.offset, tree.offset_count
        predict_tree(tree, model, dt, work)
        if several:
            tree.offset[:], tree.offset_count[:] = work.offset, work.offset_count
            tree.log_weight += s.walking_odds * dt * forwards(tree.body)
    if several:
        normalise(own, s.log_least_weight)


@kernel
def _grow_older(own, dt, s):
    """Count ages up by dt [s]; give up a track that nothing supports, let a lost one relax."""
    tree = own.trees[0]
    body, ages = tree.body, (tree.age_s, tree.conflict)
    gaussian = (body[:, :3], tree.cov[:, :3, :3], body[:, 3:])
    tree.tracked = age_worker(*gaussian, *ages, tree.tracked, dt, s)
    if not tree.tracked:  # a worker who is lost has one hypothesis
        own.n_alive[0], tree.log_weight, tree.pose_log_prior = 1, 0.0, 0.0
    for h in range(1, own.n_alive[0]):
        count_up(own.trees[h].age_s, dt, s.max_age_s)


@kernel
def forwards(body):
    """Return how clearly a body (J, 6) walks forwards, from -1 (backwards) to 1."""
    cos, sin, known = heading(body)
    if not known:
        return 0.0
    speed = 0.0
    for j in _TORSO:
        speed += 0.25 * (cos * body[j, 3] + sin * body[j, 4])
    return min(max(speed / 0.5, -1.0), 1.0)
