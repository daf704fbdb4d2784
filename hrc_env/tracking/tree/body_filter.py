"""Prediction and update of the default estimator, in loops over environments and workers.

For each hypothesis about a worker, `update_all` prepares the measurements (`measurements`), finds
the posterior mode (`search`), conditions the hypothesis (`update`), weights it (`evidence`) and
learns from it (`learning`). It also searches for alternative hypotheses (`branching`), reacquires
contradicted joints (`acquisition`), and prunes and merges hypotheses.
"""

from hrc_env.core.declared import Records1
from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats
from hrc_env.geometry.lines_of_sight import Camera
from hrc_env.tracking.measurements import (
    Frame,
    KeypointArrays,
    make_frame,
    read_for_hypothesis,
    read_worker,
    scale_sigma,
)
from hrc_env.tracking.settings import Settings
from hrc_env.tracking.tracks import age_worker, count_up
from hrc_env.tracking.tree.acquisition import acquire, agree_on_sides, recover, start_track
from hrc_env.tracking.tree.branching import branch, is_ambiguous
from hrc_env.tracking.tree.evidence import (
    find_heading,
    normalise_weights,
    prune_and_merge,
    weigh_pose,
)
from hrc_env.tracking.tree.learning import NoiseModel, learn_from_frame
from hrc_env.tracking.tree.one_view import start_from_one_view
from hrc_env.tracking.tree.pair_calibration import check_pair_calibration, write_projections
from hrc_env.tracking.tree.predict import MotionModel, predict_tree
from hrc_env.tracking.tree.report import measure_pace
from hrc_env.tracking.tree.state import Hypotheses, Tree, Work, WorkerHypotheses
from hrc_env.tracking.tree.update import condition_on_frame

_TORSO = (1, 2, 7, 8)
_WALKING_M_S = 0.5
"""Minimum speed along the heading at which a body certainly walks forwards [m/s]."""


@kernel(makes_arrays=True)
def update_all(
    state: Hypotheses,
    cameras: Records1[Camera],
    measured: KeypointArrays,
    settings: Settings,
    noise_model: NoiseModel,
    works: Records1[Work],
    prior: Records1[Tree],
) -> None:
    """Update every worker's hypotheses by one set of frames.

    Args:
        state: the hypotheses, changed in place.
        cameras: (C,) cameras of the rig.
        measured: pixels, confidences and standard deviations of all workers.
        settings: settings of the estimator.
        noise_model: constants for learning the measurement noise.
        works: (1,) work arrays.
        prior: (1,) work array for a hypothesis before its update.
    """
    frame, work = make_frame(cameras), works[0]
    for b in range(state.n_alive.shape[0]):
        for w in range(state.n_alive.shape[1]):
            worker = select_worker(state, b, w)
            tree = worker.trees[0]
            write_projections(tree.pair, frame)
            if tree.tracked:
                _update_worker(worker, measured, b, w, frame, settings, noise_model, work, prior)
                continue
            read_worker(measured, b, w, settings.sigma_scale, frame)
            scale_sigma(worker.noise[0], frame.sigma)
            agree_on_sides(frame, settings)
            start_track(worker, frame, settings)
            check_pair_calibration(worker, frame, settings)
            if not tree.tracked:
                start_from_one_view(worker, frame, settings, work, prior)


@kernel
def _update_worker(
    worker: WorkerHypotheses,
    measured: KeypointArrays,
    b: int,
    w: int,
    frame: Frame,
    settings: Settings,
    noise_model: NoiseModel,
    work: Work,
    prior: Records1[Tree],
) -> None:
    """Update the hypotheses about a tracked worker, and search for alternatives if a search is due.

    Args:
        worker: the worker's hypotheses, changed in place.
        measured: pixels, confidences and standard deviations of all workers.
        b: index of the environment.
        w: index of the worker.
        frame: measurements of the worker, filled in.
        settings: settings of the estimator.
        noise_model: constants for learning the measurement noise.
        work: work arrays.
        prior: (1,) work array for a hypothesis before its update.
    """
    if worker.trees[0].size_std > 0.0:
        read_worker(measured, b, w, settings.sigma_scale, frame)
        if start_track(worker, frame, settings):
            return
    is_due = worker.since_search_s[0] >= settings.hypothesis_search_period_s
    searches_now = len(worker.trees) > 1 and is_due
    if searches_now:
        read_worker(measured, b, w, settings.sigma_scale, frame)
        searches_now = is_ambiguous(worker.trees[0], frame, settings)
    for h in range(worker.n_alive[0]):
        tree, noise, has_rivals = worker.trees[h], worker.noise[h], worker.n_alive[0] > 1
        branches = searches_now and h == 0
        is_weighed = has_rivals or branches
        is_mirrored = read_for_hypothesis(
            tree, worker.views[h], noise, measured, b, w, settings, frame
        )
        if is_mirrored and acquire(tree, frame, settings):
            tree.slope[:] = 0.0
        evidence = condition_on_frame(tree, prior, is_weighed, frame, settings, work)
        if is_weighed:
            weigh_pose(tree, has_rivals, settings.evidence_exponent * evidence, settings)
        learn_from_frame(frame, tree, noise, noise_model, work)
        if branches:
            worker.since_search_s[0] = 0.0
            branch(worker, prior, evidence, frame, settings, work)
        recover(tree, frame, settings, work)
    if worker.n_alive[0] > 1:
        prune_and_merge(worker, settings, work)
    measure_pace(worker)
    check_pair_calibration(worker, frame, settings)


@kernel(makes_arrays=True)
def select_worker(state: Hypotheses, b: int, w: int) -> WorkerHypotheses:
    """Return views of the hypotheses about worker `w` in environment `b`."""
    return WorkerHypotheses(
        state.trees[b, w],
        state.views[b, w],
        state.noise[b, w],
        state.n_alive[b, w : w + 1],
        state.since_search_s[b, w : w + 1],
        state.pace[b][w : w + 1],
    )


@kernel(makes_arrays=True)
def predict_all(
    state: Hypotheses, model: MotionModel, dt: float, settings: Settings, works: Records1[Work]
) -> None:
    """Predict the hypotheses about all workers after a time step.

    Args:
        state: the hypotheses, changed in place.
        model: motion over the time step.
        dt: the time step [s].
        settings: settings of the estimator.
        works: (1,) work arrays.
    """
    for b in range(state.n_alive.shape[0]):
        for w in range(state.n_alive.shape[1]):
            worker = select_worker(state, b, w)
            if worker.trees[0].tracked:
                worker.since_search_s[0] += dt
                worker.pace[0].since_s += dt
                _move_worker(worker, model, dt, settings, works[0])
            _age_worker(worker, dt, settings)


@kernel(makes_arrays=True)
def _move_worker(
    worker: WorkerHypotheses, model: MotionModel, dt: float, settings: Settings, work: Work
) -> None:
    """Predict a worker's hypotheses; joint offsets are learnt only if there is a single hypothesis.

    Args:
        worker: the worker's hypotheses, changed in place.
        model: motion over the time step.
        dt: the time step [s].
        settings: settings of the estimator.
        work: work arrays.
    """
    has_rivals = worker.n_alive[0] > 1
    for h in range(worker.n_alive[0]):
        tree = worker.trees[h]
        if has_rivals:
            work.offset[:], work.offset_count[:] = tree.offset, tree.offset_count
        predict_tree(tree, model, dt, work)
        if has_rivals:
            tree.offset[:], tree.offset_count[:] = work.offset, work.offset_count
            tree.log_weight += settings.walking_log_odds_per_s * dt * _score_walk(tree.body)
    if has_rivals:
        normalise_weights(worker, settings.log_min_weight)


@kernel
def _age_worker(worker: WorkerHypotheses, dt: float, settings: Settings) -> None:
    """Increase ages by `dt` [s], end a track without support, and relax a lost one to the prior."""
    tree = worker.trees[0]
    tree.tracked = age_worker(
        tree.body[:, :3],
        tree.cov[:, :3, :3],
        tree.body[:, 3:],
        tree.age_s,
        tree.conflict,
        tree.tracked,
        dt,
        settings,
    )
    if not tree.tracked:  # a lost worker has one hypothesis
        worker.n_alive[0], tree.log_weight, tree.pose_log_prior = 1, 0.0, 0.0
    for h in range(1, worker.n_alive[0]):
        count_up(worker.trees[h].age_s, dt, settings.max_age_s)


@kernel
def _score_walk(body: Floats) -> float:
    """Return a score between -1 if a body (J, 6) walks backwards and 1 if it walks forwards."""
    heading = find_heading(body)
    if not heading.is_known:
        return 0.0
    speed = 0.0
    for j in _TORSO:
        speed += 0.25 * (heading.cos * body[j, 3] + heading.sin * body[j, 4])
    return min(max(speed / _WALKING_M_S, -1.0), 1.0)
