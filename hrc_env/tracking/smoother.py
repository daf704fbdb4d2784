"""Offline smoothing of a whole clip, as an upper bound on the accuracy of estimators.

The filter on the kinematic tree runs through the clip with one hypothesis. A Rauch-Tung-Striebel
pass (AIAA Journal 3, 1965) then runs backwards with the linear motion model, on all 90 coordinates
of a body at once. With the filter's mean x and covariance P at time t, the motion F and Q to t + 1,
and the prediction x- and P- = F P F' + Q:

    G = P F' (P-)^-1,   x_s = x + G (x_s' - x-),   P_s = P + G (P_s' - P-) G'.

Nothing is propagated back across the start of a track. A backward pass cannot correct a body that
was tracked mirrored in depth from one view. Therefore the clip is also processed in reverse, and
the result is the mixture of both directions, weighted by the certainty of their filters.

The smoother needs future frames and therefore cannot be the estimator of an environment. It is
implemented in plain NumPy.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hrc_env.core.batching import map_arrays
from hrc_env.core.errors import ConfigError
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS, TORSO
from hrc_env.core.typing import Bools, Floats
from hrc_env.tracking.config import ParticleConfig, TrackerConfig, cast_config
from hrc_env.tracking.particle import ParticleEstimator
from hrc_env.tracking.tracks import bound_estimate
from hrc_env.tracking.tree.gaussian import ORDER, PARENT
from hrc_env.tracking.tree.predict import make_motion_model

_N = 6 * N_JOINTS
"""Number of coordinates of a body: positions and velocities of all joints."""


class Moments(NamedTuple):
    """The means and covariances of n Gaussians in d dimensions."""

    mean: Floats
    """(n, d) means of the Gaussians."""
    cov: Floats
    """(n, d, d) covariances of the Gaussians."""


class LinearMotion(NamedTuple):
    """The motion of a body over one step: x' = F x + constant + noise with covariance Q."""

    F: Floats
    """(90, 90) transition matrix."""
    Q: Floats
    """(90, 90) covariance of the noise."""


class _FilteredFrame(NamedTuple):
    """The state of the filter at one frame, for n = B W workers."""

    predicted: Floats
    """(n, 90) predicted means, before the update with the frame."""
    mean: Floats
    """(n, 90) means after the update with the frame."""
    cov: Floats
    """(n, J, 6, 6) marginal covariances of the joints after the update."""
    slope: Floats
    """(n, J, 6, 6) slopes of the joints on their parents after the update; see `tree.gaussian`."""
    displaced_m2: Floats
    """(n, 3, 3) covariance of the displacement of the whole body [m^2]."""
    age_s: Floats
    """(n, J) ages of the joints [s]."""
    tracked: Bools
    """(n,) mask of the tracked workers."""
    follows: Bools
    """(n,) mask of the workers with a track that continues from the previous frame."""


class _Smoothed(NamedTuple):
    """The result of one direction for T frames and n workers, in the order of the clip."""

    mean: Floats
    """(T, n, J, 6) positions [m] and velocities [m/s]."""
    cov: Floats
    """(T, n, J, 3, 3) covariances of the positions [m^2]."""
    doubt: Floats
    """(T, n) mean variance of the filter's positions [m^2]."""
    age_s: Floats
    """(T, n, J) ages of the joints [s]."""
    tracked: Bools
    """(T, n) mask of the tracked workers."""


def smooth(
    P: Floats, clip: Sequence[Keypoints], dt_s: float, config: TrackerConfig | None = None
) -> PoseEstimate:
    """Return the estimate for every frame, given the whole clip.

    Args:
        P: (C, 3, 4) projections from the world [m] to pixels.
        clip: keypoints of T frames, each (B, C, W, J, ...), in chronological order; their `time_s`
            is ignored.
        dt_s: time between two frames [s].
        config: settings of the estimator "kalman"; None for the defaults.

    Returns:
        Arrays (T, B, W, ...). A worker that is tracked in neither direction has the position
        reported by the forward filter; `age_s` is the time to the nearest measurement of the joint
        [s].

    Raises:
        ConfigError: there are no frames, or the time between them is not positive.
    """
    if len(clip) == 0 or not dt_s > 0:
        raise ConfigError(
            f"a clip must have frames, and dt_s must be positive, got {len(clip)}, {dt_s}."
        )
    config = replace(cast_config(config, ParticleConfig), n_hypotheses=1)
    estimator = ParticleEstimator(np.ascontiguousarray(P, float), dt_s, config)
    forth = _smooth_one_way(estimator, clip, dt_s)
    back = _reverse(_smooth_one_way(estimator, clip[::-1], dt_s))
    batch, _, n_workers = clip[0].px.shape[:3]
    return _make_estimate(_mix(forth, back), batch, n_workers, config)


def rts_step(filtered: Moments, predicted: Floats, later: Moments, F: Floats, Q: Floats) -> Moments:
    """Return the smoothed moments of a frame, given those of the next frame.

    Args:
        filtered: moments of the filter at the frame.
        predicted: (n, d) means of the next frame, predicted from the filtered ones.
        later: smoothed moments of the next frame.
        F: (d, d) transition matrix from the frame to the next one.
        Q: (d, d) covariance of the process noise.
    """
    moved = F @ filtered.cov
    cov_predicted = moved @ F.T + Q
    gain = np.linalg.solve(cov_predicted, moved).swapaxes(-1, -2)
    mean = filtered.mean + np.einsum("nij,nj->ni", gain, later.mean - predicted)
    cov = filtered.cov + gain @ (later.cov - cov_predicted) @ gain.swapaxes(-1, -2)
    return Moments(mean, 0.5 * (cov + cov.swapaxes(-1, -2)))


def make_linear_motion(dt_s: float, config: ParticleConfig) -> LinearMotion:
    """Return the motion of a body over `dt_s` [s] in the model of `tree.predict`."""
    own, travel, noise, shared = make_motion_model(dt_s, config.damping, config.root_acceleration)
    F = np.zeros((N_JOINTS, 2, N_JOINTS, 2))
    Q = np.tile(shared[None, :, None, :], (N_JOINTS, 1, N_JOINTS, 1))
    for j in range(N_JOINTS):
        F[j, :, j] += own[j]
        Q[j, :, j] = noise[j]
        for k in TORSO:
            F[j, :, int(k)] += travel[j] / len(TORSO)
    return LinearMotion(_expand_axes(F), _expand_axes(Q))


def expand_covariance(cov: Floats, slope: Floats) -> Floats:
    """Return the joint covariance (n, 90, 90) of all joints.

    Args:
        cov: (n, J, 6, 6) marginal covariances of the joints.
        slope: (n, J, 6, 6) slopes of the joints on their parents.
    """
    out = np.zeros((len(cov), N_JOINTS, 6, N_JOINTS, 6))
    for m, j in enumerate(ORDER):
        for k in ORDER[:m]:
            edge = slope[:, j] @ out[:, PARENT[j], :, k]
            out[:, j, :, k], out[:, k, :, j] = edge, edge.swapaxes(1, 2)
        out[:, j, :, j] = cov[:, j]
    return out.reshape(-1, _N, _N)


def _expand_axes(blocks: Floats) -> Floats:
    """Expand blocks (J, 2, J, 2) of position and velocity, equal on all axes, to (90, 90)."""
    full = np.einsum("jakb,cd->jackbd", blocks, np.eye(3))
    return full.reshape(_N, _N)


def _smooth_one_way(
    estimator: ParticleEstimator, clip: Sequence[Keypoints], dt_s: float
) -> _Smoothed:
    """Filter a clip with frames every `dt_s` [s] forwards, then smooth it backwards."""
    frames = _filter_clip(estimator, clip, dt_s)
    F, Q = make_linear_motion(dt_s, estimator.config)
    mean, cov = _get_moments(frames[-1])
    means, covs = [mean], [_get_position_blocks(cov)]
    for frame, later in zip(frames[-2::-1], frames[:0:-1], strict=True):
        on = later.follows
        x, spread = _get_moments(frame)
        filtered, smoothed = Moments(x[on], spread[on]), Moments(mean[on], cov[on])
        x[on], spread[on] = rts_step(filtered, later.predicted[on], smoothed, F, Q)
        mean, cov = x, spread
        means.append(mean)
        covs.append(_get_position_blocks(cov))
    marginals = np.stack([frame.cov for frame in frames])
    return _Smoothed(
        mean=np.stack(means[::-1]).reshape(len(frames), -1, N_JOINTS, 6),
        cov=np.stack(covs[::-1]) + np.stack([frame.displaced_m2 for frame in frames])[:, :, None],
        doubt=np.trace(marginals[..., :3, :3], axis1=-2, axis2=-1).mean(-1),
        age_s=np.stack([frame.age_s for frame in frames]),
        tracked=np.stack([frame.tracked for frame in frames]),
    )


def _filter_clip(
    estimator: ParticleEstimator, clip: Sequence[Keypoints], dt_s: float
) -> list[_FilteredFrame]:
    """Return the state of the filter at every frame of a clip with frames every `dt_s` [s]."""
    batch, _, n_workers = clip[0].px.shape[:3]
    state, frames = estimator.init(batch, n_workers), list[_FilteredFrame]()

    def copy_field(name: str) -> NDArray[Any]:
        array = state.trees[name]
        return array.copy().reshape(batch * n_workers, *array.shape[3:])

    for keypoints in clip:
        estimator.predict(state, dt_s, [])
        predicted, was_tracked = copy_field("body"), copy_field("tracked")
        estimator.update(state, keypoints, [])
        body, tracked = copy_field("body"), copy_field("tracked")
        begins = ~body[..., 3:].any((-2, -1))  # only a new track is at rest
        frame = _FilteredFrame(
            predicted=predicted.reshape(-1, _N),
            mean=body.reshape(-1, _N),
            cov=copy_field("cov"),
            slope=copy_field("slope"),
            displaced_m2=copy_field("displaced_m2"),
            age_s=copy_field("age_s"),
            tracked=tracked,
            follows=was_tracked & tracked & ~begins,
        )
        frames.append(frame)
    return frames


def _get_moments(frame: _FilteredFrame) -> Moments:
    """Return the moments of all 90 coordinates of the bodies after the update with a frame."""
    return Moments(frame.mean.copy(), expand_covariance(frame.cov, frame.slope))


def _get_position_blocks(cov: Floats) -> Floats:
    """Return the position covariances (n, J, 3, 3) in the covariances (n, 90, 90) of bodies."""
    joint = np.arange(N_JOINTS)
    blocks = cov.reshape(-1, N_JOINTS, 6, N_JOINTS, 6)
    return np.moveaxis(blocks[:, joint, :3, joint, :3], 0, 1)


def _reverse(backward: _Smoothed) -> _Smoothed:
    """Return the result for a reversed clip in the order of the original clip."""
    mean = backward.mean[::-1].copy()
    mean[..., 3:] *= -1.0
    rest = (backward.cov[::-1], backward.doubt[::-1], backward.age_s[::-1])
    return _Smoothed(mean, *rest, backward.tracked[::-1])


def _mix(a: _Smoothed, b: _Smoothed) -> _Smoothed:
    """Return the moments of the mixture of two results, weighted by their filters' certainty."""
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


def _make_estimate(
    smoothed: _Smoothed, batch: int, n_workers: int, config: ParticleConfig
) -> PoseEstimate:
    """Return the estimate (T, B, W, ...) of a clip.

    Args:
        smoothed: the result for n = B W workers.
        batch: number of environments B.
        n_workers: number of workers W.
        config: settings that contain the bounds of the covariances.
    """
    n_frames = len(smoothed.tracked)
    tracked = smoothed.tracked.reshape(n_frames * batch, n_workers)
    joints = (*tracked.shape, N_JOINTS)
    estimate = PoseEstimate(
        mean_world=smoothed.mean[..., :3].reshape(*joints, 3),
        cov_world=smoothed.cov.reshape(*joints, 3, 3),
        velocity_world=smoothed.mean[..., 3:].reshape(*joints, 3),
        age_s=smoothed.age_s.reshape(joints),
        tracked=tracked,
    )
    return map_arrays(
        bound_estimate(estimate, config), lambda a: a.reshape(n_frames, batch, *a.shape[1:])
    )
