"""Detection of people without a track from the poses in several cameras.

Any two poses in two cameras propose a body, which consists of the points where the lines of sight
of their joints meet, if enough of them meet and the bones have plausible lengths. Each other camera
contributes the pose that fits the body best, and the proposal with the best total fit is considered
a person. A pose that only one camera sees is not (after RapidPoseTriangulation, arXiv 2503.21692).

All functions process one environment, with cameras (C,) and their poses (C, D).
"""

from typing import NamedTuple

import numpy as np

from hrc_env.core.declared import Records1, Records2
from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import BONE_LENGTH_M, BONES, N_JOINTS
from hrc_env.core.typing import Bools, Floats, Ints, Points3
from hrc_env.geometry.lines_of_sight import Camera, look, nearest_places
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.people.affinity import (
    AssociationSettings,
    Pose,
    compute_affinity,
    project_body,
)

MEETING_M = 0.03
"""Standard deviation of the gap between two lines of sight that is not due to pixel noise [m]."""
AGREEING_SHARE = 0.6
"""Minimum fraction of the joints common to two poses at which their lines of sight must meet."""
SHORTEST = 0.5
"""Minimum length of a plausible bone, relative to the population mean."""
LONGEST = 1.6
"""Maximum length of a plausible bone, relative to the population mean."""
BONE_SLACK_M = 0.08
"""Tolerance added to both limits of a bone's length [m]."""
GOOD_BONES = 0.7
"""Minimum fraction of a body's bones with lengths within the limits."""
BODY_SLACK_M = 0.1
"""Standard deviation of the joints of a body triangulated from two poses [m]. It is used to compare
the body with the poses in other cameras."""


class Body(NamedTuple):
    """A body triangulated from the poses in two cameras."""

    points: Points3
    """(J, 3) positions of the joints, where the lines of sight meet [m]."""
    met: Bools
    """(J,) mask of the joints at which the lines of sight meet; other positions are undefined."""


class Proposals(NamedTuple):
    """Arrays for up to N bodies proposed by pairs of cameras; the first rows are filled."""

    seeds: Ints
    """(N, 4) indices of the first camera, its pose, the second camera and its pose."""
    members: Ints
    """(N, C) index of each camera's pose that fits the body best; -1 if there is none."""
    scores: Floats
    """(N, C) affinity of each of these poses to the body."""


@kernel(makes_arrays=True)
def make_body() -> Body:
    """Return empty arrays for a body."""
    return Body(np.empty((N_JOINTS, 3)), np.empty(N_JOINTS, np.bool_))


@kernel(makes_arrays=True)
def make_proposals(n_cameras: int, n_poses: int) -> Proposals:
    """Return empty arrays for the proposals of all pairs of cameras with `n_poses` poses each."""
    n = n_cameras * (n_cameras - 1) // 2 * n_poses * n_poses
    members, scores = np.empty((n, n_cameras), np.int64), np.empty((n, n_cameras))
    return Proposals(np.empty((n, 4), np.int64), members, scores)


@kernel(makes_arrays=True)
def fill_sight_lines(cameras: Records1[Camera], poses: Records2[Pose]) -> None:
    """Fill in the lines of sight of the unassigned poses among `poses` (C, D)."""
    for c in range(poses.shape[0]):
        back = cameras[c].back
        for d in range(poses.shape[1]):
            pose = poses[c, d]
            for j in range(N_JOINTS):
                if pose.free and pose.ok[j]:
                    look(back, pose.px[j, 0], pose.px[j, 1], pose.sight[j])


@kernel(makes_arrays=True)
def intersect_poses(
    camera_1: Camera, camera_2: Camera, pose_1: Pose, pose_2: Pose, gate_sigma: float, body: Body
) -> int:
    """Compute the points where the lines of sight of two poses meet.

    Args:
        camera_1: the camera of the first pose.
        camera_2: the camera of the second pose.
        pose_1: the first pose, with its lines of sight.
        pose_2: the second pose, with its lines of sight.
        gate_sigma: gap up to which two lines meet, in standard deviations.
        body: the triangulated body, filled in.

    Returns:
        The number of joints at which the lines meet, or 0 if their fraction of the common joints is
        too small.
    """
    points, met, ok_1, ok_2 = body.points, body.met, pose_1.ok, pose_2.ok
    n_common, n_met = 0, 0
    for j in range(len(points)):
        met[j] = False
        if not (ok_1[j] and ok_2[j]):
            continue
        if n_common - n_met > (1.0 - AGREEING_SHARE) * len(points):
            return 0  # the remaining joints cannot suffice
        n_common += 1
        far_1, far_2, gap = nearest_places(
            camera_1.eye, pose_1.sight[j], camera_2.eye, pose_2.sight[j], points[j]
        )
        if not (far_1 > 0.0 and far_2 > 0.0):
            continue
        noise_1 = pose_1.sigma_px[j] * far_1 / camera_1.focal
        noise_2 = pose_2.sigma_px[j] * far_2 / camera_2.focal
        allowed = gate_sigma**2 * (noise_1**2 + noise_2**2 + MEETING_M**2)
        if gap < allowed and _is_ahead(camera_1.P, points[j]) and _is_ahead(camera_2.P, points[j]):
            met[j] = True
            n_met += 1
    return n_met if n_met >= AGREEING_SHARE * n_common else 0


@kernel(makes_arrays=True)
def _is_ahead(camera: Floats, point: Points3) -> bool:
    """Return whether a point (3,) [m] is in front of a camera (3, 4)."""
    return pixel_of(camera, point[0], point[1], point[2])[2] > NEAREST_DEPTH_M


@kernel(makes_arrays=True)
def has_good_bones(body: Body) -> bool:
    """Return whether enough bones between triangulated joints have plausible lengths."""
    points, met, n, good = body.points, body.met, 0, 0
    for k in range(len(BONES)):
        i: int = BONES[k, 0]
        j: int = BONES[k, 1]
        length_m = BONE_LENGTH_M[k]
        if met[i] and met[j]:
            squared = ((points[i] - points[j]) ** 2).sum()
            least, most = SHORTEST * length_m - BONE_SLACK_M, LONGEST * length_m + BONE_SLACK_M
            n += 1
            good += max(least, 0.0) ** 2 < squared < most**2
    return n > 0 and good >= GOOD_BONES * n


@kernel(makes_arrays=True)
def fit_cameras(
    cameras: Records1[Camera],
    poses: Records2[Pose],
    body: Body,
    settings: AssociationSettings,
    member: Ints,
    score: Floats,
) -> None:
    """Find the unassigned pose in each camera that fits a body best.

    Args:
        cameras: (C,) cameras.
        poses: (C, D) poses in each camera.
        body: the body.
        settings: settings that contain the gate and the area of the image.
        member: (C,) index of the pose, or -1 if there is none; filled in.
        score: (C,) affinity of the pose, filled in.
    """
    points = body.points
    image, no_cov = np.empty((len(points), 3)), np.zeros((len(points), 3, 3))
    for c in range(poses.shape[0]):
        member[c], score[c] = -1, 0.0
        project_body(cameras[c].P, points, no_cov, body.met, BODY_SLACK_M, image)
        for d in range(poses.shape[1]):
            if poses[c, d].free:
                fit = compute_affinity(image, poses[c, d], settings)
                if fit > score[c]:
                    member[c], score[c] = d, fit


@kernel(makes_arrays=True)
def propose_bodies(
    cameras: Records1[Camera],
    poses: Records2[Pose],
    settings: AssociationSettings,
    proposals: Proposals,
) -> int:
    """Fill in the bodies proposed by pairs of cameras, and return their number.

    Args:
        cameras: (C,) cameras.
        poses: (C, D) poses in each camera, with lines of sight.
        settings: settings of the assignment.
        proposals: arrays for all proposals, filled in.
    """
    seeds, members = proposals.seeds, proposals.members
    n_cameras, n_poses = poses.shape
    body, n = make_body(), 0
    for c1 in range(n_cameras):
        for c2 in range(c1 + 1, n_cameras):
            for d1 in range(n_poses):
                for d2 in range(n_poses):
                    one, other = poses[c1, d1], poses[c2, d2]
                    if not (one.free and other.free):
                        continue
                    n_met = intersect_poses(
                        cameras[c1], cameras[c2], one, other, settings.gate_sigma, body
                    )
                    if n_met < settings.min_joints or not has_good_bones(body):
                        continue
                    fit_cameras(cameras, poses, body, settings, members[n], proposals.scores[n])
                    if members[n, c1] >= 0 and members[n, c2] >= 0:
                        seeds[n, 0], seeds[n, 1], seeds[n, 2], seeds[n, 3] = c1, d1, c2, d2
                        n += 1
    return n
