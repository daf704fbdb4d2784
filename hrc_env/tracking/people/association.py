"""Which detection belongs to whom: 2D poses of every camera to workers who are followed.

Poses that fit where a worker is predicted go to that worker, in each camera so that all together
fit best, and no pose to two workers. What is left is compared across cameras: poses of at least two
cameras that are one body go to a worker who was lost from sight nearby, else to a place that nobody
has; poses that no other camera confirms go to nobody: views that do not fit their worker look like
somebody new. Where there is no other camera, they go to vacant places while all who are followed
are seen.
"""

from collections import namedtuple
from dataclasses import dataclass, fields

import numpy as np

from hrc_env.core.errors import check_fields, check_shape
from hrc_env.core.kernels import kernel
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Floats, Ints
from hrc_env.geometry.assignment import assign_rows
from hrc_env.geometry.lines_of_sight import cameras_of
from hrc_env.tracking.measurements import arrays_of, is_measurement
from hrc_env.tracking.people.affinity import LEAST_JOINTS, POSE, affinity, expect
from hrc_env.tracking.people.new_people import (
    fit_cameras,
    look_along,
    meeting,
    propose,
)


@dataclass(frozen=True, slots=True)
class AssociationConfig:
    """When a 2D pose is believed to be of a worker."""

    gate_sigma: float = 5.0
    """A joint is near where it is expected within so many standard deviations; half of a
    pose's joints must be."""
    slack_m: float = 0.05
    """Standard deviation of what predictions do not know of [m]: detectors err for half a
    second in the same way, and people start and stop."""
    min_joints: int = 8
    """Two cameras must agree on so many joints (of 15) of somebody new."""
    apart_m: float = 0.35
    """Two people's bodies are never nearer than this [m]: nearer ones are one person."""
    rejoin_m: float = 1.0
    """Somebody new who appears so near [m] a worker whom no camera sees now is that worker."""
    image_area_px: float = 1920.0 * 1080.0
    """Area of an image [px^2]: the inverse is the density of poses that are nobody's."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "gate_sigma", "min_joints", "image_area_px")
        check_fields(self, "not be negative", "slack_m", "apart_m", "rejoin_m")


@dataclass(frozen=True, slots=True)
class Association:
    """Keypoints by worker, and where each of them came from."""

    keypoints: Keypoints
    """(B, C, W, J, ...): missing where a camera has no pose of a worker."""
    pose: Ints
    """(B, C, W) which of the camera's poses it is, -1 for none."""


_Settings = namedtuple("_Settings", [each.name for each in fields(AssociationConfig)])
"""`AssociationConfig` for the kernels, under the same names."""


def associate(
    P: Floats, found: Keypoints, predicted: PoseEstimate, config: AssociationConfig | None = None
) -> Association:
    """Sort poses by worker.

    Args:
        P: (C, 3, 4) projections.
        found: (B, C, D, J, ...) D poses a camera in any order; those that are not are NaN.
        predicted: (B, W, ...) where the workers should be, before these frames were taken in.

    Raises:
        ConfigError: arrays of other shapes. Never because of what they hold.
    """
    P = np.ascontiguousarray(P, np.float64)
    batch, n_workers = predicted.tracked.shape
    n_poses = found.px.shape[2] if found.px.ndim == 5 else -1
    measured = arrays_of(found, (batch, len(P), n_poses, N_JOINTS))
    check_shape("mean_world", predicted.mean_world.shape, (batch, n_workers, N_JOINTS, 3), "B, W")
    config = config or AssociationConfig()
    settings = _Settings(*(getattr(config, name) for name in _Settings._fields))
    shape = (batch, len(P), n_workers, N_JOINTS)
    pose = np.full(shape[:3], -1, np.int64)
    keypoints = Keypoints(
        np.full((*shape, 2), np.nan), np.zeros(shape), np.full(shape, np.inf), found.time_s
    )
    belief = (
        np.ascontiguousarray(predicted.mean_world, np.float64),
        np.ascontiguousarray(predicted.cov_world, np.float64),
        np.ascontiguousarray(predicted.tracked),
    )
    cameras, poses = cameras_of(P), np.empty((len(P), n_poses), POSE)
    sorted_into = (keypoints.px, keypoints.confidence, keypoints.sigma_px)
    _associate_all(cameras, poses, measured, belief, settings, pose, sorted_into)
    return Association(keypoints, pose)


@kernel(makes_arrays=True)
def _associate_all(cameras, poses, measured, belief, s, pose, sorted_into):
    """Sort what was measured into arrays by worker, and fill in which pose it was."""
    (found_px, found_confidence, found_sigma), (mean, cov, tracked) = measured, belief
    px, confidence, sigma_px = sorted_into
    for b in range(len(pose)):
        _read(found_px[b], found_confidence[b], found_sigma[b], poses)
        _follow(cameras, poses, (mean[b], cov[b], tracked[b]), s, pose[b])
        _assign_new_people(cameras, poses, mean[b], tracked[b], s, pose[b])
        for c in range(len(cameras)):
            for w in range(pose.shape[2]):
                d = pose[b, c, w]
                if d >= 0:
                    px[b, c, w] = found_px[b, c, d]
                    confidence[b, c, w] = found_confidence[b, c, d]
                    sigma_px[b, c, w] = found_sigma[b, c, d]


@kernel(makes_arrays=True)
def _read(px, confidence, sigma_px, poses):
    """Which joints are measurements, and which poses have enough of them to be somebody's."""
    for c in range(poses.shape[0]):
        for d in range(poses.shape[1]):
            pose, n = poses[c, d], 0
            pose.px[:], pose.sigma_px[:] = px[c, d], sigma_px[c, d]
            for j in range(N_JOINTS):
                u, v = px[c, d, j, 0], px[c, d, j, 1]
                pose.ok[j] = is_measurement(u, v, confidence[c, d, j], sigma_px[c, d, j])
                n += pose.ok[j]
            pose.free = n >= LEAST_JOINTS


@kernel(makes_arrays=True)
def _follow(cameras, poses, belief, s, chosen):
    """Give tracked workers the poses that fit their predictions best, camera by camera."""
    (mean, cov, tracked), n_poses = belief, poses.shape[1]
    n_workers = len(tracked)
    size = max(n_workers, n_poses)
    fit, column = np.empty((size, size)), np.empty(size, np.int64)
    image, known = np.empty((N_JOINTS, 3)), np.ones(N_JOINTS, np.bool_)
    for c in range(len(cameras)):
        fit[:] = 0.0
        for w in range(n_workers):
            if not tracked[w]:
                continue
            expect(cameras[c].P, mean[w], cov[w], known, s.slack_m, image)
            for d in range(n_poses):
                if poses[c, d].free:
                    fit[w, d] = -affinity(image, poses[c, d], s)
        assign_rows(fit, column)
        for w in range(n_workers):
            if fit[w, column[w]] < 0.0:  # 0: no pose fits, or it fits another better
                chosen[c, w] = column[w]
                poses[c, column[w]].free = False


@kernel(makes_arrays=True)
def _assign_new_people(cameras, poses, mean, tracked, s, chosen):
    """Give poses that several cameras have of one body to whom it can be."""
    (n_cameras, n_poses), n_workers = poses.shape, len(tracked)
    vacant, unseen = np.empty(n_workers, np.bool_), np.empty(n_workers, np.bool_)
    wanted = False
    for w in range(n_workers):
        n_views = 0
        for c in range(n_cameras):
            n_views += chosen[c, w] >= 0
        vacant[w], unseen[w] = not tracked[w], tracked[w] and n_views == 0
        wanted |= vacant[w] or n_views < min(2, n_cameras)
    if n_cameras == 1 and not unseen.any():
        for w in np.flatnonzero(vacant):
            for d in range(n_poses):
                if chosen[0, w] < 0 and poses[0, d].free:
                    chosen[0, w], poses[0, d].free = d, False
    if n_cameras == 1 or not wanted:
        return
    most = n_cameras * (n_cameras - 1) // 2 * n_poses * n_poses
    seeds = np.empty((most, 4), np.int64)
    proposals = (seeds, np.empty((most, n_cameras), np.int64), np.empty((most, n_cameras)))
    look_along(cameras, poses)
    n = propose(cameras, poses, s, proposals)
    mean, tracked = mean.copy(), tracked.copy()  # newcomers are followed from here on
    member, score = np.empty(n_cameras, np.int64), np.empty(n_cameras)
    while True:
        best = _best(proposals, poses, n)
        if best < 0:
            return
        c1, d1, c2, d2 = seeds[best]
        body = np.empty((N_JOINTS, 3)), np.empty(N_JOINTS, np.bool_)
        meeting(cameras[c1], cameras[c2], poses[c1, d1], poses[c2, d2], s.gate_sigma, body)
        fit_cameras(cameras, poses, body, s, member, score)
        w = _whose(body, mean, tracked, vacant, unseen, s)
        for c in range(n_cameras):
            if member[c] < 0:
                continue
            poses[c, member[c]].free = False
            if w >= 0 and chosen[c, w] < 0:
                chosen[c, w] = member[c]
        if w >= 0:
            if vacant[w]:
                _place(body, mean[w])
            tracked[w], vacant[w], unseen[w] = True, False, False


@kernel(makes_arrays=True)
def _best(proposals, poses, n):
    """The proposal that the cameras fit best with poses that are still free, or -1."""
    (seeds, members, scores), best, best_total = proposals, -1, 0.0
    for k in range(n):
        if not (poses[seeds[k, 0], seeds[k, 1]].free and poses[seeds[k, 2], seeds[k, 3]].free):
            continue
        total, n_views = 0.0, 0
        for c in range(poses.shape[0]):
            if members[k, c] >= 0 and poses[c, members[k, c]].free:
                total += scores[k, c]
                n_views += 1
        if n_views >= 2 and total > best_total:
            best, best_total = k, total
    return best


@kernel(makes_arrays=True)
def _whose(body, mean, tracked, vacant, unseen, s):
    """The worker that a body is, or -1: one who is followed there, is missed near, or is nobody.

    Of vacant places the one whose last belief is nearest: who comes back is known again.
    """
    distance = np.empty(len(tracked))
    for w in range(len(tracked)):
        distance[w] = _apart(body, mean[w])
    near = _nearest(distance, tracked, s.apart_m)
    if near < 0:
        near = _nearest(distance, unseen, s.rejoin_m)
    return near if near >= 0 else _nearest(distance, vacant, np.inf)


@kernel(makes_arrays=True)
def _nearest(distance, among, limit):
    best = -1
    for w in range(len(distance)):
        if among[w] and distance[w] < limit:
            best, limit = w, distance[w]
    return best


@kernel(makes_arrays=True)
def _place(body, mean):
    points, met = body
    mean[:] = np.nan
    for j in range(len(met)):
        if met[j]:
            for i in range(3):
                mean[j, i] = points[j, i]


@kernel(makes_arrays=True)
def _apart(body, mean):
    """Distance [m] between a body and a worker, on average over joints known of both."""
    points, met = body
    n, dx, dy, dz = 0, 0.0, 0.0, 0.0
    for j in range(len(met)):
        if met[j] and np.isfinite(mean[j, 0]):
            n += 1
            dx += points[j, 0] - mean[j, 0]
            dy += points[j, 1] - mean[j, 1]
            dz += points[j, 2] - mean[j, 2]
    return np.sqrt(dx * dx + dy * dy + dz * dz) / n if n else np.inf
