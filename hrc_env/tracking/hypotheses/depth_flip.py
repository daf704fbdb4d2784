"""Bodies that one view can hardly tell from another: reflected in depth, whole or in part.

A camera sees a limb in front of its joint as it sees it behind (the bas-relief ambiguity): the
joints keep their rays, and their depths are reflected in the depth of a pivot. These are
starting points for a search; bones, places on the body and motion decide what becomes of them.
"""

import numpy as np

from hrc_env.core.kernels import kernel
from hrc_env.core.skeleton import N_JOINTS, TORSO
from hrc_env.core.typing import Bools
from hrc_env.geometry.lines_of_sight import eye_of

_PARTS: tuple[tuple[tuple[int, ...], tuple[int, ...]], ...] = (
    (tuple(int(j) for j in TORSO), tuple(range(N_JOINTS))),  # the whole body
    ((1,), (3, 5)), ((2,), (4, 6)),  # arms
    ((3,), (5,)), ((4,), (6,)),  # forearms
    ((7,), (9, 11, 13)), ((8,), (10, 12, 14)),  # legs
    ((9,), (11, 13)), ((10,), (12, 14)),  # shanks
    ((1, 2), (0,)),  # head
)  # fmt: skip
"""Joints whose mean is the pivot, and joints that are reflected."""


def _table(which: int) -> Bools:
    table = np.zeros((len(_PARTS), N_JOINTS), bool)
    for row, part in enumerate(_PARTS):
        table[row, list(part[which])] = True
    return table


_PIVOT, _MOVED = _table(0), _table(1)
N_MIRRORS = len(_PARTS)
WHOLE_BODY = 0
"""The row that reflects the whole body; the others reflect limbs."""
_MOST_SEEN_TWICE = 2
"""So many joints of a whole body may be seen twice, and it may still be mirrored."""


@kernel
def lone_camera(part, ok):
    """The camera that alone sees a part of the body, of which `ok` (J, C) is seen, or -1."""
    n_cameras, seen_twice, best, most = ok.shape[1], 0, -1, 0
    for c in range(n_cameras):
        n = 0
        for j in range(len(ok)):
            n += _MOVED[part, j] and ok[j, c]
        if n > most:
            best, most = c, n
    for j in range(len(ok)):
        n_views = 0
        for c in range(n_cameras):
            n_views += ok[j, c]
        seen_twice += _MOVED[part, j] and n_views > 1
    return best if seen_twice <= (_MOST_SEEN_TWICE if part == WHOLE_BODY else 0) else -1


@kernel(makes_arrays=True)
def open_depth(part, camera, body, cov):
    """How little is known of a part's depth from a camera (3, 4), for a body (J, 6), cov (J, 6, 6)
    [m]: the least standard deviation along its ray of any joint of the part.
    """
    eye, ray, least = eye_of(camera), np.empty(3), np.inf
    for j in range(len(body)):
        if not _MOVED[part, j]:
            continue
        variance, square = 0.0, 0.0
        for i in range(3):
            ray[i] = body[j, i] - eye[i]
            square += ray[i] * ray[i]
        for i in range(3):
            for k in range(3):
                variance += ray[i] * cov[j, i, k] * ray[k]
        least = min(least, variance / square)
    return np.sqrt(max(least, 0.0))


@kernel(makes_arrays=True)
def reflect(part, camera, body, out):
    """Positions (J, 3) of a body (J, 6) whose `part` is reflected along a camera's rays.

    False where that would bring a joint to the camera or behind it.
    """
    eye, middle, n = eye_of(camera), np.zeros(3), 0
    for j in range(len(body)):
        for i in range(3):
            out[j, i] = body[j, i]
            middle[i] += body[j, i] if _PIVOT[part, j] else 0.0
        n += _PIVOT[part, j]
    for i in range(3):
        middle[i] = middle[i] / n - eye[i]
    away = np.sqrt(middle[0] ** 2 + middle[1] ** 2 + middle[2] ** 2)
    for j in range(len(body)):
        if not _MOVED[part, j]:
            continue
        along = 0.0
        for i in range(3):
            along += (body[j, i] - eye[i]) * middle[i] / away
        if not (along > 0.0 and 2.0 * away - along > 0.2):
            return False
        for i in range(3):
            out[j, i] = eye[i] + (body[j, i] - eye[i]) * (2.0 * away - along) / along
    return True
