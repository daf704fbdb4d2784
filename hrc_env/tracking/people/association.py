"""Association of the 2D poses detected in every camera with workers.

In each camera, poses that fit the prediction of a tracked worker are assigned to that worker, with
the best total fit and each pose at most once. The remaining poses are compared across cameras. If
poses in at least two cameras belong to one body, they are assigned to a tracked worker at that
position, or to a nearby tracked worker that no camera sees, or else to a slot without a track.
Poses that no other camera confirms are not assigned, because an erroneous view of a tracked worker
resembles a new person. If the rig has a single camera, the remaining poses are assigned to slots
without a track as long as the camera sees all tracked workers.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hrc_env.core.declared import Records1, Records2, make_records
from hrc_env.core.errors import check_fields, check_shape
from hrc_env.core.kernels import kernel
from hrc_env.core.mapping import answer_unknown_fields
from hrc_env.core.records import Keypoints, PoseEstimate
from hrc_env.core.skeleton import N_JOINTS
from hrc_env.core.typing import Bools, Covariances3, Floats, Ints, Points2, Points3
from hrc_env.geometry.assignment import assign_rows
from hrc_env.geometry.lines_of_sight import Camera, cameras_of
from hrc_env.tracking.measurements import KeypointArrays, get_keypoint_arrays, is_measurement
from hrc_env.tracking.people.affinity import (
    LEAST_JOINTS,
    AssociationSettings,
    Pose,
    compute_affinity,
    project_body,
)
from hrc_env.tracking.people.new_people import (
    Body,
    Proposals,
    fill_sight_lines,
    fit_cameras,
    intersect_poses,
    make_body,
    make_proposals,
    propose_bodies,
)
from hrc_env.tracking.tracks import EstimateArrays, get_estimate_arrays


@answer_unknown_fields
@dataclass(frozen=True, slots=True)
class AssociationConfig:
    """Settings for the assignment of 2D poses to workers.

    Raises:
        ConfigError: a value is out of its range; the error names the field and the range.
    """

    RENAMED: ClassVar[Mapping[str, str]] = {
        "slack_m": "prediction_std_m",
        "apart_m": "merge_distance_m",
        "rejoin_m": "rejoin_distance_m",
    }
    """Current names of renamed fields, by their former names."""

    gate_sigma: float = 5.0
    """Gate around the predicted pixel of a joint, in standard deviations. At least half of a pose's
    joints must be within their gates."""
    prediction_std_m: float = 0.05
    """Standard deviation of errors that predictions do not account for [m], such as persistent
    errors of the detector and sudden movements."""
    min_joints: int = 8
    """Number of joints, out of 15, on which two cameras must agree to detect a new person."""
    merge_distance_m: float = 0.35
    """Distance between two bodies below which they are considered one person [m]."""
    rejoin_distance_m: float = 1.0
    """Distance within which a new body is assigned to a tracked worker that no camera sees [m]."""
    image_area_px: float = 1920.0 * 1080.0
    """Area of an image [px^2]. Its inverse is the probability density of joints that belong to no
    worker."""

    def __post_init__(self) -> None:
        check_fields(self, "be positive", "gate_sigma", "min_joints", "image_area_px")
        check_fields(
            self, "not be negative", "prediction_std_m", "merge_distance_m", "rejoin_distance_m"
        )


@dataclass(frozen=True, slots=True)
class Association:
    """Keypoints assigned to workers, and the indices of the assigned poses."""

    keypoints: Keypoints
    """(B, C, W, J, ...) keypoints; missing where a camera has no pose of a worker."""
    pose: Ints
    """(B, C, W) index of the camera's pose that was assigned to the worker; -1 if there is none."""


def associate(
    P: Floats, detected: Keypoints, predicted: PoseEstimate, config: AssociationConfig | None = None
) -> Association:
    """Assign poses to workers.

    Args:
        P: (C, 3, 4) projections from the world [m] to pixels.
        detected: (B, C, D, J, ...) D poses per camera in any order; missing poses are NaN.
        predicted: (B, W, ...) prediction of the workers for the time of these frames.
        config: settings of the assignment; None for the defaults.

    Raises:
        ConfigError: an array has another shape. The values of the arrays are not checked.
    """
    cameras = cameras_of(P)
    batch, n_workers = predicted.tracked.shape
    n_poses = detected.px.shape[2] if detected.px.ndim == 5 else -1
    detections = get_keypoint_arrays(detected, (batch, len(cameras), n_poses, N_JOINTS))
    check_shape("mean_world", predicted.mean_world.shape, (batch, n_workers, N_JOINTS, 3), "B, W")
    config = config or AssociationConfig()
    settings = AssociationSettings(*(getattr(config, name) for name in AssociationSettings._fields))
    shape = (batch, len(cameras), n_workers, N_JOINTS)
    pose = np.full(shape[:3], -1, np.int64)
    out = KeypointArrays(np.full((*shape, 2), np.nan), np.zeros(shape), np.full(shape, np.inf))
    poses, estimate = make_records(Pose, (len(cameras), n_poses)), get_estimate_arrays(predicted)
    _associate_all(cameras, poses, detections, estimate, settings, pose, out)
    return Association(Keypoints(*out, time_s=detected.time_s), pose)


@kernel(makes_arrays=True)
def _associate_all(
    cameras: Records1[Camera],
    poses: Records2[Pose],
    detected: KeypointArrays,
    predicted: EstimateArrays,
    settings: AssociationSettings,
    pose: Ints,
    out: KeypointArrays,
) -> None:
    """Assign the poses of every environment.

    Args:
        cameras: (C,) cameras.
        poses: (C, D) work array for the poses of one environment.
        detected: (B, C, D, J, ...) detections.
        predicted: (B, W, ...) prediction of the workers.
        settings: settings of the assignment.
        pose: (B, C, W) indices of the assigned poses, initially -1, filled in.
        out: (B, C, W, J, ...) detections of the assigned poses, filled in.
    """
    for b in range(len(pose)):
        mean, cov, tracked = predicted.mean_world[b], predicted.cov_world[b], predicted.tracked[b]
        _read_poses(detected.px[b], detected.confidence[b], detected.sigma_px[b], poses)
        _assign_to_tracked(cameras, poses, mean, cov, tracked, settings, pose[b])
        _assign_new_people(cameras, poses, mean, tracked, settings, pose[b])
        for c in range(len(cameras)):
            for w in range(pose.shape[2]):
                d: int = pose[b, c, w]
                if d >= 0:
                    out.px[b, c, w] = detected.px[b, c, d]
                    out.confidence[b, c, w] = detected.confidence[b, c, d]
                    out.sigma_px[b, c, w] = detected.sigma_px[b, c, d]


@kernel(makes_arrays=True)
def _read_poses(px: Points2, confidence: Floats, sigma_px: Floats, poses: Records2[Pose]) -> None:
    """Fill in the poses (C, D) of one environment; poses with too few joints are not assignable.

    Args:
        px: (C, D, J, 2) pixels.
        confidence: (C, D, J) confidences.
        sigma_px: (C, D, J) standard deviations [px].
        poses: (C, D) poses, filled in except for their lines of sight.
    """
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
def _assign_to_tracked(
    cameras: Records1[Camera],
    poses: Records2[Pose],
    mean: Points3,
    cov: Covariances3,
    tracked: Bools,
    settings: AssociationSettings,
    chosen: Ints,
) -> None:
    """Assign to tracked workers the poses that fit their predictions best, camera by camera.

    Args:
        cameras: (C,) cameras.
        poses: (C, D) poses in each camera; assigned poses are marked as not free.
        mean: (W, J, 3) predicted joints [m].
        cov: (W, J, 3, 3) covariances of the joints [m^2].
        tracked: (W,) mask of the tracked workers.
        settings: settings of the assignment.
        chosen: (C, W) index of the assigned pose, filled in.
    """
    n_workers, n_poses = len(tracked), poses.shape[1]
    size = max(n_workers, n_poses)
    fit, column = np.empty((size, size)), np.empty(size, np.int64)
    image, known = np.empty((N_JOINTS, 3)), np.ones(N_JOINTS, np.bool_)
    for c in range(len(cameras)):
        fit[:] = 0.0
        for w in range(n_workers):
            if not tracked[w]:
                continue
            project_body(cameras[c].P, mean[w], cov[w], known, settings.prediction_std_m, image)
            for d in range(n_poses):
                if poses[c, d].free:
                    fit[w, d] = -compute_affinity(image, poses[c, d], settings)
        assign_rows(fit, column)
        for w in range(n_workers):
            d: int = column[w]
            if fit[w, d] < 0.0:  # 0 if no pose fits or another worker fits better
                chosen[c, w] = d
                poses[c, d].free = False


@kernel(makes_arrays=True)
def _assign_new_people(
    cameras: Records1[Camera],
    poses: Records2[Pose],
    mean: Points3,
    tracked: Bools,
    settings: AssociationSettings,
    chosen: Ints,
) -> None:
    """Assign the poses of each body that several cameras see to a worker.

    Args:
        cameras: (C,) cameras.
        poses: (C, D) poses in each camera; assigned poses are marked as not free.
        mean: (W, J, 3) predicted joints [m].
        tracked: (W,) mask of the tracked workers.
        settings: settings of the assignment.
        chosen: (C, W) index of the assigned pose, filled in.
    """
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
    proposals, body = make_proposals(n_cameras, n_poses), make_body()
    fill_sight_lines(cameras, poses)
    n = propose_bodies(cameras, poses, settings, proposals)
    mean, tracked = mean.copy(), tracked.copy()  # new people are tracked from here on
    member, score = np.empty(n_cameras, np.int64), np.empty(n_cameras)
    while True:
        best = _find_best(proposals, poses, n)
        if best < 0:
            return
        c1: int = proposals.seeds[best, 0]
        c2: int = proposals.seeds[best, 2]
        one, other = poses[c1, proposals.seeds[best, 1]], poses[c2, proposals.seeds[best, 3]]
        intersect_poses(cameras[c1], cameras[c2], one, other, settings.gate_sigma, body)
        fit_cameras(cameras, poses, body, settings, member, score)
        w = _find_worker(body, mean, tracked, vacant, unseen, settings)
        for c in range(n_cameras):
            if member[c] < 0:
                continue
            poses[c, member[c]].free = False
            if w >= 0 and chosen[c, w] < 0:
                chosen[c, w] = member[c]
        if w >= 0:
            if vacant[w]:
                mean[w] = np.nan
                for j in range(N_JOINTS):
                    if body.met[j]:
                        mean[w, j] = body.points[j]
            tracked[w], vacant[w], unseen[w] = True, False, False


@kernel(makes_arrays=True)
def _find_best(proposals: Proposals, poses: Records2[Pose], n: int) -> int:
    """Return the index of the proposed body that unassigned poses fit best, or -1 if there is none.

    Args:
        proposals: proposed bodies with the poses that fit them.
        poses: (C, D) poses of the cameras.
        n: number of proposals.
    """
    seeds, members, best, best_total = proposals.seeds, proposals.members, -1, 0.0
    for k in range(n):
        if not (poses[seeds[k, 0], seeds[k, 1]].free and poses[seeds[k, 2], seeds[k, 3]].free):
            continue
        total, n_views = 0.0, 0
        for c in range(poses.shape[0]):
            if members[k, c] >= 0 and poses[c, members[k, c]].free:
                total += proposals.scores[k, c]
                n_views += 1
        if n_views >= 2 and total > best_total:
            best, best_total = k, total
    return best


@kernel(makes_arrays=True)
def _find_worker(
    body: Body,
    mean: Points3,
    tracked: Bools,
    vacant: Bools,
    unseen: Bools,
    settings: AssociationSettings,
) -> int:
    """Return the index of the worker to which a body belongs, or -1 if there is none.

    This is the nearest tracked worker within `merge_distance_m`; otherwise the nearest tracked
    worker that no camera sees, within `rejoin_distance_m`; otherwise the slot without a track that
    has the nearest last estimate, so that people return to their slots.

    Args:
        body: the body.
        mean: (W, J, 3) joints of the workers [m].
        tracked: (W,) mask of the tracked workers.
        vacant: (W,) mask of the slots without a track.
        unseen: (W,) mask of the tracked workers that no camera sees.
        settings: settings that contain these distances.
    """
    distance = np.empty(len(tracked))
    for w in range(len(tracked)):
        distance[w] = _measure_distance(body, mean[w])
    nearest = _find_nearest(distance, tracked, settings.merge_distance_m)
    if nearest < 0:
        nearest = _find_nearest(distance, unseen, settings.rejoin_distance_m)
    return nearest if nearest >= 0 else _find_nearest(distance, vacant, np.inf)


@kernel(makes_arrays=True)
def _find_nearest(distance: Floats, among: Bools, limit: float) -> int:
    """Return the index of the nearest of some workers, or -1 if none is within the limit.

    Args:
        distance: (W,) distances [m].
        among: (W,) mask of the workers that may be chosen.
        limit: distance below which a worker may be chosen [m].
    """
    best = -1
    for w in range(len(distance)):
        if among[w] and distance[w] < limit:
            best, limit = w, distance[w]
    return best


@kernel(makes_arrays=True)
def _measure_distance(body: Body, mean: Points3) -> float:
    """Return the distance between a body and a worker (J, 3) [m]; infinite without common joints.

    The distance is measured between the mean positions of the joints that both have.
    """
    points, met = body.points, body.met
    n, dx, dy, dz = 0, 0.0, 0.0, 0.0
    for j in range(len(met)):
        if met[j] and np.isfinite(mean[j, 0]):
            n += 1
            dx += points[j, 0] - mean[j, 0]
            dy += points[j, 1] - mean[j, 1]
            dz += points[j, 2] - mean[j, 2]
    return np.sqrt(dx * dx + dy * dy + dz * dz) / n if n else np.inf
