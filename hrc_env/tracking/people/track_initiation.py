"""People whom nobody follows yet: poses of several cameras that are one body.

Any two poses of two cameras are a proposal: where their joints' lines of sight meet is a body, if
enough of them meet and its bones are as long as bones are. Every other camera then says which of
its poses fits that body, and the proposal that the cameras fit best is a person. What one camera
alone has seen is nobody (after RapidPoseTriangulation, arXiv 2503.21692).

Kernels take one environment: cameras (C,) and poses (C, D) are records of `CAMERA` and `POSE`.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import BONE_LENGTH_M, BONES, N_JOINTS
from hrc_env.geometry.triangulation import NEAREST_DEPTH_M, pixel_of
from hrc_env.tracking.people.affinity import affinity, expect

MEETING_M = 0.03
"""Lines of sight may pass each other at this distance [m] for other reasons than noise."""
MIN_CROSSING = 0.1
"""Sine of the smallest angle between two lines that fixes a point."""
AGREEING_SHARE = 0.6
"""Of two poses' common joints so many must meet."""
SHORTEST, LONGEST, BONE_SLACK_M, GOOD_BONES = 0.5, 1.6, 0.08, 0.7
"""Shares of the population's length, and this much [m], that a bone may be; share of good ones."""
BODY_SLACK_M = 0.1
"""How far the body of two lines of sight may be from what other cameras see [m]."""
CAMERA = np.dtype(
    [
        # projection, rays from pixels; optical centre [m]; focal length [px]
        ("P", "f8", (3, 4)), ("back", "f8", (3, 3)), ("eye", "f8", (3,)), ("focal", "f8"),
    ],
    align=True,
)  # fmt: skip
"""A camera of the rig."""


@kernel(makes_arrays=True)
def model_cameras(P, cameras):
    """Fill cameras (C,) in from their projections P (C, 3, 4)."""
    for c in range(len(P)):
        a, inverse = P[c, :, :3].copy(), cameras[c].back
        for i in range(3):
            k, m = (i + 1) % 3, (i + 2) % 3
            for n in range(3):
                p, q = (n + 1) % 3, (n + 2) % 3
                inverse[n, i] = a[k, p] * a[m, q] - a[k, q] * a[m, p]
        inverse /= a[0, 0] * inverse[0, 0] + a[0, 1] * inverse[1, 0] + a[0, 2] * inverse[2, 0]
        for i in range(3):
            cameras[c].eye[i] = -(
                inverse[i, 0] * P[c, 0, 3] + inverse[i, 1] * P[c, 1, 3] + inverse[i, 2] * P[c, 2, 3]
            )
        along = (a[0] * a[2]).sum()
        cameras[c].focal = math.sqrt(max((a[0] * a[0]).sum() - along * along, 1e-12))
        cameras[c].P[:] = P[c]


@kernel(makes_arrays=True)
def look_along(cameras, poses):
    """Fill in the lines of sight of free poses."""
    for c in range(poses.shape[0]):
        back = cameras[c].back
        for d in range(poses.shape[1]):
            pose = poses[c, d]
            for j in range(N_JOINTS):
                if not (pose.free and pose.ok[j]):
                    continue
                u, v, length = pose.px[j, 0], pose.px[j, 1], 0.0
                for i in range(3):
                    along = back[i, 0] * u + back[i, 1] * v + back[i, 2]
                    pose.sight[j, i] = along
                    length += along * along
                for i in range(3):
                    pose.sight[j, i] /= math.sqrt(length)


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
        far_1, far_2, gap = _nearest_places(
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
def _nearest_places(eye_1, ray_1, eye_2, ray_2, middle):
    """Distances along two lines to where they pass each other, their squared gap; the middle."""
    cosine, a, b = 0.0, 0.0, 0.0
    for i in range(3):
        between = eye_2[i] - eye_1[i]
        cosine += ray_1[i] * ray_2[i]
        a += between * ray_1[i]
        b += between * ray_2[i]
    crossing = 1.0 - cosine * cosine
    if crossing < MIN_CROSSING**2:
        return -1.0, -1.0, np.inf
    far_1, far_2, gap = (a - b * cosine) / crossing, (a * cosine - b) / crossing, 0.0
    for i in range(3):
        first, second = eye_1[i] + far_1 * ray_1[i], eye_2[i] + far_2 * ray_2[i]
        middle[i] = 0.5 * (first + second)
        gap += (first - second) ** 2
    return far_1, far_2, gap


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
