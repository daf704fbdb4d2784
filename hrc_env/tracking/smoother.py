"""What could have been known: a whole clip, smoothed after the fact.

The filter on the kinematic tree goes through the clip with one hypothesis; then a
Rauch-Tung-Striebel pass (AIAA Journal 3, 1965) goes back over its linear motion, on all 90 numbers
of a body at once. With P the covariance of the belief at t, F and Q the motion to t + 1, x- and
P- = F P F' + Q the prediction:

    G = P F' (P-)^-1,   x_s = x + G (x_s' - x-),   P_s = P + G (P_s' - P-) G'.

Nothing is carried back across the beginning of a track. As no such pass turns a body round that one
camera has mirrored in depth, the clip is also read backwards: the answer is the mixture of both,
each with the certainty its filter had there.

Needing the future, this is no estimator of an environment; it is offline, and in plain numpy.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from hrc_env.core.batching import mapped
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS, TORSO
from hrc_env.core.typing import Bools, Floats
from hrc_env.tracking.config import ParticleConfig, TrackerConfig, of_kind
from hrc_env.tracking.particle import ParticleEstimator
from hrc_env.tracking.tracks import bounded
from hrc_env.tracking.tree.gaussian import ORDER, PARENT
from hrc_env.tracking.tree.predict import make_motion_model

_N = 6 * N_JOINTS
Moments: TypeAlias = tuple[Floats, Floats]
"""Means and covariances."""


class _Passed(NamedTuple):
    """What the filter believed in a frame of n = B W workers."""

    predicted: Floats
    """(n, 90) means before the frame."""
    trees: Any
    """(n,) records of `tree.state.TREE` after it."""
    follows: Bools
    """(n,) whether the track is the last frame's."""


class _Smoothed(NamedTuple):
    """One direction's answer: T frames, n workers, in the clip's order."""

    mean: Floats
    """(T, n, J, 6)."""
    cov: Floats
    """(T, n, J, 3, 3) of the positions."""
    doubt: Floats
    """(T, n) mean variance that its filter had [m^2]."""
    age_s: Floats
    """(T, n, J)."""
    tracked: Bools
    """(T, n)."""


def smooth(
    P: Floats, clip: Sequence[Keypoints], dt_s: float, config: TrackerConfig | None = None
) -> PoseEstimate:
    """Return the best belief of every frame, in view of the whole clip.

    Args:
        P: (C, 3, 4) projections.
        clip: keypoints of T frames, each (B, C, W, J, ...), in order of time; their `time_s` is
            not looked at.
        dt_s: time between two frames [s].
        config: settings of the estimator "kalman"; None: the defaults.

    Returns:
        Arrays (T, B, W, ...). A worker whom the filter followed in neither direction is where
        the forward one reported; `age_s` is the time to the nearest measurement of the joint.

    Raises:
        ConfigError: no frames, or a time between them that is not positive.
    """
    if len(clip) == 0 or not dt_s > 0:
        raise ConfigError(f"a clip needs frames and a positive dt_s, got {len(clip)}, {dt_s}.")
    config = replace(of_kind(config, ParticleConfig), n_hypotheses=1)
    estimator = ParticleEstimator(np.ascontiguousarray(P, float), dt_s, config)
    forth = _one_way(estimator, clip, dt_s)
    back = _turned(_one_way(estimator, clip[::-1], dt_s))
    batch, _, n_workers = clip[0].px.shape[:3]
    return _reported(_mixture(forth, back), (len(clip), batch, n_workers), config)


def rts_step(belief: Moments, predicted: Floats, later: Moments, F: Floats, Q: Floats) -> Moments:
    """One step back, for n Gaussians of d numbers: mean and covariance, smoothed.

    Args:
        belief: mean (n, d) and covariance (n, d, d) as filtered.
        predicted: (n, d) mean of the next frame as predicted from it.
        later: the next frame, smoothed.
        F, Q: (d, d) motion from one to the other, and its noise.
    """
    (mean, cov), (mean_later, cov_later) = belief, later
    moved = F @ cov
    cov_predicted = moved @ F.T + Q
    gain = np.linalg.solve(cov_predicted, moved).swapaxes(-1, -2)
    mean = mean + np.einsum("nij,nj->ni", gain, mean_later - predicted)
    cov = cov + gain @ (cov_later - cov_predicted) @ gain.swapaxes(-1, -2)
    return mean, 0.5 * (cov + cov.swapaxes(-1, -2))


def linear_motion(dt_s: float, config: ParticleConfig) -> tuple[Floats, Floats]:
    """F, Q (90, 90): x' = F x + constant + noise, as `tree.predict` moves the body."""
    own, travel, noise, shared = make_motion_model(dt_s, config.damping, config.root_acceleration)
    F = np.zeros((N_JOINTS, 2, N_JOINTS, 2))
    Q = np.tile(shared[None, :, None, :], (N_JOINTS, 1, N_JOINTS, 1))
    for j in range(N_JOINTS):
        F[j, :, j] += own[j]
        Q[j, :, j] = noise[j]
        for k in TORSO:
            F[j, :, int(k)] += travel[j] / len(TORSO)
    return _on_axes(F), _on_axes(Q)


def dense(cov: Floats, slope: Floats) -> Floats:
    """(n, 90, 90) covariance of all joints from marginals and slopes (n, J, 6, 6)."""
    out = np.zeros((len(cov), N_JOINTS, 6, N_JOINTS, 6))
    for m, j in enumerate(ORDER):
        for k in ORDER[:m]:
            edge = slope[:, j] @ out[:, PARENT[j], :, k]
            out[:, j, :, k], out[:, k, :, j] = edge, edge.swapaxes(1, 2)
        out[:, j, :, j] = cov[:, j]
    return out.reshape(-1, _N, _N)


def _on_axes(blocks: Floats) -> Floats:
    """(90, 90) of (J, 2, J, 2) on position and velocity, alike on each axis."""
    full = np.einsum("jakb,cd->jackbd", blocks, np.eye(3))
    return full.reshape(_N, _N)


def _one_way(estimator: ParticleEstimator, clip: Sequence[Keypoints], dt_s: float) -> _Smoothed:
    """Filter through a clip, smooth back."""
    passed = _filtered(estimator, clip, dt_s)
    F, Q = linear_motion(dt_s, estimator.config)
    mean, cov = _moments(passed[-1].trees)
    means, covs = [mean], [_own(cov)]
    for here, later in zip(passed[-2::-1], passed[:0:-1], strict=True):
        on = later.follows
        x, spread = _moments(here.trees)
        now, then = (x[on], spread[on]), (mean[on], cov[on])
        x[on], spread[on] = rts_step(now, later.predicted[on], then, F, Q)
        mean, cov = x, spread
        means.append(mean)
        covs.append(_own(cov))
    trees = np.stack([each.trees for each in passed])
    return _Smoothed(
        mean=np.stack(means[::-1]).reshape(len(passed), -1, N_JOINTS, 6),
        cov=np.stack(covs[::-1]) + trees["displaced_m2"][:, :, None],
        doubt=np.trace(trees["cov"][..., :3, :3], axis1=-2, axis2=-1).mean(-1),
        age_s=trees["age_s"],
        tracked=trees["tracked"],
    )


def _filtered(
    estimator: ParticleEstimator, clip: Sequence[Keypoints], dt_s: float
) -> list[_Passed]:
    """What the filter believed in every frame."""
    batch, _, n_workers = clip[0].px.shape[:3]
    state, passed = estimator.init(batch, n_workers), []
    for keypoints in clip:
        estimator.predict(state, dt_s, [])
        before = state.trees.flatten()
        estimator.update(state, keypoints, [])
        trees = state.trees.flatten()
        began = ~trees["body"][..., 3:].any((-2, -1))  # at rest: in the first frame, and only then
        follows = before["tracked"] & trees["tracked"] & ~began
        passed.append(_Passed(before["body"].reshape(-1, _N), trees, follows))
    return passed


def _moments(trees: Any) -> Moments:
    """Mean (n, 90) and covariance (n, 90, 90) of trees (n,)."""
    return trees["body"].reshape(-1, _N).copy(), dense(trees["cov"], trees["slope"])


def _own(cov: Floats) -> Floats:
    """(n, J, 3, 3) of the positions from (n, 90, 90)."""
    joint = np.arange(N_JOINTS)
    blocks = cov.reshape(-1, N_JOINTS, 6, N_JOINTS, 6)
    return np.moveaxis(blocks[:, joint, :3, joint, :3], 0, 1)


def _turned(there: _Smoothed) -> _Smoothed:
    """The answer for a clip that was read backwards, in the clip's order."""
    mean = there.mean[::-1].copy()
    mean[..., 3:] *= -1.0
    rest = (there.cov[::-1], there.doubt[::-1], there.age_s[::-1])
    return _Smoothed(mean, *rest, there.tracked[::-1])


def _mixture(a: _Smoothed, b: _Smoothed) -> _Smoothed:
    """Mean and covariance of the two answers, each weighted by how sure its filter was."""
    share = b.doubt / (a.doubt + b.doubt)
    share = np.where(a.tracked == b.tracked, share, a.tracked)
    share = np.where(a.tracked | b.tracked, share, 1.0)[..., None, None]
    apart = (a.mean - b.mean)[..., :3]
    between = apart[..., :, None] * apart[..., None, :]
    one, other = share[..., None], 1.0 - share[..., None]
    return a._replace(
        mean=share * a.mean + (1.0 - share) * b.mean,
        cov=one * a.cov + other * b.cov + one * other * between,
        age_s=np.minimum(a.age_s, b.age_s),
        tracked=a.tracked | b.tracked,
    )


def _reported(
    smoothed: _Smoothed, shape: tuple[int, int, int], config: ParticleConfig
) -> PoseEstimate:
    """Arrays (T, B, W, ...) as estimators report theirs."""
    n_frames, batch, n_workers = shape
    tracked = smoothed.tracked.reshape(-1, n_workers)
    joints = (*tracked.shape, N_JOINTS)
    estimate = PoseEstimate(
        mean_world=smoothed.mean[..., :3].reshape(*joints, 3),
        cov_world=smoothed.cov.reshape(*joints, 3, 3),
        velocity_world=smoothed.mean[..., 3:].reshape(*joints, 3),
        age_s=smoothed.age_s.reshape(joints),
        tracked=tracked,
    )
    return mapped(bounded(estimate, config), lambda a: a.reshape(n_frames, batch, *a.shape[1:]))
