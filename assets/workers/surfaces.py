"""The person's surfaces: bare skin, work clothes, hard hat, at a few thousand vertices."""

from dataclasses import dataclass, replace

import fast_simplification
import numpy as np
from anatomy import EYE_GROUPS, SEGMENTS, Person, crisp
from scipy import sparse
from scipy.spatial import cKDTree

PART = np.array([name.partition("_")[2] or name for name in SEGMENTS])
"""Segment names without their side (left_upper_arm: upper_arm)."""
PART[[SEGMENTS.index(f"{side}_upper_arm") for side in ("left", "right")]] = "upper_arm"

CLOTH_OFFSET_M = {
    "chest": 0.021, "torso": 0.021, "abdomen": 0.021, "clavicle": 0.018, "upper_arm": 0.014,
    "forearm": 0.012, "pelvis": 0.016, "thigh": 0.016, "shank": 0.017, "foot": 0.014,
    "toes": 0.016, "neck": 0.007, "head": 0.004, "hand": 0.006,
}  # fmt: skip
"""How far the clothes stand off the body; a judgement (a vest over a shirt, work trousers)."""


@dataclass(frozen=True)
class Surface:
    """A triangle mesh in the rest frame with skinning weights."""

    vertices: np.ndarray
    faces: np.ndarray
    weights: np.ndarray

    def parts(self) -> np.ndarray:
        """(V,) name of the part that each vertex mostly follows."""
        return PART[self.weights.argmax(1)]


def submesh(surface: Surface, keep_face: np.ndarray) -> Surface:
    """Only some faces, and only the vertices that they use."""
    used, faces = np.unique(surface.faces[keep_face], return_inverse=True)
    return Surface(surface.vertices[used], faces.reshape(-1, 3), surface.weights[used])


def joined(*surfaces: Surface) -> Surface:
    """Several surfaces as one, without welding."""
    starts = np.cumsum([0] + [len(surface.vertices) for surface in surfaces[:-1]])
    faces = [surface.faces + start for surface, start in zip(surfaces, starts, strict=True)]
    return Surface(
        np.vstack([surface.vertices for surface in surfaces]),
        np.vstack(faces),
        np.vstack([surface.weights for surface in surfaces]),
    )


def normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(V, 3) unit vertex normals, weighted by area."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    of_face = np.cross(b - a, c - a)
    total = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(total, faces[:, corner], of_face)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)


def averaging(faces: np.ndarray, count: int) -> sparse.csr_matrix:
    """(V, V) matrix that replaces a value by the mean of its neighbours'."""
    edges = np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    edges = np.unique(np.vstack([edges, edges[:, ::-1]]), axis=0)
    ones = sparse.coo_matrix((np.ones(len(edges)), edges.T), shape=(count, count)).tocsr()
    return sparse.diags(1 / np.maximum(np.asarray(ones.sum(1)).ravel(), 1)) @ ones


def smooth(values: np.ndarray, faces: np.ndarray, rounds: int, rate: float = 0.5) -> np.ndarray:
    """Laplacian smoothing of (V, n) values."""
    mean = averaging(faces, len(values))
    for _ in range(rounds):
        values = values + rate * (mean @ values - values)
    return values


def decimated(surface: Surface, n_vertices: int) -> Surface:
    """Quadric decimation; weights are carried over from the nearest old vertices."""
    reduction, points, faces = 1 - n_vertices / len(surface.vertices), None, None
    for _ in range(6):
        points, faces = fast_simplification.simplify(
            surface.vertices.astype(np.float32), surface.faces.astype(np.int32), reduction, agg=3
        )
        if len(points) <= n_vertices * 1.02:
            break
        reduction = 1 - (1 - reduction) * n_vertices / len(points)
    distance, nearest = cKDTree(surface.vertices).query(points, k=4)
    closeness = 1 / np.maximum(distance, 1e-5) ** 2
    closeness /= closeness.sum(1, keepdims=True)
    weights = np.einsum("vk,vks->vs", closeness, surface.weights[nearest])
    return Surface(points.astype(float), faces.astype(int), crisp(weights))


def whole(person: Person, group: str) -> Surface:
    """A face group of MakeHuman's mesh."""
    triangles = person.groups[group][0]
    everything = Surface(person.vertices, triangles, person.weights)
    return submesh(everything, np.ones(len(triangles), bool))


def head_surface(person: Person) -> Surface:
    """Head and neck down to under the collar, without the inside of the mouth."""
    triangles, corners = person.groups["body"]
    part = PART[person.weights.argmax(1)]
    throat = np.linalg.norm(person.vertices - person.origins[SEGMENTS.index("neck")], axis=1)
    keep = (np.isin(part, ("head", "neck")) | (throat < 0.085))[triangles].any(1)
    centre = person.corners[corners].mean(1)
    mouth = (centre[:, 0] > 0.75) & (centre[:, 0] < 0.95) & (centre[:, 1] < 0.16)
    everything = Surface(person.vertices, triangles, person.weights)
    return submesh(everything, keep & ~mouth)


def hand_surface(person: Person, side: str) -> Surface:
    """One bare hand up to under the cuff."""
    triangles = person.groups["body"][0]
    wrist = person.origins[SEGMENTS.index(f"{side}_hand")]
    hand = person.weights.argmax(1) == SEGMENTS.index(f"{side}_hand")
    hand |= np.linalg.norm(person.vertices - wrist, axis=1) < 0.05
    everything = Surface(person.vertices, triangles, person.weights)
    return submesh(everything, hand[triangles].any(1))


def eye_surface(person: Person, group: str) -> Surface:
    """The visible front of an eyeball."""
    eye = whole(person, group)
    front = eye.vertices[eye.faces].mean(1)[:, 0] > eye.vertices[:, 0].mean() - 0.001
    return submesh(eye, front)


def clothes(person: Person) -> Surface:
    """MakeHuman's tights, smoothed, pushed out, with boots that stand on the floor."""
    tights = whole(person, "helper-tights")
    part = tights.parts()
    foot = np.isin(part, ("foot", "toes"))
    soft = smooth(tights.vertices, tights.faces, 6)
    feet = smooth(tights.vertices, tights.faces, 9)
    vertices = np.where(foot[:, None], feet, soft)
    offset = np.array([CLOTH_OFFSET_M[name] for name in part])
    offset = smooth(offset[:, None], tights.faces, 4)
    vertices = vertices + offset * normals(vertices, tights.faces)
    vertices = _collar(_boots(vertices, foot), person.origins[SEGMENTS.index("neck")])
    return replace(tights, vertices=vertices)


def _neckline(ahead: np.ndarray, neck: np.ndarray) -> np.ndarray:
    """Height of the plane that cuts the clothes at the neck; it rises to the back."""
    return neck[2] + 0.014 - 0.34 * ahead


def collar(person: Person) -> Surface:
    """A standing collar round the neck, over the edge of the clothes."""
    neck = person.origins[SEGMENTS.index("neck")]
    bare = np.unique(person.groups["body"][0])
    body = person.vertices[bare]
    away = body - neck
    over = away[:, 2] + neck[2] - _neckline(away[:, 0], neck)
    throat = np.flatnonzero((over > 0.002) & (over < 0.022) & (np.hypot(*away[:, :2].T) < 0.09))
    middle = away[throat, 0].mean()
    turn = np.arctan2(away[throat, 1], away[throat, 0] - middle)
    far = np.hypot(away[throat, 1], away[throat, 0] - middle)
    angle = _around(32)
    near = np.abs((turn - angle[:, None] + np.pi) % (2 * np.pi) - np.pi) < 0.25
    radius = np.where(near, far, 0.0).max(1)
    radius = (np.roll(radius, 1) + 2 * radius + np.roll(radius, -1)) / 4
    rings = []
    for out, up in ((0.006, -0.026), (0.008, -0.006), (0.006, 0.010), (0.003, 0.012), (-0.01, 0.0)):
        x = middle + (radius + out) * np.cos(angle)
        y = (radius + out) * np.sin(angle)
        rings.append(np.stack([neck[0] + x, y, _neckline(x, neck) + up], -1))
    points = np.vstack(rings)
    nearest = bare[throat[cKDTree(body[throat]).query(points)[1]]]
    faces = grid_faces(len(rings), len(angle))[:, ::-1]
    return Surface(points, faces, person.weights[nearest])


def _collar(vertices: np.ndarray, neck: np.ndarray) -> np.ndarray:
    """Cut the neckline, and let the clothes stand open there."""
    out = vertices.copy()
    ahead = vertices[:, 0] - neck[0]
    edge = _neckline(ahead, neck)
    out[:, 2] = np.minimum(vertices[:, 2], edge)
    near = np.clip(1 - (edge - vertices[:, 2]) / 0.05, 0, 1) * (vertices[:, 2] > neck[2] - 0.06)
    outward = np.stack([ahead + 0.015, vertices[:, 1], np.zeros(len(vertices))], -1)
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-6)
    return out + 0.004 * near[:, None] * outward


def _boots(vertices: np.ndarray, foot: np.ndarray) -> np.ndarray:
    """Flat soles: everything of the boot under 12 mm above its lowest point becomes sole."""
    low = vertices[foot, 2].min()
    out = vertices.copy()
    out[foot, 2] = np.where(vertices[foot, 2] < low + 0.016, low, vertices[foot, 2])
    return out


def eye_centre(person: Person) -> np.ndarray:
    """Centre of the left eyeball."""
    eye = whole(person, EYE_GROUPS[0]).vertices
    return (eye.min(0) + eye.max(0)) / 2


def hard_hat(person: Person, head: Surface) -> tuple[np.ndarray, np.ndarray]:
    """A helmet with ridge, rim and peak, in the rest frame: vertices (V, 3), faces (F, 3)."""
    eye = eye_centre(person)
    skull = head.vertices[head.vertices[:, 2] > eye[2] + 0.03]
    centre_x = (skull[:, 0].min() + skull[:, 0].max()) / 2
    half = np.array([np.ptp(skull[:, 0]) / 2 + 0.017, np.ptp(skull[:, 1]) / 2 + 0.017])
    base = eye[2] + 0.050
    height = skull[:, 2].max() + 0.024 - base
    rings = [_dome_ring(level, half, height) for level in np.linspace(1.0, 0.0, 10)]
    rim = ((0.004, 0.004), (0.012, 0.008), (0.0135, 0.0105), (0.012, 0.013), (-0.020, 0.010))
    rings += [_rim_ring(half, out, drop) for out, drop in rim]
    points = np.vstack(rings)
    pitch = np.radians(-5.0)
    turn = np.array(
        [[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]]
    )
    return points @ turn.T + [centre_x, 0.0, base], grid_faces(len(rings), len(rings[0]))


def _around(count: int = 40) -> np.ndarray:
    return 2 * np.pi * np.arange(count) / count


def _dome_ring(level: float, half: np.ndarray, height: float) -> np.ndarray:
    """A ring of the shell at `level` (1 top, 0 rim): superellipsoid with a raised mid ridge."""
    angle = _around()
    lift = np.sin(level * np.pi / 2)
    radius = max((1 - lift**2.5) ** (1 / 2.2), 1e-3)
    x, y = half[0] * np.cos(angle) * radius, half[1] * np.sin(angle) * radius
    ridge = 0.004 * np.exp(-((y / 0.024) ** 2)) * np.sin(np.pi * min(level * 1.6, 1.0) / 2)
    return np.stack([x, y, height * lift + ridge], -1)


def _rim_ring(half: np.ndarray, out: float, drop: float) -> np.ndarray:
    """A ring of the rim, `out` beyond the shell, longer in front (the peak)."""
    angle = _around()
    peak = np.maximum(np.cos(angle), 0) ** 1.5 * np.clip(out / 0.012, 0, 1.1)
    x = (half[0] + out + 0.036 * peak) * np.cos(angle)
    y = (half[1] + out) * np.sin(angle)
    return np.stack([x, y, -drop - 0.012 * peak], -1)


def grid_faces(n_rings: int, n_around: int) -> np.ndarray:
    """Triangles (F, 3) between rings of as many points, one after the other."""
    ring, column = np.meshgrid(np.arange(n_rings - 1), np.arange(n_around), indexing="ij")
    a = (ring * n_around + column).ravel()
    b = (ring * n_around + (column + 1) % n_around).ravel()
    return np.vstack(
        [np.stack([a, a + n_around, b], -1), np.stack([b, a + n_around, b + n_around], -1)]
    )
