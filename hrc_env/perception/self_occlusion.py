"""Which joints a worker's body hides from a camera.

A joint lies inside the body, and so do the ends of the capsules that meet there; a test of
the bare line of sight would hide every joint. What counts is how much of one capsule the
line passes through: a joint is hidden where that is much more than the way from the
capsule's axis to its surface.
"""

import math

import numba

BLOCKING_CHORD = 1.4
"""A line that runs through a capsule for more than this many of its radii is blocked: it
then passes the axis within 0.7 radii."""

OWN_CAPSULE_M = 0.06
"""So much longer may the way out of a capsule be that the joint itself lies in [m]."""


@numba.njit(cache=True, nogil=True, error_model="numpy")
def bounding_spheres(capsules, radius, centre, reach):
    """Middles (n, 3) and radii (n,) of spheres round capsules (n, 2, 3), in place."""
    for k in range(len(capsules)):
        squared = 0.0
        for i in range(3):
            centre[k, i] = 0.5 * (capsules[k, 0, i] + capsules[k, 1, i])
            squared += (capsules[k, 1, i] - capsules[k, 0, i]) ** 2
        reach[k] = 0.5 * math.sqrt(squared) + radius[k]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def hidden_by_capsules(eye, joint, capsules, radius, centre, reach):
    """Whether any capsule blocks the sight of a joint (3,) from an eye (3,) [m]."""
    dx, dy, dz = joint[0] - eye[0], joint[1] - eye[1], joint[2] - eye[2]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    if length < 1e-9:
        return False
    dx, dy, dz = dx / length, dy / length, dz / length
    for k in range(len(capsules)):
        cx, cy, cz = centre[k, 0] - eye[0], centre[k, 1] - eye[1], centre[k, 2] - eye[2]
        along = cx * dx + cy * dy + cz * dz
        if along < -reach[k] or along > length + reach[k]:
            continue
        if cx * cx + cy * cy + cz * cz - along * along > reach[k] * reach[k]:
            continue
        first, last = _passage(eye, dx, dy, dz, capsules[k, 0], capsules[k, 1], radius[k])
        within = first < length and last >= length
        chord = min(last, length) - max(first, 0.0)
        if chord > BLOCKING_CHORD * radius[k] + (OWN_CAPSULE_M if within else 0.0):
            return True
    return False


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _passage(eye, dx, dy, dz, p, q, radius):
    """Where a line enters and leaves a capsule [m from the eye]; entry beyond exit if never.

    A capsule is convex, so that its parts (two spheres, a cylinder) give one interval.
    """
    ax, ay, az = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    px, py, pz = eye[0] - p[0], eye[1] - p[1], eye[2] - p[2]
    qx, qy, qz = eye[0] - q[0], eye[1] - q[1], eye[2] - q[2]
    rr = radius * radius
    first, last = math.inf, -math.inf
    nearest = -(px * dx + py * dy + pz * dz)
    room = rr - (px * px + py * py + pz * pz - nearest * nearest)
    if room > 0.0:
        half = math.sqrt(room)
        first, last = nearest - half, nearest + half
    nearest = -(qx * dx + qy * dy + qz * dz)
    room = rr - (qx * qx + qy * qy + qz * qz - nearest * nearest)
    if room > 0.0:
        half = math.sqrt(room)
        first, last = min(first, nearest - half), max(last, nearest + half)
    aa = ax * ax + ay * ay + az * az
    ad = ax * dx + ay * dy + az * dz
    ap = ax * px + ay * py + az * pz
    k = aa - ad * ad
    if k < 1e-9 * aa or aa < 1e-12:  # a sphere, or seen end on: the ends have said it all
        return first, last
    b = aa * (px * dx + py * dy + pz * dz) - ap * ad
    c = aa * (px * px + py * py + pz * pz - rr) - ap * ap
    discriminant = b * b - k * c
    if discriminant <= 0.0:
        return first, last
    root = math.sqrt(discriminant)
    enter, leave = (-b - root) / k, (-b + root) / k
    if abs(ad) > 1e-9:
        one, other = -ap / ad, (aa - ap) / ad
        enter, leave = max(enter, min(one, other)), min(leave, max(one, other))
    elif ap < 0.0 or ap > aa:
        return first, last
    if enter < leave:
        first, last = min(first, enter), max(last, leave)
    return first, last
