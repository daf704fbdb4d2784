"""Textures: flat maps of a surface, rasters of what lies on them, and how they are stored."""

from collections.abc import Callable

import numpy as np
from PIL import Image
from scipy import ndimage
from surfaces import Surface, joined, normals, smooth, submesh

SHADE_ONE = 200
"""Value of the shade map that leaves a colour as it is."""


def cavity(surface: Surface, rounds: int) -> np.ndarray:
    """(V,) how deep each vertex lies under its smoothed surroundings [m]: creases positive."""
    away = smooth(surface.vertices, surface.faces, rounds) - surface.vertices
    return np.einsum("vi,vi->v", away, normals(surface.vertices, surface.faces))


def raster(
    uv: np.ndarray, faces: np.ndarray, values: np.ndarray, near: np.ndarray, shape: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray]:
    """Values (V, n) of a mesh's vertices drawn into its flat map; the largest `near` wins.

    Returns:
        (H, W, n) values, filled beyond the mesh's edge by the nearest ones, and (H, W) whether
        a triangle covers the texel.
    """
    height, width = shape
    image = np.zeros((height, width, values.shape[1]))
    depth = np.full(shape, -np.inf)
    pixel = uv * [width, height]
    for triangle in faces:
        p = pixel[triangle]
        low = np.maximum(np.floor(p.min(0)).astype(int), 0)
        high = np.minimum(np.ceil(p.max(0)).astype(int) + 1, [width, height])
        if np.any(high <= low):
            continue
        x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
        share = _barycentric(p, x, y)
        window = (slice(low[1], high[1]), slice(low[0], high[0]))
        here = share @ near[triangle]
        inside = (share.min(-1) >= -1e-3) & (here > depth[window])
        depth[window][inside] = here[inside]
        image[window][inside] = (share @ values[triangle])[inside]
    covered = np.isfinite(depth)
    nearest = ndimage.distance_transform_edt(~covered, return_distances=False, return_indices=True)
    return image[tuple(nearest)], covered


def _barycentric(p: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    (a, b), (c, d) = p[1] - p[0], p[2] - p[0]
    area = a * d - b * c
    if abs(area) < 1e-9:
        return np.full((*x.shape, 3), -1.0)
    dx, dy = x - p[0, 0], y - p[0, 1]
    second, third = (dx * d - dy * c) / area, (dy * a - dx * b) / area
    return np.stack([1 - second - third, second, third], -1)


def split(
    surface: Surface,
    side_of_face: np.ndarray,
    uv_of: Callable[[np.ndarray, np.ndarray], np.ndarray],
) -> tuple[Surface, np.ndarray]:
    """Cut a surface along the seam between two sides, so that each side has its own uv.

    Args:
        surface: what to cut.
        side_of_face: (F,) 0 or 1.
        uv_of: maps vertices (V, 3) and their side (V,) to uv (V, 2).
    """
    old, side = surface.faces.ravel(), np.repeat(side_of_face, 3)
    corner_uv = uv_of(surface.vertices[old], side)
    keys = np.column_stack([old, np.round(corner_uv * 65535)]).astype(int)
    _, first, faces = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    kept = old[first]
    cut = Surface(surface.vertices[kept], faces.reshape(-1, 3), surface.weights[kept])
    return cut, corner_uv[first]


def smooth_seam(
    surface: Surface,
    side_of_face: np.ndarray,
    uv_of: Callable[[np.ndarray, np.ndarray], np.ndarray],
    sink_m: float = 0.004,
) -> tuple[Surface, np.ndarray]:
    """Cut as `split` does, with hidden flaps that make the shading continuous across the seam.

    A renderer computes normals from the faces around a vertex; at a seam each side lacks the
    other's. So each side also gets the other's faces along the seam, with their far corners sunk
    under the surface where they are hidden.
    """
    on_side = [np.unique(surface.faces[side_of_face == side]) for side in (0, 1)]
    seam = np.intersect1d(*on_side)
    sunk = surface.vertices - sink_m * normals(surface.vertices, surface.faces)
    pieces, uvs = [], []
    for side in (0, 1):
        own = surface.faces[side_of_face == side]
        other = surface.faces[side_of_face != side]
        flaps = other[np.isin(other, seam).any(1)]
        shifted = flaps + np.where(np.isin(flaps, on_side[side]), 0, len(surface.vertices))
        both = Surface(
            np.vstack([surface.vertices, sunk]),
            np.vstack([own, shifted]),
            np.vstack([surface.weights, surface.weights]),
        )
        piece = submesh(both, np.ones(len(both.faces), bool))
        pieces.append(piece)
        uvs.append(uv_of(piece.vertices, np.full(len(piece.vertices), side)))
    return joined(*pieces), np.vstack(uvs)


def folds(shape: tuple[int, int], seed: int, scales: tuple[float, ...]) -> np.ndarray:
    """Smooth noise of unit deviation: the unevenness of cloth and skin."""
    rng = np.random.default_rng(seed)
    total = np.zeros(shape)
    for scale in scales:
        noise = ndimage.gaussian_filter(rng.normal(size=shape), scale)
        total += noise / noise.std()
    return total / total.std()


class Painting:
    """Layers of colour over each other, then a palette image."""

    def __init__(self, shape: tuple[int, int], colour: tuple[int, int, int]) -> None:
        self.image = np.empty((*shape, 3))
        self.image[:] = colour

    def lay(self, colour: tuple[float, ...] | np.ndarray, cover: np.ndarray) -> None:
        """Lay a colour over the image with opacity `cover` (H, W) in [0, 1]."""
        share = np.clip(np.asarray(cover, float), 0.0, 1.0)[..., None]
        self.image = self.image * (1 - share) + np.asarray(colour, float) * share

    def palette(self, n_colours: int) -> tuple[np.ndarray, np.ndarray]:
        """(n, 3) colours and (H, W) indices."""
        picture = Image.fromarray(np.clip(np.round(self.image), 0, 255).astype(np.uint8))
        reduced = picture.quantize(n_colours, method=Image.Quantize.MEDIANCUT, dither=0)
        # A second pass moves the palette to the means of what it paints (k-means).
        reduced = picture.quantize(n_colours, kmeans=4, dither=0)
        index = np.asarray(reduced, np.uint8)
        flat = self.image.reshape(-1, 3)
        count = np.bincount(index.ravel(), minlength=n_colours)
        sums = [np.bincount(index.ravel(), flat[:, i], n_colours) for i in range(3)]
        colours = np.stack(sums, -1) / np.maximum(count, 1)[:, None]
        return np.clip(np.round(colours), 0, 255).astype(np.uint8), index


def stored_shade(shade: np.ndarray, factor: int, step: int = 4) -> np.ndarray:
    """A shade map (1: no change) made coarser by `factor`, in steps, as uint8."""
    height, width = shade.shape
    coarse = shade.reshape(height // factor, factor, width // factor, factor).mean((1, 3))
    return (np.round(np.clip(coarse, 0.2, 1.27) * SHADE_ONE / step) * step).astype(np.uint8)


def stored_surface(name: str, surface: Surface, uv: np.ndarray, unit_m: float) -> dict:
    """A surface as small integers."""
    order = np.argsort(-surface.weights, 1)[:, :4]
    share = np.round(np.take_along_axis(surface.weights, order, 1) * 255).astype(int)
    share[:, 0] += 255 - share.sum(1)
    return {
        f"{name}_vertices": np.round(surface.vertices / unit_m).astype(np.int16),
        f"{name}_faces": surface.faces.astype(np.uint16),
        f"{name}_uv": np.round(np.clip(uv, 0, 1) * 65535).astype(np.uint16),
        f"{name}_weight_segment": order.astype(np.uint8),
        f"{name}_weight": share.astype(np.uint8),
    }


def band(value: np.ndarray, middle: float, half: float, soft: float) -> np.ndarray:
    """1 within `half` of `middle`, falling to 0 over `soft`."""
    return np.clip((half - np.abs(value - middle)) / soft + 0.5, 0.0, 1.0)


def above(value: np.ndarray | float, edge: np.ndarray | float, soft: float) -> np.ndarray:
    """0 under the edge, 1 above it, over `soft`."""
    return np.clip((np.asarray(value) - edge) / soft + 0.5, 0.0, 1.0)
