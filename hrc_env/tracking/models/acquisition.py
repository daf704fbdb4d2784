"""Finding a worker, and finding a joint again, from views that agree.

`seen` is `measurements.Seen`, `s` are `settings.Settings`.
"""

import math

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.geometry.triangulation import consensus_point
from hrc_env.tracking.tree.evidence import find_heading
from hrc_env.tracking.tree.state import STANDING_M

WIDEST_STD_M = 0.5
"""A triangulated joint that is less certain than this is no find [m]."""
_GUESS_STD_M, _GUESS_STD_WITHOUT_HEADING_M = 0.3, 0.6


@kernel(makes_arrays=True)
def find_body(seen, s, points, cov, found):
    """Find joints on which two views agree, and guess the others; whether there are enough.

    Fills points (J, 3), cov (J, 3, 3) and which joints were found (J,).
    """
    use = np.empty(len(seen.P), np.bool_)
    for j in range(len(points)):
        cov[j] = 1.0
        found[j] = _agreed_point(seen, j, s, points[j], cov[j], use) >= 2
    if keep_one_body(points, cov, found, s.body_radius_m) < s.acquire_min_joints:
        return False
    complete_body(points, cov, found)
    return True


@kernel(makes_arrays=True)
def find_again(seen, j, s, middle, point, cov):
    """Fill `point` (3,) and `cov` (3, 3) of joint j, if two views agree near the body's middle."""
    use = np.empty(len(seen.P), np.bool_)
    if _agreed_point(seen, j, s, point, cov, use) < 2:
        return False
    widest = max(cov[0, 0], cov[1, 1], cov[2, 2])
    return widest < WIDEST_STD_M**2 and distance(point, middle) < s.body_radius_m


@kernel(makes_arrays=True)
def _agreed_point(seen, j, s, point, cov, use):
    z, sigma, ok = seen.z[j], seen.sigma[j], seen.ok[j]
    return consensus_point(seen.P, z, sigma, ok, s.gate_sigma, point, cov, use)


@kernel(makes_arrays=True)
def keep_one_body(points, cov, found, radius):
    """Drop points that are too uncertain, or not near the others as a body's are; how many stay."""
    middle, n_found = np.empty(3), 0
    for j in range(len(points)):
        widest = max(cov[j, 0, 0], cov[j, 1, 1], cov[j, 2, 2])
        found[j] = found[j] and widest < WIDEST_STD_M**2
        n_found += found[j]
    if n_found == 0 or not middle_of(points, found, middle):
        return 0
    for j in range(len(points)):
        if found[j] and not distance(points[j], middle) < radius:
            found[j] = False
            n_found -= 1
    return n_found


@kernel(makes_arrays=True)
def middle_of(points, among, out):
    """Median of the points `among`, axis by axis; False if there is none."""
    values = np.empty(len(points))
    for i in range(3):
        n = 0
        for j in range(len(points)):
            if among[j]:
                values[n] = points[j, i]
                n += 1
        if n == 0:
            return False
        out[i] = np.median(values[:n])
    return True


@kernel
def distance(a, b):
    """Euclidean distance of two points."""
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@kernel(makes_arrays=True)
def complete_body(points, cov, found):
    """Guess the joints that were not found, from a standing body turned as the torso is."""
    cos, sin, known = find_heading(points, found[1] and found[2], found[7] and found[8])
    root, n_found = np.zeros(3), 0
    for j in range(len(points)):
        if found[j]:
            forward, left, up = STANDING_M[j]
            root[0] += points[j, 0] - (cos * forward - sin * left)
            root[1] += points[j, 1] - (sin * forward + cos * left)
            root[2] += points[j, 2] - up
            n_found += 1
    root /= n_found
    std = _GUESS_STD_M if known else _GUESS_STD_WITHOUT_HEADING_M
    for j in range(len(points)):
        if not found[j]:
            forward, left, up = STANDING_M[j]
            points[j, 0] = root[0] + cos * forward - sin * left
            points[j, 1] = root[1] + sin * forward + cos * left
            points[j, 2] = root[2] + up
            cov[j] = np.eye(3) * std**2
