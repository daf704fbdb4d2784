"""People whom nobody follows yet: poses of several cameras that are one body.

Any two poses of two cameras are a proposal: where their joints' lines of sight meet is a body,
if enough of them meet and its bones are as long as bones are. Every other camera then says
which of its poses fits that body, and the proposal that the cameras fit best is a person. What
one camera alone has seen is nobody. (After the pairs of RapidPoseTriangulation, arXiv
2503.21692.)

Kernels take one environment: z (C, D, J, 2), sigma, ok (C, D, J), and free (C, D), whether a
pose is still nobody's.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
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


@kernel(makes_arrays=True)
def camera_model(P, eye, back, focal):
    """Optical centres (C, 3), rays from pixels (C, 3, 3) and focal lengths (C,) of P (C, 3, 4)."""
    for c in range(len(P)):
        a, inverse = P[c, :, :3].copy(), back[c]
        for i in range(3):
            k, m = (i + 1) % 3, (i + 2) % 3
            for n in range(3):
                p, q = (n + 1) % 3, (n + 2) % 3
                inverse[n, i] = a[k, p] * a[m, q] - a[k, q] * a[m, p]
        inverse /= a[0, 0] * inverse[0, 0] + a[0, 1] * inverse[1, 0] + a[0, 2] * inverse[2, 0]
        for i in range(3):
            eye[c, i] = -(
                inverse[i, 0] * P[c, 0, 3] + inverse[i, 1] * P[c, 1, 3] + inverse[i, 2] * P[c, 2, 3]
            )
        along = (a[0] * a[2]).sum()
        focal[c] = math.sqrt(max((a[0] * a[0]).sum() - along * along, 1e-12))


@kernel(makes_arrays=True)
def lines_of_sight(back, z, ok, free, sight):
    """Unit directions (C, D, J, 3) of the joints of free poses, into `sight`."""
    n_cameras, n_poses, n_joints = ok.shape
    for c in range(n_cameras):
        for d in range(n_poses):
            for j in range(n_joints):
                if not (free[c, d] and ok[c, d, j]):
                    continue
                u, v, length = z[c, d, j, 0], z[c, d, j, 1], 0.0
                for i in range(3):
                    along = back[c, i, 0] * u + back[c, i, 1] * v + back[c, i, 2]
                    sight[c, d, j, i] = along
                    length += along * along
                for i in range(3):
                    sight[c, d, j, i] /= math.sqrt(length)


@kernel(makes_arrays=True)
def meeting(camera_1, camera_2, pose_1, pose_2, gate_sigma, points, met):
    """Where the joints' lines of sight of two poses meet; how many do, 0 if too few.

    Args:
        camera_1, camera_2: (eye (3,), focal, P (3, 4)) of `camera_model`.
        pose_1, pose_2: (lines of sight (J, 3), sigma (J,), ok (J,)).
        gate_sigma: lines meet within so many standard deviations.
        points, met: (J, 3) and (J,), filled.
    """
    (eye_1, focal_1, P_1), (eye_2, focal_2, P_2) = camera_1, camera_2
    (sight_1, sigma_1, ok_1), (sight_2, sigma_2, ok_2) = pose_1, pose_2
    n_common, n_met = 0, 0
    for j in range(len(points)):
        met[j] = False
        if not (ok_1[j] and ok_2[j]):
            continue
        if n_common - n_met > (1.0 - AGREEING_SHARE) * len(points):
            return 0  # the rest cannot make it good
        n_common += 1
        far_1, far_2, gap = _nearest_places(eye_1, sight_1[j], eye_2, sight_2[j], points[j])
        if not (far_1 > 0.0 and far_2 > 0.0):
            continue
        noise_1, noise_2 = sigma_1[j] * far_1 / focal_1, sigma_2[j] * far_2 / focal_2
        allowed = gate_sigma**2 * (noise_1**2 + noise_2**2 + MEETING_M**2)
        if gap < allowed and _ahead(P_1, points[j]) and _ahead(P_2, points[j]):
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
def has_good_bones(points, met, bones, length_m):
    """Whether most bones between joints that met are as long as a person's."""
    n, good = 0, 0
    for k in range(len(bones)):
        i, j = bones[k, 0], bones[k, 1]
        if met[i] and met[j]:
            squared = ((points[i] - points[j]) ** 2).sum()
            n += 1
            good += (
                max(SHORTEST * length_m[k] - BONE_SLACK_M, 0.0) ** 2
                < squared
                < (LONGEST * length_m[k] + BONE_SLACK_M) ** 2
            )
    return n > 0 and good >= GOOD_BONES * n


@kernel(makes_arrays=True)
def fit_cameras(P, poses, free, body, tables, s, member, score):
    """Which free pose of each camera fits a body best, and how well; their total.

    Args:
        P: (C, 3, 4).
        poses: (z, sigma, ok) of all cameras.
        free: (C, D).
        body: (points (J, 3), met (J,)).
        tables: (mirror, bones, bone lengths).
        s: settings.
        member, score: (C,) filled: the pose or -1, and its affinity.
    """
    (z, sigma, ok), (points, met), total = poses, body, 0.0
    image, nothing = np.empty((len(points), 3)), np.zeros((len(points), 3, 3))
    for c in range(len(P)):
        member[c], score[c] = -1, 0.0
        expect(P[c], points, nothing, met, BODY_SLACK_M, image)
        for d in range(free.shape[1]):
            if free[c, d]:
                fit = affinity(
                    image, z[c, d], sigma[c, d], ok[c, d], tables[0], s.gate_sigma, s.image_area_px
                )
                if fit > score[c]:
                    member[c], score[c] = d, fit
        total += score[c]
    return total


@kernel(makes_arrays=True)
def propose(rig, poses, sight, free, tables, s, seeds, members, scores):
    """All bodies that two cameras propose: seeds (n, 4), members, scores (n, C); how many."""
    (P, eye, _, focal), (_, sigma, ok) = rig, poses
    n_cameras, n_poses, n_joints = ok.shape
    points, met, n = np.empty((n_joints, 3)), np.empty(n_joints, np.bool_), 0
    for c1 in range(n_cameras):
        for c2 in range(c1 + 1, n_cameras):
            camera_1 = (eye[c1], focal[c1], P[c1])
            camera_2 = (eye[c2], focal[c2], P[c2])
            for d1 in range(n_poses):
                for d2 in range(n_poses):
                    if not (free[c1, d1] and free[c2, d2]):
                        continue
                    pose_1 = (sight[c1, d1], sigma[c1, d1], ok[c1, d1])
                    pose_2 = (sight[c2, d2], sigma[c2, d2], ok[c2, d2])
                    n_met = meeting(camera_1, camera_2, pose_1, pose_2, s.gate_sigma, points, met)
                    if n_met < s.min_joints or not has_good_bones(points, met, *tables[1:]):
                        continue
                    body = (points, met)
                    fit_cameras(P, poses, free, body, tables, s, members[n], scores[n])
                    if members[n, c1] >= 0 and members[n, c2] >= 0:
                        seeds[n, 0], seeds[n, 1], seeds[n, 2], seeds[n, 3] = c1, d1, c2, d2
                        n += 1
    return n
