"""People whom nobody follows yet: poses of several cameras that are one body.

Any two poses of two cameras are a proposal: where their joints' lines of sight meet is a body, if
enough of them meet and its bones are as long as bones are. Every other camera then says which of
its poses fits that body, and the proposal that the cameras fit best is a person. What one camera
alone has seen is nobody (after RapidPoseTriangulation, arXiv 2503.21692).

Kernels take one environment: cameras (C,) and poses (C, D) are records of `CAMERA` and `POSE`.
"""

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import BONE_LENGTH_M, BONES, N_JOINTS
from hrc_env.geometry.lines_of_sight import look, nearest_places
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.people.affinity import affinity, expect

MEETING_M = 0.03
"""Lines of sight may pass each other at this distance [m] for other reasons than noise."""
AGREEING_SHARE = 0.6
"""Of two poses' common joints so many must meet."""
SHORTEST, LONGEST, BONE_SLACK_M, GOOD_BONES = 0.5, 1.6, 0.08, 0.7
"""Shares of the population's length, and this much [m], that a bone may be; share of good ones."""
BODY_SLACK_M = 0.1
"""How far the body of two lines of sight may be from what other cameras see [m]."""


@kernel(makes_arrays=True)
def look_along(cameras, poses):
    """Fill in the lines of sight of free poses."""
    for c in range(poses.shape[0]):
        back = cameras[c].back
        for d in range(poses.shape[1]):
            pose = poses[c, d]
            for j in range(N_JOINTS):
                if pose.free and pose.ok[j]:
                    look(back, pose.px[j, 0], pose.px[j, 1], pose.sight[j])


@kernel(makes_arrays=True)
def meeting(camera_1, camera_2, pose_1, pose_2, gate_sigma, body):
    """Where the joints' lines of sight of two poses meet; how many do, 0 if too few.

    Lines meet within `gate_sigma` standard deviations. Fills body: points (J, 3), whether met (J,).
    """
    (points, met), ok_1, ok_2 = body, pose_1.ok, pose_2.ok
    n_common, n_met = 0, 0
    for j in range(len(points)):
        met[j] = False
        if not (ok_1[j] and ok_2[j]):
            continue
        if n_common - n_met > (1.0 - AGREEING_SHARE) * len(points):
            return 0  # the rest cannot make it good
        n_common += 1
        far_1, far_2, gap = nearest_places(
            camera_1.eye, pose_1.sight[j], camera_2.eye, pose_2.sight[j], points[j]
        )
        if not (far_1 > 0.0 and far_2 > 0.0):
            continue
        noise_1 = pose_1.sigma_px[j] * far_1 / camera_1.focal
        noise_2 = pose_2.sigma_px[j] * far_2 / camera_2.focal
        allowed = gate_sigma**2 * (noise_1**2 + noise_2**2 + MEETING_M**2)
        if gap < allowed and _ahead(camera_1.P, points[j]) and _ahead(camera_2.P, points[j]):
            met[j] = True
            n_met += 1
    return n_met if n_met >= AGREEING_SHARE * n_common else 0


@kernel(makes_arrays=True)
def _ahead(camera, point):
    return pixel_of(camera, point[0], point[1], point[2])[2] > NEAREST_DEPTH_M


@kernel(makes_arrays=True)
def has_good_bones(body):
    """Whether most bones between joints that met are as long as a person's."""
    (points, met), n, good = body, 0, 0
    for k in range(len(BONES)):
        i, j, length_m = BONES[k, 0], BONES[k, 1], BONE_LENGTH_M[k]
        if met[i] and met[j]:
            squared = ((points[i] - points[j]) ** 2).sum()
            least, most = SHORTEST * length_m - BONE_SLACK_M, LONGEST * length_m + BONE_SLACK_M
            n += 1
            good += max(least, 0.0) ** 2 < squared < most**2
    return n > 0 and good >= GOOD_BONES * n


@kernel(makes_arrays=True)
def fit_cameras(cameras, poses, body, s, member, score):
    """Which free pose of each camera fits a body best, and how well.

    Fills member (C,), the pose or -1, and score (C,), its affinity; `s` as in `association`.
    """
    points, met = body
    image, nothing = np.empty((len(points), 3)), np.zeros((len(points), 3, 3))
    for c in range(poses.shape[0]):
        member[c], score[c] = -1, 0.0
        expect(cameras[c].P, points, nothing, met, BODY_SLACK_M, image)
        for d in range(poses.shape[1]):
            if poses[c, d].free:
                fit = affinity(image, poses[c, d], s)
                if fit > score[c]:
                    member[c], score[c] = d, fit


@kernel(makes_arrays=True)
def propose(cameras, poses, s, proposals):
    """All bodies that two cameras propose; how many.

    Fills proposals: seeds (n, 4), the two cameras each with its pose, members and scores (n, C).
    """
    seeds, members, scores = proposals
    n_cameras, n_poses = poses.shape
    body, n = (np.empty((N_JOINTS, 3)), np.empty(N_JOINTS, np.bool_)), 0
    for c1 in range(n_cameras):
        for c2 in range(c1 + 1, n_cameras):
            for d1 in range(n_poses):
                for d2 in range(n_poses):
                    one, other = poses[c1, d1], poses[c2, d2]
                    if not (one.free and other.free):
                        continue
                    n_met = meeting(cameras[c1], cameras[c2], one, other, s.gate_sigma, body)
                    if n_met < s.min_joints or not has_good_bones(body):
                        continue
                    fit_cameras(cameras, poses, body, s, members[n], scores[n])
                    if members[n, c1] >= 0 and members[n, c2] >= 0:
                        seeds[n, 0], seeds[n, 1], seeds[n, 2], seeds[n, 3] = c1, d1, c2, d2
                        n += 1
    return n
