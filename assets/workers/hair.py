"""Hair with a shape of its own: a cap over the scalp, a bun or a ponytail behind it."""

from dataclasses import replace

import numpy as np
from anatomy import SEGMENTS, Person
from surfaces import Surface, decimated, grid_faces, head_surface, normals, smooth, submesh

CAP_M = {"short": 0.013, "bun": 0.010, "ponytail": 0.010}
"""How far the hair stands off the scalp, by style; a judgement, as is everything here."""
UNDER_HAT_M = 0.006
"""Distance of the hair from the scalp under a hat, which is 17 mm away."""
ROOT_M = -0.0015
"""At the hairline the cap dips under the skin, so that no edge shows."""
N_VERTICES = 320


def cap(person: Person, scalp: np.ndarray, style: str, hat: bool) -> Surface:
    """The scalp pushed out.

    Args:
        person: the worker.
        scalp: (V,) how much each vertex of `head_surface(person)` is scalp, in [0, 1].
        style: a key of `CAP_M`.
        hat: whether a hat is worn over it.
    """
    head = head_surface(person)
    eye_z = person.landmarks["left_eye"][2]
    inside = smooth(1.0 * (scalp[:, None] > 0.5), head.faces, 8)[:, 0]
    share = np.clip((inside - 0.35) / 0.5, 0.0, 1.0)
    higher = np.clip((head.vertices[:, 2] - eye_z) / 0.10, 0.0, 1.0)
    thick = UNDER_HAT_M if hat else CAP_M[style] * (0.55 + 0.45 * higher)
    even = smooth(head.vertices, head.faces, 3)
    out = even + (ROOT_M + thick * share)[:, None] * normals(even, head.faces)
    return decimated(
        submesh(replace(head, vertices=out), (inside > 0.3)[head.faces].all(1)), N_VERTICES
    )


def behind(person: Person, style: str, hat: bool) -> tuple[Surface, np.ndarray] | None:
    """A bun or a ponytail with its share along the strands (V,); None for other styles."""
    if style not in ("bun", "ponytail"):
        return None
    head = head_surface(person)
    ear = person.landmarks["left_ear"]
    height = ear[2] + (-0.030 if hat else 0.050)
    level = np.abs(head.vertices[:, 2] - height) < 0.012
    nape = np.array([head.vertices[level, 0].min(), 0.0, height])
    path, radius = _bun() if style == "bun" else _tail()
    rings = [_ring(path, radius, at) for at in range(len(path))]
    points = np.vstack(rings) + nape
    weights = np.zeros((len(points), len(SEGMENTS)))
    weights[:, SEGMENTS.index("head")] = 1.0
    along = np.repeat(np.linspace(0.0, 1.0, len(rings)), len(rings[0]))
    return Surface(points, grid_faces(len(rings), len(rings[0])), weights), along


def _bun() -> tuple[np.ndarray, np.ndarray]:
    """Axis (n, 3) and radius (n,) of a knot, backwards and a little up."""
    level = np.sin(np.linspace(-np.pi / 2, np.pi / 2, 9))
    axis = np.outer(0.012 + 0.030 * level, [-1.0, 0.0, 0.25])
    return axis, 0.037 * np.sqrt(np.maximum(1 - level**2, 0.0))


def _tail() -> tuple[np.ndarray, np.ndarray]:
    """Axis and radius of a short ponytail: back, then down."""
    t = np.linspace(0.0, 1.0, 10)
    back = np.interp(t, [0.0, 0.15, 0.4, 1.0], [0.0, -0.030, -0.052, -0.066])
    axis = np.stack([back, 0 * t, -0.15 * t**1.5], -1)
    radius = np.interp(t, [0, 0.08, 0.2, 0.5, 0.85, 1.0], [0.004, 0.014, 0.019, 0.024, 0.016, 0])
    return axis, radius


def _ring(path: np.ndarray, radius: np.ndarray, at: int, count: int = 12) -> np.ndarray:
    """Points round the path, in the plane across it (the path lies in y = 0)."""
    ahead = path[min(at + 1, len(path) - 1)] - path[max(at - 1, 0)]
    ahead = ahead / np.linalg.norm(ahead)
    across = np.cross(ahead, [0.0, 1.0, 0.0])
    angle = 2 * np.pi * np.arange(count) / count
    side = np.outer(np.cos(angle), [0.0, 1.0, 0.0]) + np.outer(np.sin(angle), across)
    return path[at] + radius[at] * side
